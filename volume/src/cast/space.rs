//! Empty space in lanes: how far a ray may go on.
//!
//! Zuiderveld, Koning, Viergever, *Acceleration of Ray-Casting Using 3-D Distance Transforms*, 1992,
//! on blocks.

use raywright_bvh::simd::GatherLanes;

use super::view::SMALLEST_STEP;
use crate::distance::DistanceMap;

/// The distance map, for lanes.
#[derive(Clone, Copy)]
pub(crate) struct Space<'a, const N: usize, L: GatherLanes<N>> {
    map: &'a DistanceMap,
    blocks_across: L::Int,
    blocks_down: L::Int,
    /// Cells along the edge of a block.
    edge: L,
    /// More than samples are off by.
    margin: L,
}

impl<'a, const N: usize, L: GatherLanes<N>> Space<'a, N, L> {
    #[inline(always)]
    pub(crate) fn new(map: &'a DistanceMap, margin: f32) -> Self {
        Self {
            map,
            blocks_across: L::splat_int(map.dims[0] as i32),
            blocks_down: L::splat_int(map.dims[1] as i32),
            edge: L::splat((1_u32 << map.shift) as f32),
            margin: L::splat(margin),
        }
    }

    /// The blocks of cells and their distances from what can be seen, in blocks.
    #[inline(always)]
    pub(crate) fn distance(&self, cell: &[L::Int; 3]) -> ([L::Int; 3], L) {
        let x = L::shift_int(cell[0], self.map.shift);
        let y = L::shift_int(cell[1], self.map.shift);
        let z = L::shift_int(cell[2], self.map.shift);
        let block = L::add_int(L::mul_int(z, self.blocks_down), y);
        let block = L::add_int(L::mul_int(block, self.blocks_across), x);
        let distance = L::from_int(L::gather_bytes(&self.map.distances, block));
        ([x, y, z], distance)
    }

    /// How rays with these steps leave blocks.
    #[inline(always)]
    pub(crate) fn exits(&self, step: &[L; 3]) -> [Exit<L>; 3] {
        [
            Exit::new(step[0], self.edge, self.margin),
            Exit::new(step[1], self.edge, self.margin),
            Exit::new(step[2], self.edge, self.margin),
        ]
    }

    /// How many samples more certainly lie in the empty cubes of blocks around places.
    #[inline(always)]
    pub(crate) fn samples_inside(
        &self,
        exits: &[Exit<L>; 3],
        block: &[L::Int; 3],
        distance: L,
        place: &[L; 3],
    ) -> L {
        let along = |axis: usize| {
            exits[axis].samples(L::from_int(block[axis]), distance, self.edge, place[axis])
        };
        along(0)
            .min(along(1))
            .min(along(2))
            .max(L::splat(0.0))
            .floor()
    }
}

/// Where a ray leaves the blocks around it along one axis.
#[derive(Clone, Copy)]
pub(crate) struct Exit<L> {
    /// 1 or −1.
    sign: L,
    /// The far border of a block against its near one, less the margin, in voxels.
    border: L,
    /// Samples per voxel, with the sign of the step.
    per_voxel: L,
}

impl<L> Exit<L> {
    #[inline(always)]
    fn new<const N: usize>(step: L, edge: L, margin: L) -> Self
    where
        L: GatherLanes<N>,
    {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let is_back = step.lt(zero);
        let sign = L::select(is_back, L::splat(-1.0), one);
        // A ray that stands still along this axis has a long way to go.
        let size = step.abs().max(L::splat(SMALLEST_STEP));
        Self {
            sign,
            border: L::select(is_back, edge, zero).sub(sign.mul(margin)),
            per_voxel: sign.div(size),
        }
    }

    /// So many samples on is the border of the cube of blocks around `block` in which nothing can be
    /// seen, `distance` being that of the nearest block in which something can.
    #[inline(always)]
    fn samples<const N: usize>(&self, block: L, distance: L, edge: L, place: L) -> L
    where
        L: GatherLanes<N>,
    {
        let border = block
            .add(self.sign.mul(distance))
            .mul(edge)
            .add(self.border);
        border.sub(place).mul(self.per_voxel)
    }
}
