//! What is recorded of each scene and camera, as features of a state.
//!
//! The tables hold 9 of the paper's 17 indicators: triangles, both points of the camera, field of view and
//! extent. Meshes, lights, materials and areas were not recorded. Bounds are the next power of ten.

use std::{collections::BTreeMap, error::Error, path::Path};

use raywright_tuner::{
    Scale,
    predict::{Feature, Features, PredictError, Subject},
};
use serde::Deserialize;

use crate::problems::Metric;

/// Pixels of the frame whose seconds are told.
const FRAME_PIXELS: f64 = 640.0 * 480.0;

#[derive(Clone, Debug, Deserialize)]
struct CameraRow {
    scene: String,
    cam: i64,
    triangles: f64,
    diagonal: f64,
    eye_x: f64,
    eye_y: f64,
    eye_z: f64,
    target_x: f64,
    target_y: f64,
    target_z: f64,
    vfov_deg: f64,
    width: f64,
    height: f64,
    ref_ms_median: f64,
    ref_build_ms_median: f64,
}

/// A scene seen by a camera.
#[derive(Clone, Debug)]
pub(crate) struct State {
    pub(crate) scene: String,
    pub(crate) features: Vec<f64>,
    /// Seconds of a frame with the weak default, for each metric.
    seconds: [f64; 2],
}

impl State {
    /// Seconds of a frame with the weak default: a cost of 1.
    pub(crate) fn seconds(&self, metric: Metric) -> f64 {
        self.seconds[metric as usize]
    }
}

pub(crate) fn features() -> Result<Features, PredictError> {
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

/// The states by the names of their problems.
pub(crate) fn states(folder: &Path) -> Result<BTreeMap<String, State>, Box<dyn Error>> {
    let mut states = BTreeMap::new();
    for row in csv::Reader::from_path(folder.join("cameras.csv"))?.deserialize() {
        let row: CameraRow = row?;
        let render = FRAME_PIXELS / (row.width * row.height) * row.ref_ms_median / 1e3;
        let state = State {
            features: vec![
                row.triangles,
                row.diagonal,
                row.eye_x,
                row.eye_y,
                row.eye_z,
                row.target_x,
                row.target_y,
                row.target_z,
                row.vfov_deg,
            ],
            seconds: [render, render + row.ref_build_ms_median / 1e3],
            scene: row.scene.clone(),
        };
        states.insert(format!("{} {}", row.scene, row.cam), state);
    }
    Ok(states)
}
