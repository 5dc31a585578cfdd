//! Recorded problems: for each scene and camera what every configuration took, by two metrics, so that
//! searches and predictors are judged without one frame.
//!
//! A data set is the tables of the shared data (`shared.rs`) or all recordings of a folder (`own.rs`), with its
//! own two spaces. A cost is relative to the weak default, and was measured in turns with a reference, so that
//! drift of the machine cancels.

mod own;
mod shared;
mod spaces;
mod state;

use std::{
    env,
    error::Error,
    path::{Path, PathBuf},
};

use raywright_tuner::{Config, Outcome, Space};

pub use spaces::SpaceKind;
pub use state::{State, features};

/// Pixels of the frame for which a tree is built, in the metric that counts builds.
const FRAME_PIXELS: f64 = 640.0 * 480.0;

/// The name of the weak default: costs are relative to its.
pub const WEAK: &str = "weak2";

/// Known-good configurations: strong default, the same with spatial splits, Morton order.
pub const PORTFOLIO: &[&str] = &["strong8", "strong8hq", "morton8"];

/// What is minimised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// Traversal alone.
    Render,
    /// One build and one frame of 480p.
    Total,
}

impl Metric {
    /// All of them, in the order of costs.
    pub const ALL: [Self; 2] = [Self::Render, Self::Total];

    /// What tables call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Render => "render",
            Self::Total => "total 480p",
        }
    }
}

/// A configuration that was recorded.
#[derive(Clone, Debug)]
pub struct Row {
    /// Empty, or [`WEAK`], or one of [`PORTFOLIO`], or another.
    pub name: String,
    /// In each space.
    configs: [Config; 2],
    /// By each metric; `None`: the build was refused.
    pub costs: Option<[f64; 2]>,
}

impl Row {
    /// The configuration in a space of its data set.
    #[must_use]
    pub fn config(&self, kind: SpaceKind) -> &Config {
        &self.configs[kind as usize]
    }

    /// What a tuner is told of it.
    #[must_use]
    pub fn outcome(&self, metric: Metric) -> Outcome {
        match self.costs {
            Some(costs) => Outcome::Done {
                cost: costs[metric as usize],
            },
            None => Outcome::Failed {
                reason: "the depth limit was reached".into(),
            },
        }
    }
}

/// What every recorded configuration took in a scene from a camera.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Scene and camera.
    pub name: String,
    /// What predictors are told of it; `None` if nobody knows where its camera stands.
    pub state: Option<State>,
    /// Configurations, in the order in which they were recorded.
    pub rows: Vec<Row>,
}

impl Problem {
    /// The row with a name.
    #[must_use]
    pub fn row(&self, name: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.name == name)
    }

    /// The cost of a configuration by its name.
    #[must_use]
    pub fn named(&self, name: &str, metric: Metric) -> Option<f64> {
        Some(self.row(name)?.costs?[metric as usize])
    }

    /// The second lowest cost: the lowest of many noisy ones is luck. Infinite if there are none.
    #[must_use]
    pub fn best(&self, metric: Metric) -> f64 {
        let costs = self.rows.iter().filter_map(|row| row.costs);
        let mut costs: Vec<f64> = costs.map(|costs| costs[metric as usize]).collect();
        costs.sort_by(f64::total_cmp);
        costs.get(1).copied().unwrap_or(f64::INFINITY)
    }
}

/// Problems whose configurations are of the same spaces.
#[derive(Clone, Debug)]
pub struct DataSet {
    /// What tables call it.
    pub name: String,
    spaces: [Space; 2],
    /// In the order of their names.
    pub problems: Vec<Problem>,
}

impl DataSet {
    /// A space that all configurations have a place in.
    #[must_use]
    pub fn space(&self, kind: SpaceKind) -> &Space {
        &self.spaces[kind as usize]
    }
}

/// The data sets of a folder, or without one the shared tables and our own recordings, where there are any.
/// Says on standard output what is not there.
///
/// # Errors
/// If a file cannot be read or is no such table.
pub fn data_sets(folder: Option<&Path>) -> Result<Vec<DataSet>, Box<dyn Error>> {
    // Cargo names this crate's folder to what it runs; otherwise the current folder is taken for it.
    let member = env::var_os("CARGO_MANIFEST_DIR").map_or_else(PathBuf::new, PathBuf::from);
    let folders = match folder {
        Some(folder) => vec![folder.to_owned()],
        None => vec![
            member.join("../../shared/data/tuning"),
            member.join("recordings"),
        ],
    };
    let mut sets = Vec::new();
    for folder in &folders {
        let set = match shared::read(folder)? {
            Some(set) => Some(set),
            None => own::read(folder)?,
        };
        match set {
            Some(set) => sets.push(set),
            None => println!("{} has no recorded problems", folder.display()),
        }
    }
    Ok(sets)
}

/// The folder and the number that were named, in any order, behind the options which `cargo bench` hands on.
#[must_use]
pub fn arguments() -> (Option<PathBuf>, Option<u64>) {
    let (mut folder, mut number) = (None, None);
    for given in env::args().skip(1).filter(|arg| !arg.starts_with('-')) {
        match given.parse() {
            Ok(own) => number = Some(own),
            Err(_) => folder = Some(PathBuf::from(given)),
        }
    }
    (folder, number)
}
