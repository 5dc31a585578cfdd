//! Recorded problems: for each scene and camera what every configuration took, by two metrics.
//!
//! Columns and their meaning are in the README beside the table. A cost is relative to the weak default
//! that was measured in turns with the configuration, so that drift of the machine cancels.

use std::{collections::BTreeMap, error::Error, path::Path};

use serde::Deserialize;

/// Pixels of the frame for which a tree is built, in the metric that counts builds.
const FRAME_PIXELS: f64 = 640.0 * 480.0;

/// What is minimised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Metric {
    /// Traversal alone.
    Render,
    /// One build and one frame of 480p.
    Total,
}

impl Metric {
    pub(crate) const ALL: [Self; 2] = [Self::Render, Self::Total];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Render => "render",
            Self::Total => "total 480p",
        }
    }
}

/// A row of the table.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Row {
    scene: String,
    pub(crate) name: String,
    pub(crate) quality: i64,
    pub(crate) branching: i64,
    pub(crate) max_depth: i64,
    pub(crate) block: i64,
    pub(crate) min_leaf: i64,
    pub(crate) max_leaf: i64,
    pub(crate) trav_cost: f64,
    pub(crate) int_cost: f64,
    compact: u8,
    fail: u8,
    cam: i64,
    render_ms: Option<f64>,
    ref_ms: Option<f64>,
    build_ms: Option<f64>,
    ref_build_ms: Option<f64>,
}

#[derive(Clone, Debug, Deserialize)]
struct CameraRow {
    scene: String,
    cam: i64,
    width: f64,
    height: f64,
    ref_ms_median: f64,
    ref_build_ms_median: f64,
}

/// What every recorded configuration took in a scene from a camera.
#[derive(Clone, Debug)]
pub(crate) struct Problem {
    /// Scene and camera.
    pub(crate) name: String,
    /// Configurations, and their costs by each metric; `None`: the build was refused.
    pub(crate) rows: Vec<(Row, Option<[f64; 2]>)>,
}

impl Problem {
    /// The cost of a configuration by its name.
    pub(crate) fn named(&self, name: &str, metric: Metric) -> Option<f64> {
        let row = self.rows.iter().find(|(row, _)| row.name == name)?;
        Some(row.1?[metric as usize])
    }

    /// The second lowest cost: the lowest of many noisy ones is luck.
    pub(crate) fn best(&self, metric: Metric) -> f64 {
        let costs = self
            .rows
            .iter()
            .filter_map(|(_, costs)| Some((*costs)?[metric as usize]));
        let mut costs: Vec<f64> = costs.collect();
        costs.sort_by(f64::total_cmp);
        costs[1]
    }
}

/// The problems of a folder, in the order of their names.
pub(crate) fn problems(folder: &Path) -> Result<Vec<Problem>, Box<dyn Error>> {
    let cameras: Vec<CameraRow> = csv::Reader::from_path(folder.join("cameras.csv"))?
        .deserialize()
        .collect::<Result<_, _>>()?;
    let rows: Vec<Row> = csv::Reader::from_path(folder.join("builder_table.csv"))?
        .deserialize()
        .collect::<Result<_, _>>()?;
    let mut problems = BTreeMap::new();
    for camera in &cameras {
        let name = format!("{} {}", camera.scene, camera.cam);
        let frames = FRAME_PIXELS / (camera.width * camera.height);
        // Leaves of triangle numbers are another way to store a tree, and no axis here.
        let own = rows.iter().filter(|row| {
            row.scene == camera.scene
                && row.compact == 0
                && (row.cam == camera.cam || row.fail == 1)
        });
        let mut seen: Vec<(Row, Option<[f64; 2]>)> = Vec::new();
        for row in own {
            let costs = match (
                row.fail,
                row.render_ms,
                row.ref_ms,
                row.build_ms,
                row.ref_build_ms,
            ) {
                (0, Some(render), Some(reference), Some(build), Some(_)) => {
                    let render = render / reference;
                    let frame = frames * camera.ref_ms_median;
                    let total = (frame * render + build) / (frame + camera.ref_build_ms_median);
                    Some([render, total])
                }
                (0, ..) => return Err(format!("{name}: a row without times").into()),
                _ => None,
            };
            // Repeats of a named configuration: the first is as good as any.
            let is_repeat =
                !row.name.is_empty() && seen.iter().any(|(other, _)| other.name == row.name);
            if !is_repeat {
                seen.push((row.clone(), costs));
            }
        }
        problems.insert(name.clone(), Problem { name, rows: seen });
    }
    Ok(problems.into_values().collect())
}
