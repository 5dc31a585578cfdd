//! One ray and all boxes of a node: slabs (Kay, Kajiya, *Ray Tracing Complex Scenes*, 1986) with one multiplication and
//! addition per plane. Rounding is paid for by one pad per ray and axis, added once (see `triangle` for the bound).

use super::setup::RaySetup;
use crate::{
    layout::node::Node,
    simd::{Lanes, splat_all},
};

/// What the box test needs of a ray.
pub(super) struct BoxRay {
    pub(super) octant: usize,
    reciprocal: [f32; 3],
    near_addend: [f32; 3],
    far_addend: [f32; 3],
    t_min: f32,
    near_plane: [usize; 3],
}

impl BoxRay {
    #[inline(always)]
    pub(super) fn new(ray: &RaySetup, margin: [f32; 3]) -> Self {
        let (mut near_addend, mut far_addend, mut near_plane) = ([0.0; 3], [0.0; 3], [0; 3]);
        for axis in 0..3 {
            [near_addend[axis], far_addend[axis]] = ray.addends(margin, axis);
            near_plane[axis] = 2 * axis + (ray.octant() >> axis & 1);
        }
        Self {
            octant: ray.octant(),
            reciprocal: ray.reciprocal,
            near_addend,
            far_addend,
            t_min: ray.t_min,
            near_plane,
        }
    }
}

/// A ray in lanes of children.
pub(super) struct BoxLanes<L> {
    reciprocal: [L; 3],
    near_addend: [L; 3],
    far_addend: [L; 3],
    near_plane: [usize; 3],
    t_min: L,
}

impl<L> BoxLanes<L> {
    #[inline(always)]
    pub(super) fn new<const N: usize>(ray: &BoxRay) -> Self
    where
        L: Lanes<N>,
    {
        Self {
            reciprocal: splat_all(ray.reciprocal),
            near_addend: splat_all(ray.near_addend),
            far_addend: splat_all(ray.far_addend),
            near_plane: ray.near_plane,
            t_min: L::splat(ray.t_min),
        }
    }

    #[inline(always)]
    fn near<const N: usize, const W: usize>(&self, node: &Node<N, W>, axis: usize) -> L
    where
        L: Lanes<N>,
    {
        L::load(&node.planes[self.near_plane[axis]])
            .mul_add(self.reciprocal[axis], self.near_addend[axis])
    }

    #[inline(always)]
    fn far<const N: usize, const W: usize>(&self, node: &Node<N, W>, axis: usize) -> L
    where
        L: Lanes<N>,
    {
        L::load(&node.planes[self.near_plane[axis] ^ 1])
            .mul_add(self.reciprocal[axis], self.far_addend[axis])
    }

    /// Distances at which the boxes of a node are entered, and one bit per box that is.
    #[inline(always)]
    pub(super) fn test<const N: usize, const W: usize>(
        &self,
        node: &Node<N, W>,
        t_max: f32,
    ) -> (L, u32)
    where
        L: Lanes<N>,
    {
        let enter = self.near(node, 0).max(self.near(node, 1));
        let enter = enter.max(self.near(node, 2).max(self.t_min));
        let leave = self.far(node, 0).min(self.far(node, 1));
        let leave = leave.min(self.far(node, 2).min(L::splat(t_max)));
        (enter, L::bits(enter.le(leave)))
    }
}
