//! How the values of one parameter lie on the unit interval.
//!
//! Discrete values own bins: `[0, 1]` is cut into one bin per value, of equal width (in the
//! logarithm for [`Scale::Log`]). Rounding a real number instead would give the two end values half
//! a bin each. A value is encoded as the centre of its bin, so that decoding it again is safe from
//! rounding.
//!
//! Reals are kept on a decimal grid of [`REAL_DIGITS`] digits: absolute, relative to the larger
//! bound, on a linear axis; relative to the value on a logarithmic one. The grid makes
//! `decode(encode(value)) == value` exact, keeps the numbers people type (`0.7`) as they are, prints
//! short, and hides the last bits in which the logarithms of two platforms differ. It is far finer
//! than any measurement of a cost can tell apart.
//!
//! Invariant of all functions but `checked`: the range was accepted by `checked`.

use std::cmp::Ordering;

use crate::{Kind, Scale, SpaceError, Value};

/// Significant decimal digits of a real.
const REAL_DIGITS: i32 = 10;
/// Largest magnitude of a bound. Doubles resolve 1e-16 of a value: the narrowest bin stays thousands
/// of times wider than a rounding error.
const LARGEST: f64 = 1e12;
/// Smallest magnitude of the larger bound of a real range; `10^21`, the finest grid, is exact.
const SMALLEST: f64 = 1e-12;
/// Least width of a real range relative to its larger bound: at least a thousand steps of the grid.
const LEAST_WIDTH: f64 = 1e-6;

impl Kind {
    /// The same kind with real bounds rounded to the grid, or what is wrong with it.
    pub(crate) fn checked(&self, name: &str) -> Result<Kind, SpaceError> {
        let name = || name.to_owned();
        let kind = || self.clone();
        let empty = || SpaceError::EmptyRange {
            name: name(),
            kind: kind(),
        };
        let unusable = || SpaceError::UnusableRange {
            name: name(),
            kind: kind(),
        };
        let not_log = || SpaceError::LogOfNonPositive {
            name: name(),
            kind: kind(),
        };
        match *self {
            Kind::Bool => Ok(Kind::Bool),
            Kind::Integer { min, max, scale } => {
                if min > max {
                    return Err(empty());
                }
                if [min, max]
                    .iter()
                    .any(|bound| bound.unsigned_abs() as f64 > LARGEST)
                {
                    return Err(unusable());
                }
                if scale == Scale::Log && min < 1 {
                    return Err(not_log());
                }
                Ok(kind())
            }
            Kind::Ordinal(ref values) => {
                if values.is_empty() || values.windows(2).any(|pair| pair[0] >= pair[1]) {
                    return Err(empty());
                }
                Ok(kind())
            }
            Kind::Real { min, max, scale } => {
                if !min.is_finite() || !max.is_finite() {
                    return Err(unusable());
                }
                if min > max {
                    return Err(empty());
                }
                if scale == Scale::Log && min <= 0.0 {
                    return Err(not_log());
                }
                let magnitude = min.abs().max(max.abs());
                let narrow = min < max && max - min < LEAST_WIDTH * magnitude;
                let tiny = magnitude != 0.0 && magnitude < SMALLEST;
                if magnitude > LARGEST || tiny || narrow || (scale == Scale::Log && min < SMALLEST)
                {
                    return Err(unusable());
                }
                // Twice: rounding 9.999… up to 10 makes the grid coarser by one digit.
                let mut range = (min, max);
                for _ in 0..2 {
                    let grid = Grid::new(range.0, range.1, scale);
                    range = (grid.round(range.0), grid.round(range.1));
                }
                Ok(Kind::Real {
                    min: range.0,
                    max: range.1,
                    scale,
                })
            }
        }
    }

    /// The value that is nearest to a number; to one that is no number the first. Of a boolean numbers from
    /// one half on are true.
    pub fn nearest(&self, number: f64) -> Value {
        match *self {
            Kind::Bool => Value::Bool(number >= 0.5),
            // Clamped first: a cast of what remains is exact.
            Kind::Integer { min, max, .. } => {
                Value::Integer(number.max(min as f64).min(max as f64).round() as i64)
            }
            Kind::Ordinal(ref values) => {
                let distance = |value: &i64| (*value as f64 - number).abs();
                let nearest = values
                    .iter()
                    .min_by(|a, b| distance(a).total_cmp(&distance(b)));
                Value::Integer(nearest.copied().unwrap_or_default())
            }
            Kind::Real { min, max, .. } => self.round(Value::Real(number.max(min).min(max))),
        }
    }

    /// The value at `unit`; numbers outside the interval are projected, NaN counts as 0.
    pub(crate) fn decode(&self, unit: f64) -> Value {
        let unit = if unit.is_nan() {
            0.0
        } else {
            unit.clamp(0.0, 1.0)
        };
        match *self {
            Kind::Bool => Value::Bool(bin(unit, 2) == 1),
            Kind::Integer {
                min,
                max,
                scale: Scale::Linear,
            } => Value::Integer(min + bin(unit, (max - min + 1) as usize) as i64),
            Kind::Integer {
                min,
                max,
                scale: Scale::Log,
            } => {
                let (low, high) = log_edges(min, max);
                let value = (low + unit * (high - low)).exp().floor() as i64;
                Value::Integer(value.clamp(min, max))
            }
            Kind::Ordinal(ref values) => Value::Integer(values[bin(unit, values.len())]),
            Kind::Real { min, max, scale } => {
                let raw = match scale {
                    Scale::Linear => min + unit * (max - min),
                    Scale::Log => (min.ln() + unit * (max.ln() - min.ln())).exp(),
                };
                self.round(Value::Real(raw))
            }
        }
    }

    /// Where `value` lies: the centre of its bin, or the place of a real. Values that are not
    /// possible are projected onto the interval.
    pub(crate) fn encode(&self, value: Value) -> f64 {
        let unit = match (self, value) {
            (Kind::Bool, Value::Bool(value)) => centre(usize::from(value), 2),
            (
                &Kind::Integer {
                    min,
                    max,
                    scale: Scale::Linear,
                },
                Value::Integer(value),
            ) => centre((value - min) as usize, (max - min + 1) as usize),
            (
                &Kind::Integer {
                    min,
                    max,
                    scale: Scale::Log,
                },
                Value::Integer(value),
            ) => {
                let (low, high) = log_edges(min, max);
                let middle = 0.5 * ((value as f64).ln() + (value as f64 + 1.0).ln());
                (middle - low) / (high - low)
            }
            (Kind::Ordinal(values), Value::Integer(value)) => {
                let index = values.partition_point(|&known| known < value);
                centre(index, values.len())
            }
            (&Kind::Real { min, max, .. }, Value::Real(_)) if min == max => 0.5,
            (&Kind::Real { min, max, scale }, Value::Real(value)) => match scale {
                Scale::Linear => (value - min) / (max - min),
                Scale::Log => (value.ln() - min.ln()) / (max.ln() - min.ln()),
            },
            _ => unreachable!("a value has the type of its parameter"),
        };
        unit.clamp(0.0, 1.0)
    }

    /// Width of the narrowest bin; 0 for a real, 1 where there is nothing to choose.
    pub(crate) fn step(&self) -> f64 {
        match *self {
            Kind::Integer {
                min,
                max,
                scale: Scale::Log,
            } => {
                let (low, high) = log_edges(min, max);
                let last = (max as f64 + 1.0).ln() - (max as f64).ln();
                last / (high - low)
            }
            _ => self.count().map_or(0.0, |count| 1.0 / count as f64),
        }
    }

    /// Number of values, `None` for a real range.
    pub(crate) fn count(&self) -> Option<u64> {
        match *self {
            Kind::Bool => Some(2),
            Kind::Integer { min, max, .. } => Some(max.abs_diff(min) + 1),
            Kind::Ordinal(ref values) => Some(values.len() as u64),
            Kind::Real { min, max, .. } => (min == max).then_some(1),
        }
    }

    /// The value number `index` of a countable kind, in increasing order.
    pub(crate) fn nth(&self, index: u64) -> Value {
        match *self {
            Kind::Bool => Value::Bool(index == 1),
            Kind::Integer { min, .. } => Value::Integer(min + index as i64),
            Kind::Ordinal(ref values) => Value::Integer(values[index as usize]),
            Kind::Real { min, .. } => Value::Real(min),
        }
    }

    /// The smallest value.
    pub(crate) fn lowest(&self) -> Value {
        match *self {
            Kind::Real { min, .. } => Value::Real(min),
            _ => self.nth(0),
        }
    }

    /// The largest value.
    pub(crate) fn highest(&self) -> Value {
        match *self {
            Kind::Bool => Value::Bool(true),
            Kind::Integer { max, .. } => Value::Integer(max),
            Kind::Ordinal(ref values) => Value::Integer(values[values.len() - 1]),
            Kind::Real { max, .. } => Value::Real(max),
        }
    }

    /// Whether a parameter of this kind may have `value`, up to the grid of reals.
    pub(crate) fn contains(&self, value: Value) -> bool {
        match (self, value) {
            (Kind::Bool, Value::Bool(_)) => true,
            (Kind::Integer { min, max, .. }, Value::Integer(value)) => {
                (min..=max).contains(&&value)
            }
            (Kind::Ordinal(values), Value::Integer(value)) => values.binary_search(&value).is_ok(),
            (Kind::Real { min, max, .. }, Value::Real(value)) => (min..=max).contains(&&value),
            _ => false,
        }
    }

    /// A real rounded to the grid and projected into its range; any other value as it is.
    pub(crate) fn round(&self, value: Value) -> Value {
        match (self, value) {
            (&Kind::Real { min, max, scale }, Value::Real(value)) => {
                Value::Real(Grid::new(min, max, scale).round(value).clamp(min, max))
            }
            _ => value,
        }
    }

    /// The largest value that is at most `bound`, a value of a comparable kind; without one the
    /// lowest. For reals it may be one step of the grid less.
    pub(crate) fn at_most(&self, bound: Value) -> Value {
        self.beside(bound, Ordering::Greater)
    }

    /// The smallest value that is at least `bound`; without one the highest.
    pub(crate) fn at_least(&self, bound: Value) -> Value {
        self.beside(bound, Ordering::Less)
    }

    /// The value next to `bound` that does not compare as `wrong` to it.
    fn beside(&self, bound: Value, wrong: Ordering) -> Value {
        match (self, bound) {
            (&Kind::Integer { min, max, .. }, Value::Integer(bound)) => {
                Value::Integer(bound.clamp(min, max))
            }
            (Kind::Ordinal(values), Value::Integer(bound)) => {
                let last = values.len() - 1;
                let index = match wrong {
                    Ordering::Less => values.partition_point(|&value| value < bound).min(last),
                    _ => values
                        .partition_point(|&value| value <= bound)
                        .saturating_sub(1),
                };
                Value::Integer(values[index])
            }
            (&Kind::Real { min, max, scale }, Value::Real(bound)) => {
                let grid = Grid::new(min, max, scale);
                let near = grid.round(bound.clamp(min, max)).clamp(min, max);
                if near.partial_cmp(&bound) != Some(wrong) {
                    return Value::Real(near);
                }
                let away = if wrong == Ordering::Less { 1.0 } else { -1.0 };
                let next = grid.round(near + away * grid.step(near));
                Value::Real(next.clamp(min, max))
            }
            _ => unreachable!("only numbers of one type are ordered"),
        }
    }
}

/// Index of the bin of `unit` among `count` bins of equal width.
fn bin(unit: f64, count: usize) -> usize {
    ((unit * count as f64) as usize).min(count - 1)
}

/// Centre of bin `index` of `count`.
fn centre(index: usize, count: usize) -> f64 {
    (index as f64 + 0.5) / count as f64
}

/// Logarithms between which the integers `min..=max` own the bins `[ln n, ln (n + 1))`.
fn log_edges(min: i64, max: i64) -> (f64, f64) {
    ((min as f64).ln(), (max as f64 + 1.0).ln())
}

/// The decimal grid of a real range.
enum Grid {
    /// Multiples of `10^-decimals`.
    Absolute { decimals: i32 },
    /// [`REAL_DIGITS`] significant digits.
    Relative,
}

impl Grid {
    fn new(min: f64, max: f64, scale: Scale) -> Grid {
        match scale {
            Scale::Log => Grid::Relative,
            Scale::Linear => {
                let magnitude = min.abs().max(max.abs()).max(SMALLEST);
                Grid::Absolute {
                    decimals: REAL_DIGITS - 1 - magnitude.log10().floor() as i32,
                }
            }
        }
    }

    /// The grid point next to `value`. Powers of ten up to 22 are exact and so is the integer, hence
    /// the quotient is the double next to the decimal number and rounding it again changes nothing.
    fn round(&self, value: f64) -> f64 {
        let rounded = match *self {
            Grid::Absolute { decimals } if decimals >= 0 => {
                let power = 10f64.powi(decimals);
                (value * power).round() / power
            }
            Grid::Absolute { decimals } => {
                let power = 10f64.powi(-decimals);
                (value / power).round() * power
            }
            Grid::Relative => format!("{value:.0$e}", REAL_DIGITS as usize - 1)
                .parse()
                .expect("a printed number is a number"),
        };
        // -0.0 and 0.0 are one value.
        rounded + 0.0
    }

    /// Distance of neighbouring grid points near `value`.
    fn step(&self, value: f64) -> f64 {
        match *self {
            Grid::Absolute { decimals } => 10f64.powi(-decimals),
            Grid::Relative => 10f64.powi(value.log10().floor() as i32 + 1 - REAL_DIGITS),
        }
    }
}
