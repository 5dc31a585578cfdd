//! A frame loop at its edges: before the first frame, at rest, and where long steps are not enough.

use raywright_volume::{
    CastOptions, Control, Counts, Estimator, FrameClock, FrameLoop, FrameLoopParams, Mode,
    Raycaster, Refined, Sequence, SteeringParams, Volume, Work, WorkClock, WorkTimer, generate,
    predict::{PixelsPerRay, WorkCosts},
    sequence::{
        Moment,
        script::{Start, Views, thirty_seconds},
    },
    steer::Resolution,
};

const SIZE: [u32; 2] = [72, 65];

fn scene() -> (Volume, Sequence) {
    let made = generate::by_name("nebula", [48; 3], 1).expect("a volume");
    let views = Views {
        sparse: made.transfer_function.clone(),
        dense: made.transfer_function,
        overview: made.camera,
        close: made.camera,
    };
    let sequence = thirty_seconds("nebula", &made.volume, &views, Start::Sparse, 3);
    (made.volume, sequence)
}

fn moment(sequence: &Sequence, time: f64) -> Moment {
    sequence.at(time).expect("a moment")
}

fn timer() -> WorkTimer {
    WorkTimer::new(WorkClock::new(COSTS))
}

const COSTS: WorkCosts = WorkCosts {
    ray: 36e-9,
    skip: 18e-9,
    sample: 9e-9,
    lit: 4e-9,
    fixed: 3e-4,
};

#[test]
fn at_rest_a_picture_becomes_the_finest_there_is() {
    let (volume, sequence) = scene();
    let caster = Raycaster::new(&volume).unwrap();
    let estimator = Estimator::new(&volume);
    for (control, resolution) in [
        (Control::Whole, Resolution::Full),
        (Control::Parts, Resolution::Ladder),
    ] {
        let mut steering = SteeringParams::new(Mode::Predicted, 4e-4);
        steering.resolution = resolution;
        let mut params = FrameLoopParams::new(steering, SIZE);
        params.control = control;
        let mut frames = FrameLoop::new(&volume, &caster, &estimator, params).unwrap();
        let mut timer = timer();
        assert_eq!(
            frames.refine(&mut timer).unwrap(),
            Refined::Done,
            "no frame"
        );
        let own = moment(&sequence, 1.0);
        frames.draw(&own, &mut timer).unwrap();
        // A time in between is enough for some rows, and what they were is not kept.
        frames.refine(&mut timer).unwrap();
        let own = moment(&sequence, 2.0);
        let drawn = frames.draw(&own, &mut timer).unwrap();
        assert!(drawn.quality.coarseness() > 0.5);
        let (mut steps, mut waits, mut last) = (vec![drawn.quality.step], 0, None);
        loop {
            match frames.refine(&mut timer).unwrap() {
                Refined::Finer(picture, step) => {
                    steps.push(step);
                    last = Some(picture);
                }
                Refined::Unfinished => waits += 1,
                Refined::Done => break,
                other => panic!("{other:?}"),
            }
        }
        assert!(waits > 3, "{waits}");
        assert!(
            steps[1..].windows(2).all(|pair| pair[1] < pair[0]),
            "{steps:?}"
        );
        assert_eq!(steps.last(), Some(&0.25));
        let mut options = CastOptions::default();
        options.step = 0.25;
        let direct = caster
            .prepare(&own.function)
            .render(own.camera, SIZE, &options);
        let (last, direct) = (last.expect("a picture"), direct.unwrap());
        assert_eq!(
            (&last.image, &last.opacity),
            (&direct.image, &direct.opacity)
        );
        assert_eq!((&last.end, last.base), (&direct.end, direct.base));
        assert_eq!(last.work.rays, direct.work.rays);
        assert_eq!(frames.refine(&mut timer).unwrap(), Refined::Done);
    }
}

#[test]
fn a_loop_that_was_calibrated_knows_the_machine() {
    let (volume, sequence) = scene();
    let caster = Raycaster::new(&volume).unwrap();
    let estimator = Estimator::new(&volume);
    for control in [Control::Whole, Control::Parts] {
        let mut params = FrameLoopParams::new(SteeringParams::new(Mode::Predicted, 2e-3), SIZE);
        params.control = control;
        let mut frames = FrameLoop::new(&volume, &caster, &estimator, params).unwrap();
        frames.calibrate(&mut timer()).unwrap();
        let found = frames.predictor().params().cold_start;
        assert!((found.fixed / COSTS.fixed - 1.0).abs() < 1e-9);
        // Their ratio is the one that was given, which is that of this machine.
        assert!((found.ray / COSTS.ray - 1.0).abs() < 1e-6, "{found:?}");
        assert!((found.skip / COSTS.skip - 1.0).abs() < 1e-6, "{found:?}");
        assert!(
            (found.sample / COSTS.sample - 1.0).abs() < 0.01,
            "{found:?}"
        );
        let drawn = frames.draw(&moment(&sequence, 0.0), &mut timer()).unwrap();
        let error = drawn.prediction.time / drawn.cast_time - 1.0;
        assert!(error.abs() < 0.3, "the first frame: {error}");
    }
}

/// Tells times that cannot be.
struct Broken(f64);

impl FrameClock for Broken {
    fn start(&mut self, _: u64) {}

    fn overhead(&self) -> f64 {
        0.0
    }

    fn elapsed(&self, _: &Work) -> f64 {
        self.0
    }
}

#[test]
fn a_broken_clock_leaves_costs_and_pictures() {
    let (volume, sequence) = scene();
    let caster = Raycaster::new(&volume).unwrap();
    let estimator = Estimator::new(&volume);
    for time in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300, 1e300] {
        for control in [Control::Whole, Control::Parts] {
            let mut params = FrameLoopParams::new(SteeringParams::new(Mode::Predicted, 2e-3), SIZE);
            params.control = control;
            params.options.counts = Counts::PerRay;
            let mut frames = FrameLoop::new(&volume, &caster, &estimator, params).unwrap();
            frames.calibrate(&mut Broken(time)).unwrap();
            let WorkCosts {
                ray,
                skip,
                sample,
                lit,
                fixed,
            } = frames.predictor().params().cold_start;
            for cost in [ray, skip, sample, lit, fixed] {
                assert!(cost > 0.0 && cost.is_finite(), "{time}: {cost}");
            }
            for second in 0..3 {
                let drawn = frames.draw(&moment(&sequence, f64::from(second)), &mut Broken(time));
                let step = drawn.unwrap().quality.step;
                assert!((0.25..=8.0).contains(&step), "{time}: {step}");
            }
        }
    }
}

#[test]
fn where_long_steps_are_not_enough_rays_are_left_out() {
    let (volume, sequence) = scene();
    let caster = Raycaster::new(&volume).unwrap();
    let estimator = Estimator::new(&volume);
    let slowest = |resolution, control, target| {
        let mut steering = SteeringParams::new(Mode::Predicted, target);
        steering.resolution = resolution;
        let mut params = FrameLoopParams::new(steering, SIZE);
        params.control = control;
        let mut frames = FrameLoop::new(&volume, &caster, &estimator, params).unwrap();
        let mut timer = timer();
        frames.calibrate(&mut timer).unwrap();
        let (mut slowest, mut fewest) = (0.0_f64, PixelsPerRay::One);
        for second in 0..20 {
            let own = moment(&sequence, 0.3 * f64::from(second));
            let drawn = frames.draw(&own, &mut timer).unwrap();
            if second > 2 {
                slowest = slowest.max(drawn.frame_time / target);
            }
            fewest = fewest.max(drawn.quality.pixels_per_ray);
        }
        (slowest, fewest)
    };
    for control in [Control::Whole, Control::Parts] {
        // Rays alone take longer than this.
        let target = 4.3e-4;
        let (full, fewest) = slowest(Resolution::Full, control, target);
        assert_eq!(fewest, PixelsPerRay::One);
        assert!(full > 1.1, "{full}");
        let (ladder, fewest) = slowest(Resolution::Ladder, control, target);
        assert_eq!(fewest, PixelsPerRay::Four);
        assert!(ladder < full * 0.95, "{ladder} {full}");
        // Where there is time there are all rays.
        let (_, fewest) = slowest(Resolution::Ladder, control, 1e-1);
        assert_eq!(fewest, PixelsPerRay::One);
    }
}
