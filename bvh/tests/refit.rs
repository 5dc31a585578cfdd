//! A refitted tree gives the hits of a tree that is built anew, to the last bit: T28 of
//! `design/robustness.md`, for every built quality, width, leaf format and accuracy.

mod common;

use common::{and_variants, bits, built_qualities, random_rays, sphere};
use proptest::prelude::*;
use raywright_bvh::{
    Accuracy, BuildError, BuildParams, Bvh, Collapse, LeafFormat, MeshError, Quality, Ray,
    RefitError, TriangleMesh, Vec3, Work, reference,
};

/// Parameters of every built quality × width × leaf format × accuracy.
fn all_params() -> Vec<BuildParams> {
    let mut all = Vec::new();
    for quality in built_qualities() {
        for branching_factor in [2, 3, 4, 8, 16] {
            for leaf_format in [LeafFormat::Edges, LeafFormat::Compact] {
                for accuracy in [Accuracy::Fast, Accuracy::Robust] {
                    let mut params = BuildParams::default();
                    params.quality = quality;
                    params.branching_factor = branching_factor;
                    params.leaf_format = leaf_format;
                    params.accuracy = accuracy;
                    params.split_budget = 2.0;
                    all.push(params);
                }
            }
        }
    }
    and_variants(all)
}

fn moved(mesh: &TriangleMesh, map: impl Fn(Vec3) -> Vec3) -> TriangleMesh {
    let vertices = mesh.vertices().iter().map(|&v| map(v)).collect();
    TriangleMesh::new(vertices, mesh.triangles().to_vec()).unwrap()
}

/// 100 frames of a sphere that grows by a factor of 2¹⁰ and back, twists, is pressed flat (frames
/// 30 to 39), into a point (60 to 69), and returns to its first shape at the end.
fn frame(mesh: &TriangleMesh, number: usize) -> TriangleMesh {
    let phase = number as f32 / 99.0;
    let size = 2f32.powf(10.0 * (phase * std::f32::consts::PI).sin());
    moved(mesh, |v| match number {
        30..=39 => Vec3::new(v.x, v.y, 0.25) * size,
        60..=69 => Vec3::new(3.0, -2.0, 1.0),
        99 => v,
        _ => {
            let (sin, cos) = (6.0 * phase * v.z).sin_cos();
            Vec3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z) * size
        }
    })
}

#[test]
fn a_hundred_frames_with_collapse_to_a_plane_and_a_point() {
    let first = sphere(8);
    let still = moved(&sphere(5), |v| v * 0.5 + Vec3::new(0.5, 0.0, 0.0));
    let frames: Vec<_> = (0..100).map(|number| frame(&first, number)).collect();
    let all_rays: Vec<Vec<Ray>> = frames
        .iter()
        .zip(1..)
        .map(|(frame, seed)| random_rays(&[frame, &still], 24, seed))
        .collect();
    let mut expected = Vec::new();
    for accuracy in [Accuracy::Fast, Accuracy::Robust] {
        for (frame, rays) in frames.iter().zip(&all_rays) {
            let meshes = [frame, &still];
            let hits = rays
                .iter()
                .map(|ray| bits(reference::closest_hit(&meshes, ray, accuracy).unwrap()));
            expected.push(hits.collect::<Vec<_>>());
        }
    }
    let hits = expected.iter().flatten().flatten().count();
    assert!(hits > 1000, "{hits} hits say little");
    for params in all_params() {
        let mut tree = Bvh::build(&[&first, &still], &params).unwrap();
        let built = tree.stats();
        let first_frame = 100 * usize::from(params.accuracy == Accuracy::Robust);
        let mut cost = built.sah_cost;
        for (number, (frame, rays)) in frames.iter().zip(&all_rays).enumerate() {
            let refit = tree.refit(&[frame, &still]).unwrap();
            let stats = tree.stats();
            assert_eq!(refit.sah_cost_built, built.sah_cost);
            assert_eq!(refit.sah_cost_before, cost);
            assert_eq!(refit.sah_cost_after, stats.sah_cost);
            cost = refit.sah_cost_after;
            // What the build decided stays.
            assert_eq!(stats.leaf_sizes, built.leaf_sizes);
            assert_eq!((stats.nodes, stats.depth), (built.nodes, built.depth));
            for (ray, &hit) in rays.iter().zip(&expected[first_frame + number]) {
                assert_eq!(
                    bits(tree.closest_hit(ray)),
                    hit,
                    "frame {number} {params:?}"
                );
                assert_eq!(
                    tree.any_hit(ray),
                    hit.is_some(),
                    "frame {number} {params:?}"
                );
            }
            if number % 25 == 24 {
                let fresh = Bvh::build(&[frame, &still], &params).unwrap();
                assert_eq!(tree.bounds(), fresh.bounds());
                for ray in rays {
                    assert_eq!(bits(tree.closest_hit(ray)), bits(fresh.closest_hit(ray)));
                }
            }
        }
        // Back in its first shape, a tree without cuts is the one that was built, but for the order
        // of children of equal area.
        let drift = tree.stats().sah_cost / built.sah_cost;
        if matches!(params.quality, Quality::SpatialSplits | Quality::Optimized) {
            assert!(drift >= 1.0 - 1e-12, "{params:?}");
        } else {
            assert!((drift - 1.0).abs() < 1e-12, "{params:?}");
        }
    }
}

#[test]
fn drift_tells_neighbours_that_part_from_those_that_bend() {
    let mesh = sphere(24);
    let mut tree = Bvh::build(&[&mesh], &BuildParams::default()).unwrap();
    let same = tree.refit(&[&mesh]).unwrap().sah_drift();
    assert_eq!(same, 1.0);
    let bent = moved(&mesh, |v| v + 0.1 * (3.0 * v.y).sin() * Vec3::X);
    let bent = tree.refit(&[&bent]).unwrap().sah_drift();
    assert!((0.8..1.25).contains(&bent), "{bent}");
    // Each triangle flies to another place: the boxes of nodes become as large as the scene.
    let corners: Vec<Vec3> = (0..mesh.triangles().len() as u32)
        .flat_map(|id| {
            let hash = id.wrapping_mul(2_654_435_769);
            let offset = [hash >> 24, hash >> 16 & 255, hash >> 8 & 255];
            let offset = Vec3::from(offset.map(|x| x as f32 / 64.0));
            mesh.corners(id).map(|v| v + offset)
        })
        .collect();
    let triangles = (0..mesh.triangles().len() as u32)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    let scattered = TriangleMesh::new(corners, triangles).unwrap();
    let parted = tree.refit(&[&scattered]).unwrap().sah_drift();
    let fresh = Bvh::build(&[&scattered], &BuildParams::default()).unwrap();
    assert!(parted > 3.0, "{parted}");
    assert!(tree.stats().sah_cost > 3.0 * fresh.stats().sah_cost);
}

#[test]
fn slots_and_orders_follow_what_moves() {
    let mesh = sphere(24);
    let turned = moved(&mesh, |v| -v);
    let rays = random_rays(&[&mesh], 500, 9);
    for params in all_params() {
        // Built while all was turned by a point reflection: every order and no area is another.
        let mut tree = Bvh::build(&[&turned], &params).unwrap();
        // Cuts are lost, and agglomeration sees a mirrored mesh with other eyes.
        let differs = tree.stats().duplication > 1.0 || params.quality == Quality::Agglomerative;
        tree.refit(&[&mesh]).unwrap();
        let (mut refitted, mut fresh) = (Work::default(), Work::default());
        let built = Bvh::build(&[&mesh], &params).unwrap();
        for ray in &rays {
            let hit = tree.closest_hit_with_work(ray, &mut refitted);
            assert_eq!(
                bits(hit),
                bits(built.closest_hit_with_work(ray, &mut fresh))
            );
        }
        let ratio = refitted.nodes as f64 / fresh.nodes as f64;
        // Orders that do not follow would cost twice the nodes.
        let limit = if differs { 1.15 } else { 1.05 };
        assert!(ratio < limit, "{ratio} {params:?}");
    }
}

#[test]
fn trees_of_parts_of_triangles_are_refitted_to_whole_ones() {
    // Long triangles across each other: worth a cut.
    let long = |number: u32| {
        let mut random = common::Random(u64::from(number) + 1);
        let (a, b) = (random.vector(), random.vector());
        [a, b, (a + b) * 0.5 + random.vector() * 0.05]
    };
    let vertices: Vec<Vec3> = (0..400).flat_map(long).collect();
    let triangles: Vec<_> = (0..400).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = TriangleMesh::new(vertices, triangles).unwrap();
    let other = moved(&mesh, |v| Vec3::new(v.y, v.z + v.x, -v.x) * 3.0);
    let rays = random_rays(&[&other], 100, 11);
    for mut params in all_params() {
        params.quality = Quality::SpatialSplits;
        let mut tree = Bvh::build(&[&mesh], &params).unwrap();
        // Leaves at least cost bring some parts together again.
        let [duplication, drift] = match params.collapse {
            Collapse::LargestFirst => [1.2, 1.05],
            Collapse::LeastCost => [1.05, 1.01],
        };
        assert!(tree.stats().duplication > duplication, "{params:?}");
        let refit = tree.refit(&[&mesh]).unwrap();
        assert!(
            refit.sah_drift() > drift,
            "parts have smaller boxes: {refit:?}"
        );
        tree.refit(&[&other]).unwrap();
        for ray in &rays {
            let expected = reference::closest_hit(&[&other], ray, params.accuracy).unwrap();
            assert_eq!(bits(tree.closest_hit(ray)), bits(expected), "{params:?}");
        }
    }
}

#[test]
fn on_an_error_the_tree_is_as_before() {
    let (mesh, other) = (sphere(6), sphere(5));
    let rays = random_rays(&[&mesh], 50, 7);
    for params in all_params() {
        let mut tree = Bvh::build(&[&mesh], &params).unwrap();
        let (stats, bounds) = (tree.stats(), tree.bounds());
        let before: Vec<_> = rays.iter().map(|ray| bits(tree.closest_hit(ray))).collect();
        assert_eq!(
            tree.refit(&[&mesh, &mesh]),
            Err(RefitError::MeshCount { given: 2, built: 1 })
        );
        assert_eq!(
            tree.refit(&[]),
            Err(RefitError::MeshCount { given: 0, built: 1 })
        );
        assert_eq!(
            tree.refit(&[&other]),
            Err(RefitError::TriangleCount {
                geometry_id: 0,
                given: other.triangles().len(),
                built: mesh.triangles().len(),
            })
        );
        for factor in [1e32, 1e-32] {
            let error = tree.refit(&[&moved(&mesh, |v| v * factor)]).unwrap_err();
            assert!(
                matches!(error, RefitError::Build(BuildError::CoordinateRange { .. })),
                "{error}"
            );
        }
        assert_eq!((tree.stats(), tree.bounds()), (stats, bounds));
        for (ray, &hit) in rays.iter().zip(&before) {
            assert_eq!(bits(tree.closest_hit(ray)), hit);
        }
    }
}

#[test]
fn a_vertex_that_is_not_a_number_cannot_reach_a_refit() {
    let mesh = sphere(6);
    let mut vertices = mesh.vertices().to_vec();
    vertices[3].y = f32::NAN;
    let error = TriangleMesh::new(vertices, mesh.triangles().to_vec()).unwrap_err();
    assert!(matches!(
        error,
        MeshError::NonFiniteVertex { vertex: 3, .. }
    ));
}

#[test]
fn nothing_and_one_triangle() {
    let empty = TriangleMesh::default();
    let one = |z: f32| {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y].map(|v| v + z * Vec3::Z);
        TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap()
    };
    let ray = Ray::new([0.25, 0.25, 5.0], [0.0, 0.0, -1.0]);
    for params in all_params() {
        let mut tree = Bvh::build(&[&empty, &empty], &params).unwrap();
        assert_eq!(tree.refit(&[&empty, &empty]).unwrap().sah_drift(), 1.0);
        assert_eq!(tree.closest_hit(&ray), None);
        let mut tree = Bvh::build(&[&empty, &one(0.0), &empty], &params).unwrap();
        tree.refit(&[&empty, &one(3.0), &empty]).unwrap();
        let hit = tree.closest_hit(&ray).unwrap();
        assert_eq!((hit.t, hit.geometry_id, hit.primitive_id), (2.0, 1, 0));
    }
}

/// As many triangles as `count` says, of small whole numbers (many meet exactly) or of any.
fn soup(count: usize) -> impl Strategy<Value = TriangleMesh> {
    let vertex = prop_oneof![
        prop::array::uniform3(-2i8..=2).prop_map(|v| Vec3::from(v.map(f32::from))),
        prop::array::uniform3(-2f32..2.0).prop_map(Vec3::from),
        prop::array::uniform3(-2e9f32..2e9).prop_map(Vec3::from),
    ];
    prop::collection::vec(vertex, 3 * count).prop_map(|vertices| {
        let triangles = (0..vertices.len() as u32 / 3)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect();
        TriangleMesh::new(vertices, triangles).unwrap()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_meshes_in_the_place_of_any_others(
        (before, after) in (1usize..60, 0usize..30).prop_flat_map(|(a, b)| {
            let pair = (soup(a), soup(b));
            let other = (soup(a), soup(b));
            (pair, other)
        }),
        seed in 1u64..1_000_000,
    ) {
        let (before, after) = ([&before.0, &before.1], [&after.0, &after.1]);
        let rays = random_rays(&after, 24, seed);
        for params in all_params() {
            let mut tree = Bvh::build(&before, &params).unwrap();
            tree.refit(&after).unwrap();
            for ray in &rays {
                let expected = reference::closest_hit(&after, ray, params.accuracy).unwrap();
                prop_assert_eq!(bits(tree.closest_hit(ray)), bits(expected), "{:?}", params);
                prop_assert_eq!(tree.any_hit(ray), expected.is_some(), "{:?}", params);
            }
        }
    }
}
