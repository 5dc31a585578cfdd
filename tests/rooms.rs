//! Who may import whom: the table of ARCHITECTURE.md, read off the manifests.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

#[test]
fn manifests_follow_the_table_of_rooms() {
    let allowed: BTreeMap<&str, &[&str]> = BTreeMap::from([
        ("bvh", &[][..]),
        ("imaging", &[]),
        ("tracer", &["bvh", "imaging"]),
        ("volume", &["bvh", "imaging"]),
        ("tuner", &[]),
        ("validation", &["bvh", "tracer"]),
    ]);
    for (room, allowed) in allowed {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join(room)
            .join("Cargo.toml");
        let manifest = fs::read_to_string(&path).expect("a manifest");
        for line in manifest
            .lines()
            .filter(|line| line.starts_with("raywright-"))
        {
            let name = line
                .trim_start_matches("raywright-")
                .split([' ', '.', '='])
                .next()
                .expect("a name");
            assert!(allowed.contains(&name), "{room} must not import {name}");
        }
    }
}

#[test]
fn unsafe_code_is_in_two_rooms() {
    for room in ["imaging", "tracer", "volume", "tuner", "benches", "."] {
        let lib = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join(room)
            .join("src/lib.rs");
        let text = fs::read_to_string(&lib).expect("a crate");
        assert!(
            text.contains("#![forbid(unsafe_code)]"),
            "{}",
            lib.display()
        );
    }
    // One module of each of these may use it: lanes, and the foreign functions of Embree.
    for (file, module, others) in [
        ("bvh/src/lib.rs", "pub mod simd;", "bvh/src"),
        ("validation/src/embree/mod.rs", "mod sys;", "validation/src"),
    ] {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let text = fs::read_to_string(root.join(file)).expect("a module");
        assert!(
            text.contains(&format!("#[allow(unsafe_code)]\n{module}")),
            "{file}"
        );
        let lib = fs::read_to_string(root.join(others).join("lib.rs")).expect("a crate");
        assert!(lib.contains("#![deny(unsafe_code)]"), "{others}");
        let allowing: usize = sources(&root.join(others))
            .iter()
            .map(|path| fs::read_to_string(path).expect("a source"))
            .map(|text| text.matches("allow(unsafe_code)").count())
            .sum();
        assert_eq!(allowing, 1, "one room of {others} may use it");
    }
}

/// All Rust files below a folder.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
    found
}
