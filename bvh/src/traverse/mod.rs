//! From rays to hits: the kernels, the triangle test, and the slow twin that both answer to.

pub(crate) mod kernel;
pub mod reference;
pub(crate) mod triangle;
