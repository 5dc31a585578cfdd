//! The longest step whose predicted time is the target.
//!
//! Bruder, Frey, Ertl, 2016, equation 3, put right: there the two conditions are swapped, the factor
//! is upside down for a length, and one symbol is undefined. With the times of a shorter step above
//! the target and of a longer one below it,
//!
//! ```text
//! only above known   s ← s · t/target, longer
//! only below known   s ← s · t/target, shorter
//! both               n = 1/s:  n ← n_below + (n_above − n_below) · (target − t_below)/(t_above − t_below)
//! ```
//!
//! since time is nearly linear in 1/s. Where that is slow, because it is not, the interval is halved.
//!
//! Invariants: the step lies within its limits and is finite; between two steps that are kept, the
//! shorter takes more than the target and the longer at most the target, so that a model that is not
//! monotone cannot lose both; at most [`MAX_EVALUATIONS`] questions are asked.

use crate::grid::Volume;

/// Questions to the model at most.
pub const MAX_EVALUATIONS: u32 = 16;

/// Distance from the target that is near enough, as a share of it.
pub const TOLERANCE: f64 = 0.01;

/// Ratio of the steps of a bracket, less 1, at which it is closed.
const CLOSED: f64 = 1e-3;

/// Extrapolations before a limit itself is tried.
const EXTRAPOLATIONS: u32 = 2;

/// Steps that are allowed, in lengths of a voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepLimits {
    /// The shortest; above 0.
    pub shortest: f64,
    /// The longest; not below the shortest, finite.
    pub longest: f64,
}

impl Default for StepLimits {
    fn default() -> Self {
        Self {
            shortest: 0.25,
            longest: 8.0,
        }
    }
}

impl StepLimits {
    /// The usual limits, with at least two samples across the shortest axis of a volume.
    #[must_use]
    pub fn for_volume(volume: &Volume) -> Self {
        let usual = Self::default();
        let across = volume.extent().min_element() / volume.unit_length();
        Self {
            shortest: usual.shortest,
            longest: (f64::from(across) * 0.5).clamp(usual.shortest, usual.longest),
        }
    }

    /// Whether both are numbers in order.
    pub(super) fn is_valid(&self) -> bool {
        self.shortest > 0.0 && self.longest >= self.shortest && self.longest.is_finite()
    }
}

/// How a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SearchEnd {
    /// The time is within [`TOLERANCE`] of the target.
    Met,
    /// Even the shortest step takes less.
    Shortest,
    /// Even the longest step takes more.
    Longest,
    /// The time jumps over the target: the step is the shortest one found that takes less.
    Jump,
    /// The model gave a time that is no number or negative; the step is the longest one.
    NoTime,
}

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepFound {
    /// The step, in lengths of a voxel.
    pub step: f64,
    /// Its predicted time, seconds; not a number with [`SearchEnd::NoTime`] alone.
    pub time: f64,
    /// How often the model was asked.
    pub evaluations: u32,
    /// Why this one.
    pub end: SearchEnd,
}

/// A step and its time.
type Point = (f64, f64);

/// The longest step whose time is `target` seconds, from `start` on; an infinite target asks for the
/// shortest step.
///
/// # Panics
/// If the limits are not valid, or the target is not above 0: [`Steering`](super::Steering) checks.
pub fn search_step(
    target: f64,
    start: f64,
    limits: StepLimits,
    mut time_of: impl FnMut(f64) -> f64,
) -> StepFound {
    assert!(limits.is_valid() && target > 0.0, "{limits:?}, {target}");
    let StepLimits { shortest, longest } = limits;
    let mut evaluations = 0;
    let found = |step: f64, time: f64, evaluations: u32, end| StepFound {
        step,
        time,
        evaluations,
        end,
    };
    let mut ask = |step: f64| {
        evaluations += 1;
        let time = time_of(step);
        (time, evaluations, (0.0..f64::INFINITY).contains(&time))
    };
    let start = if start.is_finite() { start } else { longest };
    let mut step = if target == f64::INFINITY {
        shortest
    } else {
        start.clamp(shortest, longest)
    };
    // The nearest steps known: the shorter takes too long, the longer does not.
    let (mut above, mut below): (Option<Point>, Option<Point>) = (None, None);
    let mut extrapolations = 0;
    let mut last_width = f64::INFINITY;
    loop {
        let (time, asked, is_time) = ask(step);
        if !is_time {
            return found(longest, f64::NAN, asked, SearchEnd::NoTime);
        }
        if target.is_finite() && (time - target).abs() <= TOLERANCE * target {
            return found(step, time, asked, SearchEnd::Met);
        }
        if time > target {
            above = Some((step, time));
        } else {
            below = Some((step, time));
        }
        step = match (above, below) {
            (Some((at, time)), None) => {
                if at >= longest {
                    return found(at, time, asked, SearchEnd::Longest);
                }
                extrapolations += 1;
                extrapolate(at, at * (time / target), longest, extrapolations)
            }
            (None, Some((at, time))) => {
                if at <= shortest {
                    return found(at, time, asked, SearchEnd::Shortest);
                }
                extrapolations += 1;
                extrapolate(at, at * (time / target), shortest, extrapolations)
            }
            (Some(above), Some(below)) => {
                let width = below.0 / above.0;
                if width < 1.0 + CLOSED || asked >= MAX_EVALUATIONS {
                    return found(below.0, below.1, asked, SearchEnd::Jump);
                }
                let slow = width.ln() > 0.5 * last_width.ln();
                last_width = width;
                between(above, below, target, slow)
            }
            (None, None) => unreachable!("a time is above the target or not"),
        };
    }
}

/// The next step towards a limit, on which the first extrapolations aim and the next lands.
fn extrapolate(from: f64, aim: f64, limit: f64, count: u32) -> f64 {
    let beyond = if limit > from {
        aim >= limit
    } else {
        aim <= limit
    };
    // An aim that is as good as where it began would get nowhere.
    let stays = (aim / from - 1.0).abs() < CLOSED;
    if count > EXTRAPOLATIONS || beyond || stays || !aim.is_finite() {
        limit
    } else {
        aim
    }
}

/// A step within a bracket: by interpolation, or in the middle.
fn between(above: Point, below: Point, target: f64, halve: bool) -> f64 {
    let middle = (above.0 * below.0).sqrt();
    if halve {
        return middle;
    }
    let (n_above, n_below) = (1.0 / above.0, 1.0 / below.0);
    let share = (target - below.1) / (above.1 - below.1);
    let step = 1.0 / (n_below + (n_above - n_below) * share);
    // Not at the ends, where nothing would be learned.
    if step > above.0 && step < below.0 {
        step
    } else {
        middle
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const LIMITS: StepLimits = StepLimits {
        shortest: 0.25,
        longest: 8.0,
    };

    fn search(target: f64, start: f64, time_of: impl FnMut(f64) -> f64) -> StepFound {
        search_step(target, start, LIMITS, time_of)
    }

    #[test]
    fn a_linear_model_is_solved_at_once() {
        let model = |step: f64| 0.01 / step + 0.004;
        for start in [0.25, 0.5, 1.0, 3.0, 8.0] {
            let found = search(0.012, start, model);
            assert_eq!(found.end, SearchEnd::Met);
            assert!((found.step - 1.25).abs() < 0.05, "{found:?}");
            assert!(found.evaluations <= 5, "{found:?}");
        }
    }

    #[test]
    fn the_right_way_round() {
        // Twice the target asks for twice the step, not for half of it.
        let mut asked = Vec::new();
        search(1.0, 1.0, |step| {
            asked.push(step);
            2.0 / step
        });
        assert_eq!(asked, [1.0, 2.0]);
    }

    #[test]
    fn a_constant_model() {
        let found = search(1.0, 1.0, |_| 2.0);
        assert_eq!((found.step, found.end), (8.0, SearchEnd::Longest));
        let found = search(1.0, 1.0, |_| 0.5);
        assert_eq!((found.step, found.end), (0.25, SearchEnd::Shortest));
        let found = search(1.0, 1.0, |_| 1.0);
        assert_eq!((found.step, found.end), (1.0, SearchEnd::Met));
        let found = search(1.0, 1.0, |_| 0.0);
        assert_eq!((found.step, found.end), (0.25, SearchEnd::Shortest));
    }

    #[test]
    fn a_jump_over_the_target() {
        for (edge, start) in [(0.9, 1.0), (5.0, 0.3), (0.26, 8.0), (7.9, 8.0)] {
            let found = search(1.0, start, |step| if step < edge { 3.0 } else { 0.2 });
            assert_eq!(found.end, SearchEnd::Jump);
            assert!(found.step >= edge && found.step < edge * 1.01, "{found:?}");
            assert!(found.time < 1.0 && found.evaluations <= MAX_EVALUATIONS);
        }
    }

    #[test]
    fn models_that_are_not_monotone() {
        let wave = |step: f64| 1.0 / step * (1.0 + 0.6 * (6.0 * step).sin());
        for start in [0.25, 0.7, 1.0, 2.0, 8.0] {
            let found = search(0.6, start, wave);
            assert_eq!(found.end, SearchEnd::Met, "{start}");
            assert!((wave(found.step) - 0.6).abs() <= 0.006);
        }
        // Longer steps that take longer.
        let found = search(1.0, 1.0, |step| step);
        assert_eq!((found.step, found.end), (1.0, SearchEnd::Met));
        let found = search(3.0, 1.0, |step| step);
        assert_eq!((found.step, found.end), (0.25, SearchEnd::Shortest));
    }

    #[test]
    fn no_time_is_the_longest_step() {
        for bad in [f64::NAN, f64::INFINITY, -1.0] {
            let found = search(1.0, 1.0, |_| bad);
            assert_eq!((found.step, found.end), (8.0, SearchEnd::NoTime));
            let found = search(1.0, 4.0, |step| if step < 3.0 { bad } else { 0.5 });
            assert_eq!((found.step, found.end), (8.0, SearchEnd::NoTime));
        }
    }

    #[test]
    fn odd_targets_and_starts() {
        let found = search(f64::INFINITY, 1.0, |step| 1.0 / step);
        assert_eq!((found.step, found.end), (0.25, SearchEnd::Shortest));
        assert_eq!(found.evaluations, 1);
        for start in [f64::NAN, f64::INFINITY, -3.0, 0.0] {
            assert_eq!(search(1.0, start, |step| 1.0 / step).end, SearchEnd::Met);
        }
        let one = StepLimits {
            shortest: 2.0,
            longest: 2.0,
        };
        for time in [0.5, 1.0, 1.5] {
            let found = search_step(1.0, 5.0, one, |_| time);
            assert_eq!(found.step, 2.0);
        }
    }

    proptest! {
        /// Whatever smooth and falling time a model gives, a target between those of the limits is
        /// met within 1 %.
        #[test]
        fn an_exact_model_meets_its_target(
            fixed in 0.0..2.0_f64,
            scale in 1e-3..10.0_f64,
            power in 0.3..3.0_f64,
            share in 0.0..=1.0_f64,
            start in 0.01..20.0_f64,
        ) {
            let model = |step: f64| scale * (fixed + step.powf(-power));
            let (slow, fast) = (model(LIMITS.shortest), model(LIMITS.longest));
            let target = fast + (slow - fast) * share;
            let found = search(target, start, model);
            prop_assert!((found.time / target - 1.0).abs() <= TOLERANCE, "{:?} {}", found, target);
            prop_assert!(found.evaluations <= MAX_EVALUATIONS);
        }

        /// Whatever a model says, the step is a number within its limits.
        #[test]
        fn any_model_gives_a_step(
            times in prop::collection::vec(prop::num::f64::ANY, 1..20),
            target in prop::num::f64::POSITIVE,
            start in prop::num::f64::ANY,
        ) {
            prop_assume!(target > 0.0);
            let mut next = 0;
            let found = search(target, start, |_| {
                next += 1;
                times[next % times.len()]
            });
            prop_assert!((LIMITS.shortest..=LIMITS.longest).contains(&found.step));
            prop_assert!(found.evaluations <= MAX_EVALUATIONS);
        }
    }
}
