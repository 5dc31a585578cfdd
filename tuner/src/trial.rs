//! What goes between the tuner and its user: trials out, outcomes in.

use std::fmt;

use crate::Config;

/// Number of a trial within its tuner, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TrialId(pub(crate) u64);

impl TrialId {
    /// The number.
    pub fn get(self) -> u64 {
        self.0
    }
}

impl fmt::Display for TrialId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "trial {}", self.0)
    }
}

/// A configuration to be measured. Open until it is told.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Names the trial in [`Tuner::tell`](crate::Tuner::tell).
    pub id: TrialId,
    /// What to run.
    pub config: Config,
    /// The key under which it is recorded.
    pub canonical: Config,
    /// Why it is asked.
    pub reason: Reason,
}

/// Why a trial is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reason {
    /// A given starting configuration.
    Start,
    /// Not asked at all: its outcome was known.
    Known,
    /// Proposed by the search.
    Proposed {
        /// Name of the search.
        search: &'static str,
        /// Name of its move.
        step: &'static str,
    },
    /// A random configuration that is new, because the search proposed known ones only.
    Replacement,
    /// Nothing new was found: a known configuration once more, the incumbent if there is one.
    Replicate,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::Start => f.write_str("start"),
            Reason::Known => f.write_str("known"),
            Reason::Proposed { search, step } => write!(f, "{search}: {step}"),
            Reason::Replacement => f.write_str("replacement"),
            Reason::Replicate => f.write_str("replicate"),
        }
    }
}

/// How a trial ended.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "store", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "store", serde(rename_all = "snake_case"))]
pub enum Outcome {
    /// It was measured.
    Done {
        /// What is minimised; finite and at least 0.
        cost: f64,
    },
    /// It could not be run, and would not run another time: its canonical form is avoided.
    Failed {
        /// For the record.
        reason: String,
    },
    /// It was not run, for a reason that says nothing about it: as if never asked.
    Cancelled,
}

/// What an outcome changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Told {
    /// The configuration of the trial is the best known one now.
    pub is_incumbent: bool,
}
