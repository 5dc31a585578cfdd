//! The camera between two keys.
//!
//! Shoemake, "Animating rotation with quaternion curves", SIGGRAPH 1985, has the interpolation on a
//! great circle. In f64, rounded once.

use glam::{DVec3, Vec3};
use raywright_imaging::Camera;

use super::CameraKey;

/// Sine of the angle between two directions below which they are mixed in a straight line.
const NEARLY_EQUAL: f64 = 1e-6;

/// The camera at a time; there is at least one key.
pub(super) fn at(keys: &[CameraKey], time: f64) -> Camera {
    let next = keys.partition_point(|key| key.t <= time);
    match (next.checked_sub(1), keys.get(next)) {
        (Some(before), Some(after)) => {
            let before = &keys[before];
            let share = (time - before.t) / (after.t - before.t);
            between(&before.camera(), &after.camera(), share)
        }
        (Some(last), None) => keys[last].camera(),
        (None, _) => keys[0].camera(),
    }
}

/// The camera at a share, 0..=1, of the way from one to another.
pub(super) fn between(from: &Camera, to: &Camera, share: f64) -> Camera {
    if share <= 0.0 || from == to {
        return *from;
    }
    if share >= 1.0 {
        return *to;
    }
    let mix = |a: Vec3, b: Vec3| a.as_dvec3().lerp(b.as_dvec3(), share);
    let target = mix(from.target, to.target);
    let [a, b] = [from, to].map(|camera| (camera.origin - camera.target).as_dvec3());
    let distance = (a.length().ln() * (1.0 - share) + b.length().ln() * share).exp();
    let [a, b] = [a, b].map(DVec3::normalize);
    let direction = great_circle(a, b, from.up.as_dvec3(), share);
    let (start, end) = (from.vertical_fov_degrees, to.vertical_fov_degrees);
    Camera {
        origin: (target + direction * distance).as_vec3(),
        target: target.as_vec3(),
        up: mix(from.up, to.up).as_vec3(),
        vertical_fov_degrees: (f64::from(start) * (1.0 - share) + f64::from(end) * share) as f32,
    }
}

/// A unit vector on the shorter great circle from `a` to `b`; if they are opposite, over `up`.
fn great_circle(a: DVec3, b: DVec3, up: DVec3, share: f64) -> DVec3 {
    let axis = a.cross(b);
    let sine = axis.length();
    if sine >= NEARLY_EQUAL {
        let angle = sine.atan2(a.dot(b)) * share;
        // a turned towards b.
        return a * angle.cos() + axis.cross(a) / sine * angle.sin();
    }
    if a.dot(b) > 0.0 {
        return a.lerp(b, share).normalize();
    }
    let side = (up - a * up.dot(a)).normalize_or(a.any_orthonormal_vector());
    let angle = std::f64::consts::PI * share;
    a * angle.cos() + side * angle.sin()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(origin: [f32; 3], target: [f32; 3]) -> Camera {
        Camera {
            origin: origin.into(),
            target: target.into(),
            up: Vec3::Z,
            vertical_fov_degrees: 30.0,
        }
    }

    #[test]
    fn a_quarter_turn_at_constant_distance() {
        let (from, to) = (
            camera([3.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
            camera([1.0, 2.0, 0.0], [1.0, 0.0, 0.0]),
        );
        for step in 0..=90 {
            let share = f64::from(step) / 90.0;
            let got = between(&from, &to, share).origin;
            let angle = f64::from(step).to_radians();
            let expected = DVec3::new(1.0 + 2.0 * angle.cos(), 2.0 * angle.sin(), 0.0);
            assert!((got.as_dvec3() - expected).length() < 1e-6, "{step}: {got}");
        }
    }

    #[test]
    fn distances_are_linear_in_their_logarithm() {
        let (from, to) = (
            camera([1.0, 0.0, 0.0], [0.0; 3]),
            camera([16.0, 0.0, 0.0], [0.0; 3]),
        );
        for (share, expected) in [(0.25, 2.0), (0.5, 4.0), (0.75, 8.0)] {
            let got = between(&from, &to, share).origin;
            assert!((got - Vec3::X * expected).length() < 1e-5, "{got}");
        }
    }

    #[test]
    fn opposite_directions_go_over_the_top() {
        let (from, to) = (
            camera([2.0, 0.0, 0.0], [0.0; 3]),
            camera([-2.0, 0.0, 0.0], [0.0; 3]),
        );
        let got = between(&from, &to, 0.5).origin;
        assert!((got - Vec3::Z * 2.0).length() < 1e-5, "{got}");
        let got = between(&from, &to, 0.25);
        got.validate().unwrap();
    }

    #[test]
    fn ends_are_the_keys_themselves() {
        let keys = [
            CameraKey::new(1.0, &camera([0.1, 0.2, 0.3], [7.0; 3])),
            CameraKey::new(2.0, &camera([5.1, 0.2, 0.3], [7.0; 3])),
            CameraKey::new(2.0, &camera([9.1, 0.2, 0.3], [7.0; 3])),
        ];
        assert_eq!(at(&keys, 0.0), keys[0].camera());
        assert_eq!(at(&keys, 1.0), keys[0].camera());
        assert_eq!(at(&keys, 2.0), keys[2].camera());
        assert_eq!(at(&keys, 3.0), keys[2].camera());
        assert!(at(&keys, 1.999_999).origin.x < 5.2);
    }
}
