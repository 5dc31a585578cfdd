//! Are hits right? Ours beside those of another tracer, with the exact side of every edge as the judge.
//!
//! Two tracers that round differently disagree at edges, at silhouettes and where a triangle is seen nearly
//! edge-on, and neither is wrong. So no answer is compared with a fixed tolerance: each triangle that either of
//! them names is [evaluated](Evaluation) with the bound of the error that the test in f32 may make, and a
//! difference is a tie where it lies within that bound, and a fault where it does not.
//!
//! Every answer of ours is also judged beside all triangles that the ray meets up to it, from a tree of exact hits
//! ([`crate::exact::ExactTree`]): what both tracers get wrong is seen too. Looking it up in the loop over all triangles,
//! which is too slow for every ray, is left to a sample, and checks that tree.
//!
//! Invariant: a class depends on ray, answers and triangles alone.

mod clamp;
mod class;
mod closed;
mod evaluate;
mod judge;
mod patch;
mod rays;
mod sheared;

pub use class::{Answer, Class};
pub use closed::{CLOSED, closed};
pub use evaluate::{Evaluation, TriangleTestForm};
pub use judge::Judge;
pub use rays::{RayKind, Rays};
