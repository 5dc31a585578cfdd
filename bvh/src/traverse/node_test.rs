//! One ray and all boxes of a node: slabs (Kay, Kajiya, *Ray Tracing Complex Scenes*, 1986) with one multiplication and
//! addition per plane. Rounding is paid for by one pad per ray and axis, added once (see `triangle` for the bound).

use super::{
    setup::{RaySetup, in_lanes},
    triangle::NODE_PAD,
};
use crate::{
    layout::node::Node,
    simd::{Lanes, splat_all},
};

/// What the box test needs of a ray, by axis; the fourth is 0.
pub(super) struct BoxRay {
    pub(super) octant: usize,
    reciprocal: [f32; 4],
    /// What is added to the product of a near plane and a far plane of an axis with the reciprocal.
    pub(super) near_addend: [f32; 4],
    pub(super) far_addend: [f32; 4],
    t_min: f32,
}

impl BoxRay {
    #[inline(always)]
    pub(super) fn new<T: Lanes<4>>(ray: &RaySetup, margin: [f32; 3]) -> Self {
        let reciprocal = in_lanes::<T>(ray.reciprocal);
        let offset = in_lanes::<T>(ray.origin).mul(reciprocal);
        let pad = in_lanes::<T>(margin).mul(T::splat(NODE_PAD));
        Self {
            octant: ray.octant(),
            reciprocal: reciprocal.store(),
            near_addend: offset.add(pad).xor_sign(T::splat(-1.0)).store(),
            far_addend: pad.sub(offset).store(),
            t_min: ray.t_min,
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
        let ([rx, ry, rz, _], [nx, ny, nz, _]) = (ray.reciprocal, ray.near_addend);
        let [fx, fy, fz, _] = ray.far_addend;
        Self {
            reciprocal: splat_all([rx, ry, rz]),
            near_addend: splat_all([nx, ny, nz]),
            far_addend: splat_all([fx, fy, fz]),
            near_plane: [0, 1, 2].map(|axis| 2 * axis + (ray.octant >> axis & 1)),
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

    /// Distances at which the boxes of a node are entered, and which are.
    #[inline(always)]
    pub(super) fn test<const N: usize, const W: usize>(
        &self,
        node: &Node<N, W>,
        t_max: f32,
    ) -> (L, L::Mask)
    where
        L: Lanes<N>,
    {
        let enter = self.near(node, 0).max(self.near(node, 1));
        let enter = enter.max(self.near(node, 2).max(self.t_min));
        let leave = self.far(node, 0).min(self.far(node, 1));
        let leave = leave.min(self.far(node, 2).min(L::splat(t_max)));
        (enter, enter.le(leave))
    }
}
