//! Are hits right? Ours beside those of another tracer, with the exact side of every edge as the judge.
//!
//! Two tracers that round differently disagree at edges, at silhouettes and where a triangle is seen nearly
//! edge-on, and neither is wrong. So no answer is compared with a fixed tolerance: each triangle that either of
//! them names is [evaluated](Evaluation) with the bound of the error that the test in f32 may make, and a
//! difference is a tie where it lies within that bound, and a fault where it does not.
//!
//! Invariant: a class depends on ray, answers and triangles alone.

mod evaluate;
mod judge;
mod rays;

pub use evaluate::{Evaluation, TriangleTestForm};
pub use judge::{Answer, Class, Judge};
pub use rays::{RayKind, Rays};
