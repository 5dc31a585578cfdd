//! Memory of trees that are no longer needed, for those to come.
//!
//! Nodes of each width and blocks of each format are types of their own, and a vector keeps its
//! type: there is one place for each, so that a new width can still use the blocks of an old tree,
//! and a new format its nodes.
//!
//! Bound: one vector per type, and none that [`MOST_BUILDS`] builds in a row had no use for. So
//! whoever goes to and fro between a few settings never allocates, all types together take about
//! three times as much as one tree, and those of settings that have been given up are freed.
//!
//! Invariant: what old items contain never reaches a tree; who takes memory writes all of it.

use super::{
    block::Point,
    box_block::BoxBlock,
    node::Node,
    triangles::{CornerBlock, EdgeBlock, IndexBlock},
};
use crate::simd::pages::ask_for_large_pages;

/// So many builds may pass by a vector before it is freed: more than the rows of a comparison that
/// builds them in turns.
const MOST_BUILDS: u32 = 8;

/// The place of the vectors of one type.
#[derive(Debug)]
pub(crate) struct Place<T> {
    memory: Vec<T>,
    /// Builds since it was asked for or came.
    builds: u32,
}

impl<T> Default for Place<T> {
    fn default() -> Self {
        Self {
            memory: vec![],
            builds: 0,
        }
    }
}

impl<T> Place<T> {
    fn bytes(&self) -> usize {
        self.memory.capacity() * size_of::<T>()
    }

    fn begin_build(&mut self) {
        self.builds = self.builds.saturating_add(1);
        if self.builds > MOST_BUILDS {
            *self = Self::default();
        }
    }
}

/// What a tree consists of.
pub(crate) trait Part: Copy {
    /// Where spare vectors of it are.
    fn place(spares: &mut Spares) -> &mut Place<Self>;
}

macro_rules! parts {
    ($($place:ident: $part:ty,)*) => {
        /// Spare vectors.
        #[derive(Debug, Default)]
        pub(crate) struct Spares {
            $($place: Place<$part>,)*
        }

        $(impl Part for $part {
            fn place(spares: &mut Spares) -> &mut Place<Self> {
                &mut spares.$place
            }
        })*

        impl Spares {
            /// Bytes held.
            pub(crate) fn bytes(&self) -> usize {
                [$(self.$place.bytes()),*].iter().sum()
            }

            /// Frees what has not been of use for long.
            pub(crate) fn begin_build(&mut self) {
                $(self.$place.begin_build();)*
            }
        }
    };
}

parts! {
    two: Node<2, 2>,
    four: Node<4, 2>,
    eight: Node<8, 8>,
    sixteen: Node<16, 16>,
    edges: EdgeBlock,
    corners: CornerBlock,
    indices: IndexBlock,
    boxes: BoxBlock,
    points: Point,
    ids: u32,
}

impl Spares {
    /// An empty vector with room for `len`.
    pub(crate) fn take_empty<T: Part>(&mut self, len: usize) -> Vec<T> {
        let mut memory = self.take(len);
        memory.clear();
        memory
    }

    /// A vector of `len` items, which the caller has to write: they are `unused` or left from an
    /// older tree, since to write them twice takes time.
    pub(crate) fn take_filled<T: Part>(&mut self, len: usize, unused: T) -> Vec<T> {
        let mut memory = self.take(len);
        memory.resize(len, unused);
        memory
    }

    fn take<T: Part>(&mut self, len: usize) -> Vec<T> {
        let mut memory = std::mem::take(T::place(self)).memory;
        if memory.capacity() < len {
            // Freed first, so that there are never both.
            memory = vec![];
            memory.reserve_exact(len);
            ask_for_large_pages(memory.spare_capacity_mut());
        }
        memory
    }

    /// Keeps a vector; of two of a type, the one with more room.
    pub(crate) fn keep<T: Part>(&mut self, memory: Vec<T>) {
        let place = T::place(self);
        if memory.capacity() > place.memory.capacity() {
            *place = Place { memory, builds: 0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_comes_back_for_its_type_alone_and_the_larger_one_stays() {
        let mut spares = Spares::default();
        spares.keep(vec![Node::<4, 2>::default(); 100]);
        spares.keep(vec![Node::<4, 2>::default(); 10]);
        assert_eq!(spares.bytes(), 100 * 128);
        assert_eq!(spares.take_empty::<Node<8, 8>>(0).capacity(), 0);
        assert_eq!(
            spares.take_filled(50, Node::<4, 2>::default()).capacity(),
            100
        );
        assert_eq!(spares.bytes(), 0);
        // What is too small makes room for what is not.
        spares.keep(vec![[0.0; 3]; 5]);
        assert_eq!(spares.take_empty::<Point>(6).capacity(), 6);
        assert_eq!(spares.bytes(), 0);
    }

    #[test]
    fn what_nobody_asks_for_is_freed() {
        let mut spares = Spares::default();
        spares.keep(vec![Node::<2, 2>::default(); 100]);
        spares.keep(vec![7_u32; 100]);
        for _ in 0..MOST_BUILDS {
            spares.begin_build();
            let ids = spares.take_empty::<u32>(100);
            spares.keep(ids);
        }
        assert_eq!(spares.bytes(), 100 * 64 + 400);
        spares.begin_build();
        assert_eq!(spares.bytes(), 400);
    }
}
