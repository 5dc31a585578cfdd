//! The tuning loop of BVH parameters: the glue between tree, path tracer and tuner.
//!
//! The way of a frame, after Herveau, Pfaffe, Tillmann, Tichy, Dachsbacher, *Analysis of
//! Acceleration Structure Parameters and Hybrid Autotuning for Ray Tracing*, section 3.3: ask the
//! tuner, build, render one sample per pixel, tell the tuner what it cost. The tracer does not
//! know that a tuner exists; the tuner is told numbers and knows no rays. The clock is an argument.

mod canonical;
mod comparison;
#[cfg(feature = "store")]
mod memory;
mod portfolio;
mod recording;
mod session;
mod space;

pub use comparison::{Baseline, Comparison, Measurement, milliseconds};
#[cfg(feature = "store")]
pub use memory::Memory;
pub use portfolio::portfolio;
pub use recording::{Recorded, RecordedFrame, RecordedTree, Recorder, random_params};
pub use session::{
    Clock, FrameReport, FrameTimes, Metric, SLOWEST_TRIAL, Session, SessionError, Settings,
    TrialFailure, WallClock,
};
pub use space::{ParameterSpace, SpaceAxes, SpaceFault, described};
