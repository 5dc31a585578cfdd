//! One tuning run: a scene, a camera, a tuner, and the frames that are rendered on the way.
//!
//! Invariants: what the tuner decides depends on seed and told costs alone; the picture depends on
//! seed and number of frames alone, never on which configurations were tried. Each frame renders
//! the next sample of every pixel, so that the search leaves a finished picture behind.

use std::time::Duration;

use raywright_bvh::{BuildError, BuildParams, BuildWorkspace, Bvh};
use raywright_imaging::{Camera, CameraError, CancelToken, Completion, Film, FilmError, TileLoop};
use raywright_tracer::{Integrator, Shot, World};
use raywright_tuner::{Outcome, Search, TellError, Tuner};

use super::space::ParameterSpace;

/// Tells how much time has passed since some moment.
pub trait Clock {
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
    /// The cost of a frame.
    #[must_use]
    pub fn cost(self, build: Duration, render: Duration) -> Duration {
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
    /// How long it took, or why no tree was built.
    pub outcome: Result<FrameTimes, BuildError>,
    /// Whether it became the incumbent.
    pub is_incumbent: bool,
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
    camera: Camera,
    pub(super) settings: Settings,
    clock: C,
    workspace: BuildWorkspace,
}

impl<C: Clock> Stage<'_, C> {
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

    /// Renders one sample of every pixel; the time that it took, or `None` if it was cancelled.
    pub(super) fn render(
        &self,
        tree: &Bvh,
        film: &mut Film,
        sample: u32,
        cancel: &CancelToken,
    ) -> Result<Option<Duration>, SessionError> {
        let shot = Shot {
            world: self.world,
            camera: self.camera,
            integrator: Integrator::Path {
                path_length: self.settings.path_length,
            },
            seed: self.settings.seed,
        };
        let start = self.clock.now();
        let tiles = TileLoop::new().with_cancel(cancel);
        let completion = shot
            .render(film, sample..sample + 1, &tiles, |_| tree)
            .map_err(SessionError::Camera)?;
        Ok((completion == Completion::Finished).then(|| self.clock.now() - start))
    }
}

/// A tuning run.
#[derive(Debug)]
pub struct Session<'a, C> {
    pub(super) stage: Stage<'a, C>,
    space: ParameterSpace,
    tuner: Tuner,
    film: Film,
    samples: u32,
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
        let stage = Stage {
            world,
            camera,
            settings,
            clock,
            workspace: BuildWorkspace::default(),
        };
        Ok(Self {
            stage,
            space,
            tuner,
            film,
            samples: 0,
        })
    }

    /// Asks, builds, renders, tells. `None` if `cancel` was set before the frame was done; the
    /// film keeps the samples that were rendered.
    ///
    /// # Errors
    /// If the tuner refuses the measurement.
    pub fn frame(&mut self, cancel: &CancelToken) -> Result<Option<FrameReport>, SessionError> {
        let trial = self.tuner.ask();
        let params = self.space.params(&trial.config);
        let (tree, build) = match self.stage.build(&params) {
            Ok(built) => built,
            Err(error) => {
                let outcome = Outcome::Failed {
                    reason: error.to_string(),
                };
                self.tuner
                    .tell(trial.id, outcome)
                    .map_err(SessionError::Tell)?;
                return Ok(Some(FrameReport {
                    params,
                    outcome: Err(error),
                    is_incumbent: false,
                }));
            }
        };
        let Some(render) = self
            .stage
            .render(&tree, &mut self.film, self.samples, cancel)?
        else {
            self.tuner
                .tell(trial.id, Outcome::Cancelled)
                .map_err(SessionError::Tell)?;
            return Ok(None);
        };
        self.samples += 1;
        let cost = self.stage.settings.metric.cost(build, render).as_secs_f64();
        let told = self
            .tuner
            .tell(trial.id, Outcome::Done { cost })
            .map_err(SessionError::Tell)?;
        let outcome = Ok(FrameTimes { build, render });
        Ok(Some(FrameReport {
            params,
            outcome,
            is_incumbent: told.is_incumbent,
        }))
    }

    /// The best parameters so far.
    #[must_use]
    pub fn incumbent(&self) -> Option<BuildParams> {
        self.tuner
            .incumbent()
            .map(|record| self.space.params(&record.config))
    }

    /// The picture so far: one sample per pixel for every frame.
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
