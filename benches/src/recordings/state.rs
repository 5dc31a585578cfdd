//! What is known of each scene and camera, as features of a state.
//!
//! The tables hold 9 of the paper's 17 indicators: triangles, both points of the camera, field of view and
//! extent. Meshes, lights, materials and areas were not recorded. Bounds are the next power of ten.

use raywright_tuner::{
    Scale,
    predict::{Feature, Features, PredictError, Subject},
};

use super::Metric;

/// A scene seen by a camera.
#[derive(Clone, Debug)]
pub struct State {
    /// The scene.
    pub scene: String,
    /// As [`features`] says.
    pub features: Vec<f64>,
    /// Seconds of a frame with the weak default, for each metric.
    pub(super) seconds: [f64; 2],
}

impl State {
    /// Seconds of a frame with the weak default: a cost of 1.
    #[must_use]
    pub fn seconds(&self, metric: Metric) -> f64 {
        self.seconds[metric as usize]
    }
}

/// The features of a state, in their order.
///
/// # Errors
/// If a range is none.
pub fn features() -> Result<Features, PredictError> {
    let place = |name| Feature::new(name, -1e3, 1e3, Scale::Linear, Subject::View);
    Features::new(vec![
        Feature::new("triangles", 1.0, 1e7, Scale::Log, Subject::Scene),
        Feature::new("extent", 1e-2, 1e4, Scale::Log, Subject::Scene),
        place("eye_x"),
        place("eye_y"),
        place("eye_z"),
        place("target_x"),
        place("target_y"),
        place("target_z"),
        Feature::new("field of view", 0.0, 180.0, Scale::Linear, Subject::View),
    ])
}
