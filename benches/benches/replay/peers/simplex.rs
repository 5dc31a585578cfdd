//! The crate argmin: the plain simplex of Nelder & Mead, 1965.
//!
//! A point outside of the cube costs what its projection costs.

use std::cell::Cell;

use argmin::{
    core::{CostFunction, Error, Executor},
    solver::neldermead::NelderMead,
};
use rand_xoshiro::{
    Xoshiro256PlusPlus,
    rand_core::{Rng, SeedableRng},
};

use super::{FAILURE, driven::Objective};

pub(super) const NAME: &str = "argmin";

/// Edges of the first simplex, in edges of the cube.
const EDGE: f64 = 0.25;
/// A simplex that has not ended by then is small.
const ITERATIONS: u64 = 1000;
/// Standard deviation of costs below which it ends: they are measured to a percent.
const FLAT: f64 = 1e-3;

struct Cost<'a> {
    objective: &'a Objective,
    /// Vertices of the first simplex that have no cost yet: argmin panics where one has none.
    first: Cell<usize>,
}

impl CostFunction for Cost<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, point: &Vec<f64>) -> Result<f64, Error> {
        let inside: Vec<f64> = point.iter().map(|x| x.clamp(0.0, 1.0)).collect();
        let first = self.first.get();
        self.first.set(first.saturating_sub(1));
        match self.objective.cost(&inside) {
            Some(cost) => Ok(cost),
            None if first > 0 => Ok(FAILURE),
            None => Err(Error::msg("nobody asks any more")),
        }
    }
}

pub(super) fn run(start: &[f64], seed: u64, objective: &Objective) {
    let mut stream = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut simplex = vec![start.to_vec()];
    for axis in 0..start.len() {
        let mut vertex = start.to_vec();
        let is_up = match vertex[axis] {
            x if x < EDGE => true,
            x if x > 1.0 - EDGE => false,
            _ => stream.next_u64() % 2 == 0,
        };
        vertex[axis] += if is_up { EDGE } else { -EDGE };
        simplex.push(vertex);
    }
    let cost = Cost {
        objective,
        first: Cell::new(simplex.len()),
    };
    let Ok(solver) = NelderMead::new(simplex).with_sd_tolerance(FLAT) else {
        return;
    };
    let executor = Executor::new(cost, solver);
    // Whatever ends it: the best point is known.
    let _ = executor
        .configure(|state| state.max_iters(ITERATIONS))
        .run();
}
