//! What is known of a frame before it is drawn, for any quality: the estimate of its rays, added up.
//!
//! Bruder, Frey, Ertl, 2016, equation 2, with sums instead of means: where rays enter and leave the
//! blocks in which something can be seen, and where they are expected to end. Lengths are in voxels,
//! so that one estimate serves for every step.
//!
//! Invariant: a function of estimate, camera, size and volume; nothing measured by a clock.

use raywright_imaging::Camera;

use super::{PredictError, Quality};
use crate::{estimate::Estimate, grid::Volume};

/// What is known of a frame before it is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlook {
    /// The version of the volume: a number that the caller changes whenever the volume is another.
    pub volume_version: u64,
    /// Unit direction of view, in the space of the volume.
    pub direction: [f64; 3],
    /// Side of a voxel at the centre of the volume as seen by the camera, in pixels; above 0. From
    /// within the volume, of one a quarter of its diagonal away.
    pub pixels_per_voxel: f64,
    /// Pixels whose rays meet the box of the volume.
    pub rays: f64,
    /// Length of all rays from the first block in which something can be seen to their expected end,
    /// in lengths of a voxel, a ray for every pixel.
    pub length: f64,
    /// The same up to the last block in which something can be seen: no step can make rays longer.
    pub longest: f64,
    /// The part of `length` within blocks in which something can be seen.
    pub lit_length: f64,
    /// The part of `length` at which something is seen.
    pub seen_length: f64,
    /// Jumps of all rays over empty space, a ray for every pixel.
    pub jumps: f64,
    /// Blocks that the estimate looked at, for each of its rays that met the box.
    pub coarse_steps: f64,
}

impl Outlook {
    /// The outlook for a picture of `width` × `height` pixels, from the estimate that was made for it
    /// with steps of `step` lengths of a voxel.
    #[must_use]
    pub fn new(
        estimate: &Estimate,
        volume: &Volume,
        camera: &Camera,
        [width, height]: [u32; 2],
        step: f32,
    ) -> Self {
        let step = f64::from(step);
        let covered = |tile: u32, size: u32| {
            let first = tile * estimate.tile_size;
            f64::from((first + estimate.tile_size).min(size).saturating_sub(first))
        };
        let (mut length, mut longest) = (0.0, 0.0);
        let (mut lit_length, mut seen_length, mut jumps) = (0.0, 0.0, 0.0);
        for (index, ray) in estimate.rays.iter().enumerate() {
            let (x, y) = (
                index as u32 % estimate.tiles[0],
                index as u32 / estimate.tiles[0],
            );
            let pixels = covered(x, width) * covered(y, height);
            jumps += pixels * f64::from(ray.jumps);
            let weight = pixels * step;
            length += weight * f64::from(ray.end - ray.front);
            longest += weight * f64::from(ray.back - ray.front);
            lit_length += weight * f64::from(ray.lit);
            seen_length += weight * f64::from(ray.seen);
        }
        let coarse_rays = f64::from(estimate.in_box);
        let forward = (camera.target - camera.origin).as_dvec3();
        let centre = (volume.extent() * 0.5 - camera.origin).as_dvec3();
        let unit = f64::from(volume.unit_length());
        // From within, what is seen is about a quarter of the diagonal away, not at the centre.
        let distance = centre
            .length()
            .hypot(volume.extent().as_dvec3().length() * 0.25)
            .max(unit);
        let half_fov = f64::from(camera.vertical_fov_degrees).to_radians() * 0.5;
        let picture = f64::from(width) * f64::from(height);
        Self {
            volume_version: 0,
            direction: forward.normalize_or_zero().to_array(),
            pixels_per_voxel: unit * f64::from(height) / (2.0 * half_fov.tan() * distance),
            rays: picture * coarse_rays / (estimate.rays.len().max(1) as f64),
            length,
            longest,
            lit_length,
            seen_length,
            jumps,
            coarse_steps: estimate.steps as f64 / coarse_rays.max(1.0),
        }
    }

    /// The same for a volume of another version.
    #[must_use]
    pub fn with_volume_version(self, volume_version: u64) -> Self {
        Self {
            volume_version,
            ..self
        }
    }

    /// Rays that are cast.
    #[must_use]
    pub fn rays(&self, quality: Quality) -> f64 {
        self.rays / quality.pixels_per_ray.count()
    }

    /// Expected samples, as the paper counts them: all from the first block in which something can be
    /// seen to the expected end.
    #[must_use]
    pub fn samples(&self, quality: Quality) -> f64 {
        self.length / quality.coarseness()
    }

    /// Samples if no ray ended early: more there cannot be.
    #[must_use]
    pub fn most_samples(&self, quality: Quality) -> f64 {
        self.longest / quality.coarseness()
    }

    /// The share of `length` that lies in blocks in which something can be seen, 0..=1.
    #[must_use]
    pub fn lit_share(&self) -> f64 {
        share(self.lit_length, self.length)
    }

    /// The share of `length` at which something is seen, 0..=1.
    #[must_use]
    pub fn seen_share(&self) -> f64 {
        share(self.seen_length, self.length)
    }

    /// The share of `longest` that is expected to be left out because rays end early, 0..=1.
    #[must_use]
    pub fn termination_share(&self) -> f64 {
        share(self.longest - self.length, self.longest)
    }

    pub(super) fn check(&self) -> Result<(), PredictError> {
        for (name, value, least) in [
            ("direction", self.direction.iter().sum(), f64::MIN),
            ("pixels_per_voxel", self.pixels_per_voxel, f64::MIN_POSITIVE),
            ("rays", self.rays, 0.0),
            ("length", self.length, 0.0),
            ("longest", self.longest, 0.0),
            ("lit_length", self.lit_length, 0.0),
            ("seen_length", self.seen_length, 0.0),
            ("jumps", self.jumps, 0.0),
            ("coarse_steps", self.coarse_steps, 0.0),
        ] {
            if !(value >= least && value.is_finite()) {
                return Err(PredictError::Outlook { name, value });
            }
        }
        Ok(())
    }
}

fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 {
        (part / whole).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{
        cast::CastOptions,
        estimate::{EstimateMethod, Estimator},
        grid::{ValueScale, Voxels},
        predict::PixelsPerRay,
        transfer::{ControlPoint, TransferFunction},
    };

    #[test]
    fn a_box_of_thin_fog() {
        let voxels = Voxels::U8(vec![9; 33 * 33 * 33]);
        let volume = Volume::new([33; 3], [2.0; 3], voxels, ValueScale::default()).unwrap();
        let point = ControlPoint {
            value: 0.0,
            colour: [1.0; 3],
            opacity: 1e-4,
        };
        let function = TransferFunction::new(vec![point]).unwrap();
        // So far away that rays are nearly parallel.
        let eye = Vec3::new(32.0, 32.0, -3168.0);
        let camera = Camera::new(eye, Vec3::splat(32.0), Vec3::Y, 2.0).unwrap();
        let estimator = Estimator::new(&volume);
        for step in [0.5, 2.0] {
            let options = CastOptions {
                step,
                ..CastOptions::default()
            };
            let size = [600, 400];
            let estimate = estimator
                .prepare(&function, EstimateMethod::MeanExtinction)
                .estimate(camera, size, &options, 0)
                .unwrap();
            let outlook = Outlook::new(&estimate, &volume, &camera, size, step);
            // 64 of 111 units of height are seen; a ray is 32 voxels long.
            let side = 400.0 * 64.0 / (2.0 * 3168.0 * 1_f64.to_radians().tan());
            let close = |got: f64, expected: f64, tolerance: f64| {
                assert!((got / expected - 1.0).abs() < tolerance, "{got} {expected}");
            };
            close(outlook.rays, side * side, 0.05);
            close(outlook.length, outlook.rays * 32.0, 0.08);
            close(outlook.pixels_per_voxel, side / 32.0, 0.02);
            assert_eq!(outlook.length, outlook.longest);
            close(outlook.lit_length, outlook.length, 1e-6);
            close(outlook.seen_length, outlook.length, 1e-6);
            assert_eq!(outlook.direction, [0.0, 0.0, 1.0]);
            assert!(outlook.coarse_steps >= 2.0);
            let quality = Quality {
                step: 4.0,
                pixels_per_ray: PixelsPerRay::Checker,
            };
            assert_eq!(outlook.samples(quality), outlook.length / 8.0);
            assert_eq!(outlook.rays(quality), outlook.rays / 2.0);
            outlook.check().unwrap();
        }
    }
}
