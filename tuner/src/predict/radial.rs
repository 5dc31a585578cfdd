//! A value function over radial basis functions of state and point, learned by myopic Greedy-GQ.
//!
//! Herveau, Pfaffe, Tillmann, Tichy & Dachsbacher, "Analysis of Acceleration Structure Parameters and Hybrid
//! Autotuning for Ray Tracing" (TVCG): the value of a point in a state is θ·φ(x), where x is the scaled state
//! followed by the point, and φ are 100 functions around the points of a Latin hypercube. As printed,
//! φ_i(x) = exp(−ω·‖x − c_i‖), an exponential kernel; with the square of the distance it would be a Gaussian.
//!
//! Maei, Szepesvári, Bhatnagar & Sutton, "Toward Off-Policy Learning Control with Function Approximation",
//! ICML 2010: Greedy-GQ. With a discount of 0 ("myopic") the value of what follows drops out, and with it
//! the second weight vector; what is left of the update is θ ← θ + α·(R − θ·φ)·φ, least mean squares (Widrow
//! & Hoff 1960). It converges for 0 < α < 2/‖φ‖².
//!
//! Invariants: weights begin at 0 and are finite; the distance to a centre is that of the state plus that of
//! the point, so that choosing among candidates takes the state's part once. Not good for: precision. In some
//! twenty axes all distances to such centres are nearly equal, so that the functions hardly differ; kept to
//! compare with the paper.

use super::features::squared_distance;
use super::{Features, PredictError, Predictor, Scaling};
use super::{check_cost, check_point, check_range, least};
use crate::linear::dot;
use crate::rng::Stream;
use crate::search::latin_hypercube::latin_hypercube;

/// Basis functions as printed: 3.5 for each of 11 parameters and 17 indicators, rounded.
const FUNCTIONS: usize = 100;

/// How a basis function falls with the distance r from its centre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// exp(−ω·r), as printed.
    Exponential,
    /// exp(−ω·r²).
    Gaussian,
}

/// What a cost is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reward {
    /// 1/cost, as printed: of seconds, frames per second. States in which everything is fast outweigh others.
    Inverse,
    /// −ln cost: of a cost relative to that of the default in the same state, 0 is the default.
    Logarithm,
}

impl Reward {
    fn of(self, cost: f64) -> f64 {
        match self {
            Reward::Inverse => cost.recip(),
            Reward::Logarithm => -libm::log(cost),
        }
    }
}

/// The factor α of an update.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepSize {
    /// α itself, in 0..=1; where it is above 1/‖φ‖², that instead: more than twice that diverges.
    Fixed(f64),
    /// α·‖φ‖², in 0..=1: the share of the error that an update removes.
    Normalised(f64),
}

/// Settings of [`RadialBasis`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RadialSettings {
    /// How functions fall with distance.
    pub kernel: Kernel,
    /// What is learned of a cost.
    pub reward: Reward,
    /// How fast it is learned.
    pub step: StepSize,
    /// How states are scaled.
    pub scaling: Scaling,
}

impl RadialSettings {
    /// The paper's kernel, reward and scaling. It prints no α: 0.1, since 0.01 has not learned much after
    /// one pass over some hundred samples.
    #[must_use]
    pub fn printed() -> RadialSettings {
        RadialSettings {
            kernel: Kernel::Exponential,
            reward: Reward::Inverse,
            step: StepSize::Fixed(0.1),
            scaling: Scaling::Printed,
        }
    }

    /// Logarithmic reward, half of every error removed, rescaled states.
    #[must_use]
    pub fn rescaled() -> RadialSettings {
        RadialSettings {
            reward: Reward::Logarithm,
            step: StepSize::Normalised(0.5),
            scaling: Scaling::Rescaled,
            ..RadialSettings::printed()
        }
    }

    /// The same with another kernel.
    #[must_use]
    pub fn with_kernel(self, kernel: Kernel) -> RadialSettings {
        RadialSettings { kernel, ..self }
    }

    /// The same with another step.
    #[must_use]
    pub fn with_step(self, step: StepSize) -> RadialSettings {
        RadialSettings { step, ..self }
    }
}

impl Default for RadialSettings {
    fn default() -> RadialSettings {
        RadialSettings::printed()
    }
}

/// Radial basis functions of a state and a point.
#[derive(Clone, Debug)]
pub(super) struct Basis {
    kernel: Kernel,
    states: Vec<Vec<f64>>,
    points: Vec<Vec<f64>>,
}

impl Basis {
    /// [`FUNCTIONS`] functions around a Latin hypercube of `features` and `axes` dimensions.
    pub(super) fn new(kernel: Kernel, features: usize, axes: usize, seed: u64) -> Basis {
        let mut stream = Stream::new(seed);
        let centres = latin_hypercube(FUNCTIONS, features + axes, &mut stream);
        let split = centres.into_iter().map(|mut state| {
            let point = state.split_off(features);
            (state, point)
        });
        let (states, points) = split.unzip();
        Basis {
            kernel,
            states,
            points,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.states.len()
    }

    /// The state's part of the squared distance to each centre.
    pub(super) fn distances(&self, scaled: &[f64]) -> Vec<f64> {
        let centres = self.states.iter();
        centres
            .map(|centre| squared_distance(centre, scaled))
            .collect()
    }

    /// The functions at a point, where the state's parts are given.
    pub(super) fn functions(&self, distances: &[f64], point: &[f64]) -> Vec<f64> {
        let pairs = self.points.iter().zip(distances);
        pairs
            .map(|(centre, own)| {
                let square = own + squared_distance(centre, point);
                // ω = 1, as printed.
                libm::exp(-match self.kernel {
                    Kernel::Exponential => square.sqrt(),
                    Kernel::Gaussian => square,
                })
            })
            .collect()
    }
}

/// The paper's value function.
#[derive(Clone, Debug)]
pub struct RadialBasis {
    features: Features,
    axes: usize,
    settings: RadialSettings,
    basis: Basis,
    weights: Vec<f64>,
    learned: u64,
}

impl RadialBasis {
    /// A value function for points of `axes` axes that knows nothing; `seed` places its centres.
    ///
    /// # Errors
    /// [`PredictError::OutOfRange`] for a step outside 0..=1.
    pub fn new(
        features: Features,
        axes: usize,
        settings: RadialSettings,
        seed: u64,
    ) -> Result<RadialBasis, PredictError> {
        let (StepSize::Fixed(step) | StepSize::Normalised(step)) = settings.step;
        check_range("step", step, 0.0, 1.0)?;
        let basis = Basis::new(settings.kernel, features.len(), axes, seed);
        Ok(RadialBasis {
            weights: vec![0.0; basis.len()],
            features,
            axes,
            settings,
            basis,
            learned: 0,
        })
    }

    /// The reward that is expected of `point` in `state`; 0 while nothing was learned.
    ///
    /// # Errors
    /// For a state or a point that is none.
    pub fn value(&self, state: &[f64], point: &[f64]) -> Result<f64, PredictError> {
        let scaled = self.features.scaled(state, self.settings.scaling)?;
        check_point(point, self.axes)?;
        let functions = self.basis.functions(&self.basis.distances(&scaled), point);
        Ok(dot(&functions, &self.weights))
    }
}

impl Predictor for RadialBasis {
    fn learn(&mut self, state: &[f64], point: &[f64], cost: f64) -> Result<(), PredictError> {
        let scaled = self.features.scaled(state, self.settings.scaling)?;
        check_point(point, self.axes)?;
        check_cost(cost)?;
        self.learned += 1;
        let functions = self.basis.functions(&self.basis.distances(&scaled), point);
        let square = dot(&functions, &functions);
        // Far from all centres nothing can be learned, and 1/‖φ‖² is infinite.
        if square < f64::MIN_POSITIVE {
            return Ok(());
        }
        let error = self.settings.reward.of(cost) - dot(&functions, &self.weights);
        // α·‖φ‖²; each weight then gets its share φ_i/‖φ‖² of it.
        let share = match self.settings.step {
            StepSize::Fixed(step) => (step * square).min(1.0),
            StepSize::Normalised(share) => share,
        };
        let pairs = self.weights.iter().zip(&functions);
        let weights: Vec<f64> = pairs
            .map(|(weight, function)| weight + share * error * (function / square))
            .collect();
        // A huge reward far from all centres leaves the numbers: better not learned than infinite.
        if weights.iter().all(|weight| weight.is_finite()) {
            self.weights = weights;
        }
        Ok(())
    }

    fn predict(
        &self,
        state: &[f64],
        candidates: &[Vec<f64>],
    ) -> Result<Option<Vec<f64>>, PredictError> {
        let scaled = self.features.scaled(state, self.settings.scaling)?;
        let distances = self.basis.distances(&scaled);
        let best = least(candidates, self.axes, |point| {
            -dot(&self.basis.functions(&distances, point), &self.weights)
        })?;
        Ok(best.filter(|_| self.learned > 0).cloned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scale;
    use crate::predict::{Feature, Subject};

    fn features() -> Features {
        let feature = |name| Feature::new(name, 0.0, 2.0, Scale::Linear, Subject::Scene);
        Features::new(vec![feature("a"), feature("b"), feature("c")]).unwrap()
    }

    fn model(settings: RadialSettings) -> RadialBasis {
        RadialBasis::new(features(), 2, settings, 3).unwrap()
    }

    /// φ(x) by a plain loop over the joined vectors.
    fn slow(basis: &Basis, scaled: &[f64], point: &[f64]) -> Vec<f64> {
        let x = [scaled, point].concat();
        let mut all = Vec::new();
        for i in 0..basis.states.len() {
            let centre = [&basis.states[i][..], &basis.points[i]].concat();
            let mut square = 0.0;
            for k in 0..x.len() {
                square += (x[k] - centre[k]).powi(2);
            }
            all.push(match basis.kernel {
                Kernel::Exponential => (-square.sqrt()).exp(),
                Kernel::Gaussian => (-square).exp(),
            });
        }
        all
    }

    #[test]
    fn updates_are_those_of_the_plain_formula() {
        for kernel in [Kernel::Exponential, Kernel::Gaussian] {
            for reward in [Reward::Inverse, Reward::Logarithm] {
                let settings = RadialSettings {
                    kernel,
                    reward,
                    step: StepSize::Fixed(0.02),
                    scaling: Scaling::Printed,
                };
                let mut model = model(settings);
                let mut weights = vec![0.0; 100];
                let mut stream = Stream::new(5);
                for _ in 0..50 {
                    let (scaled, point) = (stream.point(3), stream.point(2));
                    let state: Vec<f64> = scaled.iter().map(|x| 2.0 * x).collect();
                    let cost = 0.5 + stream.unit();
                    model.learn(&state, &point, cost).unwrap();
                    let phi = slow(&model.basis, &scaled, &point);
                    let value: f64 = phi.iter().zip(&weights).map(|(p, w)| p * w).sum();
                    let reward = match reward {
                        Reward::Inverse => 1.0 / cost,
                        Reward::Logarithm => -cost.ln(),
                    };
                    for (weight, phi) in weights.iter_mut().zip(&phi) {
                        *weight += 0.02 * (reward - value) * phi;
                    }
                    let value: f64 = phi.iter().zip(&weights).map(|(p, w)| p * w).sum();
                    assert!((model.value(&state, &point).unwrap() - value).abs() < 1e-12);
                }
                for (own, slow) in model.weights.iter().zip(&weights) {
                    assert!((own - slow).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn a_normalised_step_removes_its_share_of_the_error() {
        // Two steps by half towards the reward 4: 2, then 3.
        let settings = RadialSettings::printed().with_step(StepSize::Normalised(0.5));
        let mut model = model(settings);
        for value in [2.0, 3.0, 3.5] {
            model.learn(&[1.0; 3], &[0.5; 2], 0.25).unwrap();
            let own = model.value(&[1.0; 3], &[0.5; 2]).unwrap();
            assert!((own - value).abs() < 1e-12, "{own}");
        }
    }

    #[test]
    fn the_best_candidate_is_that_of_single_values() {
        let mut stream = Stream::new(2);
        for settings in [RadialSettings::printed(), RadialSettings::rescaled()] {
            let mut model = model(settings.with_kernel(Kernel::Gaussian));
            for _ in 0..400 {
                let (state, point) = (stream.point(3), stream.point(2));
                let cost = 0.5 + (point[0] - 0.5 * state[0]).abs();
                model.learn(&state, &point, cost).unwrap();
            }
            let candidates: Vec<Vec<f64>> = (0..100).map(|_| stream.point(2)).collect();
            for _ in 0..10 {
                let state = stream.point(3);
                let best = model.predict(&state, &candidates).unwrap().unwrap();
                let value = model.value(&state, &best).unwrap();
                for candidate in &candidates {
                    assert!(model.value(&state, candidate).unwrap() <= value);
                }
            }
        }
    }

    #[test]
    fn weights_stay_finite_far_from_all_centres() {
        let settings = RadialSettings {
            scaling: Scaling::Raw,
            ..RadialSettings::rescaled()
        };
        let settings = RadialSettings {
            reward: Reward::Inverse,
            ..settings
        };
        let mut model = model(settings);
        for far in [100.0, 150.0, 190.0, 400.0, 1e200] {
            for cost in [1e-300, 1.0, 1e300] {
                model.learn(&[far; 3], &[0.5; 2], cost).unwrap();
                assert!(model.weights.iter().all(|weight| weight.is_finite()));
            }
        }
    }

    #[test]
    fn a_step_that_would_diverge_is_cut() {
        let settings = RadialSettings::printed().with_step(StepSize::Fixed(1.0));
        let mut model = model(settings);
        for _ in 0..10_000 {
            model.learn(&[1.0; 3], &[0.5; 2], 1e-9).unwrap();
        }
        let value = model.value(&[1.0; 3], &[0.5; 2]).unwrap();
        assert!((value - 1e9).abs() < 1.0, "{value}");
        for step in [-0.1, 1.1, f64::NAN] {
            let settings = RadialSettings::printed().with_step(StepSize::Fixed(step));
            assert!(RadialBasis::new(features(), 2, settings, 3).is_err());
        }
    }
}
