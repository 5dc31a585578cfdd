//! The tuner behind a scripted search: starts, records, database answers, typed errors.

use std::sync::{Arc, Mutex};

use raywright_tuner::{
    Config, Estimate, Outcome, Param, Proposal, Random, Reason, Scale, Search, Space, TellError,
    Tuner, search_by_name,
};

/// Proposes the given point for ever and writes down what it is told.
#[derive(Debug)]
struct Stubborn {
    point: Vec<f64>,
    samples: usize,
    heard: Arc<Mutex<Vec<Heard>>>,
}

#[derive(Debug, Clone, PartialEq)]
enum Heard {
    Observed(Option<u64>, f64, usize),
    Withdrawn(u64),
}

impl Stubborn {
    fn boxed(point: &[f64], samples: usize) -> (Box<Stubborn>, Arc<Mutex<Vec<Heard>>>) {
        let heard = Arc::default();
        let search = Stubborn {
            point: point.to_vec(),
            samples,
            heard: Arc::clone(&heard),
        };
        (Box::new(search), heard)
    }
}

impl Search for Stubborn {
    fn name(&self) -> &'static str {
        "stubborn"
    }

    fn begin(&mut self, _steps: &[f64], _seed: u64) {}

    fn propose(&mut self, _ticket: u64) -> Proposal {
        Proposal {
            point: self.point.clone(),
            samples: self.samples,
            step: "again",
        }
    }

    fn observe(&mut self, ticket: Option<u64>, _point: &[f64], estimate: Estimate) {
        let heard = Heard::Observed(ticket, estimate.mean, estimate.samples);
        self.heard.lock().unwrap().push(heard);
    }

    fn withdraw(&mut self, ticket: u64) {
        self.heard.lock().unwrap().push(Heard::Withdrawn(ticket));
    }
}

fn line() -> Space {
    Space::new(vec![Param::integer("n", 0..=9, Scale::Linear, "")]).unwrap()
}

fn n(space: &Space, value: i64) -> Config {
    space.config(&[("n", value.into())]).unwrap()
}

fn done(cost: f64) -> Outcome {
    Outcome::Done { cost }
}

fn failed() -> Outcome {
    Outcome::Failed {
        reason: "too deep".to_owned(),
    }
}

#[test]
fn tuner_can_be_sent() {
    fn needs_send(_: impl Send) {}
    needs_send(Tuner::new(line(), Box::new(Random::new()), 0));
}

#[test]
fn starts_come_first_and_return_when_cancelled() {
    let space = line();
    let mut tuner = Tuner::new(space.clone(), Box::new(Random::new()), 0)
        .with_start(n(&space, 4))
        .with_start(n(&space, 7));
    let first = tuner.ask();
    assert_eq!(
        (first.config.integer("n"), first.reason),
        (Some(4), Reason::Start)
    );
    tuner.tell(first.id, Outcome::Cancelled).unwrap();
    assert!(tuner.records().is_empty());
    assert_eq!(tuner.ask().config.integer("n"), Some(4));
    assert_eq!(tuner.ask().config.integer("n"), Some(7));
    assert_ne!(tuner.ask().reason, Reason::Start);
}

#[test]
fn what_is_known_is_not_asked_again_and_can_be_the_best() {
    let space = line();
    let mut tuner = Tuner::new(space.clone(), Box::new(Random::new()), 0);
    let bad = tuner.tell_known(&n(&space, 4), Outcome::Done { cost: f64::NAN });
    assert!(matches!(bad, Err(TellError::BadCost { .. })));
    tuner.tell_known(&n(&space, 5), Outcome::Cancelled).unwrap();
    assert!(tuner.records().is_empty());
    let told = tuner
        .tell_known(&n(&space, 4), Outcome::Done { cost: 1.0 })
        .unwrap();
    assert!(told.is_incumbent);
    tuner.tell_known(&n(&space, 6), failed()).unwrap();
    for _ in 0..5 {
        let trial = tuner.ask();
        assert!(![Some(4), Some(6)].contains(&trial.config.integer("n")));
        tuner.tell(trial.id, Outcome::Done { cost: 2.0 }).unwrap();
    }
    assert_eq!(tuner.incumbent().unwrap().config.integer("n"), Some(4));
}

#[test]
fn a_start_that_failed_is_not_asked_again() {
    let space = line();
    let mut tuner = Tuner::new(space.clone(), Box::new(Random::new()), 0)
        .with_start(n(&space, 4))
        .with_start(n(&space, 4));
    let first = tuner.ask();
    tuner.tell(first.id, failed()).unwrap();
    assert_ne!(tuner.ask().config.integer("n"), Some(4));
}

#[test]
#[should_panic(expected = "not a start of this space")]
fn a_start_of_another_space_is_refused() {
    let other = Space::new(vec![Param::integer("n", 10..=19, Scale::Linear, "")]).unwrap();
    let _ = Tuner::new(line(), Box::new(Random::new()), 0).with_start(n(&other, 12));
}

#[test]
fn the_incumbent_has_the_least_mean_and_ties_keep_the_older() {
    let space = line();
    let mut tuner = Tuner::new(space.clone(), Box::new(Random::new()), 0);
    for value in [1, 2, 3, 2] {
        tuner = tuner.with_start(n(&space, value));
    }
    let trials: Vec<_> = (0..4).map(|_| tuner.ask()).collect();
    // Told out of order: the tie of 1 and 3 goes to the older trial, not to the first told.
    assert!(tuner.tell(trials[2].id, done(5.0)).unwrap().is_incumbent);
    assert!(tuner.tell(trials[0].id, done(5.0)).unwrap().is_incumbent);
    assert!(tuner.tell(trials[1].id, done(4.0)).unwrap().is_incumbent);
    assert_eq!(tuner.incumbent().unwrap().config, n(&space, 2));
    // A second, bad measurement: the mean of 2 is 6.
    assert!(!tuner.tell(trials[3].id, done(8.0)).unwrap().is_incumbent);
    assert_eq!(tuner.incumbent().unwrap().config, n(&space, 1));
    let record = tuner.records().iter().find(|record| record.n == 2).unwrap();
    assert_eq!((record.cost, &record.costs[..]), (6.0, &[4.0, 8.0][..]));
    assert_eq!(record.first_trial, trials[1].id);
}

#[test]
fn a_failure_ends_an_incumbency() {
    let space = line();
    let mut tuner = Tuner::new(space.clone(), Box::new(Random::new()), 0)
        .with_start(n(&space, 1))
        .with_start(n(&space, 1));
    let (first, second) = (tuner.ask(), tuner.ask());
    assert!(tuner.tell(first.id, done(1.0)).unwrap().is_incumbent);
    assert!(!tuner.tell(second.id, failed()).unwrap().is_incumbent);
    assert!(tuner.incumbent().is_none());
    let record = &tuner.records()[0];
    assert_eq!(
        (record.n, record.cost, record.failures.len()),
        (1, f64::INFINITY, 1)
    );
}

#[test]
fn wrong_tells_are_typed_errors() {
    let mut tuner = Tuner::new(line(), Box::new(Random::new()), 0);
    let mut other = Tuner::new(line(), Box::new(Random::new()), 0);
    other.ask();
    let unknown = other.ask().id;
    let id = tuner.ask().id;
    assert_eq!(
        tuner.tell(unknown, failed()),
        Err(TellError::UnknownTrial { id: unknown })
    );
    let refused = tuner.tell(id, done(-1.0));
    assert_eq!(refused, Err(TellError::BadCost { id, cost: -1.0 }));
    assert!(tuner.tell(id, done(0.0)).unwrap().is_incumbent);
    for outcome in [done(0.0), failed(), Outcome::Cancelled] {
        assert_eq!(tuner.tell(id, outcome), Err(TellError::AlreadyTold { id }));
    }
}

#[test]
fn known_proposals_are_answered_three_times_and_then_replaced() {
    let (search, heard) = Stubborn::boxed(&[0.55], 1);
    let mut tuner = Tuner::new(line(), search, 0);
    let first = tuner.ask();
    assert_eq!(first.config.integer("n"), Some(5));
    assert_eq!(
        first.reason,
        Reason::Proposed {
            search: "stubborn",
            step: "again"
        }
    );
    tuner.tell(first.id, done(3.0)).unwrap();

    let second = tuner.ask();
    assert_eq!(second.reason, Reason::Replacement);
    assert_ne!(second.config.integer("n"), Some(5));
    tuner.tell(second.id, done(9.0)).unwrap();
    let expected = [
        Heard::Observed(Some(0), 3.0, 1),
        Heard::Observed(Some(1), 3.0, 1),
        Heard::Observed(Some(2), 3.0, 1),
        Heard::Observed(Some(3), 3.0, 1),
        Heard::Observed(None, 9.0, 1),
    ];
    assert_eq!(*heard.lock().unwrap(), expected);
}

#[test]
fn a_search_gets_the_samples_it_wants() {
    let (search, heard) = Stubborn::boxed(&[0.55], 3);
    let mut tuner = Tuner::new(line(), search, 0);
    for cost in [1.0, 2.0, 6.0] {
        let trial = tuner.ask();
        assert_eq!(trial.config.integer("n"), Some(5));
        tuner.tell(trial.id, done(cost)).unwrap();
    }
    assert_eq!(
        heard.lock().unwrap().last(),
        Some(&Heard::Observed(Some(2), 3.0, 3))
    );
    assert_eq!(tuner.ask().reason, Reason::Replacement);
}

#[test]
fn an_open_configuration_is_not_handed_out_twice() {
    let (search, heard) = Stubborn::boxed(&[0.55], 1);
    let mut tuner = Tuner::new(line(), search, 0);
    let values: std::collections::BTreeSet<_> =
        (0..10).map(|_| tuner.ask().config.integer("n")).collect();
    assert_eq!(values.len(), 10, "ten open trials cover the ten values");
    assert!(
        heard
            .lock()
            .unwrap()
            .iter()
            .all(|heard| matches!(heard, Heard::Withdrawn(_)))
    );
}

#[test]
fn a_cancelled_proposal_is_withdrawn() {
    let (search, heard) = Stubborn::boxed(&[0.55], 1);
    let mut tuner = Tuner::new(line(), search, 0);
    let trial = tuner.ask();
    tuner.tell(trial.id, Outcome::Cancelled).unwrap();
    assert_eq!(*heard.lock().unwrap(), [Heard::Withdrawn(0)]);
    assert_eq!(tuner.ask().config.integer("n"), Some(5));
}

#[test]
fn an_exhausted_space_measures_its_incumbent_again() {
    let mut tuner = Tuner::new(line(), search_by_name("random").unwrap(), 0);
    let cost = |config: &Config| (config.integer("n").unwrap() - 6).abs() as f64;
    let mut replicates = 0;
    for _ in 0..60 {
        let trial = tuner.ask();
        if trial.reason == Reason::Replicate {
            replicates += 1;
            assert_eq!(trial.config.integer("n"), Some(6));
        }
        tuner.tell(trial.id, done(cost(&trial.config))).unwrap();
    }
    assert_eq!(tuner.records().len(), 10);
    assert_eq!(replicates, 50);
}

#[test]
fn failures_are_avoided_until_nothing_else_is_left() {
    let mut tuner = Tuner::new(line(), search_by_name("random").unwrap(), 0);
    for count in 1..=10 {
        let trial = tuner.ask();
        tuner.tell(trial.id, failed()).unwrap();
        assert_eq!(tuner.records().len(), count);
    }
    assert_eq!(tuner.ask().reason, Reason::Replicate);
}
