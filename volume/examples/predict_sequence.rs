//! How well frames are predicted, over the scripted sequence of a volume with its view file.
//!
//! `cargo run --release -p raywright-volume --example predict_sequence -- VOLUME [SIDE] [FPS]`
//!
//! Every frame is drawn once, at steps that jump about, and its work and time are kept; then each
//! predictor is led through the same frames, by the work clock and by the processor time of all threads. Printed: root mean
//! square and median of the relative error after the first ten frames, root mean square in frames
//! whose transfer function is new, and the share of frames that took more than 1.2 times what was
//! predicted, in percent; and vectors in the dictionary.

use std::{env, error::Error, path::PathBuf};

use cpu_time::ProcessTime;
use raywright_volume::{
    CastOptions, EstimateMethod, Estimator, FramePredictor, LoadOptions, Outlook, PredictorParams,
    Quality, Raycaster, View, Work, WorkClock, load_volume,
    predict::{FeatureForm, FeatureScales, SampleUnit, WorkCosts},
    sequence::script::{Start, Views, thirty_seconds},
};

struct Frame {
    outlook: Outlook,
    quality: Quality,
    work: Work,
    processor: f64,
    switched: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let path = PathBuf::from(arguments.next().ok_or("which volume?")?);
    let side: u32 = arguments.next().map_or(Ok(256), |text| text.parse())?;
    let fps: f64 = arguments.next().map_or(Ok(10.0), |text| text.parse())?;
    let volume = load_volume(&path, &LoadOptions::default())?.volume;
    let views = Views::of(&View::read(&View::path_for(&path))?).ok_or("a view is missing")?;
    for (steps, shortest, longest) in [("step 0.75", 0.75, 0.75), ("steps 0.5 to 2", 0.5, 2.0)] {
        let mut sequence = thirty_seconds("", &volume, &views, Start::Sparse, 1);
        sequence.fps = fps;
        let frames = record(&volume, &sequence, side, [shortest, longest])?;
        println!("{}, {steps}, {} frames", path.display(), frames.len());
        println!("{:40} {:^31}   {:^31}", "", "work clock", "processor time");
        for (name, params) in predictors() {
            // Not what predictors begin with.
            let costs = WorkCosts {
                ray: 20e-9,
                skip: 8e-9,
                sample: 5e-9,
                lit: 0.9e-9,
                fixed: 110e-6,
            };
            let clock = WorkClock::new(costs).with_noise(0.02, 7);
            let work = run(params, &frames, |index, frame| {
                clock.time(&frame.work, index)
            })?;
            let processor = run(params, &frames, |_, frame| frame.processor)?;
            println!("{name:40} {work}   {processor}");
        }
    }
    Ok(())
}

fn record(
    volume: &raywright_volume::Volume,
    sequence: &raywright_volume::Sequence,
    side: u32,
    [shortest, longest]: [f64; 2],
) -> Result<Vec<Frame>, Box<dyn Error>> {
    let caster = Raycaster::new(volume)?;
    let estimator = Estimator::new(volume);
    let mut last_key = 0;
    let mut state = 1_u32;
    (0..sequence.frames())
        .map(|index| {
            let moment = sequence.at(sequence.time_of(index))?;
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let share = f64::from(state >> 8) / f64::from(1 << 24);
            let step = shortest * (longest / shortest).powf(share);
            let mut options = CastOptions::default();
            options.step = step as f32;
            let size = [side; 2];
            let prepared = caster.prepare(&moment.function);
            let estimate = estimator
                .prepare(&moment.function, EstimateMethod::MeanExtinction)
                .with_blocks_of(&prepared)
                .estimate(moment.camera, size, &options, index as u32)?;
            let mut processor = f64::INFINITY;
            let mut work = Work::default();
            for _ in 0..2 {
                let start = ProcessTime::now();
                work = prepared.render(moment.camera, size, &options)?.work;
                processor = processor.min(start.elapsed().as_secs_f64());
            }
            let switched = moment.function_key != last_key;
            last_key = moment.function_key;
            Ok(Frame {
                outlook: Outlook::new(&estimate, volume, &moment.camera, size, options.step),
                quality: Quality::with_step(step),
                work,
                processor,
                switched,
            })
        })
        .collect()
}

fn predictors() -> Vec<(&'static str, PredictorParams)> {
    let plus = PredictorParams::plus();
    let with = |change: fn(&mut PredictorParams)| {
        let mut params = plus;
        change(&mut params);
        params
    };
    let scales = |change: fn(&mut FeatureScales)| {
        let mut scales = FeatureScales::default();
        change(&mut scales);
        let mut params = plus;
        params.features = FeatureForm::Scaled(scales);
        params
    };
    let forgetting = |forgetting: f64| {
        let mut params = plus;
        params.cost = plus.cost.map(|krls| krls.with_forgetting(forgetting));
        params
    };
    let mut paper_mean = PredictorParams::paper();
    paper_mean.cost = paper_mean
        .cost
        .map(|krls| krls.with_gamma(1e-12).with_forgetting(0.9));
    let mut raw = PredictorParams::paper();
    raw.features = FeatureForm::Raw;
    vec![
        ("paper, raw features", raw),
        ("paper", PredictorParams::paper()),
        ("plus", plus),
        (
            "plus, unit corrected",
            with(|p| p.unit = SampleUnit::Corrected),
        ),
        (
            "plus, unit estimated",
            with(|p| p.unit = SampleUnit::Estimated),
        ),
        ("plus, no speed", with(|p| p.speed_memory = None)),
        ("plus, no fallback", with(|p| p.fallback = None)),
        ("plus, no kernel model", with(|p| p.cost = None)),
        // A kernel that is the same everywhere: the mean of the costs, the recent ones above all.
        (
            "plus, running mean",
            with(|p| p.cost = p.cost.map(|krls| krls.with_gamma(1e-12))),
        ),
        ("paper, running mean", paper_mean),
        ("plus, forgetting 1", forgetting(1.0)),
        ("plus, forgetting 0.95", forgetting(0.95)),
        ("plus, no direction", scales(|s| s.direction = 0.0)),
        ("plus, no voxel size", scales(|s| s.voxel_size = 0.0)),
        ("plus, no step", scales(|s| s.step = 0.0)),
        ("plus, no termination", scales(|s| s.termination = 0.0)),
        ("plus, no coarse steps", scales(|s| s.coarse_steps = 0.0)),
        ("plus, no lit share", scales(|s| s.lit_share = 0.0)),
        ("plus, no seen share", scales(|s| s.seen_share = 0.0)),
        ("plus, scales x 0.5", scales(|s| *s = s.scaled(0.5))),
        ("plus, scales x 2", scales(|s| *s = s.scaled(2.0))),
    ]
}

fn run(
    params: PredictorParams,
    frames: &[Frame],
    time_of: impl Fn(u64, &Frame) -> f64,
) -> Result<String, Box<dyn Error>> {
    let mut predictor = FramePredictor::new(params)?;
    let (mut errors, mut switches) = (Vec::new(), Vec::new());
    for (index, frame) in frames.iter().enumerate() {
        let time = time_of(index as u64, frame);
        let predicted = predictor.predict(&frame.outlook, frame.quality)?.time;
        if index >= 10 {
            let error = predicted / time - 1.0;
            errors.push(error);
            if frame.switched {
                switches.push(error);
            }
        }
        predictor.learn(&frame.outlook, frame.quality, &frame.work, time)?;
    }
    let rms = |errors: &[f64]| {
        let squares: f64 = errors.iter().map(|e| e * e).sum();
        100.0 * (squares / errors.len().max(1) as f64).sqrt()
    };
    let mut sizes: Vec<f64> = errors.iter().map(|e| 100.0 * e.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let late = errors.iter().filter(|&&e| 1.0 / (1.0 + e) > 1.2).count();
    Ok(format!(
        "{:6.1} {:6.1} {:6.1} {:6.1} {:4}",
        rms(&errors),
        sizes[sizes.len() / 2],
        rms(&switches),
        100.0 * late as f64 / errors.len() as f64,
        predictor.dictionaries()[0],
    ))
}
