//! `raywright study record`: rows that say what they mean, stopped and gone on with; `study gains`: a row for
//! each run, and goals.

#![cfg(feature = "cli")]

use std::{fs, path::Path, process::Command};

/// Exit code and standard error.
fn record(folder: &Path, args: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_raywright"))
        .args(["study", "record", "interior", "--configurations", "12"])
        .args(["--width", "16", "--height", "9", "--repeats", "1"])
        .args(["-o", "table.csv"])
        .args(args)
        .current_dir(folder)
        .output()
        .expect("the binary runs");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code(), text)
}

const CAMERAS: &str = r#"{"scenes": {"interior": {"cameras": [
    {"name": "door", "eye": [1.0, 1.5, 1.0], "target": [0.0, 1.0, 0.0], "up": [0, 1, 0], "fov_y_deg": 60},
    {"name": "corner", "eye": [-1.0, 1.5, 1.0], "target": [0.0, 1.0, 0.0], "up": [0, 1, 0], "fov_y_deg": 40}
]}}}"#;

#[test]
fn a_recording_is_stopped_and_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let at = |args: &[&str]| record(folder.path(), args);
    fs::write(folder.path().join("cameras.json"), CAMERAS).unwrap();
    let cameras = ["--cameras", "cameras.json"];
    assert_eq!(at(&cameras).0, Some(0));
    let path = folder.path().join("table.csv");
    let text = fs::read_to_string(&path).unwrap();
    let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let column = |name: &str| head.iter().position(|own| *own == name).unwrap();
    let rows: Vec<Vec<&str>> = text
        .lines()
        .skip(1)
        .map(|l| l.split(',').collect())
        .collect();
    let mut configurations = std::collections::BTreeSet::new();
    for row in &rows {
        assert_eq!(row.len(), head.len(), "{row:?}");
        configurations.insert(row[column("row")]);
        let number = |name| row[column(name)].parse::<f64>().unwrap();
        assert!(number("ref_build_ms") > 0.0);
        if row[column("fail")] == "0" {
            assert!(["door", "corner"].contains(&row[column("cam")]));
            assert!(number("ref_ms") > 0.0 && number("build_ms") > 0.0 && number("nodes") >= 1.0);
        } else {
            assert_eq!(row[column("cam")], "");
        }
    }
    assert_eq!(configurations.len(), 12);
    // Complete: nothing is added. Cut in the middle of a line: the rest comes anew, with the same
    // configurations.
    assert_eq!(at(&cameras).0, Some(0));
    assert_eq!(fs::read_to_string(&path).unwrap(), text);
    fs::write(&path, &text[..text.len() * 2 / 3]).unwrap();
    assert_eq!(at(&cameras).0, Some(0));
    let again = fs::read_to_string(&path).unwrap();
    let shape = |text: &str| -> Vec<String> {
        let end = column("fail");
        let row = |line: &str| line.split(',').take(end).collect::<Vec<_>>().join(",");
        let mut rows: Vec<String> = text.lines().map(row).collect();
        rows.dedup();
        rows
    };
    assert_eq!(shape(&again), shape(&text));

    let (code, text) = at(&["--cameras", "missing.json"]);
    assert_eq!(code, Some(2), "{text}");
    fs::write(
        folder.path().join("other.json"),
        r#"{"scenes": {"attic": {"cameras": []}}}"#,
    )
    .unwrap();
    let (code, text) = at(&["--cameras", "other.json"]);
    assert!(code == Some(2) && text.contains("attic"), "{text}");
    fs::write(&path, "something else\n").unwrap();
    let (code, text) = at(&cameras);
    assert!(code == Some(2) && text.contains("another table"), "{text}");
}

#[test]
fn gains_have_a_row_for_each_run_and_goals() {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_raywright"))
        .args([
            "study", "gains", "interior", "--seeds", "3,4", "--frames", "4",
        ])
        .args(["--rounds", "2", "--width", "40", "--height", "30"])
        .args(["--metrics", "render,total", "--spaces", "eleven,wide"])
        .current_dir(folder.path())
        .output()
        .expect("the binary runs");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}");
    assert!(
        text.contains("goals: ") && text.contains(" of 15 met"),
        "{text}"
    );
    let csv = fs::read_to_string(folder.path().join("gains.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 1 + 2 * 2 * 2);
    assert!(rows.iter().all(|row| row.len() == rows[0].len()));
    for row in &rows[1..] {
        assert_eq!(row[0], "interior");
        let tried: usize = row[4].parse().unwrap();
        // What the first frames took decides whether there is time for trials.
        assert!(tried <= 3);
        assert!(
            row[6..9]
                .iter()
                .all(|ratio| ratio.parse::<f64>().unwrap() > 0.0)
        );
        let is_eleven = row[2] == "eleven";
        assert!(!is_eleven || !row[12].contains("optimized"), "{row:?}");
    }
}
