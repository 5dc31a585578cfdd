//! A triangle and a ray in f64, and what a test in f32 may be off by.
//!
//! Bounds in units of the rounding u = 2⁻²⁴, with γ(n) = n·u/(1 − n·u): running error analysis after Higham,
//! *Accuracy and Stability of Numerical Algorithms*, 2002, chapter 3, of three forms of the test: triple products of
//! edges, a corner and the direction (Möller, Trumbore, *Fast, Minimum Storage Ray/Triangle Intersection*, 1997);
//! the same of the direction and, for each edge, the difference and the sum of its ends (Embree's robust mode); and
//! sheared corners (Woop, Benthin, Wald, *Watertight Ray/Triangle Intersection*, 2013).

use glam::DVec3;
use raywright_bvh::{Ray, Vec3};

use crate::exact;

/// Rounding of f32.
const UNIT: f64 = 1.0 / (1 << 24) as f64;

fn gamma(n: f64) -> f64 {
    n * UNIT / (1.0 - n * UNIT)
}

/// How a test in f32 finds the sides of edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TriangleTestForm {
    /// By triple products with two edges and the corner that they share.
    MollerTrumbore,
    /// By triple products with the difference and the sum of the ends of each edge.
    EdgeSums,
    /// By corners that are sheared such that the ray is an axis.
    Sheared,
}

/// A triangle seen along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Evaluation {
    /// Whether the line of the ray meets it exactly, borders included.
    pub is_met: bool,
    /// How far inside of its edges the ray passes, in bounds of the error: above 1 no test may miss it, below −1
    /// none may hit it; by edges opposite to vertices 0, 1, 2.
    pub margins: [f64; 3],
    /// Distance to its plane, and bound of the error.
    pub t: f64,
    /// The bound.
    pub t_bound: f64,
    /// Weights of vertices 1 and 2.
    pub uv: [f64; 2],
    /// Bound of the error of either.
    pub uv_bound: f64,
    /// Whether so little is certain that no number can be relied on: a sliver, or seen edge-on.
    pub is_ill_conditioned: bool,
    /// Above 0 if vertices 0, 1, 2 run counter-clockwise as the ray sees them; 0 if it sees a line.
    pub orientation: f64,
}

impl Evaluation {
    /// Of a triangle, for tests of a form.
    #[must_use]
    pub fn new(corners: [Vec3; 3], ray: &Ray, form: TriangleTestForm) -> Self {
        let origin = ray.origin.as_dvec3();
        let direction = ray.direction.as_dvec3();
        let [a, b, c] = corners.map(|corner| corner.as_dvec3() - origin);
        let (values, bounds) = match form {
            TriangleTestForm::MollerTrumbore => moller_trumbore([a, b, c], direction),
            TriangleTestForm::EdgeSums => edge_sums([a, b, c], direction),
            TriangleTestForm::Sheared => sheared([a, b, c], direction),
        };
        let sum: f64 = values.iter().sum();
        let sum_bound = bounds.iter().sum::<f64>()
            + gamma(2.0) * values.iter().map(|value| value.abs()).sum::<f64>();
        let sign = if sum < 0.0 { -1.0 } else { 1.0 };
        let margins = [0, 1, 2].map(|i| sign * values[i] / bounds[i].max(f64::MIN_POSITIVE));
        let sure = sum.abs() - sum_bound;
        let is_ill_conditioned = sum_bound >= 0.5 * sum.abs();
        let weights = values.map(|value| value / sum);
        let weight_bounds =
            [0, 1, 2].map(|i| (bounds[i] + weights[i].abs() * sum_bound) / sure + 2.0 * UNIT);
        let (t, t_bound) = distance([a, b, c], direction, weights, weight_bounds);
        Self {
            is_met: exact::is_met(corners, ray),
            margins,
            t,
            t_bound,
            uv: [weights[1], weights[2]],
            uv_bound: weight_bounds[1].max(weight_bounds[2]),
            is_ill_conditioned,
            orientation: sum,
        }
    }

    /// The smallest of the margins.
    #[must_use]
    pub fn margin(&self) -> f64 {
        self.margins.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// The largest terms of D·(P×Q), if the components of P and Q are as large as given.
fn terms(d: DVec3, p: DVec3, q: DVec3) -> f64 {
    let (d, p, q) = (d.abs(), p.abs(), q.abs());
    d.x * (p.y * q.z + p.z * q.y) + d.y * (p.z * q.x + p.x * q.z) + d.z * (p.x * q.y + p.y * q.x)
}

/// D·(B×C), D·(C×A), D·(A×B).
fn triple_products([a, b, c]: [DVec3; 3], d: DVec3) -> [f64; 3] {
    [(b, c), (c, a), (a, b)].map(|(p, q)| d.dot(p.cross(q)))
}

/// These, and bounds of what f32 makes of them: eight roundings of each term where edges are stored. The first weight
/// is what the other two leave of the whole.
fn moller_trumbore([a, b, c]: [DVec3; 3], d: DVec3) -> ([f64; 3], [f64; 3]) {
    let [second, third] = [c - a, b - a].map(|edge| gamma(8.0) * terms(edge, a, d));
    let whole = gamma(8.0) * terms(d, b - a, c - a);
    (
        triple_products([a, b, c], d),
        [second + third + whole, second, third],
    )
}

/// The same; twice a value is that of the difference and the sum.
fn edge_sums([a, b, c]: [DVec3; 3], d: DVec3) -> ([f64; 3], [f64; 3]) {
    let bounds = [(b, c), (c, a), (a, b)].map(|(p, q)| gamma(7.0) * 0.5 * terms(d, p - q, p + q));
    (triple_products([a, b, c], d), bounds)
}

/// The same of sheared corners. A component of a sheared corner is off by four roundings of its terms; the products of
/// two of them by what these make of each other, and two roundings.
fn sheared(corners: [DVec3; 3], d: DVec3) -> ([f64; 3], [f64; 3]) {
    let size = d.abs();
    // The largest last; of equal ones, the first.
    let axes = if size.x >= size.y && size.x >= size.z {
        [1, 2, 0]
    } else if size.y >= size.z {
        [2, 0, 1]
    } else {
        [0, 1, 2]
    };
    let [x, y, z] = axes.map(|axis| d[axis]);
    let shear = [x / z, y / z];
    let points = corners.map(|corner| {
        let along = corner[axes[2]];
        [0, 1].map(|i| {
            let (own, moved) = (corner[axes[i]], shear[i] * along);
            (own - moved, gamma(4.0) * (own.abs() + moved.abs()))
        })
    });
    let [a, b, c] = points;
    // (value, bound) of p × q in the plane, seen along the ray: the sign is that of D·(P×Q).
    let edge = |p: [(f64, f64); 2], q: [(f64, f64); 2]| {
        let product = |(a, e): (f64, f64), (b, f): (f64, f64)| {
            (
                a * b,
                a.abs() * f + b.abs() * e + e * f + gamma(2.0) * (a * b).abs(),
            )
        };
        let (left, right) = (product(p[0], q[1]), product(p[1], q[0]));
        (z.signum() * (left.0 - right.0), left.1 + right.1)
    };
    let edges = [edge(b, c), edge(c, a), edge(a, b)];
    (edges.map(|edge| edge.0), edges.map(|edge| edge.1))
}

/// Where the ray meets the plane, and how far off a test may be that finds it by weights or by the normal.
fn distance(
    [a, b, c]: [DVec3; 3],
    direction: DVec3,
    weights: [f64; 3],
    weight_bounds: [f64; 3],
) -> (f64, f64) {
    let (e1, e2) = (b - a, c - a);
    let normal = e1.cross(e2);
    let along = normal.dot(direction);
    let t = normal.dot(a) / along;
    // By the normal: its components are sums of two products.
    let along_bound = gamma(7.0) * terms(direction, e1, e2);
    let plane_bound = gamma(8.0) * terms(a, e1, e2);
    let sure = along.abs() - along_bound;
    let by_normal = (plane_bound + t.abs() * along_bound) / sure;
    // By the weights: along the largest axis of the direction.
    let size = direction.abs();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let corners = [a, b, c];
    let off: f64 = (0..3)
        .map(|i| {
            let along = corners[i][axis].abs();
            weight_bounds[i] * along + gamma(6.0) * weights[i].abs() * along
        })
        .sum();
    let by_weights = off / size[axis];
    let bound = by_normal.max(by_weights) + 2.0 * UNIT * t.abs();
    // Beyond what is certain: anything.
    let bound = if sure > 0.0 && bound >= 0.0 {
        bound
    } else {
        f64::INFINITY
    };
    (t, bound)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_see_the_same_triangle() {
        let corners = [
            Vec3::new(0.0, 0.0, 2.0),
            Vec3::new(4.0, 0.0, 2.0),
            Vec3::new(0.0, 4.0, 2.0),
        ];
        for ray in [
            Ray::new([1.0, 0.5, -1.0], [0.0, 0.25, 1.0]),
            Ray::new([1.0, 2.0, 5.0], [0.0, -0.25, -1.0]),
        ] {
            let forms = [
                TriangleTestForm::MollerTrumbore,
                TriangleTestForm::EdgeSums,
                TriangleTestForm::Sheared,
            ];
            let [products, sums, sheared] = forms.map(|form| Evaluation::new(corners, &ray, form));
            for evaluation in [products, sums, sheared] {
                assert!(evaluation.is_met && evaluation.margin() > 1e4);
                assert!((evaluation.t - 3.0).abs() < 1e-12);
                assert!((evaluation.uv[0] - 0.25).abs() < 1e-12);
                assert!((evaluation.uv[1] - 0.3125).abs() < 1e-12);
                assert!(evaluation.t_bound < 1e-4 && evaluation.uv_bound < 1e-4);
                assert!(!evaluation.is_ill_conditioned);
            }
            assert_eq!(products.orientation > 0.0, sheared.orientation > 0.0);
            assert!((products.uv[1] - sheared.uv[1]).abs() < 1e-12);
        }
    }

    #[test]
    fn an_edge_and_a_plane_are_uncertain() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let form = TriangleTestForm::Sheared;
        let on_edge = Ray::new([0.5, 0.5, 1.0], [0.0, 0.0, -1.0]);
        let evaluation = Evaluation::new(corners, &on_edge, form);
        assert!(evaluation.is_met && evaluation.margin().abs() < 1.0);
        let in_plane = Ray::new([-1.0, 0.25, 0.0], [1.0, 0.0, 0.0]);
        let evaluation = Evaluation::new(corners, &in_plane, form);
        assert!(!evaluation.is_met && evaluation.is_ill_conditioned);
        assert_eq!(evaluation.t_bound, f64::INFINITY);
    }
}
