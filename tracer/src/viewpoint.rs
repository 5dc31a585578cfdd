//! A camera for a scene that brings none.
//!
//! Candidates stand on a lattice inside the scene's box and around it; each looks where a coarse
//! picture shows the most of the scene. The score is the number of distinct triangles met, less
//! for rays that leave the scene, for views that are close to a wall, and for surfaces seen from
//! behind (a camera inside a solid). Deterministic; costs some hundred thousand rays.

use std::collections::HashSet;

use raywright_bvh::{Aabb, Bvh, Ray, Vec3};
use raywright_imaging::Camera;

use crate::world::World;

const VERTICAL_FOV_DEGREES: f32 = 60.0;
/// Size of the coarse picture.
const WIDTH: u32 = 32;
const HEIGHT: u32 = 18;
/// Places per axis, as shares of the box.
const PLACES: [[f32; 3]; 3] = [[0.2, 0.5, 0.8], [0.15, 0.4, 0.65], [0.2, 0.5, 0.8]];
/// Views whose median distance is below this share of the diagonal are too close.
const CLOSE: f32 = 0.06;

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
    let mut best: Option<(f32, Camera)> = None;
    for camera in candidates(&bounds) {
        let score = score(world, bvh, &camera, bounds.diagonal());
        if best.as_ref().is_none_or(|(other, _)| score > *other) {
            best = Some((score, camera));
        }
    }
    best.map_or_else(|| outside(&bounds, Vec3::Z), |(_, camera)| camera)
}

fn camera(origin: Vec3, target: Vec3) -> Camera {
    Camera {
        origin,
        target,
        up: Vec3::Y,
        vertical_fov_degrees: VERTICAL_FOV_DEGREES,
    }
}

/// A camera outside that has the whole box in view.
fn outside(bounds: &Aabb, direction: Vec3) -> Camera {
    // At a field of 60 degrees a sphere fills the height from twice its radius.
    let centre = bounds.centre();
    camera(
        centre + direction.normalize_or(Vec3::Z) * bounds.diagonal().max(f32::MIN_POSITIVE),
        centre,
    )
}

fn candidates(bounds: &Aabb) -> impl Iterator<Item = Camera> {
    let bounds = *bounds;
    let size = bounds.max - bounds.min;
    let directions = (0..8).map(|eighth| {
        // Eight compass directions, a little downwards.
        let [x, z] = [
            [1, 0],
            [1, 1],
            [0, 1],
            [-1, 1],
            [-1, 0],
            [-1, -1],
            [0, -1],
            [1, -1],
        ][eighth];
        Vec3::new(x as f32, -0.15, z as f32).normalize()
    });
    let directions: Vec<Vec3> = directions.collect();
    let inside = PLACES[0].into_iter().flat_map(move |x| {
        let directions = directions.clone();
        PLACES[1].into_iter().flat_map(move |y| {
            let directions = directions.clone();
            PLACES[2].into_iter().flat_map(move |z| {
                let origin = bounds.min + size * Vec3::new(x, y, z);
                let reach = size.max_element();
                directions
                    .clone()
                    .into_iter()
                    .map(move |direction| camera(origin, origin + direction * reach))
            })
        })
    });
    let around = [
        [1.0, 0.5, 1.0],
        [-1.0, 0.5, 1.0],
        [1.0, 0.5, -1.0],
        [-1.0, 0.5, -1.0],
    ];
    inside.chain(
        around
            .into_iter()
            .map(move |direction| outside(&bounds, Vec3::from(direction))),
    )
}

fn score(world: &World, bvh: &Bvh, camera: &Camera, diagonal: f32) -> f32 {
    let Ok(projection) = camera.projection(WIDTH, HEIGHT) else {
        return 0.0;
    };
    let mut seen = HashSet::new();
    let mut distances = Vec::new();
    let mut from_behind = 0;
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let direction = projection.direction(x as f32 + 0.5, y as f32 + 0.5);
            if let Some(hit) = bvh.closest_hit(&Ray::new(camera.origin, direction)) {
                seen.insert((hit.geometry_id, hit.primitive_id));
                distances.push(hit.t);
                from_behind += u32::from(world.surface(&hit).0.normal.dot(direction) > 0.0);
            }
        }
    }
    if distances.is_empty() {
        return 0.0;
    }
    distances.sort_by(f32::total_cmp);
    let median = distances[distances.len() / 2];
    let hits = distances.len() as f32;
    let hit_share = hits / (WIDTH * HEIGHT) as f32;
    let close = (median / (CLOSE * diagonal)).min(1.0);
    // Not quite to 0, so that a scene wound the other way round still has a best view.
    let front = 1.05 - from_behind as f32 / hits;
    seen.len() as f32 * hit_share * close * front
}
