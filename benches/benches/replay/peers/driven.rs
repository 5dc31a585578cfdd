//! A library that calls its objective, as a search that is asked: it runs in a thread that waits for costs.
//!
//! A run begins at the best point that is known by the first proposal, and one that has ended is begun anew
//! at the best of all with other random numbers. A library that is driven in this way cannot be told where
//! the configuration that answered lies: it takes the cost for that of its own point.
//! Invariant: a point is out until its cost is there; with nobody to ask, the thread ends.

use std::{
    sync::mpsc::{Receiver, Sender, channel},
    thread,
};

use raywright_tuner::{Estimate, Proposal, Search};

use super::FAILURE;

/// Runs in a row that may end without a point.
const EMPTY_RUNS: usize = 8;

/// What a run minimises.
#[derive(Debug)]
pub(super) struct Objective {
    points: Sender<Vec<f64>>,
    costs: Receiver<f64>,
}

impl Objective {
    /// The cost of a point of the unit cube; `None` when nobody asks any more.
    pub(super) fn cost(&self, point: &[f64]) -> Option<f64> {
        self.points.send(point.to_vec()).ok()?;
        self.costs.recv().ok()
    }
}

/// A run of a library from a point, with a seed.
pub(super) type Run = fn(&[f64], u64, &Objective);

/// The other ends of an objective.
#[derive(Debug)]
struct Thread {
    points: Receiver<Vec<f64>>,
    costs: Sender<f64>,
}

/// A library behind [`Search`].
#[derive(Debug)]
pub(crate) struct Driven {
    name: &'static str,
    run: Run,
    seed: u64,
    thread: Option<Thread>,
    /// The point whose cost is waited for.
    out: Option<Vec<f64>>,
    best: (Vec<f64>, f64),
}

impl Driven {
    pub(super) fn new(name: &'static str, run: Run) -> Driven {
        Driven {
            name,
            run,
            seed: 0,
            thread: None,
            out: None,
            best: (Vec::new(), f64::INFINITY),
        }
    }

    fn start(&mut self) -> Thread {
        let (points, asked) = channel();
        let (costs, told) = channel();
        let objective = Objective {
            points,
            costs: told,
        };
        let (run, start, seed) = (self.run, self.best.0.clone(), self.seed);
        self.seed = self.seed.wrapping_add(1);
        thread::spawn(move || run(&start, seed, &objective));
        Thread {
            points: asked,
            costs,
        }
    }

    /// The next point of the library; the best one if it has none to ask for.
    fn next(&mut self) -> Vec<f64> {
        for _ in 0..EMPTY_RUNS {
            let thread = match self.thread.take() {
                Some(thread) => thread,
                None => self.start(),
            };
            if let Ok(point) = thread.points.recv() {
                self.thread = Some(thread);
                return point;
            }
        }
        self.best.0.clone()
    }
}

impl Search for Driven {
    fn name(&self) -> &'static str {
        self.name
    }

    fn begin(&mut self, steps: &[f64], seed: u64) {
        *self = Driven::new(self.name, self.run);
        self.seed = seed;
        self.best.0 = vec![0.5; steps.len()];
    }

    fn propose(&mut self, _ticket: u64) -> Proposal {
        let point = match self.out.take() {
            Some(point) => point,
            None => self.next(),
        };
        self.out = Some(point.clone());
        Proposal {
            point,
            samples: 1,
            step: "ask",
        }
    }

    fn observe(&mut self, ticket: Option<u64>, point: &[f64], estimate: Estimate) {
        if estimate.mean < self.best.1 {
            self.best = (point.to_vec(), estimate.mean);
        }
        if ticket.is_some() && self.out.take().is_some() {
            let cost = estimate.mean.min(FAILURE);
            // A run that has ended meanwhile needs no cost.
            self.thread.as_ref().map(|thread| thread.costs.send(cost));
        }
    }

    fn withdraw(&mut self, _ticket: u64) {}
}
