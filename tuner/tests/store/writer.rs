//! What a writer accepts, and that it comes back as it was.

use std::num::NonZeroU32;

use raywright_tuner::Outcome;
use raywright_tuner::store::{
    Body, Fact, Facts, Fields, MAX_PAYLOAD_BYTES, Machine, Note, State, StoreError, SyncPolicy,
    TrialOutcome,
};

use crate::common::{fill, id, store, writer};

#[test]
fn numbers_that_are_not_finite_are_refused() {
    let (_folder, store) = store();
    let mut log = writer(&store, "a");
    let trial = log.append(0.0, Note::new("stands for a trial")).unwrap();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let outcome = |cost| TrialOutcome::new(trial.clone(), Outcome::Done { cost });
        let refused = [
            log.append(bad, Note::new("time")),
            log.append(0.0, outcome(bad)),
            log.append(0.0, outcome(-1.0)),
            log.append(0.0, outcome(1.0).with_measure("build_ms", bad)),
            log.append(
                0.0,
                Machine::new(Facts::from([("ghz".to_owned(), Fact::from(bad))])),
            ),
        ];
        for refused in refused {
            let error = refused.unwrap_err();
            let is_typed = matches!(
                error,
                StoreError::NotFinite { .. } | StoreError::BadCost { .. }
            );
            assert!(is_typed, "{error}");
        }
    }
    // Nothing was written, and no number was used.
    assert_eq!(log.append(0.0, Note::new("on")).unwrap().sequence, 1);
    assert_eq!(store.read().unwrap().records.len(), 2);
}

#[test]
fn extreme_numbers_come_back() {
    let (_folder, store) = store();
    let mut log = writer(&store, "a");
    let trial = log
        .append(f64::MAX, Note::new("at the end of time"))
        .unwrap();
    let reals = [
        f64::MAX,
        f64::MIN,
        f64::MIN_POSITIVE,
        5e-324,
        -0.0,
        0.1 + 0.2,
        1e22,
        1.0,
    ];
    let mut outcome = TrialOutcome::new(trial, Outcome::Done { cost: f64::MAX });
    for (index, real) in reals.iter().enumerate() {
        outcome = outcome.with_measure(&index.to_string(), *real);
    }
    let integers = serde_json::json!([u64::MAX, i64::MIN, i64::MAX, 9007199254740993u64]);
    let mut facts = Facts::new();
    for (index, integer) in [i64::MIN, i64::MAX, 0].into_iter().enumerate() {
        facts.insert(index.to_string(), Fact::from(integer));
    }
    let bodies: [Body; 3] = [
        outcome.into(),
        State::new("integers", integers).into(),
        Machine::new(facts).into(),
    ];
    for body in &bodies {
        log.append(-1e300, body.clone()).unwrap();
    }
    let records = store.read().unwrap().records;
    let read: Vec<_> = records
        .iter()
        .skip(1)
        .map(|entry| entry.body().clone())
        .collect();
    assert_eq!(read, bodies);
    assert_eq!(records.iter().next().unwrap().time(), f64::MAX);
    let Body::Outcome(outcome) = &read[0] else {
        panic!("an outcome was written");
    };
    for (index, real) in reals.iter().enumerate() {
        assert_eq!(
            outcome.measures[&index.to_string()].to_bits(),
            real.to_bits()
        );
    }
}

#[test]
fn what_would_not_come_back_is_refused() {
    let (_folder, store) = store();
    let mut log = writer(&store, "a");
    for name in ["writer", "time", "text"] {
        let mut note = Note::new("a");
        note.extra.insert(name.to_owned(), "b".into());
        let refused = log.append(0.0, note);
        assert!(
            matches!(refused, Err(StoreError::NotRepresentable)),
            "{name}"
        );
    }
    let mut deep = serde_json::Value::Null;
    for _ in 0..200 {
        deep = vec![deep].into();
    }
    let refused = log.append(0.0, State::new("deep", deep));
    assert!(matches!(refused, Err(StoreError::NotRepresentable)));
    let refused = log.append(0.0, Note::new(&"x".repeat(MAX_PAYLOAD_BYTES)));
    assert!(matches!(refused, Err(StoreError::TooLong { .. })));
    assert!(store.read().unwrap().records.is_empty());
}

#[test]
fn numbers_go_on_from_writer_to_writer() {
    let (_folder, store) = store();
    let every = SyncPolicy::Every(NonZeroU32::new(3).unwrap());
    let policies = [SyncPolicy::EachRecord, every, SyncPolicy::OnClose];
    for (index, policy) in policies.into_iter().enumerate() {
        let mut log = store.writer(&id("a"), policy).unwrap();
        assert!(log.recovered().is_empty());
        fill(&mut log, 1);
        log.close().unwrap();
        assert_eq!(store.read().unwrap().records.len(), 7 * (index + 1));
    }
    let records = store.read().unwrap().records;
    let numbers = records.iter().map(|entry| entry.stamp().sequence);
    assert!(numbers.eq(0..21));
}

#[test]
fn kinds_of_other_programs_are_carried() {
    let (_folder, store) = store();
    let mut log = writer(&store, "a");
    let fields = Fields::from_iter([("colour".to_owned(), "red".into())]);
    let body = Body::Other { kind: 1000, fields };
    let stamp = log.append(0.0, body.clone()).unwrap();
    assert_eq!(
        store.read().unwrap().records.get(&stamp).unwrap().body(),
        &body
    );
}
