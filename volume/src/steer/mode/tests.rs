use super::*;
use crate::{
    grid::{ValueScale, Voxels},
    predict::PixelsPerRay,
    steer::NoModel,
};

const TARGET: f64 = 0.1;

/// Time = `scale` / coarseness, and known to be so.
struct Exact(f64);

impl TimeModel for Exact {
    fn forecast(&self, quality: Quality) -> Forecast {
        Forecast {
            time: self.0 / quality.coarseness(),
            deviation: 0.0,
            novelty: 0.0,
        }
    }

    fn safe_step(&self, _: PixelsPerRay, _: f64) -> f64 {
        0.0
    }
}

fn steering(mode: Mode) -> Steering {
    Steering::new(SteeringParams::new(mode, TARGET)).unwrap()
}

/// Draws a frame; the passes it took, their qualities, the shown one and the frame time.
fn frame(steering: &mut Steering, scale: f64) -> (Vec<f64>, f64, f64) {
    let mut pass = steering.begin(&Exact(scale));
    let mut steps = Vec::new();
    loop {
        steps.push(pass.quality.step);
        match steering.finish(scale / pass.quality.coarseness()).unwrap() {
            Next::DrawAgain(again) => pass = again,
            Next::Shown {
                quality,
                frame_time,
            } => return (steps, quality.step, frame_time),
        }
    }
}

#[test]
fn no_adapt_never_does() {
    let mut steering = steering(Mode::NoAdapt);
    for scale in [0.01, 1.0, 100.0] {
        assert_eq!(frame(&mut steering, scale).0, [0.75]);
    }
}

#[test]
fn the_last_frame_is_a_frame_too_late() {
    let mut steering = steering(Mode::LastFrame);
    assert_eq!(frame(&mut steering, 0.1).1, 0.75);
    let (_, step, time) = frame(&mut steering, 0.1);
    assert!((step - 1.0).abs() < 1e-12 && (time - TARGET).abs() < 1e-12);
    // A jump of the scene by 5: one frame is as much too slow, the next is right.
    let (_, step, time) = frame(&mut steering, 0.5);
    assert!((step - 1.0).abs() < 1e-12 && (time - 5.0 * TARGET).abs() < 1e-12);
    let (_, step, time) = frame(&mut steering, 0.5);
    assert!((step - 5.0).abs() < 1e-12 && (time - TARGET).abs() < 1e-12);
    // Back: from 5 to 1 in eight frames.
    frame(&mut steering, 0.1);
    for _ in 0..7 {
        assert!(frame(&mut steering, 0.1).1 > 1.0 + 1e-9);
    }
    assert!((frame(&mut steering, 0.1).1 - 1.0).abs() < 1e-9);
}

#[test]
fn a_prediction_is_in_time() {
    let mut steering = steering(Mode::Predicted);
    for scale in [0.1, 0.5, 0.3, 0.45] {
        let (_, step, time) = frame(&mut steering, scale);
        if steering.shown().unwrap().step > 0.81 * step {
            assert!(time < TARGET * 1.0101, "{scale}: {time}");
        }
    }
    // The limit holds for shorter steps.
    let before = steering.shown().unwrap().step;
    let pass = steering.begin(&Exact(0.01));
    assert!(pass.held_back && (pass.quality.step - 0.8 * before).abs() < 1e-12);
    let forecast = pass.forecast.unwrap();
    assert!((forecast.time - 0.01 / pass.quality.step).abs() < 1e-12);
}

#[test]
fn two_passes_hold_the_target_and_cost_samples() {
    let mut steering = steering(Mode::TwoPass);
    for scale in [0.1; 20] {
        frame(&mut steering, scale);
    }
    let (steps, step, time) = frame(&mut steering, 0.1);
    assert_eq!(steps.len(), 2);
    assert!((time - TARGET).abs() < 1e-9, "{time}");
    assert!((step - 4.0 / 3.0).abs() < 0.1, "{step}");
    // A jump by 3: the first pass is too slow to be followed, and is shown.
    let (steps, shown, time) = frame(&mut steering, 0.3);
    assert_eq!(steps, [shown]);
    assert!(time < TARGET && shown > 4.0);
}

#[test]
fn two_passes_taken_literally_exceed_the_target() {
    let mut steering = steering(Mode::TwoPassLiteral);
    let (steps, shown, time) = frame(&mut steering, 0.1);
    assert_eq!(steps, [shown]);
    assert!(time > 3.0 * TARGET);
}

#[test]
fn times_that_cannot_be_change_nothing() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for mode in Mode::ALL {
            let mut steering = steering(mode);
            frame(&mut steering, 0.1);
            let pass = steering.begin(&Exact(0.1));
            assert!(
                matches!(steering.finish(bad), Ok(Next::Shown { .. })),
                "{mode:?} {bad}"
            );
            let next = steering.begin(&Exact(0.1));
            assert!(next.quality.step.is_finite() && next.quality.step > 0.0);
            if mode == Mode::LastFrame {
                assert_eq!(next.quality, pass.quality);
            }
        }
    }
}

#[test]
fn targets_at_the_ends() {
    for mode in [Mode::LastFrame, Mode::Predicted, Mode::TwoPass] {
        let params = SteeringParams::new(mode, f64::INFINITY);
        let mut endless = Steering::new(params).unwrap();
        for _ in 0..40 {
            frame(&mut endless, 0.1);
        }
        assert_eq!(endless.shown().unwrap().step, 0.25, "{mode:?}");
        let mut tiny = Steering::new(SteeringParams::new(mode, 1e-9)).unwrap();
        frame(&mut tiny, 0.1);
        frame(&mut tiny, 0.1);
        assert_eq!(tiny.shown().unwrap().step, 8.0, "{mode:?}");
    }
    let mut tiny = Steering::new(SteeringParams::new(Mode::Predicted, 1e-9)).unwrap();
    assert!(tiny.begin(&Exact(0.1)).over_budget);
}

#[test]
fn without_a_model_a_prediction_is_the_longest_step() {
    let mut steering = steering(Mode::Predicted);
    let pass = steering.begin(&NoModel);
    assert!(pass.safe && pass.quality.step == 8.0);
}

#[test]
fn limits_of_volumes() {
    let limits = |dims: [usize; 3], spacing| {
        let voxels = Voxels::U8(vec![0; dims.iter().product()]);
        let volume = Volume::new(dims, spacing, voxels, ValueScale::default()).unwrap();
        StepLimits::for_volume(&volume)
    };
    assert_eq!(limits([64, 64, 64], [1.0; 3]).longest, 8.0);
    // Two samples across the shortest axis.
    assert_eq!(limits([64, 64, 9], [1.0; 3]).longest, 4.0);
    assert_eq!(limits([64, 64, 9], [1.0, 1.0, 2.0]).longest, 8.0);
    assert_eq!(limits([64, 64, 1], [1.0; 3]).longest, 0.25);
    assert_eq!(limits([2, 2, 2], [1.0; 3]).longest, 0.5);
}

#[test]
fn what_is_refused() {
    assert_eq!(
        steering(Mode::NoAdapt).finish(1.0),
        Err(SteeringError::NoPass)
    );
    let good = SteeringParams::new(Mode::Predicted, TARGET);
    for change in [
        |p: &mut SteeringParams| p.target = 0.0,
        |p: &mut SteeringParams| p.target = -1.0,
        |p: &mut SteeringParams| p.target = f64::NAN,
        |p: &mut SteeringParams| p.fixed_step = 0.0,
        |p: &mut SteeringParams| p.shrink_limit = 1.1,
        |p: &mut SteeringParams| p.shrink_limit = 0.0,
        |p: &mut SteeringParams| p.caution = f64::INFINITY,
        |p: &mut SteeringParams| p.safe_novelty = f64::NAN,
        |p: &mut SteeringParams| p.limits.shortest = 0.0,
        |p: &mut SteeringParams| p.limits.longest = 0.1,
        |p: &mut SteeringParams| p.limits.longest = f64::NAN,
    ] {
        let mut params = good;
        change(&mut params);
        Steering::new(params).unwrap_err();
    }
    let mut steering = steering(Mode::Predicted);
    steering.set_target(0.0).unwrap_err();
    assert_eq!(steering.params().target, TARGET);
    steering.set_target(0.2).unwrap();
    assert_eq!(steering.params().target, 0.2);
}

#[test]
fn names_are_those_of_files() {
    for mode in Mode::ALL {
        let json = serde_json::to_string(&mode).unwrap();
        assert_eq!(json, format!("\"{}\"", mode.name()));
    }
}
