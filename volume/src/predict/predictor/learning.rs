//! What a predictor learns of a frame that was drawn.
//!
//! Invariant: one odd time moves nothing by more than a factor of 2; a refused lesson changes nothing.

use std::collections::VecDeque;

use super::{
    BIAS, COST, COST_UNIT, COSTS, Counts, FEATURES, FramePredictor, Lesson, MAX_BIAS, MAX_SPEED,
    Outlook, Parts, PredictError, Quality, RESIDUALS, Work, estimated,
};

/// A measured time this many times the predicted one, or one over it, is an outlier.
const OUTLIER: f64 = 20.0;

/// What an outlier is taken for: the prediction times this, or over it.
const OUTLIER_WEIGHT: f64 = 2.0;

/// Outliers in a row after which everything that was learned is forgotten: the machine is another.
const OUTLIERS: u32 = 5;

/// What is left after a frame of a speed other than 1: what lasts is the business of σ.
const SPEED_DECAY: f64 = 0.99;

/// Novelty up to which a frame tells the speed of the machine, and how noisy times are.
const KNOWN: f64 = 0.1;

/// A sample that costs more seconds is a fault of the clock.
const MOST_COST: f64 = 1.0;

/// Lessons that are kept.
const LESSONS: usize = 64;

/// What a kernel model was told in recent frames, which bounds what it may say: it may lie between its
/// lessons, but follows no trend beyond them. Smooth as it is, it would: in the scripted sequences of one
/// volume (fingers, seed 101, 96², 30 frames a second) the slowest frame takes 2.5 targets without bounds, and
/// 1.08 with them.
#[derive(Clone, Debug, Default)]
pub(super) struct Told(VecDeque<f64>);

impl Told {
    fn add(&mut self, value: f64) {
        push(&mut self.0, LESSONS, value);
    }

    /// The value between the lessons that is nearest to one; the value itself if there is no lesson.
    pub(super) fn bound(&self, value: f64) -> f64 {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &told in &self.0 {
            (low, high) = (low.min(told), high.max(told));
        }
        if low <= high {
            value.clamp(low, high)
        } else {
            value
        }
    }
}

/// Frames over which ratios of counts are averaged.
const RATIO_MEMORY: f64 = 10.0;

impl FramePredictor {
    /// Learns what a frame took: `work` and `time` seconds.
    ///
    /// # Errors
    /// [`PredictError::Outlook`] and [`PredictError::Step`]; nothing was learned.
    pub fn learn(
        &mut self,
        outlook: &Outlook,
        quality: Quality,
        work: &Work,
        time: f64,
    ) -> Result<Lesson, PredictError> {
        let Parts {
            features,
            prediction,
            additive_time,
        } = self.parts(outlook, quality)?;
        if outlook.volume_version != self.volume_version {
            return Ok(Lesson::Stale);
        }
        if !(time > 0.0 && time.is_finite()) {
            return Ok(Lesson::BadTime);
        }
        let (low, high) = (
            prediction.time.min(additive_time),
            prediction.time.max(additive_time),
        );
        // Where there is nothing to sample, times are all overhead, of which little is known.
        let expected = prediction.samples > 0.0;
        let sampled = expected && work.samples > 0;
        let odd = self.frames > 0 && sampled && !(low / OUTLIER..=high * OUTLIER).contains(&time);
        if odd && self.outliers + 1 >= OUTLIERS {
            self.reset(self.volume_version);
            return self.learn(outlook, quality, work, time);
        }
        if sampled {
            self.outliers = if odd { self.outliers + 1 } else { 0 };
        }
        let time = if odd {
            time.clamp(low / OUTLIER_WEIGHT, high * OUTLIER_WEIGHT)
        } else {
            time
        };
        let residual = (time / prediction.time).ln();
        if self.frames > 0 && sampled && prediction.novelty <= KNOWN {
            push(&mut self.residuals, RESIDUALS, residual);
            self.learn_speed(residual);
        }
        self.frames += 1;
        let usual_time = time / self.speed();
        self.additive.learn(&Counts::from(work), usual_time);
        self.learn_counts(outlook, quality, work, &features)?;
        if !expected {
            return Ok(Lesson::NoSamples);
        }
        let lit = outlook.lit_length / quality.coarseness();
        if lit > 0.0 {
            push(&mut self.costs, COSTS, usual_time / lit);
        }
        let cost = usual_time / prediction.samples;
        if let Some(model) = &mut self.cost {
            let cost = cost.min(MOST_COST) / COST_UNIT;
            self.told[COST].add(cost);
            model.learn(&features, cost)?;
        }
        Ok(if odd {
            Lesson::Outlier
        } else {
            Lesson::Learned
        })
    }

    fn learn_speed(&mut self, residual: f64) {
        let Some(memory) = self.params.speed_memory else {
            return;
        };
        let limit = MAX_SPEED.ln();
        let speed = self.log_speed * SPEED_DECAY + residual.clamp(-limit, limit) / memory;
        self.log_speed = speed.clamp(-limit, limit);
    }

    fn learn_counts(
        &mut self,
        outlook: &Outlook,
        quality: Quality,
        work: &Work,
        features: &[f64; FEATURES],
    ) -> Result<(), PredictError> {
        let counts = Counts::from(work);
        let expected = estimated(outlook, quality);
        let pairs = [
            (counts.rays, expected.rays),
            (counts.skips, expected.skips),
            (counts.lit, expected.lit),
        ];
        let kept = 1.0 - 1.0 / RATIO_MEMORY;
        for (sums, (count, expected)) in self.recent.iter_mut().zip(pairs) {
            *sums = [sums[0] * kept + count, sums[1] * kept + expected];
        }
        if let Some(model) = &mut self.bias
            && expected.samples > 0.0
        {
            let bias = log_ratio(counts.samples, expected.samples).clamp(-MAX_BIAS, MAX_BIAS);
            self.told[BIAS].add(bias);
            model.learn(features, bias)?;
        }
        Ok(())
    }
}

/// The logarithm of a ratio of counts, either of which may be 0.
fn log_ratio(count: f64, expected: f64) -> f64 {
    ((count + 1.0) / (expected + 1.0)).ln()
}

fn push(queue: &mut VecDeque<f64>, limit: usize, value: f64) {
    if queue.len() == limit {
        queue.pop_front();
    }
    queue.push_back(value);
}
