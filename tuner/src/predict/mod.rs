//! Predictors: a good configuration for a state without a search, from what was measured in other states.
//!
//! Herveau, Pfaffe, Tillmann, Tichy & Dachsbacher, "Analysis of Acceleration Structure Parameters and Hybrid
//! Autotuning for Ray Tracing" (TVCG): a state is described by features; a predictor is told what points of
//! the unit cube cost in states, and names a point for a state. [`NearestNeighbour`] and [`RadialBasis`] are
//! the paper's, [`EpsilonGreedy`] chooses between them and a search; [`LeastSquares`] and [`Portfolio`] are
//! ours. Features are plain numbers with bounds: nothing here knows what they mean.
//!
//! Which to use: on recorded tables (bench `predictors`) no prediction alone comes as near to a search as a few
//! of them measured for a frame each: what a table and least squares say, and a portfolio. The value function
//! as printed is worst. A prediction for a state unlike all known ones is a guess.
//!
//! Invariants: a predictor is a function of its settings, its seed and what it learned, in that order;
//! what is refused changes nothing; nothing learned is no prediction, never an arbitrary one.
//!
//! ```
//! use raywright_tuner::Scale;
//! use raywright_tuner::predict::{
//!     Feature, Features, NearestNeighbour, Predictor, Scaling, Subject,
//! };
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let triangles = Feature::new("triangles", 1.0, 1e7, Scale::Log, Subject::Scene);
//! let features = Features::new(vec![triangles])?;
//! let mut table = NearestNeighbour::new(features, 2, Scaling::Rescaled);
//! assert_eq!(table.predict(&[5e4], &[])?, None);
//! table.learn(&[1e3], &[0.2, 0.9], 0.5)?;
//! table.learn(&[1e6], &[0.7, 0.1], 0.8)?;
//! table.learn(&[1e6], &[0.8, 0.1], 0.6)?;
//! assert_eq!(table.predict(&[5e5], &[])?, Some(vec![0.8, 0.1]));
//! # Ok(())
//! # }
//! ```

mod error;
mod features;
mod least_squares;
mod nearest;
mod policy;
mod portfolio;
mod radial;

use std::fmt::Debug;

pub use error::PredictError;
pub use features::{Feature, Features, Scaling, Subject};
pub use least_squares::{LeastSquares, Terms};
pub use nearest::NearestNeighbour;
pub use policy::{EpsilonGreedy, PolicySettings, Step};
pub use portfolio::{Portfolio, greedy_members};
pub use radial::{Kernel, RadialBasis, RadialSettings, Reward, StepSize};

/// Learns what points cost in states, and names a point for a state.
///
/// A state is one number per feature, in the features' own units; a point has one coordinate in `[0, 1]` per
/// axis ([`Space::encode`](crate::Space::encode)); a cost is finite and above 0, the less the better, and has
/// the same unit at every call. Failures are not told.
pub trait Predictor: Debug + Send {
    /// Learns that `point` cost `cost` in `state`.
    ///
    /// # Errors
    /// For a state, a point or a cost that is none, see [`PredictError`]. Then nothing is learned.
    fn learn(&mut self, state: &[f64], point: &[f64], cost: f64) -> Result<(), PredictError>;

    /// The point that promises most in `state`; `None` if nothing is known that could say so.
    ///
    /// A model chooses among `candidates` (measured points, a portfolio, points that fill the space) and takes
    /// the first of equals, so that the point in use should come first; a table knows its points and ignores
    /// them.
    ///
    /// # Errors
    /// For a state or a candidate that is none, see [`PredictError`].
    fn predict(
        &self,
        state: &[f64],
        candidates: &[Vec<f64>],
    ) -> Result<Option<Vec<f64>>, PredictError>;
}

/// Whether `point` is one of a cube of `axes` axes.
fn check_point(point: &[f64], axes: usize) -> Result<(), PredictError> {
    if point.len() != axes {
        return Err(PredictError::PointAxes {
            given: point.len(),
            wanted: axes,
        });
    }
    // Not a comparison with the ends: NaN is in no range.
    let outside = |&(_, value): &(usize, &f64)| !(0.0..=1.0).contains(value);
    match point.iter().enumerate().find(outside) {
        Some((axis, &value)) => Err(PredictError::OutsideCube { axis, value }),
        None => Ok(()),
    }
}

/// Whether `cost` is one, and has a logarithm and a reciprocal.
fn check_cost(cost: f64) -> Result<(), PredictError> {
    if cost.is_finite() && cost > 0.0 && cost.recip().is_finite() {
        Ok(())
    } else {
        Err(PredictError::BadCost { cost })
    }
}

/// Whether a setting is in its range.
fn check_range(name: &'static str, value: f64, min: f64, max: f64) -> Result<(), PredictError> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(PredictError::OutOfRange {
        name,
        value,
        min,
        max,
    })
}

/// The first candidate of the least value.
fn least(
    candidates: &[Vec<f64>],
    axes: usize,
    value: impl Fn(&[f64]) -> f64,
) -> Result<Option<&Vec<f64>>, PredictError> {
    let mut best: Option<(&Vec<f64>, f64)> = None;
    for candidate in candidates {
        check_point(candidate, axes)?;
        let own = value(candidate);
        if best.is_none_or(|(_, least)| own < least) {
            best = Some((candidate, own));
        }
    }
    Ok(best.map(|(candidate, _)| candidate))
}

#[cfg(test)]
mod tests;
