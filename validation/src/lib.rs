//! Oracles and statistical tests: what raywright is checked with, and what others may check their
//! own tracer or tree with.
//!
//! | module | question | oracle |
//! | --- | --- | --- |
//! | [`z_test`] | do two pictures have the same mean? | statistics |
//! | [`exact`] | where does a ray hit a triangle? | f64 |
//! | [`golden`] | is a tree Embree's, to the last bit? | hashes of Embree's trees, in files |
//!
//! The program of this crate asks the last question; see its `--help`:
//!
//! ```text
//! cargo run --release -p raywright-validation -- trees            # all golden lines
//! ```
//!
//! Features: `golden` (the files), `cli` (the program, with `golden`). The default is `cli`.
#![forbid(unsafe_code)]

pub mod exact;
#[cfg(feature = "golden")]
pub mod golden;
pub mod tree;
pub mod z_test;

pub use tree::{Node, Tree};
pub use z_test::{Estimate, ZTest};
