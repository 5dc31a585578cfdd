//! From uniform numbers to points and directions.
//!
//! Invariant: nothing here calls a function of the platform's mathematical library, whose last bit
//! may differ from one version to the next; square roots and divisions are exact everywhere.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use raywright_bvh::Vec3;

/// A direction around `normal` with density cos θ / π: a point of the unit disk lifted to the
/// hemisphere (Malley's method).
#[inline]
pub(crate) fn cosine_hemisphere(normal: Vec3, uniform: [f32; 2]) -> Vec3 {
    let [x, y] = concentric_disk(uniform);
    let z = (1.0 - x * x - y * y).max(0.0).sqrt();
    let (tangent, bitangent) = basis(normal);
    tangent * x + bitangent * y + normal * z
}

/// A point of the unit disk, of equal area for equal area of the square: Shirley, Chiu, *A Low
/// Distortion Map Between Disk and Square*, 1997.
#[inline]
fn concentric_disk([a, b]: [f32; 2]) -> [f32; 2] {
    let (a, b) = (2.0 * a - 1.0, 2.0 * b - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0, 0.0];
    }
    // The angle stays within an eighth of a turn around an axis, where short series are exact to
    // the last bits.
    if a.abs() > b.abs() {
        let (sin, cos) = sin_cos_eighth(FRAC_PI_4 * (b / a));
        [a * cos, a * sin]
    } else {
        let (sin, cos) = sin_cos_eighth(FRAC_PI_4 * (a / b));
        [b * sin, b * cos]
    }
}

/// Sine and cosine for |x| ≤ π/4, by their series to x⁹ and x¹⁰ (error below 2⁻²⁴).
#[inline]
fn sin_cos_eighth(x: f32) -> (f32, f32) {
    debug_assert!(x.abs() < FRAC_PI_2 / 2.0 + 1e-6);
    let s = x * x;
    let sin = x
        * (1.0
            + s * (-1.0 / 6.0 + s * (1.0 / 120.0 + s * (-1.0 / 5040.0 + s * (1.0 / 362_880.0)))));
    let cos = 1.0
        + s * (-0.5
            + s * (1.0 / 24.0
                + s * (-1.0 / 720.0 + s * (1.0 / 40_320.0 - s * (1.0 / 3_628_800.0)))));
    (sin, cos)
}

/// Two unit vectors perpendicular to a unit vector and to each other: Duff, Burgess, Christensen,
/// Hery, Kensler, Liani, Villemin, *Building an Orthonormal Basis, Revisited*, 2017.
#[inline]
fn basis(n: Vec3) -> (Vec3, Vec3) {
    let sign = 1f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (
        Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vec3::new(b, sign + n.y * n.y * a, -n.y),
    )
}

/// Weights of the three corners for a point of uniform density in a triangle.
#[inline]
pub(crate) fn uniform_triangle([a, b]: [f32; 2]) -> [f32; 3] {
    let root = a.sqrt();
    [1.0 - root, root * (1.0 - b), root * b]
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use proptest::prelude::*;
    use raywright_imaging::PixelSampler;

    use super::*;

    proptest! {
        #[test]
        fn directions_are_unit_vectors_of_the_hemisphere(
            n in prop::array::uniform3(-1f32..1.0), uniform in prop::array::uniform2(0f32..1.0),
        ) {
            let n = Vec3::from(n);
            prop_assume!(n.length() > 1e-3);
            let n = n.normalize();
            let d = cosine_hemisphere(n, uniform);
            prop_assert!((d.length() - 1.0).abs() < 1e-6, "{}", d.length());
            prop_assert!(d.dot(n) > -1e-6);
        }

        #[test]
        fn series_equal_the_functions(x in -PI / 4.0..PI / 4.0) {
            let (sin, cos) = sin_cos_eighth(x);
            prop_assert!((sin - x.sin()).abs() < 1.2e-7 && (cos - x.cos()).abs() < 1.2e-7);
        }
    }

    /// The cosine θ of the density cos θ / π has mean 2/3 and mean square 1/2; cos² θ is uniform.
    #[test]
    fn cosine_hemisphere_has_its_density() {
        let n = Vec3::new(0.6, -0.48, 0.64);
        let mut cells = [0_u32; 10];
        for sample in 0..40_000 {
            let uniform = PixelSampler::new(7, 0, 0, sample).uniform_2d(0);
            let cos = cosine_hemisphere(n, uniform).dot(n).clamp(0.0, 1.0);
            cells[((cos * cos * 10.0) as usize).min(9)] += 1;
        }
        // Each cell expects 4000 with a deviation of 60.
        for cell in cells {
            assert!((3750..=4250).contains(&cell), "{cells:?}");
        }
    }

    #[test]
    fn uniform_triangle_has_equal_weights_on_average() {
        let side = 200;
        let mut mean = [0.0; 3];
        for i in 0..side * side {
            let uniform =
                [(i % side) as f32 + 0.5, (i / side) as f32 + 0.5].map(|x| x / side as f32);
            for (mean, weight) in mean.iter_mut().zip(uniform_triangle(uniform)) {
                assert!(weight >= 0.0);
                *mean += f64::from(weight) / f64::from(side * side);
            }
        }
        assert!(
            mean.iter().all(|m| (m - 1.0 / 3.0).abs() < 1e-4),
            "{mean:?}"
        );
    }
}
