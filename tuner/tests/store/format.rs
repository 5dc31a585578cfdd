//! The bytes: a kept file of every version, and what later versions may add.

use std::fs;
use std::path::Path;

use raywright_tuner::store::{Body, FORMAT_VERSION, LogFile, StoreError, SyncPolicy, kind_name};

use crate::common::{all_of, fill, header, id, machine, put, record, store, writer};

#[test]
fn version_1_is_read() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/store-v1.log");
    let log = LogFile::read(&path).unwrap();
    assert_eq!(log.version, Some(1));
    assert!(log.damage.is_empty());
    let names: Vec<_> = log
        .records
        .iter()
        .map(|r| kind_name(r.kind()).unwrap())
        .collect();
    let expected = [
        "space",
        "machine",
        "scene",
        "state",
        "note",
        "trial-open",
        "outcome",
        "alias",
    ];
    assert_eq!(names, expected);
    let is_known = |body: &Body| !matches!(body, Body::Other { .. });
    assert!(log.entries().all(|entry| is_known(entry.body())));
    let (_folder, store) = store();
    fs::copy(&path, store.log_of(&id("a"))).unwrap();
    let records = store.read().unwrap().records;
    let measured = records.outcomes(&all_of(&machine("one")));
    assert_eq!(measured.len(), 1);
    assert_eq!(measured[0].outcome.measures["build_ms"], 12.5);
}

#[test]
fn todays_files_have_the_documented_form() {
    let (_folder, store) = store();
    let mut log = writer(&store, "a");
    fill(&mut log, 1);
    drop(log);
    let bytes = fs::read(store.log_of(&id("a"))).unwrap();
    let mut expected = header(1);
    for entry in store.read().unwrap().records.iter() {
        assert!(!entry.json().contains('\n'));
        expected.extend(record(entry.kind(), entry.json()));
    }
    assert_eq!(bytes, expected);
}

#[test]
fn later_versions_are_refused_and_left_alone() {
    let (_folder, store) = store();
    let mut bytes = header(FORMAT_VERSION + 1);
    bytes.extend(b"whatever is the form of this");
    let path = put(&store, &bytes);
    let is_newer = |error| matches!(error, StoreError::NewerVersion { version: 2, .. });
    assert!(is_newer(LogFile::read(&path).unwrap_err()));
    assert!(is_newer(
        store.writer(&id("a"), SyncPolicy::OnClose).unwrap_err()
    ));
    fill(&mut writer(&store, "b"), 1);
    store.compact(0.0).unwrap();
    let contents = store.read().unwrap();
    assert_eq!(contents.newer, std::slice::from_ref(&path));
    assert_eq!(contents.records.len(), 7);
    assert_eq!(fs::read(path).unwrap(), bytes);
}

#[test]
fn unknown_kinds_fields_and_forms_are_kept_to_the_byte() {
    let records = [
        record(
            7,
            r#"{"time":2.50,"text":"t","tone" : [1, 2.0],"writer":"a","sequence":0}"#,
        ),
        record(77, r#"{ "sequence":1,"writer":"a","time":3,"x":{"y":1e2}}"#),
        // A known kind in a form that is not known.
        record(
            6,
            r#"{"sequence":2,"writer":"a","time":3,"outcome":{"censored":{"above":1.0}}}"#,
        ),
        // Not stamped at all.
        record(78, r#"{"x":1}"#),
        record(79, "no JSON"),
    ];
    let (_folder, store) = store();
    let mut bytes = header(1);
    bytes.extend(records.concat());
    let path = put(
        &store,
        &[&header(1)[..], b"damage", &records.concat()].concat(),
    );
    let contents = store.read().unwrap();
    assert_eq!(contents.files[0].unknown, 2);
    assert_eq!(contents.files[0].unstamped, 2);
    let bodies: Vec<_> = contents
        .records
        .iter()
        .map(|entry| entry.body().clone())
        .collect();
    let Body::Note(note) = &bodies[0] else {
        panic!("kind 7 is a note");
    };
    assert_eq!(note.extra["tone"], serde_json::json!([1, 2.0]));
    assert!(matches!(&bodies[1], Body::Other { kind: 77, fields } if fields["x"]["y"] == 100.0));
    assert!(matches!(bodies[2], Body::Other { kind: 6, .. }));

    store.compact(0.0).unwrap();
    assert_eq!(fs::read(&path).unwrap(), bytes);
    let (_other, other) = crate::common::store();
    other.import(&contents.records).unwrap();
    let imported = fs::read(other.log_of(&id("a"))).unwrap();
    assert_eq!(imported, [&header(1)[..], &records[..3].concat()].concat());
    assert_eq!(other.read().unwrap().records, contents.records);

    // Fields of a later version survive being written again.
    let stamp = writer(&store, "a").append(0.0, bodies[0].clone()).unwrap();
    let again = store.read().unwrap().records;
    assert_eq!(again.get(&stamp).unwrap().body(), &bodies[0]);
    assert_eq!(stamp.sequence, 3);
}

#[test]
fn the_last_sequence_number_ends_a_log() {
    let (_folder, store) = store();
    let json = format!(
        r#"{{"sequence":{},"writer":"a","time":0,"text":""}}"#,
        u64::MAX
    );
    put(&store, &[header(1), record(7, &json)].concat());
    let refused = writer(&store, "a").append(0.0, raywright_tuner::store::Note::new("on"));
    assert!(matches!(refused, Err(StoreError::SequenceExhausted { .. })));
}

/// Writes the kept file of the current version. Run it by name once per version, never to make a
/// failing test pass.
#[test]
#[ignore = "writes a fixture"]
fn write_fixture() {
    let (_folder, store) = store();
    let mut log = writer(&store, "a");
    fill(&mut log, 1);
    let (one, two) = (machine("one").id, machine("two").id);
    log.append(
        1.5e9,
        raywright_tuner::store::Alias::of_machines(&one, &two),
    )
    .unwrap();
    let name = format!("tests/data/store-v{FORMAT_VERSION}.log");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
    fs::copy(store.log_of(&id("a")), path).unwrap();
}
