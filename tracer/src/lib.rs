//! stub
#![forbid(unsafe_code)]
pub mod scene;
pub use scene::{Light, Material, Mesh, Rgb, Scene};
