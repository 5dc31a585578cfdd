//! What a value looks like: colour and opacity, piecewise linear.
//!
//! Opacity is per length of one voxel (the smallest spacing of the volume); `table` corrects it for
//! the length of a step.
//!
//! Invariants: there is at least one point; positions are finite and ascend, two equal ones being a
//! jump at which the right one holds; colours and opacities lie in 0..=1.

use serde::{Deserialize, Serialize};

/// Red, green, blue and opacity at a value. Colours are mixed as they are given: as values of a
/// screen, if they were chosen on one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f32; 5]", into = "[f32; 5]")]
pub struct ControlPoint {
    /// The value, after slope and intercept.
    pub value: f32,
    /// RGB.
    pub colour: [f32; 3],
    /// The opacity of one voxel's length.
    pub opacity: f32,
}

impl From<[f32; 5]> for ControlPoint {
    fn from([value, r, g, b, opacity]: [f32; 5]) -> Self {
        Self {
            value,
            colour: [r, g, b],
            opacity,
        }
    }
}

impl From<ControlPoint> for [f32; 5] {
    fn from(
        ControlPoint {
            value,
            colour: [r, g, b],
            opacity,
        }: ControlPoint,
    ) -> Self {
        [value, r, g, b, opacity]
    }
}

/// Why points make no transfer function.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TransferError {
    /// There is no point.
    #[error("a transfer function needs at least one point")]
    NoPoint,
    /// A number is not finite, or a colour or opacity is outside 0..=1.
    #[error("point {index}: {what} is {value}, allowed is {allowed}")]
    OutOfRange {
        /// The number of the point, from 0.
        index: usize,
        /// Which number.
        what: &'static str,
        /// The number.
        value: f32,
        /// What is allowed.
        allowed: &'static str,
    },
    /// Values do not ascend.
    #[error("point {index}: its value {value} is below {previous} of the point before")]
    NotSorted {
        /// The number of the point, from 0.
        index: usize,
        /// Its value.
        value: f32,
        /// The value before.
        previous: f32,
    },
}

/// A transfer function: colour and opacity of every value, linear between its points and constant
/// outside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<ControlPoint>", into = "Vec<ControlPoint>")]
pub struct TransferFunction {
    points: Vec<ControlPoint>,
}

impl TryFrom<Vec<ControlPoint>> for TransferFunction {
    type Error = TransferError;

    fn try_from(points: Vec<ControlPoint>) -> Result<Self, TransferError> {
        Self::new(points)
    }
}

impl From<TransferFunction> for Vec<ControlPoint> {
    fn from(function: TransferFunction) -> Self {
        function.points
    }
}

impl TransferFunction {
    /// A function through points whose values ascend.
    ///
    /// # Errors
    /// [`TransferError`], with the first point that is wrong.
    pub fn new(points: Vec<ControlPoint>) -> Result<Self, TransferError> {
        if points.is_empty() {
            return Err(TransferError::NoPoint);
        }
        for (index, point) in points.iter().enumerate() {
            let out_of_range = |what, value, allowed| TransferError::OutOfRange {
                index,
                what,
                value,
                allowed,
            };
            if !point.value.is_finite() {
                return Err(out_of_range("the value", point.value, "a finite number"));
            }
            let [r, g, b] = point.colour;
            for (what, value) in [
                ("red", r),
                ("green", g),
                ("blue", b),
                ("opacity", point.opacity),
            ] {
                if !(0.0..=1.0).contains(&value) {
                    return Err(out_of_range(what, value, "0 to 1"));
                }
            }
            if index > 0 && point.value < points[index - 1].value {
                return Err(TransferError::NotSorted {
                    index,
                    value: point.value,
                    previous: points[index - 1].value,
                });
            }
        }
        Ok(Self { points })
    }

    /// The points, by ascending value.
    #[must_use]
    pub fn points(&self) -> &[ControlPoint] {
        &self.points
    }

    /// RGB and opacity of a value.
    #[must_use]
    pub fn at(&self, value: f64) -> [f64; 4] {
        let next = self.points.partition_point(|p| f64::from(p.value) <= value);
        let rgba = |p: &ControlPoint| {
            let [r, g, b] = p.colour;
            [r, g, b, p.opacity].map(f64::from)
        };
        let Some(before) = next.checked_sub(1) else {
            return rgba(&self.points[0]);
        };
        let from = &self.points[before];
        let Some(to) = self.points.get(next) else {
            return rgba(from);
        };
        let (start, end) = (f64::from(from.value), f64::from(to.value));
        let share = (value - start) / (end - start);
        let (from, to) = (rgba(from), rgba(to));
        std::array::from_fn(|i| from[i] + (to[i] - from[i]) * share)
    }

    /// The mean opacity of the values between two, in either order; of equal ones, that of the value.
    #[must_use]
    pub fn mean_opacity(&self, a: f64, b: f64) -> f64 {
        let (low, high) = (a.min(b), a.max(b));
        if low == high {
            return self.at(low)[3];
        }
        let mut sum = 0.0;
        let mut add = |from: (f64, f64), to: (f64, f64)| {
            // The part of a line from one point to another that lies within.
            let (start, end) = (from.0.max(low), to.0.min(high));
            if start < end {
                let slope = (to.1 - from.1) / (to.0 - from.0);
                let at = |value: f64| from.1 + slope * (value - from.0);
                sum += (end - start) * 0.5 * (at(start) + at(end));
            }
        };
        let place = |point: &ControlPoint| (f64::from(point.value), f64::from(point.opacity));
        let (first, last) = (
            place(&self.points[0]),
            place(&self.points[self.points.len() - 1]),
        );
        add((low.min(first.0) - 1.0, first.1), first);
        for pair in self.points.windows(2) {
            add(place(&pair[0]), place(&pair[1]));
        }
        add(last, (high.max(last.0) + 1.0, last.1));
        sum / (high - low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn function(points: &[[f32; 5]]) -> Result<TransferFunction, TransferError> {
        TransferFunction::new(points.iter().map(|&p| p.into()).collect())
    }

    #[test]
    fn linear_between_points_and_constant_outside() {
        let function = function(&[[1.0, 0.0, 0.0, 0.5, 0.0], [3.0, 1.0, 0.5, 0.5, 0.8]]).unwrap();
        for (value, expected) in [
            (-5.0, [0.0, 0.0, 0.5, 0.0]),
            (1.0, [0.0, 0.0, 0.5, 0.0]),
            (2.0, [0.5, 0.25, 0.5, 0.4]),
            (3.0, [1.0, 0.5, 0.5, 0.8]),
            (9.0, [1.0, 0.5, 0.5, 0.8]),
        ] {
            let got = function.at(value);
            assert!(
                got.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-7),
                "{value}: {got:?}"
            );
        }
    }

    #[test]
    fn at_a_jump_the_right_value_holds() {
        let points = [
            [0.0; 5],
            [2.0, 0.0, 0.0, 0.0, 0.2],
            [2.0, 0.0, 0.0, 0.0, 0.9],
        ];
        let function = function(&points).unwrap();
        assert_eq!(function.at(2.0)[3], f64::from(0.9_f32));
        assert!((function.at(1.999_999)[3] - 0.2).abs() < 1e-6);
    }

    #[test]
    fn points_that_make_no_function() {
        assert_eq!(function(&[]), Err(TransferError::NoPoint));
        let ok = [0.0; 5];
        for (index, number) in [
            (0, f32::NAN),
            (0, f32::INFINITY),
            (1, -0.1),
            (2, 1.1),
            (4, f32::NAN),
        ] {
            let mut bad = [1.0; 5];
            bad[index] = number;
            let result = function(&[ok, bad]);
            assert!(
                matches!(result, Err(TransferError::OutOfRange { index: 1, .. })),
                "{result:?}"
            );
        }
        let result = function(&[[2.0, 0.0, 0.0, 0.0, 0.0], ok]);
        assert!(matches!(
            result,
            Err(TransferError::NotSorted { index: 1, .. })
        ));
    }

    #[test]
    fn the_mean_opacity_is_that_of_many_values() {
        let function = function(&[
            [1.0, 0.0, 0.0, 0.0, 0.1],
            [2.0, 0.0, 0.0, 0.0, 0.3],
            [2.0, 0.0, 0.0, 0.0, 0.9],
            [5.0, 0.0, 0.0, 0.0, 0.2],
        ])
        .unwrap();
        for (a, b) in [
            (0.0, 6.0),
            (1.25, 1.75),
            (6.0, 0.5),
            (1.9, 2.1),
            (-3.0, -2.0),
            (7.0, 9.0),
        ] {
            let n = 40_000;
            let at = |i: i32| function.at(a + (b - a) * (f64::from(i) + 0.5) / f64::from(n))[3];
            let expected = (0..n).map(at).sum::<f64>() / f64::from(n);
            let got = function.mean_opacity(a, b);
            assert!((got - expected).abs() < 1e-4, "{a} {b}: {got} {expected}");
        }
        assert_eq!(function.mean_opacity(2.0, 2.0), f64::from(0.9_f32));
    }

    #[test]
    fn json_in_and_out() {
        let text = "[[0.0,0.0,0.0,0.0,0.0],[2.5,1.0,0.5,0.25,0.75]]";
        let function: TransferFunction = serde_json::from_str(text).unwrap();
        assert_eq!(serde_json::to_string(&function).unwrap(), text);
        let error = serde_json::from_str::<TransferFunction>("[[0,0,0,0,2]]").unwrap_err();
        assert!(error.to_string().contains("opacity is 2"), "{error}");
    }
}
