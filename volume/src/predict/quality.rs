//! What may be given up for time: samples along a ray, and rays.
//!
//! Invariant of the order: with the same picture, time falls as [`Quality::coarseness`] rises, as far
//! as it depends on samples alone.

pub use crate::cast::PixelsPerRay;

/// How finely a frame is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Distance between samples, in lengths of a voxel; above 0.
    pub step: f64,
    /// Pixels for which one ray is cast.
    pub pixels_per_ray: PixelsPerRay,
}

impl Quality {
    /// A ray for every pixel, with samples at a distance of `step` lengths of a voxel.
    #[must_use]
    pub fn with_step(step: f64) -> Self {
        Self {
            step,
            pixels_per_ray: PixelsPerRay::One,
        }
    }

    /// Voxel lengths times pixels for which a sample stands.
    #[must_use]
    pub fn coarseness(self) -> f64 {
        self.step * self.pixels_per_ray.count()
    }
}
