//! Axes: which interval is shown, on which scale, with which ticks.
//!
//! Ticks are at 1, 2 or 5 times a power of ten (Heckbert, "Nice numbers for graph labels", Graphics
//! Gems, 1990). Invariants: the interval is finite and not empty, whatever the data; ticks increase,
//! lie inside the interval and have labels that differ; [`Axis::fraction`] is finite or `None`.

/// Values of larger magnitude are not shown: the quotient of two could overflow.
const LARGEST: f64 = 1e150;
/// Values of smaller magnitude are taken as zero, for the same reason.
const SMALLEST: f64 = 1e-150;
/// Below this ratio of the largest to the smallest value, a logarithmic scale shows nothing more.
const LOGARITHMIC_FROM: f64 = 8.0;
/// How far the interval reaches beyond the data, as a fraction of its length.
const MARGIN: f64 = 0.04;
/// Values that differ by less, relative to their magnitude, cannot have ticks of their own.
const RELATIVE_RESOLUTION: f64 = 1e-9;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Scale {
    Linear,
    Logarithmic,
}

/// A round number on an axis.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tick {
    pub(crate) value: f64,
    pub(crate) label: String,
}

/// An interval with a scale and ticks.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    low: f64,
    high: f64,
    scale: Scale,
    ticks: Vec<Tick>,
}

impl Axis {
    /// The axis on which `values` are told apart best: logarithmic if they are positive, spread
    /// over about a decade or more, and their median then lies nearer to the middle. Values that
    /// are not finite are left out.
    pub(crate) fn fitting(values: impl IntoIterator<Item = f64>) -> Axis {
        let mut shown: Vec<f64> = values.into_iter().filter_map(plottable).collect();
        shown.sort_by(f64::total_cmp);
        // How often a value occurs does not matter: a search that stays where it found something
        // should not change the scale.
        shown.dedup();
        let (Some(&low), Some(&high)) = (shown.first(), shown.last()) else {
            return Axis::linear(0.0, 1.0, 0.0);
        };
        let median = shown[shown.len() / 2];
        if low > 0.0 && high / low >= LOGARITHMIC_FROM && is_skewed(low, median, high) {
            let margin = (high / low).powf(MARGIN);
            return Axis::logarithmic(low / margin, high * margin);
        }
        // Between whole numbers, such as numbers of frames, there is nothing to mark.
        let whole = shown.iter().all(|value| value.fract() == 0.0);
        let smallest_step = if whole { 1.0 } else { 0.0 };
        let magnitude = low.abs().max(high.abs());
        if high - low <= magnitude * RELATIVE_RESOLUTION {
            let margin = if magnitude == 0.0 {
                1.0
            } else {
                0.1 * magnitude
            };
            return Axis::linear(padded(low, margin), high + margin, smallest_step);
        }
        let margin = MARGIN * (high - low);
        Axis::linear(padded(low, margin), high + margin, smallest_step)
    }

    /// The linear axis from zero to the largest of `values`: lengths of bars are comparable.
    pub(crate) fn from_zero(values: impl IntoIterator<Item = f64>) -> Axis {
        let high = values.into_iter().filter_map(plottable).fold(0.0, f64::max);
        let high = if high == 0.0 { 1.0 } else { high };
        Axis::linear(0.0, high, 0.0)
    }

    /// The logarithmic axis over whole decades around the positive ones of `values`.
    pub(crate) fn decades(values: impl IntoIterator<Item = f64>) -> Axis {
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for value in values.into_iter().filter_map(plottable) {
            if value > 0.0 {
                (low, high) = (low.min(value), high.max(value));
            }
        }
        if high == 0.0 {
            (low, high) = (1.0, 1.0);
        }
        let first = low.log10().floor() as i32;
        let last = (high.log10().ceil() as i32).max(first + 1);
        Axis::logarithmic(10f64.powi(first), 10f64.powi(last))
    }

    /// The same axis with ticks at `values`, in place of round numbers.
    pub(crate) fn with_ticks_at(mut self, ticks: Vec<Tick>) -> Axis {
        self.ticks = ticks;
        self
    }

    /// Position of `value`: 0 at the lower end, 1 at the upper. `None` if it has none.
    pub(crate) fn fraction(&self, value: f64) -> Option<f64> {
        let value = plottable(value)?;
        match self.scale {
            Scale::Linear => Some((value - self.low) / (self.high - self.low)),
            Scale::Logarithmic if value <= 0.0 => None,
            Scale::Logarithmic => {
                Some((value.ln() - self.low.ln()) / (self.high.ln() - self.low.ln()))
            }
        }
    }

    /// The ticks, each with its position as [`Axis::fraction`].
    pub(crate) fn ticks(&self) -> impl Iterator<Item = (f64, &Tick)> {
        self.ticks
            .iter()
            .filter_map(|tick| self.fraction(tick.value).map(|position| (position, tick)))
    }

    /// What to append to the label of the axis.
    pub(crate) fn remark(&self) -> &'static str {
        match self.scale {
            Scale::Linear => "",
            Scale::Logarithmic => ", log scale",
        }
    }

    fn linear(low: f64, high: f64, smallest_step: f64) -> Axis {
        let step = round_up((high - low) / 5.0).max(smallest_step);
        let first = (low / step).ceil() as i64;
        let last = (high / step).floor() as i64;
        let magnitude = low.abs().max(high.abs());
        let ticks = (first..=last)
            .map(|multiple| {
                let value = multiple as f64 * step;
                Tick {
                    value,
                    label: label(value, step, magnitude),
                }
            })
            // Rounding may put the outermost product beside the interval.
            .filter(|tick| (low..=high).contains(&tick.value))
            .collect();
        Axis {
            low,
            high,
            scale: Scale::Linear,
            ticks,
        }
    }

    fn logarithmic(low: f64, high: f64) -> Axis {
        let decades = high.log10() - low.log10();
        let multiples: &[i32] = if decades <= 3.0 { &[1, 2, 5] } else { &[1] };
        let stride = (decades / 8.0).ceil().max(1.0) as usize;
        let first = low.log10().floor() as i32;
        let last = high.log10().ceil() as i32;
        let mut ticks = Vec::new();
        for exponent in (first..=last).step_by(stride) {
            for &multiple in multiples {
                let value = f64::from(multiple) * 10f64.powi(exponent);
                if (low..=high).contains(&value) {
                    let label = label(value, value, value);
                    ticks.push(Tick { value, label });
                }
            }
        }
        Axis {
            low,
            high,
            scale: Scale::Logarithmic,
            ticks,
        }
    }
}

/// `value` as it can be drawn; `None` if it cannot.
fn plottable(value: f64) -> Option<f64> {
    if !value.is_finite() || value.abs() > LARGEST {
        None
    } else if value.abs() < SMALLEST {
        Some(0.0)
    } else {
        Some(value)
    }
}

/// `low` less `margin`, but what is never negative shall not look as if it could be.
fn padded(low: f64, margin: f64) -> f64 {
    if low >= 0.0 {
        (low - margin).max(0.0)
    } else {
        low - margin
    }
}

/// Whether `median` lies nearer to the middle of the interval on a logarithmic scale.
fn is_skewed(low: f64, median: f64, high: f64) -> bool {
    let linear = (median - low) / (high - low);
    let logarithmic = (median / low).ln() / (high / low).ln();
    (logarithmic - 0.5).abs() < (linear - 0.5).abs()
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `step`.
fn round_up(step: f64) -> f64 {
    let exponent = step.log10().floor() as i32;
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|multiple| power_of_ten_times(multiple, exponent))
        .find(|&round| round >= step)
        .unwrap_or_else(|| power_of_ten_times(1.0, exponent + 1))
}

/// `multiple` × 10^`exponent`; negative powers by division, which rounds once: 1 / 10 is the double
/// nearest to 0.1, and so the label is short.
fn power_of_ten_times(multiple: f64, exponent: i32) -> f64 {
    if exponent < 0 {
        multiple / 10f64.powi(-exponent)
    } else {
        multiple * 10f64.powi(exponent)
    }
}

/// As many digits as tell neighbours apart, at `step` from each other and below `magnitude`.
fn label(value: f64, step: f64, magnitude: f64) -> String {
    if value == 0.0 {
        return "0".to_string();
    }
    let step_exponent = step.log10().floor() as i32;
    if magnitude >= 1e6 || step < 1e-4 {
        let own_exponent = value.abs().log10().floor() as i32;
        let digits = usize::try_from(own_exponent - step_exponent).unwrap_or(0);
        return format!("{value:.digits$e}");
    }
    let decimals = usize::try_from(-step_exponent).unwrap_or(0);
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<&str> {
        axis.ticks.iter().map(|tick| tick.label.as_str()).collect()
    }

    #[test]
    fn decades_are_whole_whatever_the_values() {
        let axis = Axis::decades([0.3, 40.0, 0.0, -1.0, f64::NAN, f64::INFINITY]);
        assert_eq!(axis.fraction(0.1), Some(0.0));
        assert!((axis.fraction(10.0).unwrap() - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(axis.fraction(0.0), None);
        for values in [vec![], vec![0.0], vec![1.0], vec![1e-150, 1e150]] {
            let axis = Axis::decades(values.clone());
            assert!(axis.low < axis.high && axis.high.is_finite(), "{values:?}");
            assert!(axis.ticks().count() >= 2, "{values:?}");
        }
    }

    #[test]
    fn ticks_of_some_known_intervals() {
        let frames = Axis::fitting((0..80).map(f64::from));
        assert_eq!(labels(&frames), ["0", "20", "40", "60", "80"]);
        let few_frames = Axis::fitting([0.0, 1.0, 2.0]);
        assert_eq!(labels(&few_frames), ["0", "1", "2"]);
        let one_frame = Axis::fitting([0.0]);
        assert_eq!(labels(&one_frame), ["0", "1"]);
        let leaves = Axis::fitting([1.0, 4.0, 32.0]);
        assert_eq!(labels(&leaves), ["1", "2", "5", "10", "20"]);
        let times = Axis::fitting([31.3, 31.9]);
        assert_eq!(labels(&times), ["31.4", "31.6", "31.8"]);
        let small = Axis::fitting([1e-7, 3e-7]);
        assert_eq!(
            labels(&small),
            ["1.0e-7", "1.5e-7", "2.0e-7", "2.5e-7", "3.0e-7"]
        );
    }

    /// A source of numbers in [0, 1) that is the same in every run.
    fn uniform(state: &mut u64) -> f64 {
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Whether `value` is 1, 2 or 5 times a power of ten.
    fn is_round(value: f64) -> bool {
        // A little more, so that 9.999… × 10ⁿ counts as the power of ten that it stands for.
        let leading = value / 10f64.powf((value * 1.000_001).log10().floor());
        [1.0, 2.0, 5.0]
            .iter()
            .any(|round| (leading - round).abs() < 1e-6)
    }

    fn assert_sound(axis: &Axis) {
        let ticks = &axis.ticks;
        assert!((2..=12).contains(&ticks.len()), "{axis:?}");
        for pair in ticks.windows(2) {
            assert!(pair[0].value < pair[1].value, "{axis:?}");
            assert_ne!(pair[0].label, pair[1].label, "{axis:?}");
        }
        let step = ticks[1].value - ticks[0].value;
        for tick in ticks {
            assert!((axis.low..=axis.high).contains(&tick.value), "{axis:?}");
            let read: f64 = tick.label.parse().unwrap();
            let rounding = 1e-9 * step + 1e-14 * tick.value.abs();
            assert!((read - tick.value).abs() <= rounding, "{axis:?}");
        }
    }

    #[test]
    fn linear_ticks_are_round_distinct_and_inside() {
        let mut state = 1;
        for _ in 0..4000 {
            let magnitude = 10f64.powf(40.0 * uniform(&mut state) - 20.0);
            let low = (2.0 * uniform(&mut state) - 1.0) * magnitude;
            let high = low + magnitude * 10f64.powf(-6.0 * uniform(&mut state));
            let axis = Axis::fitting([low, high]);
            assert_eq!(axis.scale, Scale::Linear);
            assert_sound(&axis);
            let step = axis.ticks[1].value - axis.ticks[0].value;
            assert!(is_round(step), "{axis:?}");
        }
    }

    #[test]
    fn logarithmic_ticks_are_round_distinct_and_inside() {
        let mut state = 2;
        for _ in 0..4000 {
            let low = 10f64.powf(40.0 * uniform(&mut state) - 20.0);
            let ratio = LOGARITHMIC_FROM * 10f64.powf(20.0 * uniform(&mut state).powi(3));
            let axis = Axis::fitting([low, low * ratio.sqrt(), low * ratio * 1.000_001]);
            assert_eq!(axis.scale, Scale::Logarithmic);
            assert_sound(&axis);
            assert!(
                axis.ticks.iter().all(|tick| is_round(tick.value)),
                "{axis:?}"
            );
        }
    }

    #[test]
    fn steps_are_one_two_or_five() {
        for (step, round) in [
            (0.3, 0.5),
            (1.0, 1.0),
            (1.1, 2.0),
            (2.0, 2.0),
            (5.1, 10.0),
            (0.07, 0.1),
            (123.0, 200.0),
        ] {
            assert_eq!(round_up(step), round, "{step}");
        }
    }

    #[test]
    fn values_keep_their_order_and_lie_inside() {
        for values in [[3.0, 5.0, 9.0], [0.1, 8.0, 900.0], [-4.0, 0.0, 1e9]] {
            let axis = Axis::fitting(values);
            let positions = values.map(|value| axis.fraction(value).unwrap());
            assert!(positions[0] < positions[1] && positions[1] < positions[2]);
            assert!(positions.iter().all(|at| (0.0..=1.0).contains(at)));
        }
    }

    #[test]
    fn values_spread_over_decades_are_logarithmic() {
        let scale = |values: &[f64]| Axis::fitting(values.iter().copied()).scale;
        assert_eq!(scale(&[30.0, 35.0, 60.0]), Scale::Linear);
        assert_eq!(scale(&[30.0, 35.0, 600.0]), Scale::Logarithmic);
        assert_eq!(scale(&[0.0, 35.0, 600.0]), Scale::Linear);
        assert_eq!(scale(&[-3.0, 35.0, 600.0]), Scale::Linear);
        // One small value does not press evenly spread ones together.
        assert_eq!(scale(&[0.01, 2.0, 4.0, 6.0, 8.0, 10.0]), Scale::Linear);
    }

    #[test]
    fn degenerate_data_give_finite_positions() {
        let cases: [&[f64]; 12] = [
            &[],
            &[0.0],
            &[31.0],
            &[31.0, 31.0],
            &[f64::NAN, f64::INFINITY],
            &[f64::NAN, 2.0],
            &[f64::MAX, -f64::MAX],
            &[1e150, -1e150],
            &[5e-324, 1e-310],
            &[1e15, 1e15 + 1.0],
            &[1e-150, 1e150],
            &[-7.0, -7.0],
        ];
        for values in cases {
            for axis in [
                Axis::fitting(values.iter().copied()),
                Axis::from_zero(values.iter().copied()),
            ] {
                assert!(axis.low < axis.high, "{values:?}");
                assert!(axis.low.is_finite() && axis.high.is_finite());
                assert!(axis.ticks.len() <= 12, "{values:?}: {axis:?}");
                for value in values {
                    if let Some(position) = axis.fraction(*value) {
                        assert!(position.is_finite(), "{values:?}");
                    }
                }
                assert!(axis.ticks().all(|(position, _)| position.is_finite()));
            }
        }
    }

    #[test]
    fn what_cannot_be_drawn_has_no_position() {
        let axis = Axis::fitting([1.0, 10.0, 100.0]);
        for value in [f64::NAN, f64::INFINITY, 1e151, 0.0, -1.0] {
            assert_eq!(axis.fraction(value), None, "{value}");
        }
    }

    #[test]
    fn bars_begin_at_zero() {
        let axis = Axis::from_zero([30.0, 40.0]);
        assert_eq!(axis.fraction(0.0), Some(0.0));
        assert_eq!(axis.fraction(40.0), Some(1.0));
    }
}
