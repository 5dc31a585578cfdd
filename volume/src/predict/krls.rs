//! Kernel recursive least squares: a smooth function of a few features, learned one pair at a time.
//!
//! Engel, Mannor, Meir, *The Kernel Recursive Least-Squares Algorithm*, IEEE Transactions on Signal
//! Processing 52(8), 2004; in the form that dlib gives it, which Bruder, Frey, Ertl, 2016, use: kernel
//! exp(−γ|u − v|²) + 0.01, of which the 0.01 is a bias, and a limited dictionary whose oldest vector
//! goes first. A feature vector is novel if it is not nearly a combination, in the space of the
//! kernel, of those in the dictionary (approximate linear dependence): then it joins them; if not, it
//! only moves the weights.
//!
//! With h the kernel between a vector x and the dictionary, κ = k(x, x) = 1.01, Q the inverse of the
//! kernel matrix, a the weights and P the matrix of the least squares:
//!
//! ```text
//! prediction  aᵀh             b = Q h             δ = κ − hᵀb, the part of x that is new
//! novel       Q ← [[Q + b bᵀ/δ, −b/δ], [−bᵀ/δ, 1/δ]]   P ← diag(P, 1)   e = (y − aᵀh)/δ   a ← (a − b e, e)
//! known       q = P b/(λ + bᵀP b)   P ← (P − q bᵀP)/λ   a ← a + Q q (y − aᵀh)
//! ```
//!
//! Beyond dlib: a forgetting factor λ, since machines change their speed (1 is dlib); a novelty and a
//! deviation beside each prediction, as a Gaussian process has them; repair by Cholesky factors. The
//! vector that goes takes its share of the prediction to the others without the kernel matrix, which
//! is not kept: with c the first column of Q, a ← a − a₀·c/Q₀₀ is dlib's Q'·(K a).
//!
//! Invariants: the dictionary has at most `limit` vectors and so the memory is bounded; all numbers
//! are finite; a model is a function of the pairs it was given, in order, alone.
//!
//! Not good for more than some ten features, or thousands of vectors: a step is O(m²).

mod params;

pub use params::{KrlsError, KrlsParams};

use super::symmetric::{Symmetric, dot};

/// What the kernel has everywhere: a bias.
const KERNEL_BIAS: f64 = 0.01;

/// The kernel between a vector and itself.
const KAPPA: f64 = 1.0 + KERNEL_BIAS;

/// Largest magnitude of a target: products of a few of them are finite.
const MAX_TARGET: f64 = 1e100;

/// Mean of the diagonal of P above which nothing is forgotten. Directions that are never seen gain
/// 1/λ in each step, and would one day drown the others.
const MAX_MEAN_P: f64 = 10.0;

/// Novel vectors between two looks at the inverse.
const CHECK_EVERY: u32 = 64;

/// Largest error of a column of Q·K that is let pass.
const MAX_INVERSE_ERROR: f64 = 1e-7;

/// Smallest part of a vector that is not a combination of the others: below, Q is made anew.
const MIN_RESIDUAL: f64 = 1e-10;

/// What a model did with a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Learned {
    /// The vector was nearly a combination of those in the dictionary: the weights moved.
    Known,
    /// The vector joined the dictionary.
    Novel,
    /// The vector joined the dictionary, and the oldest one left.
    Replaced,
}

/// A prediction and what is known about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KrlsPrediction {
    /// The value; 0 of an empty model.
    pub mean: f64,
    /// δ/κ: 0 if the vector is known, towards 1 if it is unlike anything in the dictionary.
    pub novelty: f64,
    /// Standard deviation of the value for want of knowledge alone: sqrt(δ) times the deviation of
    /// the targets in the dictionary. The noise of the targets comes on top.
    pub deviation: f64,
}

/// A model of functions of `D` features.
#[derive(Clone, Debug)]
pub struct Krls<const D: usize> {
    params: KrlsParams,
    /// The dictionary, oldest first, and the targets it came with.
    vectors: Vec<[f64; D]>,
    targets: Vec<f64>,
    weights: Vec<f64>,
    inverse_kernel: Symmetric,
    p: Symmetric,
    novel_since_check: u32,
    repairs: u64,
    scratch: Scratch,
}

/// Vectors of a step, kept so that a step allocates nothing.
#[derive(Clone, Debug, Default)]
struct Scratch {
    h: Vec<f64>,
    b: Vec<f64>,
    pb: Vec<f64>,
    step: Vec<f64>,
}

/// Equal models predict and learn alike; what a step left in its scratch space does not count.
impl<const D: usize> PartialEq for Krls<D> {
    fn eq(&self, other: &Self) -> bool {
        self.params == other.params
            && self.vectors == other.vectors
            && self.targets == other.targets
            && self.weights == other.weights
            && self.inverse_kernel == other.inverse_kernel
            && self.p == other.p
            && self.novel_since_check == other.novel_since_check
            && self.repairs == other.repairs
    }
}

impl<const D: usize> Krls<D> {
    /// A model that knows nothing.
    ///
    /// # Errors
    /// [`KrlsError::Parameter`].
    pub fn new(params: KrlsParams) -> Result<Self, KrlsError> {
        params.check()?;
        Ok(Self {
            params,
            vectors: Vec::new(),
            targets: Vec::new(),
            weights: Vec::new(),
            inverse_kernel: Symmetric::default(),
            p: Symmetric::default(),
            novel_since_check: 0,
            repairs: 0,
            scratch: Scratch::default(),
        })
    }

    /// Forgets everything: equal to a new model.
    pub fn clear(&mut self) {
        self.vectors.clear();
        self.targets.clear();
        self.weights.clear();
        self.inverse_kernel.clear();
        self.p.clear();
        self.novel_since_check = 0;
        self.repairs = 0;
    }

    /// How it learns.
    #[must_use]
    pub fn params(&self) -> &KrlsParams {
        &self.params
    }

    /// The dictionary, oldest vector first.
    #[must_use]
    pub fn dictionary(&self) -> &[[f64; D]] {
        &self.vectors
    }

    /// How often the inverse of the kernel matrix was made anew.
    #[must_use]
    pub fn repairs(&self) -> u64 {
        self.repairs
    }

    /// The predicted value; 0 of an empty model. O(m).
    ///
    /// # Errors
    /// [`KrlsError::Feature`].
    pub fn predict(&self, features: &[f64; D]) -> Result<f64, KrlsError> {
        check(features)?;
        let kernels = self
            .vectors
            .iter()
            .map(|vector| kernel(self.params.gamma, vector, features));
        Ok(kernels.zip(&self.weights).map(|(k, w)| k * w).sum())
    }

    /// The predicted value, and what is known about it. O(m²).
    ///
    /// # Errors
    /// [`KrlsError::Feature`].
    pub fn predict_with_deviation(&self, features: &[f64; D]) -> Result<KrlsPrediction, KrlsError> {
        check(features)?;
        let mut scratch = Scratch::default();
        let residual = self.residual(features, &mut scratch);
        let count = self.targets.len().max(1) as f64;
        let mean = self.targets.iter().sum::<f64>() / count;
        let squares = self.targets.iter().map(|t| (t - mean) * (t - mean));
        let variance = squares.sum::<f64>() / count;
        let residual = residual.clamp(0.0, KAPPA);
        Ok(KrlsPrediction {
            mean: dot(&scratch.h, &self.weights),
            novelty: residual / KAPPA,
            deviation: (residual * variance).sqrt(),
        })
    }

    /// Learns that the function has the value `target` at `features`. O(m²).
    ///
    /// # Errors
    /// [`KrlsError::Feature`] and [`KrlsError::Target`]; the model is as before.
    pub fn learn(&mut self, features: &[f64; D], target: f64) -> Result<Learned, KrlsError> {
        check(features)?;
        // A NaN lies in no range.
        if !(-MAX_TARGET..=MAX_TARGET).contains(&target) {
            return Err(KrlsError::Target { value: target });
        }
        let mut scratch = std::mem::take(&mut self.scratch);
        let mut residual = self.residual(features, &mut scratch);
        let learned = if self.vectors.is_empty() || residual > self.params.tolerance {
            let full = self.vectors.len() >= self.params.limit;
            if full {
                self.remove_oldest(&mut scratch);
                residual = self.residual(features, &mut scratch);
            }
            self.insert(features, target, residual, &mut scratch);
            if full {
                Learned::Replaced
            } else {
                Learned::Novel
            }
        } else {
            self.adjust(target, &mut scratch);
            Learned::Known
        };
        self.scratch = scratch;
        Ok(learned)
    }

    /// δ of a vector; leaves h and b in the scratch space.
    fn residual(&self, features: &[f64; D], scratch: &mut Scratch) -> f64 {
        let gamma = self.params.gamma;
        scratch.h.clear();
        let kernels = self.vectors.iter().map(|v| kernel(gamma, v, features));
        scratch.h.extend(kernels);
        self.inverse_kernel.multiply(&scratch.h, &mut scratch.b);
        KAPPA - dot(&scratch.h, &scratch.b)
    }

    fn insert(
        &mut self,
        features: &[f64; D],
        target: f64,
        residual: f64,
        Scratch { h, b, .. }: &mut Scratch,
    ) {
        // Rounding may leave less than there can be.
        let residual = residual.max(MIN_RESIDUAL);
        let weight = (target - dot(h, &self.weights)) / residual;
        for (own, b) in self.weights.iter_mut().zip(b.iter()) {
            *own -= b * weight;
        }
        self.weights.push(weight);
        self.inverse_kernel.add_outer(1.0 / residual, b, 1.0);
        let row = b.iter().map(|b| -b / residual);
        self.inverse_kernel
            .push(row.chain(std::iter::once(1.0 / residual)));
        let zeros = std::iter::repeat_n(0.0, self.p.order());
        self.p.push(zeros.chain(std::iter::once(1.0)));
        self.vectors.push(*features);
        self.targets.push(target);
        self.novel_since_check += 1;
        if self.novel_since_check >= CHECK_EVERY || !self.inverse_kernel.last_row_is_finite() {
            self.novel_since_check = 0;
            if self.is_ill() {
                self.repair();
            }
        }
    }

    fn adjust(&mut self, target: f64, Scratch { h, b, pb, step }: &mut Scratch) {
        let error = target - dot(h, &self.weights);
        self.p.multiply(b, pb);
        let order = self.p.order();
        let forgetting = if self.p.trace() > MAX_MEAN_P * order as f64 {
            1.0
        } else {
            self.params.forgetting
        };
        let excitation = dot(b, pb);
        if !(excitation >= 0.0 && excitation.is_finite()) {
            // P lost its meaning to rounding: every direction is as after one sample.
            self.p.clear();
            for row in 0..order {
                let zeros = std::iter::repeat_n(0.0, row);
                self.p.push(zeros.chain(std::iter::once(1.0)));
            }
            return;
        }
        let denominator = forgetting + excitation;
        self.inverse_kernel.multiply(pb, step);
        let factor = error / denominator;
        for (weight, step) in self.weights.iter_mut().zip(step.iter()) {
            *weight += step * factor;
        }
        self.p.add_outer(-1.0 / denominator, pb, 1.0 / forgetting);
    }

    fn remove_oldest(&mut self, Scratch { b, .. }: &mut Scratch) {
        let (first, weight) = (self.inverse_kernel.diagonal(0), self.weights[0]);
        let column = b;
        self.p.remove_first(column);
        self.inverse_kernel.remove_first(column);
        self.inverse_kernel.add_outer(-1.0 / first, column, 1.0);
        self.weights.remove(0);
        for (own, c) in self.weights.iter_mut().zip(column.iter()) {
            *own -= weight * c / first;
        }
        self.vectors.remove(0);
        self.targets.remove(0);
    }

    /// Whether Q is far from the inverse of the kernel matrix, as far as one column tells, or a vector
    /// in the dictionary has become a combination of others.
    fn is_ill(&self) -> bool {
        let order = self.vectors.len();
        // 1/Qᵢᵢ is the residual of vector i without itself.
        let most = 1.0 / MIN_RESIDUAL;
        if !(0..order).all(|i| (0.0..most).contains(&self.inverse_kernel.diagonal(i))) {
            return true;
        }
        let Some(newest) = self.vectors.last() else {
            return false;
        };
        let column: Vec<f64> = self
            .vectors
            .iter()
            .map(|vector| kernel(self.params.gamma, vector, newest))
            .collect();
        let mut product = Vec::new();
        self.inverse_kernel.multiply(&column, &mut product);
        product[order - 1] -= 1.0;
        // A NaN is no small number.
        !product.iter().all(|error| error.abs() < MAX_INVERSE_ERROR)
    }

    /// Makes Q anew from the dictionary. The weights stay; where they are not finite, they become
    /// those that the targets of the dictionary ask for.
    fn repair(&mut self) {
        self.repairs += 1;
        let mut matrix = Symmetric::default();
        for (row, a) in self.vectors.iter().enumerate() {
            let before = &self.vectors[..row];
            let kernels = before.iter().map(|b| kernel(self.params.gamma, a, b));
            matrix.push(kernels.chain(std::iter::once(KAPPA)));
        }
        let Some(inverse) = matrix.inverse() else {
            // Not even the factors can be had: what can be kept is the newest pair.
            let newest = self
                .vectors
                .last()
                .copied()
                .zip(self.targets.last().copied());
            let repairs = self.repairs;
            self.clear();
            self.repairs = repairs;
            if let Some((features, target)) = newest {
                self.insert(&features, target, KAPPA, &mut Scratch::default());
            }
            return;
        };
        self.inverse_kernel = inverse;
        if !self.weights.iter().all(|weight| weight.is_finite()) {
            self.inverse_kernel
                .multiply(&self.targets, &mut self.weights);
        }
    }
}

/// exp(−γ|a − b|²) + 0.01.
fn kernel<const D: usize>(gamma: f64, a: &[f64; D], b: &[f64; D]) -> f64 {
    let mut square = 0.0;
    for i in 0..D {
        square += (a[i] - b[i]) * (a[i] - b[i]);
    }
    (-gamma * square).exp() + KERNEL_BIAS
}

fn check<const D: usize>(features: &[f64; D]) -> Result<(), KrlsError> {
    match features.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(KrlsError::Feature {
            index,
            value: features[index],
        }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
