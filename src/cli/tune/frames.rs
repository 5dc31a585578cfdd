//! Frames of a run by its policy: each with what belongs into the log, and what became of its trial.

use raywright::{
    bvh::BuildParams,
    imaging::{CancelToken, Film},
    report::record::{FrameRecord, ProbeRecord},
    tune::{
        Comparison, FrameTimes, Hybrid, HybridFrame, Metric, Session, SessionError, WallClock,
        described, milliseconds,
    },
    tuner::Trial,
};

/// A run by any policy.
#[expect(
    clippy::large_enum_variant,
    reason = "there is one in a run, and it is not moved"
)]
pub(super) enum Frames<'a> {
    /// Every frame is a trial.
    Whole(Session<'a, WallClock>),
    /// Candidates are tried on tiles, or nothing is.
    Tiles(Hybrid<'a, WallClock>),
}

/// A frame that is done.
pub(super) struct Done {
    pub(super) record: FrameRecord,
    /// What the trial of the frame found, if it was one.
    pub(super) ended: Result<FrameTimes, String>,
}

impl Frames<'_> {
    /// The next frame, which is number `frame`; `begins` hears of its trial, if it is one. `None` if it was
    /// cancelled.
    pub(super) fn frame(
        &mut self,
        frame: usize,
        metric: Metric,
        cancel: &CancelToken,
        mut begins: impl FnMut(&Trial),
    ) -> Result<Option<Done>, SessionError> {
        let mut reason = None;
        let told = |trial: &Trial| {
            reason = Some(trial.reason.to_string());
            begins(trial);
        };
        Ok(match self {
            Self::Whole(session) => {
                let best = session.incumbent_cost_ms();
                let report = session.frame_told(cancel, told)?;
                report.map(|report| {
                    let times = report.outcome.as_ref().ok();
                    let cost_ms = times.map(|times| times.cost(metric) * 1e3);
                    let record = FrameRecord {
                        frame,
                        config: described(&report.params),
                        build_ms: times.map(|times| milliseconds(times.build)),
                        render_ms: times.map(|times| milliseconds(times.render)),
                        cost_ms,
                        failure: report.outcome.as_ref().err().map(ToString::to_string),
                        incumbent_cost_ms: match (best, cost_ms) {
                            (Some(best), Some(cost)) => Some(best.min(cost)),
                            (best, cost) => best.or(cost),
                        },
                        is_incumbent: report.is_incumbent,
                        frame_ms: None,
                        probe: None,
                        reason,
                    };
                    let ended = report.outcome.map_err(|failure| failure.to_string());
                    Done { record, ended }
                })
            }
            Self::Tiles(hybrid) => {
                let before = hybrid.incumbent();
                let done = hybrid.frame_told(cancel, told)?;
                done.map(|done| of_tiles(frame, before, &done, metric))
            }
        })
    }

    /// The best parameters so far.
    pub(super) fn incumbent(&self) -> Option<BuildParams> {
        match self {
            Self::Whole(session) => session.incumbent(),
            Self::Tiles(hybrid) => hybrid.incumbent(),
        }
    }

    /// As [`Session::compare`].
    pub(super) fn compare(
        &mut self,
        tuned: &BuildParams,
        rounds: usize,
        cancel: &CancelToken,
        progress: impl Fn(usize, usize),
    ) -> Result<Comparison, SessionError> {
        match self {
            Self::Whole(session) => session.compare(tuned, rounds, cancel, progress),
            Self::Tiles(hybrid) => hybrid.compare(tuned, rounds, cancel, progress),
        }
    }

    /// The picture so far.
    pub(super) fn film(&self) -> &Film {
        match self {
            Self::Whole(session) => session.film(),
            Self::Tiles(hybrid) => hybrid.film(),
        }
    }
}

/// The record of a frame in which a candidate may have been tried on tiles.
fn of_tiles(frame: usize, before: Option<BuildParams>, done: &HybridFrame, metric: Metric) -> Done {
    let own = FrameTimes {
        build: done.build,
        render: done.time.saturating_sub(done.build),
    };
    let incumbent_cost_ms = done.incumbent_cost * 1e3;
    let probed = done.candidate.as_ref().map(|candidate| &candidate.outcome);
    let params = done
        .candidate
        .as_ref()
        .map_or(done.incumbent, |candidate| candidate.params);
    let record = FrameRecord {
        frame,
        config: described(&params),
        build_ms: Some(milliseconds(match probed {
            // The incumbent may have been built anew in the same frame.
            Some(Ok(probed)) => probed.times.build,
            _ => own.build,
        })),
        render_ms: Some(milliseconds(own.render)),
        cost_ms: match probed {
            Some(Ok(probed)) => Some(probed.times.cost(metric) * 1e3),
            Some(Err(_)) => None,
            None => Some(incumbent_cost_ms),
        },
        failure: probed.and_then(|outcome| outcome.as_ref().err().map(ToString::to_string)),
        incumbent_cost_ms: Some(incumbent_cost_ms),
        is_incumbent: before != Some(done.incumbent),
        frame_ms: Some(milliseconds(done.time)),
        probe: probed.and_then(|outcome| {
            let probed = outcome.as_ref().ok()?;
            let [ratio, lower, upper] = probed.ratio.bounds();
            Some(ProbeRecord {
                share: probed.share,
                pairs: probed.ratio.pairs,
                ratio,
                lower,
                upper,
                decision: probed.decision.name().into(),
            })
        }),
        reason: done
            .candidate
            .as_ref()
            .map(|candidate| candidate.reason.clone()),
    };
    let ended = match probed {
        Some(Ok(probed)) => Ok(probed.times),
        Some(Err(failure)) => Err(failure.to_string()),
        None => Ok(own),
    };
    Done { record, ended }
}
