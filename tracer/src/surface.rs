//! The point that a ray hits, known well enough to start the next ray from it.
//!
//! There is no epsilon: the point is formed from the barycentric weights in f64 and rounded once,
//! so that it lies within half an ulp per coordinate of the triangle's plane; a ray starts beyond
//! the error that is left (after the bounds of Pharr, Jakob, Humphreys, *Physically Based
//! Rendering*, 4th ed., 2023, section 6.8). Invariant: a ray that leaves a triangle on one side
//! does not hit it again, unless the triangle is thinner than a thousandth of its length. The bound is
//! that of N · (v0 − o), by which both triangle tests find their distances.

use glam::swizzles::Vec3Swizzles;
use raywright_bvh::{Hit, Ray, TriangleMesh, Vec3};

/// The unit roundoff of f32.
const UNIT_ROUNDOFF: f32 = 1.0 / (1 << 24) as f32;

/// Roundings in the numerator of the distance to a triangle's plane, `N · (v0 − o)`, one of them
/// in `v0 − o` (robustness bound γ₈), and one for the vertices' own scaling and difference.
const PLANE_DISTANCE_ERROR: f32 = 9.0 * UNIT_ROUNDOFF;

/// No origin is moved farther because its triangle's normal is not known well, in units of the triangle's extent: the
/// thinner a triangle, the more is near it that must not be passed.
const LARGEST_ERROR: f32 = 1.0 / (1 << 10) as f32;

/// A point on a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Where it is.
    pub position: Vec3,
    /// Unit geometric normal, by counter-clockwise winding.
    pub normal: Vec3,
    /// How far from `position` along the normal the triangle can seem to be.
    error: f32,
}

impl Surface {
    /// The point that a hit names.
    ///
    /// # Panics
    /// If `mesh` is not the mesh that was hit.
    #[must_use]
    #[inline]
    pub fn of_hit(mesh: &TriangleMesh, hit: &Hit) -> Self {
        Self::at(
            mesh.corners(hit.primitive_id),
            [1.0 - hit.u - hit.v, hit.u, hit.v],
        )
    }

    /// The point of a triangle with the given weights of its corners.
    #[inline]
    pub(crate) fn at(corners: [Vec3; 3], weights: [f32; 3]) -> Self {
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let [_, u, v] = weights.map(f64::from);
        let (ab, ac) = (b - a, c - a);
        let position = (a + ab * u + ac * v).as_vec3();
        let area_normal = ab.cross(ac);
        let normal = area_normal.normalize_or_zero().as_vec3();
        let extent = corners
            .iter()
            .map(|&corner| (corner - position).abs().max_element())
            .fold(0.0, f32::max);
        // What the products are of which the test makes N · (v0 − o).
        let (p, q) = (ab.abs(), ac.abs());
        let products = p.yzx() * q.zxy() + p.zxy() * q.yzx();
        let products = products.dot((a - position.as_dvec3()).abs()) / area_normal.length();
        // At least what there is without cancellation, though the plane's own coordinate may be exactly 0, where an error
        // of its own size would be none. (A triangle without area gives no number, and has no normal to go along.)
        let distance = (products as f32).max(extent * normal.abs().element_sum());
        let error = (distance * PLANE_DISTANCE_ERROR).min(extent * LARGEST_ERROR);
        Self {
            position,
            normal,
            error: error + position.abs().dot(normal.abs()) * UNIT_ROUNDOFF,
        }
    }

    /// The normal on the side that `direction` points to.
    #[must_use]
    #[inline]
    pub fn normal_towards(&self, direction: Vec3) -> Vec3 {
        if self.normal.dot(direction) < 0.0 {
            -self.normal
        } else {
            self.normal
        }
    }

    /// A point on the side that `direction` points to, from which the triangle is behind.
    #[must_use]
    #[inline]
    pub fn offset_towards(&self, direction: Vec3) -> Vec3 {
        let normal = self.normal_towards(direction);
        let moved = self.position + normal * self.error;
        // The sum may have been rounded back by half an ulp.
        Vec3::from_array(std::array::from_fn(|axis| {
            let at = moved[axis];
            if normal[axis] > 0.0 {
                at.next_up()
            } else if normal[axis] < 0.0 {
                at.next_down()
            } else {
                at
            }
        }))
    }

    /// A ray without end from the surface.
    #[must_use]
    #[inline]
    pub fn ray_towards(&self, direction: Vec3) -> Ray {
        Ray::new(self.offset_towards(direction), direction)
    }

    /// The segment between two surfaces, neither of them included.
    #[must_use]
    #[inline]
    pub fn segment_to(&self, other: &Self) -> Ray {
        let between = other.position - self.position;
        let origin = self.offset_towards(between);
        let target = other.offset_towards(-between);
        Ray::new(origin, target - origin).with_range(0.0, 1.0 - f32::EPSILON)
    }

    /// The segment to a point in space.
    #[must_use]
    #[inline]
    pub fn segment_to_point(&self, point: Vec3) -> Ray {
        let origin = self.offset_towards(point - self.position);
        Ray::new(origin, point - origin).with_range(0.0, 1.0 - f32::EPSILON)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use raywright_bvh::{Accuracy, BuildParams, Bvh};

    use super::*;

    fn vector() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-1f32..1.0).prop_map(Vec3::from)
    }

    /// Whether a triangle is thinner than a thousandth of its length: of those nothing is promised.
    fn is_sliver([a, b, c]: [Vec3; 3]) -> bool {
        let [a, b, c] = [a, b, c].map(|corner| corner.as_dvec3());
        let longest = [b - a, c - b, a - c]
            .map(|edge| edge.length_squared())
            .into_iter()
            .fold(0.0, f64::max);
        (b - a).cross(c - a).length() < 1e-3 * longest
    }

    /// A direction, one close to the surface, and the normal, to both sides, of which a ray finds a
    /// hit by one of the triangle tests.
    fn hits_again(corners: [Vec3; 3], surface: &Surface, direction: Vec3) -> Option<Vec3> {
        let mesh = TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap();
        let trees = [Accuracy::Fast, Accuracy::Robust].map(|accuracy| {
            let mut params = BuildParams::default();
            params.accuracy = accuracy;
            Bvh::build(&[&mesh], &params).unwrap()
        });
        let flat = direction.reject_from_normalized(surface.normal) + surface.normal * 1e-3;
        [direction, flat, surface.normal]
            .into_iter()
            .flat_map(|direction| [direction, -direction])
            .find(|&direction| {
                let ray = surface.ray_towards(direction);
                trees.iter().any(|tree| tree.any_hit(&ray))
            })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        #[test]
        fn a_ray_that_leaves_does_not_hit_again(
            corners in prop::array::uniform3(vector()), shift in vector(), far in 0f32..1e5, exponent in -40i32..40,
            weights in prop::array::uniform2(0f32..1.0), direction in vector(),
        ) {
            let scale = 2f32.powi(exponent);
            let corners = corners.map(|c| (c + shift * far) * scale);
            let surface = Surface::at(corners, crate::sampling::uniform_triangle(weights));
            prop_assume!(!is_sliver(corners) && direction != Vec3::ZERO);
            prop_assert_eq!(hits_again(corners, &surface, direction), None);
        }

        /// Coordinates that are exactly 0 have no rounding error of their own.
        #[test]
        fn nor_from_axis_parallel_planes_through_the_origin(
            corners in prop::array::uniform3(prop::array::uniform2(-3i8..=3)), axis in 0usize..3, height in 0i8..2,
            exponent in -60i32..60, weights in prop::array::uniform2(0f32..1.0), direction in vector(),
        ) {
            let corners = corners.map(|[a, b]| {
                let mut corner = [f32::from(height); 3];
                (corner[(axis + 1) % 3], corner[(axis + 2) % 3]) = (f32::from(a), f32::from(b));
                Vec3::from(corner) * 2f32.powi(exponent)
            });
            let surface = Surface::at(corners, crate::sampling::uniform_triangle(weights));
            prop_assume!(!is_sliver(corners) && direction != Vec3::ZERO);
            prop_assert_eq!(hits_again(corners, &surface, direction), None);
        }

        /// Long thin triangles, whose normals are known less well.
        #[test]
        fn nor_from_slivers(
            corner in vector(), along in vector(), across in vector(), place in 0f32..=1.0, thinness in 0i32..11,
            first in 0usize..3, weights in prop::array::uniform2(0f32..1.0), direction in vector(),
        ) {
            let mut corners = [corner, corner + along, corner + along * place + across * 2f32.powi(-thinness)];
            corners.rotate_left(first);
            let surface = Surface::at(corners, crate::sampling::uniform_triangle(weights));
            prop_assume!(!is_sliver(corners) && direction != Vec3::ZERO);
            prop_assert_eq!(hits_again(corners, &surface, direction), None);
        }

        /// The products, as a vector, are at most 2 / √3 times the product of the edges' lengths, which is the normal's length
        /// divided by the sine between the edges: at most 9 √3 roundings of the longest edge divided by that sine, and
        /// those of the position and of the last sum.
        #[test]
        fn the_offset_is_a_few_roundings(corners in prop::array::uniform3(vector()), weights in prop::array::uniform2(0f32..1.0)) {
            let surface = Surface::at(corners, crate::sampling::uniform_triangle(weights));
            let [ab, ac] = [1, 2].map(|corner| corners[corner].as_dvec3() - corners[0].as_dvec3());
            let sine = ab.cross(ac).length() / (ab.length() * ac.length());
            let longest = ab.length().max(ac.length()).max(ab.distance(ac));
            let moved = surface.offset_towards(surface.normal).as_dvec3().distance(surface.position.as_dvec3());
            let bound = (longest / 1000.0).min(16.0 * longest / sine * f64::from(UNIT_ROUNDOFF)) + 8.0 * f64::from(UNIT_ROUNDOFF);
            prop_assert!(moved <= bound, "{moved} of {bound}");
        }
    }
}
