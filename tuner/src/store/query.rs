//! Asking for outcomes.
//!
//! Times of two machines are not comparable. Invariant: an outcome of another machine is handed out
//! only to those who ask for it, and then it is marked; an alias, which somebody has to record, is
//! the only way to make it a fact.

use super::alias::SameIds;
use super::body::{AliasOf, Body, TrialOpen, TrialOutcome};
use super::{Entry, MachineId, Records, SceneId, SpaceId};

/// What to do with outcomes of other machines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Others {
    /// Leave them out.
    #[default]
    Leave,
    /// Hand them out as [`Origin::Prior`].
    AsPrior,
}

/// What an outcome is to the machine that asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Measured on this machine.
    Fact,
    /// Measured on another one: a hint where to look, not a time to compare with.
    Prior,
}

/// Which outcomes are wanted.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Query {
    /// The machine that asks.
    pub machine: MachineId,
    /// Of this scene or an alias of it; `None`: of any.
    pub scene: Option<SceneId>,
    /// Of this space; `None`: of any.
    pub space: Option<SpaceId>,
    /// What to do with other machines.
    pub others: Others,
}

impl Query {
    /// All outcomes of `machine`, and of no other.
    pub fn new(machine: MachineId) -> Query {
        Query {
            machine,
            scene: None,
            space: None,
            others: Others::Leave,
        }
    }

    /// Only those of `scene`.
    #[must_use]
    pub fn with_scene(mut self, scene: SceneId) -> Query {
        self.scene = Some(scene);
        self
    }

    /// Only those of `space`.
    #[must_use]
    pub fn with_space(mut self, space: SpaceId) -> Query {
        self.space = Some(space);
        self
    }

    /// With or without those of other machines.
    #[must_use]
    pub fn with_others(mut self, others: Others) -> Query {
        self.others = others;
        self
    }
}

/// An outcome and its trial.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Measured<'a> {
    /// The record of the outcome: stamp and time.
    pub entry: &'a Entry,
    /// What was tried, and where.
    pub trial: &'a TrialOpen,
    /// How it ended.
    pub outcome: &'a TrialOutcome,
    /// What it is to the machine that asked.
    pub origin: Origin,
}

impl Records {
    /// The outcomes that `query` wants, in the order of their stamps. Outcomes whose trial is not
    /// in the set are left out, since nobody knows whose they are.
    pub fn outcomes(&self, query: &Query) -> Vec<Measured<'_>> {
        let mut machines = SameIds::of(self, AliasOf::Machine);
        let mut scenes = SameIds::of(self, AliasOf::Scene);
        let mut wanted = Vec::new();
        for (entry, trial, outcome) in self.ended() {
            let is_here = machines.are_same(trial.machine.as_str(), query.machine.as_str());
            let origin = match (is_here, query.others) {
                (true, _) => Origin::Fact,
                (false, Others::AsPrior) => Origin::Prior,
                (false, Others::Leave) => continue,
            };
            if query.space.as_ref().is_some_and(|id| *id != trial.space) {
                continue;
            }
            let scene = query.scene.as_ref();
            if scene.is_some_and(|id| !scenes.are_same(id.as_str(), trial.scene.as_str())) {
                continue;
            }
            wanted.push(Measured {
                entry,
                trial,
                outcome,
                origin,
            });
        }
        wanted
    }

    /// All outcomes with their trials.
    pub(crate) fn ended(&self) -> impl Iterator<Item = (&Entry, &TrialOpen, &TrialOutcome)> {
        self.iter().filter_map(|entry| {
            let Body::Outcome(outcome) = entry.body() else {
                return None;
            };
            match self.get(&outcome.trial)?.body() {
                Body::TrialOpen(trial) => Some((entry, trial, outcome)),
                _ => None,
            }
        })
    }
}
