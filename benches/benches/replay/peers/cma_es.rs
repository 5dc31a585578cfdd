//! The crate cmaes: adaptation of a covariance matrix (Hansen & Ostermeier, "Completely Derandomized
//! Self-Adaptation in Evolution Strategies", 2001).

use cmaes::{CMAESOptions, DVector};

use super::driven::Objective;

pub(super) const NAME: &str = "cmaes";

/// Standard deviation at first, in edges of the cube.
const STEP: f64 = 0.25;

pub(super) fn run(start: &[f64], seed: u64, objective: &Objective) {
    // Outside of the cube a point costs more the further out it lies, or the mean would walk away.
    let cost = |point: &DVector<f64>| {
        let inside: Vec<f64> = point.iter().map(|x| x.clamp(0.0, 1.0)).collect();
        let pairs = point.iter().zip(&inside);
        let outside: f64 = pairs.map(|(x, inside)| (x - inside).powi(2)).sum();
        let cost = objective.cost(&inside);
        cost.map_or(f64::NAN, |cost| cost * (1.0 + outside))
    };
    // It ends at a cost that is no number.
    if let Ok(mut state) = CMAESOptions::new(start.to_vec(), STEP)
        .seed(seed)
        .build(cost)
    {
        state.run();
    }
}
