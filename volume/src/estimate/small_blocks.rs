//! The blocks by which a caster skips, within those of an estimate: a word of bits for each of these.
//!
//! A block of the estimate has 4 × 4 × 4 of them. It is lit as soon as something can be seen in one, and a
//! ray that leaves a head passes two such blocks of air with a corner of skin.
//!
//! Invariant: a bit is set if and only if its block is at distance 0.

use std::sync::Arc;

use super::BLOCK_SHIFT;
use crate::{
    cast::view::{RayLattice, SMALLEST_STEP},
    distance::DistanceMap,
};

/// Binary logarithm of the small blocks along the edge of one.
const ACROSS_SHIFT: u32 = 2;

/// Binary logarithm of the cells along the edge of a small block.
const SMALL_SHIFT: u32 = BLOCK_SHIFT - ACROSS_SHIFT;

/// More jumps than this in one stretch of a ray are not counted.
const MOST_JUMPS: u32 = 64;

/// Which small blocks show something.
#[derive(Clone, Debug)]
pub(super) struct SmallBlocks {
    map: Arc<DistanceMap>,
    /// For each block, bit x + 4 (y + 4 z) for what shows something.
    pub(super) masks: Vec<u64>,
    /// One over the number of small blocks, which is smaller at the border.
    per_count: Vec<f32>,
}

impl SmallBlocks {
    /// Those of a map, in `dims` blocks.
    pub(super) fn new(map: Arc<DistanceMap>, dims: [usize; 3]) -> Self {
        assert_eq!(map.shift, SMALL_SHIFT, "blocks of another size");
        let [across, down, layers] = map.dims;
        let mut masks = vec![0_u64; dims.iter().product()];
        let rows = map.distances[..across * down * layers].chunks_exact(across);
        for (row, distances) in rows.enumerate() {
            let (y, z) = (row % down, row / down);
            let first = ((z >> ACROSS_SHIFT) * dims[1] + (y >> ACROSS_SHIFT)) * dims[0];
            let shift = ((y & 3) + ((z & 3) << 2)) << 2;
            for (mask, four) in masks[first..].iter_mut().zip(distances.chunks(4)) {
                for (x, &distance) in four.iter().enumerate() {
                    *mask |= u64::from(distance == 0) << (shift + x);
                }
            }
        }
        let along = |axis: usize, block: usize| (map.dims[axis] - (block << ACROSS_SHIFT)).min(4);
        let per_count = (0..masks.len())
            .map(|block| {
                let [x, y, z] = [
                    block % dims[0],
                    block / dims[0] % dims[1],
                    block / dims[0] / dims[1],
                ];
                1.0 / (along(0, x) * along(1, y) * along(2, z)) as f32
            })
            .collect();
        Self {
            map,
            masks,
            per_count,
        }
    }

    /// The share of the small blocks of a block that show something, and their bits. Of a block that shows
    /// nothing the share is 1.
    pub(super) fn of(&self, block: usize) -> (f32, u64) {
        let mask = self.masks[block];
        let share = mask.count_ones() as f32 * self.per_count[block];
        match mask {
            0 => (1.0, 0),
            _ if share >= 1.0 => (1.0, u64::MAX),
            _ => (share, mask),
        }
    }

    /// How often a caster jumps on a ray between two samples: each time out of the cube of blocks around a
    /// place in which nothing can be seen.
    pub(super) fn jumps(&self, ray: &RayLattice, from: f32, to: f32) -> f32 {
        let dims = self.map.dims;
        let edge = (1_u32 << SMALL_SHIFT) as f32;
        // Samples per voxel; a ray that stands still along an axis has a long way to go.
        let per_voxel = ray.step.map(|step| {
            1.0 / if step.abs() < SMALLEST_STEP {
                SMALLEST_STEP
            } else {
                step
            }
        });
        let (mut k, mut jumps) = (from, 0);
        while k <= to && jumps < MOST_JUMPS {
            let place: [f32; 3] = std::array::from_fn(|axis| k * ray.step[axis] + ray.origin[axis]);
            let block: [usize; 3] = std::array::from_fn(|axis| {
                (place[axis].max(0.0) as usize >> SMALL_SHIFT).min(dims[axis] - 1)
            });
            let index = (block[2] * dims[1] + block[1]) * dims[0] + block[0];
            let distance = self.map.distances[index];
            jumps += u32::from(distance > 0);
            // Out of its own block at least.
            let reach = f32::from(distance.max(1));
            let along = |axis: usize| {
                let block = block[axis] as f32;
                let border = if per_voxel[axis] < 0.0 {
                    block + 1.0 - reach
                } else {
                    block + reach
                };
                (border * edge - place[axis]) * per_voxel[axis]
            };
            let inside = along(0).min(along(1)).min(along(2));
            k += inside.max(0.0).floor() + 1.0;
        }
        jumps as f32
    }

    /// The bit of the small block of a place, in voxels.
    pub(super) fn bit(place: [f32; 3]) -> u64 {
        let [x, y, z] = place.map(|p| (p.max(0.0) as usize >> SMALL_SHIFT) & 3);
        1 << (x + ((y + (z << 2)) << 2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_the_blocks_of_the_map_one_by_one() {
        // 9 × 6 × 5 small blocks in 3 × 2 × 2.
        let dims = [9, 6, 5];
        let lit = |x: usize, y: usize, z: usize| (x * 7 + y * 3 + z * 5).is_multiple_of(4);
        let mut distances = Vec::new();
        for index in 0..9 * 6 * 5 {
            let (x, y, z) = (index % 9, index / 9 % 6, index / 54);
            distances.push(u8::from(!lit(x, y, z)));
        }
        distances.extend([0; 3]);
        let map = DistanceMap {
            distances,
            dims,
            shift: SMALL_SHIFT,
        };
        let small = SmallBlocks::new(Arc::new(map), [3, 2, 2]);
        let mut counts = [0; 12];
        for index in 0..9 * 6 * 5 {
            let (x, y, z) = (index % 9, index / 9 % 6, index / 54);
            let block = (z / 4 * 2 + y / 4) * 3 + x / 4;
            let place = [x, y, z].map(|i| (i << SMALL_SHIFT) as f32 + 1.5);
            let is_set = small.masks[block] & SmallBlocks::bit(place) != 0;
            assert_eq!(is_set, lit(x, y, z), "{x} {y} {z}");
            counts[block] += 1;
        }
        for (block, count) in counts.into_iter().enumerate() {
            let expected = small.masks[block].count_ones() as f32 / count as f32;
            assert!((small.of(block).0 - expected).abs() < 1e-6, "{block}");
        }
    }

    #[test]
    fn full_and_empty_blocks_have_no_parts() {
        let of = |distance| {
            let map = DistanceMap {
                distances: vec![distance; 8 + 3],
                dims: [2; 3],
                shift: SMALL_SHIFT,
            };
            SmallBlocks::new(Arc::new(map), [1; 3]).of(0)
        };
        assert_eq!(of(0), (1.0, u64::MAX));
        assert_eq!(of(2), (1.0, 0));
    }
}
