//! Our simplex beside the plain one of argmin: from the same first simplex both make the same moves, until one
//! of them has to do what the other does not (a draw instead of a shrink, a projection onto the cube); and both
//! reach the optimum.

use std::cell::RefCell;

use argmin::{
    core::{CostFunction, Error, Executor},
    solver::neldermead::NelderMead,
};
use raywright_tuner::{Estimate, LatinHypercubeNelderMead, Search};

type Function = fn(&[f64]) -> f64;

/// Ill-conditioned, 1 to 16, with its minimum of 0 away from the middle.
fn quadratic(point: &[f64]) -> f64 {
    let centres = [0.4, 0.6, 0.45, 0.55];
    let weights = [1.0, 16.0, 4.0, 8.0];
    let axes = point.iter().zip(centres).zip(weights);
    axes.map(|((x, centre), weight)| weight * (x - centre).powi(2))
        .sum()
}

/// Rosenbrock, "An automatic method for finding the greatest or least value of a function", 1960, with its
/// minimum of 0 at (0.7, 0.7).
fn rosenbrock(point: &[f64]) -> f64 {
    let [x, y] = [point[0], point[1]].map(|x| 5.0 * x - 2.5);
    100.0 * (y - x * x).powi(2) + (1.0 - x).powi(2)
}

/// Points that our search asks for with their steps, of which it sees the exact costs.
fn ours(function: Function, dimensions: usize, seed: u64, count: usize) -> Vec<(String, Vec<f64>)> {
    let mut search = LatinHypercubeNelderMead::new();
    search.begin(&vec![0.0; dimensions], seed);
    let mut points: Vec<(String, Vec<f64>)> = Vec::new();
    for ticket in 0..count as u64 {
        let proposal = search.propose(ticket);
        let estimate = Estimate {
            mean: function(&proposal.point),
            samples: proposal.samples,
            noise: 0.0,
        };
        search.observe(Some(ticket), &proposal.point, estimate);
        // Its confirmations tell nothing new of an exact cost.
        let is_again = points.last().is_some_and(|last| last.1 == proposal.point);
        if proposal.step != "resample" && !is_again {
            points.push((proposal.step.to_owned(), proposal.point));
        }
    }
    points
}

struct Watched {
    function: Function,
    points: RefCell<Vec<Vec<f64>>>,
}

impl CostFunction for &Watched {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, point: &Vec<f64>) -> Result<f64, Error> {
        self.points.borrow_mut().push(point.clone());
        Ok((self.function)(point))
    }
}

/// Points that argmin asks for, and the least cost.
fn theirs(function: Function, simplex: &[Vec<f64>]) -> (Vec<Vec<f64>>, f64) {
    let watched = Watched {
        function,
        points: RefCell::default(),
    };
    let executor = Executor::new(&watched, NelderMead::new(simplex.to_vec()));
    let executor = executor.configure(|state| state.max_iters(200));
    let best = executor.run().unwrap().state.best_cost;
    (watched.points.into_inner(), best)
}

#[test]
fn moves_are_the_same_until_one_must_draw_or_project() {
    let mut moves = std::collections::BTreeMap::<String, usize>::new();
    for (function, dimensions) in [(quadratic as Function, 2), (quadratic, 4), (rosenbrock, 2)] {
        for seed in 0..40 {
            let ours = ours(function, dimensions, seed, 60);
            let first = dimensions + 1;
            let simplex: Vec<Vec<f64>> = ours[..first].iter().map(|own| own.1.clone()).collect();
            let theirs = theirs(function, &simplex).0;
            for (own, other) in ours.iter().zip(&theirs).skip(first) {
                // What argmin would have to project it does not, and a draw is no move of its.
                let is_projected = other.iter().any(|x| !(0.0..=1.0).contains(x));
                if is_projected || own.0.starts_with("draw") || own.0 == "latin-hypercube" {
                    break;
                }
                let pairs = own.1.iter().zip(other);
                let apart = pairs.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
                assert!(apart < 1e-9, "seed {seed}: {own:?}, argmin {other:?}");
                *moves.entry(own.0.clone()).or_default() += 1;
            }
        }
    }
    // Every kind of move was seen, many times.
    for step in ["reflect", "expand", "contract-outside", "contract-inside"] {
        assert!(moves.get(step).is_some_and(|&n| n >= 50), "{moves:?}");
    }
}

#[test]
fn both_reach_the_optimum() {
    for (function, dimensions) in [(quadratic as Function, 2), (quadratic, 4), (rosenbrock, 2)] {
        let (mut own, mut other) = (Vec::new(), Vec::new());
        for seed in 0..20 {
            let points = ours(function, dimensions, seed, 400);
            let first: Vec<Vec<f64>> = points[..=dimensions].iter().map(|p| p.1.clone()).collect();
            let costs = points.iter().map(|point| function(&point.1));
            own.push(costs.fold(f64::INFINITY, f64::min));
            other.push(theirs(function, &first).1);
        }
        for costs in [&mut own, &mut other] {
            costs.sort_by(f64::total_cmp);
            assert!(costs[10] < 1e-3, "median: {costs:?}");
        }
    }
}
