//! What every search must do, as one function that panics with what it does not do.
//!
//! The suite drives a search alone and behind a [`Tuner`], over spaces and outcomes that break
//! careless searches: most trials fail, nothing is told, everything is told backwards, there is
//! only one configuration. Seeds are fixed: a search passes always or never. The idea of one suite
//! for all is optuna's (`testing/pytest_samplers.py`).

use std::collections::HashSet;

use crate::rng::Stream;
use crate::{
    Config, Estimate, Outcome, Param, Scale, Search, Space, TellError, Trial, Tuner, Value,
};

/// Checks the search that `make` makes. Takes well below a second in an optimised build.
///
/// # Panics
///
/// If the search breaks the contract of [`Search`], or finds nothing in a smooth convex valley.
pub fn check(make: impl Fn() -> Box<dyn Search>) {
    let make: &dyn Fn() -> Box<dyn Search> = &make;
    proposes_in_the_cube(make);
    stays_in_the_space(make);
    repeats_itself(make);
    begins_anew(make);
    never_repeats_a_failure(make);
    survives_failures_only(make);
    asks_without_being_told(make);
    takes_tells_in_any_order(make);
    refuses_bad_tells(make);
    survives_cancellation(make);
    copes_with_one_configuration(make);
    exhausts_booleans(make);
    descends_a_valley(make);
}

type Make<'a> = &'a dyn Fn() -> Box<dyn Search>;

/// Every type, both scales, a constraint, conditions two deep.
fn mixed_space() -> Space {
    Space::new(vec![
        Param::ordinal("quality", vec![1, 2, 3], ""),
        Param::integer("least", 1..=32, Scale::Log, ""),
        Param::integer("most", 1..=32, Scale::Log, ""),
        Param::boolean("split", "").active_if("quality", [2, 3]),
        Param::real("overlap", 1e-6..=1e-2, Scale::Log, "").active_if("split", [true]),
        Param::real("ratio", 0.0..=10.0, Scale::Linear, ""),
    ])
    .and_then(|space| space.with_at_most("least", "most"))
    .expect("a valid space")
}

/// Smooth, with its minimum in the middle of the space.
fn mixed_cost(config: &Config) -> f64 {
    let integer = |name| config.integer(name).expect("an integer") as f64;
    let ratio = config.real("ratio").expect("a real");
    let leaves = (integer("least") - 4.0).powi(2) + (integer("most") - 20.0).powi(2);
    1.0 + integer("quality") + 0.01 * leaves + (ratio - 3.0).powi(2)
}

fn done(cost: f64) -> Outcome {
    Outcome::Done { cost }
}

fn failed() -> Outcome {
    Outcome::Failed {
        reason: "does not fit".to_owned(),
    }
}

fn tell(tuner: &mut Tuner, trial: &Trial, outcome: Outcome) {
    tuner
        .tell(trial.id, outcome)
        .expect("an open trial and a finite cost");
}

fn proposes_in_the_cube(make: Make<'_>) {
    let steps = [0.5, 0.0, 1.0, 1.0 / 32.0];
    let mut search = make();
    search.begin(&steps, 1);
    let mut costs = Stream::new(1);
    for ticket in 0..3000 {
        let proposal = search.propose(ticket);
        let name = search.name();
        assert_eq!(
            proposal.point.len(),
            steps.len(),
            "{name}: one coordinate per axis"
        );
        assert!(
            proposal.point.iter().all(|unit| (0.0..=1.0).contains(unit)),
            "{name}: {} left the unit cube: {:?}",
            proposal.step,
            proposal.point
        );
        assert!(
            proposal.samples > 0,
            "{name}: a proposal without measurement"
        );
        match costs.below(10) {
            0 => search.withdraw(ticket),
            1 => {}
            draw => {
                let mean = if draw == 2 {
                    f64::INFINITY
                } else {
                    costs.unit()
                };
                let estimate = Estimate {
                    mean,
                    samples: proposal.samples,
                    noise: 0.0,
                };
                search.observe(Some(ticket), &proposal.point, estimate);
            }
        }
    }
}

fn stays_in_the_space(make: Make<'_>) {
    let space = mixed_space();
    let mut tuner = Tuner::new(space.clone(), make(), 2);
    for _ in 0..2000 {
        let trial = tuner.ask();
        if let Err(error) = space.check(&trial.config) {
            panic!("{}: {error}", trial.reason);
        }
        assert_eq!(trial.canonical, space.canonical(&trial.config));
        tell(&mut tuner, &trial, done(mixed_cost(&trial.config)));
    }
}

/// A run with up to four open trials and every kind of outcome.
fn entangled_run(search: Box<dyn Search>, seed: u64) -> Vec<Trial> {
    let mut tuner = Tuner::new(mixed_space(), search, seed);
    let mut dice = Stream::new(99);
    let mut open: Vec<Trial> = Vec::new();
    let mut asked = Vec::new();
    while asked.len() < 300 {
        if open.len() < 4 && dice.below(2) == 0 {
            let trial = tuner.ask();
            asked.push(trial.clone());
            open.push(trial);
        } else if !open.is_empty() {
            let trial = open.swap_remove(dice.below(open.len()));
            let outcome = match dice.below(8) {
                0 => Outcome::Cancelled,
                1 => failed(),
                _ => done(mixed_cost(&trial.config)),
            };
            tell(&mut tuner, &trial, outcome);
        }
    }
    asked
}

fn repeats_itself(make: Make<'_>) {
    let first = entangled_run(make(), 3);
    assert_eq!(
        first,
        entangled_run(make(), 3),
        "the same seed and tells gave other asks"
    );
    assert_ne!(
        first,
        entangled_run(make(), 4),
        "another seed gave the same asks"
    );
}

fn begins_anew(make: Make<'_>) {
    let run = |search: &mut dyn Search| -> Vec<Vec<f64>> {
        search.begin(&[0.0, 0.0], 5);
        let points = (0..40).map(|ticket| {
            let point = search.propose(ticket).point;
            let estimate = Estimate {
                mean: point[0],
                samples: 9,
                noise: 0.0,
            };
            search.observe(Some(ticket), &point, estimate);
            point
        });
        points.collect()
    };
    let mut search = make();
    let first = run(&mut *search);
    assert_eq!(
        first,
        run(&mut *search),
        "begin left something of the run before"
    );
}

fn never_repeats_a_failure(make: Make<'_>) {
    // 3 · 16 configurations, of which 2 · 16 fail: soon nothing new is left.
    let space = Space::new(vec![
        Param::ordinal("a", vec![1, 2, 3], ""),
        Param::integer("b", 0..=15, Scale::Linear, ""),
    ]);
    let mut tuner = Tuner::new(space.expect("a valid space"), make(), 6);
    let mut refused = HashSet::new();
    for _ in 0..300 {
        let trial = tuner.ask();
        assert!(
            !refused.contains(&trial.canonical),
            "{} failed before",
            trial.config
        );
        let a = trial.config.integer("a").expect("an integer");
        let b = trial.config.integer("b").expect("an integer");
        if a == 2 {
            tell(&mut tuner, &trial, done(b as f64));
        } else {
            refused.insert(trial.canonical.clone());
            tell(&mut tuner, &trial, failed());
        }
    }
    let best = tuner.incumbent().expect("a third of the space works");
    assert_eq!(
        best.config.integer("b"),
        Some(0),
        "a third of 48 configurations was not searched"
    );
}

fn survives_failures_only(make: Make<'_>) {
    let mut tuner = Tuner::new(mixed_space(), make(), 7);
    let mut refused = HashSet::new();
    for _ in 0..500 {
        let trial = tuner.ask();
        assert!(
            refused.insert(trial.canonical.clone()),
            "{} failed before",
            trial.config
        );
        tell(&mut tuner, &trial, failed());
    }
    assert!(tuner.incumbent().is_none());
}

fn asks_without_being_told(make: Make<'_>) {
    let mut tuner = Tuner::new(mixed_space(), make(), 8);
    for _ in 0..30 {
        let batch: Vec<Trial> = (0..8).map(|_| tuner.ask()).collect();
        let different: HashSet<&Config> = batch.iter().map(|trial| &trial.canonical).collect();
        assert!(
            different.len() >= 7,
            "a batch of 8 has {} configurations",
            different.len()
        );
        for trial in &batch[..4] {
            tell(&mut tuner, trial, done(mixed_cost(&trial.config)));
        }
    }
}

fn takes_tells_in_any_order(make: Make<'_>) {
    let mut tuner = Tuner::new(mixed_space(), make(), 9);
    let mut order = Stream::new(9);
    let mut least = f64::INFINITY;
    for _ in 0..30 {
        let mut batch: Vec<Trial> = (0..8).map(|_| tuner.ask()).collect();
        order.shuffle(&mut batch);
        for trial in batch {
            let cost = mixed_cost(&trial.config);
            least = least.min(cost);
            tell(&mut tuner, &trial, done(cost));
        }
    }
    let best = tuner.incumbent().expect("all were done");
    assert_eq!(
        mixed_cost(&best.config),
        least,
        "the incumbent is not the best"
    );
}

fn refuses_bad_tells(make: Make<'_>) {
    let mut tuner = Tuner::new(mixed_space(), make(), 10);
    let trial = tuner.ask();
    for cost in [f64::NAN, f64::INFINITY, -1.0] {
        let refused = tuner.tell(trial.id, done(cost));
        assert!(
            matches!(refused, Err(TellError::BadCost { .. })),
            "{cost}: {refused:?}"
        );
    }
    tell(&mut tuner, &trial, done(1.0));
    let id = trial.id;
    assert_eq!(
        tuner.tell(id, done(1.0)),
        Err(TellError::AlreadyTold { id })
    );
    assert_eq!(tuner.records()[0].n, 1);
}

fn survives_cancellation(make: Make<'_>) {
    let mut tuner = Tuner::new(mixed_space(), make(), 11);
    for _ in 0..100 {
        let trial = tuner.ask();
        tell(&mut tuner, &trial, Outcome::Cancelled);
    }
    assert!(tuner.records().is_empty());
    let trial = tuner.ask();
    tell(&mut tuner, &trial, done(1.0));
    assert_eq!(tuner.records().len(), 1);
}

fn copes_with_one_configuration(make: Make<'_>) {
    let space = Space::new(vec![Param::integer("only", 7..=7, Scale::Linear, "")]);
    let mut tuner = Tuner::new(space.expect("a valid space"), make(), 12);
    for round in 0..20 {
        let batch: Vec<Trial> = (0..3).map(|_| tuner.ask()).collect();
        for trial in batch {
            assert_eq!(trial.config.integer("only"), Some(7));
            let outcome = if round == 19 { failed() } else { done(2.0) };
            tell(&mut tuner, &trial, outcome);
        }
    }
    assert_eq!(tuner.records().len(), 1);
    assert!(tuner.incumbent().is_none(), "its only configuration failed");
    assert_eq!(tuner.ask().config.integer("only"), Some(7));
}

fn exhausts_booleans(make: Make<'_>) {
    let names = ["a", "b", "c", "d"];
    let space = Space::new(names.iter().map(|name| Param::boolean(name, "")).collect());
    let mut tuner = Tuner::new(space.expect("a valid space"), make(), 13);
    let wanted = [true, false, false, true];
    for _ in 0..100 {
        let trial = tuner.ask();
        let wrong = trial.config.iter().zip(wanted);
        let cost = wrong
            .filter(|((_, value), wanted)| *value != Value::Bool(*wanted))
            .count();
        tell(&mut tuner, &trial, done(cost as f64));
    }
    assert_eq!(
        tuner.records().len(),
        16,
        "not all of 16 configurations were asked in 100 trials"
    );
    assert_eq!(tuner.incumbent().expect("all were done").cost, 0.0);
}

/// After 100 trials in a five-dimensional bowl a search must have gone below the best tenth of
/// random points. Independent random trials miss that with a probability of 0.9^100 = 3e-5.
fn descends_a_valley(make: Make<'_>) {
    let names = ["a", "b", "c", "d", "e"];
    let axis = |name: &&str| Param::real(name, 0.0..=1.0, Scale::Linear, "");
    let space = Space::new(names.iter().map(axis).collect()).expect("a valid space");
    let cost = |config: &Config| -> f64 {
        let square = |name| (config.real(name).expect("a real") - 0.3).powi(2);
        names.into_iter().map(square).sum()
    };
    let mut stream = Stream::new(14);
    let mut random: Vec<f64> = (0..1000)
        .map(|_| cost(&space.decode(&stream.point(names.len()))))
        .collect();
    random.sort_by(f64::total_cmp);
    for seed in 0..10 {
        let mut tuner = Tuner::new(space.clone(), make(), seed);
        for _ in 0..100 {
            let trial = tuner.ask();
            tell(&mut tuner, &trial, done(cost(&trial.config)));
        }
        let best = tuner.incumbent().expect("all were done").cost;
        assert!(
            best < random[100],
            "seed {seed}: {best}, a tenth of random points is better"
        );
    }
}

#[cfg(test)]
mod tests;
