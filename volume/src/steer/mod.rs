//! Which quality the next frame is drawn in, so that it takes a given time.
//!
//! | module | what it answers |
//! | --- | --- |
//! | `mode` | what is drawn next, in each of five ways |
//! | `ladder` | the quality that a prediction asks for |
//! | `search` | the step whose predicted time is the target |
//! | `inside` | the step of the next part of a frame that has begun |
//! | `model` | what steering asks a predictor |
//! | `clock` | what a frame takes on a machine of known costs |
//!
//! Invariants: nothing here reads a clock, times are told; a steering is a function of what it was
//! told, in order; a step that it gives is finite and within its limits.

mod clock;
mod inside;
mod ladder;
mod mode;
mod model;
mod search;

pub(crate) use clock::unit;
pub use clock::{SpeedChange, WorkClock};
pub use inside::{Inside, InsideParams, PartRatios, PartShare, part_shares};
pub use mode::{Mode, Next, Pass, Resolution, Steering, SteeringError, SteeringParams};
pub use model::{Forecast, NoModel, TimeModel};
pub use search::{MAX_EVALUATIONS, SearchEnd, StepFound, StepLimits, TOLERANCE, search_step};
