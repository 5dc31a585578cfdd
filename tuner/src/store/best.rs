//! The best that is known, by machine, scene and space.
//!
//! Invariants: a configuration that failed once is no best; of equal means the one that was tried more often,
//! then the one with the smaller text, so that the order of logs decides nothing.

use std::collections::BTreeMap;

use super::body::TrialOutcome;
use super::{MachineId, Records, SceneId, SpaceId};
use crate::{Outcome, Value};

/// The best configuration of a machine, a scene and a space.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Best {
    /// Where it was measured.
    pub machine: MachineId,
    /// On what it was measured.
    pub scene: SceneId,
    /// The space of the configuration.
    pub space: SpaceId,
    /// Values by parameter.
    pub config: BTreeMap<String, Value>,
    /// The mean of its costs. It is the least of many noisy means, and so a little too good to be true.
    pub cost: f64,
    /// Number of its costs.
    pub n: usize,
    /// Number of configurations that it is the best of.
    pub of: usize,
}

/// What is known of a configuration.
#[derive(Default)]
struct Known {
    config: BTreeMap<String, Value>,
    sum: f64,
    n: usize,
    has_failed: bool,
}

impl Records {
    /// The best of each machine, scene and space, in the order of their names. `cost_of` tells the cost of an
    /// outcome; what has none, or one that is no number, is left out.
    pub fn best(&self, cost_of: impl Fn(&TrialOutcome) -> Option<f64>) -> Vec<Best> {
        let mut groups: BTreeMap<(&str, &str, &str), BTreeMap<String, Known>> = BTreeMap::new();
        for (_, trial, outcome) in self.ended() {
            let group = (
                trial.machine.as_str(),
                trial.scene.as_str(),
                trial.space.as_str(),
            );
            let cost = match &outcome.outcome {
                Outcome::Done { .. } => match cost_of(outcome) {
                    Some(cost) if cost.is_finite() => Some(cost),
                    _ => continue,
                },
                Outcome::Failed { .. } => None,
                Outcome::Cancelled => continue,
            };
            let values = trial.config.iter();
            let text: Vec<String> = values
                .map(|(name, value)| format!("{name}={value}"))
                .collect();
            let known = groups.entry(group).or_default();
            let known = known.entry(text.join(" ")).or_default();
            known.config.clone_from(&trial.config);
            match cost {
                Some(cost) => {
                    known.sum += cost;
                    known.n += 1;
                }
                None => known.has_failed = true,
            }
        }
        let best = groups
            .into_iter()
            .filter_map(|((machine, scene, space), all)| {
                let of = all.len();
                let good = all
                    .into_values()
                    .filter(|known| known.n > 0 && !known.has_failed);
                let mean = |known: &Known| known.sum / known.n as f64;
                let best = good.min_by(|a, b| mean(a).total_cmp(&mean(b)).then(b.n.cmp(&a.n)))?;
                Some(Best {
                    machine: MachineId::new(machine),
                    scene: SceneId::new(scene),
                    space: SpaceId::new(space),
                    cost: mean(&best),
                    n: best.n,
                    config: best.config,
                    of,
                })
            });
        best.collect()
    }
}
