//! Meshes that break ray tracers, of any size.
//!
//! Invariant: a [`ClosedMesh`] is welded: neighbours share the numbers of their vertices, so that it is closed for
//! whatever map of its vertices, as long as the points inside stay inside.

use std::collections::HashMap;

use raywright_bvh::{Aabb, MeshError, TriangleMesh, Vec3};

use super::modes::Sampler;

/// A closed mesh, and a box inside it from which it can be seen.
#[derive(Clone, Debug)]
pub struct ClosedMesh {
    /// Its name in reports.
    pub name: &'static str,
    /// The mesh.
    pub mesh: TriangleMesh,
    /// Every point of it is strictly inside.
    pub inside: Aabb,
}

/// An icosahedron on the unit sphere, each triangle divided into four `levels` times: 20 · 4^levels triangles.
///
/// # Errors
/// None for less than 13 levels.
pub fn icosphere(levels: u32) -> Result<ClosedMesh, MeshError> {
    // Rings of five about the axis z, between two poles.
    let (height, radius) = (1.0 / 5f32.sqrt(), 2.0 / 5f32.sqrt());
    let ring = |turn: f32, z: f32| {
        (0..5).map(move |i| {
            let (sin, cos) = ((i as f32 + turn) * std::f32::consts::TAU / 5.0).sin_cos();
            Vec3::new(radius * cos, radius * sin, z)
        })
    };
    let mut vertices = vec![Vec3::Z];
    vertices.extend(ring(0.0, height));
    vertices.extend(ring(0.5, -height));
    vertices.push(-Vec3::Z);
    let mut triangles: Vec<[u32; 3]> = (0..5)
        .flat_map(|i| {
            let (upper, lower) = ([1 + i, 1 + (i + 1) % 5], [6 + i, 6 + (i + 1) % 5]);
            [
                [0, upper[0], upper[1]],
                [upper[0], lower[0], upper[1]],
                [upper[1], lower[0], lower[1]],
                [11, lower[1], lower[0]],
            ]
        })
        .collect();
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                let sum = vertices[a as usize] + vertices[b as usize];
                vertices.push(sum.normalize());
                vertices.len() as u32 - 1
            })
        };
        let mut divided = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let (d, e, f) = (middle(a, b), middle(b, c), middle(c, a));
            divided.extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
        }
        triangles = divided;
    }
    Ok(ClosedMesh {
        name: "icosphere",
        mesh: TriangleMesh::new(vertices, triangles)?,
        inside: Aabb {
            min: Vec3::splat(-0.4),
            max: Vec3::splat(0.4),
        },
    })
}

/// Collects squares of a lattice, welded by their place.
#[derive(Default)]
struct Lattice {
    places: Vec<[u32; 3]>,
    numbers: HashMap<[u32; 3], u32>,
    triangles: Vec<[u32; 3]>,
}

impl Lattice {
    fn square(&mut self, corners: [[u32; 3]; 4]) {
        let [a, b, c, d] = corners.map(|place| {
            *self.numbers.entry(place).or_insert_with(|| {
                self.places.push(place);
                self.places.len() as u32 - 1
            })
        });
        self.triangles.extend([[a, b, c], [a, c, d]]);
    }

    fn mesh(self, place: impl Fn([u32; 3]) -> Vec3) -> Result<TriangleMesh, MeshError> {
        let vertices = self.places.into_iter().map(place).collect();
        TriangleMesh::new(vertices, self.triangles)
    }
}

/// The cube 0..1, each face n × n squares of two triangles.
///
/// # Errors
/// None for n below 6000.
pub fn cube(n: u32) -> Result<ClosedMesh, MeshError> {
    let mut lattice = Lattice::default();
    for axis in 0..3 {
        for side in [0, n] {
            for i in 0..n {
                for j in 0..n {
                    let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                    lattice.square(corners.map(|(i, j)| {
                        let mut place = [side, i, j];
                        place.rotate_right(axis);
                        place
                    }));
                }
            }
        }
    }
    Ok(ClosedMesh {
        name: "cube",
        mesh: lattice.mesh(|place| Vec3::from(place.map(|i| i as f32 / n as f32)))?,
        inside: Aabb {
            min: Vec3::splat(0.1),
            max: Vec3::splat(0.9),
        },
    })
}

/// A slab 0..1 along x and z, flat below, with random heights 0.5..1 above: 4n² + 8n triangles.
///
/// # Errors
/// None for n below 6000.
pub fn terrain(n: u32) -> Result<ClosedMesh, MeshError> {
    let mut lattice = Lattice::default();
    for i in 0..n {
        for side in [0, n] {
            lattice.square([
                [i, 0, side],
                [i + 1, 0, side],
                [i + 1, 1, side],
                [i, 1, side],
            ]);
            lattice.square([
                [side, 0, i],
                [side, 0, i + 1],
                [side, 1, i + 1],
                [side, 1, i],
            ]);
        }
        for j in 0..n {
            for y in [0, 1] {
                lattice.square([[i, y, j], [i + 1, y, j], [i + 1, y, j + 1], [i, y, j + 1]]);
            }
        }
    }
    let mut sampler = Sampler::new(64);
    let heights: Vec<f32> = (0..(n + 1) * (n + 1))
        .map(|_| 0.5 + 0.5 * sampler.unit())
        .collect();
    let mesh = lattice.mesh(|[x, y, z]| {
        let height = heights[(x * (n + 1) + z) as usize] * y as f32;
        Vec3::new(x as f32 / n as f32, height, z as f32 / n as f32)
    })?;
    Ok(ClosedMesh {
        name: "terrain",
        mesh,
        inside: Aabb {
            min: Vec3::splat(0.1),
            max: Vec3::new(0.9, 0.4, 0.9),
        },
    })
}

/// The three closed meshes of Embree's table of leaks, with 20 480, 3 072 and 16 896 triangles.
///
/// # Errors
/// None.
pub fn closed() -> Result<[ClosedMesh; 3], MeshError> {
    Ok([icosphere(5)?, cube(16)?, terrain(64)?])
}

/// The same with 1 280, 768 and 1 152 triangles, for what tests every triangle.
///
/// # Errors
/// None.
pub fn small_closed() -> Result<[ClosedMesh; 3], MeshError> {
    Ok([icosphere(3)?, cube(8)?, terrain(16)?])
}

/// The square 0..1 at z = 0.5 as n × n squares.
///
/// # Errors
/// None for n below 10 000.
pub fn grid(n: u32) -> Result<TriangleMesh, MeshError> {
    let mut lattice = Lattice::default();
    for i in 0..n {
        for j in 0..n {
            lattice.square([[i, j, 0], [i + 1, j, 0], [i + 1, j + 1, 0], [i, j + 1, 0]]);
        }
    }
    lattice.mesh(|[x, y, _]| Vec3::new(x as f32 / n as f32, y as f32 / n as f32, 0.5))
}

/// `count` triangles of height 1 and the given width, side by side in the plane z = 0 along x.
///
/// # Errors
/// None for finite widths.
pub fn strip(width: f32, count: u32) -> Result<TriangleMesh, MeshError> {
    let vertices = (0..count + 2)
        .map(|i| Vec3::new(0.5 * width * i as f32, (i % 2) as f32, 0.0))
        .collect();
    TriangleMesh::new(vertices, (0..count).map(|i| [i, i + 1, i + 2]).collect())
}

/// Triangles that share no vertex.
///
/// # Errors
/// If a corner is not finite.
pub fn soup(triangles: &[[Vec3; 3]]) -> Result<TriangleMesh, MeshError> {
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    TriangleMesh::new(triangles.concat(), indices.collect())
}

/// Random triangles of size about 0.1 in the cube −1..1.
///
/// # Errors
/// None.
pub fn random_soup(count: usize, seed: u64) -> Result<TriangleMesh, MeshError> {
    let mut sampler = Sampler::new(seed);
    let triangles: Vec<_> = (0..count)
        .map(|_| {
            let at = sampler.vector();
            [at, at + 0.1 * sampler.vector(), at + 0.1 * sampler.vector()]
        })
        .collect();
    soup(&triangles)
}

/// `count` triangles of size first · ratioⁱ at that distance along the diagonal.
///
/// # Errors
/// If sizes leave the range of f32.
pub fn series(first: f32, ratio: f32, count: i32) -> Result<TriangleMesh, MeshError> {
    let triangles: Vec<_> = (0..count)
        .map(|i| {
            let size = first * ratio.powi(i);
            let at = Vec3::splat(size);
            [at, at + 0.25 * size * Vec3::X, at + 0.25 * size * Vec3::Y]
        })
        .collect();
    soup(&triangles)
}

/// The mesh with other vertices.
///
/// # Errors
/// If they are not finite.
pub fn mapped(mesh: &TriangleMesh, map: impl Fn(Vec3) -> Vec3) -> Result<TriangleMesh, MeshError> {
    let vertices = mesh.vertices().iter().map(|&v| map(v)).collect();
    TriangleMesh::new(vertices, mesh.triangles().to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every edge has one triangle on either side, in opposite order where the winding is the same.
    fn assert_closed(closed: &ClosedMesh, triangles: usize) {
        assert_eq!(closed.mesh.triangles().len(), triangles, "{}", closed.name);
        let mut edges = HashMap::new();
        for corners in closed.mesh.triangles() {
            for i in 0..3 {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                assert_ne!(a, b);
                *edges.entry([a.min(b), a.max(b)]).or_insert(0) += 1;
            }
        }
        assert!(edges.values().all(|&count| count == 2), "{}", closed.name);
        // Euler's formula for a sphere: no vertex is left alone or doubled.
        let faces = closed.mesh.triangles().len();
        assert_eq!(closed.mesh.vertices().len() + faces, edges.len() + 2);
    }

    #[test]
    fn meshes_are_closed() {
        for (closed, count) in closed().unwrap().iter().zip([20_480, 3_072, 16_896]) {
            assert_closed(closed, count);
        }
        for (closed, count) in small_closed().unwrap().iter().zip([1_280, 768, 1_152]) {
            assert_closed(closed, count);
        }
    }

    #[test]
    fn an_icosphere_has_its_vertices_on_the_sphere() {
        let sphere = icosphere(2).unwrap();
        for vertex in sphere.mesh.vertices() {
            assert!((vertex.length() - 1.0).abs() < 1e-6);
        }
        let area: f32 = (0..20 * 16)
            .map(|id| {
                let [a, b, c] = sphere.mesh.corners(id);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum();
        assert!((area / (4.0 * std::f32::consts::PI) - 1.0).abs() < 0.05);
    }
}
