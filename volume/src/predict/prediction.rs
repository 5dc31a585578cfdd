//! What is predicted, what becomes of a lesson, and one frame in any quality.

use super::{Counts, FramePredictor, Outlook, PixelsPerRay, PredictError, Quality};

/// What a frame is expected to take.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Prediction {
    /// Samples, in the unit of the cost.
    pub samples: f64,
    /// Seconds of a sample, everything else included; 0 if there are no samples.
    pub cost_per_sample: f64,
    /// Seconds.
    pub time: f64,
    /// Standard deviation of the logarithm of the time: 0.05 is some 5 %.
    pub deviation: f64,
    /// 0 if frames like this one are known, towards 1 if there was none.
    pub novelty: f64,
    /// The work that is expected.
    pub counts: Counts,
}

/// What became of a lesson.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Lesson {
    /// It was learned.
    Learned,
    /// The time is far from the prediction; it was learned as one less far.
    Outlier,
    /// There was no sample: only what an empty frame takes was learned.
    NoSamples,
    /// The time is not a positive finite number: nothing was learned.
    BadTime,
    /// The outlook is one of a volume of an earlier version: nothing was learned.
    Stale,
}

/// A frame whose time is asked for in different qualities.
#[derive(Clone, Copy, Debug)]
pub struct FrameModel<'a> {
    predictor: &'a FramePredictor,
    outlook: &'a Outlook,
}

impl<'a> FrameModel<'a> {
    pub(super) fn new(predictor: &'a FramePredictor, outlook: &'a Outlook) -> Self {
        Self { predictor, outlook }
    }

    /// What the frame will take in some quality.
    ///
    /// # Errors
    /// As [`FramePredictor::predict`].
    pub fn predict(&self, quality: Quality) -> Result<Prediction, PredictError> {
        self.predictor.predict(self.outlook, quality)
    }

    /// As [`FramePredictor::safe_step`].
    ///
    /// # Errors
    /// As there.
    pub fn safe_step(
        &self,
        pixels_per_ray: PixelsPerRay,
        target: f64,
    ) -> Result<f64, PredictError> {
        self.predictor
            .safe_step(self.outlook, pixels_per_ray, target)
    }
}
