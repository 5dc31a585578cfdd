//! Trees over the procedural sets are Embree's, to the last bit. All scenes too:
//! `cargo run --release -p raywright-validation -- trees`.

use std::path::{Path, PathBuf};

use raywright_validation::{
    TriangleSet,
    golden::{self, DebugTree, Fnv, GoldenQuality, Line, Outcome, Steps, procedural, read_lines},
};

/// The golden files beside the checkout; says so if there are none.
fn folder() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/golden/trees");
    let found = folder.is_dir();
    if !found {
        eprintln!("skipped: no golden trees in {}", folder.display());
    }
    found.then_some(folder)
}

fn set(name: &str) -> TriangleSet {
    procedural(name).unwrap_or_else(|| panic!("no set is called {name}"))
}

#[test]
fn sets_have_the_vertices_of_the_files() {
    let Some(folder) = folder() else { return };
    let steps: Vec<Steps> = read_lines(&folder.join("debug_steps.jsonl")).expect("readable");
    assert_eq!(steps.len(), golden::NAMES.len());
    for step in steps {
        let set = set(&step.set);
        assert_eq!(
            (set.triangles.len(), set.geometries),
            (step.n, step.geometries)
        );
        let first: Vec<f32> = set.triangles[0].iter().flat_map(|v| v.to_array()).collect();
        assert_eq!(first, step.first_triangle, "{}", step.set);
        assert_eq!(
            Fnv::of_vertices(&set.triangles),
            step.vertices_hash,
            "{}",
            step.set
        );
    }
}

#[test]
fn hashes_and_figures_of_written_trees_are_those_of_their_lines() {
    let Some(folder) = folder() else { return };
    let trees: Vec<DebugTree> = read_lines(&folder.join("debug_trees.jsonl")).expect("readable");
    let mut compared = 0;
    for DebugTree { line, tree } in trees {
        let (golden::Expected::Tree(expected), Some(tree)) = (&line.expected, tree) else {
            continue;
        };
        let tree = golden::tree_of_json(&tree);
        let got = golden::Figures::of(&tree, &set(&line.set).bounds(), line.block_size);
        assert_eq!(
            got.differences(expected),
            [""; 0],
            "{} {}",
            line.set,
            line.case
        );
        assert_eq!(got.hash, expected.hash);
        assert_eq!(got.hash_unordered, expected.hash_unordered);
        compared += 1;
    }
    assert!(compared > 20, "{compared}");
}

/// All procedural lines of a quality; the message names the first that differ.
fn all_lines_are_equal(quality: GoldenQuality) {
    let Some(folder) = folder() else { return };
    let lines: Vec<Line> = read_lines(&folder.join("sets.jsonl")).expect("readable");
    let mut workspace = Default::default();
    let mut wrong = Vec::new();
    let mut compared = 0;
    for name in golden::NAMES {
        let set = set(name);
        let primitives = set.primitives();
        let of_set = |line: &&Line| line.set == name && line.quality == quality;
        for line in lines.iter().filter(of_set) {
            compared += 1;
            match golden::compare(line, &set, &primitives, &mut workspace).0 {
                Outcome::Equal => {}
                Outcome::Skipped(why) => eprintln!("skipped: {name}, case {}: {why}", line.case),
                other => wrong.push(format!("{name}, case {}: {other:?}", line.case)),
            }
        }
    }
    assert!(compared > 500, "{compared} lines");
    assert!(
        wrong.is_empty(),
        "{} of {compared} differ, first: {:#?}",
        wrong.len(),
        &wrong[..wrong.len().min(5)]
    );
}

#[test]
fn binned_sah_is_embrees_medium() {
    all_lines_are_equal(GoldenQuality::Medium);
}

#[test]
fn morton_is_embrees_low() {
    all_lines_are_equal(GoldenQuality::Low);
}

#[test]
fn spatial_splits_are_embrees_high() {
    all_lines_are_equal(GoldenQuality::High);
}
