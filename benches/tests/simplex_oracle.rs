//! The simplex of the crate argmin as an oracle of ours.
//!
//! From the same first simplex both make the same moves, until ours draws where argmin shrinks, projects onto
//! the cube or begins anew. And both get to the same optimum, ours with about as many costs although it draws.
//!
//! `cargo test -p raywright-benches --features peers --test simplex_oracle`

use std::{cell::RefCell, rc::Rc};

use argmin::{
    core::{CostFunction, Error, Executor},
    solver::neldermead::NelderMead,
};
use raywright_tuner::{Estimate, search_by_name};

const SEEDS: u64 = 20;
const AXES: usize = 2;
/// Points of our search, repeated measurements included.
const PROPOSALS: usize = 1000;
const ITERATIONS: u64 = 200;
/// What counts as the optimum: nearer than the extent at which our simplex counts as collapsed.
const REACHED: f64 = 1e-4;
/// Size of a first simplex that does not soon step out of the cube.
const SMALL: f64 = 0.2;
/// Least number of points behind the first simplex that have to be compared over all seeds.
const COMPARED: usize = 20 * SEEDS as usize;

type Cost = fn(&[f64]) -> f64;

/// Rosenbrock's valley over −2..2 on both axes, divided by 100; 0 at (1, 1).
fn rosenbrock(point: &[f64]) -> f64 {
    let (x, y) = (4.0 * point[0] - 2.0, 4.0 * point[1] - 2.0);
    ((1.0 - x).powi(2) + 100.0 * (y - x * x).powi(2)) / 100.0
}

/// A slanted bowl; 0 at (0.4, 0.6).
fn quadratic(point: &[f64]) -> f64 {
    let (x, y) = (point[0] - 0.4, point[1] - 0.6);
    x * x + 4.0 * y * y + x * y
}

/// A point and the name of the move that led to it.
type Visit = (Vec<f64>, &'static str);

/// Where our simplex begins.
#[derive(Clone, Copy, PartialEq, Eq)]
enum First {
    /// At its hypercube.
    Wide,
    /// At the hypercube drawn together: its own points fail, and these are known from elsewhere.
    Small,
}

/// Points of our simplex, without measuring again what has just been measured or is best.
fn ours(cost: Cost, seed: u64, first: First) -> Vec<Visit> {
    let mut search = search_by_name("nelder-mead").expect("it is one of ours");
    search.begin(&[0.0; AXES], seed);
    let mut visits: Vec<Visit> = Vec::new();
    for ticket in 0..PROPOSALS as u64 {
        let proposal = search.propose(ticket);
        let mut estimate = Estimate {
            mean: cost(&proposal.point),
            samples: proposal.samples,
            noise: 0.0,
        };
        let mut point = proposal.point.clone();
        if first == First::Small && visits.len() <= AXES {
            point.iter_mut().for_each(|x| *x = 0.5 + SMALL * (*x - 0.5));
            estimate.mean = cost(&point);
            search.observe(None, &point, estimate);
            estimate.mean = f64::INFINITY;
        }
        search.observe(Some(ticket), &proposal.point, estimate);
        let last = visits.last().map(|(point, _)| point);
        if proposal.step != "resample" && last != Some(&point) {
            visits.push((point, proposal.step));
        }
    }
    visits
}

struct Recorded {
    cost: Cost,
    points: Rc<RefCell<Vec<Vec<f64>>>>,
}

impl CostFunction for Recorded {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, point: &Vec<f64>) -> Result<f64, Error> {
        self.points.borrow_mut().push(point.clone());
        Ok((self.cost)(point))
    }
}

/// Points of argmin's simplex.
fn theirs(cost: Cost, first: &[Visit]) -> Vec<Vec<f64>> {
    let points = Rc::new(RefCell::new(Vec::new()));
    let recorded = Recorded {
        cost,
        points: Rc::clone(&points),
    };
    let solver = NelderMead::new(first.iter().map(|visit| visit.0.clone()).collect());
    Executor::new(recorded, solver)
        .configure(|state| state.max_iters(ITERATIONS))
        .run()
        .expect("costs are numbers");
    points.take()
}

fn is_inside(point: &[f64]) -> bool {
    point.iter().all(|x| (0.0..=1.0).contains(x))
}

/// Points after which the optimum is reached.
fn reached<'a>(cost: Cost, mut points: impl Iterator<Item = &'a Vec<f64>>) -> Option<usize> {
    Some(points.position(|point| cost(point) < REACHED)? + 1)
}

fn median(mut counts: Vec<usize>) -> usize {
    counts.sort_unstable();
    counts[counts.len() / 2]
}

#[test]
fn both_make_the_same_moves() {
    for (name, cost) in [("rosenbrock", rosenbrock as Cost), ("quadratic", quadratic)] {
        let mut compared = 0;
        let mut steps: Vec<&str> = Vec::new();
        for seed in 0..SEEDS {
            let own = ours(cost, seed, First::Small);
            let other = theirs(cost, &own[..=AXES]);
            let pairs = own.iter().zip(&other).skip(AXES + 1);
            for (at, ((point, step), other)) in pairs.enumerate() {
                let is_ours_alone = ["draw-global", "draw-local", "latin-hypercube"];
                if is_ours_alone.contains(step) || !is_inside(other) {
                    break;
                }
                let apart = point.iter().zip(other).map(|(a, b)| (a - b).abs());
                let apart = apart.fold(0.0, f64::max);
                assert!(
                    apart < 1e-9,
                    "{name}, seed {seed}, move {at}: {step} to {point:?}, not {other:?}"
                );
                compared += 1;
                steps.push(step);
            }
        }
        assert!(compared >= COMPARED, "{name}: {compared} points compared");
        for step in ["reflect", "expand", "contract-outside", "contract-inside"] {
            assert!(steps.contains(&step), "{name}: no {step} was compared");
        }
    }
}

#[test]
fn both_reach_the_same_optimum_with_about_as_many_costs() {
    for (name, cost) in [("rosenbrock", rosenbrock as Cost), ("quadratic", quadratic)] {
        let (mut own_counts, mut other_counts) = (Vec::new(), Vec::new());
        for seed in 0..SEEDS {
            let own = ours(cost, seed, First::Wide);
            let other = theirs(cost, &own[..=AXES]);
            // A hypercube of points on one line spans no simplex, and argmin stays on it.
            if let Some(count) = reached(cost, other.iter()) {
                other_counts.push(count);
            }
            let count = reached(cost, own.iter().map(|visit| &visit.0));
            own_counts.push(count.unwrap_or_else(|| panic!("{name}, seed {seed}: not reached")));
        }
        println!("{name}: ours {own_counts:?}, argmin {other_counts:?}");
        assert!(other_counts.len() * 10 >= SEEDS as usize * 9, "{name}");
        let (own, other) = (median(own_counts), median(other_counts));
        assert!(
            own * 2 <= other * 3 && other * 2 <= own * 3,
            "{name}: ours {own}, argmin {other}"
        );
    }
}
