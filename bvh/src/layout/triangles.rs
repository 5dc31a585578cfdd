//! Blocks of four triangles, component by component, in three formats that differ in memory and in
//! what is ready for the test:
//!
//! - [`EdgeBlock`], 160 bytes: one vertex and two edges, those of the form of the Möller–Trumbore
//!   test that Embree uses, so that both barycentric numerators come from one cross product;
//! - [`CornerBlock`], 160 bytes: three vertices. A watertight test needs the same coordinates in
//!   all triangles around a vertex, which a vertex that is found by adding an edge does not have;
//! - [`IndexBlock`], 64 bytes, a cache line: numbers of three points that the tree keeps once.
//!   Each test fetches twelve points, but nothing is stored twice.
//!
//! Invariant: edges are the same differences of the same scaled vertices, whether they are formed
//! when the block is made or when it is tested, so that the format changes no bit of a hit.

use glam::Vec3;

use super::block::{BLOCK_SIZE, Block, BlockOf, NO_PRIMITIVE, Point, Primitives};
use crate::{
    build::LeafReference,
    mesh::TriangleMesh,
    simd::{Lanes, prefetch},
};

/// The value of unused lanes. Every comparison with it fails, so that such a lane is never taken
/// for one that needs a second look.
const UNUSED: f32 = f32::NAN;

/// The triangles of a build, by their place in the meshes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangles<'a> {
    pub(crate) meshes: &'a [&'a TriangleMesh],
    /// Number of each mesh's first triangle over all meshes.
    pub(crate) first_ids: &'a [u32],
    /// Number of each mesh's first vertex over all meshes, and the total at the end.
    pub(crate) first_points: &'a [u32],
    pub(crate) scale: f32,
}

impl Triangles<'_> {
    #[inline]
    fn id(&self, leaf: LeafReference) -> u32 {
        self.first_ids[leaf.geometry_id as usize] + leaf.primitive_id
    }

    /// The triangle with a number over all meshes.
    #[inline]
    pub(crate) fn locate(&self, id: u32) -> LeafReference {
        locate(self.first_ids, id)
    }

    #[inline]
    pub(crate) fn corners(&self, leaf: LeafReference) -> [Vec3; 3] {
        let mesh = self.meshes[leaf.geometry_id as usize];
        mesh.corners(leaf.primitive_id).map(|v| v * self.scale)
    }

    #[inline]
    fn point_numbers(&self, leaf: LeafReference) -> [u32; 3] {
        let geometry_id = leaf.geometry_id as usize;
        let first = self.first_points[geometry_id];
        self.meshes[geometry_id].triangles()[leaf.primitive_id as usize].map(|i| first + i)
    }

    /// The number of the point of the unused lanes.
    fn unused_point(&self) -> u32 {
        self.first_points.last().copied().unwrap_or(0)
    }
}

/// Geometry id and primitive id of a triangle, by its number over all meshes.
#[inline]
pub(crate) fn locate(first_ids: &[u32], id: u32) -> LeafReference {
    // The last mesh that begins at or before it: empty meshes begin where the next one does.
    let geometry_id = first_ids.partition_point(|&first| first <= id) - 1;
    LeafReference {
        geometry_id: geometry_id as u32,
        primitive_id: id - first_ids[geometry_id],
    }
}

impl Primitives for Triangles<'_> {
    #[inline]
    fn prefetch_ids(&self, leaf: LeafReference) {
        let mesh = self.meshes[leaf.geometry_id as usize];
        prefetch(&mesh.triangles()[leaf.primitive_id as usize]);
    }

    #[inline]
    fn prefetch(&self, leaf: LeafReference) {
        let mesh = self.meshes[leaf.geometry_id as usize];
        for index in mesh.triangles()[leaf.primitive_id as usize] {
            prefetch(&mesh.vertices()[index as usize]);
        }
    }

    fn point_count(&self) -> usize {
        self.unused_point() as usize + 1
    }

    fn points(&self) -> impl Iterator<Item = Point> {
        let vertices = self.meshes.iter().flat_map(|mesh| mesh.vertices());
        let scaled = vertices.map(|&v| (v * self.scale).to_array());
        scaled.chain([[UNUSED; 3]])
    }
}

/// A block that can give vertex 0, vertex 0 − vertex 1, and vertex 2 − vertex 0.
pub(crate) trait WithEdges: Block {
    fn edges<L: Lanes<4>>(&self, points: &[Point]) -> [[L; 3]; 3];
}

/// A block that can give its corners, each by three axes in any order.
pub(crate) trait WithCorners: Block {
    fn corners<L: Lanes<4>>(&self, points: &[Point], axes: [usize; 3]) -> [[L; 3]; 3];
}

type Rows = [[f32; BLOCK_SIZE]; 3];

/// One vertex and two edges of each triangle.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct EdgeBlock {
    vertex: Rows,
    /// Vertex 0 − vertex 1.
    edge_1: Rows,
    /// Vertex 2 − vertex 0.
    edge_2: Rows,
    id: [u32; BLOCK_SIZE],
}

/// Three vertices of each triangle.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct CornerBlock {
    corners: [Rows; 3],
    id: [u32; BLOCK_SIZE],
}

/// Numbers of three points of each triangle.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct IndexBlock {
    points: [[u32; BLOCK_SIZE]; 3],
    id: [u32; BLOCK_SIZE],
}

fn ids_of(leaves: &[LeafReference], triangles: &Triangles<'_>) -> [u32; BLOCK_SIZE] {
    let mut ids = [NO_PRIMITIVE; BLOCK_SIZE];
    for (id, &leaf) in ids.iter_mut().zip(leaves) {
        *id = triangles.id(leaf);
    }
    ids
}

/// Corner by corner, one vector per lane.
fn corners_of(leaves: &[LeafReference], triangles: &Triangles<'_>) -> [[Vec3; BLOCK_SIZE]; 3] {
    let mut corners = [[Vec3::splat(UNUSED); BLOCK_SIZE]; 3];
    for (lane, &leaf) in leaves.iter().enumerate().take(BLOCK_SIZE) {
        for (corner, vertex) in triangles.corners(leaf).into_iter().enumerate() {
            corners[corner][lane] = vertex;
        }
    }
    corners
}

/// One vector per lane, component by component.
fn rows(lanes: &[Vec3; BLOCK_SIZE]) -> Rows {
    let [a, b, c, d] = lanes;
    [
        [a.x, b.x, c.x, d.x],
        [a.y, b.y, c.y, d.y],
        [a.z, b.z, c.z, d.z],
    ]
}

/// Row by row, the difference of two vectors per lane.
fn difference_of(a: &Rows, b: &Rows) -> Rows {
    let mut difference = *a;
    for (row, other) in difference.iter_mut().zip(b) {
        for (value, other) in row.iter_mut().zip(other) {
            *value -= other;
        }
    }
    difference
}

#[inline(always)]
fn load<L: Lanes<4>>([x, y, z]: &Rows) -> [L; 3] {
    [L::load(x), L::load(y), L::load(z)]
}

impl Block for EdgeBlock {
    const INDEXED: bool = false;

    #[inline(always)]
    fn ids(&self) -> &[u32; BLOCK_SIZE] {
        &self.id
    }
}

impl BlockOf<Triangles<'_>> for EdgeBlock {
    fn new(leaves: &[LeafReference], triangles: &Triangles<'_>) -> Self {
        let [a, b, c] = corners_of(leaves, triangles).each_ref().map(rows);
        Self {
            vertex: a,
            edge_1: difference_of(&a, &b),
            edge_2: difference_of(&c, &a),
            id: ids_of(leaves, triangles),
        }
    }
}

impl WithEdges for EdgeBlock {
    #[inline(always)]
    fn edges<L: Lanes<4>>(&self, _points: &[Point]) -> [[L; 3]; 3] {
        [load(&self.vertex), load(&self.edge_1), load(&self.edge_2)]
    }
}

impl Block for CornerBlock {
    const INDEXED: bool = false;

    #[inline(always)]
    fn ids(&self) -> &[u32; BLOCK_SIZE] {
        &self.id
    }
}

impl BlockOf<Triangles<'_>> for CornerBlock {
    fn new(leaves: &[LeafReference], triangles: &Triangles<'_>) -> Self {
        Self {
            corners: corners_of(leaves, triangles).each_ref().map(rows),
            id: ids_of(leaves, triangles),
        }
    }
}

impl WithCorners for CornerBlock {
    #[inline(always)]
    fn corners<L: Lanes<4>>(&self, _points: &[Point], [x, y, z]: [usize; 3]) -> [[L; 3]; 3] {
        let [a, b, c] = &self.corners;
        [
            [L::load(&a[x]), L::load(&a[y]), L::load(&a[z])],
            [L::load(&b[x]), L::load(&b[y]), L::load(&b[z])],
            [L::load(&c[x]), L::load(&c[y]), L::load(&c[z])],
        ]
    }
}

impl Block for IndexBlock {
    const INDEXED: bool = true;

    #[inline(always)]
    fn ids(&self) -> &[u32; BLOCK_SIZE] {
        &self.id
    }
}

impl BlockOf<Triangles<'_>> for IndexBlock {
    fn new(leaves: &[LeafReference], triangles: &Triangles<'_>) -> Self {
        let mut points = [[triangles.unused_point(); BLOCK_SIZE]; 3];
        for (lane, &leaf) in leaves.iter().enumerate().take(BLOCK_SIZE) {
            for (corner, number) in triangles.point_numbers(leaf).into_iter().enumerate() {
                points[corner][lane] = number;
            }
        }
        Self {
            points,
            id: ids_of(leaves, triangles),
        }
    }
}

impl WithCorners for IndexBlock {
    #[inline(always)]
    fn corners<L: Lanes<4>>(&self, points: &[Point], axes: [usize; 3]) -> [[L; 3]; 3] {
        [
            gather(points, self.points[0], axes),
            gather(points, self.points[1], axes),
            gather(points, self.points[2], axes),
        ]
    }
}

impl WithEdges for IndexBlock {
    #[inline(always)]
    fn edges<L: Lanes<4>>(&self, points: &[Point]) -> [[L; 3]; 3] {
        let [a, b, c] = self.corners::<L>(points, [0, 1, 2]);
        [a, difference(a, b), difference(c, a)]
    }
}

/// Four points, by three axes in any order.
#[inline(always)]
fn gather<L: Lanes<4>>(
    points: &[Point],
    numbers: [u32; BLOCK_SIZE],
    [x, y, z]: [usize; 3],
) -> [L; 3] {
    let lanes = numbers.map(|number| &points[number as usize]);
    [
        L::load(&lanes.map(|point| point[x])),
        L::load(&lanes.map(|point| point[y])),
        L::load(&lanes.map(|point| point[z])),
    ]
}

#[inline(always)]
fn difference<L: Lanes<4>>(p: [L; 3], q: [L; 3]) -> [L; 3] {
    [p[0].sub(q[0]), p[1].sub(q[1]), p[2].sub(q[2])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_whole_half_lines() {
        assert_eq!(size_of::<EdgeBlock>(), 192 - 32);
        assert_eq!(size_of::<CornerBlock>(), 192 - 32);
        assert_eq!(size_of::<IndexBlock>(), 64);
    }
}
