//! Path tracing (Kajiya, *The Rendering Equation*, 1986) with next-event estimation and multiple
//! importance sampling by the power heuristic (Veach, *Robust Monte Carlo Methods for Light
//! Transport Simulation*, 1997, section 9.2).
//!
//! Invariants: random numbers are asked by the fixed plan of `imaging::sampler::dimension`, so
//! that what a scene lacks changes no number of what it has; every path is a pure function of
//! world, ray and sampler. Not for scenes lit by small lights behind glass: there is no glass yet,
//! and light that no strategy can find is missing in every path tracer.

use std::f32::consts::{FRAC_1_PI, PI};

use raywright_bvh::{Bvh, Ray, Vec3};
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
    mut ray: Ray,
    sampler: &PixelSampler,
    path_length: u32,
) -> Rgb {
    let needs = world.needs();
    let mut radiance = Rgb::ZERO;
    let mut throughput = Rgb::ONE;
    // Where the last scattering event was, and with which density its direction was sampled.
    let mut last: Option<(Vec3, f32)> = None;
    for event in 0..=path_length {
        let Some(hit) = bvh.closest_hit(&ray) else {
            return radiance + throughput * world.environment();
        };
        let (surface, material) = world.surface(&hit);
        let out = -ray.direction;
        if material.is_emissive() && surface.normal.dot(out) > 0.0 {
            let weight = last.map_or(1.0, |(from, density)| {
                world
                    .emitters
                    .density(hit.geometry_id as usize, &surface, from, ray.direction)
                    .map_or(1.0, |light_density| power_heuristic(density, light_density))
            });
            radiance += throughput * material.emission * weight;
        }
        let from_behind = surface.normal.dot(out) < 0.0;
        if event == path_length
            || (from_behind && material.sides == Sides::Front)
            || material.diffuse == Rgb::ZERO
        {
            return radiance;
        }
        let normal = surface.normal_towards(out);
        let numbers = dimension::event(event);
        if needs.next_event {
            let choice = [
                sampler.uniform(numbers + dimension::LIGHT_CHOICE),
                sampler.uniform(numbers + dimension::SPARE),
            ];
            let uniform = sampler.uniform_2d(numbers + dimension::LIGHT_UV);
            if let Some(light) =
                world
                    .emitters
                    .sample(&world.scene().meshes, &surface, choice, uniform)
            {
                let cosine = normal.dot(light.direction);
                if cosine > 0.0 && !bvh.any_hit(&light.shadow_ray) {
                    let weight = light
                        .density
                        .map_or(1.0, |density| power_heuristic(density, cosine * FRAC_1_PI));
                    radiance +=
                        throughput * material.diffuse * light.value * (FRAC_1_PI * cosine * weight);
                }
            }
        }
        if event + 1 == path_length && !needs.found_by_rays {
            return radiance;
        }
        let direction = cosine_hemisphere(normal, sampler.uniform_2d(numbers + dimension::BSDF_UV));
        let cosine = normal.dot(direction);
        if cosine <= 0.0 {
            return radiance;
        }
        // Lambert reflection sampled by the cosine: (albedo / π) · cos θ / (cos θ / π) = albedo.
        throughput *= material.diffuse;
        last = Some((surface.position, cosine / PI));
        ray = surface.ray_towards(direction);
    }
    radiance
}

/// Weight of a sample of density `this` where another strategy has density `other`.
#[inline]
fn power_heuristic(this: f32, other: f32) -> f32 {
    // Of the ratio, since the square of a density can overflow.
    let ratio = other / this;
    1.0 / (1.0 + ratio * ratio)
}
