//! The time of a frame, learned frame by frame.
//!
//! Bruder, Frey, Ertl, 2016, with four changes that `PredictorParams` can undo one by one. Two errors
//! have two learners, since they have different causes and time constants: β, the logarithm of
//! samples taken over samples estimated, which no clock disturbs; and σ, the cost of a sample. What
//! the machine does on the whole (clock rate, other programs) is one factor g, which follows within
//! some frames. And where a frame is unlike any before, as the kernel model itself says, the
//! additive model takes over. Learners are told times as they would be at g = 1.
//!
//! Invariants: predictions are finite and not negative; a time that cannot be (0, negative, not a
//! number) teaches nothing; one odd time moves nothing by more than a factor of 2.

use std::collections::VecDeque;

use super::{
    AdditiveModel, Counts, FEATURES, FrameModel, Krls, Lesson, Outlook, PixelsPerRay, PredictError,
    Prediction, PredictorParams, Quality, SampleUnit,
};
use crate::cast::Work;
use learning::Told;

/// Residuals from which the noise of times is found.
const RESIDUALS: usize = 32;

/// Standard deviation of the logarithm of times until there are some residuals.
const FIRST_DEVIATION: f64 = 0.3;

/// Residuals from which on they are believed.
const FEW_RESIDUALS: usize = 4;

/// Costs of samples whose quantile makes a step safe, and that quantile.
const COSTS: usize = 64;
const SAFE_QUANTILE: f64 = 0.95;

/// Limits of β; and of the speed of the machine, as a factor and its inverse.
const MAX_BIAS: f64 = 3.0;
const MAX_SPEED: f64 = 2.0;

/// Indices of the kernel models.
const COST: usize = 0;
const BIAS: usize = 1;

/// Units of costs for the kernel model, seconds: numbers near 1.
const COST_UNIT: f64 = 1e-9;

/// Predicts frames, and learns from them.
#[derive(Clone, Debug)]
pub struct FramePredictor {
    params: PredictorParams,
    volume_version: u64,
    cost: Option<Krls<FEATURES>>,
    bias: Option<Krls<FEATURES>>,
    additive: AdditiveModel,
    /// log g.
    log_speed: f64,
    /// Counted and expected rays, skips, lit samples: sums over recent frames.
    recent: [[f64; 2]; 3],
    /// What the kernel models of cost and bias were told in recent frames.
    told: [Told; 2],
    residuals: VecDeque<f64>,
    costs: VecDeque<f64>,
    frames: u64,
    outliers: u32,
}

/// What a prediction is made of.
struct Parts {
    features: [f64; FEATURES],
    prediction: Prediction,
    /// The time that the additive model predicts.
    additive_time: f64,
}

impl FramePredictor {
    /// A predictor that knows no frame yet.
    ///
    /// # Errors
    /// [`PredictError::Parameter`] and [`PredictError::Krls`].
    pub fn new(params: PredictorParams) -> Result<Self, PredictError> {
        params.check()?;
        Ok(Self {
            volume_version: 0,
            cost: params.cost.map(Krls::new).transpose()?,
            bias: params.bias.map(Krls::new).transpose()?,
            additive: AdditiveModel::new(params.cold_start, params.additive_memory),
            log_speed: 0.0,
            recent: [[0.0; 2]; 3],
            told: Default::default(),
            residuals: VecDeque::with_capacity(RESIDUALS),
            costs: VecDeque::with_capacity(COSTS),
            frames: 0,
            outliers: 0,
            params,
        })
    }

    /// Forgets all frames, for a volume of another version. What was learned of one volume is of no
    /// use for another.
    pub fn reset(&mut self, volume_version: u64) {
        if let Some(cost) = &mut self.cost {
            cost.clear();
        }
        if let Some(bias) = &mut self.bias {
            bias.clear();
        }
        self.volume_version = volume_version;
        self.additive = AdditiveModel::new(self.params.cold_start, self.params.additive_memory);
        self.log_speed = 0.0;
        self.recent = [[0.0; 2]; 3];
        self.told = Default::default();
        self.residuals.clear();
        self.costs.clear();
        self.frames = 0;
        self.outliers = 0;
    }

    /// How it predicts.
    #[must_use]
    pub fn params(&self) -> &PredictorParams {
        &self.params
    }

    /// Frames learned since the last reset.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// The present speed of the machine as a factor of times: 2 is half as fast as usual.
    #[must_use]
    pub fn speed(&self) -> f64 {
        self.log_speed.exp()
    }

    /// What rays, jumps and samples are known to cost.
    #[must_use]
    pub fn additive(&self) -> &AdditiveModel {
        &self.additive
    }

    /// Vectors in the dictionaries of cost and bias.
    #[must_use]
    pub fn dictionaries(&self) -> [usize; 2] {
        [&self.cost, &self.bias].map(|krls| krls.as_ref().map_or(0, |krls| krls.dictionary().len()))
    }

    /// What a frame will take.
    ///
    /// # Errors
    /// [`PredictError::Outlook`] and [`PredictError::Step`].
    pub fn predict(&self, outlook: &Outlook, quality: Quality) -> Result<Prediction, PredictError> {
        Ok(self.parts(outlook, quality)?.prediction)
    }

    /// One frame in any quality.
    #[must_use]
    pub fn frame<'a>(&'a self, outlook: &'a Outlook) -> FrameModel<'a> {
        FrameModel::new(self, outlook)
    }

    /// The step with which a frame holds `target` seconds even if samples cost what the dearest of
    /// the recent ones did and no ray ends early. It may be 0, and infinite if no step holds it.
    ///
    /// # Errors
    /// [`PredictError::Outlook`].
    pub fn safe_step(
        &self,
        outlook: &Outlook,
        pixels_per_ray: PixelsPerRay,
        target: f64,
    ) -> Result<f64, PredictError> {
        outlook.check()?;
        let costs = self.additive.costs();
        let step_one = Quality {
            step: 1.0,
            pixels_per_ray,
        };
        let stretch = if outlook.length > 0.0 {
            outlook.longest / outlook.length
        } else {
            1.0
        };
        let samples = outlook.lit_length * stretch / step_one.coarseness();
        let (cost, fixed) = match self.dearest_cost() {
            // Rays and jumps are in the cost already.
            Some(cost) => (cost, costs.fixed),
            None => (
                costs.sample + costs.lit,
                costs.fixed + costs.ray * outlook.rays(step_one),
            ),
        };
        let left = target - fixed * self.speed();
        if samples == 0.0 {
            return Ok(if left > 0.0 { 0.0 } else { f64::INFINITY });
        }
        let step = samples * cost * self.speed() / left;
        Ok(if left > 0.0 && step.is_finite() {
            step
        } else {
            f64::INFINITY
        })
    }

    fn parts(&self, outlook: &Outlook, quality: Quality) -> Result<Parts, PredictError> {
        outlook.check()?;
        if !(quality.step > 0.0 && quality.step.is_finite()) {
            return Err(PredictError::Step { step: quality.step });
        }
        let features = self.params.features.features(outlook, quality);
        let counts = self.counts(outlook, quality, &features)?;
        let samples = match self.params.unit {
            SampleUnit::Estimated => outlook.samples(quality),
            SampleUnit::Corrected => counts.samples,
            SampleUnit::Weighted => {
                let costs = self.params.cold_start;
                costs.time(&estimated(outlook, quality)) / costs.sample
            }
        };
        let additive_time = self.additive.predict(&counts);
        let (mut time, mut novelty, mut unknown) = (additive_time, 1.0, 0.0);
        if let Some(model) = &self.cost
            && samples > 0.0
        {
            let known = model.predict_with_deviation(&features)?;
            let cost = self.within_told(COST, known.mean) * COST_UNIT;
            // Nothing learned is 0, and what is far from all that was learned may be negative.
            if cost > 0.0 {
                novelty = known.novelty;
                unknown = known.deviation / known.mean;
                let share = match self.params.fallback {
                    Some([low, high]) => ((novelty - low) / (high - low)).clamp(0.0, 1.0),
                    None => 0.0,
                };
                let kernel_time = samples * cost;
                // The geometric mean: both may be off by a factor.
                time = kernel_time.powf(1.0 - share) * additive_time.powf(share);
            }
        }
        let [time, additive_time] =
            [time, additive_time].map(|time| (time * self.speed()).min(f64::MAX));
        let cost_per_sample = if samples > 0.0 { time / samples } else { 0.0 };
        Ok(Parts {
            features,
            prediction: Prediction {
                samples,
                cost_per_sample,
                time,
                deviation: self.noise().hypot(unknown),
                novelty,
                counts,
            },
            additive_time,
        })
    }

    /// The work that is expected.
    fn counts(
        &self,
        outlook: &Outlook,
        quality: Quality,
        features: &[f64; FEATURES],
    ) -> Result<Counts, PredictError> {
        let bias = match &self.bias {
            Some(bias) => {
                let bias = self.within_told(BIAS, bias.predict(features)?);
                bias.clamp(-MAX_BIAS, MAX_BIAS)
            }
            None => 0.0,
        };
        let expected = estimated(outlook, quality);
        let [rays, skips, lit] = self.recent.map(|[counted, expected]| {
            // One of each more: a ratio of nothing is 1.
            (counted + 1.0) / (expected + 1.0)
        });
        Ok(Counts {
            rays: expected.rays * rays,
            skips: expected.skips * skips,
            samples: expected.samples * bias.exp(),
            lit: expected.lit * lit,
        })
    }

    /// What a kernel model says, held within what it was told if so asked for.
    fn within_told(&self, model: usize, value: f64) -> f64 {
        match self.params.bounded {
            true => self.told[model].bound(value),
            false => value,
        }
    }

    /// Standard deviation of the logarithm of times of known frames.
    fn noise(&self) -> f64 {
        if self.residuals.len() < FEW_RESIDUALS {
            return FIRST_DEVIATION;
        }
        let squares: f64 = self.residuals.iter().map(|r| r * r).sum();
        (squares / self.residuals.len() as f64).sqrt()
    }

    fn dearest_cost(&self) -> Option<f64> {
        let mut costs: Vec<f64> = self.costs.iter().copied().collect();
        costs.sort_by(f64::total_cmp);
        let index = (costs.len() as f64 * SAFE_QUANTILE) as usize;
        costs.get(index.min(costs.len().saturating_sub(1))).copied()
    }
}

/// The work of a frame as far as its estimate tells, nothing learned.
fn estimated(outlook: &Outlook, quality: Quality) -> Counts {
    let rays = outlook.rays(quality);
    let samples = outlook.lit_length / quality.coarseness();
    Counts {
        rays,
        skips: outlook.jumps / quality.pixels_per_ray.count(),
        samples,
        lit: outlook.seen_length / quality.coarseness(),
    }
}

mod learning;

#[cfg(test)]
mod tests;
