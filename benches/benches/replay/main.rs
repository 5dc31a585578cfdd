//! `cargo bench -p raywright-benches --bench replay [--features peers] [-- FOLDER]`: searches on recorded problems, judged in
//! seconds and without one frame.
//!
//! Every search asks, and the nearest recorded configuration that is left answers; so no cost is that of
//! a model. Regret is the best cost so far over the second best of the table, less 1; excess is the mean
//! cost of the frames so far over it, less 1: what a user would pay without probes. Geometric means over
//! problems and seeds; beside the regret the interval in which 95 % of means over problems drawn anew lie.

#[cfg(feature = "peers")]
mod peer;
mod problems;
mod spaces;

use std::{env, error::Error, path::PathBuf, time::Instant};

use raywright_tuner::{Outcome, Search, Tuner, replay::Pool, search_by_name};

use problems::{Metric, Problem, problems};
use spaces::SpaceKind;

const SEEDS: u64 = 10;
const FRAMES: usize = 40;
/// Frames after which regret is told.
const TOLD: [usize; 3] = [10, 20, 40];

/// A search with everything that belongs to it.
struct Method {
    name: &'static str,
    space: SpaceKind,
    search: &'static str,
    /// Names of rows that are tried first.
    starts: &'static [&'static str],
}

const METHODS: &[Method] = &[
    Method {
        name: "random, printed",
        space: SpaceKind::Printed,
        search: "random",
        starts: &[],
    },
    Method {
        name: "paper: hypercube + simplex, printed",
        space: SpaceKind::Printed,
        search: "nelder-mead",
        starts: &[],
    },
    Method {
        name: "hypercube + simplex, canonical",
        space: SpaceKind::Canonical,
        search: "nelder-mead",
        starts: &[],
    },
    Method {
        name: "3 starts + simplex, canonical",
        space: SpaceKind::Canonical,
        search: "nelder-mead",
        starts: PORTFOLIO,
    },
    Method {
        name: "Gaussian process, canonical",
        space: SpaceKind::Canonical,
        search: "gaussian-process",
        starts: &[],
    },
    Method {
        name: "3 starts + Gaussian process, canonical",
        space: SpaceKind::Canonical,
        search: "gaussian-process",
        starts: PORTFOLIO,
    },
    #[cfg(feature = "peers")]
    Method {
        name: "crate tpe, canonical",
        space: SpaceKind::Canonical,
        search: peer::NAME,
        starts: &[],
    },
    #[cfg(feature = "peers")]
    Method {
        name: "3 starts + crate tpe, canonical",
        space: SpaceKind::Canonical,
        search: peer::NAME,
        starts: PORTFOLIO,
    },
];

/// A search of the tuner or of a peer.
fn search(name: &str) -> Option<Box<dyn Search>> {
    #[cfg(feature = "peers")]
    if name == peer::NAME {
        return Some(Box::new(peer::Tpe::default()));
    }
    search_by_name(name)
}

/// Known-good configurations: strong default, the same with spatial splits, Morton order.
const PORTFOLIO: &[&str] = &["strong8", "strong8hq", "morton8"];

/// What a method did on a problem, mean over seeds of logarithms: after each of [`TOLD`].
#[derive(Clone, Copy, Default)]
struct Score {
    regret: [f64; 3],
    excess: [f64; 3],
}

fn main() -> Result<(), Box<dyn Error>> {
    // cargo bench hands its own options on.
    let folder = env::args().skip(1).find(|arg| !arg.starts_with('-'));
    let folder = folder.map_or_else(
        || {
            let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
            root.join("../../shared/data/tuning")
        },
        PathBuf::from,
    );
    if !folder.join("builder_table.csv").is_file() {
        println!("{} has no recorded problems", folder.display());
        return Ok(());
    }
    let problems = problems(&folder)?;
    let mut goals = Goals::default();
    println!("{} problems, {SEEDS} seeds", problems.len());
    for metric in Metric::ALL {
        println!(
            "\n{}: regret after {TOLD:?} frames, %; excess, %",
            metric.name()
        );
        for method in METHODS {
            let start = Instant::now();
            let scores = problems
                .iter()
                .map(|problem| score(method, problem, metric))
                .collect::<Result<Vec<_>, _>>()?;
            let regret = [0, 1, 2].map(|at| mean(&scores, |score| score.regret[at]));
            let excess = [0, 1, 2].map(|at| mean(&scores, |score| score.excess[at]));
            let [low, high] = interval(&scores, |score| score.regret[1]);
            println!(
                "{:40} {:6.1} {:6.1} [{low:5.1}, {high:5.1}] {:6.1}   {:6.1} {:6.1} {:6.1}   {:.1} s",
                method.name,
                regret[0],
                regret[1],
                regret[2],
                excess[0],
                excess[1],
                excess[2],
                start.elapsed().as_secs_f64(),
            );
            if method.search == "gaussian-process" && !method.starts.is_empty() {
                let name = |frames| format!("regret after {frames} frames, {}, %", metric.name());
                goals.add(&name(10), regret[0], 1.0);
                goals.add(&name(20), regret[1], 0.5);
            }
        }
        fixed(&problems, metric, &mut goals);
    }
    goals.print();
    Ok(())
}

/// What fixed configurations give: no search at all.
fn fixed(problems: &[Problem], metric: Metric, goals: &mut Goals) {
    let ratio = |of: &dyn Fn(&Problem) -> Option<f64>| {
        let logs: Vec<f64> = problems.iter().filter_map(|p| Some(of(p)?.ln())).collect();
        (logs.iter().sum::<f64>() / logs.len() as f64).exp()
    };
    let weak = ratio(&|p| Some(p.named("strong8", metric)? / p.named("weak2", metric)?));
    let best = ratio(&|p| {
        let costs = PORTFOLIO.iter().filter_map(|name| p.named(name, metric));
        Some(costs.fold(f64::INFINITY, f64::min) / p.best(metric))
    });
    println!("strong default ÷ weak default {weak:.3}; best of the portfolio ÷ best {best:.3}");
    let (first, portfolio) = match metric {
        Metric::Render => (0.49, 1.02),
        Metric::Total => (0.56, 1.06),
    };
    goals.add(
        &format!("first frame ÷ weak default, {}", metric.name()),
        weak,
        first,
    );
    goals.add(
        &format!("portfolio ÷ best, {}", metric.name()),
        best,
        portfolio,
    );
}

fn score(method: &Method, problem: &Problem, metric: Metric) -> Result<Score, Box<dyn Error>> {
    let space = method.space.space()?;
    let rows = problem
        .rows
        .iter()
        .map(|(row, costs)| {
            let outcome = match costs {
                Some(costs) => Outcome::Done {
                    cost: costs[metric as usize],
                },
                None => Outcome::Failed {
                    reason: "the depth limit was reached".into(),
                },
            };
            Ok((method.space.config(&space, row)?, outcome))
        })
        .collect::<Result<Vec<_>, Box<dyn Error>>>()?;
    let best = problem.best(metric);
    let weak = problem.named("weak2", metric);
    let worst = weak.ok_or_else(|| format!("{}: no weak default", problem.name))?;
    let mut sum = Score::default();
    for seed in 0..SEEDS {
        let mut pool = Pool::new(&space, rows.iter().cloned());
        let search = search(method.search).ok_or("no such search")?;
        let mut tuner = Tuner::new(space.clone(), search, seed);
        for name in method.starts {
            if let Some((row, _)) = problem.rows.iter().find(|(row, _)| row.name == *name) {
                tuner = tuner.with_start(method.space.config(&space, row)?);
            }
        }
        let (mut least, mut paid) = (f64::INFINITY, 0.0);
        for frame in 1..=FRAMES {
            let trial = tuner.ask();
            let Some((outcome, _)) = pool.answer(&mut tuner, &trial)? else {
                return Err("the pool is empty".into());
            };
            match outcome {
                Outcome::Done { cost } => {
                    least = least.min(cost);
                    paid += cost;
                }
                // A build that is refused costs a frame with what there is.
                _ => paid += least.min(worst),
            }
            if let Some(at) = TOLD.iter().position(|&told| told == frame) {
                sum.regret[at] += (least / best).ln() / SEEDS as f64;
                sum.excess[at] += (paid / frame as f64 / best).ln() / SEEDS as f64;
            }
        }
    }
    Ok(sum)
}

/// The geometric mean over problems, less 1, in percent.
fn mean(scores: &[Score], of: impl Fn(&Score) -> f64) -> f64 {
    let sum: f64 = scores.iter().map(of).sum();
    100.0 * ((sum / scores.len() as f64).exp() - 1.0)
}

/// 95 % of such means over as many problems, drawn again and again from them (Efron, 1979).
fn interval(scores: &[Score], of: impl Fn(&Score) -> f64) -> [f64; 2] {
    const DRAWS: usize = 2000;
    let mut state = 1_u64;
    let mut means: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let drawn: Vec<Score> = scores
                .iter()
                .map(|_| {
                    state = state
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1);
                    scores[(state >> 33) as usize % scores.len()]
                })
                .collect();
            mean(&drawn, &of)
        })
        .collect();
    means.sort_by(f64::total_cmp);
    [means[DRAWS / 40], means[DRAWS - DRAWS / 40]]
}

/// Goals, met or missed.
#[derive(Default)]
struct Goals {
    all: usize,
    missed: Vec<String>,
}

impl Goals {
    fn add(&mut self, what: &str, value: f64, most: f64) {
        self.all += 1;
        if value.is_nan() || value > most {
            self.missed
                .push(format!("missed: {what}: {value:.3}, not {most}"));
        }
    }

    fn print(&self) {
        println!();
        for missed in &self.missed {
            println!("{missed}");
        }
        println!(
            "goals: {} of {} met",
            self.all - self.missed.len(),
            self.all
        );
    }
}
