//! The slow twin of the path integrator: the rendering equation read aloud. Emitters are found by
//! chance; only lights without extent, which chance cannot find, are added one by one.

use std::f32::consts::FRAC_1_PI;

use raywright_bvh::{Bvh, Ray};
use raywright_imaging::sampler::{PixelSampler, dimension};

use crate::{
    sampling::cosine_hemisphere,
    scene::{Rgb, Sides},
    world::World,
};

/// Radiance that arrives along `ray` by paths of at most `path_length` scattering events.
pub(crate) fn radiance(
    world: &World,
    bvh: &Bvh,
    ray: Ray,
    sampler: &PixelSampler,
    path_length: u32,
) -> Rgb {
    incoming(world, bvh, ray, sampler, 0, path_length)
}

fn incoming(
    world: &World,
    bvh: &Bvh,
    ray: Ray,
    sampler: &PixelSampler,
    event: u32,
    path_length: u32,
) -> Rgb {
    let Some(hit) = bvh.closest_hit(&ray) else {
        return world.environment();
    };
    let (surface, material) = world.surface(&hit);
    let out = -ray.direction;
    let in_front = surface.normal.dot(out) > 0.0;
    let emitted = if in_front {
        material.emission
    } else {
        Rgb::ZERO
    };
    if event == path_length || (!in_front && material.sides == Sides::Front) {
        return emitted;
    }
    let normal = surface.normal_towards(out);
    let mut reflected = Rgb::ZERO;
    for light in world.emitters.without_extent(&surface) {
        let cosine = normal.dot(light.direction);
        if cosine > 0.0 && !bvh.any_hit(&light.shadow_ray) {
            reflected += light.value * (cosine * FRAC_1_PI);
        }
    }
    let uniform = sampler.uniform_2d(dimension::event(event) + dimension::BSDF_UV);
    let direction = cosine_hemisphere(normal, uniform);
    reflected += incoming(
        world,
        bvh,
        surface.ray_towards(direction),
        sampler,
        event + 1,
        path_length,
    );
    emitted + material.diffuse * reflected
}
