//! Searches on our own recordings, small enough for every run of the tests: what is judged by `--bench replay`
//! holds in short.

use raywright_benches::recordings::{DataSet, Metric, SpaceKind, data_sets};
use raywright_tuner::{Outcome, Tuner, replay::Pool, search_by_name};

const FRAMES: usize = 20;
const SEEDS: u64 = 2;

/// The geometric mean over all problems of the best cost after [`FRAMES`] over the second best of the table.
fn best_found(set: &DataSet, metric: Metric, search: &str, kind: SpaceKind, starts: usize) -> f64 {
    let mut sum = 0.0;
    for problem in &set.problems {
        let starts = set
            .cover(problem.scene(), metric, starts, kind)
            .expect("costs");
        for seed in 0..SEEDS {
            let rows = problem.rows.iter();
            let rows = rows.map(|row| (row.config(kind).clone(), row.outcome(metric)));
            let mut pool = Pool::new(set.space(kind), rows);
            let search = search_by_name(search).expect("a search of that name");
            let mut tuner = Tuner::new(set.space(kind).clone(), search, seed);
            for start in &starts {
                tuner = tuner.with_start(start.clone());
            }
            let mut least = f64::INFINITY;
            for _ in 0..FRAMES {
                let trial = tuner.ask();
                let answer = pool.answer(&mut tuner, &trial).expect("a trial of its own");
                if let Some((Outcome::Done { cost }, _)) = answer {
                    least = least.min(cost);
                }
            }
            sum += (least / problem.best(metric)).ln();
        }
    }
    (sum / (set.problems.len() as f64 * SEEDS as f64)).exp()
}

#[test]
fn twenty_frames_find_what_three_hundred_would() {
    let sets = data_sets(None).expect("recordings that can be read");
    let own = sets.iter().find(|set| set.name == "own recordings");
    let own = own.expect("they are in this folder");
    assert_eq!(own.problems.len(), 18, "six scenes from three cameras");
    for metric in Metric::ALL {
        let ours = best_found(own, metric, "gaussian-process", SpaceKind::Canonical, 3);
        let paper = best_found(own, metric, "nelder-mead", SpaceKind::Printed, 0);
        assert!(ours < 1.02, "{}: {ours}", metric.name());
        assert!(paper > ours + 0.02, "{}: {paper} and {ours}", metric.name());
    }
}
