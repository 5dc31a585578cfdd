//! Trees over instances against testing every triangle of every instance: the same bits, whatever
//! the trees, the kernels and the order of visits; and against the meshes moved to the world.

mod common;

use std::sync::Arc;

use common::{Random, bits, built_qualities, random_rays, sphere};
use glam::{Affine3, DVec3, Mat3, Quat};
use proptest::prelude::*;
use raywright_bvh::{
    Accuracy, BuildError, BuildParams, BuildWorkspace, Bvh, Instance, InstanceError, InstanceHit,
    InstancedBvh, Isa, LeafFormat, Quality, Ray, TriangleMesh, Vec3, reference,
};

const ALL: u32 = u32::MAX;

/// What the trees of objects are built over, with their accuracy.
type Objects<'a> = Vec<(Vec<&'a TriangleMesh>, Accuracy)>;

/// Trees of objects, of other parameters and another instruction set with each `variant`.
fn object_trees(objects: &Objects<'_>, variant: usize) -> Vec<Arc<Bvh>> {
    let isas: Vec<_> = Isa::ALL
        .into_iter()
        .filter(|isa| isa.is_available())
        .collect();
    let build = |(place, (meshes, accuracy)): (usize, &(Vec<&TriangleMesh>, Accuracy))| {
        let number = variant + place;
        let mut params = BuildParams::default();
        params.accuracy = *accuracy;
        params.branching_factor = [8, 2, 16, 4][number % 4];
        params.quality = [Quality::BinnedSah, Quality::Morton][number / 2 % 2];
        if number.is_multiple_of(3) {
            params.leaf_format = LeafFormat::Compact;
        }
        let tree = Bvh::build(meshes, &params).unwrap();
        Arc::new(tree.with_isa(isas[number % isas.len()]).unwrap())
    };
    objects.iter().enumerate().map(build).collect()
}

/// Trees of every built quality and width over the instances, by every instruction set.
fn trees(objects: &Objects<'_>, instances: &[Instance]) -> Vec<InstancedBvh> {
    let mut workspace = BuildWorkspace::default();
    let mut trees = Vec::new();
    for quality in built_qualities() {
        for branching_factor in [2, 4, 8, 16] {
            for max_leaf_size in [1, 28] {
                let mut params = BuildParams::default();
                params.quality = quality;
                params.branching_factor = branching_factor;
                params.max_leaf_size = max_leaf_size;
                let below = object_trees(objects, trees.len());
                let tree = InstancedBvh::build(&below, instances, &params, &mut workspace);
                let tree = tree.unwrap();
                let isas = Isa::ALL.into_iter();
                trees.extend(isas.filter_map(|isa| tree.clone().with_isa(isa)));
            }
        }
    }
    trees
}

fn one_tree(objects: &Objects<'_>, instances: &[Instance]) -> InstancedBvh {
    let (below, params) = (object_trees(objects, 0), BuildParams::default());
    InstancedBvh::build(&below, instances, &params, &mut Default::default()).unwrap()
}

fn hit_bits(hit: Option<InstanceHit>) -> Option<(u32, common::Bits)> {
    hit.map(|hit| (hit.instance_id, bits(Some(hit.hit))))
}

type Accept = fn(&InstanceHit) -> bool;

fn by_ids(hit: &InstanceHit) -> bool {
    !(hit.instance_id + hit.hit.primitive_id).is_multiple_of(3)
}

fn by_bits(hit: &InstanceHit) -> bool {
    (hit.hit.t.to_bits() ^ hit.hit.u.to_bits()).is_multiple_of(2)
}

/// Compares all trees with the slow twin; gives how many hits there were.
fn check(
    objects: &Objects<'_>,
    instances: &[Instance],
    rays: &[(Ray, u32)],
) -> Result<usize, TestCaseError> {
    let trees = trees(objects, instances);
    let slices: Vec<_> = objects.iter().map(|(m, a)| (m.as_slice(), *a)).collect();
    let mut hits = 0;
    for (ray, mask) in rays {
        let expected = |accept: Accept| {
            let hit = reference::closest_instance_hit_where(&slices, instances, ray, *mask, accept);
            hit.unwrap()
        };
        let plain = expected(|_| true);
        let filters: [(Accept, _); 2] = [(by_ids, expected(by_ids)), (by_bits, expected(by_bits))];
        hits += usize::from(plain.is_some());
        for tree in &trees {
            let context = format!("{} {:?} {ray:?} {mask:x}", tree.isa(), tree.params());
            let got = tree.closest_hit(ray, *mask);
            prop_assert_eq!(hit_bits(got), hit_bits(plain), "{}", context);
            prop_assert_eq!(tree.any_hit(ray, *mask), plain.is_some(), "{}", context);
            for (accept, expected) in filters {
                let got = tree.closest_hit_where(ray, *mask, accept);
                prop_assert_eq!(hit_bits(got), hit_bits(expected), "{}", context);
                let any = tree.any_hit_where(ray, *mask, accept);
                prop_assert_eq!(any, expected.is_some(), "{}", context);
            }
        }
    }
    Ok(hits)
}

fn scaled(scale: impl Into<Vec3>) -> Affine3 {
    Affine3::from_scale(scale.into())
}

fn moved(translation: impl Into<Vec3>) -> Affine3 {
    Affine3::from_translation(translation.into())
}

/// Turned, scaled by 1/16 to 4 on each axis, sheared, every other one mirrored, moved.
fn random_transform(random: &mut Random, shear: f32) -> Affine3 {
    let turn = |r: &mut Random| {
        let (v, w) = (r.vector(), r.unit() - 0.5);
        Mat3::from_quat(Quat::from_xyzw(v.x, v.y, v.z, w + 0.01).normalize())
    };
    let scale = (random.vector() * 3.0 - 1.0).exp2();
    let mirror = [1.0, -1.0][random.bits() as usize % 2];
    let slant = Mat3::from_cols(
        Vec3::X,
        Vec3::new(shear * random.unit(), 1.0, 0.0),
        Vec3::new(0.0, shear * random.unit(), mirror),
    );
    Affine3 {
        matrix3: turn(random) * slant * Mat3::from_diagonal(scale) * turn(random),
        translation: random.vector() * 2.0,
    }
}

fn soup(random: &mut Random, triangles: u32) -> TriangleMesh {
    let corners = (0..3 * triangles).map(|_| random.vector()).collect();
    let triangles = (0..triangles).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    TriangleMesh::new(corners, triangles.collect()).unwrap()
}

fn random_ray(random: &mut Random) -> (Ray, u32) {
    let ray = Ray::new(random.vector() * 4.0, random.vector());
    let ray = match random.bits() % 4 {
        0 => ray.with_range(random.unit() * 2.0, 1.0 + random.unit() * 4.0),
        1 => Ray::new(ray.origin * 0.25, ray.direction),
        _ => ray,
    };
    (ray, [ALL, 1, 2, 6][random.bits() as usize % 4])
}

/// Some instances of some objects, overlapping a lot, a third of them at the place of another.
fn random_instances(random: &mut Random, objects: usize, count: usize) -> Vec<Instance> {
    let mut instances: Vec<Instance> = Vec::new();
    for _ in 0..count {
        let tree = random.bits() as usize % objects;
        let same = instances.get(random.bits() as usize % (3 * count));
        let transform = match same {
            Some(other) => other.transform,
            None => random_transform(random, 1.0),
        };
        let mask = [ALL, 1, 2, 3, 4, 0][random.bits() as usize % 6];
        instances.push(Instance::new(tree, transform).with_mask(mask));
    }
    instances
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn random_instances_of_random_objects(seed in any::<u64>(), count in 0usize..40) {
        let mut random = Random(seed);
        let (a, b, c) = (soup(&mut random, 30), soup(&mut random, 5), sphere(4));
        let objects = vec![
            (vec![&a, &b], Accuracy::Fast),
            (vec![&b], Accuracy::Robust),
            (vec![], Accuracy::Fast),
            (vec![&c], Accuracy::Fast),
        ];
        let instances = random_instances(&mut random, objects.len(), count);
        let rays: Vec<_> = (0..6).map(|_| random_ray(&mut random)).collect();
        check(&objects, &instances, &rays)?;
    }

    /// Distances down to subnormal ones and up to the largest, in worlds of any size.
    #[test]
    fn any_scale_of_worlds_and_directions(
        seed in any::<u64>(), world in -90i32..90, spread in 0i32..60, direction in -140i32..127,
    ) {
        let mut random = Random(seed);
        let mesh = soup(&mut random, 20);
        let objects = vec![(vec![&mesh], Accuracy::Fast), (vec![&mesh], Accuracy::Robust)];
        let instances = random_instances(&mut random, 2, 12).into_iter().map(|instance| {
            let exponent = world - (random.unit() * spread as f32) as i32;
            let scale = scaled(Vec3::splat(2f32.powi(exponent.max(-95))));
            Instance::new(instance.tree, scale * instance.transform).with_mask(ALL)
        });
        let instances: Vec<_> = instances.collect();
        let rays: Vec<_> = (0..6)
            .map(|_| {
                let (ray, _) = random_ray(&mut random);
                let origin = ray.origin * 2f32.powi(world);
                let towards = -ray.origin + random.vector();
                // In two steps: the power of two alone may be no f32.
                let half = 2f32.powi(direction / 2);
                let way = towards * half * 2f32.powi(direction - direction / 2);
                (Ray::new(origin, way), ALL)
            })
            .collect();
        check(&objects, &instances, &rays)?;
    }

    /// Strong shears seen from afar, where distances are rounded by more than the boxes are padded.
    #[test]
    fn rays_that_have_lost_their_precision(
        seed in any::<u64>(), shear in 0i32..6, distance in 0i32..20,
    ) {
        let mut random = Random(seed);
        let mesh = soup(&mut random, 8);
        let objects = vec![(vec![&mesh], Accuracy::Fast), (vec![&mesh], Accuracy::Robust)];
        let instances: Vec<_> = (0..16)
            .map(|number| {
                let mut transform = random_transform(&mut random, 2f32.powi(shear));
                transform.translation *= 0.1;
                Instance::new(number % 2, transform)
            })
            .collect();
        let rays: Vec<_> = (0..8)
            .map(|_| {
                let origin = random.vector() * 2f32.powi(distance);
                let instance = instances[random.bits() as usize % 16];
                let corner = mesh.vertices()[random.bits() as usize % 24] * random.unit();
                let target = instance.transform.transform_point3(corner);
                (Ray::new(origin, target - origin), ALL)
            })
            .collect();
        check(&objects, &instances, &rays)?;
    }

    /// Faces, edges and corners that meet exactly, and many equal distances.
    #[test]
    fn lattices(seed in any::<u64>()) {
        let mut random = Random(seed);
        let lattice = |r: &mut Random| (r.vector() * 3.49).round();
        let corners: Vec<_> = (0..60).map(|_| lattice(&mut random)).collect();
        let triangles = (0..20).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = TriangleMesh::new(corners, triangles).unwrap();
        let objects = vec![(vec![&mesh], Accuracy::Fast), (vec![&mesh], Accuracy::Robust)];
        let instances: Vec<_> = (0..20)
            .map(|_| {
                let sign = |r: &mut Random| [1.0f32, -1.0, 2.0][r.bits() as usize % 3];
                let diagonal = [(); 3].map(|()| sign(&mut random));
                let axes = Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X);
                let matrix3 = Mat3::from_diagonal(diagonal.into()) * axes;
                let translation = lattice(&mut random);
                Instance::new(random.bits() as usize % 2, Affine3 { matrix3, translation })
            })
            .collect();
        let rays: Vec<_> = (0..8)
            .map(|_| (Ray::new(lattice(&mut random) * 2.0, lattice(&mut random)), ALL))
            .collect();
        check(&objects, &instances, &rays)?;
    }
}

#[test]
fn the_identity_changes_no_bit() {
    let mut random = Random(17);
    let quad = TriangleMesh::new(
        vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X + Vec3::Y],
        vec![[0, 1, 2], [1, 3, 2]],
    );
    let mut hits = 0;
    for mesh in [sphere(12), soup(&mut random, 100), quad.unwrap()] {
        for accuracy in [Accuracy::Fast, Accuracy::Robust] {
            let objects = vec![(vec![&mesh], accuracy)];
            let instanced = one_tree(&objects, &[Instance::new(0, Affine3::IDENTITY)]);
            let [plain] = &object_trees(&objects, 0)[..] else {
                panic!("one object");
            };
            let mut rays = random_rays(&[&mesh], 4000, 23);
            rays.extend((0..2000).map(|_| random_ray(&mut random).0));
            for ray in &rays {
                let hit = instanced.closest_hit(ray, ALL);
                assert_eq!(
                    bits(hit.map(|h| h.hit)),
                    bits(plain.closest_hit(ray)),
                    "{ray:?}"
                );
                assert_eq!(instanced.any_hit(ray, ALL), plain.any_hit(ray));
                hits += usize::from(hit.is_some());
            }
        }
    }
    assert!(hits > 10_000, "{hits}");
}

/// Rays in the plane of a triangle that is alone in its box, for which all that the test computes is
/// noise.
#[test]
fn the_identity_changes_no_bit_of_noise() {
    let mut random = Random(21);
    let mut hits = 0;
    for number in 0..600 {
        let mesh = soup(&mut random, 1);
        let accuracy = [Accuracy::Fast, Accuracy::Robust][number % 2];
        let objects = vec![(vec![&mesh], accuracy)];
        let instanced = one_tree(&objects, &[Instance::new(0, Affine3::IDENTITY)]);
        let plain = &object_trees(&objects, 0)[0];
        let [a, b, c] = mesh.corners(0);
        for _ in 0..100 {
            let mut point = || a + (b - a) * random.unit() * 1.2 + (c - a) * random.unit() * 1.2;
            let (from, to) = (point(), point());
            let jitter = random.vector() * 2f32.powi(-18 - (random.bits() % 9) as i32);
            let origin = from * 2.0 - to + jitter;
            let ray = Ray::new(origin, to - origin);
            let got = bits(instanced.closest_hit(&ray, ALL).map(|h| h.hit));
            assert_eq!(got, bits(plain.closest_hit(&ray)), "{ray:?}");
            hits += usize::from(got.is_some());
        }
    }
    assert!(hits > 5000, "{hits}");
}

/// Scaling by a power of two, mirroring and exchanging axes rounds nothing.
#[test]
fn exact_transforms_change_no_distance() {
    let mut random = Random(18);
    let mesh = soup(&mut random, 100);
    let objects = vec![(vec![&mesh], Accuracy::Robust)];
    let plain = &object_trees(&objects, 0)[0];
    let mut hits = 0;
    for exponent in [-60, -1, 0, 3, 60] {
        for mirror in [1.0, -1.0] {
            let size = 2f32.powi(exponent);
            let transform = scaled([size, size * mirror, size]);
            let instanced = one_tree(&objects, &[Instance::new(0, transform)]);
            for _ in 0..1000 {
                let (ray, _) = random_ray(&mut random);
                let to_world = |v: Vec3| transform.transform_vector3(v);
                let in_world = Ray::new(to_world(ray.origin), to_world(ray.direction))
                    .with_range(ray.t_min, ray.t_max);
                let got = bits(instanced.closest_hit(&in_world, ALL).map(|h| h.hit));
                assert_eq!(got, bits(plain.closest_hit(&ray)), "2^{exponent} {ray:?}");
                hits += usize::from(got.is_some());
            }
        }
    }
    assert!(hits > 1000, "{hits}");
}

/// Objects made 10¹⁸ times larger or smaller, by a number that is no power of two.
#[test]
fn very_large_and_very_small_instances() {
    let mesh = sphere(8);
    let objects = vec![(vec![&mesh], Accuracy::Robust)];
    let mut random = Random(5);
    for size in [1e-18_f32, 1e18] {
        let place = Vec3::new(3.0, -2.0, 1.0) * size;
        let transform = moved(place) * scaled(Vec3::splat(size));
        let mut rays = Vec::new();
        for _ in 0..40 {
            let (ray, _) = random_ray(&mut random);
            let target = place + random.vector() * size * 0.3;
            let origin = ray.origin * size * 2.0 + place;
            rays.push((Ray::new(origin, (target - origin) / size), ALL));
        }
        let hits = check(&objects, &[Instance::new(0, transform)], &rays).unwrap();
        assert_eq!(hits, rays.len());
    }
    // Side by side.
    let instances = [
        Instance::new(0, scaled(Vec3::splat(1e-18))),
        Instance::new(0, moved([2e18, 0.0, 0.0]) * scaled(Vec3::splat(1e18))),
    ];
    let tree = one_tree(&objects, &instances);
    let hit = |direction: Vec3| tree.closest_hit(&Ray::new([0.0, 0.0, 0.0], direction), ALL);
    let ids = [Vec3::X, -Vec3::X].map(|direction| hit(direction).map(|h| h.instance_id));
    assert_eq!(ids, [Some(0), Some(0)], "from within the small one");
    let far = Ray::new([1.0, 0.0, 0.0], Vec3::X);
    let far = tree.closest_hit(&far, ALL).unwrap();
    assert!(far.instance_id == 1 && (far.hit.t / 1e18 - 1.0).abs() < 1e-5);
}

#[test]
fn equal_distances_go_to_the_lowest_instance() {
    let corners = vec![-Vec3::ONE, Vec3::X, Vec3::Y];
    let mesh = TriangleMesh::new(corners, vec![[0, 1, 2]; 3]).unwrap();
    let objects = vec![(vec![], Accuracy::Fast), (vec![&mesh], Accuracy::Fast)];
    let at = |z: f32| Instance::new(1, moved([0.0, 0.0, z]));
    let instances: Vec<_> = [Instance::new(0, Affine3::IDENTITY), at(-9.0)]
        .into_iter()
        .chain((0..40).map(|_| at(-5.0)))
        .collect();
    let ray = Ray::new(Vec3::new(0.0, 0.0, 3.0), -Vec3::Z);
    for tree in trees(&objects, &instances) {
        let hit = tree.closest_hit(&ray, ALL).unwrap();
        assert_eq!((hit.instance_id, hit.hit.primitive_id), (2, 0));
        let hit = tree.closest_hit_where(&ray, ALL, |h| h.instance_id > 7 && by_ids(h));
        let hit = hit.unwrap();
        assert_eq!((hit.instance_id, hit.hit.primitive_id), (8, 0));
    }
}

#[test]
fn a_mask_is_met_by_a_common_bit() {
    let mesh = sphere(6);
    let objects = vec![(vec![&mesh], Accuracy::Fast)];
    let masks = [0b001, 0b010, 0b110, 0];
    let instances: Vec<_> = (0..)
        .zip(masks)
        .map(|(i, mask)| Instance::new(0, moved([3.0 * i as f32, 0.0, 0.0])).with_mask(mask))
        .collect();
    let ray = Ray::new([-5.0, 0.1, 0.2], [1.0, 0.0, 0.0]);
    for tree in trees(&objects, &instances) {
        let first = |mask| tree.closest_hit(&ray, mask).map(|hit| hit.instance_id);
        let expected = [None, Some(0), Some(1), Some(0), Some(2), None];
        for (mask, expected) in [0, 0b001, 0b010, ALL, 0b100, 0b1000]
            .into_iter()
            .zip(expected)
        {
            assert_eq!(first(mask), expected, "{mask:b}");
            assert_eq!(tree.any_hit(&ray, mask), expected.is_some());
        }
    }
}

#[test]
fn nothing_and_instances_of_nothing() {
    let empty = TriangleMesh::default();
    let objects = vec![(vec![], Accuracy::Fast), (vec![&empty], Accuracy::Robust)];
    let ray = Ray::new(Vec3::ZERO, Vec3::X);
    for instances in [
        vec![],
        vec![Instance::new(0, moved([1.0, 0.0, 0.0])); 3],
        vec![Instance::new(1, Affine3::IDENTITY)],
    ] {
        for tree in trees(&objects, &instances) {
            assert_eq!(tree.closest_hit(&ray, ALL), None);
            assert!(!tree.any_hit(&ray, ALL) && tree.bounds().is_empty());
        }
    }
}

#[test]
fn transforms_and_trees_that_are_none_are_an_error() {
    let mesh = sphere(4);
    let objects = vec![(vec![&mesh], Accuracy::Fast), (vec![], Accuracy::Fast)];
    let below = object_trees(&objects, 0);
    let good = Instance::new(0, Affine3::IDENTITY);
    let build = |bad: Instance| {
        let built = InstancedBvh::build(
            &below,
            &[good, bad, good],
            &BuildParams::default(),
            &mut Default::default(),
        );
        built.map(|_| ())
    };
    assert_eq!(build(good), Ok(()));
    assert_eq!(
        build(Instance::new(2, Affine3::IDENTITY)),
        Err(InstanceError::TreeOutOfRange {
            instance: 1,
            tree: 2,
            trees: 2
        })
    );
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for place in 0..12 {
            let mut numbers = Affine3::IDENTITY.to_cols_array();
            numbers[place] = value;
            let bad = Instance::new(0, Affine3::from_cols_array(&numbers));
            let expected = Err(InstanceError::TransformNotFinite { instance: 1 });
            assert_eq!(build(bad), expected);
        }
    }
    let with = |matrix3: Mat3| {
        Instance::new(
            0,
            Affine3 {
                matrix3,
                translation: Vec3::ONE,
            },
        )
    };
    let turn = Mat3::from_rotation_x(0.3) * Mat3::from_rotation_z(1.0);
    let row = Vec3::new(0.1, 0.2, 0.3);
    for matrix in [
        Mat3::ZERO,
        Mat3::from_diagonal(Vec3::new(1.0, 0.0, 1.0)),
        Mat3::from_cols(row, row, Vec3::X),
        Mat3::from_cols(row, row * 3.0, Vec3::X),
        Mat3::from_cols(row, Vec3::new(0.4, 0.5, 0.6), Vec3::new(0.7, 0.8, 0.9)),
        turn * Mat3::from_diagonal(Vec3::new(1.0, 1.0, 1e-9)) * turn,
        // Their inverses are no numbers of f32.
        Mat3::from_diagonal(Vec3::splat(1e-40)),
        Mat3::from_diagonal(Vec3::splat(f32::from_bits(1))),
    ] {
        let error = build(with(matrix)).unwrap_err();
        assert!(
            matches!(
                error,
                InstanceError::TransformNotInvertible { instance: 1, .. }
            ),
            "{matrix} {error}"
        );
        // Of an empty tree as well: what is wrong does not depend on the meshes.
        let mut bad = with(matrix);
        bad.tree = 1;
        assert!(build(bad).is_err());
    }
    // However flat, axes that stay axes lose nothing.
    for diagonal in [[1.0, 1.0, 1e-9], [1e-18, 1e18, 1.0], [1e9, -1.0, 1e-20]] {
        assert_eq!(
            build(with(Mat3::from_diagonal(Vec3::from(diagonal)))),
            Ok(())
        );
    }
    // The world has the limits of any scene.
    for far in [1e31, 1e38, f32::MAX] {
        let built = build(Instance::new(0, moved([0.0, far, 0.0])));
        assert!(
            matches!(
                built,
                Err(InstanceError::Build(BuildError::CoordinateRange { .. }))
            ),
            "{built:?}"
        );
    }
    let huge = build(Instance::new(0, scaled(Vec3::splat(f32::MAX))));
    assert!(matches!(
        huge,
        Err(InstanceError::Build(BuildError::CoordinateRange { .. }))
    ));
    let mut params = BuildParams::default();
    params.branching_factor = 17;
    let built = InstancedBvh::build(&below, &[good], &params, &mut Default::default());
    assert!(matches!(
        built,
        Err(InstanceError::Build(BuildError::Parameters(_)))
    ));
}

#[test]
fn rays_that_can_hit_nothing() {
    let (inf, nan) = (f32::INFINITY, f32::NAN);
    let mesh = sphere(4);
    let objects = vec![(vec![&mesh], Accuracy::Robust)];
    let instances = [Instance::new(0, Affine3::IDENTITY)];
    let origin = Vec3::splat(-3.0);
    for tree in trees(&objects, &instances) {
        let good = Ray::new(origin, Vec3::ONE);
        assert!(tree.any_hit(&good, ALL) && tree.any_hit(&good.with_range(-5.0, inf), ALL));
        for ray in [
            Ray::new(Vec3::splat(nan), Vec3::ONE),
            Ray::new(origin, Vec3::ZERO),
            Ray::new(origin, Vec3::new(nan, 1.0, 1.0)),
            Ray::new(origin, Vec3::new(inf, 1.0, 1.0)),
            good.with_range(nan, 1.0),
            good.with_range(0.0, nan),
            good.with_range(2.0, 1.0),
            Ray::new(Vec3::splat(-1e30), Vec3::ONE),
        ] {
            assert_eq!(tree.closest_hit(&ray, ALL), None, "{ray:?}");
            assert!(!tree.any_hit(&ray, ALL), "{ray:?}");
        }
    }
}

/// In exact arithmetic: where the ray meets the plane of a triangle of an instance, and how steeply,
/// as the cosine in the world.
fn exact_distance(ray: &Ray, corners: [Vec3; 3], transform: &Affine3) -> (f64, f64) {
    let matrix = transform.matrix3.as_dmat3();
    let [a, b, c] = corners.map(|v| matrix * v.as_dvec3() + transform.translation.as_dvec3());
    let normal = (b - a).cross(c - a).normalize();
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let slope = normal.dot(direction);
    (
        normal.dot(a - origin) / slope,
        (slope / direction.length()).abs(),
    )
}

/// Distances are those of the meshes moved to the world, to within 64 roundoffs of the largest
/// coordinate times the condition of the transform, over the cosine of the angle of incidence.
#[test]
fn distances_are_those_of_a_flattened_scene() {
    let mut random = Random(31);
    let mesh = sphere(10);
    let objects = vec![(vec![&mesh], Accuracy::Robust)];
    let (mut same, mut other, mut worst) = (0, 0, 0.0f64);
    for _ in 0..60 {
        let instances: Vec<_> = (0..12)
            .map(|_| Instance::new(0, random_transform(&mut random, 2.0)))
            .collect();
        let flattened: Vec<_> = instances
            .iter()
            .map(|instance| {
                let corners = mesh.vertices().iter();
                let corners = corners.map(|&v| instance.transform.transform_point3(v));
                TriangleMesh::new(corners.collect(), mesh.triangles().to_vec()).unwrap()
            })
            .collect();
        let mut params = BuildParams::default();
        params.accuracy = Accuracy::Robust;
        let plain = Bvh::build(&flattened.iter().collect::<Vec<_>>(), &params).unwrap();
        let tree = one_tree(&objects, &instances);
        for _ in 0..100 {
            let (ray, _) = random_ray(&mut random);
            let (hit, expected) = (tree.closest_hit(&ray, ALL), plain.closest_hit(&ray));
            let (Some(hit), Some(expected)) = (hit, expected) else {
                other += usize::from(hit.is_some() != expected.is_some());
                continue;
            };
            let ids = (hit.instance_id, hit.hit.primitive_id);
            if ids != (expected.geometry_id, expected.primitive_id) {
                other += 1;
                continue;
            }
            same += 1;
            let transform = instances[hit.instance_id as usize].transform;
            let corners = mesh.corners(hit.hit.primitive_id);
            let (_, cosine) = exact_distance(&ray, corners, &transform);
            let matrix = transform.matrix3.as_dmat3();
            let condition = (matrix.abs() * (matrix.inverse().abs() * DVec3::ONE)).max_element();
            let largest = 12.0 * condition / f64::from(ray.direction.length()) / cosine;
            let error = f64::from((hit.hit.t - expected.t).abs()) / largest * f64::from(1 << 24);
            worst = worst.max(error);
        }
    }
    assert!(worst < 64.0, "{worst}");
    assert!(same > 2000 && other <= same / 500, "{same} {other} {worst}");
}

/// A triangle, alone in its box, sheared until the condition is in the millions, and rays from
/// anywhere within six times the largest coordinate at its corners, off by what rounding moves: where
/// the object sees a hit, the ray has to enter the box.
#[test]
fn boxes_hold_what_rounding_moves() {
    let mut random = Random(77);
    let (mut hits, mut misses) = (0, 0);
    for number in 0..600 {
        let mesh = soup(&mut random, 1);
        let objects = vec![(vec![&mesh], Accuracy::Robust)];
        let transform = random_transform(&mut random, 8f32.powi(number % 5));
        let built = InstancedBvh::build(
            &object_trees(&objects, number as usize),
            &[Instance::new(0, transform)],
            &BuildParams::default(),
            &mut Default::default(),
        );
        let Ok(tree) = built else {
            continue;
        };
        let bounds = tree.bounds();
        let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
        for _ in 0..50 {
            let corner = mesh.vertices()[random.bits() as usize % 3];
            let origin = random.vector() * largest * 6.0;
            let off = random.vector() * largest * 2f32.powi(-10 - (random.bits() % 15) as i32);
            let target = transform.transform_point3(corner) + off;
            let ray = Ray::new(origin, target - origin);
            let in_object = seen_by_object(&transform, &ray);
            let seen = reference::closest_hit(&[&mesh], &in_object, Accuracy::Robust).unwrap();
            assert_eq!(
                tree.any_hit(&ray, ALL),
                seen.is_some(),
                "{transform} {ray:?}"
            );
            *(if seen.is_some() {
                &mut hits
            } else {
                &mut misses
            }) += 1;
        }
    }
    assert!(hits > 2000 && misses > 2000, "{hits} {misses}");
}

/// The ray that an object sees.
fn seen_by_object(transform: &Affine3, ray: &Ray) -> Ray {
    let inverse = transform.matrix3.as_dmat3().inverse();
    let origin = ray.origin.as_dvec3() - transform.translation.as_dvec3();
    Ray::new(
        (inverse * origin).as_vec3(),
        (inverse * ray.direction.as_dvec3()).as_vec3(),
    )
}

#[test]
fn bounds_and_statistics_are_those_of_the_boxes() {
    let mut random = Random(4);
    let mesh = sphere(6);
    let objects = vec![(vec![&mesh], Accuracy::Fast), (vec![], Accuracy::Fast)];
    let mut instances: Vec<_> = (0..50)
        .map(|_| Instance::new(0, random_transform(&mut random, 1.0)))
        .collect();
    instances.push(Instance::new(1, Affine3::IDENTITY));
    let mut workspace = BuildWorkspace::default();
    let below = object_trees(&objects, 0);
    for _ in 0..3 {
        let mut params = BuildParams::default();
        params.max_leaf_size = 1;
        let tree = InstancedBvh::build(&below, &instances, &params, &mut workspace).unwrap();
        let bounds = tree.bounds();
        for instance in &instances[..50] {
            for &v in mesh.vertices() {
                let v = instance.transform.transform_point3(v);
                assert!(bounds.min.cmple(v).all() && v.cmple(bounds.max).all());
            }
        }
        assert_eq!(tree.stats().leaves, 50, "{:?}", tree.stats());
        tree.recycle(&mut workspace);
    }
}
