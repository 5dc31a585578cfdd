//! Closed meshes on which tests of triangles go wrong: no ray from inside may leave them, and every vertex is within a
//! surface.
//!
//! Invariant: triangles meet at places that are equal to the last bit, two at each edge.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use raywright_bvh::Vec3;

use crate::TriangleSet;

/// The closed meshes, by name.
pub const CLOSED: [&str; 6] = [
    "sphere",
    "far sphere",
    "spikes",
    "cube",
    "terrain",
    "spindle",
];

/// The closed mesh of a name; `None` if there is none.
#[must_use]
pub fn closed(name: &str) -> Option<TriangleSet> {
    let triangles = match name {
        "sphere" => sphere(6),
        // Coordinates have a thousandth of their bits left, and triangles are of rounding's size.
        "far sphere" => moved(sphere(6), |v| v + Vec3::splat(10_000.0)),
        "spikes" => moved(sphere(5), |v| v * (0.1 + 0.9 * share_of(v))),
        "cube" => prism(16, |_| 1.0),
        "terrain" => prism(64, |place| 0.5 + 0.5 * share_of(place)),
        "spindle" => spindle(200),
        _ => return None,
    };
    Some(TriangleSet {
        name: name.to_owned(),
        triangles,
        geometries: 1,
    })
}

fn moved(mut triangles: Vec<[Vec3; 3]>, to: impl Fn(Vec3) -> Vec3) -> Vec<[Vec3; 3]> {
    for corner in triangles.iter_mut().flatten() {
        *corner = to(*corner);
    }
    triangles
}

/// A number of 0..1 that is the place's own.
fn share_of(place: Vec3) -> f32 {
    let seed = place.to_array().map(|x| u64::from((x + 0.0).to_bits()));
    let seed = seed[0] ^ seed[1].rotate_left(21) ^ seed[2].rotate_left(42);
    Xoshiro256PlusPlus::seed_from_u64(seed).random()
}

/// An octahedron whose triangles are divided into four so many times, on the unit sphere.
fn sphere(levels: u32) -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    for x in [Vec3::X, -Vec3::X] {
        for (y, z) in [
            (Vec3::Y, Vec3::Z),
            (Vec3::Z, -Vec3::Y),
            (-Vec3::Y, -Vec3::Z),
            (-Vec3::Z, Vec3::Y),
        ] {
            triangles.push(if x.x > 0.0 { [x, y, z] } else { [x, z, y] });
        }
    }
    for _ in 0..levels {
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                // Sums do not depend on their order: neighbours find the same.
                let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| (p + q).normalize());
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    triangles
}

/// A cube of `n` squares per side; `height` of a place of its floor is where the lid is.
fn prism(n: u32, height: impl Fn(Vec3) -> f32) -> Vec<[Vec3; 3]> {
    let at = |i: u32| i as f32 / n as f32;
    let vertex = |[x, y, z]: [u32; 3]| {
        let floor = Vec3::new(at(x), 0.0, at(z));
        floor.with_y(at(y) * height(floor))
    };
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for side in [0, n] {
            for i in 0..n {
                for j in 0..n {
                    let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                    let [a, b, c, d] = corners.map(|(i, j)| {
                        let mut place = [side, i, j];
                        place.rotate_right(axis);
                        vertex(place)
                    });
                    triangles.extend(if side == 0 {
                        [[a, c, b], [a, d, c]]
                    } else {
                        [[a, b, c], [a, c, d]]
                    });
                }
            }
        }
    }
    triangles
}

/// Two tops over a circle of `n` points: slivers, all at two vertices.
fn spindle(n: u32) -> Vec<[Vec3; 3]> {
    let on_circle = |i: u32| {
        let turn = std::f32::consts::TAU * ((i % n) as f32 / n as f32);
        Vec3::new(turn.cos(), 0.1 * turn.sin(), turn.sin())
    };
    (0..n)
        .flat_map(|i| {
            let (p, q) = (on_circle(i), on_circle(i + 1));
            [[Vec3::Y, q, p], [-Vec3::Y, p, q]]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    #[test]
    fn every_edge_has_two_triangles_that_run_opposite_ways() {
        for name in CLOSED {
            let mut counts: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
            let place = |v: Vec3| v.to_array().map(|x| (x + 0.0).to_bits());
            let set = closed(name).unwrap();
            for corners in &set.triangles {
                for i in 0..3 {
                    let ends = [corners[i], corners[(i + 1) % 3]].map(place);
                    *counts.entry(ends).or_default() += 1;
                    *counts.entry([ends[1], ends[0]]).or_default() -= 1;
                }
            }
            assert!(counts.values().all(|&count| count == 0), "{name}");
            assert!(set.triangles.len() >= 400, "{name}");
        }
        assert!(closed("else").is_none());
    }
}
