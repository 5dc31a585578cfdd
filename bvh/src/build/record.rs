//! The tree between building and layout: one record per child, the children of a node side by
//! side.
//!
//! Invariant: below a range of n references there are at most 2n − 2 records, since every split
//! adds one child and a leaf holds at least one reference. So each subtree owns a slice of the
//! record array from the start, and threads never meet.

use super::primitive::Bounds;
use crate::{bounds::Aabb, layout::block::BLOCK_SIZE};

/// What is behind a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// `first..first + count` of the leaf ids.
    Leaf,
    /// `first..first + count` of the records.
    Inner,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Record {
    pub(crate) lower: [f32; 3],
    pub(crate) upper: [f32; 3],
    pub(crate) first: u32,
    pub(crate) count: u32,
    /// Inner nodes of the subtree, this one included.
    pub(crate) nodes: u32,
    /// Triangle blocks of the subtree.
    pub(crate) blocks: u32,
    pub(crate) kind: Kind,
    /// Levels of the subtree below this one; `u8::MAX` if there are more.
    pub(crate) height: u8,
}

impl Record {
    pub(crate) const UNUSED: Self = Self {
        lower: [0.0; 3],
        upper: [0.0; 3],
        first: 0,
        count: 0,
        nodes: 0,
        blocks: 0,
        kind: Kind::Leaf,
        height: 0,
    };

    pub(crate) fn leaf(bounds: &Bounds, first: usize, count: usize) -> Self {
        Self {
            first: first as u32,
            count: count as u32,
            nodes: 0,
            blocks: count.div_ceil(BLOCK_SIZE) as u32,
            kind: Kind::Leaf,
            ..Self::of(bounds)
        }
    }

    pub(crate) fn inner(bounds: &Bounds, first: usize, children: &[Self]) -> Self {
        Self {
            first: first as u32,
            count: children.len() as u32,
            nodes: 1 + children.iter().map(|c| c.nodes).sum::<u32>(),
            blocks: children.iter().map(|c| c.blocks).sum(),
            kind: Kind::Inner,
            height: (children.iter().map(|c| c.height).max()).map_or(0, |h| h.saturating_add(1)),
            ..Self::of(bounds)
        }
    }

    /// A node whose box is that of its children.
    pub(crate) fn inner_around(first: usize, children: &[Self]) -> Self {
        let bounds = children
            .iter()
            .fold(Aabb::EMPTY, |all, child| all.union(child.bounds()));
        Self {
            lower: bounds.min.to_array(),
            upper: bounds.max.to_array(),
            ..Self::inner(&Bounds::EMPTY, first, children)
        }
    }

    fn of(bounds: &Bounds) -> Self {
        let aabb = bounds.to_aabb();
        Self {
            lower: aabb.min.to_array(),
            upper: aabb.max.to_array(),
            ..Self::UNUSED
        }
    }

    /// The places of its children among the records, or of its primitives among the leaves.
    pub(crate) fn range(&self) -> std::ops::Range<usize> {
        let first = self.first as usize;
        first..first + self.count as usize
    }

    pub(crate) fn is_leaf(&self) -> bool {
        self.kind == Kind::Leaf
    }

    pub(crate) fn bounds(&self) -> Aabb {
        Aabb {
            min: self.lower.into(),
            max: self.upper.into(),
        }
    }
}
