//! Rays and hits.

use glam::Vec3;

/// A ray, or a segment of one: the points `origin + t · direction` with `t_min ≤ t ≤ t_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes; need not have unit length.
    pub direction: Vec3,
    /// Smallest `t` of a hit, in units of `direction`; a negative value acts as 0.
    pub t_min: f32,
    /// Largest `t` of a hit, in units of `direction`.
    pub t_max: f32,
}

impl Ray {
    /// A ray without end.
    #[must_use]
    #[inline]
    pub fn new(origin: impl Into<Vec3>, direction: impl Into<Vec3>) -> Self {
        Self {
            origin: origin.into(),
            direction: direction.into(),
            t_min: 0.0,
            t_max: f32::INFINITY,
        }
    }

    /// The same ray, limited to `t_min..=t_max`.
    #[must_use]
    #[inline]
    pub fn with_range(self, t_min: f32, t_max: f32) -> Self {
        Self {
            t_min,
            t_max,
            ..self
        }
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Hit {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// Barycentric weight of the triangle's vertex 1.
    pub u: f32,
    /// Barycentric weight of the triangle's vertex 2; vertex 0 has 1 − u − v.
    pub v: f32,
    /// Which mesh.
    pub geometry_id: u32,
    /// Which triangle of the mesh.
    pub primitive_id: u32,
}

/// What a traversal did: exact counts, independent of the machine's speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Nodes whose child boxes were tested.
    pub nodes: u64,
    /// Blocks of four triangles that were tested.
    pub blocks: u64,
}

impl std::ops::AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        self.nodes += other.nodes;
        self.blocks += other.blocks;
    }
}
