//! stub
#![forbid(unsafe_code)]
pub mod camera;
pub use camera::Camera;
