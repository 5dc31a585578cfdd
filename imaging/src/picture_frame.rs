//! The rays of a picture in f64, which cameras of all kinds come down to.
//!
//! Invariant: axes are computed in f64 and not rounded, so that a ray is known to about 10⁻¹⁵ of the
//! distance.

use glam::{DVec3, Vec3};

use crate::camera::CameraError;

/// Smallest sine of the angle between `up` and the direction of view. Unit vectors rounded to f32
/// are off by about 6e-8: closer than a few of these, the frame would be made of rounding errors.
const MIN_UP_SINE: f64 = 1e-6;

/// How the rays of a picture lie to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bundle {
    /// They begin at one point and go apart.
    FromPoint,
    /// They begin on a plane and are parallel.
    Parallel,
}

/// The rays of a picture in f64: for those to whom an error of 10⁻⁷ of the distance is too much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureFrame {
    /// Whether the steps for a pixel are steps of the direction or of the origin.
    pub bundle: Bundle,
    /// Origin of the ray through the centre of the picture, scene units.
    pub origin: DVec3,
    /// Unit direction of that ray.
    pub forward: DVec3,
    /// Step for one pixel to the right, at a right angle to `forward`: on the plane at distance 1
    /// for rays from a point, in scene units for parallel ones.
    pub right_per_pixel: DVec3,
    /// The same for one pixel downwards.
    pub down_per_pixel: DVec3,
    /// Picture coordinates of the centre, pixels.
    pub centre: [f64; 2],
}

impl PictureFrame {
    /// Origin and unit direction of the ray through a picture point, pixels, (0, 0) being the top
    /// left corner of the picture.
    #[inline]
    pub fn ray(&self, px: f64, py: f64) -> [DVec3; 2] {
        let across = self.right_per_pixel * (px - self.centre[0]);
        let down = self.down_per_pixel * (py - self.centre[1]);
        match self.bundle {
            Bundle::FromPoint => [self.origin, (self.forward + across + down).normalize()],
            Bundle::Parallel => [self.origin + across + down, self.forward],
        }
    }
}

/// Orthonormal right-handed frame of a camera: right × up = −forward.
pub(crate) struct Axes {
    forward: DVec3,
    right: DVec3,
    up: DVec3,
}

impl Axes {
    /// The frame of a camera at `origin` that looks at `target`.
    pub(crate) fn new(origin: Vec3, target: Vec3, up: Vec3) -> Result<Self, CameraError> {
        for (field, value) in [("origin", origin), ("target", target), ("up", up)] {
            if !value.is_finite() {
                return Err(CameraError::NotFinite { field, value });
            }
        }
        if origin == target {
            return Err(CameraError::TargetIsOrigin { origin });
        }
        // In f64 neither the difference of two finite f32 nor the square of any overflows or
        // vanishes, so both vectors below are units.
        let forward = (target.as_dvec3() - origin.as_dvec3()).normalize();
        let right = forward.cross(up.as_dvec3().normalize_or_zero());
        if right.length() < MIN_UP_SINE {
            return Err(CameraError::UpAlongView {
                up,
                view: forward.as_vec3(),
            });
        }
        let right = right.normalize();
        Ok(Self {
            forward,
            right,
            up: right.cross(forward),
        })
    }

    /// A picture of `width` × `height` square pixels that is `picture_height` high.
    pub(crate) fn picture(
        &self,
        origin: Vec3,
        picture_height: f64,
        bundle: Bundle,
        [width, height]: [u32; 2],
    ) -> Result<PictureFrame, CameraError> {
        if width == 0 || height == 0 {
            return Err(CameraError::EmptyPicture { width, height });
        }
        let pixel_side = picture_height / f64::from(height);
        Ok(PictureFrame {
            bundle,
            origin: origin.as_dvec3(),
            forward: self.forward,
            right_per_pixel: self.right * pixel_side,
            down_per_pixel: self.up * -pixel_side,
            centre: [width, height].map(|side| f64::from(side) * 0.5),
        })
    }
}
