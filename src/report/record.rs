//! What a tuning run leaves behind, as plain data: the JSON lines and the HTML page are made from
//! these values and from nothing else. Times are milliseconds of wall clock.

use serde::{Deserialize, Serialize};

/// The layout of the JSON lines; raised whenever a key changes its meaning.
pub const SCHEMA_VERSION: u32 = 1;

/// What was tuned, and how: the first line of a log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunHeader {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Version of raywright.
    pub version: String,
    /// The scene as named on the command line.
    pub scene: String,
    /// Triangles that are rendered.
    pub triangles: usize,
    /// Width of a frame in pixels.
    pub width: u32,
    /// Height of a frame in pixels.
    pub height: u32,
    /// Scattering events of a path, K.
    pub path_length: u32,
    /// What is minimised: `render` or `total` (build + render).
    pub metric: String,
    /// Name of the search.
    pub search: String,
    /// Seed of the search and of the pictures.
    pub seed: u64,
    /// Threads that build and render.
    pub threads: usize,
    /// Instruction set of the traversal kernels.
    pub instruction_set: String,
    /// How many frames were asked for.
    pub frames_planned: usize,
    /// The 17 scene indicators: name and value.
    pub indicators: Vec<(String, f64)>,
}

/// One frame of the search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameRecord {
    /// Number of the frame, from 0.
    pub frame: usize,
    /// The configuration that was tried: parameter name and value, as text.
    pub config: Vec<(String, String)>,
    /// Time to build the tree; absent if the build failed.
    pub build_ms: Option<f64>,
    /// Time to render one sample per pixel; absent if the build failed.
    pub render_ms: Option<f64>,
    /// What the search was told; absent if the build failed.
    pub cost_ms: Option<f64>,
    /// Why the build failed, if it did.
    pub failure: Option<String>,
    /// The lowest cost so far, this frame included.
    pub incumbent_cost_ms: Option<f64>,
    /// Whether this frame became the incumbent.
    pub is_incumbent: bool,
}

/// Median and quartiles of repeated measurements.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The lower quartile.
    pub lower: f64,
    /// The upper quartile.
    pub upper: f64,
}

/// One row of the interleaved comparison at the end of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComparisonRow {
    /// `tuned`, or the name of the baseline.
    pub name: String,
    /// Its configuration: parameter name and value, as text.
    pub config: Vec<(String, String)>,
    /// Time to build.
    pub build_ms: Spread,
    /// Time to render one sample per pixel.
    pub render_ms: Spread,
    /// The metric that was tuned.
    pub cost_ms: Spread,
    /// Cost of this row ÷ cost of the tuned row, paired round by round: above 1, tuning won.
    pub cost_ratio_to_tuned: Spread,
}

/// The last line of a log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunSummary {
    /// How many rounds the comparison interleaved.
    pub rounds: usize,
    /// The rows: tuned first, then the baselines.
    pub comparison: Vec<ComparisonRow>,
    /// Whether the run was interrupted before all planned frames were done.
    pub interrupted: bool,
}

/// A whole run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// What was tuned, and how.
    pub header: RunHeader,
    /// The frames in order.
    pub frames: Vec<FrameRecord>,
    /// The comparison with the baselines; absent while the run goes on.
    pub summary: Option<RunSummary>,
}
