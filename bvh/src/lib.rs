//! stub
#![deny(unsafe_code)]
mod mesh;
pub use glam::Vec3;
pub use mesh::{MeshError, TriangleMesh};
