//! With the settings that Embree uses for its own scenes, the tree has the nodes, leaves, depth
//! and costs that Embree 4.4 reports for the same meshes (one line per scene of
//! `scene_level.jsonl` of the shared data, read off the library's verbose output).

use std::{io::Read, path::Path};

use raywright_bvh::{Accuracy, BuildParams, Bvh, Quality, TriangleMesh, Vec3};

/// All triangles of a file, polygons as fans; degenerate ones too, since Embree keeps them.
fn read(path: &Path) -> Option<TriangleMesh> {
    let mut text = String::new();
    flate2::read::GzDecoder::new(std::fs::File::open(path).ok()?)
        .read_to_string(&mut text)
        .ok()?;
    let (mut vertices, mut triangles) = (vec![], vec![]);
    for line in text.lines() {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let v: Vec<f32> = words.map(|w| w.parse().unwrap()).collect();
                vertices.push(Vec3::from_slice(&v));
            }
            Some("f") => {
                let index = |w: &str| w.split('/').next().unwrap().parse::<u32>().unwrap() - 1;
                let corners: Vec<u32> = words.map(index).collect();
                for k in 2..corners.len() {
                    triangles.push([corners[0], corners[k - 1], corners[k]]);
                }
            }
            _ => {}
        }
    }
    TriangleMesh::new(vertices, triangles).ok()
}

fn scene(name: &str) -> Option<TriangleMesh> {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/scenes");
    let mesh = read(&scenes.join(format!("{name}/{name}.obj.gz")));
    if mesh.is_none() {
        eprintln!("skipped: {name} is not in {}", scenes.display());
    }
    mesh
}

/// Embree's compact scene has 33 bytes per triangle here. Ours keeps a copy of the vertices, where
/// Embree refers to the buffers of the caller.
#[test]
fn compact_leaves_take_little_memory() {
    let Some(mesh) = scene("sponza") else { return };
    for accuracy in [Accuracy::Fast, Accuracy::Robust] {
        let mut params = BuildParams::embree_scene_compact();
        params.accuracy = accuracy;
        let stats = Bvh::build(&[&mesh], &params).unwrap().stats();
        let bytes = stats.bytes as f64 / mesh.triangles().len() as f64;
        assert!(bytes <= 45.0, "{bytes:.1} bytes per triangle");
    }
}

#[test]
fn nodes_leaves_depth_and_cost_are_embrees() {
    let medium = BuildParams::embree_scene_medium();
    let high = BuildParams::embree_scene_high();
    let morton = BuildParams::embree_mesh_morton();
    let mut compact = BuildParams::embree_scene_medium();
    compact.branching_factor = 4;
    let rotated = BuildParams::embree_mesh_morton_compact();
    // Scene, settings, inner nodes, leaves, SAH of nodes, SAH of blocks, fill, depth.
    let expected = [
        ("sponza", medium, 15_053, 63_191, 13.810, 9.092, 0.650, 13),
        ("sponza", compact, 23_278, 58_017, 21.603, 9.674, 0.873, 18),
        ("sponza", high, 16_658, 70_523, 11.683, 9.052, 0.654, 12),
        ("sponza", morton, 27_953, 89_874, 22.818, 9.241, 0.527, 9),
        ("sponza", rotated, 42_520, 89_874, 27.972, 9.241, 0.778, 17),
        (
            "sponza_dabrovic",
            rotated,
            10_883,
            24_145,
            28.883,
            8.300,
            0.8046,
            15,
        ),
        (
            "sponza_dabrovic",
            medium,
            3_953,
            16_710,
            13.387,
            8.094,
            0.653,
            10,
        ),
        (
            "sponza_dabrovic",
            high,
            4_487,
            19_022,
            10.952,
            7.211,
            0.655,
            10,
        ),
        (
            "fireplace_room",
            medium,
            9_008,
            35_058,
            8.683,
            3.865,
            0.6115,
            11,
        ),
        (
            "fireplace_room",
            high,
            10_031,
            39_527,
            7.989,
            3.738,
            0.618,
            11,
        ),
    ];
    for (name, params, nodes, leaves, sah_nodes, sah_blocks, fill, depth) in expected {
        let Some(mesh) = scene(name) else { continue };
        let stats = Bvh::build(&[&mesh], &params).unwrap().stats();
        assert_eq!(
            (stats.nodes, stats.leaves, stats.depth),
            (nodes, leaves, depth),
            "{name}: {stats:?}"
        );
        if params.quality != Quality::SpatialSplits {
            assert_eq!(stats.references, mesh.triangles().len());
        }
        assert!(
            (stats.sah_nodes - sah_nodes).abs() < 5.1e-4,
            "{name}: {}",
            stats.sah_nodes
        );
        assert!(
            (stats.sah_blocks - sah_blocks).abs() < 5.1e-4,
            "{name}: {}",
            stats.sah_blocks
        );
        assert!(
            (stats.node_fill - fill).abs() < 5.1e-4,
            "{name}: {}",
            stats.node_fill
        );
    }
}
