//! Camera rays against the formula in f64, and under any numbers whatever.

use glam::Vec3;
use proptest::prelude::*;
use raywright_imaging::Camera;

/// The formula of the documentation of `camera`, literally and in f64, on plain arrays.
fn direction_f64(camera: &Camera, size: [u32; 2], at: [f32; 2]) -> [f64; 3] {
    fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
    }
    fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    }
    fn unit(a: [f64; 3]) -> [f64; 3] {
        let length = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
        a.map(|coordinate| coordinate / length)
    }
    let wide = |v: Vec3| v.to_array().map(f64::from);
    let f = unit(minus(wide(camera.target), wide(camera.origin)));
    let r = unit(cross(f, wide(camera.up)));
    let u = cross(r, f);
    let tan = (f64::from(camera.vertical_fov_degrees) * std::f64::consts::PI / 360.0).tan();
    let [w, h] = size.map(f64::from);
    let [px, py] = at.map(f64::from);
    let across = (2.0 * px / w - 1.0) * tan * (w / h);
    let upwards = (1.0 - 2.0 * py / h) * tan;
    unit([0, 1, 2].map(|i| f[i] + across * r[i] + upwards * u[i]))
}

fn point(range: f32) -> impl Strategy<Value = Vec3> {
    let coordinate = -range..range;
    [coordinate.clone(), coordinate.clone(), coordinate].prop_map(Vec3::from)
}

fn any_point() -> impl Strategy<Value = Vec3> {
    let any_bits = any::<u32>().prop_map(f32::from_bits);
    prop::array::uniform3(any_bits).prop_map(Vec3::from)
}

proptest! {
    #[test]
    fn directions_agree_with_f64(
        origin in point(1e4),
        target in point(1e4),
        up in point(1.0),
        fov in 1f32..175.0,
        size in prop::array::uniform2(1u32..5000),
        at in prop::array::uniform2(0f32..1.0),
    ) {
        let view = (target - origin).normalize_or_zero();
        prop_assume!(view.cross(up.normalize_or_zero()).length() > 0.01);
        let camera = Camera::new(origin, target, up, fov).unwrap();
        let at = [at[0] * size[0] as f32, at[1] * size[1] as f32];
        let found = camera.projection(size[0], size[1]).unwrap().direction(at[0], at[1]);
        let expected = direction_f64(&camera, size, at);
        for (found, expected) in found.to_array().into_iter().zip(expected) {
            prop_assert!((f64::from(found) - expected).abs() < 3e-7, "{found} {expected}");
        }
    }

    #[test]
    fn any_numbers_give_an_error_or_unit_directions(
        origin in any_point(),
        target in any_point(),
        up in any_point(),
        fov in prop_oneof![any::<u32>().prop_map(f32::from_bits), Just(1e-40), Just(179.99998)],
        width in 1u32..=u32::MAX,
        height in 1u32..=u32::MAX,
    ) {
        let camera = Camera { origin, target, up, vertical_fov_degrees: fov };
        if let Ok(projection) = camera.projection(width, height) {
            let (w, h) = (width as f32, height as f32);
            for (px, py) in [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h), (w * 0.5, h * 0.5)] {
                let length = projection.direction(px, py).length();
                prop_assert!((length - 1.0).abs() < 1e-6, "length {length}");
            }
        }
    }
}
