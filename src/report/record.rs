//! What a tuning run leaves behind, as plain data: the JSON lines and the HTML page are made from
//! these values and from nothing else. Times are milliseconds of wall clock.
//!
//! Fields are added at the end and may be absent, so that logs of earlier versions are read.

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
    /// Name of what decides whether a frame is a trial, a probe or neither; absent: every frame is
    /// a trial.
    #[serde(default)]
    pub policy: Option<String>,
    /// How many frames a tree serves in the metric: a frame bears its share of the build.
    #[serde(default)]
    pub frames_per_tree: Option<f64>,
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
    /// What the whole frame took, build and everything; absent in logs that had no probes, where it
    /// is build and render.
    #[serde(default)]
    pub frame_ms: Option<f64>,
    /// How the candidate did on some tiles of the frame, if it was probed.
    #[serde(default)]
    pub probe: Option<ProbeRecord>,
    /// Why this configuration was asked for: `start`, or the words of a search. Absent if nothing
    /// was tried, as in frames of the incumbent alone (or `incumbent`), and in old logs.
    #[serde(default)]
    pub reason: Option<String>,
}

/// A candidate beside the incumbent in one frame: some tiles were rendered with each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProbeRecord {
    /// Share of the tiles of the frame that were rendered with the candidate, 0 to 1.
    pub share: f64,
    /// Pairs of tiles that were compared.
    pub pairs: usize,
    /// Time to render a tile with the candidate ÷ the same with the incumbent: geometric mean over
    /// the pairs; NaN if there are none, in a file `null`.
    #[serde(deserialize_with = "or_nan")]
    pub ratio: f64,
    /// One-sided lower bound of the ratio at 95 %; NaN if too few pairs give none, in a file
    /// `null`.
    #[serde(deserialize_with = "or_nan")]
    pub lower: f64,
    /// The upper bound; infinite if too few pairs give none, in a file `null`.
    #[serde(deserialize_with = "or_infinity")]
    pub upper: f64,
    /// `accepted`, `rejected`, `undecided`, `given up` or `failed`.
    pub decision: String,
}

fn or_nan<'de, D: serde::Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

fn or_infinity<'de, D: serde::Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::INFINITY))
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
