//! Rules of the canonical form: different configurations that are known to do the same.
//!
//! Why: a search over discrete parameters proposes the same thing again and again under different
//! names. Trials are therefore counted by canonical form. A rule must never join two configurations
//! that behave differently; it may miss some that behave alike.
//!
//! A canonical configuration is a key. It may lie outside the ranges of its space: what is to be
//! run is the configuration, not its canonical form.

use crate::Value;

/// One redundancy of a space. Rules apply to active parameters.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "store", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "store", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum CanonRule {
    /// Of this integer or ordinal parameter, all values at least 1, only the largest power of two
    /// that is not above it has an effect: 5, 6 and 7 become 4.
    FloorToPowerOfTwo(String),
    /// Of these two real parameters, both at least 0, only the ratio has an effect.
    ///
    /// Canonical: both divided by the power of two that brings the denominator into `[1, 2)`.
    /// Powers of two alone, because only they scale floating-point numbers without rounding, so
    /// that even the last bit of what is computed from the two stays the same. A denominator of 0
    /// is an infinite ratio whatever the numerator, 0 included, and becomes 1 to 0.
    OnlyRatio {
        /// The parameter above the line.
        numerator: String,
        /// The parameter below the line.
        denominator: String,
    },
}

/// A rule with the indices of its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ResolvedRule {
    FloorToPowerOfTwo(usize),
    OnlyRatio {
        numerator: usize,
        denominator: usize,
    },
}

impl ResolvedRule {
    /// The rule with names instead of indices.
    #[cfg(feature = "store")]
    pub(crate) fn with_names(&self, names: &[String]) -> CanonRule {
        match *self {
            ResolvedRule::FloorToPowerOfTwo(index) => {
                CanonRule::FloorToPowerOfTwo(names[index].clone())
            }
            ResolvedRule::OnlyRatio {
                numerator,
                denominator,
            } => CanonRule::OnlyRatio {
                numerator: names[numerator].clone(),
                denominator: names[denominator].clone(),
            },
        }
    }

    /// Indices of the parameters the rule changes.
    pub(crate) fn params(&self) -> impl Iterator<Item = usize> + use<> {
        let (first, second) = match *self {
            ResolvedRule::FloorToPowerOfTwo(index) => (index, None),
            ResolvedRule::OnlyRatio {
                numerator,
                denominator,
            } => (numerator, Some(denominator)),
        };
        std::iter::once(first).chain(second)
    }

    /// Applies the rule in place. Applying it twice is applying it once.
    pub(crate) fn apply(&self, values: &mut [Value]) {
        match *self {
            ResolvedRule::FloorToPowerOfTwo(index) => {
                if let Value::Integer(value) = &mut values[index] {
                    *value = 1 << value.ilog2();
                }
            }
            ResolvedRule::OnlyRatio {
                numerator,
                denominator,
            } => {
                if let (Value::Real(above), Value::Real(below)) =
                    (values[numerator], values[denominator])
                {
                    let (above, below) = reduced_ratio(above, below);
                    values[numerator] = Value::Real(above);
                    values[denominator] = Value::Real(below);
                }
            }
        }
    }
}

/// The canonical pair of [`CanonRule::OnlyRatio`].
fn reduced_ratio(above: f64, below: f64) -> (f64, f64) {
    if below == 0.0 {
        return (1.0, 0.0);
    }
    // Reals of a space are zero or far inside the normal range: scaling neither rounds nor overflows.
    let scale = power_of_two_at_most(below).recip();
    (above * scale, below * scale)
}

/// The largest power of two that is at most the positive normal number `value`: its exponent bits.
fn power_of_two_at_most(value: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff << 52;
    f64::from_bits(value.to_bits() & EXPONENT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floors_to_powers_of_two() {
        let floored: Vec<i64> = [1, 2, 3, 5, 7, 8, 31, 32]
            .map(|value| {
                let mut values = [Value::Integer(value)];
                ResolvedRule::FloorToPowerOfTwo(0).apply(&mut values);
                match values[0] {
                    Value::Integer(value) => value,
                    other => panic!("{other:?}"),
                }
            })
            .to_vec();
        assert_eq!(floored, [1, 2, 2, 4, 4, 8, 16, 32]);
    }

    #[test]
    fn equal_ratios_up_to_powers_of_two_are_one() {
        assert_eq!(reduced_ratio(3.0, 6.0), (0.75, 1.5));
        assert_eq!(reduced_ratio(6.0, 12.0), (0.75, 1.5));
        assert_eq!(reduced_ratio(0.3, 0.25), (1.2, 1.0));
        // A third is not a power of two: kept apart, since 1/3 · 3 may round.
        assert_ne!(reduced_ratio(1.0, 2.0), reduced_ratio(3.0, 6.0));
    }

    #[test]
    fn ratios_with_zeros() {
        assert_eq!(reduced_ratio(0.0, 6.0), (0.0, 1.5));
        assert_eq!(reduced_ratio(7.0, 0.0), (1.0, 0.0));
        assert_eq!(reduced_ratio(0.0, 0.0), (1.0, 0.0));
    }
}
