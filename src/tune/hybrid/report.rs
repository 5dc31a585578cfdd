//! What a frame of a hybrid run was, for logs and pages.

use std::time::Duration;

use raywright_bvh::BuildParams;

use crate::tune::{
    probe::{Decision, ProbeRatio},
    session::TrialFailure,
    stage::FrameTimes,
};

/// What one frame was.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct HybridFrame {
    /// What was tried; `None`: the incumbent alone.
    pub candidate: Option<Candidate>,
    /// Time of the frame, builds and all.
    pub time: Duration,
    /// Its part in which trees were built.
    pub build: Duration,
    /// The parameters of the incumbent after the frame.
    pub incumbent: BuildParams,
    /// What a frame with the incumbent costs by the metric, in seconds, at the speed of these days.
    pub incumbent_cost: f64,
}

/// A candidate, and what became of it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Candidate {
    /// Its parameters.
    pub params: BuildParams,
    /// Why it was tried.
    pub reason: String,
    /// What was measured, or why nothing was.
    pub outcome: Result<Probed, TrialFailure>,
}

/// What was measured of a candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Probed {
    /// What a frame with it would take: its build as measured (that of the incumbent if it is the same), and
    /// rendering as its tiles say.
    pub times: FrameTimes,
    /// Time to render over that of the incumbent, in this frame.
    pub ratio: ProbeRatio,
    /// The cost by the metric over that of the incumbent, all probes of it together, and its bounds.
    pub cost_ratio: [f64; 3],
    /// The cost by the metric that the search was told, in seconds.
    pub cost: f64,
    /// The share of the tiles that were traced through the candidate.
    pub share: f64,
    /// What was decided.
    pub decision: Decision,
}
