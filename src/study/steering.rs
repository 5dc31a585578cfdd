//! The experiment of frame-time steering: one sequence, several ways to choose the step, and how long
//! frames take. Table 1 of Bruder, Frey, Ertl, 2016, with signed errors and more columns.
//!
//! Invariants: all ways see the same moments, and take turns frame by frame, so that slow moments of the
//! machine meet all of them; by the work clock a run is a function of its arguments.

use std::time::Instant;

use crate::imaging::Image;
use crate::volume::{
    Control, Drawn, EnclosureKind, EnclosureParams, EstimateMethod, Estimator, FrameClock,
    FrameLoop, FrameLoopParams, Mode, PredictorParams, Raycaster, Sequence, Skipping,
    SteeringParams, Volume, Work, WorkClock, WorkTimer, frames::FrameError, predict::WorkCosts,
    sequence::SequenceError,
};

/// What parts of a frame cost by the work clock: about what they do on one core of 2024 with AVX-512
/// (fitted to frames by the wall clock), which is not what predictors begin with.
pub const CLOCK_COSTS: WorkCosts = WorkCosts {
    ray: 20e-9,
    skip: 8e-9,
    sample: 5e-9,
    lit: 0.9e-9,
    fixed: 110e-6,
};

/// How empty space is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Caster {
    /// From the first to the last face of the hull of blocks of 16³, as in the paper.
    Hull,
    /// By the distance map, which is faster and makes the cost of a sample depend on more.
    Map,
}

impl Caster {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Hull, Self::Map];

    /// Its name for people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Hull => "hull",
            Self::Map => "map",
        }
    }
}

/// A way to choose steps, complete with everything that belongs to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Way {
    /// A fixed step of 0.75 voxels; times are predicted as in [`Way::Paper`].
    NoAdapt,
    /// From the time of the last frame.
    LastFrame,
    /// From the prediction of the paper.
    Paper,
    /// From our prediction, cautiously.
    Ours,
    /// The same, and the step may change between parts of a frame.
    Parts,
    /// Two passes.
    TwoPass,
}

impl Way {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::NoAdapt,
        Self::LastFrame,
        Self::Paper,
        Self::Ours,
        Self::Parts,
        Self::TwoPass,
    ];

    /// Its name for people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NoAdapt => "no adapt",
            Self::LastFrame => "last frame",
            Self::Paper => "paper",
            Self::Ours => "ours",
            Self::Parts => "ours, in parts",
            Self::TwoPass => "two pass",
        }
    }

    fn is_ours(self) -> bool {
        matches!(self, Self::Ours | Self::Parts)
    }

    fn params(self, caster: Caster, target: f64, size: [u32; 2]) -> FrameLoopParams {
        let mode = match self {
            Self::NoAdapt => Mode::NoAdapt,
            Self::LastFrame => Mode::LastFrame,
            Self::Paper | Self::Ours | Self::Parts => Mode::Predicted,
            Self::TwoPass => Mode::TwoPass,
        };
        // What errs is put right within the frame: caution would only cost quality.
        let steering = if self == Self::Ours {
            SteeringParams::cautious(mode, target)
        } else {
            SteeringParams::new(mode, target)
        };
        let mut params = FrameLoopParams::new(steering, size);
        if self == Self::Parts {
            params.steering.shrink_limit = 0.5;
        }
        if !self.is_ours() {
            params.predictor = PredictorParams::paper();
            params.method = EstimateMethod::CubeRoot;
        }
        if caster == Caster::Hull {
            params.options.skipping = Skipping::Enclosure;
            params.enclosure = Some(EnclosureParams::new(EnclosureKind::Hull));
        }
        if self == Self::Parts {
            params.control = Control::Parts;
        }
        params
    }
}

/// What tells the time.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Clock {
    /// Work times [`CLOCK_COSTS`], with noise of this standard deviation and seed.
    Work {
        /// Of the logarithm of times.
        noise: f64,
        /// Of the noise.
        seed: u64,
    },
    /// The wall.
    Wall,
}

/// Either clock of a loop.
#[derive(Debug)]
enum Timer {
    Work(WorkTimer),
    Wall(Instant),
}

impl Timer {
    fn new(clock: Clock) -> Self {
        match clock {
            Clock::Work { noise, seed } => {
                let clock = WorkClock::new(CLOCK_COSTS).with_noise(noise, seed);
                Self::Work(WorkTimer::new(clock))
            }
            Clock::Wall => Self::Wall(Instant::now()),
        }
    }
}

impl FrameClock for Timer {
    fn start(&mut self, frame: u64) {
        match self {
            Self::Work(timer) => timer.start(frame),
            Self::Wall(start) => *start = Instant::now(),
        }
    }

    fn overhead(&self) -> f64 {
        match self {
            Self::Work(timer) => timer.overhead(),
            Self::Wall(start) => start.elapsed().as_secs_f64(),
        }
    }

    fn elapsed(&self, work: &Work) -> f64 {
        match self {
            Self::Work(timer) => timer.elapsed(work),
            Self::Wall(start) => start.elapsed().as_secs_f64(),
        }
    }
}

/// One frame of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FrameRow {
    /// Moment of the sequence, seconds.
    pub time: f64,
    /// Step, lengths of a voxel; of parts with different steps, that of as many samples.
    pub step: f64,
    /// The longest over the shortest step of its parts.
    pub step_spread: f64,
    /// Seconds of everything.
    pub frame_time: f64,
    /// Seconds of what is shown.
    pub cast_time: f64,
    /// Seconds before the first ray.
    pub overhead: f64,
    /// Predicted for what is shown, seconds.
    pub predicted: f64,
    /// Samples that were taken.
    pub samples: f64,
    /// Samples that were estimated, before anything learned.
    pub estimated: f64,
    /// Predicted over true cost of an estimated sample.
    pub cost_ratio: f64,
    /// Whether another transfer function holds from this frame on.
    pub is_switch: bool,
}

impl FrameRow {
    fn new(drawn: &Drawn, time: f64, is_switch: bool) -> Self {
        let predicted = drawn.prediction;
        let spread = drawn
            .steps
            .iter()
            .fold([f64::INFINITY, 0.0_f64], |[low, high], &s| {
                [low.min(s), high.max(s)]
            });
        Self {
            time,
            step: drawn.quality.step,
            step_spread: spread[1] / spread[0],
            frame_time: drawn.frame_time,
            cast_time: drawn.cast_time,
            overhead: drawn.overhead,
            predicted: predicted.time,
            samples: drawn.picture.work.samples as f64,
            estimated: drawn.estimated_samples,
            cost_ratio: predicted.cost_per_sample * predicted.samples / drawn.cast_time,
            is_switch,
        }
    }
}

/// A sequence in one way.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Run {
    /// The way.
    pub way: Way,
    /// Seconds that a frame may take.
    pub target: f64,
    /// Frame by frame.
    pub frames: Vec<FrameRow>,
}

/// Why there is no run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A frame.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The sequence.
    #[error(transparent)]
    Sequence(#[from] SequenceError),
}

/// What is looked at.
#[derive(Debug)]
pub struct Stage<'a> {
    /// The volume.
    pub volume: &'a Volume,
    /// Its rays.
    pub caster: &'a Raycaster<'a>,
    /// Its histograms.
    pub estimator: &'a Estimator<'a>,
    /// How empty space is left out.
    pub way_to_skip: Caster,
    /// Width and height of pictures, pixels.
    pub size: [u32; 2],
}

/// Leads some ways through a sequence, in turns.
///
/// # Errors
/// [`StudyError`].
pub fn run(
    stage: &Stage<'_>,
    sequence: &Sequence,
    ways: &[Way],
    target: f64,
    clock: Clock,
) -> Result<Vec<Run>, StudyError> {
    let mut loops = Vec::new();
    for &way in ways {
        let params = way.params(stage.way_to_skip, target, stage.size);
        let mut frames = FrameLoop::new(stage.volume, stage.caster, stage.estimator, params)?;
        let mut timer = Timer::new(clock);
        if way.is_ours() {
            frames.calibrate(&mut timer)?;
        }
        let run = Run {
            way,
            target,
            frames: Vec::new(),
        };
        loops.push((frames, timer, run));
    }
    let mut last_key = None;
    for frame in 0..sequence.frames() {
        let moment = sequence.at(sequence.time_of(frame))?;
        let is_switch = last_key.is_some_and(|key| key != moment.function_key);
        last_key = Some(moment.function_key);
        for (frames, timer, run) in &mut loops {
            let drawn = frames.draw(&moment, timer)?;
            run.frames
                .push(FrameRow::new(&drawn, moment.time, is_switch));
        }
    }
    Ok(loops.into_iter().map(|(_, _, run)| run).collect())
}

/// Plays a sequence in one way: each frame shows the moment that has been reached when it begins, and is
/// there for the target at least. `tell` hears of every frame and says whether to go on.
///
/// # Errors
/// [`StudyError`].
pub fn play(
    stage: &Stage<'_>,
    sequence: &Sequence,
    way: Way,
    target: f64,
    clock: Clock,
    mut tell: impl FnMut(&FrameRow, &Image) -> bool,
) -> Result<Run, StudyError> {
    let params = way.params(stage.way_to_skip, target, stage.size);
    let mut frames = FrameLoop::new(stage.volume, stage.caster, stage.estimator, params)?;
    let mut timer = Timer::new(clock);
    if way.is_ours() {
        frames.calibrate(&mut timer)?;
    }
    let mut run = Run {
        way,
        target,
        frames: Vec::new(),
    };
    let (mut time, mut last_key) = (0.0, None);
    while time < sequence.duration_s {
        let moment = sequence.at(time)?;
        let is_switch = last_key.is_some_and(|key| key != moment.function_key);
        last_key = Some(moment.function_key);
        let drawn = frames.draw(&moment, &mut timer)?;
        let row = FrameRow::new(&drawn, time, is_switch);
        run.frames.push(row);
        if !tell(&row, &drawn.picture.image) {
            break;
        }
        time += row.frame_time.max(target);
    }
    Ok(run)
}

/// A target for a sequence: three of four frames with the fixed step are faster.
///
/// # Errors
/// [`StudyError`].
pub fn suitable_target(
    stage: &Stage<'_>,
    sequence: &Sequence,
    clock: Clock,
) -> Result<f64, StudyError> {
    let runs = run(stage, sequence, &[Way::NoAdapt], 1.0, clock)?;
    let mut times: Vec<f64> = runs[0]
        .frames
        .iter()
        .map(|frame| frame.frame_time)
        .collect();
    times.sort_by(f64::total_cmp);
    Ok(times[times.len() * 3 / 4])
}

/// What a way did, over all frames of some runs. Errors are shares of the target.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Summary {
    /// How many frames.
    pub frames: usize,
    /// Arithmetic mean of the step, lengths of a voxel.
    pub mean_step: f64,
    /// Geometric mean of the step.
    pub geometric_step: f64,
    /// Root mean square of what frames took beyond the target, over those that did.
    pub rmse_up: f64,
    /// The same of what they took less, over the others.
    pub rmse_low: f64,
    /// Root mean square over all.
    pub rmse: f64,
    /// The slowest frame: its time less the target; negative if no frame was slower.
    pub error_up: f64,
    /// The fastest frame, likewise.
    pub error_low: f64,
    /// Share of frames above the target.
    pub slow: f64,
    /// Share of frames above 1.1 times the target.
    pub above_tenth: f64,
    /// Frames above 1.5 times the target.
    pub lags: usize,
    /// The longest run of frames above the target.
    pub slow_run: usize,
    /// Percentiles 50, 95, 99 of time over target.
    pub percentiles: [f64; 3],
    /// Root mean square of (predicted ÷ measured time − 1), after the first ten frames.
    pub prediction: f64,
    /// Root mean square of (estimated − true samples), over the mean of true ones.
    pub samples: f64,
    /// The same of predicted ÷ true cost of an estimated sample.
    pub cost: f64,
    /// Median of the time before the first ray.
    pub overhead: f64,
}

/// Frames that predictors may begin with.
const FIRST_FRAMES: usize = 10;

impl Summary {
    /// Of the runs of one way.
    #[must_use]
    pub fn of<'r>(runs: impl Iterator<Item = &'r Run>) -> Self {
        let mut loads = Vec::new();
        let (mut steps, mut logs) = (0.0, 0.0);
        let (mut slow_run, mut overheads) = (0, Vec::new());
        let mut ratios: [Vec<f64>; 3] = Default::default();
        let mut mean_samples = 0.0;
        for run in runs {
            let mut slow = 0;
            for (index, frame) in run.frames.iter().enumerate() {
                let load = frame.frame_time / run.target;
                loads.push(load);
                steps += frame.step;
                logs += frame.step.ln();
                slow = if load > 1.0 { slow + 1 } else { 0 };
                slow_run = slow_run.max(slow);
                overheads.push(frame.overhead / run.target);
                if index < FIRST_FRAMES {
                    continue;
                }
                mean_samples += frame.samples;
                ratios[1].push(frame.estimated - frame.samples);
                let found = [frame.predicted / frame.cast_time, frame.cost_ratio];
                // A frame without samples has no ratio.
                for (all, ratio) in [0, 2].into_iter().zip(found) {
                    let all = &mut ratios[all];
                    all.extend(Some(ratio - 1.0).filter(|r| r.is_finite()));
                }
            }
        }
        loads.sort_by(f64::total_cmp);
        overheads.sort_by(f64::total_cmp);
        let count = loads.len();
        let at = |sorted: &[f64], share: f64| {
            let last = sorted.len().saturating_sub(1);
            sorted
                .get((last as f64 * share).round() as usize)
                .copied()
                .unwrap_or(f64::NAN)
        };
        let share = |limit: f64| {
            loads.iter().filter(|&&load| load > limit).count() as f64 / count.max(1) as f64
        };
        let up: Vec<f64> = loads
            .iter()
            .filter(|&&load| load > 1.0)
            .map(|l| l - 1.0)
            .collect();
        let low: Vec<f64> = loads
            .iter()
            .filter(|&&load| load <= 1.0)
            .map(|l| l - 1.0)
            .collect();
        let all: Vec<f64> = loads.iter().map(|l| l - 1.0).collect();
        Self {
            frames: count,
            mean_step: steps / count.max(1) as f64,
            geometric_step: (logs / count.max(1) as f64).exp(),
            rmse_up: root_mean_square(&up),
            rmse_low: root_mean_square(&low),
            rmse: root_mean_square(&all),
            error_up: at(&loads, 1.0) - 1.0,
            error_low: at(&loads, 0.0) - 1.0,
            slow: share(1.0),
            above_tenth: share(1.1),
            lags: loads.iter().filter(|&&load| load > 1.5).count(),
            slow_run,
            percentiles: [0.5, 0.95, 0.99].map(|p| at(&loads, p)),
            prediction: root_mean_square(&ratios[0]),
            samples: root_mean_square(&ratios[1]) * ratios[1].len() as f64 / mean_samples,
            cost: root_mean_square(&ratios[2]),
            overhead: at(&overheads, 0.5),
        }
    }
}

/// 0 of nothing.
fn root_mean_square(values: &[f64]) -> f64 {
    // The sum of nothing is −0.
    let squares = values.iter().fold(0.0, |sum, v| sum + v * v);
    (squares / values.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(step: f64, frame_time: f64, predicted: f64) -> FrameRow {
        FrameRow {
            time: 0.0,
            step,
            step_spread: 1.0,
            frame_time,
            cast_time: frame_time,
            overhead: 0.0,
            predicted,
            samples: 5.0,
            estimated: 5.0,
            cost_ratio: predicted / frame_time,
            is_switch: false,
        }
    }

    #[test]
    fn a_summary_by_hand() {
        let mut frames = vec![row(1.0, 2.0, 2.0); FIRST_FRAMES];
        frames.extend([row(4.0, 3.0, 3.3), row(1.0, 2.1, 2.1), row(2.0, 1.0, 1.0)]);
        let run = Run {
            way: Way::Ours,
            target: 2.0,
            frames,
        };
        let found = Summary::of([&run].into_iter());
        assert_eq!((found.frames, found.lags, found.slow_run), (13, 0, 2));
        assert!((found.mean_step - 17.0 / 13.0).abs() < 1e-12);
        assert!((found.geometric_step - 8.0_f64.powf(1.0 / 13.0)).abs() < 1e-12);
        assert!((found.rmse_up - ((0.25 + 0.0025) / 2.0_f64).sqrt()).abs() < 1e-12);
        assert!((found.rmse_low - (0.25 / 11.0_f64).sqrt()).abs() < 1e-12);
        assert!((found.error_up - 0.5).abs() < 1e-12 && (found.error_low + 0.5).abs() < 1e-12);
        assert!((found.slow - 2.0 / 13.0).abs() < 1e-12);
        assert!((found.above_tenth - 1.0 / 13.0).abs() < 1e-12);
        assert!((found.prediction - (0.01 / 3.0_f64).sqrt()).abs() < 1e-12);
        assert_eq!(found.samples, 0.0);
    }
}
