//! What traversal and emission need of the blocks of a leaf, whatever is in them.

use crate::build::LeafReference;

/// How many primitives a block holds.
pub(crate) const BLOCK_SIZE: usize = 4;

/// Marks an unused lane, which no ray hits. Such lanes come last.
pub(crate) const NO_PRIMITIVE: u32 = u32::MAX;

/// A vertex in the scaled space of a tree.
pub(crate) type Point = [f32; 3];

/// Four primitives of a leaf.
pub(crate) trait Block: Copy + std::fmt::Debug + Send + Sync {
    /// Whether it refers to the points of its tree.
    const INDEXED: bool;

    /// Number of each primitive in its tree, or [`NO_PRIMITIVE`].
    fn ids(&self) -> &[u32; BLOCK_SIZE];

    /// How many lanes are used.
    fn len(&self) -> usize {
        self.ids().iter().filter(|&&id| id != NO_PRIMITIVE).count()
    }
}

/// A block that is made of the primitives `P`.
pub(crate) trait BlockOf<P>: Block {
    /// Makes a block of at most [`BLOCK_SIZE`] primitives.
    fn new(leaves: &[LeafReference], primitives: &P) -> Self;
}

/// The primitives of a build, where the caller keeps them.
pub(crate) trait Primitives: Sync {
    /// Asks for what tells where the data of a primitive is, before it is needed.
    fn prefetch_ids(&self, leaf: LeafReference);

    /// Asks for the data of a primitive before it is needed.
    fn prefetch(&self, leaf: LeafReference);

    /// How many points indexed blocks refer to, that for the unused lanes included.
    fn point_count(&self) -> usize;

    /// All these points, in order; that for the unused lanes is the last.
    fn points(&self) -> impl Iterator<Item = Point>;
}
