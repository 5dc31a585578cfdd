//! What a predictor learns of a frame that was drawn.
//!
//! Invariant: one odd time moves nothing by more than a factor of 2; a refused lesson changes nothing.

use std::collections::VecDeque;

use super::{
    COST_UNIT, COSTS, Counts, FEATURES, FramePredictor, Lesson, MAX_SPEED, Outlook, Parts,
    PredictError, Quality, RESIDUALS, Work, estimated,
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
            model.learn(&features, cost.min(MOST_COST) / COST_UNIT)?;
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
        let share = (1.0 / (self.frames as f64)).max(1.0 / RATIO_MEMORY);
        for (own, (count, expected)) in self.log_ratios.iter_mut().zip(pairs) {
            *own += (log_ratio(count, expected) - *own) * share;
        }
        if let Some(bias) = &mut self.bias
            && expected.samples > 0.0
        {
            bias.learn(features, log_ratio(counts.samples, expected.samples))?;
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
