//! Where the frames of a tuning run are rendered: world, camera, clock, and what builds trees.
//!
//! Invariants: a frame is a function of seed and sample number, whatever trees its tiles are traced
//! through; the clock is an argument.

use std::time::Duration;

use raywright_bvh::{BuildError, BuildParams, BuildWorkspace, Bvh};
use raywright_imaging::{Camera, CameraError, CancelToken, Completion, Film, FilmError, TileLoop};
use raywright_tracer::{Integrator, Shot, World};
use raywright_tuner::TellError;

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

