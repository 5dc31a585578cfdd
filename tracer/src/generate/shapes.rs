//! Simple shapes, gathered into meshes.
//!
//! Invariants: seen from outside every shape winds counter-clockwise; solids are closed, with
//! shared vertices; no triangle is without area as long as the measures given are positive.

use std::f64::consts::TAU;

use glam::Mat3;
use raywright_bvh::{TriangleMesh, Vec3};

use crate::scene::Mesh;

/// Cosine and sine of part `i` of `n` of a full turn. In `f64`: see the invariants of the parent.
pub(super) fn turn(i: f32, n: f32) -> (f32, f32) {
    let (sin, cos) = (TAU * f64::from(i) / f64::from(n)).sin_cos();
    (cos as f32, sin as f32)
}

/// Triangles being gathered.
#[derive(Clone, Debug, Default)]
pub(super) struct Shapes {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Shapes {
    /// The mesh of everything that was added.
    ///
    /// # Panics
    /// If a coordinate is not finite: a bug in a scene formula.
    pub(super) fn into_mesh(self, name: &str, material: usize) -> Mesh {
        Mesh {
            name: name.to_owned(),
            triangles: TriangleMesh::new(self.vertices, self.triangles)
                .expect("shapes have finite vertices and indices of their own"),
            material,
        }
    }

    fn add_vertex(&mut self, position: Vec3) -> u32 {
        self.vertices.push(position);
        (self.vertices.len() - 1) as u32
    }

    fn add_quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangles.extend([[a, b, c], [a, c, d]]);
    }

    /// A parallelogram; its normal points along `u` × `v`.
    pub(super) fn quad(&mut self, origin: Vec3, u: Vec3, v: Vec3) {
        let corners = [origin, origin + u, origin + u + v, origin + v];
        let corners = corners.map(|corner| self.add_vertex(corner));
        self.add_quad(corners);
    }

    /// A bent sheet of `columns` × `rows` quads over (u, v) in 0..=1; its normal points along
    /// ∂u × ∂v.
    pub(super) fn sheet(&mut self, [columns, rows]: [u32; 2], position: impl Fn(f32, f32) -> Vec3) {
        let first = self.vertices.len() as u32;
        for row in 0..=rows {
            for column in 0..=columns {
                self.vertices.push(position(
                    column as f32 / columns as f32,
                    row as f32 / rows as f32,
                ));
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let a = first + row * (columns + 1) + column;
                self.add_quad([a, a + 1, a + columns + 2, a + columns + 1]);
            }
        }
    }

    /// A block with `half_axes` as columns, which must be right-handed.
    pub(super) fn block(&mut self, centre: Vec3, half_axes: Mat3) {
        let corners: [u32; 8] = std::array::from_fn(|i| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            self.add_vertex(centre + half_axes * Vec3::new(sign(0), sign(1), sign(2)))
        });
        for face in [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ] {
            self.add_quad(face.map(|corner| corners[corner]));
        }
    }

    /// A block along the axes.
    pub(super) fn cuboid(&mut self, min: Vec3, max: Vec3) {
        self.block(0.5 * (min + max), Mat3::from_diagonal(0.5 * (max - min)));
    }

    /// A surface of revolution about the vertical through `centre`. `profile` holds radius and
    /// height, from bottom to top where outside is away from the axis; a radius of 0 is a pole.
    pub(super) fn lathe(&mut self, centre: Vec3, segments: u32, profile: &[[f32; 2]]) {
        let ring = |shapes: &mut Self, [radius, height]: [f32; 2]| -> Vec<u32> {
            let count = if radius == 0.0 { 1 } else { segments };
            let positions = (0..count).map(|i| {
                let (cos, sin) = turn(i as f32, segments as f32);
                centre + Vec3::new(radius * cos, height, radius * sin)
            });
            positions.map(|p| shapes.add_vertex(p)).collect()
        };
        let rings: Vec<Vec<u32>> = profile.iter().map(|&point| ring(self, point)).collect();
        for pair in rings.windows(2) {
            let (lower, upper) = (&pair[0], &pair[1]);
            for i in 0..segments as usize {
                let j = (i + 1) % segments as usize;
                match (lower.len(), upper.len()) {
                    (1, _) => self.triangles.push([lower[0], upper[i], upper[j]]),
                    (_, 1) => self.triangles.push([lower[i], upper[0], lower[j]]),
                    _ => self.add_quad([lower[i], upper[i], upper[j], lower[j]]),
                }
            }
        }
    }

    /// A sphere with its poles on the vertical.
    pub(super) fn sphere(&mut self, centre: Vec3, radius: f32, segments: u32) {
        let rings = segments.div_ceil(2).max(2);
        let profile: Vec<[f32; 2]> = (0..=rings)
            .map(|ring| match ring {
                0 => [0.0, -radius],
                _ if ring == rings => [0.0, radius],
                _ => {
                    let (cos, sin) = turn(ring as f32, 2.0 * rings as f32);
                    [radius * sin, -radius * cos]
                }
            })
            .collect();
        self.lathe(centre, segments, &profile);
    }

    /// A cushion: the sphere of `segments`, bulged towards the block of `half_size`.
    pub(super) fn cushion(&mut self, centre: Vec3, half_size: Vec3, segments: u32) {
        let first = self.vertices.len();
        self.sphere(Vec3::ZERO, 1.0, segments);
        for vertex in &mut self.vertices[first..] {
            // The square root twice pulls each coordinate outwards and leaves -1, 0 and 1 alone.
            let bulged = vertex.abs().map(|c| c.sqrt().sqrt()).copysign(*vertex);
            // Without rounding the edges would fold: mix with the sphere.
            *vertex = centre + (0.6 * bulged + 0.4 * *vertex) * half_size;
        }
    }

    /// A closed rod from `a` to `b`: long thin triangles in any direction.
    pub(super) fn rod(&mut self, a: Vec3, b: Vec3, radius: f32, sides: u32) {
        let axis = (b - a).normalize();
        let (u, v) = axis.any_orthonormal_pair();
        let end = |shapes: &mut Self, centre: Vec3| -> Vec<u32> {
            let positions = (0..sides).map(|i| {
                let (cos, sin) = turn(i as f32, sides as f32);
                centre + radius * (cos * u + sin * v)
            });
            positions.map(|p| shapes.add_vertex(p)).collect()
        };
        let (first, last) = (end(self, a), end(self, b));
        let (first_centre, last_centre) = (self.add_vertex(a), self.add_vertex(b));
        for i in 0..sides as usize {
            let j = (i + 1) % sides as usize;
            self.add_quad([first[i], first[j], last[j], last[i]]);
            self.triangles.push([first_centre, first[j], first[i]]);
            self.triangles.push([last_centre, last[i], last[j]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    /// Six times the volume, if every edge is used once in each direction.
    fn closed_volume(shapes: &Shapes) -> f32 {
        let edges: Vec<(u32, u32)> = shapes
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .collect();
        let set: HashSet<(u32, u32)> = edges.iter().copied().collect();
        assert_eq!(
            set.len(),
            edges.len(),
            "an edge is used twice in one direction"
        );
        assert!(
            edges.iter().all(|&(a, b)| set.contains(&(b, a))),
            "an open edge"
        );
        let volumes = shapes.triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|i| shapes.vertices[i as usize]);
            a.dot(b.cross(c)) / 6.0
        });
        volumes.sum()
    }

    fn assert_volume(make: impl Fn(&mut Shapes), expected: f32, tolerance: f32) {
        let mut shapes = Shapes::default();
        make(&mut shapes);
        let volume = closed_volume(&shapes);
        assert!(
            (volume / expected - 1.0).abs() < tolerance,
            "{volume}, expected {expected}"
        );
    }

    #[test]
    fn solids_are_closed_and_outside_is_out() {
        let pi = std::f32::consts::PI;
        let centre = Vec3::new(1.0, 2.0, 3.0);
        assert_volume(|s| s.cuboid(-centre, centre), 48.0, 1e-6);
        assert_volume(|s| s.sphere(centre, 2.0, 128), 4.0 / 3.0 * pi * 8.0, 1e-2);
        assert_volume(
            |s| s.rod(centre, Vec3::ZERO, 0.5, 64),
            pi * 0.25 * 14.0_f32.sqrt(),
            1e-2,
        );
        assert_volume(
            |s| s.lathe(centre, 4, &[[0.0, 0.0], [1.0, 0.0], [1.0, 3.0], [0.0, 3.0]]),
            2.0 * 3.0,
            1e-5,
        );
        let mut cushion = Shapes::default();
        cushion.cushion(centre, Vec3::ONE, 32);
        let volume = closed_volume(&cushion);
        assert!(
            (4.2..8.0).contains(&volume),
            "{volume}: between ball and block"
        );
    }

    #[test]
    fn open_shapes_face_along_u_cross_v() {
        let mut shapes = Shapes::default();
        shapes.quad(Vec3::ZERO, Vec3::Z, Vec3::X);
        shapes.sheet([3, 2], |u, v| Vec3::new(v, 0.0, u));
        assert_eq!(shapes.triangles.len(), 2 + 12);
        for triangle in &shapes.triangles {
            let [a, b, c] = triangle.map(|i| shapes.vertices[i as usize]);
            assert!((b - a).cross(c - a).y > 0.0);
        }
    }
}
