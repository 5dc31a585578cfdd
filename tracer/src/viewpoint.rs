//! A camera for a scene that brings none, and a light for what no sky reaches.
//!
//! Candidates stand on a lattice inside the scene's box, where the scene surrounds them, and
//! around the bulk of the triangles; a coarse picture of each is scored: the number of distinct
//! triangles, less for a wall close by, for surfaces seen from
//! behind (a camera inside a solid), and for what the sky does not reach. Deterministic; costs
//! some hundred thousand rays.

use std::collections::HashSet;

use raywright_bvh::{Aabb, Bvh, Ray, Vec3};
use raywright_imaging::Camera;

use crate::{surface::Surface, world::World};

const VERTICAL_FOV_DEGREES: f32 = 60.0;
/// Size of the coarse picture.
const WIDTH: u32 = 32;
const HEIGHT: u32 = 18;
/// Places inside the box, as shares of it.
const ACROSS: [f32; 3] = [0.2, 0.5, 0.8];
const UP: [f32; 3] = [0.15, 0.4, 0.65];
/// A place is inside if so many of the directions around it meet the scene.
const SURROUNDED: f32 = 0.75;
/// Views whose median distance is below this share of the diagonal are too close.
const CLOSE: f32 = 0.12;
/// Distance from the bulk of the triangles, in units of their root mean square spread: at a field
/// of 60 degrees twice the spread on either side fills the height.
const DISTANCE: f32 = 3.5;
/// The sky reaches what so many of the rays towards it leave.
const LIT: f32 = 0.1;

/// The camera from which a coarse picture shows most of the scene. Without triangles, some camera.
#[must_use]
pub fn automatic_camera(world: &World, bvh: &Bvh) -> Camera {
    let bounds = world.bounds();
    let bounds = if bounds.is_empty() {
        Aabb {
            min: -Vec3::ONE,
            max: Vec3::ONE,
        }
    } else {
        bounds
    };
    let outside = outside(world, &bounds);
    let inside = inside(&bounds).filter(|camera| surrounded(bvh, camera.origin) >= SURROUNDED);
    let mut best = (0.0, outside[0]);
    for camera in inside.chain(outside) {
        let score = View::of(world, bvh, &camera).score(bounds.diagonal());
        if score > best.0 {
            best = (score, camera);
        }
    }
    best.1
}

/// Distance from the camera to what it mostly sees, if the sky hardly reaches that: the reach of a
/// light that is needed at the camera.
#[must_use]
pub fn dark_distance(world: &World, bvh: &Bvh, camera: &Camera) -> Option<f32> {
    let view = View::of(world, bvh, camera);
    (view.hits > 0.0 && view.lit < LIT).then_some(view.median_distance)
}

fn looking(origin: Vec3, target: Vec3) -> Camera {
    Camera {
        origin,
        target,
        up: Vec3::Y,
        vertical_fov_degrees: VERTICAL_FOV_DEGREES,
    }
}

/// Cameras around the bulk of the triangles.
fn outside(world: &World, bounds: &Aabb) -> [Camera; 4] {
    let (mut sum, mut squares, mut count) = (glam::DVec3::ZERO, 0.0, 0.0);
    let centre = bounds.centre().as_dvec3();
    for mesh in &world.scene().meshes {
        for id in 0..mesh.triangles.triangles().len() as u32 {
            let corners = mesh
                .triangles
                .corners(id)
                .map(|corner| corner.as_dvec3() - centre);
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            sum += middle;
            squares += middle.length_squared();
            count += 1.0;
        }
    }
    let mean = if count > 0.0 { sum / count } else { sum };
    let variance = if count > 0.0 {
        squares / count - mean.length_squared()
    } else {
        1.0
    };
    let target = (centre + mean).as_vec3();
    // A single triangle has no spread but an extent.
    let spread = (variance.max(0.0).sqrt() as f32)
        .max(bounds.diagonal() / 100.0)
        .max(f32::MIN_POSITIVE);
    [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]].map(|[x, z]| {
        let direction = Vec3::new(x, 0.6, z).normalize();
        looking(target + direction * (spread * DISTANCE), target)
    })
}

/// Cameras on a lattice in the box that look in eight compass directions, a little downwards.
fn inside(bounds: &Aabb) -> impl Iterator<Item = Camera> {
    let (min, size) = (bounds.min, bounds.max - bounds.min);
    let places = ACROSS
        .into_iter()
        .flat_map(|x| UP.into_iter().map(move |y| (x, y)));
    let places = places.flat_map(|(x, y)| ACROSS.into_iter().map(move |z| Vec3::new(x, y, z)));
    places.flat_map(move |place| {
        let origin = min + size * place;
        [
            [1, 0],
            [1, 1],
            [0, 1],
            [-1, 1],
            [-1, 0],
            [-1, -1],
            [0, -1],
            [1, -1],
        ]
        .map(|[x, z]| {
            let direction = Vec3::new(x as f32, -0.15, z as f32).normalize();
            looking(origin, origin + direction * size.max_element())
        })
    })
}

/// Share of the directions around a point that meet the scene: a lattice on the cube.
fn surrounded(bvh: &Bvh, origin: Vec3) -> f32 {
    let steps = [-1.0, -0.5, 0.0, 0.5, 1.0];
    let (mut hits, mut rays) = (0.0, 0.0);
    for x in steps {
        for y in steps {
            for z in steps {
                let direction = Vec3::new(x, y, z);
                if direction.abs().max_element() == 1.0 {
                    rays += 1.0;
                    hits += f32::from(u8::from(bvh.any_hit(&Ray::new(origin, direction))));
                }
            }
        }
    }
    hits / rays
}

/// What a coarse picture shows.
#[derive(Default)]
struct View {
    /// Share of the rays that meet the scene.
    hits: f32,
    triangles: f32,
    median_distance: f32,
    /// Share of the hits that show the back of a surface.
    from_behind: f32,
    /// Share of rays from what is seen towards the sky that arrive.
    lit: f32,
}

impl View {
    fn of(world: &World, bvh: &Bvh, camera: &Camera) -> Self {
        let Ok(projection) = camera.projection(WIDTH, HEIGHT) else {
            return Self::default();
        };
        let mut triangles = HashSet::new();
        let mut distances = Vec::new();
        let (mut from_behind, mut lit) = (0.0, 0.0);
        for y in 0..HEIGHT {
            for x in 0..WIDTH {
                let direction = projection.direction(x as f32 + 0.5, y as f32 + 0.5);
                let Some(hit) = bvh.closest_hit(&Ray::new(camera.origin, direction)) else {
                    continue;
                };
                let surface = world.surface(&hit).0;
                triangles.insert((hit.geometry_id, hit.primitive_id));
                distances.push(hit.t);
                from_behind += f32::from(u8::from(surface.normal.dot(direction) > 0.0));
                lit += sky_share(bvh, &surface, -direction);
            }
        }
        distances.sort_by(f32::total_cmp);
        let Some(&median_distance) = distances.get(distances.len() / 2) else {
            return Self::default();
        };
        let hits = distances.len() as f32;
        Self {
            hits: hits / (WIDTH * HEIGHT) as f32,
            triangles: triangles.len() as f32,
            median_distance,
            from_behind: from_behind / hits,
            lit: lit / hits,
        }
    }

    fn score(&self, diagonal: f32) -> f32 {
        let close = (self.median_distance / (CLOSE * diagonal)).min(1.0);
        // Neither factor reaches 0, so that a scene that is wound the other way round, or has no
        // opening, still has a best view.
        let front = 1.05 - self.from_behind;
        let lit = LIT + self.lit;
        self.triangles * close * close * front * lit
    }
}

/// Share of four directions around the one between the surface's normal and up that are free.
fn sky_share(bvh: &Bvh, surface: &Surface, towards_camera: Vec3) -> f32 {
    let normal = surface.normal_towards(towards_camera);
    let free = [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]].map(|[x, z]| {
        let direction = normal + Vec3::new(0.4 * x, 0.9, 0.4 * z);
        direction.dot(normal) > 0.0 && !bvh.any_hit(&surface.ray_towards(direction))
    });
    free.iter().filter(|free| **free).count() as f32 / free.len() as f32
}

#[cfg(test)]
mod tests {
    use raywright_bvh::TriangleMesh;

    use super::*;
    use crate::scene::{Material, Mesh, Rgb, Scene};

    fn world(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> (World, Bvh) {
        let triangles = TriangleMesh::new(vertices, triangles).unwrap();
        let world = World::new(Scene {
            meshes: vec![Mesh {
                name: "mesh".into(),
                triangles,
                material: 0,
            }],
            materials: vec![Material::diffuse("grey", Rgb::splat(0.5))],
            ..Scene::default()
        });
        let bvh = world
            .build_tree(&Default::default(), &mut Default::default())
            .unwrap();
        (world, bvh)
    }

    /// A box of 12 triangles with the given winding of its faces.
    fn cube(outward: bool) -> (World, Bvh) {
        let vertices = (0..8)
            .map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 4.0)
            .collect();
        let faces = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        let triangles = faces
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
        world(
            vertices,
            triangles
                .map(|[a, b, c]| if outward { [a, b, c] } else { [a, c, b] })
                .collect(),
        )
    }

    #[test]
    fn a_solid_is_seen_from_outside_and_a_room_from_inside() {
        let within = |p: Vec3| p.cmpgt(Vec3::ZERO).all() && p.cmplt(Vec3::splat(4.0)).all();
        let (solid, tree) = cube(true);
        assert!(!within(automatic_camera(&solid, &tree).origin));
        let (room, tree) = cube(false);
        let camera = automatic_camera(&room, &tree);
        assert!(within(camera.origin), "{camera:?}");
        assert!(dark_distance(&room, &tree, &camera).is_some_and(|d| d > 0.0 && d < 8.0));
    }

    #[test]
    fn the_sky_reaches_a_plane() {
        let (plane, tree) = world(
            vec![Vec3::ZERO, Vec3::Z * 4.0, Vec3::X * 4.0],
            vec![[0, 1, 2]],
        );
        let camera = automatic_camera(&plane, &tree);
        assert!(
            View::of(&plane, &tree, &camera).hits > 0.05,
            "it is in view: {camera:?}"
        );
        assert_eq!(dark_distance(&plane, &tree, &camera), None);
    }

    #[test]
    fn a_scene_without_triangles_has_a_camera() {
        let (empty, tree) = world(vec![], vec![]);
        assert_eq!(automatic_camera(&empty, &tree).validate(), Ok(()));
    }
}
