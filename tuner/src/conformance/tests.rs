//! A suite that no search fails proves nothing: each of these breaks one rule and is caught.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::*;
use crate::{Proposal, Random};

/// Random search whose proposals are spoilt by a function of ticket and point.
#[derive(Debug)]
struct Spoilt<F> {
    random: Random,
    spoil: F,
}

#[derive(Clone, Copy)]
struct Spoil<F>(F);

impl<F> std::fmt::Debug for Spoil<F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Spoil")
    }
}

impl<F: Fn(u64, &mut Proposal) + Send> Search for Spoilt<Spoil<F>> {
    fn name(&self) -> &'static str {
        "spoilt"
    }

    fn begin(&mut self, steps: &[f64], seed: u64) {
        self.random.begin(steps, seed);
    }

    fn propose(&mut self, ticket: u64) -> Proposal {
        let mut proposal = self.random.propose(ticket);
        (self.spoil.0)(ticket, &mut proposal);
        proposal
    }

    fn observe(&mut self, ticket: Option<u64>, point: &[f64], estimate: Estimate) {
        self.random.observe(ticket, point, estimate);
    }

    fn withdraw(&mut self, ticket: u64) {
        self.random.withdraw(ticket);
    }
}

fn check_spoilt(spoil: impl Fn(u64, &mut Proposal) + Send + Clone + 'static) {
    check(|| {
        Box::new(Spoilt {
            random: Random::new(),
            spoil: Spoil(spoil.clone()),
        })
    });
}

#[test]
fn accepts_an_unspoilt_search() {
    check_spoilt(|_, _| {});
}

#[test]
#[should_panic(expected = "left the unit cube")]
fn catches_a_search_that_leaves_the_cube() {
    check_spoilt(|ticket, proposal| proposal.point[0] += (ticket / 1000) as f64);
}

#[test]
#[should_panic(expected = "one coordinate per axis")]
fn catches_a_missing_coordinate() {
    check_spoilt(|ticket, proposal| proposal.point.truncate(3 + usize::from(ticket < 50)));
}

#[test]
#[should_panic(expected = "a proposal without measurement")]
fn catches_a_proposal_without_measurement() {
    check_spoilt(|_, proposal| proposal.samples = 0);
}

#[test]
#[should_panic(expected = "the same seed and tells gave other asks")]
fn catches_shared_state() {
    let calls = Arc::new(AtomicU64::new(0));
    check_spoilt(move |_, proposal| {
        let call = calls.fetch_add(1, Ordering::Relaxed);
        // A real axis of every space in the suite that is searched twice with one seed.
        let last = proposal.point.len() - 1;
        proposal.point[last] /= 1.0 + call as f64;
    });
}

#[test]
#[should_panic(expected = "another seed gave the same asks")]
fn catches_a_search_without_seed() {
    check_spoilt(|ticket, proposal| {
        for (axis, unit) in proposal.point.iter_mut().enumerate() {
            *unit = (ticket as f64 * 0.618 * (axis + 1) as f64).fract();
        }
    });
}

#[test]
#[should_panic(expected = "a tenth of random points is better")]
fn catches_a_search_that_looks_in_a_corner() {
    check_spoilt(|_, proposal| {
        proposal
            .point
            .iter_mut()
            .for_each(|unit| *unit = 0.9 + *unit / 10.0);
    });
}
