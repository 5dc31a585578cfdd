//! The test of boxes as primitives, in the shape of a triangle test: the distance is that of entry,
//! the first weight that of exit.
//!
//! One subtraction and one multiplication per plane, then a pad: never fused, so that the interval
//! is a function of ray and box alone. In the numbers of `triangle`: with the true reciprocal, a
//! distance to a plane is off by at most 3.1·u·m·|r|, and by u·m·|r| more after the pad, which is
//! 8·u·m·|r|. So the interval contains the exact one, and is wider by at most 12.1·u·m·|r| at either
//! end. That is also the triangle's own padded box in `triangle`, hence every enclosing box of a
//! node is entered, at or before the distance of entry. A component of the direction below 2⁻⁶⁰
//! acts as 2⁻⁶⁰: a ray in a face's plane, or nearer to it than 8·u·m, is inside.

use super::{
    setup::RaySetup,
    triangle::{BlockHits, TRIANGLE_PAD, TriangleTest},
};
use crate::{
    layout::{block::Point, box_block::BoxBlock},
    simd::{Lanes, splat_all},
};

/// Names the test.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxTest;

/// A ray in lanes of boxes.
#[derive(Clone, Copy)]
pub(crate) struct BoxRay<L> {
    origin: [L; 3],
    reciprocal: [L; 3],
    pad: [L; 3],
    near_plane: [usize; 3],
}

impl TriangleTest<BoxBlock> for BoxTest {
    type Ray<L: Lanes<4>> = BoxRay<L>;

    #[inline(always)]
    fn margin(ray: &RaySetup) -> [f32; 3] {
        ray.margin
    }

    #[inline(always)]
    fn prepare<L: Lanes<4>>(ray: &RaySetup) -> BoxRay<L> {
        BoxRay {
            origin: splat_all(ray.origin),
            reciprocal: splat_all(ray.reciprocal),
            pad: splat_all(ray.margin.map(|margin| margin * TRIANGLE_PAD)),
            near_plane: [0, 1, 2].map(|axis| 2 * axis + usize::from(ray.reciprocal[axis] < 0.0)),
        }
    }

    #[inline(always)]
    fn test<L: Lanes<4>>(
        ray: &RaySetup,
        prepared: &BoxRay<L>,
        block: &BoxBlock,
        _points: &[Point],
        t_max: f32,
    ) -> BlockHits<L> {
        let (mut enter, mut leave) = (L::splat(ray.t_min), L::splat(ray.t_max));
        for axis in 0..3 {
            let plane = prepared.near_plane[axis];
            let near = L::load(&block.planes[plane]).sub(prepared.origin[axis]);
            let far = L::load(&block.planes[plane ^ 1]).sub(prepared.origin[axis]);
            let near = near.mul(prepared.reciprocal[axis]);
            let far = far.mul(prepared.reciprocal[axis]);
            enter = enter.max(near.sub(prepared.pad[axis]));
            leave = leave.min(far.add(prepared.pad[axis]));
        }
        let hit = enter.le(leave) & enter.le(L::splat(t_max));
        BlockHits {
            mask: L::bits(hit),
            t: enter,
            u: leave,
            v: L::splat(0.0),
            den: L::splat(1.0),
        }
    }
}
