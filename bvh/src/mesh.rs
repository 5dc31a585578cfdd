//! Triangle meshes: what a tree is built over.
//!
//! Invariants, checked once when a mesh is made so that nothing behind it has to check again:
//! every index names a vertex, and every vertex that a triangle uses is finite. Triangles of zero
//! area are allowed and keep their number. One that uses a point twice is never hit; one with three
//! points on a line is hit by the robust test at most, which sees it as thin as rounding makes it:
//! without it, there would be a gap between its neighbours. Such a hit lies in the triangle's box,
//! but its weights, and its place along the line, are quotients of rounding errors.

use glam::Vec3;

/// Why a mesh was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {index}, but there are {vertex_count} vertices")]
    IndexOutOfRange {
        /// Number of the triangle, from 0.
        triangle: usize,
        /// The vertex index it names.
        index: u32,
        /// How many vertices there are.
        vertex_count: usize,
    },
    /// A triangle uses a vertex with a coordinate that is NaN or infinite.
    #[error("triangle {triangle} uses vertex {vertex}, which is not finite")]
    NonFiniteVertex {
        /// Number of the triangle, from 0.
        triangle: usize,
        /// Number of the vertex, from 0.
        vertex: u32,
    },
    /// More triangles than a 32-bit primitive id can number.
    #[error("{count} triangles are more than the limit of {limit}")]
    TooManyTriangles {
        /// Triangles given.
        count: usize,
        /// The largest number allowed.
        limit: usize,
    },
}

/// An indexed triangle mesh. Counter-clockwise winding seen from outside gives outward normals.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// The largest number of triangles of all meshes of one tree together.
    pub const MAX_TRIANGLES: usize = (1 << 29) - 1;

    /// Makes a mesh of `vertices` (positions, any unit) and `triangles` (three vertex indices each).
    ///
    /// # Errors
    /// The first triangle with an index out of range or a vertex that is not finite.
    pub fn new(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        if triangles.len() > Self::MAX_TRIANGLES {
            return Err(MeshError::TooManyTriangles {
                count: triangles.len(),
                limit: Self::MAX_TRIANGLES,
            });
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            for &index in corners {
                match vertices.get(index as usize) {
                    None => {
                        return Err(MeshError::IndexOutOfRange {
                            triangle,
                            index,
                            vertex_count: vertices.len(),
                        });
                    }
                    Some(v) if !v.is_finite() => {
                        return Err(MeshError::NonFiniteVertex {
                            triangle,
                            vertex: index,
                        });
                    }
                    Some(_) => {}
                }
            }
        }
        Ok(Self {
            vertices,
            triangles,
        })
    }

    /// The same of triangles some of which may use a vertex that is not finite: these keep their number and are
    /// never hit. Also how many there are.
    ///
    /// # Errors
    /// The first triangle with an index out of range.
    pub fn skipping_non_finite(
        mut vertices: Vec<Vec3>,
        mut triangles: Vec<[u32; 3]>,
    ) -> Result<(Self, usize), MeshError> {
        let is_finite = |corners: &[u32; 3]| {
            let mut corners = corners.iter().map(|&index| vertices.get(index as usize));
            corners.all(|vertex| vertex.is_none_or(|vertex| vertex.is_finite()))
        };
        let skipped: Vec<usize> = (0..triangles.len())
            .filter(|&triangle| !is_finite(&triangles[triangle]))
            .collect();
        // A point that a triangle has anyway changes no bounds.
        let mut sound = triangles.iter().filter(|corners| is_finite(corners));
        let point = match sound.next() {
            Some(&[point, ..]) => point,
            None => vertices.len() as u32,
        };
        if !skipped.is_empty() && point as usize == vertices.len() {
            vertices.push(Vec3::ZERO);
        }
        for &triangle in &skipped {
            triangles[triangle] = [point; 3];
        }
        Ok((Self::new(vertices, triangles)?, skipped.len()))
    }

    /// The vertex positions.
    #[must_use]
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// The three vertex indices of each triangle.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The three corners of triangle `primitive_id`.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[must_use]
    #[inline]
    pub fn corners(&self, primitive_id: u32) -> [Vec3; 3] {
        self.triangles[primitive_id as usize].map(|i| self.vertices[i as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn index_out_of_range() {
        let got = TriangleMesh::new(vec![Vec3::ZERO; 3], vec![[0, 1, 2], [0, 3, 1]]);
        assert_eq!(
            got,
            Err(MeshError::IndexOutOfRange {
                triangle: 1,
                index: 3,
                vertex_count: 3
            })
        );
    }

    #[test]
    fn a_vertex_that_is_not_finite_is_refused_only_where_used() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let vertices = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(0.0, bad, 0.0)];
            assert!(TriangleMesh::new(vertices.clone(), vec![[0, 1, 2]]).is_ok());
            let got = TriangleMesh::new(vertices, vec![[0, 1, 3]]);
            assert_eq!(
                got,
                Err(MeshError::NonFiniteVertex {
                    triangle: 0,
                    vertex: 3
                })
            );
        }
    }

    #[test]
    fn triangles_with_vertices_that_are_not_finite_are_skipped_and_keep_their_number() {
        let vertices = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(0.0, f32::NAN, 0.0)];
        let skipping = |triangles| TriangleMesh::skipping_non_finite(vertices.clone(), triangles);
        let (mesh, skipped) = skipping(vec![[0, 1, 3], [1, 2, 0], [3, 3, 3]]).unwrap();
        assert_eq!(skipped, 2);
        assert_eq!(mesh.triangles(), [[1; 3], [1, 2, 0], [1; 3]]);
        let (mesh, skipped) = skipping(vec![[3, 0, 1]]).unwrap();
        assert_eq!((skipped, mesh.corners(0)), (1, [Vec3::ZERO; 3]));
        let (mesh, skipped) = skipping(vec![[0, 1, 2]]).unwrap();
        assert_eq!((skipped, mesh.vertices().len()), (0, 4));
        let got = skipping(vec![[3, 0, 1], [0, 1, 7]]);
        assert!(matches!(
            got,
            Err(MeshError::IndexOutOfRange { triangle: 1, .. })
        ));
    }

    #[test]
    fn an_empty_mesh_is_a_mesh() {
        assert!(TriangleMesh::new(vec![], vec![]).is_ok());
    }
}
