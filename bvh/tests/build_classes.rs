//! Inputs that break builders: classes T15 to T18, T21, T24 and T26 of `design/robustness.md` (T28 is
//! in `refit.rs`), for every quality that is built and every width that has a kernel.

mod common;

use common::{
    and_variants, bits, built_qualities, contents, pool, primitives, random_rays, sphere,
};
use raywright_bvh::{
    Accuracy, BuildError, BuildParams, BuildWorkspace, Bvh, Corners, Hierarchy, LeafReference,
    MeshError, ParameterFault, Quality, Ray, TriangleMesh, Vec3, reference,
};

const WIDTHS: [u32; 4] = [2, 4, 8, 16];

/// Every built quality × width; Morton order with and without rotations, binned ones collapsed in both ways.
fn all_params() -> Vec<BuildParams> {
    let qualities = built_qualities();
    let pairs = qualities
        .iter()
        .flat_map(|&q| WIDTHS.map(|width| (q, width)));
    let all = pairs
        .map(|(quality, width)| {
            let mut params = BuildParams::default();
            params.quality = quality;
            params.branching_factor = width;
            params.max_depth = 64;
            params.split_budget = 1.5;
            params
        })
        .collect();
    and_variants(all)
}

/// Leaves of one primitive: the deepest tree.
fn deepest(mut params: BuildParams) -> BuildParams {
    (params.min_leaf_size, params.max_leaf_size) = (1, 1);
    params
}

fn soup(triangles: &[[Vec3; 3]]) -> TriangleMesh {
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    TriangleMesh::new(triangles.concat(), indices.collect()).unwrap()
}

/// Builds with both accuracies and compares with testing every triangle; gives the hits.
fn check(meshes: &[&TriangleMesh], params: &BuildParams, rays: &[Ray]) -> usize {
    let mut hits = 0;
    for accuracy in [Accuracy::Fast, Accuracy::Robust] {
        let mut params = *params;
        params.accuracy = accuracy;
        let tree = Bvh::build(meshes, &params).unwrap_or_else(|e| panic!("{e}: {params:?}"));
        assert!(tree.stats().depth <= params.max_depth as usize);
        for ray in rays {
            let expected = reference::closest_hit(meshes, ray, accuracy).unwrap();
            assert_eq!(
                bits(tree.closest_hit(ray)),
                bits(expected),
                "{params:?} {ray:?}"
            );
            assert_eq!(tree.any_hit(ray), expected.is_some(), "{params:?} {ray:?}");
            hits += usize::from(expected.is_some());
        }
    }
    hits
}

/// Triangles without area, from corners in small eighths so that their area is exactly 0 before and
/// after scaling: points, lines of two corners in each order, and three corners on a line.
fn degenerate(count: usize) -> Vec<[Vec3; 3]> {
    let mut random = common::Random(15);
    (0..count)
        .map(|number| {
            let a = (random.vector() * 4.0).round() / 8.0;
            let d = (random.vector() * 4.0).round() / 16.0 + Vec3::X * 0.5;
            let b = a + d;
            match number % 5 {
                0 => [a, a, a],
                1 => [a, a, b],
                2 => [a, b, a],
                3 => [b, a, a],
                _ => [a, a + d * 0.5, b],
            }
        })
        .collect()
}

#[test]
fn t15_triangles_without_area_are_hit_by_the_robust_test_on_a_line_at_most() {
    let triangles = degenerate(500);
    let mesh = soup(&triangles);
    let repeated: Vec<_> = (triangles.iter().enumerate())
        .filter(|(number, _)| number % 5 != 4)
        .map(|(_, &triangle)| triangle)
        .collect();
    let repeated = soup(&repeated);
    // At corners and middles of the lines, from all sides, and along them.
    let mut random = common::Random(3);
    let mut rays = Vec::new();
    for [a, b, c] in triangles.iter().step_by(3) {
        for target in [*a, *b, *c, (*a + *b) * 0.5] {
            let direction = random.vector();
            rays.push(Ray::new(target - direction, direction));
            rays.push(Ray::new(target - Vec3::Z, Vec3::Z));
        }
        rays.push(Ray::new(*a - (*c - *a), *c - *a));
    }
    for params in all_params() {
        assert_eq!(check(&[&repeated], &params, &rays), 0, "{params:?}");
        // Seen by a rounded ray, three corners on a line are a triangle as thin as rounding, without
        // which its neighbours would leave a gap: watertightness wants such a hit.
        check(&[&mesh], &params, &rays);
        let mut fast = params;
        fast.accuracy = Accuracy::Fast;
        let tree = Bvh::build(&[&mesh], &fast).unwrap();
        assert!(!rays.iter().any(|ray| tree.any_hit(ray)), "{params:?}");
        let mut robust = params;
        robust.accuracy = Accuracy::Robust;
        let robust = Bvh::build(&[&mesh], &robust).unwrap();
        for hit in rays
            .iter()
            .filter_map(|ray| Some((ray, robust.closest_hit(ray)?)))
        {
            let (ray, hit) = hit;
            assert_eq!(hit.primitive_id % 5, 4, "{ray:?}");
            // Weights are quotients of rounding errors: all that is sure is the triangle's box.
            let corners = mesh.corners(hit.primitive_id);
            let at = ray.origin + ray.direction * hit.t;
            let [low, high] = [corners[0].min(corners[2]), corners[0].max(corners[2])];
            let inside = at.cmpge(low - 1e-5).all() && at.cmple(high + 1e-5).all();
            assert!(inside, "{at} is not in the box of {corners:?}: {ray:?}");
        }
    }
}

#[test]
fn t15_every_second_triangle_without_area_changes_no_hit() {
    let whole = sphere(8);
    let count = whole.triangles().len();
    let corners: Vec<_> = (0..count as u32).map(|id| whole.corners(id)).collect();
    let mixed: Vec<_> = corners
        .iter()
        .zip(degenerate(count))
        .flat_map(|(&triangle, flat)| [triangle, flat])
        .collect();
    // Area so small that it is subnormal, inside the sphere, where rays end before it.
    let tiny = 1e-22;
    let subnormal = soup(&[[Vec3::ZERO, Vec3::X * tiny, Vec3::Y * tiny]; 40]);
    let (plain, mixed) = (soup(&corners), soup(&mixed));
    let rays = random_rays(&[&plain], 100, 15);
    for params in all_params() {
        assert!(check(&[&mixed, &subnormal], &params, &rays) > 100);
        let alone = Bvh::build(&[&plain], &params).unwrap();
        let tree = Bvh::build(&[&mixed, &subnormal], &params).unwrap();
        for ray in &rays {
            let expected = alone.closest_hit(ray).map(|mut hit| {
                hit.primitive_id *= 2;
                hit
            });
            assert_eq!(
                bits(tree.closest_hit(ray)),
                bits(expected),
                "{params:?} {ray:?}"
            );
        }
    }
}

#[test]
fn t16_bad_coordinates_name_what_has_them() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    for coordinate in 0..9 {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut vertices = [corners, corners, corners].concat();
            vertices[3 + coordinate / 3][coordinate % 3] = bad;
            let triangles = vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]];
            let error = TriangleMesh::new(vertices, triangles).unwrap_err();
            assert_eq!(
                error,
                MeshError::NonFiniteVertex {
                    triangle: 1,
                    vertex: 3 + coordinate as u32 / 3,
                }
            );
        }
        // Finite, but beyond what the tests can multiply.
        for bad in [f32::MAX, f32::MIN, 2f32.powi(101), -(2f32.powi(101))] {
            let mut vertices = corners;
            vertices[coordinate / 3][coordinate % 3] = bad;
            let mesh = soup(&[corners, vertices]);
            for params in all_params() {
                let Err(BuildError::CoordinateRange { largest, max, .. }) =
                    Bvh::build(&[&mesh], &params)
                else {
                    panic!("{bad} is in range for {params:?}");
                };
                assert_eq!((largest, max), (bad.abs(), 2f32.powi(100)));
            }
        }
    }
}

#[test]
fn t17_identical_triangles_are_hit_at_the_lowest_id() {
    let triangle = [
        -Vec3::ONE,
        Vec3::new(2.0, -1.0, -1.0),
        Vec3::new(-1.0, 2.0, -1.0),
    ];
    let ray = Ray::new([-0.5, -0.5, 3.0], [0.0, 0.0, -1.0]);
    for count in [1, 2, 3, 64, 10_000] {
        let mesh = soup(&vec![triangle; count]);
        for params in all_params() {
            for accuracy in [Accuracy::Fast, Accuracy::Robust] {
                let mut params = params;
                params.accuracy = accuracy;
                let tree = Bvh::build(&[&mesh], &params).unwrap();
                let hit = tree.closest_hit(&ray).unwrap();
                assert_eq!((hit.t, hit.primitive_id), (4.0, 0), "{count} {params:?}");
                let stats = tree.stats();
                assert!(stats.depth <= 64 && stats.references >= count);
                assert!(stats.largest_leaf <= params.max_leaf_size as usize);
            }
        }
    }
}

#[test]
fn t17_a_million_identical_triangles() {
    let mesh = TriangleMesh::new(
        vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        vec![[0, 1, 2]; 1_000_000],
    )
    .unwrap();
    for quality in [Quality::Morton, Quality::BinnedSah] {
        let mut params = BuildParams::default();
        params.quality = quality;
        let tree = Bvh::build(&[&mesh], &params).unwrap();
        let hit = tree.closest_hit(&Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0]));
        assert_eq!(hit.unwrap().primitive_id, 0);
        let stats = tree.stats();
        assert_eq!((stats.references, stats.duplication), (1_000_000, 1.0));
        assert!(stats.depth <= 40, "{}", stats.depth);
    }
}

#[test]
fn t17_one_centre_and_sizes_of_twenty_octaves() {
    let triangles: Vec<_> = (0..10_000)
        .map(|number| {
            // Boxes around the origin whose centre it is, each 0.002 octaves larger.
            let size = 2f32.powf(number as f32 / 500.0);
            [
                Vec3::new(-size, -size, 0.0),
                Vec3::new(size, -size, 0.0),
                Vec3::new(0.0, size, 0.0),
            ]
        })
        .collect();
    let mesh = soup(&triangles);
    let mut rays = vec![
        Ray::new([0.0, 0.0, 1.0], [0.0, 0.0, -1.0]),
        Ray::new([0.0, -0.5, 1e6], [0.0, 0.0, -1.0]),
        Ray::new([2e5, 3e5, -1e6], [0.1, -0.3, 1.0]),
        Ray::new([0.5, 0.0, 0.0], [1.0, 0.0, 0.0]),
    ];
    rays.extend(random_rays(&[&mesh], 6, 17));
    for params in all_params() {
        assert!(check(&[&mesh], &params, &rays) > 4);
        let tree = Bvh::build(&[&mesh], &params).unwrap();
        assert_eq!(tree.closest_hit(&rays[0]).unwrap().primitive_id, 0);
    }
}

/// Triangles of size `ratio^i` at distance `ratio^i` along the diagonal.
fn series(ratio: f32, count: i32) -> TriangleMesh {
    let triangles: Vec<_> = (0..count)
        .map(|number| {
            let size = ratio.powi(number);
            let at = Vec3::splat(size);
            [at, at + Vec3::X * size * 0.25, at + Vec3::Y * size * 0.25]
        })
        .collect();
    soup(&triangles)
}

/// Clusters within clusters: each level has `count` triangles about its centre, and the next level
/// lies within a cell of its Morton grid.
fn nested_clusters(levels: i32, count: u32) -> TriangleMesh {
    let mut random = common::Random(18);
    let mut triangles = Vec::new();
    for level in 0..levels {
        let size = 2f32.powi(-11 * level);
        for _ in 0..count {
            let at = random.vector() * size;
            let edges = [random.vector(), random.vector()].map(|v| v * size * 0.01);
            triangles.push([at, at + edges[0], at + edges[1]]);
        }
    }
    soup(&triangles)
}

fn deep_meshes() -> Vec<(&'static str, TriangleMesh)> {
    let diagonal: Vec<_> = (0..2000)
        .map(|number| {
            let at = Vec3::splat(number as f32);
            [at, at + Vec3::X, at + Vec3::Y]
        })
        .collect();
    vec![
        ("series of 0.5", series(0.5, 90)),
        ("series of 0.9", series(0.9, 800)),
        ("series of 1.6", series(1.6, 110)),
        ("sorted diagonal", soup(&diagonal)),
        ("nested clusters", nested_clusters(8, 64)),
    ]
}

#[test]
fn t18_deep_trees_keep_the_limit_and_the_hits() {
    for (name, mesh) in deep_meshes() {
        let rays = random_rays(&[&mesh], 40, 18);
        let mut deepest_level = 0;
        for params in all_params() {
            assert!(check(&[&mesh], &params, &rays) > 20, "{name}");
            let params = deepest(params);
            let tree = Bvh::build(&[&mesh], &params).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert!(check(&[&mesh], &params, &rays) > 20, "{name}");
            deepest_level = deepest_level.max(tree.stats().depth);
        }
        assert!(deepest_level > 8, "{name} is not deep: {deepest_level}");
    }
}

#[test]
fn t18_any_number_of_triangles_below_the_limit_can_be_built() {
    // 55 triangles in each of 90 places that come nearer to each other by halves.
    let triangles: Vec<_> = (0..5000)
        .map(|number| {
            let size = 0.5f32.powi(number % 90);
            let at = Vec3::splat(size * (1.0 + 0.001 * (number / 90) as f32));
            [at, at + Vec3::X * size * 0.001, at + Vec3::Y * size * 0.001]
        })
        .collect();
    let mesh = soup(&triangles);
    for params in all_params().into_iter().map(deepest) {
        let tree = Bvh::build(&[&mesh], &params).unwrap_or_else(|e| panic!("{e}: {params:?}"));
        assert!(tree.stats().depth <= 64);
    }
}

fn build_trace_refit_and_drop_in(stack_bytes: usize, build_inside: bool) {
    let mesh = series(0.5, 90);
    let rays = random_rays(&[&mesh], 20, 21);
    let (mesh, rays) = (&mesh, &rays);
    let pool = pool(1, stack_bytes);
    for params in all_params().into_iter().map(deepest) {
        let build = || Bvh::build(&[mesh], &params).unwrap();
        let built = if build_inside {
            pool.install(build)
        } else {
            build()
        };
        let hits = pool.install(move || {
            let mut tree = built;
            tree.refit(&[mesh]).unwrap();
            let hits = rays
                .iter()
                .filter(|ray| tree.closest_hit(ray).is_some())
                .count();
            let any = rays.iter().filter(|ray| tree.any_hit(ray)).count();
            assert!(tree.stats().depth > 1);
            assert_eq!(hits, any);
            hits
        });
        assert!(hits > 10, "{params:?}");
    }
}

#[test]
fn t21_tracing_refit_and_drop_need_little_stack() {
    build_trace_refit_and_drop_in(128 << 10, false);
}

/// Half of what Rust gives a thread.
#[test]
fn t21_building_needs_less_than_a_mebibyte_of_stack() {
    build_trace_refit_and_drop_in(1 << 20, true);
}

#[test]
fn t21_building_in_128_kib_of_stack() {
    build_trace_refit_and_drop_in(128 << 10, true);
}

#[test]
fn t24_hostile_calls_get_an_error_or_a_tree() {
    let error = TriangleMesh::new(vec![Vec3::ZERO; 3], vec![[0, 1, 2], [0, 1, u32::MAX]]);
    assert_eq!(
        error,
        Err(MeshError::IndexOutOfRange {
            triangle: 1,
            index: u32::MAX,
            vertex_count: 3,
        })
    );
    let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let (empty, one, two) = (soup(&[]), soup(&[triangle]), soup(&[triangle; 2]));
    let ray = Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0]);
    for params in all_params().into_iter().flat_map(|p| [p, deepest(p)]) {
        assert_eq!(check(&[], &params, &[ray]), 0);
        assert_eq!(check(&[&empty], &params, &[ray]), 0);
        assert_eq!(check(&[&one], &params, &[ray]), 2);
        assert_eq!(check(&[&empty, &two, &empty], &params, &[ray]), 2);
        // Leaves larger than the mesh.
        let mut large = params;
        (large.min_leaf_size, large.max_leaf_size) = (64, 64);
        assert_eq!(check(&[&two], &large, &[ray]), 2);
        assert_eq!(
            Bvh::build(&[&two], &large).unwrap().stats().leaf_sizes,
            [0, 0, 1]
        );
        // A width between those that have kernels.
        let mut odd = params;
        odd.branching_factor = 3;
        assert_eq!(check(&[&sphere(4)], &odd, &random_rays(&[&two], 1, 1)), 2);
        let refused = |change: fn(&mut BuildParams)| {
            let mut params = params;
            change(&mut params);
            let Err(BuildError::Parameters(faults)) = Bvh::build(&[&one], &params) else {
                panic!("{params:?} is built");
            };
            assert!(
                matches!(faults[..], [ParameterFault::OutOfRange { .. }]),
                "{faults:?}"
            );
        };
        refused(|p| p.branching_factor = 1);
        refused(|p| p.branching_factor = 17);
        refused(|p| p.traversal_cost = f32::NAN);
        refused(|p| p.intersection_cost = -1.0);
        let mut free = params;
        (free.traversal_cost, free.intersection_cost) = (0.0, 0.0);
        assert_eq!(check(&[&two], &free, &[ray]), 2);
    }
}

#[test]
fn t26_the_number_of_threads_changes_no_bit() {
    // So many that ranges are binned and parted in pieces.
    let mesh = sphere(136);
    assert!(mesh.triangles().len() > 1 << 16);
    let primitives = primitives(&mesh);
    let corners: &Corners<'_> = &|leaf: LeafReference| mesh.corners(leaf.primitive_id);
    let rays = random_rays(&[&mesh], 200, 26);
    for params in all_params() {
        let build = |threads: usize| {
            pool(threads, 2 << 20).install(|| {
                let mut workspace = BuildWorkspace::default();
                let hierarchy =
                    Hierarchy::build(&primitives, Some(corners), &params, &mut workspace).unwrap();
                let tree = Bvh::build_in(&[&mesh], &params, &mut workspace).unwrap();
                let hits: Vec<_> = rays.iter().map(|ray| bits(tree.closest_hit(ray))).collect();
                (contents(&hierarchy), tree.stats(), hits)
            })
        };
        let one = build(1);
        assert!(one.0.len() > 1000 && one.2.iter().flatten().count() > 100);
        for threads in [2, 3, 8] {
            assert!(build(threads) == one, "{threads} threads: {params:?}");
        }
    }
}
