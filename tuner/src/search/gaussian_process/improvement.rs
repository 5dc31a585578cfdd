//! Expected improvement: by how much a point is expected to be better than the best one.
//!
//! Jones, Schonlau, Welch, *Efficient Global Optimization of Expensive Black-Box Functions*, 1998. With
//! z = (best − mean)/deviation it is deviation · (z·Φ(z) + φ(z)). Far below the best it is so small that
//! only its logarithm tells points apart (Ament et al., *Unexpected Improvements to Expected Improvement*,
//! 2023).
//!
//! Invariant: the logarithm is a number, −∞ only for a deviation of 0 without improvement; it rises with
//! the deviation and falls with the mean.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use super::model::Prediction;

/// z below which the asymptotic series is used: there the two terms cancel all their digits.
const FAR: f64 = -10.0;

/// The logarithm of the improvement over `best` that is expected of a point, where less is better.
pub(super) fn log_expected_improvement(prediction: Prediction, best: f64) -> f64 {
    let Prediction { mean, deviation } = prediction;
    if deviation == 0.0 {
        return (best - mean).max(0.0).ln();
    }
    let z = (best - mean) / deviation;
    deviation.ln() + log_h(z)
}

/// ln(z·Φ(z) + φ(z)).
fn log_h(z: f64) -> f64 {
    let log_density = -0.5 * z * z - 0.5 * (2.0 * PI).ln();
    if z > FAR {
        let below = 0.5 * libm::erfc(-z * FRAC_1_SQRT_2);
        (z * below + log_density.exp()).max(f64::MIN_POSITIVE).ln()
    } else {
        // φ(z)/z² · (1 − 3/z² + 15/z⁴ − …).
        let square = z * z;
        log_density - square.ln() + (-3.0 / square + 15.0 / (square * square)).ln_1p()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ max(best − y, 0) N(y; mean, deviation) dy by the rule of Simpson.
    fn integrated(mean: f64, deviation: f64, best: f64) -> f64 {
        let (low, steps) = (mean - 12.0 * deviation, 40_000);
        let high = best.min(mean + 12.0 * deviation);
        let width = (high - low) / f64::from(steps);
        let at = |i: i32| {
            let y = low + f64::from(i) * width;
            let z = (y - mean) / deviation;
            (best - y) * (-0.5 * z * z).exp() / ((2.0 * PI).sqrt() * deviation)
        };
        let inner: f64 = (1..steps)
            .map(|i| at(i) * if i % 2 == 1 { 4.0 } else { 2.0 })
            .sum();
        (at(0) + inner + at(steps)) * width / 3.0
    }

    #[test]
    fn it_is_the_integral() {
        for (mean, deviation, best) in [
            (0.0, 1.0, 0.0),
            (3.0, 0.5, 2.0),
            (-1.0, 2.0, 1.5),
            (10.0, 1.0, 6.0),
        ] {
            let got = log_expected_improvement(Prediction { mean, deviation }, best);
            let expected = integrated(mean, deviation, best);
            assert!(
                (got.exp() / expected - 1.0).abs() < 1e-6,
                "{got} {expected}"
            );
        }
    }

    #[test]
    fn far_away_its_logarithm_goes_on_without_a_step() {
        let mut last = log_h(5.0);
        for i in 1..4000 {
            let own = log_h(5.0 - f64::from(i) * 0.01);
            assert!(own < last && own.is_finite(), "{i}");
            last = own;
        }
        assert!((log_h(FAR - 1e-6) - log_h(FAR + 1e-6)).abs() < 1e-3);
        let prediction = Prediction {
            mean: 1.0,
            deviation: 0.0,
        };
        assert_eq!(log_expected_improvement(prediction, 3.0), 2.0_f64.ln());
        assert_eq!(log_expected_improvement(prediction, 0.5), f64::NEG_INFINITY);
    }
}
