//! The faces between blocks in which something can be seen and what is around them, two triangles each.

use raywright_bvh::{BuildError, TriangleMesh, Vec3};

use super::LitBlocks;

/// The faces of lit blocks without a lit block behind them, each a margin outside and wider by a margin
/// on every side.
pub(super) fn faces(blocks: &LitBlocks, margin: f32) -> Result<TriangleMesh, BuildError> {
    let dims = blocks.dims;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (index, _) in blocks.lit.iter().enumerate().filter(|(_, lit)| **lit) {
        let block = [
            index % dims[0],
            index / dims[0] % dims[1],
            index / (dims[0] * dims[1]),
        ];
        let sides: [[f32; 2]; 3] =
            std::array::from_fn(|axis| blocks.borders(axis, block[axis], block[axis] + 1, margin));
        for axis in 0..3 {
            for side in 0..2 {
                let mut beside = block;
                let is_border = if side == 0 {
                    block[axis] == 0
                } else {
                    block[axis] + 1 == dims[axis]
                };
                if !is_border {
                    beside[axis] = block[axis] + 2 * side - 1;
                    if blocks.at(beside) {
                        continue;
                    }
                }
                let first = vertices.len() as u32;
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                for [a, b] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
                    let mut corner = Vec3::ZERO;
                    corner[axis] = sides[axis][side];
                    corner[u] = sides[u][a];
                    corner[v] = sides[v][b];
                    vertices.push(corner);
                }
                triangles.push([first, first + 1, first + 2]);
                triangles.push([first, first + 2, first + 3]);
            }
        }
    }
    let count = triangles.len();
    TriangleMesh::new(vertices, triangles).map_err(|_| BuildError::TreeTooLarge {
        parts: "triangles",
        count,
        limit: TriangleMesh::MAX_TRIANGLES,
    })
}
