//! A node with N children, and the references that lead to them.
//!
//! The boxes of the children lie axis by axis, so that one load fetches a plane of all children;
//! the order in which a ray should visit them is stored for each octant of directions, which
//! costs only the padding to a cache line. After Fuetterling, Lojewski, Pfreundt, Hamann, Ebert,
//! *Accelerated Single Ray Tracing for Wide Vector Units*, 2017 (order by octant), and Nah,
//! Manocha, *SATO: Surface Area Traversal Order for Shadow Ray Tracing*, 2014 (slots by area).
//!
//! Bytes: 64 for 2 children, 128 for 4, 256 for 8, 512 for 16.

use crate::bounds::Aabb;

/// Where a child is: an inner node or a leaf.
///
/// Bit 31 tells a leaf. A leaf has its number of triangle blocks less one in bits 27 to 30 and its
/// first block in bits 0 to 26; an inner node has its index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ChildRef(pub(crate) u32);

impl ChildRef {
    const LEAF: u32 = 1 << 31;
    const BLOCK_COUNT_SHIFT: u32 = 27;
    /// The most blocks that a leaf can have.
    pub(crate) const MAX_BLOCKS: u32 = 16;
    /// How many blocks can be told apart.
    pub(crate) const BLOCK_LIMIT: usize = 1 << Self::BLOCK_COUNT_SHIFT;
    /// How many nodes can be told apart.
    pub(crate) const NODE_LIMIT: usize = Self::LEAF as usize;

    pub(crate) fn inner(node: u32) -> Self {
        debug_assert_eq!(node & Self::LEAF, 0);
        Self(node)
    }

    pub(crate) fn leaf(first_block: u32, blocks: u32) -> Self {
        debug_assert!(
            (1..=Self::MAX_BLOCKS).contains(&blocks) && (first_block as usize) < Self::BLOCK_LIMIT
        );
        Self(Self::LEAF | (blocks - 1) << Self::BLOCK_COUNT_SHIFT | first_block)
    }

    #[inline(always)]
    pub(crate) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// The range of blocks of a leaf.
    #[inline(always)]
    pub(crate) fn blocks(self) -> std::ops::Range<usize> {
        let first = (self.0 as usize) & (Self::BLOCK_LIMIT - 1);
        first..first + ((self.0 >> Self::BLOCK_COUNT_SHIFT) as usize & 15) + 1
    }
}

/// A node with up to `N` children; `W` words hold their order for the eight octants.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Node<const N: usize, const W: usize> {
    /// min x, max x, min y, max y, min z, max z of each child. An empty slot has +∞ and −∞, which
    /// no ray enters.
    pub(crate) planes: [[f32; N]; 6],
    /// [`ChildRef`] of each child, in ascending order of area.
    pub(crate) children: [u32; N],
    order: [u32; W],
}

impl<const N: usize, const W: usize> Default for Node<N, W> {
    fn default() -> Self {
        let mut planes = [[f32::INFINITY; N]; 6];
        for axis in 0..3 {
            planes[2 * axis + 1] = [f32::NEG_INFINITY; N];
        }
        Self {
            planes,
            children: [0; N],
            order: [0; W],
        }
    }
}

impl<const N: usize, const W: usize> Node<N, W> {
    /// Bits of the order of one octant: 64 for N = 16, 32 for N = 8, 8 for N = 4 and 2.
    const OCTANT_BITS: usize = 4 * W;
    const SLOT_BITS: u32 = N.trailing_zeros();
    /// The order that takes slots as they lie.
    pub(crate) const SLOT_ORDER: u64 = {
        let (mut order, mut slot) = (0, 0);
        while slot < N as u64 {
            order |= slot << (slot * Self::SLOT_BITS as u64);
            slot += 1;
        }
        order
    };

    /// The slots from the farthest to the nearest for rays of an octant: fields of log2(N) bits,
    /// lowest first. Bit a of `octant` is set if the direction is negative along axis a.
    #[inline(always)]
    pub(crate) fn order(&self, octant: usize) -> u64 {
        let bit = octant * Self::OCTANT_BITS;
        let low = u64::from(self.order[bit / 32] >> (bit % 32));
        if Self::OCTANT_BITS <= 32 {
            low
        } else {
            low | u64::from(self.order[bit / 32 + 1]) << 32
        }
    }

    /// Makes a node of boxes and references, which must come in ascending order of area.
    pub(crate) fn new(children: &[(Aabb, ChildRef)]) -> Self {
        let mut node = Self::default();
        let mut centres = [[0.0; N]; 3];
        for (slot, (bounds, reference)) in children.iter().enumerate() {
            for (axis, centres) in centres.iter_mut().enumerate() {
                node.planes[2 * axis][slot] = bounds.min[axis];
                node.planes[2 * axis + 1][slot] = bounds.max[axis];
                centres[slot] = bounds.min[axis] + bounds.max[axis];
            }
            node.children[slot] = reference.0;
        }
        // Opposite octants see the children in opposite order, so that four sorts serve eight.
        for octant in 0..4 {
            let sign = |axis: usize| if octant >> axis & 1 == 1 { -1.0 } else { 1.0 };
            let signs = [sign(0), sign(1), sign(2)];
            let mut nearness = [f32::INFINITY; N];
            for slot in 0..children.len() {
                let [x, y, z] = [0, 1, 2].map(|axis| centres[axis][slot] * signs[axis]);
                nearness[slot] = -(x + y + z);
            }
            let (mut far_first, mut near_first) = (0, 0);
            for (slot, &place) in ranks(&nearness).iter().enumerate() {
                let opposite = match children.len() {
                    n if slot < n => n as u32 - 1 - place,
                    _ => slot as u32,
                };
                far_first |= (slot as u64) << (place * Self::SLOT_BITS);
                near_first |= (slot as u64) << (opposite * Self::SLOT_BITS);
            }
            node.set_order(octant, far_first);
            node.set_order(7 - octant, near_first);
        }
        node
    }

    fn set_order(&mut self, octant: usize, order: u64) {
        let bit = octant * Self::OCTANT_BITS;
        self.order[bit / 32] |= (order as u32) << (bit % 32);
        if Self::OCTANT_BITS > 32 {
            self.order[bit / 32 + 1] = (order >> 32) as u32;
        }
    }

    /// The box of a child; empty for an empty slot.
    pub(crate) fn child_bounds(&self, slot: usize) -> Aabb {
        let plane = |k: usize| self.planes[k][slot];
        Aabb {
            min: glam::Vec3::new(plane(0), plane(2), plane(4)),
            max: glam::Vec3::new(plane(1), plane(3), plane(5)),
        }
    }
}

/// Half the surface area.
pub(super) fn half_area(bounds: &Aabb) -> f32 {
    let d = bounds.max - bounds.min;
    d.x * (d.y + d.z) + d.y * d.z
}

/// The place of each key in ascending order, equal keys in the order in which they come. All pairs
/// are compared, which for so few is faster than sorting, since nothing depends on the outcome of a
/// comparison but a sum.
pub(super) fn ranks<const N: usize>(keys: &[f32; N]) -> [u32; N] {
    let mut ranks = [0; N];
    for (other, &other_key) in keys.iter().enumerate() {
        for (slot, &key) in keys.iter().enumerate() {
            let precedes = (other_key < key) | ((other_key == key) & (other < slot));
            ranks[slot] += u32::from(precedes);
        }
    }
    ranks
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::layout::block::BLOCK_SIZE;

    #[test]
    fn sizes_are_whole_cache_lines() {
        assert_eq!(size_of::<Node<2, 2>>(), 64);
        assert_eq!(size_of::<Node<4, 2>>(), 128);
        assert_eq!(size_of::<Node<8, 8>>(), 256);
        assert_eq!(size_of::<Node<16, 16>>(), 512);
    }

    fn order_is_a_permutation_from_far_to_near<const N: usize, const W: usize>() {
        let boxes: Vec<_> = (0..N)
            .map(|i| {
                let centre = Vec3::new(
                    (i * 37 % 11) as f32,
                    (i * 53 % 7) as f32,
                    (i * 29 % 5) as f32,
                );
                (
                    Aabb {
                        min: centre - 0.5,
                        max: centre + 0.5,
                    },
                    ChildRef::inner(i as u32),
                )
            })
            .collect();
        let node = Node::<N, W>::new(&boxes);
        for octant in 0..8 {
            let direction = Vec3::from_array(std::array::from_fn(|a| {
                if octant >> a & 1 == 1 { -1.0 } else { 1.0 }
            }));
            let slots: Vec<usize> = (0..N)
                .map(|k| (node.order(octant) >> (k as u32 * N.trailing_zeros())) as usize & (N - 1))
                .collect();
            let mut seen = slots.clone();
            seen.sort_unstable();
            assert_eq!(seen, (0..N).collect::<Vec<_>>());
            let keys: Vec<f32> = slots
                .iter()
                .map(|&s| boxes[s].0.centre().dot(direction))
                .collect();
            assert!(
                keys.is_sorted_by(|a, b| a >= b),
                "octant {octant}: {keys:?}"
            );
        }
    }

    #[test]
    fn order_for_every_width() {
        order_is_a_permutation_from_far_to_near::<2, 2>();
        order_is_a_permutation_from_far_to_near::<4, 2>();
        order_is_a_permutation_from_far_to_near::<8, 8>();
        order_is_a_permutation_from_far_to_near::<16, 16>();
    }

    #[test]
    fn references_keep_what_they_are_given() {
        assert_eq!(
            ChildRef::MAX_BLOCKS as usize * BLOCK_SIZE,
            64,
            "max_leaf_size"
        );
        for (first, blocks) in [(0, 1), (12345, 16), ((1 << 27) - 1, 3)] {
            let leaf = ChildRef::leaf(first, blocks);
            assert!(leaf.is_leaf());
            assert_eq!(leaf.blocks(), first as usize..(first + blocks) as usize);
        }
        assert!(!ChildRef::inner(7).is_leaf());
    }
}
