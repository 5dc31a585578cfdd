//! `raywright store` on a store that a program left behind.

#![cfg(feature = "cli")]

use std::{fs, path::Path, process::Command};

use raywright::tuner::{
    Outcome, Param, Space, Value,
    store::{
        Fact, Facts, Machine, Scene, SpaceFacts, Store, SyncPolicy, TrialOpen, TrialOutcome,
        WriterId,
    },
};

/// Exit code and what was printed.
fn store(folder: &Path, args: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_raywright"))
        .arg("store")
        .args(args)
        .current_dir(folder)
        .output()
        .expect("the binary runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    (output.status.code(), text)
}

/// Two outcomes by a writer; the path of its log.
fn fill(folder: &Path, writer: &str) -> std::path::PathBuf {
    let space = Space::new(vec![Param::boolean("steam", "Whether water is thrown in.")]).unwrap();
    let described = SpaceFacts::new(&space);
    let machine = Machine::new(Facts::from([("maker".to_owned(), Fact::from("Hearth"))]));
    let scene = Scene::new(Facts::from([("rye".to_owned(), Fact::from(0.3))]));
    let store = Store::open(folder).unwrap();
    let id = WriterId::new(writer).unwrap();
    let mut log = store.writer(&id, SyncPolicy::OnClose).unwrap();
    log.append(1.0, described.clone()).unwrap();
    log.append(1.0, machine.clone()).unwrap();
    log.append(1.0, scene.clone()).unwrap();
    for steam in [true, false] {
        let config = space.config(&[("steam", Value::Bool(steam))]).unwrap();
        let (space, scene) = (described.id.clone(), scene.id.clone());
        let open = TrialOpen::new(space, machine.id.clone(), scene, &config, "start");
        let trial = log.append(2.0, open).unwrap();
        let cost = if steam { 1.5 } else { 2.5 };
        let outcome = TrialOutcome::new(trial, Outcome::Done { cost });
        log.append(3.0, outcome).unwrap();
    }
    let path = log.path().to_owned();
    log.close().unwrap();
    path
}

#[test]
fn a_store_is_listed_checked_merged_and_exported() {
    let folder = tempfile::tempdir().unwrap();
    let log = fill(&folder.path().join("a"), "first");
    fill(&folder.path().join("b"), "second");
    let at = |args: &[&str]| store(folder.path(), args);

    let (code, text) = at(&["list", "a"]);
    assert_eq!(code, Some(0));
    assert!(
        text.contains("2 done, 0 failed, 0 cancelled, 0 open"),
        "{text}"
    );
    assert_eq!(at(&["fsck", "a"]).0, Some(0));

    assert_eq!(at(&["merge", "all", "a", "b"]).0, Some(0));
    assert_eq!(at(&["merge", "all", "b", "a"]).0, Some(0));
    let (_, text) = at(&["list", "all"]);
    assert!(
        text.contains("2 files") && text.contains("4 done"),
        "{text}"
    );
    let (code, table) = at(&["export", "all"]);
    assert_eq!((code, table.lines().count()), (Some(0), 1 + 4), "{table}");
    assert!(table.contains("2.5"), "{table}");
    let (_, lines) = at(&["export", "all", "--format", "json"]);
    assert_eq!(lines.lines().count(), 14);

    // One byte in the middle: the rest is still there.
    let mut bytes = fs::read(&log).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x20;
    fs::write(&log, bytes).unwrap();
    let (code, text) = at(&["fsck", "a"]);
    assert_eq!(code, Some(1));
    assert!(text.contains("damaged"), "{text}");
    assert_eq!(at(&["compact", "a"]).0, Some(0));
    assert_eq!(at(&["fsck", "a"]).0, Some(0));
}

#[test]
fn what_is_no_store_is_refused_and_not_made() {
    let folder = tempfile::tempdir().unwrap();
    for command in ["list", "best", "fsck", "compact", "export"] {
        assert_eq!(store(folder.path(), &[command, "missing"]).0, Some(2));
    }
    assert_eq!(
        store(folder.path(), &["merge", "new", "missing"]).0,
        Some(2)
    );
    assert!(!folder.path().join("missing").exists() && !folder.path().join("new").exists());
}

/// A short run of `tune`, which must succeed; what it says on standard error.
fn tune(folder: &Path, args: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_raywright"))
        .args(["tune", "interior", "--frames", "4", "--rounds", "1"])
        .args(["--policy", "paper"])
        .args(["--width", "48", "--height", "27", "--store", "memory"])
        .args(args)
        .current_dir(folder)
        .output()
        .expect("the binary runs");
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{errors}");
    errors
}

#[test]
fn a_run_goes_on_from_what_earlier_ones_found() {
    let folder = tempfile::tempdir().unwrap();
    let known = |n: usize| format!("{n} outcomes of earlier runs are known");
    let run = |args: &[&str]| tune(folder.path(), args);
    assert!(!run(&["--portfolio"]).contains("earlier runs"));
    assert!(run(&["--portfolio"]).contains(&known(4)));
    // Another metric of the same times.
    assert!(run(&["--metric", "render"]).contains(&known(8)));
    // Other scenes, settings, fixed parameters and spaces are something else.
    for other in [
        &["--path-length", "2"][..],
        &["-D", "branching_factor=4"],
        &["-D", "accuracy=robust"],
        &["--space", "canonical"],
        &["--fov", "50"],
    ] {
        assert!(!run(other).contains("earlier runs"), "{other:?}");
    }
    let (code, text) = store(folder.path(), &["list", "memory"]);
    assert_eq!(code, Some(0));
    assert!(
        text.contains("8 files") && text.contains("0 open"),
        "{text}"
    );
    assert_eq!(store(folder.path(), &["fsck", "memory"]).0, Some(0));
}

#[test]
fn a_run_on_tiles_remembers_what_it_tried() {
    let folder = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_raywright"))
            .args(["tune", "interior", "--frames", "5", "--rounds", "1"])
            .args(["--width", "64", "--height", "48", "--store", "memory"])
            .args(["--overhead", "1e9"])
            .args(args)
            .current_dir(folder.path())
            .output()
            .expect("the binary runs");
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{errors}");
        errors
    };
    assert!(!run(&[]).contains("earlier runs"));
    // The first frame and four candidates, for whatever metric and whichever policy has the space.
    assert!(run(&["--metric", "render"]).contains("5 outcomes of earlier runs are known"));
    let paper = ["--policy", "paper", "--space", "canonical"];
    assert!(run(&paper).contains("10 outcomes of earlier runs are known"));
    let (code, text) = store(folder.path(), &["best", "memory", "--metric", "render"]);
    assert_eq!(code, Some(0));
    assert!(
        text.contains("interior (64×48") && text.contains("ms over"),
        "{text}"
    );
    let other = ["--policy", "paper"];
    assert!(!run(&other).contains("earlier runs"));
}

#[test]
fn the_paper_s_policy_takes_what_is_predicted_from_other_states() {
    let folder = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| tune(folder.path(), args);
    // Nothing is known: a search.
    assert!(run(&["--predict", "nearest"]).contains("fell on a search"));
    // Another view: its nearest state is that of the first run. Of ten seeds nine take it, on average.
    let view = ["--fov", "50", "--seed", "5"];
    for predictor in ["nearest", "value"] {
        let said = run(&[&view[..], &["--predict", predictor]].concat());
        assert!(
            said.contains("predicted from") || said.contains("fell on a search"),
            "{said}"
        );
    }
    let said: Vec<String> = ["1", "2", "3", "4"]
        .iter()
        .map(|seed| run(&["--fov", "40", "--predict", "nearest", "--seed", seed]))
        .collect();
    assert!(
        said.iter().any(|said| said.contains("predicted from")),
        "{said:?}"
    );
}
