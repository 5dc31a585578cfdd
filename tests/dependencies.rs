//! What an embedder compiles, and what nobody does: counted in the lock file's own view of the
//! dependency tree.

use std::{collections::BTreeSet, process::Command};

/// Distinct packages of the normal and build dependencies of the root package.
fn packages(features: &[&str]) -> BTreeSet<String> {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args([
        "tree",
        "--offline",
        "--package",
        "raywright",
        "--edges",
        "normal,build",
        "--prefix",
        "none",
    ]);
    cargo.args([
        "--format",
        "{p}",
        "--manifest-path",
        concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"),
    ]);
    cargo.args(features);
    let output = cargo.output().expect("cargo runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = String::from_utf8(output.stdout).expect("names are UTF-8");
    text.lines()
        .filter_map(|line| line.split(' ').next())
        .map(str::to_owned)
        .filter(|name| !name.is_empty())
        .collect()
}

#[test]
fn no_c_or_cpp_in_the_default_tree() {
    let all = packages(&[]);
    for builder in ["cc", "cmake", "bindgen", "pkg-config", "cxx", "vcpkg"] {
        assert!(
            !all.contains(builder),
            "{builder} compiles or finds C: {all:?}"
        );
    }
}

#[test]
fn a_tree_alone_needs_a_handful_of_crates() {
    let tree = packages(&["--no-default-features"]);
    assert!(tree.len() <= 20, "{}: {tree:?}", tree.len());
    for heavy in ["clap", "serde", "image", "exr"] {
        assert!(!tree.contains(heavy), "{heavy}: {tree:?}");
    }
}

#[test]
fn embedding_the_tracer_brings_no_command_line() {
    let tracer = packages(&["--no-default-features", "--features", "tracer,tuner"]);
    for heavy in [
        "clap",
        "indicatif",
        "ctrlc",
        "comfy-table",
        "serde_json",
        "anyhow",
    ] {
        assert!(!tracer.contains(heavy), "{heavy}: {tracer:?}");
    }
}
