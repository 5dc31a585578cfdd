//! The tables of the shared data: `builder_table.csv` and `cameras.csv`.
//!
//! Columns and their meaning are in the README beside them. The weak default is the reference of every row.

use std::{collections::BTreeMap, error::Error, path::Path};

use serde::Deserialize;

use super::{DataSet, FRAME_PIXELS, Problem, Row, SpaceKind, State};

/// A row of the table of configurations.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct TableRow {
    scene: String,
    name: String,
    pub(super) quality: i64,
    pub(super) branching: i64,
    pub(super) max_depth: i64,
    pub(super) block: i64,
    pub(super) min_leaf: i64,
    pub(super) max_leaf: i64,
    pub(super) trav_cost: f64,
    pub(super) int_cost: f64,
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

impl CameraRow {
    /// Frames as large as that of the camera in one of 480p.
    fn frames(&self) -> f64 {
        FRAME_PIXELS / (self.width * self.height)
    }

    fn state(&self) -> State {
        let render = self.frames() * self.ref_ms_median / 1e3;
        State {
            scene: self.scene.clone(),
            features: vec![
                self.triangles,
                self.diagonal,
                self.eye_x,
                self.eye_y,
                self.eye_z,
                self.target_x,
                self.target_y,
                self.target_z,
                self.vfov_deg,
            ],
            seconds: [render, render + self.ref_build_ms_median / 1e3],
        }
    }

    /// The part of the build in the cost that counts it.
    fn build(&self, row: &TableRow) -> f64 {
        let whole = self.frames() * self.ref_ms_median + self.ref_build_ms_median;
        row.build_ms.unwrap_or(0.0) / whole
    }

    /// The costs of a row; `None` if its build was refused.
    fn costs(&self, row: &TableRow) -> Result<Option<[f64; 2]>, Box<dyn Error>> {
        if row.fail != 0 {
            return Ok(None);
        }
        let (Some(render), Some(reference), Some(build), Some(_)) =
            (row.render_ms, row.ref_ms, row.build_ms, row.ref_build_ms)
        else {
            return Err(format!("{} {}: a row without times", self.scene, self.cam).into());
        };
        let render = render / reference;
        let frame = self.frames() * self.ref_ms_median;
        let total = (frame * render + build) / (frame + self.ref_build_ms_median);
        Ok(Some([render, total]))
    }
}

/// The problems of a folder; `None` if it has no such table.
pub(super) fn read(folder: &Path) -> Result<Option<DataSet>, Box<dyn Error>> {
    let table = folder.join("builder_table.csv");
    if !table.is_file() {
        return Ok(None);
    }
    let cameras: Vec<CameraRow> = csv::Reader::from_path(folder.join("cameras.csv"))?
        .deserialize()
        .collect::<Result<_, _>>()?;
    let rows: Vec<TableRow> = csv::Reader::from_path(table)?
        .deserialize()
        .collect::<Result<_, _>>()?;
    let spaces = [SpaceKind::Printed.space()?, SpaceKind::Canonical.space()?];
    let mut problems = BTreeMap::new();
    for camera in &cameras {
        // Leaves of triangle numbers are another way to store a tree, and no axis here.
        let own = rows.iter().filter(|row| {
            row.scene == camera.scene
                && row.compact == 0
                && (row.cam == camera.cam || row.fail == 1)
        });
        let mut seen: Vec<Row> = Vec::new();
        for row in own {
            // Repeats of a named configuration: the first is as good as any.
            if !row.name.is_empty() && seen.iter().any(|other| other.name == row.name) {
                continue;
            }
            seen.push(Row {
                name: row.name.clone(),
                configs: [
                    SpaceKind::Printed.config(&spaces[0], row)?,
                    SpaceKind::Canonical.config(&spaces[1], row)?,
                ],
                costs: camera.costs(row)?,
                build: camera.build(row),
            });
        }
        let name = format!("{} {}", camera.scene, camera.cam);
        let problem = Problem {
            name: name.clone(),
            state: Some(camera.state()),
            rows: seen,
        };
        problems.insert(name, problem);
    }
    Ok(Some(DataSet {
        name: "shared tables".into(),
        spaces,
        problems: problems.into_values().collect(),
    }))
}
