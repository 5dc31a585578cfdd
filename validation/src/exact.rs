//! The closest hit in f64, without a tree: where a kernel in f32 may be wrong, and by how much.
//!
//! A hit is told apart by how surely it is one: the smallest barycentric weight says how far the
//! ray passes from an edge.

use raywright_bvh::{Ray, TriangleMesh, Vec3};

/// A hit computed in f64.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ExactHit {
    /// Distance in units of the ray's direction.
    pub t: f64,
    /// Weights of vertices 1 and 2.
    pub uv: [f64; 2],
    /// Which mesh.
    pub geometry_id: u32,
    /// Which triangle of the mesh.
    pub primitive_id: u32,
    /// The smallest of the three weights: near 0, the ray passes close to an edge.
    pub smallest_weight: f64,
}

/// Every triangle that a ray meets within its interval, the closest first.
#[must_use]
pub fn all_hits(meshes: &[&TriangleMesh], ray: &Ray) -> Vec<ExactHit> {
    let mut hits = Vec::new();
    for (geometry_id, mesh) in (0..).zip(meshes) {
        for primitive_id in 0..mesh.triangles().len() as u32 {
            if let Some((t, uv)) = triangle(mesh.corners(primitive_id), ray) {
                let smallest_weight = uv[0].min(uv[1]).min(1.0 - uv[0] - uv[1]);
                hits.push(ExactHit {
                    t,
                    uv,
                    geometry_id,
                    primitive_id,
                    smallest_weight,
                });
            }
        }
    }
    hits.sort_by(|a, b| {
        a.t.total_cmp(&b.t)
            .then((a.geometry_id, a.primitive_id).cmp(&(b.geometry_id, b.primitive_id)))
    });
    hits
}

/// Cramer's rule on o + t·d = v0 + u·(v1 − v0) + v·(v2 − v0).
fn triangle([v0, v1, v2]: [Vec3; 3], ray: &Ray) -> Option<(f64, [f64; 2])> {
    let [a, b, c, origin, direction] = [v0, v1, v2, ray.origin, ray.direction].map(Vec3::as_dvec3);
    let (ab, ac, ao) = (b - a, c - a, origin - a);
    let determinant = ab.cross(ac).dot(-direction);
    if determinant == 0.0 {
        return None;
    }
    let u = ao.cross(ac).dot(-direction) / determinant;
    let v = ab.cross(ao).dot(-direction) / determinant;
    let t = ab.cross(ac).dot(ao) / determinant;
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
    (inside && f64::from(ray.t_min) <= t && t <= f64::from(ray.t_max)).then_some((t, [u, v]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_and_distance_are_those_of_the_corners() {
        let mesh = TriangleMesh::new(
            vec![Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 2.0],
            vec![[0, 1, 2]],
        )
        .unwrap();
        let ray = Ray::new([1.0, 0.5, 3.0], [0.0, 0.0, -2.0]);
        let hits = all_hits(&[&mesh], &ray);
        assert_eq!(
            (hits[0].t, hits[0].uv, hits[0].smallest_weight),
            (1.5, [0.25, 0.25], 0.25)
        );
        assert!(all_hits(&[&mesh], &ray.with_range(0.0, 1.4)).is_empty());
    }
}
