//! What a predictor refuses. Nothing is learned from what is refused.

use std::sync::Arc;

/// Features, a point or a cost that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PredictError {
    /// The bounds of a feature are not finite, not in order, or logarithmic and not positive.
    #[error(
        "feature {name}: {low}..{high} is no range (finite, increasing, positive for logarithms)"
    )]
    BadBounds {
        /// The feature.
        name: Arc<str>,
        /// Its lower bound as given.
        low: f64,
        /// Its upper bound as given.
        high: f64,
    },
    /// A state has one number for each feature.
    #[error("{given} features were given, not {wanted}")]
    FeatureCount {
        /// Numbers that were given.
        given: usize,
        /// Features that there are.
        wanted: usize,
    },
    /// A feature must be finite.
    #[error("feature {name} must be finite, not {value}")]
    NotFinite {
        /// The feature.
        name: Arc<str>,
        /// Its value as given.
        value: f64,
    },
    /// A point has one coordinate for each axis of the cube.
    #[error("a point with {given} coordinates in a cube of {wanted} axes")]
    PointAxes {
        /// Coordinates that were given.
        given: usize,
        /// Axes that there are.
        wanted: usize,
    },
    /// A coordinate of a point must be in `[0, 1]`.
    #[error("coordinate {axis} of a point must be in 0..=1, not {value}")]
    OutsideCube {
        /// The axis, counted from 0.
        axis: usize,
        /// The coordinate as given.
        value: f64,
    },
    /// A cost must be finite and more than 0, and so must its reciprocal.
    #[error("a cost must be finite and more than 0, not {cost}")]
    BadCost {
        /// The refused cost.
        cost: f64,
    },
    /// A setting is outside its range.
    #[error("{name} must be in {min}..={max}, not {value}")]
    OutOfRange {
        /// The setting.
        name: &'static str,
        /// Its value as given.
        value: f64,
        /// The least value.
        min: f64,
        /// The largest value.
        max: f64,
    },
    /// The members of a portfolio: there must be one.
    #[error("a portfolio needs a member")]
    NoMember,
}
