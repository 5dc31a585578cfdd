//! Where the frames of a tuning run are rendered: world, camera, clock, and what builds trees.
//!
//! Invariants: a frame is a function of seed and sample number, whatever trees its tiles are traced
//! through; the clock is an argument.

use std::{
    num::NonZeroU32,
    sync::{Mutex, PoisonError},
    time::Duration,
};

use raywright_bvh::{BuildError, BuildParams, BuildWorkspace, Bvh};
use raywright_imaging::{
    Camera, CameraError, CancelToken, Completion, Film, FilmError, Pixel, TileLoop,
    tiles::DEFAULT_TILE_SIZE,
};
use raywright_tracer::{Integrator, Rgb, Shot, World};
use raywright_tuner::TellError;

use super::{metric::Metric, space::SpaceFault};

/// Tiles of a frame that is to be compared tile by tile, and their smallest side, pixels.
const MANY_TILES: f64 = 200.0;
const SMALLEST_TILE: u32 = 4;

/// Tells how much time has passed since some moment.
pub trait Clock: Sync {
    /// Time since a moment that does not change.
    fn now(&self) -> Duration;

    /// Time that the calling thread has worked since a moment that does not change: what other programs take
    /// from it is left out, if the clock can tell.
    fn busy(&self) -> Duration {
        self.now()
    }
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

    #[cfg(unix)]
    fn busy(&self) -> Duration {
        use rustix::time::{ClockId, clock_gettime};

        let time = clock_gettime(ClockId::ThreadCPUTime);
        Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec as u32)
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
    /// Parameters have no place in the space.
    Space(SpaceFault),
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
            Self::Space(fault) => fault.fmt(f),
            Self::Isa(isa) => write!(f, "this machine does not have the instruction set {isa}"),
        }
    }
}

impl std::error::Error for SessionError {}

/// How long a frame took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameTimes {
    /// Time to build the tree.
    pub build: Duration,
    /// Time to render one sample per pixel.
    pub render: Duration,
}

impl FrameTimes {
    /// What it costs, in seconds.
    #[must_use]
    pub fn cost(&self, metric: Metric) -> f64 {
        metric.cost(self.build.as_secs_f64(), self.render.as_secs_f64())
    }
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
    /// A stage.
    ///
    /// # Errors
    /// If camera, picture size or instruction set cannot be used.
    pub(super) fn new(
        world: &'a World,
        camera: Camera,
        settings: Settings,
        clock: C,
    ) -> Result<Self, SessionError> {
        camera.validate().map_err(SessionError::Camera)?;
        if !settings.isa.is_available() {
            return Err(SessionError::Isa(settings.isa));
        }
        let stage = Self {
            world,
            camera,
            settings,
            clock,
            workspace: BuildWorkspace::default(),
        };
        stage.film()?;
        Ok(stage)
    }

    /// Shows another scene from now on.
    pub(super) fn show(&mut self, world: &'a World, camera: Camera) {
        (self.world, self.camera) = (world, camera);
    }

    /// Builds a tree; the time that it took.
    pub(super) fn build(&mut self, params: &BuildParams) -> Result<(Bvh, Duration), BuildError> {
        let start = self.clock.now();
        let tree = self.world.build_tree(params, &mut self.workspace)?;
        let time = self.clock.now() - start;
        Ok((self.on_isa(tree), time))
    }

    /// A tree that is traced by the run's instruction set.
    pub(super) fn on_isa(&self, tree: Bvh) -> Bvh {
        tree.with_isa(self.settings.isa)
            .expect("the session was made for an instruction set of this machine")
    }

    /// What is shown.
    pub(super) fn world(&self) -> &'a World {
        self.world
    }

    /// The clock.
    pub(super) fn clock(&self) -> C
    where
        C: Clone,
    {
        self.clock.clone()
    }

    /// Leaves the memory of a tree to the next.
    pub(super) fn recycle(&mut self, tree: Bvh) {
        tree.recycle(&mut self.workspace);
    }

    /// A shot of the frame.
    fn shot(&self) -> Shot<'a> {
        Shot {
            world: self.world,
            camera: self.camera,
            integrator: Integrator::Path {
                path_length: self.settings.path_length,
            },
            seed: self.settings.seed,
        }
    }

    /// An empty film.
    pub(super) fn film(&self) -> Result<Film, SessionError> {
        Film::new(self.settings.width, self.settings.height).map_err(SessionError::Film)
    }

    /// Renders one sample of every pixel into a film of its own.
    pub(super) fn render(
        &self,
        tree: &Bvh,
        sample: u32,
        limit: Duration,
        cancel: &CancelToken,
    ) -> Result<Rendered, SessionError> {
        let mut film = self.film()?;
        let stop = CancelToken::new();
        let start = self.clock.now();
        let completion = self.shot().render(
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

    /// Tiles of which there are enough to compare some with others, even in a small picture.
    fn tile_loop(&self) -> TileLoop<'static> {
        let area = f64::from(self.settings.width) * f64::from(self.settings.height);
        let side = (area / MANY_TILES).sqrt() as u32;
        let most = DEFAULT_TILE_SIZE.get();
        let side = NonZeroU32::new(side.clamp(SMALLEST_TILE, most)).unwrap_or(DEFAULT_TILE_SIZE);
        TileLoop::new().with_tile_size(side)
    }

    /// The number of tiles of a frame.
    pub(super) fn tiles(&self) -> usize {
        self.tile_loop()
            .tiles(self.settings.width, self.settings.height)
    }

    /// One sample of every pixel of those tiles for which there is a tree, in place of what the film had there;
    /// what each took by `busy`, in seconds. After `limit` no further tile is begun, nor after a cancellation.
    pub(super) fn render_tiles<'t>(
        &self,
        film: &mut Film,
        sample: u32,
        limit: Duration,
        cancel: &CancelToken,
        busy: impl Fn() -> Duration + Sync,
        tree_of: impl Fn(usize) -> Option<&'t Bvh> + Sync,
    ) -> Result<Vec<(usize, f64)>, SessionError> {
        let projection = self.camera.projection(film.width(), film.height());
        let projection = projection.map_err(SessionError::Camera)?;
        let shot = self.shot();
        let times = Mutex::new(Vec::new());
        let begun = self.clock.now();
        let completion = self.tile_loop().run(film, |tile, view| {
            let Some(tree) = tree_of(tile.index) else {
                return;
            };
            let is_late = || limit < Duration::MAX && self.clock.now() - begun > limit;
            if cancel.is_cancelled() || is_late() {
                return;
            }
            let start = busy();
            for (x, y) in tile.pixels() {
                *view.pixel_mut(x, y) = Pixel::default();
            }
            shot.render_tile(&projection, tile, view, sample..sample + 1, tree);
            let time = (busy() - start).as_secs_f64();
            let mut times = times.lock().unwrap_or_else(PoisonError::into_inner);
            times.push((tile.index, time));
        });
        debug_assert_eq!(completion, Completion::Finished);
        Ok(times.into_inner().unwrap_or_else(PoisonError::into_inner))
    }

    /// Renders one sample of every pixel and forgets it: how long threads worked for it, all together. `None`
    /// if `limit` has passed on the wall before, or it was cancelled.
    pub(super) fn work(
        &self,
        tree: &Bvh,
        sample: u32,
        limit: Duration,
        cancel: &CancelToken,
    ) -> Result<Option<Duration>, SessionError> {
        let mut film = self.film()?;
        let busy = || self.clock.busy();
        let times = self.render_tiles(&mut film, sample, limit, cancel, busy, |_| Some(tree))?;
        let seconds = times.iter().map(|(_, time)| time).sum();
        let is_whole = times.len() == self.tiles();
        Ok(Duration::try_from_secs_f64(seconds)
            .ok()
            .filter(|_| is_whole))
    }

    /// Time that the calling thread has worked.
    pub(super) fn busy(&self) -> Duration {
        self.clock.busy()
    }

    /// Time since a moment that does not change.
    pub(super) fn now(&self) -> Duration {
        self.clock.now()
    }
}

/// Adds the samples of a frame to a picture.
pub(super) fn add_frame(picture: &mut Film, frame: &Film) {
    let completion = TileLoop::new().run(picture, |tile, view| {
        for (x, y) in tile.pixels() {
            // One sample: its mean is the sample, and f32 again.
            let sample = frame.pixel(x, y).mean().map(|channel| channel as f32);
            view.pixel_mut(x, y).add(Rgb::from(sample));
        }
    });
    debug_assert_eq!(completion, Completion::Finished);
}

/// How the rendering of a frame ended.
#[derive(Debug)]
pub(super) enum Rendered {
    Finished { film: Film, time: Duration },
    TooSlow,
    Cancelled,
}
