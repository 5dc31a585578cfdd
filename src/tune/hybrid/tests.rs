//! Frames of a hybrid run: their picture, their trials, their end.

use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use raywright_bvh::{BuildParams, Quality};
use raywright_imaging::{CancelToken, Film, TileLoop};
use raywright_tracer::{Integrator, Shot, generate};
use raywright_tuner::GaussianProcess;

use super::*;
use crate::tune::{Decision, Metric, SpaceAxes, TrialFailure, WallClock, portfolio};

/// Goes on by another step each time that it is looked at; with 0 it stands still.
#[derive(Clone)]
struct OddClock {
    looks: Arc<AtomicU64>,
    /// Nanoseconds that have passed.
    passed: Arc<AtomicU64>,
    /// Microseconds from look to look, less than half of it more.
    step: Arc<AtomicU64>,
}

impl OddClock {
    fn new(step: u64) -> Self {
        Self {
            looks: Arc::default(),
            passed: Arc::default(),
            step: Arc::new(AtomicU64::new(step)),
        }
    }
}

impl Clock for OddClock {
    fn now(&self) -> Duration {
        let looks = self.looks.fetch_add(1, Ordering::Relaxed);
        let step = self.step.load(Ordering::Relaxed);
        let odd = looks.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 54;
        let more = step * (1000 + odd.min(500));
        Duration::from_nanos(self.passed.fetch_add(more, Ordering::Relaxed))
    }
}

fn settings(metric: Metric) -> Settings {
    Settings {
        width: 250,
        height: 170,
        path_length: 2,
        metric,
        seed: 5,
        isa: raywright_bvh::Isa::best(),
    }
}

struct Place {
    world: World,
    camera: Camera,
}

fn place(name: &str) -> Place {
    let scene = match name {
        "interior" => generate::interior(1),
        _ => generate::voxel_terrain(24),
    };
    let camera = scene.camera.expect("generated scenes have one");
    Place {
        world: World::new(scene),
        camera,
    }
}

fn hybrid<'p, C: Clock>(
    place: &'p Place,
    metric: Metric,
    first: &BuildParams,
    clock: C,
) -> Hybrid<'p, C> {
    let base = BuildParams::default();
    let space = ParameterSpace::new(&base, &[], SpaceAxes::Canonical).unwrap();
    let search = || -> Box<dyn Search> { Box::new(GaussianProcess::new()) };
    let run = Hybrid::new(
        &place.world,
        place.camera,
        settings(metric),
        space,
        first,
        search,
        clock,
    );
    run.unwrap()
        .with_starts(&portfolio(&base, metric, SpaceAxes::Canonical))
        .with_overhead_limit(f64::INFINITY)
}

#[test]
fn starts_of_a_kind_that_the_space_lacks_are_left_out() {
    let (place, base) = (place("interior"), BuildParams::default());
    let space = ParameterSpace::new(&base, &[], SpaceAxes::Eleven).unwrap();
    let starts = portfolio(&base, Metric::Total, SpaceAxes::Canonical);
    let mut run = hybrid(&place, Metric::Total, &base, WallClock::start());
    run.space = space;
    run = run.with_starts(&starts);
    let kept = &run.starts;
    assert!(kept.len() >= 2 && kept.len() < starts.len());
    assert!(kept.iter().all(|kept| starts.contains(kept)));
    assert!(kept.iter().all(|kept| kept.branching_factor <= 8));
    let starts = portfolio(&base, Metric::Render, SpaceAxes::Eleven);
    assert_eq!(run.with_starts(&starts).starts, starts);
}

/// The same frames by one tree.
fn plain(place: &Place, frames: u32) -> Film {
    let settings = settings(Metric::Render);
    let mut film = Film::new(settings.width, settings.height).unwrap();
    add_plain(place, &mut film, 0..frames);
    film
}

/// Adds frames by one tree.
fn add_plain(place: &Place, film: &mut Film, frames: std::ops::Range<u32>) {
    let settings = settings(Metric::Render);
    let shot = Shot {
        world: &place.world,
        camera: place.camera,
        integrator: Integrator::Path {
            path_length: settings.path_length,
        },
        seed: settings.seed,
    };
    let tree = place
        .world
        .build_tree(&BuildParams::default(), &mut Default::default())
        .unwrap();
    for sample in frames {
        let done = shot.render(film, sample..sample + 1, &TileLoop::new(), |_| &tree);
        assert_eq!(done, Ok(raywright_imaging::Completion::Finished));
    }
}

#[test]
fn whatever_is_tried_the_picture_is_that_of_one_tree() {
    let place = place("interior");
    let expected = plain(&place, 30).mean();
    for metric in [
        Metric::Render,
        Metric::Total,
        Metric::of_frames_per_tree(7.try_into().unwrap()),
    ] {
        for step in [0, 1, 3] {
            let clock = OddClock::new(step);
            let mut run = hybrid(&place, metric, &BuildParams::default(), clock);
            let mut tried = 0;
            for _ in 0..30 {
                let frame = run.frame(&CancelToken::new()).unwrap().unwrap();
                tried += usize::from(frame.candidate.is_some());
                assert_eq!(Some(frame.incumbent), run.incumbent());
            }
            assert!(tried >= 5, "{tried}");
            assert!(run.film().mean() == expected, "{metric:?} {step}");
        }
    }
}

#[test]
fn a_bad_tree_is_left_at_once_and_a_good_one_kept() {
    let place = place("voxel-terrain");
    let mut bad = BuildParams::default();
    (bad.quality, bad.branching_factor) = (Quality::Morton, 2);
    (bad.min_leaf_size, bad.max_leaf_size) = (32, 32);
    let mut run = hybrid(&place, Metric::Render, &bad, WallClock::start());
    for _ in 0..8 {
        run.frame(&CancelToken::new()).unwrap().unwrap();
    }
    let incumbent = run.incumbent().unwrap();
    assert_ne!(incumbent, bad);
    assert!(
        incumbent.branching_factor > 2 || incumbent.min_leaf_size < 32,
        "{incumbent:?}"
    );
    // And nobody goes back to it.
    let mut run =
        hybrid(&place, Metric::Render, &incumbent, WallClock::start()).with_starts(&[bad]);
    run.frame(&CancelToken::new()).unwrap();
    let frame = run.frame(&CancelToken::new()).unwrap().unwrap();
    let probed = frame.candidate.unwrap().outcome.unwrap();
    assert_ne!(probed.decision, Decision::Accepted);
    assert!(probed.share <= 0.5, "{probed:?}");
    assert_eq!(run.incumbent(), Some(incumbent));
}

#[test]
fn trying_comes_to_an_end_and_begins_again_with_another_scene() {
    let [first, second] = ["interior", "voxel-terrain"].map(place);
    let clock = OddClock::new(2);
    let mut run = hybrid(&first, Metric::Render, &BuildParams::default(), clock);
    let frames = (0..400).take_while(|_| {
        run.frame(&CancelToken::new()).unwrap();
        run.is_searching()
    });
    assert!(frames.count() < 399);
    run.change_scene(&second.world, second.camera).unwrap();
    assert!(run.is_searching());
    let frame = run.frame(&CancelToken::new()).unwrap().unwrap();
    assert!(frame.candidate.is_some());
}

#[test]
fn what_cannot_be_built_costs_nothing_but_its_build() {
    let place = place("voxel-terrain");
    let mut flat = BuildParams::default();
    (flat.max_depth, flat.branching_factor, flat.max_leaf_size) = (8, 2, 4);
    flat.min_leaf_size = 1;
    let run = hybrid(
        &place,
        Metric::Render,
        &BuildParams::default(),
        WallClock::start(),
    );
    let mut run = run.with_starts(&[flat]);
    let mut failed = false;
    for _ in 0..3 {
        let frame = run.frame(&CancelToken::new()).unwrap().unwrap();
        if let Some(Candidate {
            outcome: Err(TrialFailure::Build(_)),
            ..
        }) = frame.candidate
        {
            failed = true;
        }
    }
    assert!(failed);
    assert!(run.film().mean() == plain(&place, 3).mean());
}

#[test]
fn a_cancelled_frame_is_as_if_never_begun() {
    let place = place("interior");
    let clock = OddClock::new(1);
    let mut run = hybrid(&place, Metric::Total, &BuildParams::default(), clock);
    for frame in 0..6 {
        let cancelled = CancelToken::new();
        cancelled.cancel();
        assert!(run.frame(&cancelled).unwrap().is_none());
        assert_eq!(run.incumbent().is_some(), frame > 0);
        assert!(run.frame(&CancelToken::new()).unwrap().is_some());
    }
    assert!(run.film().mean() == plain(&place, 6).mean());
}

#[test]
fn what_is_known_is_scaled_to_the_machine_and_not_tried_before_it_is_better() {
    let place = place("interior");
    let base = BuildParams::default();
    let mut other = base;
    other.branching_factor = 4;
    for (cost, is_tried) in [(50.0, true), (200.0, false)] {
        let run = hybrid(&place, Metric::Render, &base, OddClock::new(1));
        let configs = [base, other].map(|params| run.space().config(&params).unwrap());
        let known = configs.into_iter().zip([100.0, cost]);
        let mut run = run
            .with_starts(&[])
            .with_known(known.map(|(config, cost)| (config, Outcome::Done { cost })));
        run.frame(&CancelToken::new()).unwrap();
        let frame = run.frame(&CancelToken::new()).unwrap().unwrap();
        let tried = frame.candidate.map(|candidate| candidate.params);
        assert_eq!(tried == Some(other), is_tried, "{tried:?}");
    }
}

#[test]
fn trials_wait_until_there_is_time_for_them() {
    let place = place("interior");
    let tried = |limit: f64| -> usize {
        let clock = OddClock::new(1);
        let run = hybrid(&place, Metric::Render, &BuildParams::default(), clock);
        let mut run = run.with_overhead_limit(limit);
        let frames = (0..20).map(|_| run.frame(&CancelToken::new()).unwrap().unwrap());
        frames.filter(|frame| frame.candidate.is_some()).count()
    };
    // How many there are before nothing is promised depends on the odd times.
    let freely = tried(f64::INFINITY);
    assert!(freely >= 8, "{freely}");
    assert_eq!(tried(0.0), 0);
    let some = tried(0.001);
    assert!((1..freely).contains(&some), "{some} of {freely}");
}

#[test]
fn built_beside_the_frames_trials_change_no_picture_and_no_frame_waits() {
    let place = place("interior");
    std::thread::scope(|scope| {
        let run = hybrid(
            &place,
            Metric::Render,
            &BuildParams::default(),
            OddClock::new(1),
        );
        let mut run = run.with_background_builds(scope);
        let (mut tried, mut begun, mut frames) = (0, 0, 0);
        while tried < 5 {
            let frame = run.frame_told(&CancelToken::new(), |_| begun += 1);
            let frame = frame.unwrap().unwrap();
            assert_eq!(frame.build > Duration::ZERO, frames == 0);
            tried += usize::from(frame.candidate.is_some());
            frames += 1;
            assert!(frames < 1000);
        }
        // The first parameters are a trial too, and need no tree of their own.
        assert!(begun > tried, "{begun}");
        assert!(run.film().mean() == plain(&place, frames).mean());
    });
}

#[test]
fn what_is_built_for_another_scene_is_given_up() {
    let [first, second] = ["interior", "voxel-terrain"].map(place);
    std::thread::scope(|scope| {
        let run = hybrid(
            &first,
            Metric::Render,
            &BuildParams::default(),
            OddClock::new(1),
        );
        let mut run = run.with_background_builds(scope);
        for _ in 0..2 {
            run.frame(&CancelToken::new()).unwrap().unwrap();
        }
        assert!(run.is_building());
        run.change_scene(&second.world, second.camera).unwrap();
        assert!(!run.is_building());
        let mut expected = plain(&first, 2);
        add_plain(&second, &mut expected, 2..20);
        for _ in 2..20 {
            run.frame(&CancelToken::new()).unwrap().unwrap();
        }
        assert!(run.film().mean() == expected.mean());
    });
}

#[test]
fn a_run_that_ends_does_not_wait_for_its_build() {
    let place = Place {
        camera: generate::voxel_terrain(24).camera.unwrap(),
        world: World::new(generate::voxel_terrain(400)),
    };
    let mut slow = BuildParams::default();
    slow.quality = Quality::Optimized;
    let begun = Instant::now();
    let tree = place.world.build_tree(&slow, &mut Default::default());
    tree.unwrap();
    let build = begun.elapsed();
    let ended = std::thread::scope(|scope| {
        let run = hybrid(
            &place,
            Metric::Render,
            &BuildParams::default(),
            WallClock::start(),
        );
        let mut run = run.with_starts(&[slow]).with_background_builds(scope);
        for _ in 0..2 {
            run.frame(&CancelToken::new()).unwrap().unwrap();
        }
        assert!(run.is_building());
        Instant::now()
    });
    assert!(ended.elapsed() < build / 2, "{:?}", ended.elapsed());
}

#[test]
fn where_frames_bear_their_builds_none_is_in_the_background() {
    let place = place("interior");
    std::thread::scope(|scope| {
        let run = hybrid(
            &place,
            Metric::Total,
            &BuildParams::default(),
            OddClock::new(1),
        );
        let mut run = run.with_background_builds(scope);
        run.frame(&CancelToken::new()).unwrap().unwrap();
        let frame = run.frame(&CancelToken::new()).unwrap().unwrap();
        assert!(frame.candidate.is_some() && frame.build > Duration::ZERO);
    });
}

#[test]
fn where_nothing_is_tried_hardly_a_clock_is_read() {
    let place = place("interior");
    let clock = OddClock::new(1);
    let looks = clock.looks.clone();
    let run = hybrid(&place, Metric::Render, &BuildParams::default(), clock);
    let mut run = run.frozen();
    run.frame(&CancelToken::new()).unwrap();
    let before = looks.load(Ordering::Relaxed);
    let frame = run.frame(&CancelToken::new()).unwrap().unwrap();
    let looks = looks.load(Ordering::Relaxed) - before;
    assert!(looks <= 8, "{looks}");
    // And the cost is told all the same.
    let cost = Duration::from_secs_f64(run.incumbent_cost().unwrap());
    assert!(
        cost > frame.time / 2 && cost <= frame.time,
        "{cost:?} {frame:?}"
    );
    assert!(run.film().mean() == plain(&place, 2).mean());
}

/// The first frame finds memory and caches cold, and a busy machine is slower for a while.
#[test]
fn tiles_that_are_known_and_those_that_are_not_are_expected_at_one_speed() {
    let place = place("interior");
    let clock = OddClock::new(8);
    let mut run = hybrid(&place, Metric::Render, &BuildParams::default(), clock);
    run.frame(&CancelToken::new()).unwrap();
    for weight in [FRESH, 1.0] {
        let before = run.tiles.clone();
        let times = before.iter().enumerate().step_by(3);
        let times: Vec<(usize, f64)> = times.map(|(tile, time)| (tile, 0.25 * time)).collect();
        let factor = run.learn_tiles(&times, weight);
        assert!((factor - 0.25).abs() < 1e-12);
        let expected = 1.0 - 0.75 * weight;
        for (tile, (after, before)) in run.tiles.iter().zip(&before).enumerate() {
            assert!((after / before - expected).abs() < 1e-9, "{tile}");
        }
    }
    // One that was interrupted is not expected to be so again, and what is no time says nothing.
    let before = run.tiles.clone();
    let mut times: Vec<(usize, f64)> = before.iter().copied().enumerate().collect();
    times[5].1 *= 1000.0;
    let factor = run.learn_tiles(&times, 1.0);
    assert!(run.tiles[5] < 1.01 * INTERRUPTED * factor * before[5]);
    let before = run.tiles.clone();
    run.learn_tiles(&[(0, 0.0), (1, 0.0)], 1.0);
    assert_eq!(run.tiles, before);
}
