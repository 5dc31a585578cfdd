//! The experiment of frame-time steering: one sequence, several ways to choose the step, and how long
//! frames take. Table 1 of Bruder, Frey, Ertl, 2016, with signed errors and more columns.
//!
//! Invariants: all ways see the same moments, and take turns frame by frame, so that slow moments of the
//! machine meet all of them; by the work clock a run is a function of its arguments.

mod clock;
mod seam;
mod summary;
mod way;

use crate::imaging::Image;
use crate::volume::{
    Drawn, Estimator, FrameLoop, Raycaster, Refined, Sequence, Volume,
    frames::FrameError,
    sequence::{Moment, SequenceError},
    steer::Resolution,
};
use clock::Timer;
pub use clock::{CLOCK_COSTS, Clock};
pub use seam::Seam;
pub use summary::Summary;
pub use way::{Caster, Way};

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
    /// Seconds of finding what can be seen.
    pub preparing: f64,
    /// Seconds that prediction takes.
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
    /// Whether the camera is within the box of the volume.
    pub is_within: bool,
    /// How it differs from a frame with one step, where that was looked at and steps differ.
    pub seam: Option<Seam>,
}

impl FrameRow {
    fn new(drawn: &Drawn, moment: &Moment, volume: &Volume, is_switch: bool) -> Self {
        let predicted = drawn.prediction;
        let samples = drawn.picture.work.samples as f64;
        // Of the same samples, whatever the unit of the prediction is.
        let samples_ratio = if samples > 0.0 && drawn.estimated_samples > 0.0 {
            samples / drawn.estimated_samples
        } else {
            1.0
        };
        let spread = drawn
            .steps
            .iter()
            .fold([f64::INFINITY, 0.0_f64], |[low, high], &s| {
                [low.min(s), high.max(s)]
            });
        let place = moment.camera.origin;
        Self {
            time: moment.time,
            step: drawn.quality.step,
            step_spread: spread[1] / spread[0],
            frame_time: drawn.frame_time,
            cast_time: drawn.cast_time,
            preparing: drawn.preparing,
            overhead: drawn.overhead,
            predicted: predicted.time,
            samples,
            estimated: drawn.estimated_samples,
            cost_ratio: predicted.time / drawn.cast_time * samples_ratio,
            is_switch,
            is_within: place.min_element() >= 0.0 && place.cmple(volume.extent()).all(),
            seam: None,
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
    /// Whether our ways may leave out rays.
    pub resolution: Resolution,
    /// Whether frames in parts are drawn once more, with one step, and compared.
    pub seams: bool,
}

impl<'a> Stage<'a> {
    /// Pictures of a size of a volume, with all their rays; seams are not looked at.
    #[must_use]
    pub fn new(
        volume: &'a Volume,
        caster: &'a Raycaster<'a>,
        estimator: &'a Estimator<'a>,
        size: [u32; 2],
    ) -> Self {
        Self {
            volume,
            caster,
            estimator,
            way_to_skip: Caster::Map,
            size,
            resolution: Resolution::Full,
            seams: false,
        }
    }

    /// A loop that is ready for its first frame.
    fn begin(
        &self,
        way: Way,
        target: f64,
        clock: Clock,
    ) -> Result<(FrameLoop<'a>, Timer, Run), StudyError> {
        let params = way.params(self, target);
        let mut frames = FrameLoop::new(self.volume, self.caster, self.estimator, params)?;
        let mut timer = Timer::new(clock);
        if way.is_ours() {
            frames.calibrate(&mut timer)?;
        }
        let run = Run {
            way,
            target,
            frames: Vec::new(),
        };
        Ok((frames, timer, run))
    }
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
    let loops = ways.iter().map(|&way| stage.begin(way, target, clock));
    let mut loops = loops.collect::<Result<Vec<_>, _>>()?;
    let mut last_key = None;
    for frame in 0..sequence.frames() {
        let moment = sequence.at(sequence.time_of(frame))?;
        let is_switch = last_key.is_some_and(|key| key != moment.function_key);
        last_key = Some(moment.function_key);
        for (frames, timer, run) in &mut loops {
            let drawn = frames.draw(&moment, timer)?;
            let mut row = FrameRow::new(&drawn, &moment, stage.volume, is_switch);
            if stage.seams && run.way == Way::Parts {
                row.seam = Seam::of(stage, &moment, &drawn)?;
            }
            run.frames.push(row);
        }
    }
    Ok(loops.into_iter().map(|(_, _, run)| run).collect())
}

/// Plays a sequence in one way: each frame shows the moment that has been reached when it begins, and is
/// there for the target at least. While nothing moves our ways refine what is seen, in frames that take
/// the target and are not rows of the run. `tell` hears of every frame and says whether to go on.
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
    let (mut frames, mut timer, mut run) = stage.begin(way, target, clock)?;
    let (mut time, mut last) = (0.0, None);
    while time < sequence.duration_s {
        let moment = sequence.at(time)?;
        if let Some((last, row)) = &mut last
            && way.is_ours()
            && moment.shows_the_same(last)
        {
            if let Refined::Finer(picture, step) = frames.refine(&mut timer)? {
                let refined: &mut FrameRow = row;
                (refined.time, refined.step) = (time, step);
                if !tell(refined, &picture.image) {
                    break;
                }
            }
            time += target;
            continue;
        }
        let is_switch = last
            .as_ref()
            .is_some_and(|(last, _)| last.function_key != moment.function_key);
        let drawn = frames.draw(&moment, &mut timer)?;
        let row = FrameRow::new(&drawn, &moment, stage.volume, is_switch);
        run.frames.push(row);
        if !tell(&row, &drawn.picture.image) {
            break;
        }
        time += row.frame_time.max(target);
        last = Some((moment, row));
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
