//! What a frame will take, before it is drawn: time = samples · cost of a sample.
//!
//! Bruder, Frey, Ertl, *Real-Time Performance Prediction and Tuning for Interactive Volume
//! Raycasting*, 2016. The samples come from an estimate of the rays (`estimate`), the cost of a
//! sample is learned while frames are drawn.
//!
//! | module | what it answers |
//! | --- | --- |
//! | `quality` | what may be given up for time |
//! | `outlook` | what is known of a frame before it is drawn |
//! | `features` | what the cost of a sample may depend on |
//! | `krls` | which cost a sample has in frames like this one |
//! | `additive` | what rays, jumps and samples cost, in frames like none |
//! | `predictor` | the time of a frame, from all of these |
//! | `prediction` | what it answers with |
//!
//! Invariants: nothing here reads a clock, times are told; equal lessons in equal order give equal
//! predictions. Times are in seconds, steps and lengths in lengths of a voxel.

mod additive;
mod features;
mod krls;
mod outlook;
mod params;
mod prediction;
mod predictor;
mod quality;
mod symmetric;

pub use additive::{AdditiveModel, Counts, WorkCosts};
pub use features::{FEATURES, FeatureForm, FeatureScales};
pub use krls::{Krls, KrlsError, KrlsParams, KrlsPrediction, Learned};
pub use outlook::Outlook;
pub use params::{PredictorParams, SampleUnit};
pub use prediction::{FrameModel, Lesson, Prediction};
pub use predictor::FramePredictor;
pub use quality::{PixelsPerRay, Quality};

/// Why nothing can be predicted or learned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PredictError {
    /// A number of the outlook is not finite, or below what it can be.
    #[error("{name} of a frame's outlook is {value}: it must be finite and have a meaning")]
    Outlook {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// The step is not a positive number.
    #[error("a step of {step} voxels: it must be above 0 and finite")]
    Step {
        /// The step.
        step: f64,
    },
    /// A parameter of the predictor has no meaning.
    #[error("{name} is {value}, allowed is {allowed}")]
    Parameter {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The kernel model refuses.
    #[error(transparent)]
    Krls(#[from] KrlsError),
}
