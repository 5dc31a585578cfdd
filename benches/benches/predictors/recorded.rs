//! A recorded problem and the paper's search on it: what a predictor learns from and is compared with.

use std::error::Error;

use raywright_benches::recordings::{DataSet, Metric, Problem, SpaceKind, State};
use raywright_tuner::{Outcome, Tuner, replay::Pool, search_by_name};

/// Frames of a search.
pub(crate) const FRAMES: usize = 80;

/// The rows of a problem as points of a space.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    pub(crate) points: Vec<Vec<f64>>,
}

impl Table {
    pub(crate) fn new(set: &DataSet, kind: SpaceKind, problem: &Problem) -> Table {
        let space = set.space(kind);
        let configs = problem.rows.iter().map(|row| row.config(kind));
        let points = configs.map(|config| space.encode(config)).collect();
        Table { points }
    }

    /// The row nearest to a point: what is predicted need not have been measured here.
    pub(crate) fn nearest(&self, point: &[f64]) -> usize {
        let distance = |row: &usize| -> f64 {
            let pairs = self.points[*row].iter().zip(point);
            pairs.map(|(a, b)| (a - b) * (a - b)).sum()
        };
        let rows = 0..self.points.len();
        rows.min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap_or(0)
    }
}

/// A problem and one search on it.
#[derive(Clone, Debug)]
pub(crate) struct Case<'a> {
    pub(crate) problem: &'a Problem,
    pub(crate) state: &'a State,
    /// Rows that the search measured, and their costs.
    pub(crate) samples: Vec<(usize, f64)>,
    /// Sum of the costs of its frames.
    pub(crate) paid: f64,
    /// The least cost that it saw: the paper's roofline.
    pub(crate) roofline: f64,
}

impl<'a> Case<'a> {
    /// Latin hypercube and simplex in the printed space.
    pub(crate) fn new(
        set: &DataSet,
        (problem, state): (&'a Problem, &'a State),
        metric: Metric,
        seed: u64,
    ) -> Result<Case<'a>, Box<dyn Error>> {
        let kind = SpaceKind::Printed;
        let rows = problem.rows.iter();
        let rows = rows.map(|row| (row.config(kind).clone(), row.outcome(metric)));
        let mut pool = Pool::new(set.space(kind), rows);
        let search = search_by_name("nelder-mead").ok_or("no such search")?;
        let mut tuner = Tuner::new(set.space(kind).clone(), search, seed);
        let (mut paid, mut roofline) = (0.0, f64::INFINITY);
        for _ in 0..FRAMES {
            let trial = tuner.ask();
            // A table of fewer rows is known by then, and its best is what is shown from there on.
            let outcome = pool
                .answer(&mut tuner, &trial)?
                .map_or(Outcome::Done { cost: roofline }, |answer| answer.0);
            match outcome {
                Outcome::Done { cost } => {
                    roofline = roofline.min(cost);
                    paid += cost;
                }
                // A build that is refused costs a frame with what there is, the weak default at first.
                _ => paid += roofline.min(1.0),
            }
        }
        let mut samples = Vec::new();
        for record in tuner.records() {
            let mut rows = problem.rows.iter();
            let row = rows.position(|row| *row.config(kind) == record.config);
            let row = row.ok_or("a record that is no row")?;
            samples.extend(record.costs.iter().map(|&cost| (row, cost)));
        }
        Ok(Case {
            problem,
            state,
            samples,
            paid,
            roofline,
        })
    }

    /// The cost of a row; where its build was refused that of the weak default, which then stands in.
    pub(crate) fn cost(&self, row: usize, metric: Metric) -> f64 {
        let costs = self.problem.rows[row].costs;
        costs.map_or(1.0, |costs| costs[metric as usize])
    }
}
