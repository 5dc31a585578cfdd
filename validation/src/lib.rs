//! Oracles and statistical tests: what raywright is checked with, and what others may check their
//! own tracer or tree with.
//!
//! | module | question | oracle |
//! | --- | --- | --- |
//! | [`z_test`] | do two pictures have the same mean? | statistics |
//! | [`exact`] | where does a ray hit a triangle? | f64, integers for the sides of edges |
//! | [`hits`] | is what two tracers say of a ray the same, a tie or a fault? | [`exact`] and bounds of errors |
//! | [`extremes`] | does anything that breaks ray tracers break ours? | [`exact`], topology, a loop over all triangles |
//! | [`golden`] | is a tree Embree's, to the last bit? | hashes of Embree's trees, in files |
//! | [`embree`] | the same, for any input and parameters | the library itself, if it is there |
//! | [`random`] | the same, over many | random triangles and parameters |
//! | [`trends`] | does a parameter push ours where it pushes Embree's? | Embree's trees and kernels, in turns with ours |
//! | `kit` | does an accelerator of your own answer right? | [`exact`], ours, or Embree |
//!
//! The program of this crate asks all but the first and the last of them; see its `--help`:
//!
//! ```text
//! cargo run --release -p raywright-validation -- trees            # all golden lines
//! cargo run --release -p raywright-validation -- trees --random   # random builds beside Embree
//! cargo run --release -p raywright-validation -- hits             # rays beside Embree and exact hits
//! cargo run --release -p raywright-validation -- extremes         # classes of what breaks ray tracers
//! cargo run --release -p raywright-validation -- accuracy         # what robust hits cost and save
//! cargo run --release -p raywright-validation -- trends           # parameters beside Embree's, a page
//! ```
//!
//! Features: `golden` (the files), `embree` (the library, loaded at run time), `extremes`, `trends`, `cli` (the
//! program, with all of these; the default), `kit` (strategies and assertions for property tests).
#![deny(unsafe_code)]

#[cfg(feature = "embree")]
pub mod embree;
pub mod exact;
#[cfg(feature = "extremes")]
pub mod extremes;
#[cfg(feature = "golden")]
pub mod golden;
#[cfg(feature = "golden")]
pub mod hits;
#[cfg(feature = "kit")]
pub mod kit;
#[cfg(all(feature = "embree", feature = "golden"))]
pub mod random;
pub mod tree;
#[cfg(feature = "trends")]
pub mod trends;
mod triangles;
pub mod z_test;

pub use tree::{Node, Tree};
pub use triangles::TriangleSet;
pub use z_test::{Estimate, ZTest};
