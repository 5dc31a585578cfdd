//! What a search does on recorded problems, as figures: regret and excess.

use std::error::Error;

use raywright_benches::recordings::{DataSet, Metric, Problem, WEAK};
use raywright_tuner::{Config, Outcome, Tuner, replay::Pool};

use crate::methods::{Method, Searches, Starts};

/// Frames after which figures are told.
pub(crate) const TOLD: [usize; 4] = [10, 20, 40, 80];
/// Frames of a search.
const FRAMES: usize = TOLD[TOLD.len() - 1];

/// Share of a frame that a probe gets.
const PROBE: f64 = 1.0 / 8.0;

/// A gain that is worth another [`Method::patience`] of frames.
const LEAST_GAIN: f64 = 0.005;

/// What a method did on a problem, mean over seeds of logarithms: after each of [`TOLD`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Score {
    pub(crate) regret: [f64; TOLD.len()],
    pub(crate) excess: [f64; TOLD.len()],
    /// The excess if a configuration has but a part of a frame until it is known to be the best so far.
    pub(crate) probed: [f64; TOLD.len()],
}

/// The configurations that a method tries first in a problem.
fn starts(
    method: &Method,
    set: &DataSet,
    problem: &Problem,
    metric: Metric,
) -> Result<Vec<Config>, Box<dyn Error>> {
    Ok(match method.starts {
        Starts::Nothing => Vec::new(),
        #[cfg(feature = "peers")]
        Starts::Strong => {
            let strong = problem.row("strong8");
            strong
                .map(|row| row.config(method.space).clone())
                .into_iter()
                .collect()
        }
        Starts::OfOtherScenes(size) => set.cover(problem.scene(), metric, size, method.space)?,
    })
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
    let starts = starts(method, set, problem, metric)?;
    let best = problem.best(metric);
    let weak = problem.row(WEAK);
    let weak = weak.ok_or_else(|| format!("{}: no weak default", problem.name))?;
    let worst = problem.named(WEAK, metric).unwrap_or(f64::INFINITY);
    let mut sum = Score::default();
    for seed in 0..method.seeds {
        let mut pool = Pool::new(space, rows.iter().cloned());
        let search = searches.search(method, space, FRAMES)?;
        let mut tuner = Tuner::new(space.clone(), search, seed);
        for start in &starts {
            tuner = tuner.with_start(start.clone());
        }
        let (mut least, mut paid, mut paid_with_probes) = (f64::INFINITY, 0.0, 0.0);
        // What is shown while others are probed.
        let mut shown = weak;
        let (mut in_vain, mut is_over) = (0, false);
        for frame in 1..=FRAMES {
            if is_over {
                paid += least;
                paid_with_probes += least;
            } else {
                let trial = tuner.ask();
                // A table of fewer rows is known by then, and its best is what is shown from there on.
                let outcome = pool
                    .answer(&mut tuner, &trial)?
                    .map_or(Outcome::Done { cost: least }, |answer| answer.0);
                let told = tuner.records().last().map(|record| &record.config);
                let row = problem
                    .rows
                    .iter()
                    .find(|row| Some(row.config(method.space)) == told);
                in_vain += 1;
                match (outcome, row) {
                    (Outcome::Done { cost }, Some(row)) => {
                        if cost < least * (1.0 - LEAST_GAIN) {
                            in_vain = 0;
                        }
                        // The first frame is all there is to show.
                        paid_with_probes += match least.is_finite() {
                            true => row.probed(PROBE, shown, metric).unwrap_or(cost),
                            false => cost,
                        };
                        if cost < least {
                            (least, shown) = (cost, row);
                        }
                        paid += cost;
                    }
                    // A build that is refused costs a frame with what there is.
                    _ => {
                        paid += least.min(worst);
                        paid_with_probes += least.min(worst);
                    }
                }
                is_over = method.patience.is_some_and(|patience| in_vain >= patience);
            }
            if let Some(at) = TOLD.iter().position(|&told| told == frame) {
                let seeds = method.seeds as f64;
                let mean = |paid: f64| (paid / frame as f64 / best).ln() / seeds;
                sum.regret[at] += (least / best).ln() / seeds;
                sum.excess[at] += mean(paid);
                sum.probed[at] += mean(paid_with_probes);
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
