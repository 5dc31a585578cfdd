//! What the triangle tests have in common: four triangles at once, and a box that keeps the
//! distance in bounds.
//!
//! Invariants, on which it rests that no choice of tree, kernel or instruction set changes a
//! picture:
//! - one fixed sequence of operations that round once each, none of them fused;
//! - the distance lies inside the triangle's own box, widened by [`TRIANGLE_PAD`]: a grazing ray
//!   can give a quotient any value, and one outside the box would be found by some trees only,
//!   since others pass the box by. Distances are therefore clamped to the box, and a ray that
//!   misses the box misses the triangle;
//! - whether a triangle is hit depends on the ray alone, not on what was hit before.
//!
//! Why every enclosing box is entered: let u = 2⁻²⁴, m = S + |o| per axis with S the bound of
//! scaled coordinates, r the reciprocal direction, and take the computed r for exact, as both tests
//! use it. A distance to a plane of the triangle's box is off by at most 2·u·m·|r|, and by u·m·|r|
//! more after the pad; a box test of a node, whose products may be fused or not, by at most
//! 4.1·u·m·|r|. So a box that is padded by 7.1·u·m·|r| more than the triangle's own, and encloses
//! it, contains its interval; the difference of [`NODE_PAD`] and [`TRIANGLE_PAD`] is 16u. (`fast`
//! adds what its planes are off by, `robust` has a larger margin than m·|r|.)
//!
//! Where the builder cuts triangles (spatial splits) the parts' boxes cover the triangle and not its
//! box. Then the argument holds for hits whose point is in the triangle and whose distance is right
//! to about 2·u·m·|r|; a ray in the plane of a triangle, for which all that the test computes is
//! noise, can be accepted by the test and enter none of the parts.

use super::{
    kernel::Candidate,
    packet::{PACKET_SIZE, PacketRays},
    setup::RaySetup,
};
use crate::{layout::block::Point, simd::Lanes};

/// Half an ulp of 1: the unit roundoff of f32.
pub(crate) const UNIT_ROUNDOFF: f32 = 1.0 / (1 << 24) as f32;

/// Widening of a triangle's box, in units of the margin of the test.
pub(crate) const TRIANGLE_PAD: f32 = 8.0 * UNIT_ROUNDOFF;

/// Widening of a node's boxes, in the same units.
pub(crate) const NODE_PAD: f32 = 24.0 * UNIT_ROUNDOFF;

/// A test of the triangles of a block of the format `B`.
pub(crate) trait TriangleTest<B> {
    /// What does not change along a ray.
    type Ray<L: Lanes<4>>: Copy;

    /// The unit of the pads per axis: at least m·|r|.
    fn margin(ray: &RaySetup) -> [f32; 3];

    fn prepare<L: Lanes<4>>(ray: &RaySetup) -> Self::Ray<L>;

    /// Tests a block. `t_max` may be any distance at or beyond which hits are of no interest; the
    /// caller still has to compare for ties.
    fn test<L: Lanes<4>>(
        ray: &RaySetup,
        prepared: &Self::Ray<L>,
        block: &B,
        points: &[Point],
        t_max: f32,
    ) -> BlockHits<L>;

    /// Tests all rays of a packet with a block, a ray in a lane, and tells each hit, with the ray's lane. Returns the
    /// rays that hit something, as bits; `None` if this test takes rays one by one only.
    #[inline(always)]
    fn test_packet<L: Lanes<4>, R: Lanes<PACKET_SIZE>>(
        _: &PacketRays,
        _: &B,
        _: &[Point],
        _: impl FnMut(usize, Candidate),
    ) -> Option<u32> {
        None
    }
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

impl<L: Lanes<4>> BlockHits<L> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        let zero = L::splat(0.0);
        Self {
            mask: 0,
            t: zero,
            u: zero,
            v: zero,
            den: zero,
        }
    }
}

/// Where the ray enters and leaves the boxes of the triangles, widened by `pad`. The axes may come
/// in any order.
#[inline(always)]
pub(crate) fn box_interval<const N: usize, L: Lanes<N>>(
    [a, b, c]: [[L; 3]; 3],
    origin: [L; 3],
    reciprocal: [L; 3],
    pad: [L; 3],
) -> (L, L) {
    let (mut enter, mut leave) = (L::splat(f32::NEG_INFINITY), L::splat(f32::INFINITY));
    for axis in 0..3 {
        let low = a[axis].min(b[axis]).min(c[axis]);
        let high = a[axis].max(b[axis]).max(c[axis]);
        let low = low.sub(origin[axis]).mul(reciprocal[axis]);
        let high = high.sub(origin[axis]).mul(reciprocal[axis]);
        // The sign of the direction swaps the planes; min and max of the two do the same.
        enter = enter.max(low.min(high).sub(pad[axis]));
        leave = leave.min(low.max(high).add(pad[axis]));
    }
    (enter, leave)
}

#[inline(always)]
pub(super) fn sub<const N: usize, L: Lanes<N>>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0].sub(b[0]), a[1].sub(b[1]), a[2].sub(b[2])]
}

#[inline(always)]
pub(super) fn cross<const N: usize, L: Lanes<N>>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [
        determinant(a[1], a[2], b[1], b[2]),
        determinant(a[2], a[0], b[2], b[0]),
        determinant(a[0], a[1], b[0], b[1]),
    ]
}

/// a·d − b·c.
#[inline(always)]
fn determinant<const N: usize, L: Lanes<N>>(a: L, b: L, c: L, d: L) -> L {
    a.mul(d).sub(b.mul(c))
}

#[inline(always)]
pub(super) fn dot<const N: usize, L: Lanes<N>>(a: [L; 3], b: [L; 3]) -> L {
    a[0].mul(b[0]).add(a[1].mul(b[1])).add(a[2].mul(b[2]))
}

#[inline(always)]
pub(super) fn store<L: Lanes<4>>([x, y, z]: [L; 3]) -> [[f32; 4]; 3] {
    [x.store(), y.store(), z.store()]
}
