//! All hits in f64: where a kernel in f32 may be wrong, and by how much.
//!
//! A triangle is hit if and only if the ray meets it exactly, edges and vertices included: sides of edges are told
//! by f64 where rounding cannot matter, and by integers else (see `edge`). A hit is told apart by how surely it is one:
//! the smallest barycentric weight says how far the ray passes from an edge. [`ExactTree`] tells the same of many rays.
//!
//! Invariant: of triangles that share an edge, a ray that passes between their other corners meets at least one.

mod edge;
mod line;
mod tree;

use std::cmp::Ordering;

use raywright_bvh::{Ray, TriangleMesh, Vec3};

pub use self::tree::ExactTree;
use self::{edge::Edge, line::Line};

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
            hits.extend(hit(meshes, [geometry_id, primitive_id], ray));
        }
    }
    hits.sort_by(order);
    hits
}

/// The hit of one triangle, if the ray meets it within its interval.
fn hit(
    meshes: &[&TriangleMesh],
    [geometry_id, primitive_id]: [u32; 2],
    ray: &Ray,
) -> Option<ExactHit> {
    let corners = meshes[geometry_id as usize].corners(primitive_id);
    let (t, uv) = triangle(corners, ray)?;
    Some(ExactHit {
        t,
        uv,
        geometry_id,
        primitive_id,
        smallest_weight: uv[0].min(uv[1]).min(1.0 - uv[0] - uv[1]),
    })
}

/// The closest first; of equal ones, the lowest ids.
fn order(a: &ExactHit, b: &ExactHit) -> Ordering {
    a.t.total_cmp(&b.t)
        .then((a.geometry_id, a.primitive_id).cmp(&(b.geometry_id, b.primitive_id)))
}

/// Distance and weights of vertices 1 and 2, if the ray meets the triangle. Which side of each edge the ray
/// passes is exact; the numbers are as good as f64 makes them, and the distance is not outside of where the ray is in
/// the triangle's box.
///
/// With corners A, B, C as seen from the origin and direction D, the weights are to each other as D·(B×C),
/// D·(C×A) and D·(A×B).
fn triangle(corners: [Vec3; 3], ray: &Ray) -> Option<(f64, [f64; 2])> {
    let edges = edges(corners, ray);
    if !are_met(&edges, ray) {
        return None;
    }
    let weights = edges.map(|edge| edge.value);
    let sum: f64 = weights.iter().sum();
    let [v0, v1, v2] = corners.map(Vec3::as_dvec3);
    let normal = (v1 - v0).cross(v2 - v0);
    let to_plane = normal.dot(v0 - ray.origin.as_dvec3());
    let t = to_plane / normal.dot(ray.direction.as_dvec3());
    let (min, max) = (v0.min(v1).min(v2), v0.max(v1).max(v2));
    let [enter, leave] = Line::new(ray).interval(min, max);
    let t = t.max(enter).min(leave);
    let is_within = f64::from(ray.t_min) <= t && t <= f64::from(ray.t_max);
    is_within.then(|| (t, [weights[1] / sum, weights[2] / sum]))
}

/// Whether the line of a ray meets a triangle, its border included.
#[must_use]
pub fn is_met(corners: [Vec3; 3], ray: &Ray) -> bool {
    are_met(&edges(corners, ray), ray)
}

/// The edges opposite to vertices 0, 1, 2.
fn edges(corners: [Vec3; 3], ray: &Ray) -> [Edge; 3] {
    [0, 1, 2].map(|i| Edge::new(corners[(i + 1) % 3], corners[(i + 2) % 3], ray))
}

fn are_met(edges: &[Edge; 3], ray: &Ray) -> bool {
    let signs = edges.map(|edge| edge.sign(ray));
    // All zero: the ray lies in the plane, or the triangle has no area.
    signs.contains(&Ordering::Greater) != signs.contains(&Ordering::Less)
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

    /// Numbers of many sizes, from a linear congruence.
    pub(super) fn numbers() -> impl FnMut() -> f32 {
        let mut state = 12345_u64;
        move || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            let unit = (state >> 40) as f32 / (1 << 24) as f32 - 0.5;
            unit * f32::powi(2.0, ((state >> 35) & 15) as i32 - 8)
        }
    }

    #[test]
    fn a_ray_at_a_shared_edge_meets_one_triangle_at_least() {
        let mut number = numbers();
        let mut vector = || Vec3::new(number(), number(), number());
        let mut both = 0;
        for _ in 0..5_000 {
            let [p, q, right] = [vector(), vector(), vector()];
            let on_edge = p + 0.5 * (q - p);
            // On the other side of the edge.
            let left = on_edge + (on_edge - right) * 0.75;
            let mesh = TriangleMesh::new(vec![p, q, right, left], vec![[0, 1, 2], [1, 0, 3]]);
            let origin = vector() * 4.0;
            let ray = Ray::new(origin, on_edge - origin);
            let hits = all_hits(&[&mesh.unwrap()], &ray);
            assert!(!hits.is_empty());
            both += u32::from(hits.len() == 2);
        }
        assert!(both > 0);
    }

    #[test]
    fn corners_and_edges_belong_and_planes_do_not() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let mesh = TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 1, 1]]).unwrap();
        let down = |x: f32, y: f32| Ray::new([x, y, 1.0], [0.0, 0.0, -1.0]);
        let hits = |ray: &Ray| all_hits(&[&mesh], ray).len();
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.5, 0.5)] {
            assert_eq!(hits(&down(x, y)), 1, "{x} {y}");
        }
        // The next number beyond.
        assert_eq!(hits(&down(0.5, 0.5_f32.next_up())), 0);
        assert_eq!(hits(&down(0.5, 0.0_f32.next_down())), 0);
        assert_eq!(hits(&Ray::new([-1.0, 0.25, 0.0], [1.0, 0.0, 0.0])), 0);
    }
}
