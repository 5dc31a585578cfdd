//! Candidates whose trees are built beside the frames, by a thread of their own that yields to them.
//!
//! No frame waits for a build then: while one is under way frames are the incumbent's, and the first frame after
//! its end tries the tree. This is for trees that serve any number of frames. Where every frame bears a share of a
//! build, builds are to be compared with each other, and one under load cannot be.
//!
//! Invariants: at most one build is under way; one that is not wanted any more ends soon, told by its
//! [`BuildControl`](raywright_bvh::BuildControl), and its tree is never seen.

use std::{
    fmt,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, sync_channel},
    },
    thread::Scope,
    time::Duration,
};

use raywright_bvh::{BuildError, BuildParams, BuildWorkspace, Bvh};
use raywright_tracer::World;
use raywright_tuner::Trial;

use crate::tune::stage::Clock;

/// How much the thread yields to those that render, as Unix counts: with both on one core it gets a quarter.
#[cfg(target_os = "linux")]
const NICENESS: i32 = 5;

/// A tree, and how long the thread has worked for it.
pub(super) type Built = Result<(Bvh, Duration), BuildError>;

/// Runs what it is given on another thread.
type Run<'a> = dyn Fn(Box<dyn FnOnce() + Send + 'a>) + Send + Sync + 'a;

/// Builds one tree at a time.
pub(super) struct Background<'a> {
    run: Box<Run<'a>>,
    /// What a thread has worked.
    busy: Arc<dyn Fn() -> Duration + Send + Sync + 'a>,
    workspace: BuildWorkspace,
    building: Option<Building>,
}

/// A build that is under way.
struct Building {
    trial: Trial,
    cancelled: Arc<AtomicBool>,
    done: Receiver<(Built, BuildWorkspace)>,
}

impl<'a> Background<'a> {
    /// Threads are those of `scope`.
    pub(super) fn new<'env: 'a>(scope: &'a Scope<'a, 'env>, clock: impl Clock + Send + 'a) -> Self {
        let clock = Arc::new(clock);
        Self {
            run: Box::new(move |job| {
                scope.spawn(job);
            }),
            busy: Arc::new(move || clock.busy()),
            workspace: BuildWorkspace::default(),
            building: None,
        }
    }

    /// Whether a tree is being built, or waits for [`finished`](Self::finished).
    pub(super) fn is_building(&self) -> bool {
        self.building.is_some()
    }

    /// The trial whose tree is being built.
    pub(super) fn trial(&self) -> Option<&Trial> {
        self.building.as_ref().map(|building| &building.trial)
    }

    /// Begins to build the tree of a trial; whatever else was being built is given up.
    pub(super) fn begin(&mut self, world: &'a World, params: BuildParams, trial: Trial) {
        self.give_up();
        let mut workspace = std::mem::take(&mut self.workspace);
        let cancelled = Arc::new(AtomicBool::new(false));
        workspace.control.cancelled = Some(cancelled.clone());
        let busy = self.busy.clone();
        let (send, done) = sync_channel(1);
        (self.run)(Box::new(move || {
            let build = || {
                #[cfg(target_os = "linux")]
                // A build that yields to nobody is a build all the same.
                let _ = rustix::process::setpriority_process(None, NICENESS);
                let begun = busy();
                let tree = world.build_tree(&params, &mut workspace)?;
                Ok((tree, busy() - begun))
            };
            // A pool of one: the threads of the global one render.
            let built = match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
                Ok(pool) => pool.install(build),
                Err(_) => Err(BuildError::Cancelled),
            };
            // Nobody listens to a build that was given up.
            let _ = send.send((built, workspace));
        }));
        self.building = Some(Building {
            trial,
            cancelled,
            done,
        });
    }

    /// The trial whose tree is ready, and its tree; `None` while it is being built.
    pub(super) fn finished(&mut self) -> Option<(Trial, Built)> {
        // A thread that panicked has its scope panic; until then its build is under way.
        let (built, workspace) = self.building.as_ref()?.done.try_recv().ok()?;
        self.workspace = workspace;
        self.building.take().map(|building| (building.trial, built))
    }

    /// Gives up what is being built; its trial.
    pub(super) fn give_up(&mut self) -> Option<Trial> {
        let building = self.building.take()?;
        building.cancelled.store(true, Ordering::Relaxed);
        Some(building.trial)
    }
}

impl Drop for Background<'_> {
    /// The scope of the thread would wait for it.
    fn drop(&mut self) {
        self.give_up();
    }
}

impl fmt::Debug for Background<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Background")
            .field("trial", &self.trial())
            .finish_non_exhaustive()
    }
}
