//! The examples run to their end and print what they promise. `cargo test` builds them beside the
//! tests; where only this test was built, it says so.

#![cfg(feature = "cli")]

use std::process::Command;

/// Runs an example in an empty folder; what it printed.
fn run(name: &str) -> Option<String> {
    let tests = std::env::current_exe().expect("a path");
    let example = tests.parent()?.parent()?.join("examples").join(name);
    if !example.exists() {
        eprintln!("skipped: {name} was not built");
        return None;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let output = Command::new(example)
        .current_dir(folder.path())
        .output()
        .expect("it runs");
    assert!(
        output.status.success(),
        "{name}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    Some(String::from_utf8(output.stdout).expect("text"))
}

#[test]
fn one_ray() {
    let Some(printed) = run("01_one_ray") else {
        return;
    };
    assert!(
        printed.contains("hit triangle 0 of mesh 0 at t = 3"),
        "{printed}"
    );
    assert!(
        printed.contains("anything nearer than 2.9: false"),
        "{printed}"
    );
}

#[test]
fn a_picture() {
    let Some(printed) = run("03_a_picture") else {
        return;
    };
    assert!(
        printed.contains(&format!("Finished: {} samples", 320 * 240 * 64)),
        "{printed}"
    );
}

#[test]
fn tune_a_build() {
    let Some(printed) = run("05_tune_a_build") else {
        return;
    };
    let costs: Vec<f64> = printed
        .lines()
        .filter_map(|line| line.trim().split(' ').next()?.parse().ok())
        .collect();
    assert!(
        costs.len() > 1 && costs.is_sorted_by(|a, b| a >= b),
        "incumbents only get better: {printed}"
    );
}

#[test]
fn tune_a_sort() {
    let Some(printed) = run("06_tune_a_sort") else {
        return;
    };
    // Merging rows that are sorted already costs little, and insertion sorts short pieces.
    let last = printed.lines().last().unwrap_or_default();
    assert!(
        printed.lines().count() > 1
            && last.contains("merges=true")
            && !last.contains("insertion=1 "),
        "{printed}"
    );
}

#[test]
fn a_volume() {
    let Some(printed) = run("07_a_volume") else {
        return;
    };
    let numbers: Vec<u64> = printed
        .split_whitespace()
        .filter_map(|word| word.parse().ok())
        .collect();
    assert!(
        numbers.len() == 3 && numbers.iter().all(|&n| n > 0) && numbers[1] > numbers[0],
        "{printed}"
    );
}

#[test]
fn tuning_while_one_renders() {
    let Some(printed) = run("08_tune_while_rendering") else {
        return;
    };
    assert!(printed.contains("the camera turns round"), "{printed}");
    assert!(printed.contains("best: Some(BuildParams"), "{printed}");
}

#[test]
fn instances() {
    let Some(printed) = run("09_instances") else {
        return;
    };
    let counts: Vec<u32> = printed
        .split([' ', ',', ';', '\n'])
        .filter_map(|word| word.parse().ok())
        .collect();
    assert!(
        matches!(counts[..], [_, cut, opaque, seen] if 0 < seen && seen < cut && cut < opaque),
        "{printed}"
    );
}
