//! The tuning loop of BVH parameters: the glue between tree, path tracer and tuner.
//!
//! The way of a frame, after Herveau, Pfaffe, Tillmann, Tichy, Dachsbacher, *Analysis of
//! Acceleration Structure Parameters and Hybrid Autotuning for Ray Tracing*, section 3.3: ask the
//! tuner, build, render one sample per pixel, tell the tuner what it cost. The tracer does not
//! know that a tuner exists; the tuner is told numbers and knows no rays. The clock is an argument.

mod canonical;
mod comparison;
mod decision;
mod hybrid;
#[cfg(feature = "store")]
mod memory;
mod metric;
mod portfolio;
mod probe;
mod recording;
mod session;
mod space;
mod stage;

pub use comparison::{Baseline, Comparison, Measurement, milliseconds};
pub use decision::{KnownState, PredictorKind, decide, state_features};
pub use hybrid::{Candidate, DEFAULT_OVERHEAD, Hybrid, HybridFrame, Probed};
#[cfg(feature = "store")]
pub use memory::{Memory, indicator_facts};
pub use metric::Metric;
pub use portfolio::portfolio;
pub use probe::{Costs, Decision, Pair, ProbeRatio};
pub use recording::{Recorded, RecordedFrame, RecordedTree, Recorder, random_params};
pub use session::{FrameReport, SLOWEST_TRIAL, Session, TrialFailure};
pub use space::{ParameterSpace, SpaceAxes, SpaceFault, described};
pub use stage::{Clock, FrameTimes, SessionError, Settings, WallClock};
