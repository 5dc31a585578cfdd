//! Golden trees: what Embree 4.4.0's `rtcBuildBVH` built from known triangles, as counts and
//! hashes in files of JSON lines, and whether ours are the same.
//!
//! Source: the README beside the files (folder `golden/trees` of the shared data), which defines
//! the sets, the hashes and the figures. The files were made on an AMD Zen 4 with one thread.
//!
//! What is compared, and what is not:
//! - every line by its ordered hash, its counts and its costs; the unordered hash tells a wrong
//!   order from a wrong tree;
//! - lines marked `tbb_sort` (Morton order with at least 1024 equal codes) by their number of
//!   references alone, because Embree itself gives them another tree on another number of cores;
//! - lines marked `rcp` only on processors with the reciprocal estimate of the golden machine.

mod cases;
mod check;
mod compare;
mod figures;
mod hash;
mod lines;
mod obj;
mod reciprocal;
mod scene_level;
mod sets;

use std::path::PathBuf;

pub use cases::{Case, Expectation, GoldenRay, Refusal, read_cases};
pub use compare::{Outcome, build, compare, parameters, split_budget};
pub use figures::Figures;
pub use hash::{Fnv, ordered, unordered};
pub use lines::{
    DebugTree, Expected, GoldenQuality, JsonNode, Line, SceneLevel, Steps, read_lines, tree_of_json,
};
pub use obj::read_obj;
pub use reciprocal::has_golden_reciprocal;
pub use scene_level::{compare_scene_level, scene_level_parameters};
#[cfg(feature = "embree")]
pub(crate) use sets::families;
pub use sets::{NAMES, procedural};

/// Why golden files or scenes could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GoldenError {
    /// A file that cannot be opened or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A line that is not what the README says.
    #[error("{}:{line}: {source}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// The number of the line, from 1.
        line: usize,
        /// What is wrong with it.
        source: serde_json::Error,
    },
    /// A line of a scene file that cannot be read.
    #[error("{}:{line}: {text:?} is not understood", path.display())]
    Obj {
        /// The file.
        path: PathBuf,
        /// The number of the line, from 1.
        line: usize,
        /// The line.
        text: String,
    },
}
