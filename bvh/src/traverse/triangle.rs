//! The triangle test: Möller, Trumbore, *Fast, Minimum Storage Ray/Triangle Intersection*, 1997,
//! in the form of Embree's fast mode, four triangles at once.
//!
//! Invariants, on which it rests that no choice of tree, kernel or instruction set changes a
//! picture:
//! - one fixed sequence of operations that round once each, none of them fused;
//! - the distance lies inside the triangle's own box, widened by [`TRIANGLE_PAD`]: a grazing ray
//!   can give `T / den` any value, and one outside the box would be found by some trees only,
//!   since others pass the box by. Distances are therefore clamped to the box, and a ray that
//!   misses the box misses the triangle;
//! - whether a triangle is hit depends on the ray alone, not on what was hit before.
//!
//! Why every enclosing box is entered: let u = 2⁻²⁴, m = S + |o| per axis with S the bound of
//! scaled coordinates, r the reciprocal direction. The triangle's planes computed from its edges
//! are off by at most 3uS, and their distances by 3.1·u·m·|r| more; a box test is off by at most
//! 4.1·u·m·|r|. So a box that is padded by 10.3·u·m·|r| more than the triangle's own contains its
//! interval. [`NODE_PAD`] − [`TRIANGLE_PAD`] is 16u. And a true hit lies within 7.3·u·m·|r| of the
//! triangle's computed box, below [`TRIANGLE_PAD`]: no true hit is moved.

use super::kernel::RaySetup;
use crate::{layout::triangles::TriangleBlock, simd::Lanes};

/// Half an ulp of 1: the unit roundoff of f32.
pub(crate) const UNIT_ROUNDOFF: f32 = 1.0 / (1 << 24) as f32;

/// Widening of a triangle's box, in units of (S + |o|)·|r|.
pub(crate) const TRIANGLE_PAD: f32 = 8.0 * UNIT_ROUNDOFF;

/// Widening of a node's boxes, in the same units.
pub(crate) const NODE_PAD: f32 = 24.0 * UNIT_ROUNDOFF;

/// A ray in lanes of triangles.
#[derive(Clone, Copy)]
pub(crate) struct RayLanes<L> {
    origin: [L; 3],
    direction: [L; 3],
}

/// The lanes of a block that a ray hits, as bits, with distance and weights. The weights are still
/// to be divided by `den`: only those of the last hit that is kept ever are.
pub(crate) struct BlockHits<L> {
    pub(crate) mask: u32,
    pub(crate) t: L,
    pub(crate) u: L,
    pub(crate) v: L,
    pub(crate) den: L,
}

impl<L: Lanes<4>> RayLanes<L> {
    #[inline(always)]
    pub(crate) fn new(ray: &RaySetup) -> Self {
        Self {
            origin: ray.origin.map(L::splat),
            direction: ray.direction.map(L::splat),
        }
    }

    /// Tests a block. `t_max` may be any distance at or beyond which hits are of no interest; the
    /// caller still has to compare for ties.
    #[inline(always)]
    pub(crate) fn test(&self, ray: &RaySetup, block: &TriangleBlock, t_max: f32) -> BlockHits<L> {
        let vertex = block.vertex.each_ref().map(L::load);
        let edge_1 = block.edge_1.each_ref().map(L::load);
        let edge_2 = block.edge_2.each_ref().map(L::load);
        let to_vertex = sub(vertex, self.origin);
        let r = cross(to_vertex, self.direction);
        let normal = cross(edge_2, edge_1);
        let den = dot(normal, self.direction);
        let u = dot(r, edge_2).xor_sign(den);
        let v = dot(r, edge_1).xor_sign(den);
        let den_abs = den.abs();
        let zero = L::splat(0.0);
        let inside = den.is_nonzero() & zero.le(u) & zero.le(v) & u.add(v).le(den_abs);
        if L::bits(inside) == 0 {
            return BlockHits {
                mask: 0,
                t: zero,
                u: zero,
                v: zero,
                den: zero,
            };
        }
        let t = dot(normal, to_vertex).xor_sign(den).div(den_abs);
        let (enter, leave) = box_interval(ray, self.origin, vertex, edge_1, edge_2);
        let t = t.max(enter).min(leave);
        let hit = inside & enter.le(leave) & L::splat(ray.t_min).le(t) & t.le(L::splat(t_max));
        BlockHits {
            mask: L::bits(hit),
            t,
            u,
            v,
            den: den_abs,
        }
    }
}

/// Where the ray enters and leaves the boxes of the triangles, widened by [`TRIANGLE_PAD`].
#[inline(always)]
fn box_interval<L: Lanes<4>>(
    ray: &RaySetup,
    origin: [L; 3],
    vertex: [L; 3],
    edge_1: [L; 3],
    edge_2: [L; 3],
) -> (L, L) {
    let (mut enter, mut leave) = (L::splat(f32::NEG_INFINITY), L::splat(f32::INFINITY));
    for axis in 0..3 {
        let a = vertex[axis];
        let b = a.sub(edge_1[axis]);
        let c = a.add(edge_2[axis]);
        let reciprocal = L::splat(ray.reciprocal[axis]);
        let pad = L::splat(ray.triangle_pad[axis]);
        let at = |plane: L| plane.sub(origin[axis]).mul(reciprocal);
        let (low, high) = (at(a.min(b).min(c)), at(a.max(b).max(c)));
        // The sign of the direction swaps the planes; min and max of the two do the same.
        enter = enter.max(low.min(high).sub(pad));
        leave = leave.min(low.max(high).add(pad));
    }
    (enter, leave)
}

#[inline(always)]
fn sub<L: Lanes<4>>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0].sub(b[0]), a[1].sub(b[1]), a[2].sub(b[2])]
}

#[inline(always)]
fn cross<L: Lanes<4>>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    let component = |i: usize, j: usize| a[i].mul(b[j]).sub(a[j].mul(b[i]));
    [component(1, 2), component(2, 0), component(0, 1)]
}

#[inline(always)]
fn dot<L: Lanes<4>>(a: [L; 3], b: [L; 3]) -> L {
    a[0].mul(b[0]).add(a[1].mul(b[1])).add(a[2].mul(b[2]))
}
