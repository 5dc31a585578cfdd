//! Whether a tree finds what golden rays say.

use raywright_bvh::{Bvh, MeshError, Ray, TriangleMesh, Vec3};

use super::cases::{Case, Expectation, GoldenRay};

/// Below this weight the neighbour across the edge is as good.
const NEIGHBOUR: f64 = 1e-6;

/// Distances are right to this share of the ray's way and of the farthest vertex.
const DISTANCE: f64 = 1.0 / (1 << 20) as f64;

impl Case {
    /// The mesh, without a triangle that is not sound; of which the strict build has said so.
    ///
    /// # Errors
    /// What the mesh says that the case does not expect.
    pub fn mesh(&self) -> Result<TriangleMesh, String> {
        let strict = TriangleMesh::new(self.vertices(), self.triangles.clone());
        let unlike = |got: String, said: &str| Err(format!("{}: {got}, not {said}", self.id));
        match &self.build {
            None => strict.or_else(|error| unlike(error.to_string(), "sound")),
            Some(refusal) if refusal.skip.is_some() => {
                match strict {
                    Err(MeshError::NonFiniteVertex { triangle, vertex })
                        if refusal
                            .strict
                            .contains(&format!("prim:{triangle},vertex:{vertex}")) => {}
                    got => return unlike(format!("{got:?}"), &refusal.strict),
                }
                match TriangleMesh::skipping_non_finite(self.vertices(), self.triangles.clone()) {
                    Ok((mesh, 1)) => Ok(mesh),
                    got => unlike(format!("{got:?}"), "one that is skipped"),
                }
            }
            Some(refusal) => {
                let beyond = self.vertices().len() as u32;
                let mut triangles = self.triangles.clone();
                triangles.push([0, 1, beyond]);
                match TriangleMesh::new(self.vertices(), triangles) {
                    Err(MeshError::IndexOutOfRange { index, .. }) if index == beyond => {}
                    got => return unlike(format!("{got:?}"), &refusal.strict),
                }
                strict.or_else(|error| unlike(error.to_string(), "sound without it"))
            }
        }
    }
}

impl GoldenRay {
    /// What is wrong with a tree's answer, if anything; the vertices are those of the tree.
    #[must_use]
    pub fn fault(&self, tree: &Bvh, vertices: &[Vec3]) -> Option<String> {
        let ray = self.ray();
        let hit = tree.closest_hit(&ray);
        if tree.any_hit(&ray) != hit.is_some() {
            return Some(format!("any hit says otherwise than {hit:?}"));
        }
        let (hit, expected) = match (hit, self.expect, self.t) {
            (None, Expectation::Miss | Expectation::InvalidRay, _) => return None,
            (Some(hit), Expectation::Hit, Some(t)) => (hit, t),
            (hit, expect, _) => return Some(format!("{expect:?}, got {hit:?}")),
        };
        let is_near = self.min_bary.is_some_and(|weight| weight < NEIGHBOUR);
        if !self.accept_prims.contains(&hit.primitive_id) && !is_near {
            return Some(format!("{hit:?} is none of {:?}", self.accept_prims));
        }
        let far = vertices.iter().filter(|vertex| vertex.is_finite());
        let far = far.map(|&vertex| (vertex - ray.origin).as_dvec3().length());
        let way = far.fold(0.0, f64::max) / ray.direction.as_dvec3().length();
        let error = (f64::from(hit.t) - expected).abs();
        if error > DISTANCE * (expected.abs() + way) {
            return Some(format!("t = {} is off by {error}", hit.t));
        }
        let weights = [hit.u, hit.v, 1.0 - hit.u - hit.v];
        let is_weight = |weight: &f32| (-1e-6..=1.000_001).contains(weight);
        if !weights.iter().all(is_weight) {
            return Some(format!("weights {weights:?}"));
        }
        None
    }

    /// Whether the fast test may err: on borders, and at the ends of intervals.
    #[must_use]
    pub fn is_hard(&self) -> bool {
        let Ray { t_min, t_max, .. } = self.ray();
        let t = self.t.unwrap_or(f64::NAN);
        self.is_on_border() || [t_min, t_max].map(f64::from).contains(&t)
    }
}
