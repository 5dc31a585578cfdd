//! Which quality the next frame is drawn in, so that it takes a given time.
//!
//! Invariants: nothing here reads a clock, times are told; a steering is a function of what it was
//! told, in order; a step that it gives is finite and within its limits.

mod clock;
mod search;

pub use clock::{SpeedChange, WorkClock};
pub use search::{MAX_EVALUATIONS, SearchEnd, StepFound, StepLimits, TOLERANCE, search_step};
