//! How a tree lies in memory.

pub(crate) mod block;
pub(crate) mod box_block;
pub(crate) mod emit;
pub(crate) mod node;
mod refit;
pub(crate) mod spares;
pub(crate) mod tree;
pub(crate) mod triangles;
