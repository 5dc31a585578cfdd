//! Whose outcomes are whose, and how they leave the store.

use raywright_tuner::Outcome;
use raywright_tuner::store::{
    Alias, Note, Origin, Others, SpaceFacts, SpaceId, State, TrialOpen, TrialOutcome,
};

use crate::common::{all_of, config, fill, id, machine, scene, space, store, trial, writer};

#[test]
fn other_machines_are_left_out_or_marked() {
    let (_folder, store) = store();
    let (here, there) = (machine("here"), machine("there"));
    let mut log = writer(&store, "a");
    trial(&mut log, &here, &scene("hall"), 1.0);
    trial(&mut log, &there, &scene("hall"), 2.0);
    trial(&mut log, &there, &scene("yard"), 3.0);
    let records = store.read().unwrap().records;

    let facts = records.outcomes(&all_of(&here));
    assert_eq!(facts.len(), 1);
    assert_eq!(facts[0].origin, Origin::Fact);
    assert_eq!(facts[0].outcome.outcome, Outcome::Done { cost: 1.0 });
    assert_eq!(facts[0].trial.config_in(&space()).unwrap(), config(8));

    let with_others = all_of(&here).with_others(Others::AsPrior);
    let origins: Vec<_> = records
        .outcomes(&with_others)
        .iter()
        .map(|m| m.origin)
        .collect();
    assert_eq!(origins, [Origin::Fact, Origin::Prior, Origin::Prior]);
    let of_scene = with_others.with_scene(scene("yard").id);
    assert_eq!(records.outcomes(&of_scene).len(), 1);
    let of_space = all_of(&here).with_space(SpaceId::new("another"));
    assert!(records.outcomes(&of_space).is_empty());

    // An alias makes two machines one, transitively and in both directions.
    let between = machine("between");
    log.append(0.0, Alias::of_machines(&there.id, &between.id))
        .unwrap();
    log.append(0.0, Alias::of_machines(&here.id, &between.id))
        .unwrap();
    log.append(0.0, Alias::of_machines(&between.id, &here.id))
        .unwrap();
    log.append(0.0, Alias::of_scenes(&scene("hall").id, &scene("yard").id))
        .unwrap();
    let records = store.read().unwrap().records;
    let facts = records.outcomes(&all_of(&here).with_scene(scene("hall").id));
    assert_eq!(facts.len(), 3);
    assert!(facts.iter().all(|measured| measured.origin == Origin::Fact));
    assert!(records.outcomes(&all_of(&machine("elsewhere"))).is_empty());
}

#[test]
fn descriptions_and_states_come_back() {
    let (_folder, store) = store();
    let mut log = writer(&store, "a");
    fill(&mut log, 1);
    log.append(2e9, State::new("s", "late".into())).unwrap();
    log.append(1e9, State::new("s", "early".into())).unwrap();
    let records = store.read().unwrap().records;
    let described = records.space(&SpaceFacts::new(&space()).id).unwrap();
    assert_eq!(described.space().unwrap(), space());
    assert_eq!(records.machine(&machine("one").id), Some(&machine("one")));
    assert_eq!(records.scene(&scene("hall").id), Some(&scene("hall")));
    assert_eq!(records.state("s").unwrap().value, "late");
    assert_eq!(records.state("t"), None);
}

#[test]
fn stats_count() {
    let (_folder, store) = store();
    let mut log = writer(&store, "a");
    fill(&mut log, 2);
    let ids = (
        SpaceFacts::new(&space()).id,
        machine("one").id,
        scene("hall").id,
    );
    let open = TrialOpen::new(ids.0, ids.1.clone(), ids.2, &config(2), "why");
    let failed = log.append(0.0, open.clone()).unwrap();
    log.append(0.0, open).unwrap();
    let reason = "no memory".to_owned();
    log.append(
        0.0,
        TrialOutcome::new(failed.clone(), Outcome::Failed { reason }),
    )
    .unwrap();
    let mut nowhere = failed;
    nowhere.sequence = 999;
    log.append(0.0, TrialOutcome::new(nowhere, Outcome::Cancelled))
        .unwrap();
    let stats = store.read().unwrap().records.stats();
    assert_eq!((stats.done, stats.failed, stats.cancelled), (2, 1, 0));
    assert_eq!((stats.open, stats.orphans, stats.conflicts), (1, 1, 0));
    assert_eq!(
        stats.by_machine.into_iter().collect::<Vec<_>>(),
        [(ids.1, 3)]
    );
    assert_eq!(
        stats.by_writer.into_iter().collect::<Vec<_>>(),
        [(id("a"), 13)]
    );
    assert_eq!(stats.by_kind[&5], 4);
}

#[test]
fn export_is_a_table_and_lines() {
    let (_folder, store) = store();
    let mut log = writer(&store, "a");
    trial(&mut log, &machine("one"), &scene("hall"), 1.0 / 3.0);
    let ids = (
        SpaceFacts::new(&space()).id,
        machine("one").id,
        scene("hall").id,
    );
    let open = TrialOpen::new(ids.0, ids.1, ids.2, &config(2), "a, \"b\"");
    let failed = log.append(0.0, open).unwrap();
    let reason = "two\nlines".to_owned();
    log.append(0.0, TrialOutcome::new(failed, Outcome::Failed { reason }))
        .unwrap();
    log.append(0.0, Note::new("end")).unwrap();
    let records = store.read().unwrap().records;

    let mut csv = Vec::new();
    records.write_csv(&mut csv).unwrap();
    let csv = String::from_utf8(csv).unwrap();
    let lines: Vec<_> = csv.lines().collect();
    assert!(
        lines[0].ends_with(
            "outcome,cost,failure,config.alpha,config.bins,config.rotate,measure.build_ms"
        )
    );
    assert!(lines[1].starts_with("a,1,1500000001,a,0,"));
    assert!(lines[1].ends_with("test,done,0.3333333333333333,,0.00125,8,true,12.5"));
    assert!(lines[2].ends_with("\"a, \"\"b\"\"\",failed,,\"two"));
    assert_eq!(lines[3], "lines\",0.00125,2,true,");

    let mut json = Vec::new();
    records.write_json_lines(&mut json).unwrap();
    let json = String::from_utf8(json).unwrap();
    let parsed = json
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    let names: Vec<_> = parsed
        .map(|line| line["name"].as_str().unwrap().to_owned())
        .collect();
    assert_eq!(
        names,
        ["trial-open", "outcome", "trial-open", "outcome", "note"]
    );
}

#[test]
fn the_best_has_the_least_mean_and_no_failure() {
    let (_folder, store) = store();
    let (here, there) = (machine("here"), machine("there"));
    let mut log = writer(&store, "a");
    let mut told = |machine, size, outcome: Outcome| {
        let (own_space, own_scene) = (SpaceFacts::new(&space()).id, scene("hall").id);
        let open = TrialOpen::new(own_space, machine, own_scene, &config(size), "test");
        let stamp = log.append(0.0, open).unwrap();
        log.append(1.0, TrialOutcome::new(stamp, outcome)).unwrap();
    };
    let done = |cost| Outcome::Done { cost };
    let failed = || Outcome::Failed {
        reason: "too deep".into(),
    };
    for (size, outcome) in [
        (2, done(1.0)),
        (2, done(4.0)),
        (4, done(2.0)),
        (6, done(0.5)),
        (6, failed()),
        (8, Outcome::Cancelled),
    ] {
        told(here.id.clone(), size, outcome);
    }
    told(there.id.clone(), 8, done(9.0));
    let cost = |outcome: &TrialOutcome| match outcome.outcome {
        Outcome::Done { cost } => Some(cost),
        _ => None,
    };
    let mut best = store.read().unwrap().records.best(cost);
    best.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    assert_eq!(best.len(), 2);
    let size = |index: usize| best[index].config["bins"].to_string();
    assert_eq!(
        (best[0].machine.clone(), best[0].cost, best[0].n, best[0].of),
        (here.id, 2.0, 1, 3)
    );
    assert_eq!((size(0), size(1)), ("4".into(), "8".into()));
    assert_eq!((best[1].machine.clone(), best[1].cost), (there.id, 9.0));
    let nothing = store.read().unwrap().records.best(|_| None);
    assert!(nothing.is_empty());
}
