//! A triangle and a ray in f64, and what a test in f32 may be off by.
//!
//! Bounds in units of the rounding u = 2⁻²⁴, with γ(n) = n·u/(1 − n·u): running error analysis after Higham,
//! *Accuracy and Stability of Numerical Algorithms*, 2002, chapter 3, of three forms of the test: triple products of
//! edges, a corner and the direction (Möller, Trumbore, *Fast, Minimum Storage Ray/Triangle Intersection*, 1997);
//! the same of the direction and, for each edge, the difference and the sum of its ends (Embree's robust mode); and
//! sheared corners (Woop, Benthin, Wald, *Watertight Ray/Triangle Intersection*, 2013), with their distance or with that
//! to the plane.

use glam::DVec3;
use raywright_bvh::{Accuracy, Ray, Vec3};

use super::{
    clamp::clamped,
    sheared::{Shear, axes_of},
};
use crate::exact;

/// Rounding of f32.
const UNIT: f64 = 1.0 / (1 << 24) as f64;

pub(super) fn gamma(n: f64) -> f64 {
    n * UNIT / (1.0 - n * UNIT)
}

/// How a test in f32 finds the sides of edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TriangleTestForm {
    /// By triple products with two edges and the corner that they share.
    MollerTrumbore,
    /// By triple products with the difference and the sum of the ends of each edge.
    EdgeSums,
    /// By corners that are sheared such that the ray is an axis, of which the distance is interpolated too.
    Sheared,
    /// The same, but the distance is that to the plane of the corners before they are sheared.
    ShearedToPlane,
}

impl TriangleTestForm {
    /// That of our test of an accuracy.
    #[must_use]
    pub fn of_ours(accuracy: Accuracy) -> Self {
        match accuracy {
            Accuracy::Fast => Self::MollerTrumbore,
            Accuracy::Robust => Self::ShearedToPlane,
        }
    }
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
    /// Distance to its plane.
    pub t: f64,
    /// What a test may find for it: from, to.
    pub t_range: [f64; 2],
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
    /// Of a triangle, for our test of an accuracy, if coordinates are below `coordinate_bound`: the power of two above
    /// the largest of the scene's.
    #[must_use]
    pub fn of_ours(
        corners: [Vec3; 3],
        ray: &Ray,
        accuracy: Accuracy,
        coordinate_bound: f64,
    ) -> Self {
        let free = Self::new(corners, ray, TriangleTestForm::of_ours(accuracy));
        Self {
            t_range: clamped(free.t_range, corners, ray, accuracy, coordinate_bound),
            ..free
        }
    }

    /// Of a triangle, for tests of a form that leave the distance as it is.
    #[must_use]
    pub fn new(corners: [Vec3; 3], ray: &Ray, form: TriangleTestForm) -> Self {
        let origin = ray.origin.as_dvec3();
        let direction = ray.direction.as_dvec3();
        let [a, b, c] = corners.map(|corner| corner.as_dvec3() - origin);
        let (values, bounds) = match form {
            TriangleTestForm::MollerTrumbore => moller_trumbore([a, b, c], direction),
            TriangleTestForm::EdgeSums => edge_sums([a, b, c], direction),
            TriangleTestForm::Sheared | TriangleTestForm::ShearedToPlane => {
                sheared([a, b, c], direction)
            }
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
        let (t, bound) = distance([a, b, c], direction, form, weights, weight_bounds);
        Self {
            is_met: exact::is_met(corners, ray),
            margins,
            t,
            t_range: if bound < f64::INFINITY {
                [t - bound, t + bound]
            } else {
                [f64::NEG_INFINITY, f64::INFINITY]
            },
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

/// The same of sheared corners: bounds of what their ends and their own products are off by.
fn sheared(corners: [DVec3; 3], d: DVec3) -> ([f64; 3], [f64; 3]) {
    let shear = Shear::new(d);
    let [a, b, c] = corners.map(|corner| shear.point(corner));
    let sides = [(b, c), (c, a), (a, b)].map(|(p, q)| shear.side(p, q));
    (
        sides.map(|side| shear.sign * side.value),
        sides.map(|side| side.moved + side.rounded),
    )
}

/// Where the ray meets the plane, and how far off a test of the form may be.
fn distance(
    [a, b, c]: [DVec3; 3],
    direction: DVec3,
    form: TriangleTestForm,
    weights: [f64; 3],
    weight_bounds: [f64; 3],
) -> (f64, f64) {
    let (e1, e2) = (b - a, c - a);
    let normal = e1.cross(e2);
    let along = normal.dot(direction);
    let t = normal.dot(a) / along;
    let bound = match form {
        TriangleTestForm::Sheared => {
            let [_, _, axis] = axes_of(direction);
            by_weights([a[axis], b[axis], c[axis]], weights, weight_bounds) / direction[axis].abs()
        }
        // By the normal, whose components are sums of two products.
        TriangleTestForm::MollerTrumbore
        | TriangleTestForm::EdgeSums
        | TriangleTestForm::ShearedToPlane => {
            let along_bound = gamma(7.0) * terms(direction, e1, e2);
            let plane_bound = gamma(8.0) * terms(a, e1, e2);
            let sure = along.abs() - along_bound;
            let bound = (plane_bound + t.abs() * along_bound) / sure;
            if sure > 0.0 { bound } else { f64::INFINITY }
        }
    };
    // A quotient in the last two places; that of the other tracer by a reciprocal and a step of Newton's.
    let quotient = match form {
        TriangleTestForm::EdgeSums => 6.0,
        TriangleTestForm::MollerTrumbore
        | TriangleTestForm::Sheared
        | TriangleTestForm::ShearedToPlane => 2.0,
    };
    let bound = bound + quotient * UNIT * t.abs();
    // Beyond what is certain: anything.
    let is_certain = bound >= 0.0 && weight_bounds.iter().all(|&bound| bound >= 0.0);
    (t, if is_certain { bound } else { f64::INFINITY })
}

/// How far off A + v·(B − A) + w·(C − A) may be, with corners that one subtraction made. The weight of A is what the
/// others leave: an error of v counts by the length of an edge, even where all of the weight is at a corner that is
/// near. Each term is rounded in its corners, the difference, the product and two sums.
fn by_weights([a, b, c]: [f64; 3], weights: [f64; 3], weight_bounds: [f64; 3]) -> f64 {
    let term = |i: usize, end: f64| {
        weight_bounds[i] * (end - a).abs() + gamma(5.0) * weights[i].abs() * (end.abs() + a.abs())
    };
    term(1, b) + term(2, c) + gamma(3.0) * a.abs()
}

#[cfg(test)]
mod tests {
    use raywright_bvh::{BuildParams, Bvh, TriangleMesh};

    use super::*;

    #[test]
    fn all_forms_see_the_same_triangle() {
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
                TriangleTestForm::ShearedToPlane,
            ];
            let [products, sums, sheared, to_plane] =
                forms.map(|form| Evaluation::new(corners, &ray, form));
            for evaluation in [products, sums, sheared, to_plane] {
                assert!(evaluation.is_met && evaluation.margin() > 1e4);
                assert!((evaluation.t - 3.0).abs() < 1e-12);
                assert!((evaluation.uv[0] - 0.25).abs() < 1e-12);
                assert!((evaluation.uv[1] - 0.3125).abs() < 1e-12);
                let [from, to] = evaluation.t_range;
                assert!(from < 3.0 && to > 3.0 && to - from < 2e-4);
                assert!(evaluation.uv_bound < 1e-4);
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
        assert_eq!(evaluation.t_range, [f64::NEG_INFINITY, f64::INFINITY]);
        // Ours stays near the box: the plane x = 0 at 1, the plane x = 1 at 2.
        let [from, to] = Evaluation::of_ours(corners, &in_plane, Accuracy::Robust, 2.0).t_range;
        assert!(0.99999 < from && from < 1.0 && 2.0 < to && to < 2.00001);
    }

    /// The floor of the conference room, met 5 units away at a corner, by weights of edges of 2,600 units.
    #[test]
    fn a_distance_by_weights_is_off_by_their_errors_times_edges() {
        let corners = [
            Vec3::new(-946.888, -1.57216, 668.489),
            Vec3::new(1653.25, -1.57216, 668.489),
            Vec3::new(1653.25, -1.57216, -1016.1),
        ];
        let ray = Ray::new(
            [1650.5236, -2.4062593, -1005.6227],
            [-0.77985334, 0.16286229, 0.60440475],
        );
        let by_weights = Evaluation::new(corners, &ray, TriangleTestForm::Sheared);
        let [from, to] = by_weights.t_range;
        assert!(
            by_weights.margin() > 1e3 && to - from > 8e-4,
            "{from} … {to}"
        );
        let evaluation = Evaluation::of_ours(corners, &ray, Accuracy::Robust, 2048.0);
        assert!((evaluation.t - 5.121_500_584).abs() < 1e-9);
        let [from, to] = evaluation.t_range;
        assert!(to - from < 2e-5, "{from} … {to}");
        let mesh = TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap();
        let mut params = BuildParams::default();
        params.accuracy = Accuracy::Robust;
        let hit = Bvh::build(&[&mesh], &params).unwrap().closest_hit(&ray);
        let t = f64::from(hit.unwrap().t);
        assert!(from <= t && t <= to, "{t}");
    }
}
