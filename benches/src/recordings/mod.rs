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
    collections::{HashMap, HashSet},
    env,
    error::Error,
    path::{Path, PathBuf},
};

use raywright_tuner::{Config, Outcome, Space, predict::greedy_members};

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
    /// The part of the build in the cost of the second metric.
    pub build: f64,
}

impl Row {
    /// The configuration in a space of its data set.
    #[must_use]
    pub fn config(&self, kind: SpaceKind) -> &Config {
        &self.configs[kind as usize]
    }

    /// What a frame costs that has a probe of this configuration in a share of it, and that of another in the
    /// rest; builds are paid in full.
    #[must_use]
    pub fn probed(&self, share: f64, rest: &Row, metric: Metric) -> Option<f64> {
        let (own, other) = (self.costs?[metric as usize], rest.costs?[metric as usize]);
        let builds = match metric {
            Metric::Render => [0.0; 2],
            Metric::Total => [self.build, rest.build],
        };
        let casts = (own - builds[0]) * share + (other - builds[1]) * (1.0 - share);
        Some(casts + builds[0] + builds[1])
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
    /// The scene: the first word of the name.
    #[must_use]
    pub fn scene(&self) -> &str {
        self.name.split(' ').next().unwrap_or_default()
    }

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
    /// The configurations that together are good in all scenes but one, by a metric, the most useful first, of those
    /// that were recorded in all: what a tuner would begin with that knows the other scenes.
    ///
    /// # Errors
    /// If a cost is none.
    pub fn cover(
        &self,
        but: &str,
        metric: Metric,
        size: usize,
        kind: SpaceKind,
    ) -> Result<Vec<Config>, Box<dyn Error>> {
        let space = self.space(kind);
        let mut recorded_in: HashMap<&Config, usize> = HashMap::new();
        for problem in &self.problems {
            let configs: HashSet<&Config> = problem.rows.iter().map(|r| r.config(kind)).collect();
            for config in configs {
                *recorded_in.entry(config).or_default() += 1;
            }
        }
        let (mut configs, mut states) = (Vec::new(), Vec::new());
        for problem in self.problems.iter().filter(|p| p.scene() != but) {
            let mut state = Vec::new();
            for row in &problem.rows {
                let Some(costs) = row.costs else { continue };
                if recorded_in[row.config(kind)] < self.problems.len() {
                    continue;
                }
                let point = space.encode(row.config(kind));
                state.push((point.clone(), costs[metric as usize]));
                configs.push((point, row.config(kind)));
            }
            states.push(state);
        }
        let members = greedy_members(&states, size)?;
        let config = |member: Vec<f64>| {
            let own = configs.iter().find(|(point, _)| *point == member);
            own.map(|&(_, config)| config.clone())
        };
        Ok(members.into_iter().filter_map(config).collect())
    }

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
