//! Recordings: what many configurations take in a scene, from several cameras, each in turns with a
//! reference, so that searches and predictors can be judged later without the machine.
//!
//! Invariants: a figure stands beside that of the reference from the same moments; all trees render the
//! same samples; times to render are what threads worked, so that another program is in none of them; the random configurations are a function of space and seed.

use std::time::Duration;

use raywright_bvh::{BuildError, BuildParams, Bvh, TreeStats};
use raywright_imaging::{Camera, CancelToken};
use raywright_tracer::World;
use raywright_tuner::{Outcome, Random, Tuner};

use super::{
    ParameterSpace, SLOWEST_TRIAL, SessionError, Settings,
    stage::{Clock, Stage},
};

/// The tree of the reference is built once more after so many configurations.
const REFERENCE_EVERY: usize = 4;

/// A build that took less, or less than [`SLOW_BUILD`] times the reference, is done twice: the shorter
/// counts.
const SHORT_BUILD: Duration = Duration::from_millis(400);
const SLOW_BUILD: u32 = 3;

/// What a configuration took.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// Its tree, or why it could not be built.
    pub tree: Result<RecordedTree, BuildError>,
    /// The last build of the reference.
    pub reference_build: Duration,
}

/// A tree that was recorded.
#[derive(Clone, Debug)]
pub struct RecordedTree {
    /// Time to build it.
    pub build: Duration,
    /// What it is like.
    pub stats: TreeStats,
    /// What a frame took from each camera, in their order.
    pub cameras: Vec<RecordedFrame>,
}

/// Medians over repeats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordedFrame {
    /// Time that threads worked to render a sample of every pixel, all together; `None` if it was given up, being more than
    /// [`SLOWEST_TRIAL`] times slower than the reference.
    pub render: Option<Duration>,
    /// The same with the reference, in turns.
    pub reference: Duration,
}

/// Records configurations in one scene.
#[derive(Debug)]
pub struct Recorder<'a, C> {
    stage: Stage<'a, C>,
    cameras: Vec<Camera>,
    reference: BuildParams,
    reference_tree: Bvh,
    reference_build: Duration,
    recorded: usize,
    repeats: usize,
}

impl<'a, C: Clock> Recorder<'a, C> {
    /// A recorder with cameras and a reference. Each figure is the median of `repeats` ≥ 1.
    ///
    /// # Errors
    /// If there is no camera, a camera or the instruction set cannot be used, or the reference cannot be
    /// built.
    pub fn new(
        world: &'a World,
        cameras: &[Camera],
        settings: Settings,
        reference: &BuildParams,
        repeats: usize,
        clock: C,
    ) -> Result<Self, SessionError> {
        for camera in cameras {
            camera.validate().map_err(SessionError::Camera)?;
        }
        let first = cameras.first().ok_or(SessionError::NoCamera)?;
        let mut stage = Stage::new(world, *first, settings, clock)?;
        let (tree, mut build) = stage.build(reference).map_err(SessionError::Build)?;
        // A build that finds no memory of another is no measure.
        for _ in 0..2 {
            let (other, time) = stage.build(reference).map_err(SessionError::Build)?;
            stage.recycle(other);
            build = time;
        }
        Ok(Self {
            stage,
            cameras: cameras.to_vec(),
            reference: *reference,
            reference_tree: tree,
            reference_build: build,
            recorded: 0,
            repeats: repeats.max(1),
        })
    }

    /// Builds and renders a configuration; `None` if `cancel` was set before that was done.
    ///
    /// # Errors
    /// If the reference cannot be built any more.
    pub fn record(
        &mut self,
        params: &BuildParams,
        cancel: &CancelToken,
    ) -> Result<Option<Recorded>, SessionError> {
        if self.recorded.is_multiple_of(REFERENCE_EVERY) {
            let (tree, build) = self
                .stage
                .build(&self.reference)
                .map_err(SessionError::Build)?;
            self.stage.recycle(tree);
            self.reference_build = build;
        }
        self.recorded += 1;
        let tree = match self.build(params) {
            Ok(built) => {
                let (tree, build) = built;
                let stats = tree.stats();
                let frames = self.frames(&tree, cancel)?;
                self.stage.recycle(tree);
                let Some(cameras) = frames else {
                    return Ok(None);
                };
                Ok(RecordedTree {
                    build,
                    stats,
                    cameras,
                })
            }
            Err(error) => Err(error),
        };
        Ok(Some(Recorded {
            tree,
            reference_build: self.reference_build,
        }))
    }

    fn build(&mut self, params: &BuildParams) -> Result<(Bvh, Duration), BuildError> {
        let (tree, first) = self.stage.build(params)?;
        if first >= SHORT_BUILD && first >= self.reference_build * SLOW_BUILD {
            return Ok((tree, first));
        }
        self.stage.recycle(tree);
        let (tree, second) = self.stage.build(params)?;
        Ok((tree, first.min(second)))
    }

    /// What frames with a tree take, from all cameras.
    fn frames(
        &mut self,
        tree: &Bvh,
        cancel: &CancelToken,
    ) -> Result<Option<Vec<RecordedFrame>>, SessionError> {
        let mut frames = Vec::new();
        for &camera in &self.cameras {
            self.stage.camera = camera;
            let (mut own, mut references) = (Vec::new(), Vec::new());
            // The same samples for all configurations: others take other times.
            for sample in 0..self.repeats as u32 {
                let begun = self.stage.now();
                let reference =
                    self.stage
                        .work(&self.reference_tree, sample, Duration::MAX, cancel)?;
                let Some(reference) = reference else {
                    return Ok(None);
                };
                let limit = (self.stage.now() - begun) * SLOWEST_TRIAL;
                references.push(reference);
                match self.stage.work(tree, sample, limit, cancel)? {
                    Some(time) => own.push(time),
                    None if cancel.is_cancelled() => return Ok(None),
                    None => break,
                }
            }
            let is_whole = own.len() == self.repeats;
            frames.push(RecordedFrame {
                render: is_whole.then(|| median(own)),
                reference: median(references),
            });
        }
        Ok(Some(frames))
    }
}

/// The middle one; of an even number the mean of the middle two. 0 of none.
fn median(mut times: Vec<Duration>) -> Duration {
    times.sort();
    let Some(last) = times.len().checked_sub(1) else {
        return Duration::ZERO;
    };
    (times[last / 2] + times[last.div_ceil(2)]) / 2
}

/// `count` different configurations of a space that are not in `known`, at random.
#[must_use]
pub fn random_params(
    space: &ParameterSpace,
    known: &[BuildParams],
    count: usize,
    seed: u64,
) -> Vec<BuildParams> {
    let mut tuner = Tuner::new(space.space().clone(), Box::new(Random::new()), seed);
    let canonical = |params: &BuildParams| {
        let config = space.config(params).ok()?;
        Some(space.space().canonical(&config))
    };
    let known: Vec<_> = known.iter().filter_map(canonical).collect();
    let mut found = Vec::new();
    // A small space may have fewer.
    for _ in 0..count * 4 {
        if found.len() == count {
            break;
        }
        let trial = tuner.ask();
        let is_repeated = tuner
            .records()
            .iter()
            .any(|record| record.canonical == trial.canonical);
        if !is_repeated && !known.contains(&trial.canonical) {
            found.push(space.params(&trial.config));
        }
        // What it costs is of no interest to a random search, only that it is known.
        let told = tuner.tell(trial.id, Outcome::Done { cost: 0.0 });
        debug_assert!(told.is_ok());
    }
    found
}

#[cfg(test)]
mod tests {
    use raywright_tracer::{generate, imaging::Camera};

    use super::*;
    use crate::tune::{Metric, SpaceAxes};

    /// Every look at it takes a millisecond more.
    #[derive(Debug, Default)]
    struct Steps(std::sync::atomic::AtomicU64);

    impl Clock for Steps {
        fn now(&self) -> Duration {
            let before = self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            Duration::from_millis(before)
        }
    }

    fn settings() -> Settings {
        Settings {
            width: 16,
            height: 16,
            path_length: 1,
            metric: Metric::Render,
            seed: 1,
            isa: raywright_bvh::Isa::Portable,
        }
    }

    #[test]
    fn a_row_has_a_frame_for_each_camera_and_failures_a_reason() {
        let world = World::new(generate::by_name("interior").unwrap());
        let camera = world.scene().camera.unwrap();
        let mut turned = camera;
        turned.vertical_fov_degrees = 20.0;
        let reference = BuildParams::default();
        let (cameras, cancel) = ([camera, turned], CancelToken::new());
        let mut recorder = Recorder::new(
            &world,
            &cameras,
            settings(),
            &reference,
            2,
            Steps::default(),
        )
        .unwrap();
        let row = recorder.record(&reference, &cancel).unwrap().unwrap();
        let tree = row.tree.unwrap();
        assert_eq!(tree.cameras.len(), 2);
        assert!(tree.stats.nodes > 0 && tree.build > Duration::ZERO);
        assert!(row.reference_build > Duration::ZERO);
        for frame in tree.cameras {
            assert!(frame.render.is_some_and(|time| time > Duration::ZERO));
            assert!(frame.reference > Duration::ZERO);
        }
        let mut shallow = reference;
        shallow.max_depth = 9;
        shallow.max_leaf_size = 1;
        shallow.min_leaf_size = 1;
        shallow.branching_factor = 2;
        let row = recorder.record(&shallow, &cancel).unwrap().unwrap();
        assert!(matches!(row.tree, Err(BuildError::DepthLimit { .. })));
        cancel.cancel();
        assert!(recorder.record(&reference, &cancel).unwrap().is_none());
        let none = Recorder::new(&world, &[], settings(), &reference, 2, Steps::default());
        assert_eq!(none.err(), Some(SessionError::NoCamera));
        let mut odd: Camera = camera;
        odd.vertical_fov_degrees = f32::NAN;
        let odd = Recorder::new(&world, &[odd], settings(), &reference, 2, Steps::default());
        assert!(matches!(odd.err(), Some(SessionError::Camera(_))));
    }

    #[test]
    fn random_configurations_are_new_and_repeatable() {
        let base = BuildParams::default();
        let space = ParameterSpace::new(&base, &[], SpaceAxes::Canonical).unwrap();
        let found = random_params(&space, &[base], 100, 3);
        assert_eq!(found, random_params(&space, &[base], 100, 3));
        assert_ne!(found, random_params(&space, &[base], 100, 4));
        let forms: std::collections::HashSet<_> = found
            .iter()
            .chain([&base])
            .map(|params| {
                format!(
                    "{:?}",
                    space.space().canonical(&space.config(params).unwrap())
                )
            })
            .collect();
        assert_eq!(forms.len(), 101);
        // A space of three configurations, one of which is known.
        let others: Vec<&str> = raywright_bvh::PARAMETERS
            .iter()
            .map(|p| p.name)
            .filter(|name| *name != "leaf_format")
            .collect();
        let small = ParameterSpace::new(&base, &others, SpaceAxes::Printed).unwrap();
        assert_eq!(random_params(&small, &[base], 100, 3).len(), 1);
    }
}
