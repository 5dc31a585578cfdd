//! Ray sets that are shot at a scene by a path tracer.

use raywright_bvh::{Bvh, Ray, Vec3};
use raywright_tracer::{Surface, World, imaging::PixelSampler};

/// Side of the square picture whose rays are taken.
const SIDE: u32 = 256;

/// One kind of rays.
#[derive(Debug)]
pub struct RaySet {
    /// Its name in tables.
    pub name: &'static str,
    /// The rays, in the order in which pixels shoot them.
    pub rays: Vec<Ray>,
    /// Whether only occlusion is asked.
    pub any_hit: bool,
}

/// Camera rays, one diffuse bounce from each hit, and a segment from each hit to a point near the
/// top of the scene's box.
///
/// # Panics
/// If the scene has no camera.
#[must_use]
pub fn ray_sets(world: &World, bvh: &Bvh) -> Vec<RaySet> {
    let camera = world.scene().camera.expect("a scene with a camera");
    let projection = camera
        .projection(SIDE, SIDE)
        .expect("a camera that can be used");
    let bounds = world.bounds();
    let size = bounds.max - bounds.min;
    let (mut primary, mut diffuse, mut shadow) = (vec![], vec![], vec![]);
    for y in 0..SIDE {
        for x in 0..SIDE {
            let direction = projection.direction(x as f32 + 0.5, y as f32 + 0.5);
            let ray = Ray::new(camera.origin, direction);
            primary.push(ray);
            let Some(hit) = bvh.closest_hit(&ray) else {
                continue;
            };
            let mesh = &world.scene().meshes[hit.geometry_id as usize].triangles;
            let surface = Surface::of_hit(mesh, &hit);
            let numbers = PixelSampler::new(1, x, y, 0);
            let uniform = |dimension: u32| numbers.uniform(dimension);
            // A point of the unit sphere around the tip of the normal has density cos θ / π.
            let (z, angle) = (2.0 * uniform(0) - 1.0, std::f32::consts::TAU * uniform(1));
            let across = (1.0 - z * z).max(0.0).sqrt();
            let sphere = Vec3::new(across * angle.cos(), across * angle.sin(), z);
            let normal = surface.normal_towards(-direction);
            diffuse.push(surface.ray_towards((normal + sphere * 0.999).normalize()));
            let light =
                bounds.min + size * Vec3::new(0.4 + 0.2 * uniform(2), 0.9, 0.4 + 0.2 * uniform(3));
            shadow.push(surface.segment_to_point(light));
        }
    }
    vec![
        RaySet {
            name: "primary",
            rays: primary,
            any_hit: false,
        },
        RaySet {
            name: "diffuse",
            rays: diffuse,
            any_hit: false,
        },
        RaySet {
            name: "shadow",
            rays: shadow,
            any_hit: true,
        },
    ]
}
