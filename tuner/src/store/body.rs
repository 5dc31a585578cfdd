//! What a record says: one type per kind of record.
//!
//! Invariant: fields that this version does not know stay in `extra` and are written again; a
//! record whose fields do not have the expected form becomes [`Body::Other`], not an error.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use super::id::hash;
use super::space::SpaceFacts;
use super::{MachineId, SceneId, SpaceId, Stamp, StoreError};
use crate::{Config, Outcome, Space, SpaceError, Value};

/// Any JSON value.
pub type Json = serde_json::Value;

/// Fields of a JSON object by name.
pub type Fields = serde_json::Map<String, Json>;

/// What is known about a machine or a scene: names and values, as the caller tells them.
pub type Facts = BTreeMap<String, Fact>;

/// One told fact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Fact {
    /// Yes or no.
    Bool(bool),
    /// A count or size.
    Integer(i64),
    /// A measure; finite.
    Real(f64),
    /// A name.
    Text(String),
}

impl fmt::Display for Fact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Fact::Bool(value) => value.fmt(f),
            Fact::Integer(value) => value.fmt(f),
            Fact::Real(value) => value.fmt(f),
            Fact::Text(value) => value.fmt(f),
        }
    }
}

impl From<&str> for Fact {
    fn from(text: &str) -> Fact {
        Fact::Text(text.to_owned())
    }
}

impl From<i64> for Fact {
    fn from(value: i64) -> Fact {
        Fact::Integer(value)
    }
}

impl From<f64> for Fact {
    fn from(value: f64) -> Fact {
        Fact::Real(value)
    }
}

/// A machine that measures: processor, cores, instruction set, caches, memory, system, engine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Machine {
    /// Named by trials.
    pub id: MachineId,
    /// What was told. Whatever changes times should be part of it.
    pub facts: Facts,
    /// Fields of later versions.
    #[serde(flatten)]
    pub extra: Fields,
}

impl Machine {
    /// The machine with these facts; equal facts give equal ids.
    pub fn new(facts: Facts) -> Machine {
        Machine {
            id: MachineId::new(hash_of(&facts)),
            facts,
            extra: Fields::new(),
        }
    }
}

/// A scene that is measured: a hash of its geometry, its indicators.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Scene {
    /// Named by trials.
    pub id: SceneId,
    /// What was told.
    pub facts: Facts,
    /// Fields of later versions.
    #[serde(flatten)]
    pub extra: Fields,
}

impl Scene {
    /// The scene with these facts; equal facts give equal ids.
    pub fn new(facts: Facts) -> Scene {
        Scene {
            id: SceneId::new(hash_of(&facts)),
            facts,
            extra: Fields::new(),
        }
    }
}

/// What a search or a model wants to find again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct State {
    /// Whose state it is. The latest state of a name counts.
    pub name: String,
    /// The state.
    pub value: Json,
    /// Fields of later versions.
    #[serde(flatten)]
    pub extra: Fields,
}

impl State {
    /// The state `value` of `name`.
    pub fn new(name: &str, value: Json) -> State {
        State {
            name: name.to_owned(),
            value,
            extra: Fields::new(),
        }
    }
}

/// A configuration is about to be measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct TrialOpen {
    /// The space of the configuration.
    pub space: SpaceId,
    /// Where it is measured.
    pub machine: MachineId,
    /// On what it is measured.
    pub scene: SceneId,
    /// Values by parameter.
    pub config: BTreeMap<String, Value>,
    /// Why it is tried, for people.
    pub reason: String,
    /// Fields of later versions.
    #[serde(flatten)]
    pub extra: Fields,
}

impl TrialOpen {
    /// A trial of `config` on a machine and a scene.
    pub fn new(
        space: SpaceId,
        machine: MachineId,
        scene: SceneId,
        config: &Config,
        reason: &str,
    ) -> TrialOpen {
        let values = config.iter();
        TrialOpen {
            space,
            machine,
            scene,
            config: values
                .map(|(name, value)| (name.to_owned(), value))
                .collect(),
            reason: reason.to_owned(),
            extra: Fields::new(),
        }
    }

    /// The configuration as one of `space`.
    ///
    /// # Errors
    ///
    /// If it is none of that space.
    pub fn config_in(&self, space: &Space) -> Result<Config, SpaceError> {
        let values = self.config.iter();
        let given: Vec<(&str, Value)> = values.map(|(name, &v)| (name.as_str(), v)).collect();
        space.config(&given)
    }
}

/// How a trial ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct TrialOutcome {
    /// The record that opened the trial.
    pub trial: Stamp,
    /// Its end.
    pub outcome: Outcome,
    /// What else was measured, with the unit in the name: `build_ms`, `nodes`. Finite.
    pub measures: BTreeMap<String, f64>,
    /// Fields of later versions.
    #[serde(flatten)]
    pub extra: Fields,
}

impl TrialOutcome {
    /// The end of the trial that the record `trial` opened.
    pub fn new(trial: Stamp, outcome: Outcome) -> TrialOutcome {
        TrialOutcome {
            trial,
            outcome,
            measures: BTreeMap::new(),
            extra: Fields::new(),
        }
    }

    /// The same outcome with one more measure.
    #[must_use]
    pub fn with_measure(mut self, name: &str, value: f64) -> TrialOutcome {
        self.measures.insert(name.to_owned(), value);
        self
    }
}

/// A remark for people.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Note {
    /// The remark.
    pub text: String,
    /// Fields of later versions.
    #[serde(flatten)]
    pub extra: Fields,
}

impl Note {
    /// The remark `text`.
    pub fn new(text: &str) -> Note {
        Note {
            text: text.to_owned(),
            extra: Fields::new(),
        }
    }
}

/// Two ids that mean the same thing: a machine after an update that does not matter, say.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Alias {
    /// What the ids name.
    pub of: AliasOf,
    /// The ids, in any order.
    pub same: (String, String),
    /// Fields of later versions.
    #[serde(flatten)]
    pub extra: Fields,
}

/// What the ids of an alias name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum AliasOf {
    /// Machines.
    Machine,
    /// Scenes.
    Scene,
}

impl Alias {
    /// Measurements of one machine are facts about the other.
    pub fn of_machines(one: &MachineId, other: &MachineId) -> Alias {
        Alias::new(AliasOf::Machine, one.as_str(), other.as_str())
    }

    /// The two scenes are one.
    pub fn of_scenes(one: &SceneId, other: &SceneId) -> Alias {
        Alias::new(AliasOf::Scene, one.as_str(), other.as_str())
    }

    fn new(of: AliasOf, one: &str, other: &str) -> Alias {
        Alias {
            of,
            same: (one.to_owned(), other.to_owned()),
            extra: Fields::new(),
        }
    }
}

/// What a record says.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Body {
    /// Describes a space.
    Space(SpaceFacts),
    /// Describes a machine.
    Machine(Machine),
    /// Describes a scene.
    Scene(Scene),
    /// A state to be found again.
    State(State),
    /// Opens a trial.
    TrialOpen(TrialOpen),
    /// Ends a trial.
    Outcome(TrialOutcome),
    /// A remark.
    Note(Note),
    /// Makes two ids one.
    Alias(Alias),
    /// A record of a kind, or with fields, that this version does not know. Programs may write
    /// kinds of their own, from 1000 on.
    Other {
        /// Number of the kind.
        kind: u32,
        /// All fields but writer, sequence and time.
        fields: Fields,
    },
}

macro_rules! body_from {
    ($($variant:ident($type:ty)),*) => {
        $(impl From<$type> for Body {
            fn from(body: $type) -> Body {
                Body::$variant(body)
            }
        })*
    };
}

body_from!(
    Space(SpaceFacts),
    Machine(Machine),
    Scene(Scene),
    State(State),
    TrialOpen(TrialOpen),
    Outcome(TrialOutcome),
    Note(Note),
    Alias(Alias)
);

impl Body {
    /// Refuses numbers that JSON cannot hold and costs that no search accepts.
    pub(crate) fn check(&self) -> Result<(), StoreError> {
        let real = |value: &Value| match *value {
            Value::Real(value) => value,
            _ => 0.0,
        };
        match self {
            Body::Machine(Machine { facts, .. }) | Body::Scene(Scene { facts, .. }) => {
                all_finite(facts.iter().map(|(name, fact)| match *fact {
                    Fact::Real(value) => (name, value),
                    _ => (name, 0.0),
                }))
            }
            Body::TrialOpen(open) => {
                all_finite(open.config.iter().map(|(name, value)| (name, real(value))))
            }
            Body::Outcome(TrialOutcome {
                outcome, measures, ..
            }) => match *outcome {
                Outcome::Done { cost } if !(cost.is_finite() && cost >= 0.0) => {
                    Err(StoreError::BadCost { cost })
                }
                _ => all_finite(measures.iter().map(|(name, &value)| (name, value))),
            },
            // JSON in them is finite by its type; what is left is caught by reading it back.
            _ => Ok(()),
        }
    }
}

/// Refuses the first number that is not finite.
fn all_finite<'a>(mut numbers: impl Iterator<Item = (&'a String, f64)>) -> Result<(), StoreError> {
    match numbers.find(|(_, value)| !value.is_finite()) {
        Some((name, value)) => Err(StoreError::NotFinite {
            name: name.clone(),
            value,
        }),
        None => Ok(()),
    }
}

/// Hash of the JSON text of `facts`. Its names are sorted, so the text is unique.
fn hash_of(facts: &Facts) -> String {
    // Facts have text names and plain values, which always have a JSON text.
    hash(&serde_json::to_string(facts).unwrap_or_default())
}
