//! What steering asks for: the time of the next frame in some quality.

use crate::predict::{FrameModel, PixelsPerRay, Quality};

/// What a frame is expected to take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Seconds; not a number where nothing can be said.
    pub time: f64,
    /// Standard deviation of the logarithm of the time.
    pub deviation: f64,
    /// 0 if frames like this one are known, towards 1 if there was none.
    pub novelty: f64,
}

/// Something that predicts the next frame.
pub trait TimeModel {
    /// What the frame will take in some quality.
    fn forecast(&self, quality: Quality) -> Forecast;

    /// The step, in lengths of a voxel, with which the frame holds `target` seconds whatever happens;
    /// infinite if there is none.
    fn safe_step(&self, pixels_per_ray: PixelsPerRay, target: f64) -> f64;
}

impl TimeModel for FrameModel<'_> {
    fn forecast(&self, quality: Quality) -> Forecast {
        match self.predict(quality) {
            Ok(prediction) => Forecast {
                time: prediction.time,
                deviation: prediction.deviation,
                novelty: prediction.novelty,
            },
            Err(_) => NoModel.forecast(quality),
        }
    }

    fn safe_step(&self, pixels_per_ray: PixelsPerRay, target: f64) -> f64 {
        FrameModel::safe_step(self, pixels_per_ray, target).unwrap_or(f64::INFINITY)
    }
}

/// Predicts nothing: for ways that do not ask.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoModel;

impl TimeModel for NoModel {
    fn forecast(&self, _quality: Quality) -> Forecast {
        Forecast {
            time: f64::NAN,
            deviation: 0.0,
            novelty: 1.0,
        }
    }

    fn safe_step(&self, _pixels_per_ray: PixelsPerRay, _target: f64) -> f64 {
        f64::INFINITY
    }
}
