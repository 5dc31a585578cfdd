//! What a search does on recorded problems, as figures: regret and excess.

use std::error::Error;

use raywright_benches::recordings::{DataSet, Metric, Problem, WEAK};
use raywright_tuner::{Outcome, Tuner, replay::Pool};

use crate::methods::{Method, Searches};

/// Frames after which figures are told.
pub(crate) const TOLD: [usize; 4] = [10, 20, 40, 80];
/// Frames of a search.
const FRAMES: usize = TOLD[TOLD.len() - 1];

/// What a method did on a problem, mean over seeds of logarithms: after each of [`TOLD`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Score {
    pub(crate) regret: [f64; TOLD.len()],
    pub(crate) excess: [f64; TOLD.len()],
}

pub(crate) fn score(
    searches: &Searches,
    method: &Method,
    set: &DataSet,
    problem: &Problem,
    metric: Metric,
) -> Result<Score, Box<dyn Error>> {
    let space = set.space(method.space);
    let rows = problem.rows.iter();
    let rows = rows.map(|row| (row.config(method.space).clone(), row.outcome(metric)));
    let rows: Vec<_> = rows.collect();
    let best = problem.best(metric);
    let weak = problem.named(WEAK, metric);
    let worst = weak.ok_or_else(|| format!("{}: no weak default", problem.name))?;
    let mut sum = Score::default();
    for seed in 0..method.seeds {
        let mut pool = Pool::new(space, rows.iter().cloned());
        let search = searches.search(method, space, FRAMES)?;
        let mut tuner = Tuner::new(space.clone(), search, seed);
        for name in method.starts {
            if let Some(row) = problem.row(name) {
                tuner = tuner.with_start(row.config(method.space).clone());
            }
        }
        let (mut least, mut paid) = (f64::INFINITY, 0.0);
        for frame in 1..=FRAMES {
            let trial = tuner.ask();
            // A table of fewer rows is known by then, and its best is what is shown from there on.
            let outcome = pool
                .answer(&mut tuner, &trial)?
                .map_or(Outcome::Done { cost: least }, |answer| answer.0);
            match outcome {
                Outcome::Done { cost } => {
                    least = least.min(cost);
                    paid += cost;
                }
                // A build that is refused costs a frame with what there is.
                _ => paid += least.min(worst),
            }
            if let Some(at) = TOLD.iter().position(|&told| told == frame) {
                let seeds = method.seeds as f64;
                sum.regret[at] += (least / best).ln() / seeds;
                sum.excess[at] += (paid / frame as f64 / best).ln() / seeds;
            }
        }
        if let Some(failure) = searches.failure() {
            return Err(failure.into());
        }
    }
    Ok(sum)
}

/// The geometric mean over problems, less 1, in percent, of their logarithms.
pub(crate) fn mean(logs: &[f64]) -> f64 {
    100.0 * ((logs.iter().sum::<f64>() / logs.len() as f64).exp() - 1.0)
}

/// 95 % of such means over as many problems, drawn again and again from them (Efron, 1979).
pub(crate) fn interval(logs: &[f64]) -> [f64; 2] {
    const DRAWS: usize = 2000;
    let mut state = 1_u64;
    let mut draw = |_: &f64| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        logs[(state >> 33) as usize % logs.len()]
    };
    let mut means: Vec<f64> = (0..DRAWS)
        .map(|_| mean(&logs.iter().map(&mut draw).collect::<Vec<f64>>()))
        .collect();
    means.sort_by(f64::total_cmp);
    [means[DRAWS / 40], means[DRAWS - DRAWS / 40]]
}
