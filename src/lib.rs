//! raywright: a pure-Rust ray tracing engine that knows what its own knobs do.
//!
//! This crate is a facade. Each feature opens a room: [`bvh`] is always there, `tracer` brings the
//! path tracer and its pictures, `tuner` the search of parameters, both together the tuning loop
//! `tune`, `volume` the volume raycaster, `cli` the command line and its reports.
//! Those who embed a tracer switch the default features off.
//!
//! ```
//! use raywright::bvh::{BuildParams, Bvh, Ray, TriangleMesh, Vec3};
//!
//! let mesh = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
//! let tree = Bvh::build(&[&mesh], &BuildParams::default())?;
//! assert!(tree.any_hit(&Ray::new([0.2, 0.2, 1.0], [0.0, 0.0, -1.0])));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

pub use raywright_bvh as bvh;
#[cfg(any(feature = "tracer", feature = "volume"))]
pub use raywright_imaging as imaging;
#[cfg(feature = "tracer")]
pub use raywright_tracer as tracer;
#[cfg(feature = "tuner")]
pub use raywright_tuner as tuner;
#[cfg(feature = "volume")]
pub use raywright_volume as volume;

#[cfg(feature = "cli")]
pub mod report;
#[cfg(all(feature = "volume", feature = "cli"))]
pub mod study;
#[cfg(all(feature = "tracer", feature = "tuner"))]
pub mod tune;
