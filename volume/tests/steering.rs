//! The whole loop of estimate, prediction, steering and learning over a scripted sequence, by the work
//! clock: repeatable to the last bit, so that what prediction is for can be a test.

use raywright_imaging::Camera;
use raywright_volume::{
    Estimator, FrameLoop, FrameLoopParams, Mode, PredictorParams, Raycaster, SteeringParams,
    Volume, WorkClock, WorkTimer, generate,
    predict::WorkCosts,
    presets::preset,
    sequence::{
        Sequence,
        script::{Start, Views, thirty_seconds},
    },
    steer::SpeedChange,
};

const SIZE: [u32; 2] = [64, 64];

struct Shown {
    step: f64,
    /// Frame time over target.
    load: f64,
    /// Predicted over measured time.
    predicted: Option<f64>,
}

fn scene() -> (Volume, Sequence) {
    let made = generate::by_name("nebula", [64; 3], 1).expect("a volume");
    let centre = made.camera.target;
    let views = Views {
        sparse: preset("fire", [0.55, 0.8]).expect("a preset"),
        dense: made.transfer_function,
        overview: made.camera,
        close: Camera {
            origin: centre + (made.camera.origin - centre) * 0.3,
            ..made.camera
        },
    };
    let mut sequence = thirty_seconds("nebula", &made.volume, &views, Start::Sparse, 3);
    sequence.fps = 6.0;
    (made.volume, sequence)
}

/// Leads a way of steering through the sequence; `target` is in seconds of the work clock.
fn lead(
    (volume, sequence): &(Volume, Sequence),
    params: SteeringParams,
    predictor: PredictorParams,
    clock: &WorkClock,
) -> Vec<Shown> {
    let caster = Raycaster::new(volume).expect("a volume of usual size");
    let estimator = Estimator::new(volume);
    let mut all = FrameLoopParams::new(params, SIZE);
    all.predictor = predictor;
    let mut frames = FrameLoop::new(volume, &caster, &estimator, all).expect("parameters");
    let mut timer = WorkTimer::new(clock.clone());
    let shown = (0..sequence.frames()).map(|frame| {
        let moment = sequence.at(sequence.time_of(frame)).expect("a moment");
        let drawn = frames.draw(&moment, &mut timer).expect("a frame");
        Shown {
            step: drawn.quality.step,
            load: drawn.frame_time / params.target,
            predicted: (params.mode == Mode::Predicted)
                .then(|| drawn.prediction.time / drawn.cast_time),
        }
    });
    shown.collect()
}

/// Root mean square of what frames took beyond the target, as a share of it, over those that did.
fn rms_up(shown: &[Shown]) -> f64 {
    let over: Vec<f64> = shown
        .iter()
        .map(|s| s.load - 1.0)
        .filter(|&o| o > 0.0)
        .collect();
    let squares: f64 = over.iter().map(|o| o * o).sum();
    (squares / over.len().max(1) as f64).sqrt()
}

fn worst(shown: &[Shown]) -> f64 {
    shown.iter().map(|s| s.load).fold(0.0, f64::max)
}

fn mean_step(shown: &[Shown]) -> f64 {
    shown.iter().map(|s| s.step).sum::<f64>() / shown.len() as f64
}

/// Seconds, such that steps are between the limits most of the time.
const TARGET: f64 = 1.5e-3;

#[test]
fn a_prediction_is_in_time_where_the_last_frame_is_too_late() {
    let scene = scene();
    let clock = WorkClock::new(WorkCosts::default()).with_noise(0.02, 1);
    let run = |params, predictor| lead(&scene, params, predictor, &clock);
    let plus = PredictorParams::plus();
    let last = run(SteeringParams::new(Mode::LastFrame, TARGET), plus);
    let paper = run(
        SteeringParams::new(Mode::Predicted, TARGET),
        PredictorParams::paper(),
    );
    let ours = run(SteeringParams::new(Mode::Predicted, TARGET), plus);
    let cautious = run(SteeringParams::cautious(Mode::Predicted, TARGET), plus);
    let two = run(SteeringParams::new(Mode::TwoPass, TARGET), plus);
    for (name, shown) in [
        ("last frame", &last),
        ("paper", &paper),
        ("ours", &ours),
        ("cautious", &cautious),
        ("two pass", &two),
    ] {
        let errors = shown[10..].iter().filter_map(|s| Some(s.predicted? - 1.0));
        let squares: Vec<f64> = errors.map(|e| e * e).collect();
        let rms = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
        println!(
            "{name:12} step {:5.2}  rms up {:5.1} %  worst {:4.2}  prediction {:5.1} %",
            mean_step(shown),
            100.0 * rms_up(shown),
            worst(shown),
            100.0 * rms,
        );
    }
    assert!(rms_up(&ours) < 0.4 * rms_up(&last));
    assert!(worst(&ours) < 1.7 && worst(&last) > 3.0);
    assert!(worst(&cautious) <= worst(&ours));
    assert!(mean_step(&ours) < 1.15 * mean_step(&last));
    assert!(mean_step(&two) > 1.2 * mean_step(&last));
}

#[test]
fn a_run_is_repeated_to_the_last_bit() {
    let scene = scene();
    let clock = WorkClock::new(WorkCosts::default())
        .with_noise(0.05, 9)
        .with_change(SpeedChange {
            frames: 60..72,
            speed: 0.7,
        });
    let run = || {
        let params = SteeringParams::cautious(Mode::Predicted, TARGET);
        let shown = lead(&scene, params, PredictorParams::plus(), &clock);
        let bits = shown.iter().map(|s| (s.step.to_bits(), s.load.to_bits()));
        bits.collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}
