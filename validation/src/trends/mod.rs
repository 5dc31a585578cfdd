//! Does each parameter push build time, trace time, SAH cost and memory in the same direction for us as for Embree?
//!
//! One parameter is swept over a few values, the others stay at a default ([`Sweep`]). What is compared:
//! - Parameters of the builder: ours is [`Hierarchy`](raywright_bvh::Hierarchy), Embree's is `rtcBuildBVH`, its
//!   counterpart; each build begins without memory of the last. Embree cannot trace what its builder makes, as the
//!   nodes are the caller's. So **Embree's tree is traced by our kernels**: our builder makes the same tree once more
//!   with Embree's rounding and gives it our layout, and this is believed only if the tree that was read back from
//!   Embree is the same to the last bit. Where it is not, that value has no trace time and no counts for Embree.
//!   Trace time and counts of work thus tell trees apart, never kernels.
//! - The three flags (`dynamics`, `leaf_format`, `accuracy`), which `rtcBuildBVH` does not have: ours is
//!   [`Bvh`](raywright_bvh::Bvh), Embree's a scene of its own, committed anew each time and traced by Embree's own
//!   kernels. Here trace times tell kernels apart too. Embree tells no counts and no cost of its scenes. Our
//!   workspace lives through all rounds, so that `dynamic` can keep what it keeps.
//! - SAH cost is by the default's costs and block size, whatever the sweep, so that it is one yardstick.
//! - Memory of ours is that of the tree in its layout, triangles included, and of what the workspace of a flag's sweep
//!   keeps; Embree's is what the library tells its memory monitor of after the build, which comes in blocks, and holds
//!   ids alone where `rtcBuildBVH` built it.
//!
//! Direction: Spearman's rank correlation ρ of value and quantity within a round, then the mean over rounds, with a
//! bootstrap interval over rounds (Efron, Tibshirani, *An Introduction to the Bootstrap*, 1993, section 13.3). Ranks
//! within a round do not see drift from round to round. ρ does not see a quantity that falls and rises again: look
//! at the plots. Counts, costs and memory are the same in each round, and have an interval of no length.

mod correlation;
mod measure;
mod page;
mod subject;
mod sweep;

use raywright_bvh::BuildError;

use crate::embree::EmbreeError;

pub use correlation::{Agreement, Correlation, spearman};
pub use measure::{Swept, sweep};
pub use page::page;
pub use subject::Subject;
pub use sweep::{SWEEPS, Sweep};

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Quantity {
    /// Milliseconds of a build.
    BuildTime,
    /// Nanoseconds of a ray.
    TraceTime,
    /// Nodes whose child boxes are tested, per ray.
    NodesVisited,
    /// Blocks of four triangles that are tested, per ray.
    BlocksTested,
    /// Expected cost of a line, by the default's costs.
    SahCost,
    /// Inner nodes and leaves.
    TreeNodes,
    /// Bytes held after a build.
    Memory,
}

impl Quantity {
    /// All, in the order of tables.
    pub const ALL: [Self; 7] = [
        Self::BuildTime,
        Self::TraceTime,
        Self::NodesVisited,
        Self::BlocksTested,
        Self::SahCost,
        Self::TreeNodes,
        Self::Memory,
    ];

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::BuildTime => "build time",
            Self::TraceTime => "trace time",
            Self::NodesVisited => "nodes visited",
            Self::BlocksTested => "blocks tested",
            Self::SahCost => "SAH cost",
            Self::TreeNodes => "tree nodes",
            Self::Memory => "memory",
        }
    }

    /// Its unit; empty for a number.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::BuildTime => "ms",
            Self::TraceTime => "ns/ray",
            Self::NodesVisited | Self::BlocksTested => "1/ray",
            Self::SahCost | Self::TreeNodes => "",
            Self::Memory => "bytes",
        }
    }
}

/// Measurements of one quantity of one engine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Which values of the sweep were measured, ascending.
    pub places: Vec<usize>,
    /// The measurements of each round, one for each of `places`; of what does not change, one round.
    pub rounds: Vec<Vec<f64>>,
}

impl Series {
    /// The median over rounds, one for each of `places`.
    #[must_use]
    pub fn medians(&self) -> Vec<f64> {
        (0..self.places.len())
            .map(|place| {
                let mut all: Vec<f64> = self.rounds.iter().map(|round| round[place]).collect();
                all.sort_by(f64::total_cmp);
                let middle = all.len() / 2;
                if all.len() % 2 == 1 {
                    all[middle]
                } else {
                    0.5 * (all[middle - 1] + all[middle])
                }
            })
            .collect()
    }

    /// The median at the last value over that at the first; not a number where there is none.
    #[must_use]
    pub fn change(&self) -> f64 {
        match self.medians()[..] {
            [first, .., last] => last / first,
            _ => f64::NAN,
        }
    }
}

/// One parameter, one quantity, one scene; both engines.
#[derive(Clone, Debug)]
pub struct Trend {
    /// The scene.
    pub scene: String,
    /// What was swept.
    pub sweep: &'static Sweep,
    /// What was measured.
    pub quantity: Quantity,
    /// Of ours and of Embree's.
    pub series: [Series; 2],
    /// The same order.
    pub correlations: [Correlation; 2],
}

impl Trend {
    /// The trend of two series.
    #[must_use]
    pub fn new(
        scene: &str,
        sweep: &'static Sweep,
        quantity: Quantity,
        series: [Series; 2],
    ) -> Self {
        let correlations = [0, 1].map(|engine| Correlation::of(&series[engine].rounds));
        Self {
            scene: scene.to_owned(),
            sweep,
            quantity,
            series,
            correlations,
        }
    }

    /// Whether both go the same way.
    #[must_use]
    pub fn agreement(&self) -> Agreement {
        Agreement::of(&self.correlations[0], &self.correlations[1])
    }
}

/// The names of the engines, in the order of [`Trend::series`].
pub const ENGINES: [&str; 2] = ["ours", "Embree"];

/// Why nothing was measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrendsError {
    /// Our builder refused what has to be possible.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// Embree did.
    #[error(transparent)]
    Embree(#[from] EmbreeError),
    /// A scene that is no mesh.
    #[error("{scene}: {why}")]
    Scene {
        /// Which.
        scene: String,
        /// What is wrong with it.
        why: String,
    },
    /// A plot could not be drawn.
    #[error("plot: {0}")]
    Plot(String),
}
