//! Every kernel against testing every triangle: the same bits, for every accuracy, branching factor,
//! leaf format and instruction set, any parameters, any rays.
//!
//! Where triangles are cut, only hits that exact arithmetic knows are promised: the parts cover the
//! triangle and not its box, so that a ray in the plane of a triangle can be accepted by the test,
//! at any place of the triangle's box, and enter none of the parts.

use proptest::prelude::*;
use raywright_bvh::{
    Accuracy, BuildError, BuildParams, Bvh,
    Collapse::{LargestFirst, LeastCost},
    Hit, Isa, LeafFormat, Quality, Ray, RayPackets, TriangleMesh, Vec3, reference,
};

/// Distance, weights, geometry, primitive.
type HitBits = (u32, u32, u32, u32, u32);
type Bits = Option<HitBits>;

fn bits(hit: Option<Hit>) -> Bits {
    hit.map(|h| {
        (
            h.t.to_bits(),
            h.u.to_bits(),
            h.v.to_bits(),
            h.geometry_id,
            h.primitive_id,
        )
    })
}

/// Trees of every kind that has a kernel of its own, and two of widths between, by every
/// instruction set that this machine has.
fn trees(meshes: &[&TriangleMesh], params: &BuildParams, accuracy: Accuracy) -> Vec<Bvh> {
    let mut trees = Vec::new();
    for branching_factor in [2, 3, 4, 8, 12, 16] {
        for leaf_format in [LeafFormat::Edges, LeafFormat::Compact] {
            let mut params = *params;
            params.branching_factor = branching_factor;
            params.leaf_format = leaf_format;
            params.accuracy = accuracy;
            let tree = match Bvh::build(meshes, &params) {
                Ok(tree) => tree,
                Err(BuildError::DepthLimit { .. }) => continue,
                Err(error) => panic!("{error}"),
            };
            trees.extend(
                Isa::ALL
                    .into_iter()
                    .filter_map(|isa| tree.clone().with_isa(isa)),
            );
        }
    }
    trees
}

const ACCURACIES: [Accuracy; 2] = [Accuracy::Fast, Accuracy::Robust];

/// Trees of both accuracies.
fn all_trees(meshes: &[&TriangleMesh]) -> impl Iterator<Item = Bvh> {
    ACCURACIES
        .into_iter()
        .flat_map(move |accuracy| trees(meshes, &BuildParams::default(), accuracy))
}

fn check(
    meshes: &[&TriangleMesh],
    params: &BuildParams,
    rays: &[Ray],
) -> Result<usize, TestCaseError> {
    let mut hits = 0;
    for accuracy in ACCURACIES {
        let trees = trees(meshes, params, accuracy);
        for tree in &trees {
            check_streams(tree, rays)?;
        }
        for ray in rays {
            let expected = bits(reference::closest_hit(meshes, ray, accuracy).unwrap());
            hits += usize::from(expected.is_some());
            for tree in &trees {
                let context = format!("{} {:?} {ray:?}", tree.isa(), tree.params());
                let got = bits(tree.closest_hit(ray));
                let any = tree.any_hit(ray);
                if let (true, Some(expected)) = (cuts(params.quality), expected)
                    && (got != Some(expected) || !any)
                    && is_noise(meshes, ray, expected)
                {
                    let order = |(t, _, _, geometry, primitive)| (t, geometry, primitive);
                    let behind = got.is_none_or(|got| order(got) >= order(expected));
                    prop_assert!(behind, "{got:?} precedes {expected:?}: {context}");
                    continue;
                }
                prop_assert_eq!(got, expected, "{}", context);
                prop_assert_eq!(any, expected.is_some(), "{}", context);
            }
        }
    }
    Ok(hits)
}

/// Rays of one octant, which go side by side for a while, and as many that stay together down to the leaves.
fn packets_of(rays: &[Ray]) -> Vec<Ray> {
    const SIZE: usize = 16;
    let in_octant = |ray: &Ray, step: f32| {
        let mut ray = *ray;
        ray.origin += Vec3::splat(step);
        ray.direction = ray.direction.abs();
        ray
    };
    let apart = rays
        .iter()
        .cycle()
        .take(SIZE)
        .map(|ray| in_octant(ray, 0.0));
    let close = rays
        .iter()
        .take(4)
        .flat_map(|ray| (0..SIZE).map(move |k| in_octant(ray, k as f32 / 1024.0)));
    apart.chain(close).collect()
}

/// Compares rays that are traced together with one at a time: rays of all directions, and packets.
fn check_streams(tree: &Bvh, rays: &[Ray]) -> Result<(), TestCaseError> {
    let (mut hits, mut are_hit) = (vec![], vec![]);
    for rays in [rays, &packets_of(rays)] {
        let alone: Vec<_> = rays.iter().map(|ray| bits(tree.closest_hit(ray))).collect();
        let any_alone: Vec<_> = rays.iter().map(|ray| tree.any_hit(ray)).collect();
        for (in_flight, packets) in [
            (1, RayPackets::Off),
            (3, RayPackets::Off),
            (1, RayPackets::On),
            (32, RayPackets::On),
        ] {
            let tree = tree
                .clone()
                .with_rays_in_flight(in_flight)
                .with_ray_packets(packets);
            let context = format!("{} {:?}", tree.isa(), tree.params());
            tree.closest_hits(rays, &mut hits);
            let hits: Vec<_> = hits.iter().map(|&hit| bits(hit)).collect();
            prop_assert_eq!(&hits, &alone, "{}", context);
            tree.any_hits(rays, &mut are_hit);
            prop_assert_eq!(&are_hit, &any_alone, "{}", context);
        }
    }
    Ok(())
}

/// Whether triangles may be cut.
fn cuts(quality: Quality) -> bool {
    matches!(quality, Quality::SpatialSplits | Quality::Optimized)
}

/// Whether a hit is owed to rounding: by the formulas of `triangle` in f64, from the same vertices,
/// the ray passes the triangle by, or meets it at a distance that is off by more than the padding
/// of boxes allows for.
fn is_noise(meshes: &[&TriangleMesh], ray: &Ray, (t, _, _, geometry, primitive): HitBits) -> bool {
    let [a, b, c] = meshes[geometry as usize]
        .corners(primitive)
        .map(|v| v.as_dvec3());
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (edge_1, edge_2) = (b - a, c - a);
    let p = direction.cross(edge_2);
    let den = p.dot(edge_1);
    let q = (origin - a).cross(edge_1);
    let u = p.dot(origin - a) / den;
    let v = q.dot(direction) / den;
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
    let largest = meshes
        .iter()
        .flat_map(|mesh| mesh.vertices())
        .map(|v| v.abs().max_element())
        .fold(0.0, f32::max);
    // Two roundoffs of the margin m·|r| on its tightest axis.
    let margin = (ray.origin.abs().as_dvec3() + f64::from(largest)) / direction.abs();
    let allowed = margin.min_element() / f64::from(1 << 23);
    let distance = q.dot(edge_2) / den;
    !(inside && (distance - f64::from(f32::from_bits(t))).abs() <= allowed)
}

fn vector(range: f32) -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-range..range).prop_map(Vec3::from)
}

/// Coordinates that meet exactly: small whole numbers, of which many triangles are degenerate,
/// coplanar or the same.
fn lattice_vector() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-3i8..=3).prop_map(|v| Vec3::from(v.map(f32::from)))
}

fn soup(vertex: impl Strategy<Value = Vec3>, most: usize) -> impl Strategy<Value = TriangleMesh> {
    prop::collection::vec(prop::array::uniform3(vertex), 0..most).prop_map(|corners| {
        let triangles = (0..corners.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect();
        TriangleMesh::new(corners.concat(), triangles).unwrap()
    })
}

fn params() -> impl Strategy<Value = BuildParams> {
    (
        9u32..40,
        1u32..=32,
        1u32..=64,
        1u32..=64,
        0f32..10.0,
        0f32..10.0,
        0u32..4,
        prop::sample::select(vec![
            (Quality::Morton, LargestFirst),
            (Quality::Agglomerative, LargestFirst),
            (Quality::BinnedSah, LargestFirst),
            (Quality::BinnedSah, LeastCost),
            (Quality::SpatialSplits, LargestFirst),
            (Quality::SpatialSplits, LeastCost),
            (Quality::Optimized, LargestFirst),
        ]),
    )
        .prop_map(
            |(
                depth,
                block,
                min_leaf,
                max_leaf,
                traversal,
                intersection,
                rotations,
                (quality, collapse),
            )| {
                let mut params = BuildParams::default();
                params.quality = quality;
                params.collapse = collapse;
                params.split_budget = 2.0;
                params.max_depth = depth;
                params.sah_block_size = block;
                params.min_leaf_size = min_leaf;
                params.max_leaf_size = max_leaf;
                params.traversal_cost = traversal;
                params.intersection_cost = intersection;
                params.rotations = rotations;
                params
            },
        )
}

fn rays(
    origin: impl Strategy<Value = Vec3>,
    direction: impl Strategy<Value = Vec3>,
) -> impl Strategy<Value = Vec<Ray>> {
    prop::collection::vec(
        (origin, direction, 0f32..1.0, 0f32..4.0, any::<bool>()).prop_map(
            |(o, d, t_min, length, bounded)| {
                let ray = Ray::new(o, d);
                if bounded {
                    ray.with_range(t_min, t_min + length)
                } else {
                    ray
                }
            },
        ),
        20,
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn random_triangles(
        mesh in soup(vector(1.0), 200), other in soup(vector(0.3), 60), params in params(),
        rays in rays(vector(2.0), vector(1.0)),
    ) {
        check(&[&mesh, &other], &params, &rays)?;
    }

    #[test]
    fn lattice_triangles_and_lattice_rays(
        mesh in soup(lattice_vector(), 200), params in params(), rays in rays(lattice_vector(), lattice_vector()),
    ) {
        check(&[&mesh], &params, &rays)?;
    }

    /// Long thin triangles seen at a grazing angle, where `T / den` can be anything.
    #[test]
    fn slivers_and_grazing_rays(
        mesh in soup((vector(1.0), -20i32..=0).prop_map(|(v, e)| Vec3::new(v.x, v.y * 2f32.powi(e), v.z)), 100),
        params in params(),
        rays in rays(vector(1.0).prop_map(|v| v * Vec3::new(2.0, 1e-6, 2.0)),
                     (vector(1.0), -24i32..=-2).prop_map(|(v, e)| Vec3::new(v.x, v.y * 2f32.powi(e), v.z))),
    ) {
        check(&[&mesh], &params, &rays)?;
    }

    /// Rays in the plane of a triangle up to a few roundings: all that the triangle test computes
    /// is noise, and without the triangle's own box it would accept any distance.
    #[test]
    fn rays_in_the_planes_of_triangles(
        mesh in soup(vector(1.0), 150), params in params(),
        picks in prop::collection::vec(
            (any::<prop::sample::Index>(), prop::array::uniform4(-0.5f32..1.5), vector(1.0), -26i32..=-18), 20),
    ) {
        prop_assume!(!mesh.triangles().is_empty());
        let rays: Vec<Ray> = picks
            .iter()
            .map(|(index, [a, b, c, d], jitter, exponent)| {
                let [v0, v1, v2] = mesh.corners(index.index(mesh.triangles().len()) as u32);
                let point = |a: f32, b: f32| v0 + (v1 - v0) * a + (v2 - v0) * b;
                let origin = point(a * 3.0, b * 3.0) + *jitter * 2f32.powi(*exponent);
                Ray::new(origin, point(*c, *d) - origin)
            })
            .collect();
        check(&[&mesh], &params, &rays)?;
    }

    #[test]
    fn far_from_the_origin_and_at_any_scale(
        mesh in soup(vector(1.0), 100), params in params(), rays in rays(vector(2.0), vector(1.0)),
        shift in 0f32..1e5, exponent in -80i32..80,
    ) {
        let scale = 2f32.powi(exponent);
        let place = |v: Vec3| (v + shift) * scale;
        let moved = TriangleMesh::new(
            mesh.vertices().iter().map(|&v| place(v)).collect(), mesh.triangles().to_vec()).unwrap();
        let rays: Vec<Ray> = rays.iter().map(|r| Ray::new(place(r.origin), r.direction)).collect();
        check(&[&moved], &params, &rays)?;
    }
}

#[test]
fn a_power_of_two_changes_no_bit() {
    let triangle = |s: f32| {
        let v = [
            Vec3::new(0.1, 0.2, 0.3),
            Vec3::new(1.3, -0.4, 0.2),
            Vec3::new(0.2, 1.7, -0.1),
        ];
        TriangleMesh::new(v.map(|v| v * s).to_vec(), vec![[0, 1, 2]]).unwrap()
    };
    let hit = |s: f32, accuracy: Accuracy| {
        let mesh = triangle(s);
        let mut params = BuildParams::default();
        params.accuracy = accuracy;
        let tree = Bvh::build(&[&mesh], &params).unwrap();
        tree.closest_hit(&Ray::new(
            Vec3::new(0.4, 0.3, 2.0) * s,
            Vec3::new(0.03, 0.02, -1.0) * s,
        ))
        .unwrap()
    };
    for accuracy in ACCURACIES {
        let expected = hit(1.0, accuracy);
        for exponent in -90..=90 {
            let got = hit(2f32.powi(exponent), accuracy);
            assert_eq!(got, expected, "2^{exponent}, {accuracy:?}");
        }
    }
}

#[test]
fn equal_distances_go_to_the_lowest_ids() {
    let quad = |z: f32| {
        TriangleMesh::new(
            vec![
                Vec3::new(-1.0, -1.0, z),
                Vec3::new(1.0, -1.0, z),
                Vec3::new(0.0, 1.0, z),
            ],
            vec![[0, 1, 2]; 40],
        )
        .unwrap()
    };
    let (empty, far, near) = (TriangleMesh::default(), quad(-2.0), quad(-1.0));
    for tree in all_trees(&[&empty, &far, &empty, &near, &near]) {
        let hit = tree.closest_hit(&Ray::new(Vec3::ZERO, -Vec3::Z)).unwrap();
        assert_eq!((hit.geometry_id, hit.primitive_id, hit.t), (3, 0, 1.0));
    }
}

#[test]
fn rays_that_can_hit_nothing() {
    let mesh = TriangleMesh::new(vec![-Vec3::ONE, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
    let (inf, nan) = (f32::INFINITY, f32::NAN);
    let origin = Vec3::splat(-3.0);
    let unusable = [
        Ray::new(Vec3::splat(nan), Vec3::ONE),
        Ray::new(Vec3::splat(inf), Vec3::ONE),
        Ray::new(origin, Vec3::ZERO),
        Ray::new(origin, Vec3::new(nan, 1.0, 1.0)),
        Ray::new(origin, Vec3::new(inf, 1.0, 1.0)),
        Ray::new(origin, Vec3::ONE).with_range(nan, 1.0),
        Ray::new(origin, Vec3::ONE).with_range(0.0, nan),
        Ray::new(origin, Vec3::ONE).with_range(2.0, 1.0),
        Ray::new(origin, Vec3::ONE).with_range(0.0, -inf),
        Ray::new(Vec3::splat(-1e30), Vec3::ONE),
    ];
    for tree in all_trees(&[&mesh]) {
        assert!(tree.any_hit(&Ray::new(origin, Vec3::ONE)));
        assert!(
            tree.any_hit(&Ray::new(origin, Vec3::ONE).with_range(-5.0, inf)),
            "a negative start acts as 0"
        );
        assert!(
            tree.any_hit(&Ray::new(origin, Vec3::ONE * 1e-42)),
            "a subnormal direction is a direction"
        );
        assert!(tree.any_hit(&Ray::new(origin, Vec3::ONE * 1e38)));
        for ray in &unusable {
            assert_eq!(tree.closest_hit(ray), None, "{ray:?}");
            assert!(!tree.any_hit(ray), "{ray:?}");
        }
    }
}

/// At the corners and the middles of the edges of a square, where weights are 0.
#[test]
fn the_sign_of_a_zero_in_the_direction_changes_no_bit() {
    let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    let vertices = corners.map(|(x, y)| Vec3::new(x, y, 0.5)).to_vec();
    let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    let mut hits = 0;
    for tree in all_trees(&[&mesh]) {
        for (x, y) in (0..9).map(|i| (0.5 * (i % 3) as f32, 0.5 * (i / 3) as f32)) {
            let hit = |dx: f32, dy: f32| {
                let ray = Ray::new([x, y, 0.0], [dx, dy, 1.0]);
                bits(tree.closest_hit(&ray))
            };
            let expected = hit(0.0, 0.0);
            hits += usize::from(expected.is_some());
            for (dx, dy) in [(0.0, -0.0), (-0.0, 0.0), (-0.0, -0.0)] {
                assert_eq!(
                    hit(dx, dy),
                    expected,
                    "{x} {y} {dx} {dy} {:?}",
                    tree.params()
                );
            }
        }
    }
    assert!(hits > 0);
}

#[test]
fn interval_ends_belong_to_the_interval() {
    let mesh = TriangleMesh::new(
        vec![
            -Vec3::ONE,
            Vec3::new(3.0, -1.0, -1.0),
            Vec3::new(-1.0, 3.0, -1.0),
        ],
        vec![[0, 1, 2]],
    )
    .unwrap();
    let ray = Ray::new(Vec3::ZERO, -Vec3::Z);
    let (before, after) = (1f32.next_down(), 1f32.next_up());
    for tree in all_trees(&[&mesh]) {
        for (t_min, t_max, hit) in [
            (1.0, 1.0, true),
            (0.0, 1.0, true),
            (1.0, 2.0, true),
            (after, 2.0, false),
            (0.0, before, false),
        ] {
            assert_eq!(
                tree.any_hit(&ray.with_range(t_min, t_max)),
                hit,
                "[{t_min}, {t_max}]"
            );
        }
    }
}
