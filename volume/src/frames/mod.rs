//! The loop of a frame: prepare, estimate, predict, choose a step, cast, measure, learn.
//!
//! Algorithm 1 of Bruder, Frey, Ertl, 2016, with control between the parts of a picture besides.
//!
//! Invariants: what a transfer function needs is prepared once for as long as it is the same; with a
//! clock that depends on work alone, frames are a function of what was asked for, in order.

mod calibrate;
mod clock;
mod rest;

use raywright_bvh::BuildWorkspace;

pub use clock::{FrameClock, WorkTimer};
use rest::Rest;

use crate::{
    appearance::{Appearance, AppearanceError},
    cast::{CastError, CastOptions, Picture, Prepared, Raycaster, Skipping, parts},
    enclosure::{EnclosureError, EnclosureParams},
    estimate::{EstimateMethod, Estimator, PreparedEstimate},
    grid::Volume,
    predict::{FramePredictor, Outlook, PredictError, Prediction, PredictorParams, Quality},
    sequence::Moment,
    steer::{
        Inside, InsideParams, Next, PartRatios, PartShare, Steering, SteeringError, SteeringParams,
        StepLimits, part_shares,
    },
};

/// The least that is left of a target for casting, as a share.
const LEAST_SHARE: f64 = 0.05;

/// Whether the step may change on the way through a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// One step for a frame.
    Whole,
    /// Each part of the picture has a step of its own if need be.
    Parts,
}

/// Everything that a loop is made with.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FrameLoopParams {
    /// How steps are chosen, and the target.
    pub steering: SteeringParams,
    /// How frames are predicted.
    pub predictor: PredictorParams,
    /// How the end of rays is estimated.
    pub method: EstimateMethod,
    /// Whether steps change within a frame.
    pub control: Control,
    /// Width and height of pictures, pixels.
    pub size: [u32; 2],
    /// Everything of pictures but their step and clip box.
    pub options: CastOptions,
    /// The tree around what can be seen, if the options skip by one.
    pub enclosure: Option<EnclosureParams>,
}

impl FrameLoopParams {
    /// Pictures of a size, steered in some way, with the default predictor.
    #[must_use]
    pub fn new(steering: SteeringParams, size: [u32; 2]) -> Self {
        Self {
            steering,
            predictor: PredictorParams::plus(),
            method: EstimateMethod::MeanExtinction,
            control: Control::Whole,
            size,
            options: CastOptions::default(),
            enclosure: None,
        }
    }
}

/// Why there is no frame.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// No picture.
    #[error(transparent)]
    Cast(#[from] CastError),
    /// A surface.
    #[error(transparent)]
    Appearance(#[from] AppearanceError),
    /// No tree around what can be seen.
    #[error(transparent)]
    Enclosure(#[from] EnclosureError),
    /// No prediction.
    #[error(transparent)]
    Predict(#[from] PredictError),
    /// No step.
    #[error(transparent)]
    Steering(#[from] SteeringError),
}

/// A frame that was drawn.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Drawn {
    /// What is shown.
    pub picture: Picture,
    /// Its quality; of parts with different steps, that of as many samples.
    pub quality: Quality,
    /// The steps of its parts, in their order; one if there are no parts.
    pub steps: Vec<f64>,
    /// Seconds of everything.
    pub frame_time: f64,
    /// Seconds of what is shown alone.
    pub cast_time: f64,
    /// Seconds of finding what can be seen, where it is not what it was in the last frame.
    pub preparing: f64,
    /// Seconds that prediction takes: estimating, features, predicting, choosing, learning.
    pub overhead: f64,
    /// What was predicted for what is shown, at the quality that it got in the end.
    pub prediction: Prediction,
    /// Samples that were estimated, before anything learned.
    pub estimated_samples: f64,
    /// As of the [`Pass`](crate::steer::Pass): whether the step was a safe one.
    pub safe: bool,
    /// As of the [`Pass`](crate::steer::Pass): whether no quality was expected to hold the target.
    pub over_budget: bool,
}

/// Draws frame after frame of a volume, each in its time.
#[derive(Debug)]
pub struct FrameLoop<'a> {
    volume: &'a Volume,
    caster: &'a Raycaster<'a>,
    estimator: &'a Estimator<'a>,
    params: FrameLoopParams,
    steering: Steering,
    predictor: FramePredictor,
    part_ratios: PartRatios,
    shown: Option<Shown<'a>>,
    rest: Option<Rest>,
    workspace: BuildWorkspace,
    frame: u64,
}

/// What was prepared for a transfer function, and surfaces if there are any.
#[derive(Debug)]
struct Shown<'a> {
    appearance: Appearance,
    prepared: Prepared<'a>,
    estimate: PreparedEstimate<'a>,
}

impl<'a> FrameLoop<'a> {
    /// A loop that has drawn no frame; the steps allowed are those of its parameters and of the volume.
    ///
    /// # Errors
    /// [`FrameError::Steering`] and [`FrameError::Predict`] if a parameter has no meaning.
    pub fn new(
        volume: &'a Volume,
        caster: &'a Raycaster<'a>,
        estimator: &'a Estimator<'a>,
        params: FrameLoopParams,
    ) -> Result<Self, FrameError> {
        Ok(Self {
            volume,
            caster,
            estimator,
            steering: Steering::new(params.steering.for_volume(volume))?,
            predictor: FramePredictor::new(params.predictor)?,
            part_ratios: PartRatios::default(),
            params,
            shown: None,
            rest: None,
            workspace: BuildWorkspace::default(),
            frame: 0,
        })
    }

    /// What it has learned.
    #[must_use]
    pub fn predictor(&self) -> &FramePredictor {
        &self.predictor
    }

    /// Measures what rays, jumps, samples and a frame itself cost on this machine, some small pictures
    /// long, and forgets what was learned: to be called before the first frame. Without it a loop begins
    /// with the costs of its parameters, and learns the rarer ones late.
    ///
    /// # Errors
    /// [`FrameError`].
    pub fn calibrate(&mut self, clock: &mut impl FrameClock) -> Result<(), FrameError> {
        self.params.predictor.cold_start =
            calibrate::costs(self.volume, self.caster, &self.params, clock)?;
        self.predictor = FramePredictor::new(self.params.predictor)?;
        Ok(())
    }

    /// Draws what is to be seen at a moment.
    ///
    /// # Errors
    /// [`FrameError`].
    pub fn draw(
        &mut self,
        moment: &Moment,
        clock: &mut impl FrameClock,
    ) -> Result<Drawn, FrameError> {
        let frame = self.frame;
        self.frame += 1;
        clock.start(frame);
        let target = self.params.steering.target;
        let mut options = self.params.options;
        options.clip = moment.clip;
        self.rest = None;
        // That of the last frame: whether a short ray has a sample depends on it.
        options.step = self.steering.shown().map_or(1.0, |shown| shown.step as f32);
        let size = self.params.size;
        let appearance = moment.appearance();
        let kept = self
            .shown
            .take()
            .filter(|shown| shown.appearance == appearance);
        let mut preparing = 0.0;
        let shown = match kept {
            Some(shown) => shown,
            None => {
                let prepared =
                    prepare(self.caster, &self.params, &mut self.workspace, &appearance)?;
                preparing = clock.overhead();
                let mut estimate = self
                    .estimator
                    .prepare(&appearance.function, self.params.method);
                if options.skipping == Skipping::Distance {
                    estimate = estimate.with_blocks_of(&prepared);
                }
                Shown {
                    appearance,
                    prepared,
                    estimate,
                }
            }
        };
        let shown = &*self.shown.insert(shown);
        let estimate = shown
            .estimate
            .estimate(moment.camera, size, &options, frame as u32)?;
        let outlook = Outlook::new(&estimate, self.volume, &moment.camera, size, options.step);
        let left = (target - clock.overhead()).max(LEAST_SHARE * target);
        self.steering.set_target(left)?;
        let mut pass = self.steering.begin(&self.predictor.frame(&outlook));
        let mut overhead = clock.overhead() - preparing;
        let mut spent = 0.0;
        loop {
            options.step = pass.quality.step as f32;
            options.pixels_per_ray = pass.quality.pixels_per_ray;
            clock.start(frame);
            let (picture, steps, quality) = match self.params.control {
                Control::Whole => {
                    let picture = shown.prepared.render(moment.camera, size, &options)?;
                    (picture, vec![pass.quality.step], pass.quality)
                }
                Control::Parts => {
                    let rows = parts(size[1]);
                    let mut shares = part_shares(&estimate, size[1], &rows);
                    self.part_ratios.correct(&mut shares);
                    let limits = self.steering.params().limits;
                    let (predictor, left) = (&self.predictor, left - spent);
                    let inside = inside(predictor, &outlook, pass.quality, left, limits, shares)?;
                    let ratios = &mut self.part_ratios;
                    in_parts(
                        &shown.prepared,
                        moment,
                        size,
                        &options,
                        inside,
                        ratios,
                        clock,
                    )?
                }
            };
            let time = clock.elapsed(&picture.work);
            let prediction = self.predictor.predict(&outlook, quality)?;
            let estimated_samples = outlook.samples(quality);
            clock.start(frame);
            self.predictor
                .learn(&outlook, quality, &picture.work, time)?;
            overhead += clock.overhead();
            self.steering.drew(quality);
            match self.steering.finish(time)? {
                Next::DrawAgain(again) => {
                    pass = again;
                    spent += time;
                }
                Next::Shown { frame_time, .. } => {
                    let shortest = self.steering.params().limits.shortest;
                    let rest = Rest::new(moment.camera, size, options, quality, shortest);
                    self.rest = Some(rest);
                    return Ok(Drawn {
                        picture,
                        quality,
                        steps,
                        frame_time: preparing + overhead + frame_time,
                        cast_time: time,
                        preparing,
                        overhead,
                        prediction,
                        estimated_samples,
                        safe: pass.safe,
                        over_budget: pass.over_budget,
                    });
                }
            }
        }
    }
}

/// What became of a picture in a time in which nothing moved.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Refined {
    /// A finer picture, with this step, lengths of a voxel.
    Finer(Box<Picture>, f64),
    /// Nothing yet: the time was up.
    Unfinished,
    /// There is nothing finer: the last picture is the one that a direct render makes with the shortest
    /// step, bit for bit.
    Done,
}

impl FrameLoop<'_> {
    /// Refines the picture of the last frame for at most the target, since nothing moved; to be called
    /// again until it is done, or something moves, which [`draw`](Self::draw) is for. It stops within some
    /// rows of pixels, and goes on where it stopped.
    ///
    /// # Errors
    /// [`FrameError`].
    pub fn refine(&mut self, clock: &mut impl FrameClock) -> Result<Refined, FrameError> {
        let (Some(rest), Some(shown)) = (&mut self.rest, &self.shown) else {
            return Ok(Refined::Done);
        };
        if rest.is_done() {
            return Ok(Refined::Done);
        }
        clock.start(self.frame);
        self.frame += 1;
        let target = self.params.steering.target;
        let finer = rest.advance(&shown.prepared, |work| clock.elapsed(work) < target)?;
        Ok(match finer {
            Some((picture, step)) => Refined::Finer(Box::new(picture), step),
            None => Refined::Unfinished,
        })
    }
}

/// Control of a pass that may take `target` seconds.
fn inside(
    predictor: &FramePredictor,
    outlook: &Outlook,
    quality: Quality,
    target: f64,
    limits: StepLimits,
    shares: Vec<PartShare>,
) -> Result<Inside, FrameError> {
    let prediction = predictor.predict(outlook, quality)?;
    let costs = predictor.additive().costs();
    let all = costs.time(&prediction.counts) - costs.fixed;
    let samples = costs.sample * prediction.counts.samples + costs.lit * prediction.counts.lit;
    let share = if all > 0.0 { samples / all } else { 1.0 };
    Ok(Inside::new(InsideParams::new(
        target,
        prediction.time,
        share,
        quality.step,
        limits,
        shares,
    )))
}

/// An appearance, and the tree around what can be seen if there is to be one.
fn prepare<'a>(
    caster: &'a Raycaster<'a>,
    params: &FrameLoopParams,
    workspace: &mut BuildWorkspace,
    appearance: &Appearance,
) -> Result<Prepared<'a>, FrameError> {
    let mut prepared = caster.prepare_appearance(appearance.clone())?;
    if let Some(enclosure) = &params.enclosure {
        prepared.enclose(enclosure, workspace)?;
    }
    Ok(prepared)
}

/// A picture with control between its parts, their steps, and the quality of the whole.
fn in_parts(
    prepared: &Prepared<'_>,
    moment: &Moment,
    size: [u32; 2],
    options: &CastOptions,
    mut inside: Inside,
    ratios: &mut PartRatios,
    clock: &impl FrameClock,
) -> Result<(Picture, Vec<f64>, Quality), FrameError> {
    let mut begun = Vec::with_capacity(size[1].min(64) as usize);
    let picture = prepared.render_in_parts(moment.camera, size, options, |_, work| {
        let elapsed = clock.elapsed(work);
        begun.push(elapsed);
        inside.next_step(elapsed) as f32
    })?;
    begun.push(clock.elapsed(&picture.work));
    let times: Vec<f64> = begun.windows(2).map(|pair| pair[1] - pair[0]).collect();
    ratios.learn(&inside, &times);
    let quality = Quality {
        step: inside.mean_step(),
        pixels_per_ray: options.pixels_per_ray,
    };
    Ok((picture, inside.steps().to_vec(), quality))
}
