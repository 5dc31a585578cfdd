//! One tuning run: a scene, a camera, a tuner, and the frames that are rendered on the way.
//!
//! Invariants: what the tuner decides depends on seed and told costs alone; the picture depends on
//! seed and number of finished frames alone, never on which configurations were tried. Each frame
//! renders the next sample of every pixel, so that the search leaves a finished picture behind. No
//! trial takes longer than [`SLOWEST_TRIAL`] times a frame with default parameters: a tree that
//! the depth limit has robbed of its heuristic can be a thousand times slower.

use std::time::Duration;

use raywright_bvh::{BuildError, BuildParams};
use raywright_imaging::{Camera, CancelToken, Film};
use raywright_tracer::World;
use raywright_tuner::{Config, Outcome, Search, Trial, Tuner};

use super::{
    comparison::Comparison,
    space::{ParameterSpace, SpaceFault},
    stage::{Clock, FrameTimes, Rendered, SessionError, Settings, Stage, add_frame},
};

/// Trials are given up after so many times the render time of the default parameters.
pub const SLOWEST_TRIAL: u32 = 10;

/// What one frame was.
#[derive(Clone, Debug)]
pub struct FrameReport {
    /// The parameters that were tried.
    pub params: BuildParams,
    /// How long it took, or why it has no result.
    pub outcome: Result<FrameTimes, TrialFailure>,
    /// Whether it became the incumbent.
    pub is_incumbent: bool,
}

/// Why a trial has no result.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum TrialFailure {
    /// No tree could be built.
    Build(BuildError),
    /// Rendering was given up.
    TooSlow,
    /// The picture has too few tiles, or the clock is too coarse, to tell.
    Unmeasured,
}

impl std::fmt::Display for TrialFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Build(error) => error.fmt(f),
            Self::TooSlow => write!(
                f,
                "given up: over {SLOWEST_TRIAL} times slower than the default parameters"
            ),
            Self::Unmeasured => f.write_str("not measured: too few tiles, or too coarse a clock"),
        }
    }
}

/// A tuning run.
#[derive(Debug)]
pub struct Session<'a, C> {
    pub(super) stage: Stage<'a, C>,
    space: ParameterSpace,
    tuner: Tuner,
    film: Film,
    /// Frames that are in the film.
    finished: u32,
    /// Longest time that a trial may take to render; known after the first frame.
    limit: Option<Duration>,
}

impl<'a, C: Clock> Session<'a, C> {
    /// A run that has not begun.
    ///
    /// # Errors
    /// If camera, picture size or instruction set cannot be used.
    pub fn new(
        world: &'a World,
        camera: Camera,
        settings: Settings,
        space: ParameterSpace,
        search: Box<dyn Search>,
        clock: C,
    ) -> Result<Self, SessionError> {
        let stage = Stage::new(world, camera, settings, clock)?;
        let film = stage.film()?;
        let tuner = Tuner::new(space.space().clone(), search, settings.seed);
        Ok(Self {
            stage,
            space,
            tuner,
            film,
            finished: 0,
            limit: None,
        })
    }

    /// The same run, in which some outcomes are known: they are no frames of this run, and the search sees
    /// them. To be told before [`with_starts`](Self::with_starts), which leaves out what is known.
    ///
    /// # Errors
    /// [`SessionError::Tell`] if a cost cannot be one.
    ///
    /// # Panics
    /// If a configuration is none of the space.
    pub fn with_known(
        mut self,
        known: impl IntoIterator<Item = (Config, Outcome)>,
    ) -> Result<Self, SessionError> {
        for (config, outcome) in known {
            self.tuner
                .tell_known(&config, outcome)
                .map_err(SessionError::Tell)?;
        }
        Ok(self)
    }

    /// The same run, in which some parameters are tried first, in the order given; of those that are one
    /// configuration of its space the first.
    ///
    /// # Errors
    /// If parameters are not valid.
    pub fn with_starts(mut self, starts: &[BuildParams]) -> Result<Self, SpaceFault> {
        for params in starts {
            self.tuner.add_new_start(self.space.config(params)?);
        }
        Ok(self)
    }

    /// Asks, builds, renders, tells. The first frame is preceded by one with default parameters,
    /// which is no trial and sets the limit for all. `None` if `cancel` was set before the frame
    /// was done.
    ///
    /// # Errors
    /// If the tuner refuses the measurement.
    pub fn frame(&mut self, cancel: &CancelToken) -> Result<Option<FrameReport>, SessionError> {
        self.frame_told(cancel, |_| ())
    }

    /// The same; `begins` hears of the trial before it is built.
    ///
    /// # Errors
    /// As [`frame`](Self::frame).
    pub fn frame_told(
        &mut self,
        cancel: &CancelToken,
        begins: impl FnOnce(&Trial),
    ) -> Result<Option<FrameReport>, SessionError> {
        let limit = match self.limit {
            Some(limit) => limit,
            None => {
                let (tree, _) = self
                    .stage
                    .build(&BuildParams::default())
                    .map_err(SessionError::Build)?;
                let rendered = self.stage.render(&tree, 0, Duration::MAX, cancel)?;
                self.stage.recycle(tree);
                match rendered {
                    Rendered::Finished { time, .. } => *self.limit.insert(time * SLOWEST_TRIAL),
                    Rendered::TooSlow | Rendered::Cancelled => return Ok(None),
                }
            }
        };
        let trial = self.tuner.ask();
        begins(&trial);
        let params = self.space.params(&trial.config);
        let trial_result = match self.stage.build(&params) {
            Err(error) => Err(TrialFailure::Build(error)),
            Ok((tree, build)) => {
                let rendered = self.stage.render(&tree, self.finished, limit, cancel)?;
                self.stage.recycle(tree);
                match rendered {
                    Rendered::Finished { film, time } => Ok((
                        film,
                        FrameTimes {
                            build,
                            render: time,
                        },
                    )),
                    Rendered::TooSlow => Err(TrialFailure::TooSlow),
                    Rendered::Cancelled => {
                        self.tuner
                            .tell(trial.id, Outcome::Cancelled)
                            .map_err(SessionError::Tell)?;
                        return Ok(None);
                    }
                }
            }
        };
        let (outcome, told) = match trial_result {
            Ok((film, times)) => {
                add_frame(&mut self.film, &film);
                self.finished += 1;
                let cost = times.cost(self.stage.settings.metric);
                (Ok(times), Outcome::Done { cost })
            }
            Err(failure) => {
                let reason = failure.to_string();
                (Err(failure), Outcome::Failed { reason })
            }
        };
        let told = self
            .tuner
            .tell(trial.id, told)
            .map_err(SessionError::Tell)?;
        Ok(Some(FrameReport {
            params,
            outcome,
            is_incumbent: told.is_incumbent,
        }))
    }

    /// Measures `tuned` beside both baselines for `rounds` rounds, after one that does not count.
    /// Rounds that were done when `cancel` was set are kept. `progress` is told rounds done and
    /// rounds to do.
    ///
    /// # Errors
    /// If a baseline cannot be built or the camera cannot be used.
    pub fn compare(
        &mut self,
        tuned: &BuildParams,
        rounds: usize,
        cancel: &CancelToken,
        progress: impl Fn(usize, usize),
    ) -> Result<Comparison, SessionError> {
        self.stage.compare(tuned, rounds, cancel, progress)
    }

    /// The space that is searched.
    #[must_use]
    pub fn space(&self) -> &ParameterSpace {
        &self.space
    }

    /// The best parameters so far.
    #[must_use]
    pub fn incumbent(&self) -> Option<BuildParams> {
        self.tuner
            .incumbent()
            .map(|record| self.space.params(&record.config))
    }

    /// What the best parameters so far cost on average, in milliseconds.
    #[must_use]
    pub fn incumbent_cost_ms(&self) -> Option<f64> {
        self.tuner.incumbent().map(|record| record.cost * 1e3)
    }

    /// The picture so far: one sample per pixel for every finished frame.
    #[must_use]
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// How the run is done.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.stage.settings
    }
}
