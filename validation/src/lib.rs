//! Oracles and statistical tests: what raywright is checked with, and what others may check their
//! own tracer or tree with.
#![forbid(unsafe_code)]

pub mod exact;
pub mod z_test;

pub use z_test::{Estimate, ZTest};
