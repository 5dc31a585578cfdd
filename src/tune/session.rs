//! One tuning run: a scene, a camera, a tuner, and the frames that are rendered on the way.
//!
//! Invariants: what the tuner decides depends on seed and told costs alone; the picture depends on
//! seed and number of finished frames alone, never on which configurations were tried. Each frame
//! renders the next sample of every pixel, so that the search leaves a finished picture behind. No
//! trial takes longer than [`SLOWEST_TRIAL`] times a frame with default parameters: a tree that
//! the depth limit has robbed of its heuristic can be a thousand times slower.

use std::{ops::Add, time::Duration};

use raywright_bvh::{BuildError, BuildParams, BuildWorkspace, Bvh};
use raywright_imaging::{Camera, CameraError, CancelToken, Completion, Film, FilmError, TileLoop};
use raywright_tracer::{Integrator, Rgb, Shot, World};
use raywright_tuner::{Config, Outcome, Search, TellError, Trial, Tuner};

use super::space::{ParameterSpace, SpaceFault};

/// Trials are given up after so many times the render time of the default parameters.
pub const SLOWEST_TRIAL: u32 = 10;

/// Tells how much time has passed since some moment.
pub trait Clock: Sync {
    /// Time since a moment that does not change.
    fn now(&self) -> Duration;
}

/// The wall clock.
#[derive(Clone, Copy, Debug)]
pub struct WallClock(std::time::Instant);

impl WallClock {
    /// A clock that starts now.
    #[must_use]
    pub fn start() -> Self {
        Self(std::time::Instant::now())
    }
}

impl Clock for WallClock {
    fn now(&self) -> Duration {
        self.0.elapsed()
    }
}

/// What is made small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// Time to render: the tree serves many frames.
    Render,
    /// Time to build and render: the tree is built anew for each frame.
    Total,
}

impl Metric {
    /// The cost of a frame, in the unit of its times.
    #[must_use]
    pub fn cost<T: Add<Output = T>>(self, build: T, render: T) -> T {
        match self {
            Self::Render => render,
            Self::Total => build + render,
        }
    }

    /// Its name on a command line and in a log.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Render => "render",
            Self::Total => "total",
        }
    }
}

/// How a run is done.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Width of a frame in pixels.
    pub width: u32,
    /// Height of a frame in pixels.
    pub height: u32,
    /// Scattering events of a path, K.
    pub path_length: u32,
    /// What is made small.
    pub metric: Metric,
    /// Seed of the search and of the pictures.
    pub seed: u64,
    /// Instruction set of the traversal kernels.
    pub isa: raywright_bvh::Isa,
}

/// Why a run cannot go on.
#[derive(Debug, PartialEq)]
#[non_exhaustive]
pub enum SessionError {
    /// The camera cannot be used.
    Camera(CameraError),
    /// There is no camera.
    NoCamera,
    /// No picture of this size.
    Film(FilmError),
    /// A tree for a baseline could not be built.
    Build(BuildError),
    /// The tuner refused a measurement.
    Tell(TellError),
    /// The instruction set is not available on this machine.
    Isa(raywright_bvh::Isa),
}

impl std::fmt::Display for SessionError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Camera(error) => error.fmt(f),
            Self::NoCamera => f.write_str("there is no camera"),
            Self::Film(error) => error.fmt(f),
            Self::Build(error) => error.fmt(f),
            Self::Tell(error) => error.fmt(f),
            Self::Isa(isa) => write!(f, "this machine does not have the instruction set {isa}"),
        }
    }
}

impl std::error::Error for SessionError {}

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
}

impl std::fmt::Display for TrialFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Build(error) => error.fmt(f),
            Self::TooSlow => write!(
                f,
                "given up: over {SLOWEST_TRIAL} times slower than the default parameters"
            ),
        }
    }
}

/// How long a frame took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameTimes {
    /// Time to build the tree.
    pub build: Duration,
    /// Time to render one sample per pixel.
    pub render: Duration,
}

/// Where frames are rendered: everything but the search.
#[derive(Debug)]
pub(super) struct Stage<'a, C> {
    world: &'a World,
    pub(super) camera: Camera,
    pub(super) settings: Settings,
    clock: C,
    workspace: BuildWorkspace,
}

impl<'a, C: Clock> Stage<'a, C> {
    /// A stage; camera and instruction set have been looked at.
    pub(super) fn new(world: &'a World, camera: Camera, settings: Settings, clock: C) -> Self {
        Self {
            world,
            camera,
            settings,
            clock,
            workspace: BuildWorkspace::default(),
        }
    }

    /// Builds a tree; the time that it took.
    pub(super) fn build(&mut self, params: &BuildParams) -> Result<(Bvh, Duration), BuildError> {
        let start = self.clock.now();
        let tree = self.world.build_tree(params, &mut self.workspace)?;
        let time = self.clock.now() - start;
        let tree = tree.with_isa(self.settings.isa);
        Ok((
            tree.expect("the session was made for an instruction set of this machine"),
            time,
        ))
    }

    /// Leaves the memory of a tree to the next.
    pub(super) fn recycle(&mut self, tree: Bvh) {
        tree.recycle(&mut self.workspace);
    }

    /// Renders one sample of every pixel into a film of its own.
    pub(super) fn render(
        &self,
        tree: &Bvh,
        sample: u32,
        limit: Duration,
        cancel: &CancelToken,
    ) -> Result<Rendered, SessionError> {
        let shot = Shot {
            world: self.world,
            camera: self.camera,
            integrator: Integrator::Path {
                path_length: self.settings.path_length,
            },
            seed: self.settings.seed,
        };
        let mut film =
            Film::new(self.settings.width, self.settings.height).map_err(SessionError::Film)?;
        let stop = CancelToken::new();
        let start = self.clock.now();
        let completion = shot.render(
            &mut film,
            sample..sample + 1,
            &TileLoop::new().with_cancel(&stop),
            |_| {
                if cancel.is_cancelled() || self.clock.now() - start > limit {
                    stop.cancel();
                }
                tree
            },
        );
        let time = self.clock.now() - start;
        Ok(match completion.map_err(SessionError::Camera)? {
            Completion::Finished => Rendered::Finished { film, time },
            Completion::Cancelled { .. } if cancel.is_cancelled() => Rendered::Cancelled,
            Completion::Cancelled { .. } => Rendered::TooSlow,
        })
    }
}

/// How the rendering of a frame ended.
#[derive(Debug)]
pub(super) enum Rendered {
    Finished { film: Film, time: Duration },
    TooSlow,
    Cancelled,
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
        camera.validate().map_err(SessionError::Camera)?;
        let film = Film::new(settings.width, settings.height).map_err(SessionError::Film)?;
        if !settings.isa.is_available() {
            return Err(SessionError::Isa(settings.isa));
        }
        let tuner = Tuner::new(space.space().clone(), search, settings.seed);
        Ok(Self {
            stage: Stage::new(world, camera, settings, clock),
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
        let records = self.tuner.records().iter();
        let mut known: Vec<Config> = records.map(|record| record.canonical.clone()).collect();
        for params in starts {
            let config = self.space.config(params)?;
            let canonical = self.space.space().canonical(&config);
            if !known.contains(&canonical) {
                known.push(canonical);
                self.tuner = self.tuner.with_start(config);
            }
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
                self.add(&film);
                let cost = self
                    .stage
                    .settings
                    .metric
                    .cost(times.build, times.render)
                    .as_secs_f64();
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

    /// Adds the samples of a finished frame to the picture.
    fn add(&mut self, frame: &Film) {
        let completion = TileLoop::new().run(&mut self.film, |tile, view| {
            for (x, y) in tile.pixels() {
                // One sample: its mean is the sample, and f32 again.
                let sample = frame.pixel(x, y).mean().map(|channel| channel as f32);
                view.pixel_mut(x, y).add(Rgb::from(sample));
            }
        });
        debug_assert_eq!(completion, Completion::Finished);
        self.finished += 1;
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
