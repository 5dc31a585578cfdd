//! What runs leave for later ones: every trial of a session in a store, and what is known of the same
//! machine, scene and space told to a tuner before its first trial.
//!
//! Invariants: a trial is in the store before it is rendered, so that one that takes the program with it
//! is known as well; times are kept apart by build and rendering, so that a run may have another metric
//! than those before. Times of another machine are never told: [`Query`] leaves them out.

use raywright_tracer::{INDICATORS, Indicators};
use raywright_tuner::{
    Config, Outcome, Space, SpaceError, Trial,
    store::{
        Fact, Facts, Machine, Query, Records, Scene, SpaceFacts, Stamp, Store, StoreError,
        TrialOpen, TrialOutcome, Writer,
    },
};

use super::{FrameTimes, KnownState, Metric};

/// Seconds of building and rendering, as measures of outcomes.
const MEASURES: [&str; 2] = ["build_s", "render_s"];

/// What the names of facts of a scene begin with that are its indicators.
const INDICATOR: &str = "indicator ";

/// Facts of a scene that only describe it.
const DESCRIPTIONS: [&str; 2] = ["name", "triangles"];

/// Indicators as facts of a scene, which [`Memory::states`] reads.
pub fn indicator_facts(indicators: &Indicators) -> impl Iterator<Item = (String, Fact)> {
    let named = indicators.named();
    named.map(|(name, value)| (format!("{INDICATOR}{name}"), Fact::from(value)))
}

/// The state of a scene; `None` if an indicator is missing.
fn state_of(scene: &Scene) -> Option<Vec<f64>> {
    let value = |name: &str| match scene.facts.get(&format!("{INDICATOR}{name}"))? {
        Fact::Real(value) => Some(*value),
        Fact::Integer(value) => Some(*value as f64),
        _ => None,
    };
    INDICATORS.iter().map(|(name, ..)| value(name)).collect()
}

/// A log of one session, and what earlier ones left.
#[derive(Debug)]
pub struct Memory {
    writer: Writer,
    records: Records,
    space: SpaceFacts,
    machine: Machine,
    scene: Scene,
}

impl Memory {
    /// Reads a store, and begins a log with what `writer` keeps, at `time` (seconds since 1970). What
    /// changes times should be a fact of the machine or of the scene.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn new(
        store: &Store,
        mut writer: Writer,
        time: f64,
        space: &Space,
        machine: Machine,
        scene: Scene,
    ) -> Result<Self, StoreError> {
        let space = SpaceFacts::new(space);
        let records = store.read()?.records;
        // Told once: each log would repeat them otherwise.
        if records.space(&space.id).is_none() {
            writer.append(time, space.clone())?;
        }
        if records.machine(&machine.id).is_none() {
            writer.append(time, machine.clone())?;
        }
        if records.scene(&scene.id).is_none() {
            writer.append(time, scene.clone())?;
        }
        Ok(Self {
            writer,
            records,
            space,
            machine,
            scene,
        })
    }

    /// The outcomes of earlier runs on this machine with this scene and space, in the order of their
    /// writers, their cost by `metric`. Cancelled trials say nothing.
    ///
    /// # Errors
    /// If a configuration is none of the space.
    pub fn known(
        &self,
        space: &Space,
        metric: Metric,
    ) -> Result<Vec<(Config, Outcome)>, SpaceError> {
        let query = Query::new(self.machine.id.clone())
            .with_scene(self.scene.id.clone())
            .with_space(self.space.id.clone());
        let mut known = Vec::new();
        for measured in self.records.outcomes(&query) {
            let outcome = match &measured.outcome.outcome {
                Outcome::Done { .. } => match Self::cost(measured.outcome, metric) {
                    Some(cost) => Outcome::Done { cost },
                    None => continue,
                },
                Outcome::Cancelled => continue,
                failed => failed.clone(),
            };
            known.push((measured.trial.config_in(space)?, outcome));
        }
        Ok(known)
    }

    /// What was measured on this machine in any scene with this space and these settings, each in its state,
    /// with a cost by `metric`. Failures have no cost and are left out.
    ///
    /// # Errors
    /// If a configuration is none of the space.
    pub fn states(&self, space: &Space, metric: Metric) -> Result<Vec<KnownState>, SpaceError> {
        let query = Query::new(self.machine.id.clone()).with_space(self.space.id.clone());
        let settings = |scene: &Scene| -> Facts {
            let facts = scene.facts.iter().filter(|(name, _)| {
                !name.starts_with(INDICATOR) && !DESCRIPTIONS.contains(&name.as_str())
            });
            facts
                .map(|(name, fact)| (name.clone(), fact.clone()))
                .collect()
        };
        let own = settings(&self.scene);
        let mut states = Vec::new();
        for measured in self.records.outcomes(&query) {
            let Some(scene) = self.records.scene(&measured.trial.scene) else {
                continue;
            };
            let is_done = matches!(measured.outcome.outcome, Outcome::Done { .. });
            if let (true, Some(cost), Some(state)) = (
                is_done && settings(scene) == own,
                Self::cost(measured.outcome, metric).filter(|cost| *cost > 0.0),
                state_of(scene),
            ) {
                let config = measured.trial.config_in(space)?;
                states.push(KnownState {
                    state,
                    config,
                    cost,
                });
            }
        }
        Ok(states)
    }

    /// What an outcome of such a run costs by `metric`, in seconds; `None` if it does not tell.
    #[must_use]
    pub fn cost(outcome: &TrialOutcome, metric: Metric) -> Option<f64> {
        let [build, render] = MEASURES.map(|name| outcome.measures.get(name).copied());
        Some(metric.cost(build?, render?))
    }

    /// Notes that a trial begins at `time`, seconds since 1970; it is on the disk when this returns, if
    /// the writer syncs each record.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn begins(&mut self, time: f64, trial: &Trial) -> Result<Stamp, StoreError> {
        let open = TrialOpen::new(
            self.space.id.clone(),
            self.machine.id.clone(),
            self.scene.id.clone(),
            &trial.config,
            &trial.reason.to_string(),
        );
        self.writer.append(time, open)
    }

    /// Notes how the trial ended that began as `trial`: what a frame takes, or why nothing was measured;
    /// `None` if it was cancelled.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn ended(
        &mut self,
        time: f64,
        trial: Stamp,
        ended: Option<Result<FrameTimes, String>>,
        metric: Metric,
    ) -> Result<(), StoreError> {
        let outcome = match ended {
            None => TrialOutcome::new(trial, Outcome::Cancelled),
            Some(Err(reason)) => TrialOutcome::new(trial, Outcome::Failed { reason }),
            Some(Ok(FrameTimes { build, render })) => {
                let times = [build.as_secs_f64(), render.as_secs_f64()];
                let cost = metric.cost(times[0], times[1]);
                let done = TrialOutcome::new(trial, Outcome::Done { cost });
                MEASURES
                    .iter()
                    .zip(times)
                    .fold(done, |done, (name, time)| done.with_measure(name, time))
            }
        };
        self.writer.append(time, outcome)?;
        Ok(())
    }
}
