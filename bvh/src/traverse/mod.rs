//! From rays to hits: the kernels, the triangle tests, and the slow twin that both answer to.

pub(crate) mod box_test;
pub(crate) mod fast;
pub(crate) mod kernel;
mod node_test;
pub(crate) mod packet;
pub mod reference;
pub(crate) mod robust;
pub(crate) mod setup;
pub(crate) mod stream;
pub(crate) mod triangle;
