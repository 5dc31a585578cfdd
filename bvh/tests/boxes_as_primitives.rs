//! Trees over boxes against testing every box, and both against exact intervals.

mod common;

use common::{Random, built_qualities};
use proptest::prelude::*;
use raywright_bvh::{
    Aabb, BoxBvh, BoxHit, BuildError, BuildParams, BuildWorkspace, Isa, Ray, Vec3, reference,
    segments,
};

/// Trees of every built quality and width, by every instruction set that this machine has.
fn trees(boxes: &[Aabb]) -> Vec<BoxBvh> {
    let mut workspace = BuildWorkspace::default();
    let mut trees = Vec::new();
    for quality in built_qualities() {
        for branching_factor in [2, 3, 4, 8, 12, 16] {
            for max_leaf_size in [1, 28] {
                let mut params = BuildParams::default();
                params.quality = quality;
                params.branching_factor = branching_factor;
                params.max_leaf_size = max_leaf_size;
                let tree = BoxBvh::build(boxes, &params, &mut workspace).unwrap();
                let isas = Isa::ALL.into_iter();
                trees.extend(isas.filter_map(|isa| tree.clone().with_isa(isa)));
            }
        }
    }
    trees
}

fn bits(hits: &[BoxHit]) -> Vec<(u32, u32, u32)> {
    let bits = |h: &BoxHit| (h.t_enter.to_bits(), h.t_exit.to_bits(), h.index);
    hits.iter().map(bits).collect()
}

/// Compares all trees with the slow twin; gives how many hits there were.
fn check(boxes: &[Aabb], rays: &[Ray]) -> Result<usize, TestCaseError> {
    let trees = trees(boxes);
    let mut count = 0;
    let mut hits = Vec::new();
    for ray in rays {
        let expected = reference::box_intervals(boxes, ray).unwrap();
        count += expected.len();
        for tree in &trees {
            let context = format!("{} {:?} {ray:?}", tree.isa(), tree.params());
            tree.intervals(ray, &mut hits);
            prop_assert_eq!(bits(&hits), bits(&expected), "{}", context);
            let closest: Vec<_> = tree.closest_hit(ray).into_iter().collect();
            prop_assert_eq!(bits(&closest), bits(&expected[..expected.len().min(1)]));
            prop_assert_eq!(tree.any_hit(ray), !expected.is_empty(), "{}", context);
        }
    }
    Ok(count)
}

fn cube(min: [i32; 3], size: i32) -> Aabb {
    let min = Vec3::from(min.map(|x| x as f32));
    Aabb {
        min,
        max: min + size as f32,
    }
}

/// Some cells of a grid of unit cubes, as a volume raycaster has them.
fn grid(n: i32) -> Vec<Aabb> {
    let mut boxes = Vec::new();
    for z in 0..n {
        for y in 0..n {
            for x in 0..n {
                if (x * 7 + y * 5 + z * 3) % 4 != 0 {
                    boxes.push(cube([x, y, z], 1));
                }
            }
        }
    }
    boxes
}

/// The interval of a ray with a box in f64, in which differences of small whole numbers and halves
/// are exact, and whether it is not empty.
fn exact(bounds: &Aabb, ray: &Ray) -> Option<(f64, f64)> {
    let (mut enter, mut leave) = (f64::from(ray.t_min), f64::from(ray.t_max));
    for axis in 0..3 {
        let (o, d) = (f64::from(ray.origin[axis]), f64::from(ray.direction[axis]));
        let (low, high) = (f64::from(bounds.min[axis]), f64::from(bounds.max[axis]));
        if d == 0.0 {
            if o < low || o > high {
                return None;
            }
            continue;
        }
        let (a, b) = ((low - o) / d, (high - o) / d);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter <= leave).then_some((enter, leave))
}

#[test]
fn intervals_contain_the_exact_ones_and_little_more() {
    let boxes = grid(6);
    let tree = BoxBvh::build(&boxes, &BuildParams::default(), &mut Default::default()).unwrap();
    let mut random = Random(5);
    let (mut touched, mut hits) = (0, Vec::new());
    for number in 0..2000 {
        // From lattice points and half points (corners, edges, faces, centres) to others.
        let lattice = |r: &mut Random| (r.vector() * 14.0).floor() * 0.5 + 3.0;
        let (origin, target) = (lattice(&mut random), lattice(&mut random));
        let mut direction = target - origin;
        match number % 4 {
            0 => direction = Vec3::new(0.0, direction.y, 0.0),
            1 => direction.x = -0.0,
            _ => {}
        }
        if direction == Vec3::ZERO {
            continue;
        }
        let ray = Ray::new(origin, direction);
        tree.intervals(&ray, &mut hits);
        for (index, bounds) in (0..).zip(&boxes) {
            let hit = hits.iter().find(|hit| hit.index == index);
            let Some((enter, leave)) = exact(bounds, &ray) else {
                // On this lattice, what is missed is missed by far more than rounding.
                assert_eq!(hit, None, "{ray:?}");
                continue;
            };
            let hit = hit.unwrap_or_else(|| panic!("box {index} is missed by {ray:?}"));
            let (t_enter, t_exit) = (f64::from(hit.t_enter), f64::from(hit.t_exit));
            assert!(
                t_enter <= enter && leave <= t_exit,
                "{hit:?} {enter} {leave} {ray:?}"
            );
            let slack = 20.0 / f64::from(1 << 20) / 0.5;
            assert!(
                enter - t_enter <= slack && t_exit - leave <= slack,
                "{hit:?} {ray:?}"
            );
            touched += 1;
        }
    }
    assert!(touched > 4000, "{touched}");
}

#[test]
fn rays_from_inside_along_faces_and_through_corners() {
    let boxes = [
        cube([0; 3], 1),
        cube([1, 0, 0], 1),
        cube([4, 0, 0], 2),
        cube([0; 3], 8),
    ];
    let indices = |hits: &[BoxHit]| hits.iter().map(|h| h.index).collect::<Vec<_>>();
    for tree in trees(&boxes) {
        let mut hits = Vec::new();
        // From inside: all boxes that hold the origin are entered at 0, the lowest index first.
        let inside = Ray::new([0.5, 0.5, 0.5], [1.0, 0.0, 0.0]);
        let hit = tree.closest_hit(&inside).unwrap();
        assert_eq!((hit.t_enter, hit.index), (0.0, 0));
        assert!((hit.t_exit - 0.5).abs() < 1e-5);
        tree.intervals(&inside, &mut hits);
        assert_eq!(indices(&hits), [0, 3, 1, 2]);
        assert_eq!(
            tree.closest_hit(&inside.with_range(1.0, 1.2))
                .unwrap()
                .index,
            1
        );
        // A whole number of intervals: from a gap in the small boxes only the large one is left.
        tree.intervals(&inside.with_range(2.0, 3.0), &mut hits);
        assert_eq!(bits(&hits), [(2f32.to_bits(), 3f32.to_bits(), 3)]);
        // In the plane of a face, and along an edge, either sign of zero.
        for zero in [0.0, -0.0] {
            let on_face = Ray::new([-1.0, 0.5, 0.0], [1.0, zero, zero]);
            tree.intervals(&on_face, &mut hits);
            assert_eq!(indices(&hits), [0, 3, 1, 2]);
            let on_edge = Ray::new([9.0, 0.0, 0.0], [-1.0, zero, zero]);
            tree.intervals(&on_edge, &mut hits);
            assert_eq!(indices(&hits), [3, 2, 1, 0]);
        }
        // Through a corner only, and from a face outwards.
        assert!(tree.any_hit(&Ray::new([-1.0, 1.0, 0.0], [1.0, -1.0, 0.0])));
        let outwards = Ray::new([8.0, 4.0, 4.0], [1.0, 0.0, 0.0]);
        assert_eq!(tree.closest_hit(&outwards).unwrap().index, 3);
        // Parallel to an axis, outside.
        assert!(!tree.any_hit(&Ray::new([-1.0, 8.001, 1.0], [1.0, 0.0, 0.0])));
        assert!(!tree.any_hit(&outwards.with_range(0.001, f32::INFINITY)));
    }
}

/// Two neighbouring values, with one of which a ray enters the first box and with the other not;
/// both are 0 or positive.
fn edge_of_pad(
    boxes: &[Aabb],
    inside: f32,
    outside: f32,
    ray: impl Fn(f32) -> Ray,
) -> Option<[Ray; 2]> {
    let enters = |bits| {
        let hits = reference::box_intervals(boxes, &ray(f32::from_bits(bits))).unwrap();
        hits.iter().any(|hit| hit.index == 0)
    };
    let (mut inside, mut outside) = (inside.to_bits(), outside.to_bits());
    if !enters(inside) || enters(outside) {
        return None;
    }
    while inside.abs_diff(outside) > 1 {
        let middle = inside.midpoint(outside);
        *(if enters(middle) {
            &mut inside
        } else {
            &mut outside
        }) = middle;
    }
    Some([inside, outside].map(|bits| ray(f32::from_bits(bits))))
}

/// Boxes of nodes are padded by more than those of primitives, for they are computed by other
/// operations: rays at the very edge of a primitive's pad need the difference.
#[test]
fn rays_at_the_edge_of_the_pad_enter_every_node_above() {
    let mut random = Random(11);
    let mut cases = 0;
    for _ in 0..60 {
        let boxes = [3.0, 4.0, 5.0].map(|place| {
            let a = random.vector() + place;
            Aabb::EMPTY.extended_by(a).extended_by(a + random.vector())
        });
        let centre = (boxes[0].min + boxes[0].max) * 0.5;
        let mut rays = vec![];
        for _ in 0..8 {
            let direction = random.vector();
            let origin = centre - direction * 2.0;
            // Past the box along an axis, and up to it.
            rays.extend(edge_of_pad(&boxes, origin.x, origin.x + 9.0, |x| {
                Ray::new(Vec3 { x, ..origin }, direction)
            }));
            rays.extend(edge_of_pad(&boxes, 2.0, 0.0, |t_max| {
                Ray::new(origin, direction).with_range(0.0, t_max)
            }));
        }
        cases += rays.len();
        check(&boxes, rays.as_flattened()).unwrap();
    }
    assert!(cases > 600, "{cases}");
}

#[test]
fn segments_are_the_union_of_intervals() {
    let boxes = [
        cube([0; 3], 1),
        cube([1, 0, 0], 1),
        cube([4, 0, 0], 4),
        cube([5, 0, 0], 1),
        cube([9, 0, 0], 1),
    ];
    let tree = BoxBvh::build(&boxes, &BuildParams::default(), &mut Default::default()).unwrap();
    let mut hits = Vec::new();
    tree.intervals(&Ray::new([-1.0, 0.5, 0.5], [1.0, 0.0, 0.0]), &mut hits);
    let rounded: Vec<_> = segments(&hits)
        .map(|(a, b)| (a.round(), b.round()))
        .collect();
    assert_eq!(rounded, [(1.0, 3.0), (5.0, 9.0), (10.0, 11.0)]);
    assert_eq!(segments(&[]).count(), 0);
}

#[test]
fn boxes_that_are_none_are_an_error() {
    let good = cube([0; 3], 1);
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let mut bad = vec![Aabb::EMPTY];
    for axis in 0..3 {
        for value in [nan, inf, -inf] {
            let (mut a, mut b) = (good, good);
            a.min[axis] = value;
            b.max[axis] = value;
            bad.extend([a, b]);
        }
        let mut inverted = good;
        inverted.min[axis] = 2.0;
        bad.push(inverted);
    }
    for bad in bad {
        let boxes = [good, bad, good, bad];
        let built = BoxBvh::build(&boxes, &BuildParams::default(), &mut Default::default());
        assert_eq!(
            built.unwrap_err(),
            BuildError::InvalidBox { index: 1 },
            "{bad:?}"
        );
        let ray = Ray::new(Vec3::ZERO, Vec3::X);
        assert!(reference::box_intervals(&boxes, &ray).is_err());
    }
    for size in [1e31, 1e-31] {
        let boxes = [Aabb {
            min: Vec3::ZERO,
            max: Vec3::splat(size),
        }];
        let built = BoxBvh::build(&boxes, &BuildParams::default(), &mut Default::default());
        assert!(matches!(built, Err(BuildError::CoordinateRange { .. })));
    }
    let mut params = BuildParams::default();
    params.branching_factor = 17;
    let built = BoxBvh::build(&[good], &params, &mut Default::default());
    assert!(matches!(built, Err(BuildError::Parameters(_))));
}

#[test]
fn nothing_flat_boxes_and_points() {
    let ray = Ray::new([-1.0, 0.5, 0.5], [1.0, 0.0, 0.0]);
    for tree in trees(&[]) {
        assert_eq!(tree.closest_hit(&ray), None);
        assert!(!tree.any_hit(&ray) && tree.bounds().is_empty());
    }
    let flat = |x: f32| Aabb {
        min: Vec3::new(x, 0.0, 0.0),
        max: Vec3::new(x, 1.0, 1.0),
    };
    let point = Aabb {
        min: Vec3::new(3.0, 0.5, 0.5),
        max: Vec3::new(3.0, 0.5, 0.5),
    };
    let boxes = [point, flat(2.0), flat(1.0), flat(1.0)];
    let hits = check(&boxes, &[ray]).unwrap();
    assert_eq!(hits, 4);
    let tree = BoxBvh::build(&boxes, &BuildParams::default(), &mut Default::default()).unwrap();
    assert_eq!(tree.closest_hit(&ray).unwrap().index, 2);
}

#[test]
fn rays_that_can_enter_nothing() {
    let (inf, nan) = (f32::INFINITY, f32::NAN);
    let origin = Vec3::splat(-3.0);
    let mut hits = vec![];
    for tree in trees(&grid(3)) {
        let good = Ray::new(origin, Vec3::ONE);
        assert!(tree.any_hit(&good) && tree.any_hit(&good.with_range(-5.0, inf)));
        tree.intervals(&good, &mut hits);
        assert!(!hits.is_empty());
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
            assert!(
                tree.closest_hit(&ray).is_none() && !tree.any_hit(&ray),
                "{ray:?}"
            );
            tree.intervals(&ray, &mut hits);
            assert!(
                hits.is_empty(),
                "what an earlier ray left is dropped: {ray:?}"
            );
        }
    }
}

fn any_box(range: f32) -> impl Strategy<Value = Aabb> {
    let corner = move || prop::array::uniform3(-range..range).prop_map(Vec3::from);
    (corner(), corner(), 0f32..1.0).prop_map(|(a, b, size)| {
        let b = a + (b - a) * size;
        Aabb::EMPTY.extended_by(a).extended_by(b)
    })
}

fn lattice_box() -> impl Strategy<Value = Aabb> {
    let corner = || prop::array::uniform3(-3i32..=3);
    (corner(), 0..3).prop_map(|(min, size)| cube(min, size))
}

fn lattice_ray() -> impl Strategy<Value = Ray> {
    let vector = || prop::array::uniform3(-4i8..=4).prop_map(|v| Vec3::from(v.map(f32::from)));
    (vector(), vector()).prop_map(|(origin, direction)| Ray::new(origin, direction))
}

fn any_ray(range: f32) -> impl Strategy<Value = Ray> {
    let vector = move || prop::array::uniform3(-range..range).prop_map(Vec3::from);
    (vector(), vector(), 0f32..1.0, 0f32..3.0)
        .prop_map(|(o, d, t_min, length)| Ray::new(o, d).with_range(t_min, t_min + length))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_boxes(
        boxes in prop::collection::vec(any_box(1.0), 0..80),
        rays in prop::collection::vec(any_ray(2.0), 10),
    ) {
        check(&boxes, &rays)?;
    }

    #[test]
    fn boxes_that_meet_exactly(
        boxes in prop::collection::vec(lattice_box(), 1..80),
        rays in prop::collection::vec(lattice_ray(), 10),
    ) {
        check(&boxes, &rays)?;
    }

    #[test]
    fn any_scale(
        boxes in prop::collection::vec(any_box(1.0), 1..40),
        rays in prop::collection::vec(any_ray(2.0), 5),
        exponent in -99i32..99,
    ) {
        // A power of two scales intervals of unscaled directions and changes no other bit.
        let scale = 2f32.powi(exponent);
        let scaled = |v: Vec3| v * scale;
        let boxes_scaled: Vec<_> = boxes
            .iter()
            .map(|b| Aabb { min: scaled(b.min), max: scaled(b.max) })
            .collect();
        let large = boxes.iter().any(|b| {
            b.min.abs().max(b.max.abs()).max_element() > 0.5
        });
        prop_assume!(large);
        for ray in &rays {
            let ray_scaled = Ray::new(scaled(ray.origin), scaled(ray.direction))
                .with_range(ray.t_min, ray.t_max);
            let expected = reference::box_intervals(&boxes, ray).unwrap();
            for tree in trees(&boxes_scaled).iter().step_by(7) {
                let mut hits = Vec::new();
                tree.intervals(&ray_scaled, &mut hits);
                prop_assert_eq!(bits(&hits), bits(&expected));
            }
        }
    }
}
