//! Who may import whom: the table of ARCHITECTURE.md, read off the manifests.

use std::{collections::BTreeMap, fs, path::Path};

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
fn unsafe_code_is_forbidden_outside_the_simd_rooms() {
    for room in [
        "imaging",
        "tracer",
        "volume",
        "tuner",
        "validation",
        "benches",
        ".",
    ] {
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
    let bvh = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("bvh/src/lib.rs"))
        .expect("a crate");
    assert_eq!(
        bvh.matches("allow(unsafe_code)").count(),
        1,
        "one room of bvh may use it"
    );
    assert!(
        bvh.contains("#![deny(unsafe_code)]") && bvh.contains("#[allow(unsafe_code)]\nmod simd;")
    );
}
