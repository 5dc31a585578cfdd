//! Triangles with ids, as a builder gets them.

use raywright_bvh::{Aabb, BuildPrimitive, LeafReference, Vec3};

/// Triangles to build over. The primitive id is the place in the list, the geometry id that place
/// modulo the number of geometries.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleSet {
    /// Its name in the golden files.
    pub name: String,
    /// The corners of each triangle, in any unit.
    pub triangles: Vec<[Vec3; 3]>,
    /// How many geometries the triangles are dealt to.
    pub geometries: u32,
}

impl TriangleSet {
    /// The box and ids of each triangle.
    #[must_use]
    pub fn primitives(&self) -> Vec<BuildPrimitive> {
        self.triangles
            .iter()
            .zip(0..)
            .map(|(corners, i)| BuildPrimitive {
                bounds: bounds(corners),
                geometry_id: i % self.geometries,
                primitive_id: i,
            })
            .collect()
    }

    /// The corners of a primitive, as the builder asks for them.
    #[must_use]
    pub fn corners(&self, reference: LeafReference) -> [Vec3; 3] {
        self.triangles[reference.primitive_id as usize]
    }

    /// The box of all triangles.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.triangles
            .iter()
            .fold(Aabb::EMPTY, |all, corners| all.union(bounds(corners)))
    }
}

fn bounds([a, b, c]: &[Vec3; 3]) -> Aabb {
    Aabb {
        min: a.min(*b).min(*c),
        max: a.max(*b).max(*c),
    }
}
