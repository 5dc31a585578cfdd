//! Meshes by class. Each is made of small numbers, so that a smaller mesh is of the same class.

use proptest::{collection::vec, prelude::*};
use raywright_bvh::{TriangleMesh, Vec3};

/// What the triangles of a mesh have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum MeshClass {
    /// Coordinates with uniform bits; exponents are −20..=20, so that no product of three leaves the range of f32.
    AnyBits,
    /// Coordinates k/16 with |k| ≤ 64: rays meet edges and vertices exactly.
    Lattice,
    /// Up to three clusters, each a thousand times smaller than their distances.
    Clustered,
    /// Triangles between points of one line, which have no area, and from that line to points beside it.
    Collinear,
    /// Triangles at least a thousand times as long as high.
    Slivers,
    /// Each triangle two to four times, its vertices in any rotation.
    Duplicated,
    /// A height field over whole coordinates: a surface with inner edges and vertices, some of it level.
    Terrain,
}

impl MeshClass {
    /// All.
    pub const ALL: [Self; 7] = [
        Self::AnyBits,
        Self::Lattice,
        Self::Clustered,
        Self::Collinear,
        Self::Slivers,
        Self::Duplicated,
        Self::Terrain,
    ];
}

/// The most triangles of a mesh that is not repeated.
const MOST: usize = 24;

/// Vertices of which a mesh is made; fewer than corners, so that triangles have edges in common.
const MOST_VERTICES: usize = 12;

/// Meshes of a class, with one triangle to 96.
pub fn meshes(class: MeshClass) -> BoxedStrategy<TriangleMesh> {
    match class {
        MeshClass::AnyBits => indexed(any_bits_vertex().boxed()).boxed(),
        MeshClass::Lattice => indexed(lattice_vertex().boxed()).boxed(),
        MeshClass::Clustered => clustered().boxed(),
        MeshClass::Collinear => collinear().boxed(),
        MeshClass::Slivers => slivers().boxed(),
        MeshClass::Duplicated => duplicated().boxed(),
        MeshClass::Terrain => terrain().boxed(),
    }
}

fn mesh(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> TriangleMesh {
    TriangleMesh::new(vertices, triangles).expect("finite vertices, indices in range")
}

/// A mesh whose triangles do not share vertices by index.
fn soup(triangles: Vec<[Vec3; 3]>) -> TriangleMesh {
    let count = triangles.len() as u32;
    let indices = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    mesh(triangles.concat(), indices)
}

/// Any three of some vertices, again and again.
fn indexed(vertex: BoxedStrategy<Vec3>) -> impl Strategy<Value = TriangleMesh> {
    let corners = vec(any::<[prop::sample::Index; 3]>(), 1..=MOST);
    (vec(vertex, 3..=MOST_VERTICES), corners).prop_map(|(vertices, corners)| {
        let of = |index: prop::sample::Index| index.index(vertices.len()) as u32;
        let triangles = corners.into_iter().map(|corner| corner.map(of)).collect();
        mesh(vertices, triangles)
    })
}

fn any_bits() -> impl Strategy<Value = f32> {
    (any::<bool>(), -20..=20_i32, 0..1_u32 << 23).prop_map(|(is_negative, exponent, fraction)| {
        let sign = u32::from(is_negative) << 31;
        f32::from_bits(sign | (((exponent + 127) as u32) << 23) | fraction)
    })
}

fn any_bits_vertex() -> impl Strategy<Value = Vec3> {
    [any_bits(), any_bits(), any_bits()].prop_map(Vec3::from_array)
}

/// k/16 with |k| ≤ 64.
pub(super) fn lattice() -> impl Strategy<Value = f32> {
    (-64..=64_i32).prop_map(|k| k as f32 / 16.0)
}

pub(super) fn lattice_vertex() -> impl Strategy<Value = Vec3> {
    [lattice(), lattice(), lattice()].prop_map(Vec3::from_array)
}

fn clustered() -> impl Strategy<Value = TriangleMesh> {
    // Whole coordinates, apart by one at least where they differ.
    let centre = [-8..=8_i32, -8..=8, -8..=8].prop_map(|k| Vec3::from_array(k.map(|k| k as f32)));
    let offset = [-1.0..=1.0_f32, -1.0..=1.0, -1.0..=1.0];
    let offset = offset.prop_map(|k| Vec3::from_array(k) / 4096.0);
    let triangle = (
        any::<prop::sample::Index>(),
        [offset.clone(), offset.clone(), offset],
    );
    (vec(centre, 1..=3), vec(triangle, 1..=MOST)).prop_map(|(centres, triangles)| {
        let place = |(which, offsets): (prop::sample::Index, [Vec3; 3])| {
            offsets.map(|offset| centres[which.index(centres.len())] + offset)
        };
        soup(triangles.into_iter().map(place).collect())
    })
}

fn collinear() -> impl Strategy<Value = TriangleMesh> {
    let along =
        [-4..=4_i32, -4..=4, -4..=4].prop_map(|k| Vec3::from_array(k.map(|k| k as f32 / 16.0)));
    let on_line = vec(-16..=16_i32, 3..=8);
    let beside = vec(lattice_vertex(), 0..=3);
    let corners = vec(any::<[prop::sample::Index; 3]>(), 1..=MOST);
    (lattice_vertex(), along, on_line, beside, corners).prop_map(
        |(start, along, on_line, beside, corners)| {
            let line = on_line.len();
            let mut vertices: Vec<Vec3> = on_line
                .into_iter()
                .map(|k| start + k as f32 * along)
                .collect();
            vertices.extend(beside);
            let count = vertices.len();
            let triangle = |[a, b, c]: [prop::sample::Index; 3]| {
                [a.index(line), b.index(line), c.index(count)].map(|index| index as u32)
            };
            mesh(vertices, corners.into_iter().map(triangle).collect())
        },
    )
}

fn slivers() -> impl Strategy<Value = TriangleMesh> {
    let end = || [-64..=64_i32, -64..=64, -64..=64];
    // At least 8/16 long on some axis, and at most √3/4096 high.
    let ends = (end(), end()).prop_map(|(a, mut b)| {
        if (0..3).all(|k| (b[k] - a[k]).abs() < 8) {
            b[0] = if a[0] > 0 { a[0] - 8 } else { a[0] + 8 };
        }
        [a, b].map(|k| Vec3::from_array(k.map(|k| k as f32 / 16.0)))
    });
    let apex = (0..=16_u8, [-2..=2_i32, -2..=2, -2..=2]);
    let triangle = (ends, apex).prop_map(|([a, b], (share, off))| {
        let off = Vec3::from_array(off.map(|k| k as f32 / 8192.0));
        [a, b, a + f32::from(share) / 16.0 * (b - a) + off]
    });
    vec(triangle, 1..=MOST).prop_map(soup)
}

fn duplicated() -> impl Strategy<Value = TriangleMesh> {
    let corners = [lattice_vertex(), lattice_vertex(), lattice_vertex()];
    let triangle = (corners, vec(0..3_usize, 2..=4));
    vec(triangle, 1..=MOST).prop_map(|triangles| {
        let copies = triangles.into_iter().flat_map(|(corners, turns)| {
            turns.into_iter().map(move |turn| {
                let mut corners = corners;
                corners.rotate_left(turn);
                corners
            })
        });
        soup(copies.collect())
    })
}

fn terrain() -> impl Strategy<Value = TriangleMesh> {
    let heights = |(columns, rows): (u32, u32)| {
        let height = prop_oneof![Just(0), -32..=32_i32];
        let count = ((columns + 1) * (rows + 1)) as usize;
        (Just((columns, rows)), vec(height, count))
    };
    let sizes = (1..=4_u32, 1..=4_u32);
    (sizes.prop_flat_map(heights), 0..3_usize).prop_map(|(((columns, rows), heights), up)| {
        let at = |column: u32, row: u32| row * (columns + 1) + column;
        let mut vertices = Vec::new();
        let mut triangles = Vec::new();
        for row in 0..=rows {
            for column in 0..=columns {
                let height = heights[at(column, row) as usize] as f32 / 16.0;
                let mut vertex = [column as f32, row as f32, height];
                vertex.rotate_right(up);
                vertices.push(Vec3::from_array(vertex));
                if column < columns && row < rows {
                    let [a, b] = [at(column, row), at(column + 1, row)];
                    let [c, d] = [at(column, row + 1), at(column + 1, row + 1)];
                    triangles.extend([[a, b, c], [d, c, b]]);
                }
            }
        }
        mesh(vertices, triangles)
    })
}

#[cfg(test)]
mod tests {
    use proptest::{strategy::ValueTree, test_runner::TestRunner};

    use super::*;

    /// Whether a mesh is of a class, told from the mesh alone.
    fn is_of(class: MeshClass, mesh: &TriangleMesh) -> bool {
        let corners: Vec<[Vec3; 3]> = (0..mesh.triangles().len() as u32)
            .map(|id| mesh.corners(id))
            .collect();
        let mut coordinates = mesh.vertices().iter().flat_map(|vertex| vertex.to_array());
        let is_lattice = |x: f32| (16.0 * x).fract() == 0.0;
        match class {
            MeshClass::AnyBits => {
                coordinates.all(|x| (-20..=20).contains(&(x.abs().log2().floor() as i32)))
            }
            MeshClass::Lattice => coordinates.all(|x| is_lattice(x) && x.abs() <= 4.0),
            MeshClass::Clustered => coordinates.all(|x| (x - x.round()).abs() <= 1.0 / 4096.0),
            MeshClass::Collinear => corners.iter().all(|[a, b, _]| {
                // All first edges are along one line.
                let line = corners
                    .iter()
                    .map(|[a, b, _]| *b - *a)
                    .find(|d| *d != Vec3::ZERO);
                line.is_none_or(|line| (*b - *a).cross(line) == Vec3::ZERO)
                    && coordinates.clone().all(is_lattice)
            }),
            MeshClass::Slivers => corners.iter().all(|[a, b, c]| {
                let [along, side] = [*b - *a, *c - *a].map(Vec3::as_dvec3);
                1000.0 * along.cross(side).length() <= along.length_squared()
            }),
            MeshClass::Duplicated => corners.iter().all(|corners| {
                let is_equal = |other: &&[Vec3; 3]| {
                    (0..3).any(|turn| (0..3).all(|i| other[(i + turn) % 3] == corners[i]))
                };
                mesh_corners(mesh).iter().filter(is_equal).count() >= 2
            }),
            MeshClass::Terrain => {
                let edges = 3 * corners.len();
                coordinates.all(is_lattice) && mesh.vertices().len() < edges
            }
        }
    }

    fn mesh_corners(mesh: &TriangleMesh) -> Vec<[Vec3; 3]> {
        (0..mesh.triangles().len() as u32)
            .map(|id| mesh.corners(id))
            .collect()
    }

    #[test]
    fn a_mesh_is_of_its_class_however_small_it_is_made() {
        let mut runner = TestRunner::deterministic();
        for class in MeshClass::ALL {
            let strategy = meshes(class);
            let mut steps = 0;
            for turn in 0..50 {
                let mut tree = strategy.new_tree(&mut runner).expect("a mesh");
                let before = tree.current();
                assert!(is_of(class, &before), "{class:?}: {before:?}");
                // Some steps are taken back, as where a smaller mesh does not fail.
                while steps < 400 * (turn + 1) && tree.simplify() {
                    steps += 1;
                    let now = tree.current();
                    assert!(is_of(class, &now), "{class:?}: {now:?}");
                    if steps % 3 == 0 && !tree.complicate() {
                        break;
                    }
                }
            }
            assert!(steps > 100, "{class:?}: {steps} steps");
        }
    }
}
