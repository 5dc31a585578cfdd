//! The time of a frame as a sum: so much for a ray, a jump over empty space, a sample, a sample of
//! which something is seen, and the frame itself.
//!
//! Least squares of relative errors with a forgetting factor, its five coefficients held at 0 or
//! above. What recent frames do not tell apart (rays and jumps, as a rule) stays near the
//! coefficients that the model was given, times the speed of this machine relative to them: each
//! unknown is a multiple of its given coefficient, drawn weakly to the mean ratio of measured to
//! given time.
//!
//! It knows something before the first frame, and something of frames unlike any that was seen:
//! there, better than a kernel; where there were similar frames, worse. So it is the start and the
//! fallback of [`FramePredictor`](super::FramePredictor).
//!
//! Invariants: coefficients are finite and not negative; prediction and memory are functions of what
//! was learned, in order.

use crate::cast::Work;

/// Number of coefficients.
const TERMS: usize = 5;

/// Strength of the pull to the given coefficients: that of a part of a frame.
const PULL: f64 = 0.02;

/// Passes over the coefficients; they have met long before, as a rule.
const SWEEPS: usize = 200;

/// Change of a coefficient, relative to the given one, at which the passes end.
const PRECISION: f64 = 1e-10;

/// What parts of a frame cost, in seconds each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkCosts {
    /// A ray that meets the box of the volume.
    pub ray: f64,
    /// A jump over empty space.
    pub skip: f64,
    /// A sample.
    pub sample: f64,
    /// A sample of which something is seen, on top.
    pub lit: f64,
    /// The frame itself.
    pub fixed: f64,
}

impl Default for WorkCosts {
    /// One core of a machine of 2024, to begin with.
    fn default() -> Self {
        Self {
            ray: 12e-9,
            skip: 6e-9,
            sample: 4.5e-9,
            lit: 2e-9,
            fixed: 20e-6,
        }
    }
}

impl WorkCosts {
    /// The costs times a factor.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self::from_array(self.to_array().map(|cost| cost * factor))
    }

    /// The time of some work, in seconds.
    #[must_use]
    pub fn time(&self, counts: &Counts) -> f64 {
        let counts = counts.to_array();
        self.to_array().iter().zip(counts).map(|(c, n)| c * n).sum()
    }

    fn to_array(self) -> [f64; TERMS] {
        [self.ray, self.skip, self.sample, self.lit, self.fixed]
    }

    fn from_array([ray, skip, sample, lit, fixed]: [f64; TERMS]) -> Self {
        Self {
            ray,
            skip,
            sample,
            lit,
            fixed,
        }
    }
}

/// Work that was counted or is expected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Rays that meet the box of the volume.
    pub rays: f64,
    /// Jumps over empty space.
    pub skips: f64,
    /// Samples.
    pub samples: f64,
    /// Samples of which something is seen.
    pub lit: f64,
}

impl From<&Work> for Counts {
    fn from(work: &Work) -> Self {
        Self {
            rays: work.rays as f64,
            skips: work.skips as f64,
            samples: work.samples as f64,
            lit: work.lit_samples as f64,
        }
    }
}

impl Counts {
    fn to_array(self) -> [f64; TERMS] {
        [self.rays, self.skips, self.samples, self.lit, 1.0]
    }
}

/// Learns what parts of a frame cost.
#[derive(Clone, Debug, PartialEq)]
pub struct AdditiveModel {
    given: WorkCosts,
    forgetting: f64,
    costs: WorkCosts,
    /// Σ z zᵀ and Σ z, z being the parts that the given costs have in the measured time.
    products: [[f64; TERMS]; TERMS],
    sums: [f64; TERMS],
    /// Weight and sum of log(measured / given).
    weight: f64,
    log_ratios: f64,
}

impl AdditiveModel {
    /// A model that begins with given costs and remembers about `frames` ≥ 1 frames.
    ///
    /// Costs that are not above 0 and finite are taken as those of [`WorkCosts::default`].
    #[must_use]
    pub fn new(given: WorkCosts, frames: f64) -> Self {
        let usual = WorkCosts::default().to_array();
        let mut costs = given.to_array();
        for (cost, usual) in costs.iter_mut().zip(usual) {
            if !(*cost > 0.0 && cost.is_finite()) {
                *cost = usual;
            }
        }
        let given = WorkCosts::from_array(costs);
        Self {
            given,
            forgetting: 1.0 - 1.0 / frames.max(1.0),
            costs: given,
            products: [[0.0; TERMS]; TERMS],
            sums: [0.0; TERMS],
            weight: 0.0,
            log_ratios: 0.0,
        }
    }

    /// The costs as they are known now.
    #[must_use]
    pub fn costs(&self) -> &WorkCosts {
        &self.costs
    }

    /// The expected time of some work, seconds.
    #[must_use]
    pub fn predict(&self, counts: &Counts) -> f64 {
        self.costs.time(counts)
    }

    /// Learns that `counts` took `time` seconds. A time that is not above 0 and finite teaches
    /// nothing, nor do counts that are not finite; returns whether something was learned.
    pub fn learn(&mut self, counts: &Counts, time: f64) -> bool {
        let given = self.given.time(counts);
        if !(time > 0.0 && time.is_finite() && given > 0.0 && given.is_finite()) {
            return false;
        }
        let mut parts = self.given.to_array();
        for (part, count) in parts.iter_mut().zip(counts.to_array()) {
            *part *= count / time;
        }
        if !parts.iter().all(|part| part.is_finite() && *part <= 1e60) {
            return false;
        }
        for (row, a) in parts.iter().enumerate() {
            for (column, b) in parts.iter().enumerate() {
                let sum = &mut self.products[row][column];
                *sum = *sum * self.forgetting + a * b;
            }
            self.sums[row] = self.sums[row] * self.forgetting + a;
        }
        self.weight = self.weight * self.forgetting + 1.0;
        self.log_ratios = self.log_ratios * self.forgetting + (time / given).ln();
        self.solve();
        true
    }

    /// The factors u of the given costs that minimise Σ(zᵀu − 1)² + pull·|u − speed|², u ≥ 0: one
    /// after the other, until none changes. Strictly convex, so there is one minimum.
    fn solve(&mut self) {
        let speed = (self.log_ratios / self.weight).exp();
        // In units of the mean speed, so that the pull is as strong on any machine.
        let mut factors = [1.0; TERMS];
        for _ in 0..SWEEPS {
            let mut change: f64 = 0.0;
            for i in 0..TERMS {
                let others: f64 = (0..TERMS)
                    .filter(|&j| j != i)
                    .map(|j| self.products[i][j] * factors[j])
                    .sum();
                let slope = self.sums[i] * speed - others * speed * speed + PULL;
                let curvature = self.products[i][i] * speed * speed + PULL;
                let factor = (slope / curvature).max(0.0);
                change = change.max((factor - factors[i]).abs());
                factors[i] = factor;
            }
            if change < PRECISION {
                break;
            }
        }
        let mut costs = self.given.to_array();
        for (cost, factor) in costs.iter_mut().zip(factors) {
            *cost *= factor * speed;
        }
        if costs.iter().all(|cost| cost.is_finite()) {
            self.costs = WorkCosts::from_array(costs);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(i: u32) -> Counts {
        let wave = |k: f64| 1.0 + 0.9 * (f64::from(i) * k).sin();
        Counts {
            rays: 2e5 * wave(0.7),
            skips: 8e5 * wave(1.3),
            samples: 4e6 * wave(0.31),
            lit: 1e6 * wave(2.1),
        }
    }

    #[test]
    fn costs_of_another_machine_are_found() {
        let truth = WorkCosts {
            ray: 60e-9,
            skip: 3e-9,
            sample: 9e-9,
            lit: 0.0,
            fixed: 1e-4,
        };
        let mut model = AdditiveModel::new(WorkCosts::default(), 64.0);
        let mut last = 0.0;
        for i in 0..300 {
            let (time, predicted) = (truth.time(&counts(i)), model.predict(&counts(i)));
            last = predicted / time;
            if i > 20 {
                assert!((last - 1.0).abs() < 0.1, "{i}: {last}");
            }
            assert!(model.learn(&counts(i), time));
        }
        assert!((last - 1.0).abs() < 0.02, "{last}");
        assert!((model.costs().sample / truth.sample - 1.0).abs() < 0.05);
        assert!(model.costs().lit < 0.5e-9);
    }

    #[test]
    fn one_frame_tells_the_speed() {
        let mut model = AdditiveModel::new(WorkCosts::default(), 64.0);
        let time = 7.0 * model.predict(&counts(0));
        model.learn(&counts(0), time);
        assert!((model.predict(&counts(0)) / time - 1.0).abs() < 1e-6);
        assert!(
            (model.predict(&counts(1)) / (7.0 * WorkCosts::default().time(&counts(1))) - 1.0).abs()
                < 1e-6
        );
    }

    #[test]
    fn a_slower_machine_is_noticed() {
        let mut model = AdditiveModel::new(WorkCosts::default(), 64.0);
        for i in 0..500 {
            let speed = if i < 200 { 1.0 } else { 2.0 };
            model.learn(&counts(i), speed * WorkCosts::default().time(&counts(i)));
        }
        let ratio = model.predict(&counts(3)) / WorkCosts::default().time(&counts(3));
        assert!((ratio - 2.0).abs() < 0.05, "{ratio}");
    }

    #[test]
    fn what_teaches_nothing() {
        let mut model = AdditiveModel::new(WorkCosts::default(), 64.0);
        let before = model.clone();
        for time in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(!model.learn(&counts(1), time));
        }
        let endless = Counts {
            samples: f64::INFINITY,
            ..Counts::default()
        };
        assert!(!model.learn(&endless, 1.0));
        assert!(!model.learn(&counts(1), f64::MIN_POSITIVE));
        assert_eq!(model, before);
        let odd = WorkCosts {
            ray: f64::NAN,
            skip: -1.0,
            ..WorkCosts::default()
        };
        assert_eq!(AdditiveModel::new(odd, 0.0).given, WorkCosts::default());
    }

    #[test]
    fn an_empty_frame_teaches_what_a_frame_costs() {
        let mut model = AdditiveModel::new(WorkCosts::default(), 64.0);
        for _ in 0..100 {
            assert!(model.learn(&Counts::default(), 1e-3));
        }
        assert!((model.predict(&Counts::default()) / 1e-3 - 1.0).abs() < 0.01);
        assert!(model.predict(&counts(2)).is_finite());
    }
}
