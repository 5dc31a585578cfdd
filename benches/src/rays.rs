//! Ray sets: those that a path tracer shoots at a scene, the same out of order, and segments that
//! have nothing to do with one another.

use raywright_bvh::{Aabb, Bvh, Ray, Vec3};
use raywright_tracer::{Surface, World, imaging::PixelSampler};

/// Side of the square picture whose rays are measured.
pub const SIDE: u32 = 256;

/// Seeds of sets that must not share their numbers with the bounces of [`ray_sets`].
const SHUFFLE_SEED: u64 = 2;
const SEGMENT_SEED: u64 = 3;

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

impl RaySet {
    /// The same rays in an order that has nothing to do with pixels.
    #[must_use]
    pub fn shuffled(&self, name: &'static str) -> Self {
        let key = |i: u32| PixelSampler::new(SHUFFLE_SEED, i, 0, 0).uniform(0);
        let mut keyed: Vec<(f32, Ray)> = (0..).map(key).zip(self.rays.iter().copied()).collect();
        keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self {
            name,
            rays: keyed.into_iter().map(|(_, ray)| ray).collect(),
            any_hit: self.any_hit,
        }
    }
}

/// Occlusion along segments between two points that are uniform in `bounds`, one for each pixel of
/// a square picture of side `side`.
#[must_use]
pub fn random_segments(bounds: Aabb, side: u32) -> RaySet {
    let segment = |i: u32| {
        // The row tells pictures of different sides apart.
        let numbers = PixelSampler::new(SEGMENT_SEED, i, side, 0);
        let point = |first: u32| {
            let place = [0, 1, 2].map(|axis| numbers.uniform(first + axis));
            bounds.min + (bounds.max - bounds.min) * Vec3::from_array(place)
        };
        let from = point(0);
        Ray::new(from, point(3) - from).with_range(0.0, 1.0)
    };
    RaySet {
        name: "random segments",
        rays: (0..side * side).map(segment).collect(),
        any_hit: true,
    }
}

/// From a square picture of side `side`: camera rays, one diffuse bounce from each hit, and a
/// segment from each hit to a point near the top of the scene's box.
///
/// # Panics
/// If the scene has no camera.
#[must_use]
pub fn ray_sets(world: &World, bvh: &Bvh, side: u32) -> Vec<RaySet> {
    let camera = world.scene().camera.expect("a scene with a camera");
    let projection = camera
        .projection(side, side)
        .expect("a camera that can be used");
    let bounds = world.bounds();
    let size = bounds.max - bounds.min;
    let (mut primary, mut diffuse, mut shadow) = (vec![], vec![], vec![]);
    for y in 0..side {
        for x in 0..side {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shuffling_keeps_the_rays_and_not_their_order() {
        let bounds = Aabb {
            min: Vec3::ZERO,
            max: Vec3::new(1.0, 2.0, 3.0),
        };
        let set = random_segments(bounds, 16);
        assert!(set.rays.iter().all(|ray| {
            let ends = [ray.origin, ray.origin + ray.direction];
            ends.iter().all(|end| end.cmpge(Vec3::splat(-1e-6)).all())
        }));
        let shuffled = set.shuffled("again");
        assert_ne!(set.rays, shuffled.rays);
        let sorted = |set: &RaySet| {
            let mut xs: Vec<f32> = set.rays.iter().map(|ray| ray.origin.x).collect();
            xs.sort_by(f32::total_cmp);
            xs
        };
        assert_eq!(sorted(&set), sorted(&shuffled));
    }
}
