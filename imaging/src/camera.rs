//! Pinhole camera.
use glam::Vec3;
/// stub
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of projection.
    pub origin: Vec3,
    /// The point looked at.
    pub target: Vec3,
    /// Up direction.
    pub up: Vec3,
    /// Full vertical field of view, degrees, in (0, 180).
    pub vertical_fov_degrees: f32,
}
