//! Pinhole camera.
//!
//! Idea: a [`Camera`] is the plain description of a view, free of any picture size; its
//! [`Projection`] onto a picture of given size holds what a camera ray needs, so that a ray costs
//! two scaled additions and a normalisation.
//!
//! For picture coordinates (px, py) with (0, 0) the top left corner, W × H the size of the picture
//! and v the vertical field of view,
//!
//! ```text
//! d = f + (2 px/W − 1)·tan(v/2)·(W/H)·r + (1 − 2 py/H)·tan(v/2)·u
//! f = normalize(target − origin),  r = normalize(f × up),  u = r × f
//! ```
//!
//! which is the convention of Mitsuba with `fov_axis = y`. With s = 2·tan(v/2)/H, the side of a
//! square pixel on the plane at distance 1, this is d = f + (px − W/2)·s·r − (py − H/2)·s·u. That
//! form is evaluated: the centre of the picture looks exactly along f.
//!
//! Invariants: the frame is computed in f64 and rounded once, so that a camera far from the origin
//! of the scene loses nothing; every direction is a unit vector up to rounding.

use glam::Vec3;

use crate::picture_frame::{Axes, Bundle, PictureFrame};

/// Where a picture is taken from, and how much of the scene it shows.
///
/// The fields are plain data, as they come from a scene file; [`Camera::validate`] says whether
/// they describe a view, and [`Camera::projection`] validates in any case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of projection, scene units.
    pub origin: Vec3,
    /// The point looked at: the centre of the picture. Differs from `origin`.
    pub target: Vec3,
    /// Direction that appears upwards in the picture; any length but zero, not along the view.
    pub up: Vec3,
    /// Full vertical field of view, degrees, in (0, 180).
    pub vertical_fov_degrees: f32,
}

/// Why a camera describes no view.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// A coordinate is infinite or not a number.
    #[error("camera {field} is {value}: all coordinates must be finite")]
    NotFinite {
        /// The field: `origin`, `target` or `up`.
        field: &'static str,
        /// Its value.
        value: Vec3,
    },
    /// The camera looks at the point where it stands.
    #[error("camera origin and target are both {origin}: there is no direction of view")]
    TargetIsOrigin {
        /// The common point.
        origin: Vec3,
    },
    /// `up` is zero or parallel to the direction of view.
    #[error("camera up {up} is zero or parallel to the direction of view {view}")]
    UpAlongView {
        /// The direction given.
        up: Vec3,
        /// The unit direction of view.
        view: Vec3,
    },
    /// The field of view is outside the open interval (0, 180).
    #[error(
        "vertical field of view is {degrees} degrees: it must lie between 0 and 180, exclusive"
    )]
    FieldOfView {
        /// The value given.
        degrees: f32,
    },
    /// The height of an orthographic picture is not above 0 and finite.
    #[error("an orthographic picture {height} high: its height must be above 0 and finite")]
    PictureHeight {
        /// The value given, scene units.
        height: f32,
    },
    /// The picture has no pixels.
    #[error("a picture of {width} x {height} pixels has nothing to project onto")]
    EmptyPicture {
        /// Width asked for, pixels.
        width: u32,
        /// Height asked for, pixels.
        height: u32,
    },
}

impl Camera {
    /// A validated camera.
    ///
    /// # Errors
    ///
    /// As [`Camera::validate`].
    pub fn new(
        origin: Vec3,
        target: Vec3,
        up: Vec3,
        vertical_fov_degrees: f32,
    ) -> Result<Camera, CameraError> {
        let camera = Camera {
            origin,
            target,
            up,
            vertical_fov_degrees,
        };
        camera.validate()?;
        Ok(camera)
    }

    /// Whether the fields describe a view.
    ///
    /// # Errors
    ///
    /// The first fault found: a coordinate that is not finite, a target at the origin, an `up`
    /// that is zero or along the view, a field of view outside (0, 180) degrees.
    pub fn validate(&self) -> Result<(), CameraError> {
        self.axes().map(|_| ())
    }

    /// The projection onto a picture of `width` × `height` square pixels.
    ///
    /// # Errors
    ///
    /// As [`Camera::validate`], and [`CameraError::EmptyPicture`] if either side is zero.
    pub fn projection(&self, width: u32, height: u32) -> Result<Projection, CameraError> {
        let frame = self.picture_frame(width, height)?;
        Ok(Projection {
            origin: self.origin,
            forward: frame.forward.as_vec3(),
            right_per_pixel: frame.right_per_pixel.as_vec3(),
            down_per_pixel: frame.down_per_pixel.as_vec3(),
            centre_x: frame.centre[0] as f32,
            centre_y: frame.centre[1] as f32,
        })
    }

    /// The rays of a picture of `width` × `height` square pixels before they are rounded to f32.
    ///
    /// # Errors
    ///
    /// As [`Camera::projection`].
    pub fn picture_frame(&self, width: u32, height: u32) -> Result<PictureFrame, CameraError> {
        let axes = self.axes()?;
        // The tangent of the platform's library may differ in its last bit of f64; what is left of
        // that after rounding to f32 is nothing, save in one case of about 2^28.
        let half_fov = f64::from(self.vertical_fov_degrees).to_radians() * 0.5;
        axes.picture(
            self.origin,
            2.0 * half_fov.tan(),
            Bundle::FromPoint,
            [width, height],
        )
    }

    fn axes(&self) -> Result<Axes, CameraError> {
        let axes = Axes::new(self.origin, self.target, self.up)?;
        // A NaN lies in no interval, so it is refused here as well.
        if !(self.vertical_fov_degrees > 0.0 && self.vertical_fov_degrees < 180.0) {
            return Err(CameraError::FieldOfView {
                degrees: self.vertical_fov_degrees,
            });
        }
        Ok(axes)
    }
}

/// A camera together with the size of its picture: turns picture coordinates into rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    origin: Vec3,
    forward: Vec3,
    /// Step of the unnormalised direction for one pixel to the right.
    right_per_pixel: Vec3,
    /// The same for one pixel downwards.
    down_per_pixel: Vec3,
    /// Picture coordinates of the point looked at.
    centre_x: f32,
    centre_y: f32,
}

impl Projection {
    /// Origin of every ray of the camera.
    #[inline]
    pub fn origin(&self) -> Vec3 {
        self.origin
    }

    /// Unit direction of the ray through the picture point (`px`, `py`), pixels, (0, 0) being the
    /// top left corner of the picture and (0.5, 0.5) the centre of its first pixel.
    #[inline]
    pub fn direction(&self, px: f32, py: f32) -> Vec3 {
        let across = self.right_per_pixel * (px - self.centre_x);
        let down = self.down_per_pixel * (py - self.centre_y);
        (self.forward + across + down).normalize()
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::FRAC_1_SQRT_2;

    use super::*;

    fn looking_down_z(vertical_fov_degrees: f32) -> Camera {
        Camera::new(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, vertical_fov_degrees).unwrap()
    }

    fn assert_close(found: Vec3, expected: Vec3) {
        assert!(
            (found - expected).length() < 3e-7,
            "{found} instead of {expected}"
        );
    }

    #[test]
    fn landmarks_of_the_picture() {
        let projection = looking_down_z(90.0).projection(200, 100).unwrap();
        assert_eq!(projection.origin(), Vec3::ZERO);
        assert_eq!(projection.direction(100.0, 50.0), Vec3::NEG_Z);
        let edge = FRAC_1_SQRT_2;
        assert_close(
            projection.direction(100.0, 0.0),
            Vec3::new(0.0, edge, -edge),
        );
        assert_close(
            projection.direction(100.0, 100.0),
            Vec3::new(0.0, -edge, -edge),
        );
        assert_close(
            projection.direction(0.0, 0.0),
            Vec3::new(-2.0, 1.0, -1.0).normalize(),
        );
        assert_close(
            projection.direction(200.0, 100.0),
            Vec3::new(2.0, -1.0, -1.0).normalize(),
        );
    }

    #[test]
    fn a_camera_far_from_the_scene_origin_keeps_its_frame() {
        let origin = Vec3::new(1e7, -3e6, 5e6);
        let camera = Camera::new(origin, origin + Vec3::new(0.0, 0.0, -8.0), Vec3::Y, 60.0);
        let near = looking_down_z(60.0).projection(64, 64).unwrap();
        let far = camera.unwrap().projection(64, 64).unwrap();
        assert_eq!(far.direction(3.0, 5.0), near.direction(3.0, 5.0));
    }

    #[test]
    fn one_coordinate_not_finite() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let bad = Vec3::new(0.0, value, 1.0);
            let fields = [
                ("origin", Camera::new(bad, Vec3::NEG_Z, Vec3::Y, 40.0)),
                ("target", Camera::new(Vec3::ZERO, bad, Vec3::Y, 40.0)),
                ("up", Camera::new(Vec3::ZERO, Vec3::NEG_Z, bad, 40.0)),
            ];
            for (name, result) in fields {
                assert!(
                    matches!(result, Err(CameraError::NotFinite { field, .. }) if field == name),
                    "{name}: {result:?}"
                );
            }
        }
    }

    #[test]
    fn target_at_the_origin() {
        let result = Camera::new(Vec3::ONE, Vec3::ONE, Vec3::Y, 40.0);
        assert_eq!(
            result,
            Err(CameraError::TargetIsOrigin { origin: Vec3::ONE })
        );
    }

    #[test]
    fn up_zero_or_along_the_view() {
        for up in [
            Vec3::ZERO,
            Vec3::Z,
            Vec3::NEG_Z * 1e20,
            Vec3::new(1e-8, 0.0, 1.0),
        ] {
            let result = Camera::new(Vec3::ZERO, Vec3::NEG_Z, up, 40.0);
            assert_eq!(
                result,
                Err(CameraError::UpAlongView {
                    up,
                    view: Vec3::NEG_Z
                })
            );
        }
        assert!(Camera::new(Vec3::ZERO, Vec3::NEG_Z, Vec3::new(1e-5, 0.0, 1.0), 40.0).is_ok());
    }

    #[test]
    fn field_of_view_outside_the_open_interval() {
        for degrees in [0.0, -0.0, -10.0, 180.0, 360.0, f32::NAN, f32::INFINITY] {
            let result = Camera::new(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, degrees);
            assert!(
                matches!(result, Err(CameraError::FieldOfView { .. })),
                "{degrees}"
            );
        }
    }

    #[test]
    fn picture_without_pixels() {
        for (width, height) in [(0, 1), (1, 0), (0, 0)] {
            let result = looking_down_z(40.0).projection(width, height);
            assert_eq!(result, Err(CameraError::EmptyPicture { width, height }));
        }
    }

    #[test]
    fn projection_validates_fields_that_were_set_by_hand() {
        let camera = Camera {
            up: Vec3::Z,
            ..looking_down_z(40.0)
        };
        assert!(matches!(
            camera.projection(4, 4),
            Err(CameraError::UpAlongView { .. })
        ));
    }
}
