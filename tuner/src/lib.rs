//! Online search of parameters by ask and tell.
//!
//! A [`Space`] describes parameters as data: ranges, conditions, constraints, and which
//! configurations are known to do the same. A [`Tuner`] hands out configurations to try and is told
//! what they cost; a [`Search`] behind it decides where to look. Several trials may be open at
//! once. The crate knows nothing about what is tuned. It reads no clock and draws no randomness
//! but from the seed it is given, so every run can be replayed. Only `store`, behind the
//! feature of that name (default), touches files.
//!
//! # Example
//!
//! A baker who wants his bread dark, but not black:
//!
//! ```
//! use raywright_tuner::{Outcome, Param, Scale, Space, Tuner, Value, search_by_name};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let space = Space::new(vec![
//!     Param::integer("celsius", 160..=260, Scale::Linear, "Temperature of the oven."),
//!     Param::real("hours", 0.25..=2.0, Scale::Log, "Time in the oven."),
//!     Param::boolean("steam", "Whether water is thrown in."),
//! ])?;
//! let usual = space.config(&[
//!     ("celsius", Value::Integer(200)),
//!     ("hours", Value::Real(1.0)),
//!     ("steam", Value::Bool(false)),
//! ])?;
//!
//! let search = search_by_name("nelder-mead").expect("a name in SEARCH_NAMES");
//! let mut tuner = Tuner::new(space, search, 42).with_start(usual);
//! for _ in 0..60 {
//!     let trial = tuner.ask();
//!     let celsius = trial.config.integer("celsius").unwrap() as f64;
//!     let hours = trial.config.real("hours").unwrap();
//!     let crust = if trial.config.boolean("steam").unwrap() { 0.0 } else { 5.0 };
//!     let outcome = if celsius * hours > 400.0 {
//!         Outcome::Failed { reason: "burnt".to_owned() }
//!     } else {
//!         Outcome::Done { cost: (celsius - 230.0).abs() + 100.0 * (hours - 0.75).abs() + crust }
//!     };
//!     tuner.tell(trial.id, outcome)?;
//! }
//! let best = tuner.incumbent().expect("some bread came out");
//! assert!(best.cost < 20.0, "{} costs {}", best.config, best.cost);
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]

mod axis;
mod canon;
mod change;
mod config;
pub mod conformance;
mod error;
mod linear;
mod param;
pub mod predict;
mod record;
pub mod replay;
mod rng;
mod search;
mod space;
#[cfg(feature = "store")]
pub mod store;
mod trial;
mod tuner;

pub use canon::CanonRule;
pub use change::ChangeDetector;
pub use config::{Config, Value};
pub use error::{SpaceError, TellError};
pub use param::{Condition, Kind, Param, Scale};
pub use record::Record;
pub use search::{
    Estimate, GaussianProcess, LatinHypercubeNelderMead, Proposal, Random, SEARCH_NAMES, Search,
    search_by_name,
};
pub use space::Space;
pub use trial::{Outcome, Reason, Told, Trial, TrialId};
pub use tuner::Tuner;
