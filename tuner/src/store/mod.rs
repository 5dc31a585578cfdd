//! What was found, kept in files: an append-only log per writer.
//!
//! A [`Store`] is a folder with one log per [`Writer`]. A log is a row of records, each with a
//! checksum, its writer and a number; what is appended is never changed. Whatever happens to a
//! file, its good records are found and the rest is reported as [`Damage`], not as an error. The
//! logs of many writers and folders are one set of [`Records`], merged by writer and number.
//!
//! Outcomes belong to a machine: [`Records::outcomes`] hands out those of another one only on
//! request, and marked. Format: `frame.rs` for the bytes, `entry.rs` for the JSON in them.
//!
//! The store reads no clock and draws no names: times (seconds since 1970) and writer ids are told.
//! Not good for: millions of records, since reading takes all of them into memory.
//!
//! # Example
//!
//! ```
//! use raywright_tuner::store::{
//!     Fact, Facts, Machine, Query, Scene, SpaceFacts, Store, SyncPolicy, TrialOpen, TrialOutcome,
//!     WriterId,
//! };
//! use raywright_tuner::{Outcome, Param, Space, Value};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! let space = Space::new(vec![Param::boolean("steam", "Whether water is thrown in.")])?;
//! let described = SpaceFacts::new(&space);
//! let oven = Machine::new(Facts::from([("maker".to_owned(), Fact::from("Hearth & Sons"))]));
//! let dough = Scene::new(Facts::from([("rye".to_owned(), Fact::from(0.3))]));
//!
//! let store = Store::open(folder.path())?;
//! let mut writer = store.writer(&WriterId::new("baker-1")?, SyncPolicy::EachRecord)?;
//! writer.append(1.0e9, described.clone())?;
//! writer.append(1.0e9, oven.clone())?;
//! writer.append(1.0e9, dough.clone())?;
//! let config = space.config(&[("steam", Value::Bool(true))])?;
//! let (space_id, scene_id) = (described.id.clone(), dough.id.clone());
//! let open = TrialOpen::new(space_id, oven.id.clone(), scene_id, &config, "first try");
//! let trial = writer.append(1.0e9 + 1.0, open)?;
//! let outcome = TrialOutcome::new(trial, Outcome::Done { cost: 0.25 });
//! writer.append(1.0e9 + 2700.0, outcome.with_measure("crust_mm", 4.5))?;
//! writer.close()?;
//!
//! let records = store.read()?.records;
//! let measured = records.outcomes(&Query::new(oven.id));
//! assert_eq!(measured.len(), 1);
//! assert_eq!(measured[0].trial.config_in(&space)?, config);
//! # Ok(())
//! # }
//! ```

mod alias;
mod best;
mod body;
mod entry;
mod error;
mod export;
mod folder;
mod frame;
mod id;
mod lock;
mod log;
mod query;
mod records;
mod report;
mod space;
mod writer;

pub use best::Best;
pub use body::{
    Alias, AliasOf, Body, Fact, Facts, Fields, Json, Machine, Note, Scene, State, TrialOpen,
    TrialOutcome,
};
pub use entry::{Entry, kind_name};
pub use error::StoreError;
pub use folder::{Changed, Contents, Store};
pub use frame::{Damage, DamagePlace, FORMAT_VERSION, MAX_PAYLOAD_BYTES};
pub use id::{MachineId, SceneId, SpaceId, Stamp, WriterId};
pub use log::{LogFile, LogRecord};
pub use query::{Measured, Origin, Others, Query};
pub use records::Records;
pub use report::{FileReport, Stats, StoreReport};
pub use space::SpaceFacts;
pub use writer::{SyncPolicy, Writer};
