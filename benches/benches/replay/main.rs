//! `cargo bench -p raywright-benches --bench replay [--features peers] [-- FOLDER]`: searches on recorded problems, judged in
//! seconds and without one frame.
//!
//! Every search asks, and the nearest recorded configuration that is left answers; so no cost is that of
//! a model. Regret is the best cost so far over the second best of the table, less 1; excess is the mean
//! cost of the frames so far over it, less 1: what a user would pay without probes. Geometric means over
//! problems and seeds; beside the regret the interval in which 95 % of means over problems drawn anew lie.
//!
//! Peers search the same canonical space on the same problems and seeds, with our starts and without. Those
//! that are slow have fewer seeds, as the table says; those of Python are left out where it has none of them.

mod methods;
#[cfg(feature = "peers")]
mod peers;
mod score;

use std::{error::Error, time::Instant};

use raywright_benches::{
    goals::Goals,
    recordings::{DataSet, Metric, PORTFOLIO, Problem, WEAK, arguments, data_sets},
};

use methods::{JUDGED, Method, Searches};
use score::{Score, TOLD, interval, mean, score};

/// Where [`TOLD`] says 20 and 80 frames.
const JUDGED_AT: [usize; 2] = [1, 3];

/// Most percents of regret after 10 and 20 frames.
const MOST_REGRET: [f64; 2] = [1.0, 0.5];

/// Figures of a method over all problems, in percent.
#[derive(Clone, Copy, Debug)]
struct Figures {
    method: Method,
    regret: [f64; TOLD.len()],
    excess: [f64; TOLD.len()],
}

fn main() -> Result<(), Box<dyn Error>> {
    let (folder, _) = arguments();
    let sets = data_sets(folder.as_deref())?;
    if sets.is_empty() {
        return Ok(());
    }
    let searches = Searches::open();
    let mut goals = Goals::default();
    for set in &sets {
        println!("\n{}: {} problems", set.name, set.problems.len());
        for metric in Metric::ALL {
            let title = format!("{}, {}", set.name, metric.name());
            println!("\n{title}: regret after {TOLD:?} frames, %; excess, %; seeds");
            let figures = table(&searches, set, metric)?;
            let judged = figures.iter().find(|own| own.method.name == JUDGED);
            if let Some(judged) = judged {
                for (at, most) in MOST_REGRET.into_iter().enumerate() {
                    let (regret, frames) = (judged.regret[at], TOLD[at]);
                    let what = format!("regret after {frames} frames, {title}: {regret:.3} %");
                    goals.check(format!("{what}, not {most}"), regret <= most);
                }
                beside_peers(judged, &figures, &title, &mut goals);
            }
            fixed(&set.problems, metric, &title, &mut goals);
        }
    }
    goals.print();
    Ok(())
}

/// Prints a row for each search.
fn table(
    searches: &Searches,
    set: &DataSet,
    metric: Metric,
) -> Result<Vec<Figures>, Box<dyn Error>> {
    let mut figures = Vec::new();
    for method in &searches.methods {
        let start = Instant::now();
        let scores = set
            .problems
            .iter()
            .map(|problem| score(searches, method, set, problem, metric))
            .collect::<Result<Vec<Score>, _>>();
        let scores = match scores {
            Err(why) if method.is_peer() => {
                println!("{:40} left out: {why}", method.name);
                continue;
            }
            scores => scores?,
        };
        let told: [usize; TOLD.len()] = std::array::from_fn(|at| at);
        let own = Figures {
            method: *method,
            regret: told.map(|at| mean(&scores, |score| score.regret[at])),
            excess: told.map(|at| mean(&scores, |score| score.excess[at])),
        };
        let [low, high] = interval(&scores, |score| score.regret[1]);
        let numbers = |values: &[f64]| -> String {
            let numbers = values.iter().map(|value| format!(" {value:6.1}"));
            numbers.collect()
        };
        println!(
            "{:40}{} [{low:5.1}, {high:5.1}]{}  {}  {:2} {:7.1} s",
            method.name,
            numbers(&own.regret[..2]),
            numbers(&own.regret[2..]),
            numbers(&own.excess),
            method.seeds,
            start.elapsed().as_secs_f64(),
        );
        figures.push(own);
    }
    Ok(figures)
}

/// Whether a search of ours is ahead of every peer, in each figure by itself.
fn beside_peers(judged: &Figures, figures: &[Figures], title: &str, goals: &mut Goals) {
    type Of = fn(&Figures) -> &[f64; TOLD.len()];
    let kinds: [(&str, Of); 2] = [("regret", |f| &f.regret), ("excess", |f| &f.excess)];
    for (kind, of) in kinds {
        for at in JUDGED_AT {
            let peers = figures.iter().filter(|other| other.method.is_peer());
            let least = peers.min_by(|a, b| of(a)[at].total_cmp(&of(b)[at]));
            let Some(peer) = least else { return };
            let (own, other) = (of(judged)[at], of(peer)[at]);
            let what = format!("{kind} after {} frames, {title}", TOLD[at]);
            let figures = format!("ours {own:.2} %, {} {other:.2} %", peer.method.name);
            let is_ahead = own < other;
            let word = if is_ahead { "ahead" } else { "not ahead" };
            println!("{word} of every peer in {what}: {figures}");
            goals.check(
                format!("ahead of every peer in {what}: {figures}"),
                is_ahead,
            );
        }
    }
}

/// What fixed configurations give: no search at all.
fn fixed(problems: &[Problem], metric: Metric, title: &str, goals: &mut Goals) {
    let ratio = |of: &dyn Fn(&Problem) -> Option<f64>| {
        let logs: Vec<f64> = problems.iter().filter_map(|p| Some(of(p)?.ln())).collect();
        (logs.iter().sum::<f64>() / logs.len() as f64).exp()
    };
    let weak = ratio(&|p| Some(p.named("strong8", metric)? / p.named(WEAK, metric)?));
    let best = ratio(&|p| {
        let costs = PORTFOLIO.iter().filter_map(|name| p.named(name, metric));
        Some(costs.fold(f64::INFINITY, f64::min) / p.best(metric))
    });
    println!("strong default ÷ weak default {weak:.3}; best of the portfolio ÷ best {best:.3}");
    let most = match metric {
        Metric::Render => [0.49, 1.02],
        Metric::Total => [0.56, 1.06],
    };
    let whats = ["first frame ÷ weak default", "portfolio ÷ best"];
    for ((what, value), most) in whats.iter().zip([weak, best]).zip(most) {
        goals.check(
            format!("{what}, {title}: {value:.3}, not {most}"),
            value <= most,
        );
    }
}
