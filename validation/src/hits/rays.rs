//! Rays to ask tracers with: those of a path tracer, and those that go wrong most.
//!
//! Invariant: a function of scene, kind, number and seed.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use raywright_bvh::{Bvh, Ray, TriangleMesh, Vec3};

/// A kind of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum RayKind {
    /// From one place to the pixels of a picture.
    Primary,
    /// From a surface, by the cosine.
    Diffuse,
    /// From a surface to a point of the box of the scene, and no farther.
    Shadow,
    /// From anywhere to anywhere.
    Random,
    /// At the middles and other points of edges.
    Edges,
    /// At vertices.
    Vertices,
    /// Along an axis, from coordinates of vertices.
    AxisParallel,
    /// Nearly within the plane of a triangle, at it.
    Grazing,
    /// From a point of a triangle, exactly as far as rounding allows.
    FromSurfaces,
    /// From a thousand sizes of the scene away.
    FarAway,
}

impl RayKind {
    /// All.
    pub const ALL: [Self; 10] = [
        Self::Primary,
        Self::Diffuse,
        Self::Shadow,
        Self::Random,
        Self::Edges,
        Self::Vertices,
        Self::AxisParallel,
        Self::Grazing,
        Self::FromSurfaces,
        Self::FarAway,
    ];

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary",
            Self::Diffuse => "diffuse",
            Self::Shadow => "shadow",
            Self::Random => "random",
            Self::Edges => "edges",
            Self::Vertices => "vertices",
            Self::AxisParallel => "axis-parallel",
            Self::Grazing => "grazing",
            Self::FromSurfaces => "from surfaces",
            Self::FarAway => "far away",
        }
    }
}

/// Makes rays for a mesh.
#[derive(Debug)]
pub struct Rays<'a> {
    mesh: &'a TriangleMesh,
    /// Tells where rays that begin on surfaces begin.
    tree: &'a Bvh,
    min: Vec3,
    size: Vec3,
    random: Xoshiro256PlusPlus,
}

/// Width of the picture of primary rays, in rays.
const PICTURE_WIDTH: usize = 1024;

impl<'a> Rays<'a> {
    /// Rays for a mesh with a triangle at least, by a seed.
    #[must_use]
    pub fn new(mesh: &'a TriangleMesh, tree: &'a Bvh, seed: u64) -> Self {
        let used = mesh.triangles().iter().flatten();
        let (min, max) = used.fold(
            (Vec3::INFINITY, Vec3::NEG_INFINITY),
            |(min, max), &index| {
                let vertex = mesh.vertices()[index as usize];
                (min.min(vertex), max.max(vertex))
            },
        );
        Self {
            mesh,
            tree,
            min,
            size: max - min,
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
        }
    }

    /// So many rays of a kind.
    pub fn of(&mut self, kind: RayKind, count: usize) -> Vec<Ray> {
        let eye = self.place();
        let target = self.place();
        (0..count)
            .map(|index| match kind {
                RayKind::Primary => primary(eye, target, index, count),
                RayKind::Diffuse => self.diffuse(),
                RayKind::Shadow => self.shadow(),
                RayKind::Random => {
                    let (from, to) = (self.place(), self.place());
                    Ray::new(from, to - from)
                }
                RayKind::Edges => {
                    let [a, b, _] = self.triangle();
                    let share = [0.5, 0.25, self.unit()][index % 3];
                    self.toward(a + share * (b - a))
                }
                RayKind::Vertices => {
                    let [vertex, ..] = self.triangle();
                    self.toward(vertex)
                }
                RayKind::AxisParallel => self.axis_parallel(index),
                RayKind::Grazing => self.grazing(),
                RayKind::FromSurfaces => {
                    let from = self.on_triangle();
                    let to = self.place();
                    Ray::new(from, to - from)
                }
                RayKind::FarAway => {
                    let direction = self.direction();
                    let to = self.on_triangle();
                    Ray::new(to - direction * (1000.0 * self.size.length()), direction)
                }
            })
            .collect()
    }

    fn unit(&mut self) -> f32 {
        self.random.random()
    }

    /// Anywhere in the box of the scene.
    fn place(&mut self) -> Vec3 {
        let share = Vec3::new(self.unit(), self.unit(), self.unit());
        self.min + share * self.size
    }

    /// A unit vector, all alike.
    fn direction(&mut self) -> Vec3 {
        let z = 2.0 * self.unit() - 1.0;
        let turn = std::f32::consts::TAU * self.unit();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * turn.cos(), r * turn.sin(), z)
    }

    fn triangle(&mut self) -> [Vec3; 3] {
        let count = self.mesh.triangles().len();
        let primitive = self.random.random_range(0..count) as u32;
        let mut corners = self.mesh.corners(primitive);
        corners.rotate_left(self.random.random_range(0..3));
        corners
    }

    fn on_triangle(&mut self) -> Vec3 {
        let [a, b, c] = self.triangle();
        let (x, y) = (self.unit().sqrt(), self.unit());
        a + x * (1.0 - y) * (b - a) + x * y * (c - a)
    }

    /// From anywhere at a point.
    fn toward(&mut self, point: Vec3) -> Ray {
        let from = self.place();
        Ray::new(from, point - from)
    }

    /// Where a random ray meets a surface, and its normal on that side; the middle of nothing else.
    fn surface(&mut self) -> (Vec3, Vec3) {
        for _ in 0..64 {
            let ray = Ray::new(self.place(), self.direction());
            if let Some(hit) = self.tree.closest_hit(&ray) {
                let [a, b, c] = self.mesh.corners(hit.primitive_id);
                let normal = (b - a).cross(c - a).normalize_or_zero();
                let side = if normal.dot(ray.direction) > 0.0 {
                    -1.0
                } else {
                    1.0
                };
                return (ray.origin + hit.t * ray.direction, side * normal);
            }
        }
        (self.place(), Vec3::Y)
    }

    fn diffuse(&mut self) -> Ray {
        let (point, normal) = self.surface();
        let direction = normal + self.direction();
        Ray::new(point, direction).with_range(1e-4 * self.size.length(), f32::INFINITY)
    }

    fn shadow(&mut self) -> Ray {
        let (point, _) = self.surface();
        let to_light = self.place() - point;
        Ray::new(point, to_light).with_range(1e-3, 1.0)
    }

    fn axis_parallel(&mut self, index: usize) -> Ray {
        let axis = index % 3;
        let (a, b) = (self.triangle()[0], self.triangle()[1]);
        let mut from = Vec3::new(a.x, b.y, a.z);
        let mut direction = Vec3::ZERO;
        // Zeros of both signs.
        for other in 0..3 {
            direction[other] = if self.unit() < 0.5 { 0.0 } else { -0.0 };
        }
        let up = self.unit() < 0.5;
        direction[axis] = if up { 1.0 } else { -1.0 };
        from[axis] = if up {
            self.min[axis] - self.size[axis]
        } else {
            self.min[axis] + 2.0 * self.size[axis]
        };
        Ray::new(from, direction)
    }

    fn grazing(&mut self) -> Ray {
        let [a, b, c] = self.triangle();
        let (x, y) = (self.unit().sqrt(), self.unit());
        let point = a + x * (1.0 - y) * (b - a) + x * y * (c - a);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let along = self.direction();
        let along = (along - along.dot(normal) * normal).normalize_or_zero();
        // From a hundredth of a degree to one.
        let slope = 10.0_f32.powf(-2.0 * self.unit()).to_radians();
        let direction = along - slope * normal;
        let away = 0.25 * self.unit() * self.size.length();
        Ray::new(point - away * direction, direction)
    }
}

/// A ray of a picture of `count` rays.
fn primary(eye: Vec3, target: Vec3, index: usize, count: usize) -> Ray {
    let forward = (target - eye).normalize_or_zero();
    let right = forward.any_orthonormal_vector();
    let up = right.cross(forward);
    let rows = count.div_ceil(PICTURE_WIDTH);
    let across = (index % PICTURE_WIDTH) as f32 / PICTURE_WIDTH as f32 - 0.5;
    let down = (index / PICTURE_WIDTH) as f32 / rows as f32 - 0.5;
    Ray::new(eye, forward + 1.5 * across * right - 1.5 * down * up)
}
