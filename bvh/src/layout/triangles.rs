//! Blocks of four triangles, one vertex and two edges each, component by component: 160 bytes.
//!
//! The edges are those of the form of the Möller–Trumbore test that Embree uses, so that both
//! barycentric numerators come from one cross product.

use glam::Vec3;

/// How many triangles a block holds.
pub(crate) const BLOCK_SIZE: usize = 4;

/// Marks an unused lane; all its vectors are zero, which no ray hits.
pub(crate) const NO_TRIANGLE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct TriangleBlock {
    /// Vertex 0.
    pub(crate) vertex: [[f32; BLOCK_SIZE]; 3],
    /// Vertex 0 − vertex 1.
    pub(crate) edge_1: [[f32; BLOCK_SIZE]; 3],
    /// Vertex 2 − vertex 0.
    pub(crate) edge_2: [[f32; BLOCK_SIZE]; 3],
    /// Number of the triangle over all meshes.
    pub(crate) id: [u32; BLOCK_SIZE],
}

impl Default for TriangleBlock {
    fn default() -> Self {
        Self {
            vertex: [[0.0; BLOCK_SIZE]; 3],
            edge_1: [[0.0; BLOCK_SIZE]; 3],
            edge_2: [[0.0; BLOCK_SIZE]; 3],
            id: [NO_TRIANGLE; BLOCK_SIZE],
        }
    }
}

impl TriangleBlock {
    /// Fills a lane.
    pub(crate) fn set(&mut self, lane: usize, id: u32, [a, b, c]: [Vec3; 3]) {
        let (edge_1, edge_2) = (a - b, c - a);
        for axis in 0..3 {
            self.vertex[axis][lane] = a[axis];
            self.edge_1[axis][lane] = edge_1[axis];
            self.edge_2[axis][lane] = edge_2[axis];
        }
        self.id[lane] = id;
    }

    /// How many lanes are used.
    pub(crate) fn len(&self) -> usize {
        self.id.iter().filter(|&&id| id != NO_TRIANGLE).count()
    }
}
