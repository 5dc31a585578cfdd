//! On which side of an edge a ray passes, exactly (after Shewchuk, *Adaptive Precision Floating-Point Arithmetic and
//! Fast Robust Geometric Predicates*, 1997, with integers in place of expansions).

use std::cmp::Ordering;

use glam::DVec3;
use num_bigint::BigInt;
use raywright_bvh::{Ray, Vec3};

/// An edge of a triangle, beside a ray.
#[derive(Clone, Copy)]
pub(super) struct Edge {
    ends: [Vec3; 2],
    /// D·(P×Q) for the ends P and Q as seen from the origin.
    pub(super) value: f64,
    /// The sum of the magnitudes of its terms.
    magnitude: f64,
}

/// A value is off by less than ten roundings of its terms.
const SURE: f64 = 1e-14;

impl Edge {
    pub(super) fn new(p: Vec3, q: Vec3, ray: &Ray) -> Self {
        let [origin, direction] = [ray.origin, ray.direction].map(Vec3::as_dvec3);
        let [from, to] = [p, q].map(|end| end.as_dvec3() - origin);
        let magnitude = |x: DVec3| x.abs();
        let [d, f, t] = [direction, from, to].map(magnitude);
        Self {
            ends: [p, q],
            value: direction.dot(from.cross(to)),
            magnitude: d.x * (f.y * t.z + f.z * t.y)
                + d.y * (f.z * t.x + f.x * t.z)
                + d.z * (f.x * t.y + f.y * t.x),
        }
    }

    /// On which side of the edge the ray passes: that of the value if it is surely not 0, else by integers.
    pub(super) fn sign(&self, ray: &Ray) -> Ordering {
        if self.value.abs() > SURE * self.magnitude {
            return self.value.total_cmp(&0.0);
        }
        self.exact_sign(ray)
    }

    /// The same by integers, short ones if the numbers are of like size.
    fn exact_sign(&self, ray: &Ray) -> Ordering {
        let vectors = [ray.origin, ray.direction, self.ends[0], self.ends[1]];
        match short_integers(vectors.map(|vector| vector.to_array())) {
            Some([origin, direction, p, q]) => {
                let from = |end: [i128; 3]| [0, 1, 2].map(|axis| end[axis] - origin[axis]);
                let (p, q) = (from(p), from(q));
                let terms = CYCLES.map(|[x, y, z]| direction[x] * (p[y] * q[z] - p[z] * q[y]));
                terms.into_iter().sum::<i128>().cmp(&0)
            }
            None => self.sign_by_long_integers(ray),
        }
    }

    /// By integers of any length: every f32 is one, times 2⁻¹⁴⁹.
    fn sign_by_long_integers(&self, ray: &Ray) -> Ordering {
        let integers = |v: Vec3| v.to_array().map(integer);
        let [origin, direction] = [ray.origin, ray.direction].map(integers);
        let [p, q] = self.ends.map(|end| {
            let end = integers(end);
            [0, 1, 2].map(|axis| &end[axis] - &origin[axis])
        });
        let sum: BigInt = CYCLES
            .into_iter()
            .map(|[x, y, z]| &direction[x] * (&p[y] * &q[z] - &p[z] * &q[y]))
            .sum();
        sum.cmp(&BigInt::ZERO)
    }
}

/// Axes in cyclic order.
const CYCLES: [[usize; 3]; 3] = [[0, 1, 2], [1, 2, 0], [2, 0, 1]];

/// Numbers times one power of two that makes all of them integers below 2³⁹, if there is one: a product of one and two
/// differences of others is below 2¹¹⁹, and six of these fit.
fn short_integers(vectors: [[f32; 3]; 4]) -> Option<[[i128; 3]; 4]> {
    // Mantissa without trailing zeros, and exponent.
    let parts = |value: f32| {
        let bits = value.to_bits();
        let (exponent, fraction) = ((bits >> 23) & 0xff, bits & 0x7f_ffff);
        let mantissa = if exponent == 0 {
            fraction
        } else {
            fraction | 0x80_0000
        };
        let zeros = mantissa.trailing_zeros();
        (mantissa != 0).then(|| (i128::from(mantissa >> zeros), exponent.max(1) + zeros))
    };
    let nonzero = || vectors.iter().flatten().filter_map(|&value| parts(value));
    let lowest = nonzero().map(|(_, exponent)| exponent).min()?;
    let is_short = nonzero()
        .all(|(mantissa, exponent)| 128 - mantissa.leading_zeros() + exponent - lowest <= 39);
    is_short.then(|| {
        vectors.map(|vector| {
            vector.map(|value| {
                let magnitude =
                    parts(value).map_or(0, |(mantissa, exponent)| mantissa << (exponent - lowest));
                if value < 0.0 { -magnitude } else { magnitude }
            })
        })
    })
}

/// `value` · 2¹⁴⁹; 0 if it is not finite.
fn integer(value: f32) -> BigInt {
    let bits = value.to_bits();
    let (exponent, fraction) = ((bits >> 23) & 0xff, bits & 0x7f_ffff);
    let magnitude = match exponent {
        0 => BigInt::from(fraction),
        0xff => BigInt::ZERO,
        _ => BigInt::from(fraction | 0x80_0000) << (exponent - 1),
    };
    if value.is_sign_negative() {
        -magnitude
    } else {
        magnitude
    }
}

#[cfg(test)]
mod tests {
    use super::{super::tests::numbers, *};

    #[test]
    fn integers_are_the_numbers() {
        for value in [0.0, 1.5, -2.75, 1e-45, -3e-39, f32::MAX, f32::MIN_POSITIVE] {
            let expected = f64::from(value) * 2.0_f64.powi(149);
            let digits = integer(value).to_string();
            assert_eq!(digits.parse::<f64>().unwrap(), expected, "{value}");
        }
        assert_eq!(integer(f32::INFINITY), BigInt::ZERO);
    }

    #[test]
    fn both_ways_to_a_sign_agree() {
        let mut number = numbers();
        let mut vector = || Vec3::new(number(), number(), number());
        let (mut unsure, mut short) = (0, 0);
        for _ in 0..20_000 {
            let (p, q) = (vector(), vector());
            // Toward a point of the edge, so that signs are not all sure.
            let origin = vector();
            let ray = Ray::new(origin, p + 0.25 * (q - p) - origin);
            let edge = Edge::new(p, q, &ray);
            unsure += u32::from(edge.value.abs() <= SURE * edge.magnitude);
            assert_eq!(edge.sign(&ray), edge.exact_sign(&ray));
            assert_eq!(edge.sign(&ray), edge.sign_by_long_integers(&ray));
            let vectors = [ray.origin, ray.direction, p, q];
            short += u32::from(short_integers(vectors.map(|vector| vector.to_array())).is_some());
            // Seen from the other triangle at the edge.
            assert_eq!(Edge::new(q, p, &ray).sign(&ray), edge.sign(&ray).reverse());
        }
        assert!(unsure > 0 && short > 1000, "{unsure} {short}");
    }
}
