//! Orthographic camera: parallel rays, which keep sizes whatever the distance.
//!
//! For picture coordinates (px, py) with (0, 0) the top left corner, W × H the size of the picture and
//! h its height in scene units, all rays go along f and begin on the plane through the origin of the
//! camera at
//!
//! ```text
//! o = origin + (px − W/2)·(h/H)·r − (py − H/2)·(h/H)·u
//! f = normalize(target − origin),  r = normalize(f × up),  u = r × f
//! ```
//!
//! It is a type of its own, so that it cannot reach those who need a centre of projection: the
//! indicators of the path tracer know a field of view.

use glam::Vec3;

use crate::{
    camera::{Camera, CameraError},
    picture_frame::{Axes, Bundle, PictureFrame},
};

/// Where a picture with parallel rays is taken from, and how much it shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrthographicCamera {
    /// The centre of the plane on which rays begin, scene units. What is behind is not seen.
    pub origin: Vec3,
    /// A point on the ray through the centre of the picture. Differs from `origin`.
    pub target: Vec3,
    /// Direction that appears upwards in the picture; any length but zero, not along the view.
    pub up: Vec3,
    /// Height of what the picture shows, scene units, above 0.
    pub height: f32,
}

impl OrthographicCamera {
    /// A validated camera.
    ///
    /// # Errors
    ///
    /// As [`OrthographicCamera::validate`].
    pub fn new(origin: Vec3, target: Vec3, up: Vec3, height: f32) -> Result<Self, CameraError> {
        let camera = Self {
            origin,
            target,
            up,
            height,
        };
        camera.validate()?;
        Ok(camera)
    }

    /// Whether the fields describe a view.
    ///
    /// # Errors
    ///
    /// As [`Camera::validate`], with [`CameraError::PictureHeight`] in place of the field of view.
    pub fn validate(&self) -> Result<(), CameraError> {
        self.axes().map(|_| ())
    }

    /// The rays of a picture of `width` × `height` square pixels.
    ///
    /// # Errors
    ///
    /// As [`OrthographicCamera::validate`], and [`CameraError::EmptyPicture`] if either side is zero.
    pub fn picture_frame(&self, width: u32, height: u32) -> Result<PictureFrame, CameraError> {
        let picture_height = f64::from(self.height);
        self.axes()?.picture(
            self.origin,
            picture_height,
            Bundle::Parallel,
            [width, height],
        )
    }

    fn axes(&self) -> Result<Axes, CameraError> {
        let axes = Axes::new(self.origin, self.target, self.up)?;
        if !(self.height > 0.0 && self.height.is_finite()) {
            return Err(CameraError::PictureHeight {
                height: self.height,
            });
        }
        Ok(axes)
    }
}

/// A camera of either kind, for those who can use both.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum AnyCamera {
    /// All rays begin at one point.
    Pinhole(Camera),
    /// All rays are parallel.
    Orthographic(OrthographicCamera),
}

impl AnyCamera {
    /// Whether it describes a view.
    ///
    /// # Errors
    ///
    /// As [`Camera::validate`] and [`OrthographicCamera::validate`].
    pub fn validate(&self) -> Result<(), CameraError> {
        match self {
            Self::Pinhole(camera) => camera.validate(),
            Self::Orthographic(camera) => camera.validate(),
        }
    }

    /// The rays of a picture of `width` × `height` square pixels.
    ///
    /// # Errors
    ///
    /// As [`AnyCamera::validate`], and [`CameraError::EmptyPicture`] if either side is zero.
    pub fn picture_frame(&self, width: u32, height: u32) -> Result<PictureFrame, CameraError> {
        match self {
            Self::Pinhole(camera) => camera.picture_frame(width, height),
            Self::Orthographic(camera) => camera.picture_frame(width, height),
        }
    }

    /// Where it stands, scene units.
    #[must_use]
    pub fn origin(&self) -> Vec3 {
        match self {
            Self::Pinhole(camera) => camera.origin,
            Self::Orthographic(camera) => camera.origin,
        }
    }

    /// The point that it looks at.
    #[must_use]
    pub fn target(&self) -> Vec3 {
        match self {
            Self::Pinhole(camera) => camera.target,
            Self::Orthographic(camera) => camera.target,
        }
    }

    /// The direction that appears upwards.
    #[must_use]
    pub fn up(&self) -> Vec3 {
        match self {
            Self::Pinhole(camera) => camera.up,
            Self::Orthographic(camera) => camera.up,
        }
    }

    /// The same camera at another place, looking at the same point.
    #[must_use]
    pub fn with_origin(self, origin: Vec3) -> Self {
        match self {
            Self::Pinhole(camera) => Self::Pinhole(Camera { origin, ..camera }),
            Self::Orthographic(camera) => {
                Self::Orthographic(OrthographicCamera { origin, ..camera })
            }
        }
    }
}

impl From<Camera> for AnyCamera {
    fn from(camera: Camera) -> Self {
        Self::Pinhole(camera)
    }
}

impl From<&Camera> for AnyCamera {
    fn from(camera: &Camera) -> Self {
        Self::Pinhole(*camera)
    }
}

impl From<OrthographicCamera> for AnyCamera {
    fn from(camera: OrthographicCamera) -> Self {
        Self::Orthographic(camera)
    }
}

impl From<&OrthographicCamera> for AnyCamera {
    fn from(camera: &OrthographicCamera) -> Self {
        Self::Orthographic(*camera)
    }
}

impl From<&AnyCamera> for AnyCamera {
    fn from(camera: &AnyCamera) -> Self {
        *camera
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn looking_down_z(height: f32) -> Result<OrthographicCamera, CameraError> {
        OrthographicCamera::new(
            Vec3::new(1.0, 2.0, 3.0),
            Vec3::new(1.0, 2.0, 0.0),
            Vec3::Y,
            height,
        )
    }

    #[test]
    fn landmarks_of_the_picture() {
        let frame = looking_down_z(8.0)
            .unwrap()
            .picture_frame(200, 100)
            .unwrap();
        for (at, origin) in [
            ([100.0, 50.0], [1.0, 2.0, 3.0]),
            ([0.0, 0.0], [-7.0, 6.0, 3.0]),
            ([200.0, 100.0], [9.0, -2.0, 3.0]),
        ] {
            let [found, direction] = frame.ray(at[0], at[1]);
            assert!((found - DVec3::from(origin)).length() < 1e-14, "{found}");
            assert_eq!(direction, DVec3::NEG_Z);
        }
    }

    #[test]
    fn heights_that_show_nothing() {
        for height in [0.0, -0.0, -1.0, f32::NAN, f32::INFINITY] {
            let result = looking_down_z(height);
            assert!(
                matches!(result, Err(CameraError::PictureHeight { .. })),
                "{height}"
            );
        }
    }

    #[test]
    fn faults_that_both_kinds_have() {
        let camera = looking_down_z(1.0).unwrap();
        let of = |camera: OrthographicCamera| AnyCamera::from(camera).picture_frame(3, 0);
        let [origin, target] = [camera.origin, camera.target];
        let up = Vec3::NEG_Z;
        assert!(matches!(
            of(OrthographicCamera { up, ..camera }),
            Err(CameraError::UpAlongView { .. })
        ));
        let at_target = AnyCamera::from(camera).with_origin(target);
        assert_eq!(
            at_target.validate(),
            Err(CameraError::TargetIsOrigin { origin: target })
        );
        let (width, height) = (3, 0);
        assert_eq!(of(camera), Err(CameraError::EmptyPicture { width, height }));
        assert_eq!(AnyCamera::from(&camera).origin(), origin);
    }
}
