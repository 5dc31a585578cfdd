//! `cargo bench -p raywright-benches --bench replay [--features peers] [-- FOLDER]`: searches on recorded problems, judged in
//! seconds and without one frame.
//!
//! Every search asks, and the nearest recorded configuration that is left answers; so no cost is that of
//! a model. Regret is the best cost so far over the second best of the table, less 1; excess is the mean
//! cost of the frames so far over it, less 1: what a user would pay without probes. With them a configuration
//! gets an eighth of a frame, and the best so far the rest; builds are paid in full. Geometric means over
//! problems and seeds; beside the regret the interval in which 95 % of means over problems drawn anew lie.
//! Starts are the configurations that together are best in the tables of the *other* scenes, for all alike.
//!
//! Peers search the same canonical space on the same problems and seeds, with our starts and without. Those
//! that are slow have fewer seeds, as the table says; those of Python are left out where it has none of them.
//! Where the interval of what is between ours and the nearest peer has both signs, nobody is ahead for sure.

mod methods;
#[cfg(feature = "peers")]
mod peers;
mod score;

use std::{error::Error, ops::Range, time::Instant};

use raywright_benches::{
    goals::Goals,
    recordings::{DataSet, Metric, PORTFOLIO, Problem, SpaceKind, WEAK, arguments, data_sets},
};

use methods::{JUDGED, Method, Searches};
use score::{Score, TOLD, interval, mean, score};

/// Where [`TOLD`] says 20 and 80 frames.
const JUDGED_AT: [usize; 2] = [1, 3];

/// Configurations that a portfolio may have.
const PORTFOLIO_FRAMES: usize = 5;

/// What a method did on all problems.
#[derive(Clone, Debug)]
struct Row {
    method: Method,
    scores: Vec<Score>,
}

/// A figure of a search on a problem, as a logarithm.
type Of = fn(&Score, usize) -> f64;

const REGRET: Of = |score, at| score.regret[at];
const EXCESS: Of = |score, at| score.excess[at];
const PROBED: Of = |score, at| score.probed[at];

/// Goals of one search: which figure, after how many frames, and the most percents by each metric.
const MOST: [(&str, Of, usize, [f64; 2]); 7] = [
    ("regret", REGRET, 0, [1.0, 1.0]),
    ("regret", REGRET, 1, [0.5, 0.5]),
    ("regret", REGRET, 3, [1.0, 1.5]),
    ("excess", EXCESS, 1, [12.0, f64::NAN]),
    ("excess", EXCESS, 3, [8.0, f64::NAN]),
    ("excess with probes", PROBED, 1, [5.0, 12.0]),
    ("excess with probes", PROBED, 3, [2.5, 6.0]),
];

impl Row {
    fn logs(&self, of: Of, at: usize) -> Vec<f64> {
        self.scores.iter().map(|score| of(score, at)).collect()
    }

    /// In percent, over all problems.
    fn figure(&self, of: Of, at: usize) -> f64 {
        mean(&self.logs(of, at))
    }

    fn print(&self, seconds: f64) {
        let [low, high] = interval(&self.logs(REGRET, 1));
        let numbers = |of: Of, places: Range<usize>| -> String {
            let figures = places.map(|at| format!(" {:6.1}", self.figure(of, at)));
            figures.collect()
        };
        println!(
            "{:40}{} [{low:5.1}, {high:5.1}]{}  {}  {}  {:2} {seconds:7.1} s",
            self.method.name,
            numbers(REGRET, 0..2),
            numbers(REGRET, 2..TOLD.len()),
            numbers(EXCESS, 0..TOLD.len()),
            numbers(PROBED, 0..TOLD.len()),
            self.method.seeds,
        );
    }
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
            println!(
                "\n{title}: regret after {TOLD:?} frames, %; excess, %; the same with probes; seeds"
            );
            let rows = table(&searches, set, metric)?;
            let judged = rows.iter().find(|row| row.method.name == JUDGED);
            if let Some(judged) = judged {
                for (what, of, at, most) in MOST {
                    let most = most[metric as usize];
                    if most.is_nan() {
                        continue;
                    }
                    let (value, frames) = (judged.figure(of, at), TOLD[at]);
                    let what = format!("{what} after {frames} frames, {title}: {value:.2} %");
                    goals.check(format!("{what}, not {most}"), value <= most);
                }
                beside_peers(judged, &rows, &title, &mut goals);
            }
            fixed(set, metric, &title, &mut goals)?;
        }
    }
    goals.print();
    Ok(())
}

/// Prints a row for each search.
fn table(searches: &Searches, set: &DataSet, metric: Metric) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut rows = Vec::new();
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
        let row = Row {
            method: *method,
            scores,
        };
        row.print(start.elapsed().as_secs_f64());
        rows.push(row);
    }
    Ok(rows)
}

/// Whether a search of ours is ahead of every peer, in each figure by itself, and by how much of the costs.
fn beside_peers(judged: &Row, rows: &[Row], title: &str, goals: &mut Goals) {
    for (kind, of) in [("regret", REGRET), ("excess", EXCESS)] {
        for at in JUDGED_AT {
            let peers = rows.iter().filter(|row| row.method.is_peer());
            let figure = |row: &Row| row.figure(of, at);
            let least = peers.min_by(|a, b| figure(a).total_cmp(&figure(b)));
            let Some(peer) = least else { return };
            let (own, other) = (figure(judged), figure(peer));
            let pairs = judged.logs(of, at).into_iter().zip(peer.logs(of, at));
            let apart: Vec<f64> = pairs.map(|(own, other)| own - other).collect();
            let [low, high] = interval(&apart);
            let what = format!(
                "ahead of every peer in {kind} after {} frames, {title}: ours {own:.2} %, {} {other:.2} %, \
                 apart {:+.2} [{low:+.2}, {high:+.2}] %",
                TOLD[at],
                peer.method.name,
                mean(&apart)
            );
            let is_ahead = own < other;
            println!("{}{what}", if is_ahead { "" } else { "not " });
            goals.check(what, is_ahead);
        }
    }
}

/// The geometric mean over all problems.
fn mean_of(
    set: &DataSet,
    of: impl Fn(&Problem) -> Result<f64, Box<dyn Error>>,
) -> Result<f64, Box<dyn Error>> {
    let mut sum = 0.0;
    for problem in &set.problems {
        sum += of(problem)?.ln();
    }
    Ok((sum / set.problems.len() as f64).exp())
}

/// What fixed configurations give: no search at all.
fn fixed(
    set: &DataSet,
    metric: Metric,
    title: &str,
    goals: &mut Goals,
) -> Result<(), Box<dyn Error>> {
    let named = |problem: &Problem, name: &str| {
        let cost = problem.named(name, metric);
        cost.ok_or_else(|| format!("{}: no {name}", problem.name))
    };
    let weak = mean_of(set, |p| Ok(named(p, "strong8")? / named(p, WEAK)?))?;
    let three = mean_of(set, |p| {
        let costs = PORTFOLIO.iter().filter_map(|name| p.named(name, metric));
        Ok(costs.fold(f64::INFINITY, f64::min) / p.best(metric))
    })?;
    let kind = SpaceKind::Canonical;
    let of_others = mean_of(set, |p| {
        let members = set.cover(p.scene(), metric, PORTFOLIO_FRAMES, kind)?;
        let rows = p
            .rows
            .iter()
            .filter(|row| members.contains(row.config(kind)));
        let costs = rows.filter_map(|row| Some(row.costs?[metric as usize]));
        Ok(costs.fold(f64::INFINITY, f64::min) / p.best(metric))
    })?;
    println!(
        "strong default ÷ weak default {weak:.3}; ÷ best: of three named {three:.3}, of {PORTFOLIO_FRAMES} that \
         cover the other scenes {of_others:.3}"
    );
    let most = match metric {
        Metric::Render => [0.49, 1.02],
        Metric::Total => [0.56, 1.06],
    };
    let whats = ["first frame ÷ weak default", "portfolio ÷ best"];
    for ((what, value), most) in whats.iter().zip([weak, of_others]).zip(most) {
        goals.check(
            format!("{what}, {title}: {value:.3}, not {most}"),
            value <= most,
        );
    }
    Ok(())
}
