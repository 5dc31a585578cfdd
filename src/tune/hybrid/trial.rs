//! A candidate in a frame: built, traced on more and more tiles, accepted or not.
//!
//! Invariant: whatever becomes of the candidate, the trial is told once, and the frame is finished unless it
//! was cancelled.

use std::time::Duration;

use raywright_bvh::{BuildParams, Bvh};
use raywright_tuner::{ChangeDetector, Outcome, Reason, Trial};

use super::{Built, Candidate, Hybrid, Incumbent, LEAST_NOISE, MOST_PROBES, Probed, frame::Frame};
use crate::tune::{
    probe::{Costs, Decision, Evidence, Pair, ProbeRatio, SHARES, spread_order, turn},
    session::TrialFailure,
    stage::{Clock, FrameTimes, SessionError},
};

/// A part of a probe is given up after so many times what the whole frame takes with the incumbent.
const SLOWEST_PART: f64 = 2.0;

/// What a probe has found.
struct Probe {
    /// In this frame.
    ratio: ProbeRatio,
    /// In all frames.
    all: ProbeRatio,
    decision: Decision,
    candidate_times: Vec<(usize, f64)>,
    incumbent_times: Vec<(usize, f64)>,
}

/// What a frame with a candidate would take.
fn times(build: f64, costs: &Costs, ratio: ProbeRatio) -> FrameTimes {
    let duration = |seconds| Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
    FrameTimes {
        build: duration(build),
        render: duration(costs.render * ratio.log.exp()),
    }
}

impl<C: Clock> Hybrid<'_, C> {
    /// Tries what a trial says, with a tree that is `ready` or is built now, and finishes the frame with the better
    /// one; the candidate and the time for which the frame waited for it. `None` if the frame was cancelled.
    pub(super) fn try_candidate(
        &mut self,
        frame: &mut Frame<'_>,
        incumbent: &mut Incumbent,
        trial: &Trial,
        ready: Option<Built>,
    ) -> Result<Option<(Candidate, Duration)>, SessionError> {
        let params = self.space.params(&trial.config);
        // The incumbent beside itself shows how much noise there is, and needs no tree.
        let is_own = trial.canonical == incumbent.config;
        let is_ready = ready.is_some();
        let built = match ready {
            _ if is_own => Ok(None),
            Some(built) => built.map(|(tree, build)| Some((self.stage.on_isa(tree), build))),
            None => self.stage.build(&params).map(Some),
        };
        let (outcome, build) = match built {
            Err(error) => {
                self.trace_rest(frame, &incumbent.tree)?;
                (Err(TrialFailure::Build(error)), Duration::ZERO)
            }
            Ok(None) => {
                let build = incumbent.build();
                let costs = self.costs(incumbent, build);
                let probe = self.probe(frame, [&incumbent.tree; 2], &costs, None)?;
                self.trace_rest(frame, &incumbent.tree)?;
                let outcome = probe.map(|probe| self.own(frame, incumbent, &probe, &costs));
                (outcome, Duration::ZERO)
            }
            Ok(Some((tree, build))) => {
                let outcome = self.beside(frame, incumbent, trial, params, tree, build)?;
                (outcome, if is_ready { Duration::ZERO } else { build })
            }
        };
        let told = match &outcome {
            _ if !frame.is_done() => Outcome::Cancelled,
            Ok(probed) => Outcome::Done { cost: probed.cost },
            Err(failure) => Outcome::Failed {
                reason: failure.to_string(),
            },
        };
        self.tell(trial, told)?;
        if !frame.is_done() {
            return Ok(None);
        }
        match &outcome {
            Ok(probed) if probed.decision == Decision::Accepted => self.fruitless = 0,
            _ if is_own || trial.reason == Reason::Replicate => {}
            _ => self.fruitless += 1,
        }
        if let Some((_, known)) = self.check.take()
            && let Ok(probed) = &outcome
        {
            self.checked(incumbent, probed, known);
        }
        let candidate = Candidate {
            params,
            reason: if is_own {
                "incumbent".into()
            } else {
                trial.reason.to_string()
            },
            outcome,
        };
        Ok(Some((candidate, build)))
    }

    /// What frames cost with the incumbent, and with a tree that takes `build` seconds.
    fn costs(&self, incumbent: &Incumbent, build: f64) -> Costs {
        let share = self.stage.settings.metric.build_share();
        Costs {
            render: self.render_time(),
            incumbent_build: share * incumbent.build(),
            candidate_build: share * build,
            build_deviation: incumbent.build_deviation(),
        }
    }

    /// The incumbent beside itself.
    fn own(
        &self,
        frame: &mut Frame<'_>,
        incumbent: &Incumbent,
        probe: &Probe,
        costs: &Costs,
    ) -> Probed {
        frame.times.extend(&probe.candidate_times);
        frame.times.extend(&probe.incumbent_times);
        let cost = self.unit * incumbent.log_cost().exp() * costs.ratio(probe.ratio.log.exp());
        Probed {
            times: times(incumbent.build(), costs, probe.ratio),
            ratio: probe.ratio,
            cost_ratio: costs.bounds(probe.ratio),
            cost,
            share: 0.0,
            decision: Decision::Undecided,
        }
    }

    /// Another tree beside the incumbent's, in whose place it comes if it is better.
    fn beside(
        &mut self,
        frame: &mut Frame<'_>,
        incumbent: &mut Incumbent,
        trial: &Trial,
        params: BuildParams,
        tree: Bvh,
        build: Duration,
    ) -> Result<Result<Probed, TrialFailure>, SessionError> {
        let costs = self.costs(incumbent, build.as_secs_f64());
        // Builds beside frames are timed by another measure.
        if self.background.is_none() {
            let own = (incumbent.params.quality, incumbent.build());
            self.budget
                .add_build(params.quality, build.as_secs_f64(), own.0, own.1);
        }
        // What is to be seen by a check is whether what was known still holds.
        let is_check = self.check.is_some();
        let before = self.probed.get(&trial.canonical).copied();
        let before = before.filter(|_| !is_check);
        let trees = [&tree, &incumbent.tree];
        let probe = self.probe(frame, trees, &costs, before.map(|known| known.0))?;
        let is_accepted =
            !is_check && (probe.as_ref()).is_ok_and(|probe| probe.decision == Decision::Accepted);
        self.trace_rest(frame, if is_accepted { &tree } else { &incumbent.tree })?;
        let probe = match probe {
            Ok(probe) => probe,
            Err(failure) => {
                self.stage.recycle(tree);
                return Ok(Err(failure));
            }
        };
        let share = probe.candidate_times.len() as f64 / self.tiles.len() as f64;
        let other_share = probe.incumbent_times.len() as f64 / self.tiles.len() as f64;
        let probed = Probed {
            times: times(build.as_secs_f64(), &costs, probe.ratio),
            ratio: probe.ratio,
            cost_ratio: costs.bounds(probe.all),
            cost: self.unit * incumbent.log_cost().exp() * costs.ratio(probe.ratio.log.exp()),
            share: if is_accepted {
                1.0 - other_share
            } else {
                share
            },
            decision: probe.decision,
        };
        if !frame.is_done() {
            self.stage.recycle(tree);
            return Ok(Ok(probed));
        }
        if is_accepted {
            frame.times.extend(&probe.candidate_times);
            self.learn_tiles(&frame.times, 1.0);
            let accepted = (trial.canonical.clone(), params, tree, build.as_secs_f64());
            let build_share = self.stage.settings.metric.build_share();
            let old = incumbent.replace(accepted, costs, probe.all, build_share);
            self.stage.recycle(old);
            self.probed.clear();
            self.quiet = 0;
            self.detector = ChangeDetector::new(LEAST_NOISE);
        } else {
            frame.times.extend(&probe.incumbent_times);
            self.stage.recycle(tree);
            let probes = match probe.decision {
                Decision::Rejected => MOST_PROBES,
                _ => before.map_or(0, |known| known.1) + 1,
            };
            let known = (probe.all, probes);
            self.probed.insert(trial.canonical.clone(), known);
        }
        Ok(Ok(probed))
    }

    /// Traces tiles through the trees of candidate and incumbent until one is seen to be better, or half of
    /// the frame is done with either.
    fn probe(
        &self,
        frame: &mut Frame<'_>,
        [candidate, incumbent]: [&Bvh; 2],
        costs: &Costs,
        before: Option<ProbeRatio>,
    ) -> Result<Result<Probe, TrialFailure>, SessionError> {
        let order = spread_order(self.tiles.len(), frame.sample);
        let limit = Duration::try_from_secs_f64(SLOWEST_PART * costs.render);
        let limit = limit.unwrap_or(Duration::MAX);
        let mut evidence = Evidence::default();
        let (mut candidate_times, mut incumbent_times) = (Vec::new(), Vec::new());
        let mut found = Err(TrialFailure::Unmeasured);
        let mut begin = 0;
        for share in SHARES {
            let end = 2 * ((share * order.len() as f64) as usize).min(order.len() / 2);
            let part = &order[begin.min(end)..end];
            begin = end;
            let turned = |pair: &[usize]| turn([pair[0], pair[1]], frame.sample);
            let twos: Vec<[usize; 2]> = part.chunks_exact(2).map(turned).collect();
            let mut trees: Vec<Option<&Bvh>> = vec![None; order.len()];
            for &[own, other] in &twos {
                trees[own] = Some(candidate);
                trees[other] = Some(incumbent);
            }
            let times = self.trace(frame, limit, |tile| trees[tile])?;
            let mut took: Vec<Option<f64>> = vec![None; order.len()];
            for &(tile, time) in &times {
                took[tile] = Some(time);
            }
            let pairs = twos.iter().filter_map(|&[own, other]| {
                candidate_times.extend(took[own].map(|time| (own, time)));
                incumbent_times.extend(took[other].map(|time| (other, time)));
                Some(Pair {
                    candidate: [took[own]?, self.tiles[own]],
                    incumbent: [took[other]?, self.tiles[other]],
                })
            });
            let told = evidence.add_part(pairs, costs, before);
            let is_late = times.len() < part.len();
            if let Some(told) = told {
                found = Ok(told);
                if told.2 != Decision::Undecided {
                    break;
                }
            } else if is_late {
                found = Err(TrialFailure::TooSlow);
            }
            if is_late {
                break;
            }
        }
        // What was traced in vain is the incumbent's all the same.
        if found.is_err() {
            frame.times.extend(&incumbent_times);
        }
        Ok(found.map(|(ratio, all, decision)| Probe {
            ratio,
            all,
            decision,
            candidate_times,
            incumbent_times,
        }))
    }
}
