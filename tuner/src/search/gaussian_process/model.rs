//! A Gaussian process over the unit cube: a value and how sure it is, anywhere, from values at some
//! points.
//!
//! Rasmussen & Williams, *Gaussian Processes for Machine Learning*, 2006, chapters 2 and 5: Matérn kernel
//! of order 5/2 with a length per axis, a constant mean, noise that is known up to a share of the
//! variance of the values. Mean and variance of the process follow from the points in closed form for any
//! lengths; the lengths themselves are judged by the likelihood.
//!
//! With r² = Σ ((u_i − v_i)/ℓ_i)² and s = √5·r the kernel is (1 + s + s²/3)·exp(−s).
//!
//! Invariants: a model is a function of its points, values, noises and lengths; its numbers are finite;
//! where nothing is known it predicts the mean with the deviation of the values.

use crate::linear::{dot, factorise, forward, solve, triangle};

/// The least noise, as a share of the variance: the kernel matrix stays regular.
const LEAST_NOISE: f64 = 1e-6;

/// A process that knows some points.
#[derive(Clone, Debug)]
pub(super) struct Model {
    dimensions: usize,
    /// Points divided by the lengths, one after the other.
    points: Vec<f64>,
    inverse_lengths: Vec<f64>,
    /// Lower triangle of the Cholesky factor of the kernel matrix, row by row.
    factor: Vec<f64>,
    /// Kernel matrix⁻¹ · (values − mean).
    weights: Vec<f64>,
    mean: f64,
    /// Variance of the process.
    variance: f64,
    log_likelihood: f64,
}

/// A value at a point of the cube.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Known {
    pub(super) point: Vec<f64>,
    pub(super) value: f64,
    /// Variance of the noise in the value, as a share of the variance of all values; 0 or more.
    pub(super) noise: f64,
}

/// What a model says of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Prediction {
    pub(super) mean: f64,
    /// Standard deviation without noise, 0 or more.
    pub(super) deviation: f64,
}

impl Model {
    /// The process through some points, which there are, with a length for each axis. `None` if the
    /// kernel matrix is singular in the numbers of this machine.
    pub(super) fn new(known: &[Known], lengths: &[f64]) -> Option<Self> {
        let (count, dimensions) = (known.len(), lengths.len());
        let inverse_lengths: Vec<f64> = lengths.iter().map(|length| 1.0 / length).collect();
        let points: Vec<f64> = known
            .iter()
            .flat_map(|known| scaled(&known.point, &inverse_lengths))
            .collect();
        let mut factor = Vec::with_capacity(count * (count + 1) / 2);
        for (row, known) in known.iter().enumerate() {
            let own = &points[row * dimensions..(row + 1) * dimensions];
            for other in points.chunks_exact(dimensions).take(row) {
                factor.push(kernel(own, other));
            }
            factor.push(1.0 + known.noise.max(LEAST_NOISE));
        }
        factorise(&mut factor, count)?;
        let ones = solve(&factor, &vec![1.0; count]);
        let values: Vec<f64> = known.iter().map(|known| known.value).collect();
        let mean = dot(&ones, &values) / ones.iter().sum::<f64>();
        let centred: Vec<f64> = values.iter().map(|value| value - mean).collect();
        let weights = solve(&factor, &centred);
        let variance = (dot(&weights, &centred) / count as f64).max(f64::MIN_POSITIVE);
        let log_determinant: f64 = (0..count)
            .map(|row| factor[triangle(row) + row].ln())
            .sum::<f64>()
            * 2.0;
        let log_likelihood = -0.5 * (count as f64 * variance.ln() + log_determinant);
        let is_usable = mean.is_finite() && variance.is_finite() && log_likelihood.is_finite();
        is_usable.then_some(Self {
            dimensions,
            points,
            inverse_lengths,
            factor,
            weights,
            mean,
            variance,
            log_likelihood,
        })
    }

    /// How well the lengths suit the values: the larger the better.
    pub(super) fn log_likelihood(&self) -> f64 {
        self.log_likelihood
    }

    /// What it says of a point.
    pub(super) fn predict(&self, point: &[f64]) -> Prediction {
        let kernels = self.kernels(point);
        let mean = self.mean + dot(&kernels, &self.weights);
        let reduced = forward(&self.factor, &kernels);
        let share = (1.0 - dot(&reduced, &reduced)).max(0.0);
        Prediction {
            mean,
            deviation: (self.variance * share).sqrt(),
        }
    }

    fn kernels(&self, point: &[f64]) -> Vec<f64> {
        let own: Vec<f64> = scaled(point, &self.inverse_lengths).collect();
        self.points
            .chunks_exact(self.dimensions)
            .map(|other| kernel(&own, other))
            .collect()
    }
}

fn scaled<'a>(point: &'a [f64], inverse_lengths: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    point
        .iter()
        .zip(inverse_lengths)
        .map(|(x, scale)| x * scale)
}

fn kernel(a: &[f64], b: &[f64]) -> f64 {
    let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    let s = (5.0 * square).sqrt();
    (1.0 + s + s * s / 3.0) * (-s).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Stream;

    fn known(count: usize, seed: u64) -> Vec<Known> {
        let mut stream = Stream::new(seed);
        (0..count)
            .map(|_| {
                let point = stream.point(3);
                let value = 5.0 + (4.0 * point[0]).sin() + point[1] * point[1] - 0.3 * point[2];
                Known {
                    point,
                    value,
                    noise: 0.01 * stream.unit(),
                }
            })
            .collect()
    }

    /// Solves a dense system by Gaussian elimination with pivots: nothing in common with the factor.
    fn eliminated(mut matrix: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
        let count = b.len();
        for column in 0..count {
            let pivot = (column..count)
                .max_by(|&i, &j| matrix[i][column].abs().total_cmp(&matrix[j][column].abs()))
                .unwrap();
            matrix.swap(column, pivot);
            b.swap(column, pivot);
            for row in column + 1..count {
                let factor = matrix[row][column] / matrix[column][column];
                let (above, below) = matrix.split_at_mut(row);
                for (own, other) in below[0].iter_mut().zip(&above[column]) {
                    *own -= factor * other;
                }
                b[row] -= factor * b[column];
            }
        }
        let mut x = vec![0.0; count];
        for row in (0..count).rev() {
            let rest: f64 = (row + 1..count).map(|k| matrix[row][k] * x[k]).sum();
            x[row] = (b[row] - rest) / matrix[row][row];
        }
        x
    }

    fn matern(a: &[f64], b: &[f64], lengths: &[f64]) -> f64 {
        let r: f64 = (a.iter().zip(b).zip(lengths))
            .map(|((a, b), l)| ((a - b) / l).powi(2))
            .sum::<f64>()
            .sqrt();
        let s = 5.0_f64.sqrt() * r;
        (1.0 + s + 5.0 / 3.0 * r * r) * (-s).exp()
    }

    #[test]
    fn predictions_are_those_of_the_dense_formulas() {
        let lengths = [0.4, 0.7, 1.3];
        let known = known(30, 3);
        let model = Model::new(&known, &lengths).unwrap();
        let matrix: Vec<Vec<f64>> = (0..30)
            .map(|i| {
                (0..30)
                    .map(|j| {
                        let noise = if i == j { known[i].noise } else { 0.0 };
                        matern(&known[i].point, &known[j].point, &lengths) + noise
                    })
                    .collect()
            })
            .collect();
        let ones = eliminated(matrix.clone(), vec![1.0; 30]);
        let values: Vec<f64> = known.iter().map(|k| k.value).collect();
        let mean = dot(&ones, &values) / ones.iter().sum::<f64>();
        let centred: Vec<f64> = values.iter().map(|v| v - mean).collect();
        let weights = eliminated(matrix.clone(), centred.clone());
        let variance = dot(&weights, &centred) / 30.0;
        let mut stream = Stream::new(9);
        for _ in 0..50 {
            let point = stream.point(3);
            let k: Vec<f64> = known
                .iter()
                .map(|k| matern(&k.point, &point, &lengths))
                .collect();
            let share = 1.0 - dot(&k, &eliminated(matrix.clone(), k.clone()));
            let got = model.predict(&point);
            assert!((got.mean - mean - dot(&k, &weights)).abs() < 1e-9);
            assert!((got.deviation - (variance * share).sqrt()).abs() < 1e-8);
        }
    }

    #[test]
    fn what_is_known_is_predicted_and_what_is_far_away_is_not() {
        let mut known = known(20, 5);
        for known in &mut known {
            known.noise = 0.0;
        }
        let model = Model::new(&known, &[0.3; 3]).unwrap();
        for known in &known {
            let got = model.predict(&known.point);
            assert!((got.mean - known.value).abs() < 1e-3, "{got:?}");
            assert!(got.deviation < 0.01);
        }
        let far = model.predict(&[50.0; 3]);
        assert!((far.mean - model.mean).abs() < 1e-12);
        assert!((far.deviation - model.variance.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn equal_points_and_equal_values_are_no_fault() {
        let same = Known {
            point: vec![0.5; 3],
            value: 2.0,
            noise: 0.0,
        };
        let model = Model::new(&vec![same; 12], &[0.5; 3]).unwrap();
        let got = model.predict(&[0.5; 3]);
        assert!((got.mean - 2.0).abs() < 1e-9 && got.deviation.is_finite());
    }

    #[test]
    fn lengths_that_suit_are_more_likely() {
        // Nothing depends on the second axis.
        let mut stream = Stream::new(4);
        let known: Vec<Known> = (0..25)
            .map(|_| {
                let point = stream.point(2);
                Known {
                    value: (5.0 * point[0]).sin(),
                    point,
                    noise: 1e-4,
                }
            })
            .collect();
        let likelihood = |lengths: [f64; 2]| Model::new(&known, &lengths).unwrap().log_likelihood();
        assert!(likelihood([0.5, 4.0]) > likelihood([0.5, 0.5]) + 1.0);
        assert!(likelihood([0.5, 4.0]) > likelihood([4.0, 0.5]) + 1.0);
    }
}
