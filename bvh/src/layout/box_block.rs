//! Four boxes, plane by plane: 128 bytes.

use glam::Vec3;

use super::block::{BLOCK_SIZE, Block, BlockOf, NO_PRIMITIVE, Point, Primitives};
use crate::{bounds::Aabb, build::LeafReference, simd::prefetch};

/// The boxes of a build; the primitive id is the place in the slice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Boxes<'a> {
    pub(crate) boxes: &'a [Aabb],
    pub(crate) scale: f32,
}

impl Primitives for Boxes<'_> {
    // The references themselves tell where a box is.
    fn prefetch_ids(&self, _leaf: LeafReference) {}

    #[inline]
    fn prefetch(&self, leaf: LeafReference) {
        prefetch(&self.boxes[leaf.primitive_id as usize]);
    }

    fn point_count(&self) -> usize {
        0
    }

    fn points(&self) -> impl Iterator<Item = Point> {
        std::iter::empty()
    }
}

/// Four boxes of a leaf.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct BoxBlock {
    /// min x, max x, min y, max y, min z, max z of each box, as in a node: an unused lane has +∞
    /// and −∞, which no ray enters.
    pub(crate) planes: [[f32; BLOCK_SIZE]; 6],
    id: [u32; BLOCK_SIZE],
}

impl Block for BoxBlock {
    const INDEXED: bool = false;

    #[inline(always)]
    fn ids(&self) -> &[u32; BLOCK_SIZE] {
        &self.id
    }
}

impl BlockOf<Boxes<'_>> for BoxBlock {
    fn new(leaves: &[LeafReference], primitives: &Boxes<'_>) -> Self {
        let mut block = Self {
            planes: [[0.0; BLOCK_SIZE]; 6],
            id: [NO_PRIMITIVE; BLOCK_SIZE],
        };
        for lane in 0..BLOCK_SIZE {
            let bounds = match leaves.get(lane) {
                Some(leaf) => {
                    block.id[lane] = leaf.primitive_id;
                    scaled(
                        &primitives.boxes[leaf.primitive_id as usize],
                        primitives.scale,
                    )
                }
                None => Aabb::EMPTY,
            };
            for axis in 0..3 {
                block.planes[2 * axis][lane] = bounds.min[axis];
                block.planes[2 * axis + 1][lane] = bounds.max[axis];
            }
        }
        block
    }
}

/// A box times a positive number.
pub(crate) fn scaled(bounds: &Aabb, scale: f32) -> Aabb {
    let scale = Vec3::splat(scale);
    Aabb {
        min: bounds.min * scale,
        max: bounds.max * scale,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn size_is_two_cache_lines() {
        assert_eq!(size_of::<BoxBlock>(), 128);
    }
}
