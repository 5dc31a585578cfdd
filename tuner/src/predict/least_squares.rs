//! A regularised least-squares model of the logarithm of costs over state and point.
//!
//! Hoerl & Kennard, "Ridge Regression: Biased Estimation for Nonorthogonal Problems", Technometrics 1970:
//! θ minimises Σ (ln cost − θ·φ)² + λ·‖θ‖². Golub & Van Loan, *Matrix Computations*, 4th edition 2013, 6.5.4:
//! a sample is one row more in a factorisation, so that learning takes time in the square of the number of
//! terms, whatever is known already. Costs differ by factors, hence the logarithm; told relative to the
//! default of their state, the weights 0 mean "as good as the default".
//!
//! Invariants: the weights are those of the normal equations over all samples, in any order up to rounding;
//! time and memory do not grow with the samples. Not good for: optima that lie elsewhere than between what
//! was sampled; a quadratic continues as it likes.

use super::radial::Basis;
use super::{Features, Kernel, PredictError, Predictor, Scaling};
use super::{check_cost, check_point, check_range, least};
use crate::linear::{add_outer_product, dot, solve, triangle};

/// How states are scaled: products of raw features may exceed all numbers.
const SCALING: Scaling = Scaling::Rescaled;

/// The functions whose weights are learned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Terms {
    /// 1, every feature, and of the coordinates all squares, products of two, and products with features.
    Quadratic,
    /// The 100 radial basis functions of [`RadialBasis`](super::RadialBasis).
    Radial {
        /// How they fall with distance.
        kernel: Kernel,
        /// Places their centres.
        seed: u64,
    },
}

/// Regularised least squares of the logarithm of costs.
#[derive(Clone, Debug)]
pub struct LeastSquares {
    features: Features,
    axes: usize,
    /// `None`: quadratic.
    basis: Option<Basis>,
    /// Cholesky factor of Σ φ·φᵀ + λ, a lower triangle row by row.
    factor: Vec<f64>,
    /// Σ φ·ln cost.
    moments: Vec<f64>,
    learned: u64,
}

impl LeastSquares {
    /// A model for points of `axes` axes that knows nothing. `ridge` is λ, a number of samples' worth of
    /// evidence for the weight 0 of each term.
    ///
    /// # Errors
    /// [`PredictError::OutOfRange`] for a ridge outside 1e-9..=1e9.
    pub fn new(
        features: Features,
        axes: usize,
        terms: Terms,
        ridge: f64,
    ) -> Result<LeastSquares, PredictError> {
        check_range("ridge", ridge, 1e-9, 1e9)?;
        let basis = match terms {
            Terms::Quadratic => None,
            Terms::Radial { kernel, seed } => Some(Basis::new(kernel, features.len(), axes, seed)),
        };
        let count = match &basis {
            Some(basis) => basis.len(),
            None => 1 + features.len() + axes + triangle(axes) + axes * features.len(),
        };
        let mut factor = vec![0.0; triangle(count)];
        for row in 0..count {
            factor[triangle(row) + row] = ridge.sqrt();
        }
        Ok(LeastSquares {
            features,
            axes,
            basis,
            factor,
            moments: vec![0.0; count],
            learned: 0,
        })
    }

    /// The logarithm of the cost that is expected of `point` in `state`; 0 while nothing was learned.
    ///
    /// # Errors
    /// For a state or a point that is none.
    pub fn log_cost(&self, state: &[f64], point: &[f64]) -> Result<f64, PredictError> {
        let prepared = self.prepared(self.features.scaled(state, SCALING)?);
        check_point(point, self.axes)?;
        Ok(dot(&self.terms(&prepared, point), &self.weights()))
    }

    /// What of a state all points share: itself, or its part of the distances to the centres.
    fn prepared(&self, scaled: Vec<f64>) -> Vec<f64> {
        match &self.basis {
            Some(basis) => basis.distances(&scaled),
            None => scaled,
        }
    }

    fn terms(&self, prepared: &[f64], point: &[f64]) -> Vec<f64> {
        if let Some(basis) = &self.basis {
            return basis.functions(prepared, point);
        }
        let mut terms = Vec::with_capacity(self.moments.len());
        terms.push(1.0);
        terms.extend(prepared);
        for (axis, x) in point.iter().enumerate() {
            terms.push(*x);
            terms.extend(point[..=axis].iter().map(|other| x * other));
            terms.extend(prepared.iter().map(|feature| x * feature));
        }
        terms
    }

    fn weights(&self) -> Vec<f64> {
        solve(&self.factor, &self.moments)
    }
}

impl Predictor for LeastSquares {
    fn learn(&mut self, state: &[f64], point: &[f64], cost: f64) -> Result<(), PredictError> {
        let prepared = self.prepared(self.features.scaled(state, SCALING)?);
        check_point(point, self.axes)?;
        check_cost(cost)?;
        let terms = self.terms(&prepared, point);
        add_outer_product(&mut self.factor, &terms);
        let value = libm::log(cost);
        for (moment, term) in self.moments.iter_mut().zip(&terms) {
            *moment += value * term;
        }
        self.learned += 1;
        Ok(())
    }

    fn predict(
        &self,
        state: &[f64],
        candidates: &[Vec<f64>],
    ) -> Result<Option<Vec<f64>>, PredictError> {
        let prepared = self.prepared(self.features.scaled(state, SCALING)?);
        let weights = self.weights();
        let best = least(candidates, self.axes, |point| {
            dot(&self.terms(&prepared, point), &weights)
        })?;
        Ok(best.filter(|_| self.learned > 0).cloned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scale;
    use crate::linear::factorise;
    use crate::predict::{Feature, Subject};
    use crate::rng::Stream;

    fn model(terms: Terms, ridge: f64) -> LeastSquares {
        let feature = |name| Feature::new(name, 0.0, 1.0, Scale::Linear, Subject::Scene);
        let features = Features::new(vec![feature("a"), feature("b")]).unwrap();
        LeastSquares::new(features, 2, terms, ridge).unwrap()
    }

    const RADIAL: Terms = Terms::Radial {
        kernel: Kernel::Gaussian,
        seed: 1,
    };

    #[test]
    fn weights_are_those_of_the_normal_equations() {
        for terms in [Terms::Quadratic, RADIAL] {
            let mut model = model(terms, 0.1);
            let mut stream = Stream::new(4);
            let count = model.moments.len();
            let mut matrix = vec![0.0; triangle(count)];
            let mut moments = vec![0.0; count];
            for row in 0..count {
                matrix[triangle(row) + row] = 0.1;
            }
            for _ in 0..300 {
                let (state, point) = (stream.point(2), stream.point(2));
                let cost = 0.2 + stream.unit();
                model.learn(&state, &point, cost).unwrap();
                let phi = model.terms(&model.prepared(state.clone()), &point);
                for row in 0..count {
                    moments[row] += phi[row] * cost.ln();
                    for column in 0..=row {
                        matrix[triangle(row) + column] += phi[row] * phi[column];
                    }
                }
            }
            factorise(&mut matrix, count).unwrap();
            let dense = solve(&matrix, &moments);
            for (own, dense) in model.weights().iter().zip(&dense) {
                assert!((own - dense).abs() < 1e-9, "{own} {dense}");
            }
        }
    }

    #[test]
    fn terms_are_counted_and_worked_by_hand() {
        let model = model(Terms::Quadratic, 1.0);
        let terms = model.terms(&[2.0, 3.0], &[0.5, 0.25]);
        let by_hand = [
            1.0, 2.0, 3.0, 0.5, 0.25, 1.0, 1.5, 0.25, 0.125, 0.0625, 0.5, 0.75,
        ];
        assert_eq!(terms, by_hand);
        assert_eq!(model.moments.len(), terms.len());
    }

    #[test]
    fn a_quadratic_whose_optimum_moves_with_the_state_is_found() {
        let mut model = model(Terms::Quadratic, 1e-6);
        let mut stream = Stream::new(7);
        // (x − a)² without a², which is no term.
        let log_cost = |state: &[f64], point: &[f64]| {
            point[0] * (point[0] - 2.0 * state[0]) + 0.3 * (point[1] - 0.5).powi(2) + state[1]
        };
        for _ in 0..200 {
            let (state, point) = (stream.point(2), stream.point(2));
            let cost = log_cost(&state, &point).exp();
            model.learn(&state, &point, cost).unwrap();
        }
        let grid = |i: usize| vec![(i % 11) as f64 / 10.0, (i / 11) as f64 / 10.0];
        let candidates: Vec<Vec<f64>> = (0..121).map(grid).collect();
        for target in [0.2, 0.7, 1.0] {
            let best = model.predict(&[target, 0.4], &candidates).unwrap();
            assert_eq!(best, Some(vec![target, 0.5]));
        }
    }

    #[test]
    fn one_sample_is_told_back_in_part() {
        // With one sample θ·φ is ln cost · ‖φ‖²/(‖φ‖² + λ).
        let mut model = model(Terms::Quadratic, 2.0);
        model.learn(&[0.0, 0.0], &[0.0, 0.0], 3.0).unwrap();
        let told = model.log_cost(&[0.0, 0.0], &[0.0, 0.0]).unwrap();
        assert!((told - 3f64.ln() / 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_ridge_that_is_none_is_refused() {
        for ridge in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let features = Features::new(vec![]).unwrap();
            assert!(LeastSquares::new(features, 2, RADIAL, ridge).is_err());
        }
    }
}
