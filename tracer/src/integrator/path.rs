//! Path tracing (Kajiya, *The Rendering Equation*, 1986) with next-event estimation and multiple
//! importance sampling by the power heuristic (Veach, *Robust Monte Carlo Methods for Light
//! Transport Simulation*, 1997, section 9.2).
//!
//! Invariants: random numbers are asked by the fixed plan of `imaging::sampler::dimension`, so
//! that what a scene lacks changes no number of what it has; every path is a pure function of
//! world, ray and sampler. Not for scenes lit by small lights behind glass: there is no glass yet,
//! and light that no strategy can find is missing in every path tracer.

use std::f32::consts::{FRAC_1_PI, PI};

use raywright_bvh::{Bvh, Hit, Ray, Vec3};
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
    let mut path = Path::new(ray);
    loop {
        let hit = bvh.closest_hit(&path.ray);
        let event = path.scatter(world, hit.as_ref(), sampler, path_length);
        if let Some(light) = event.light
            && !bvh.any_hit(&light.shadow_ray)
        {
            path.radiance += light.radiance;
        }
        if !event.goes_on {
            return path.radiance;
        }
    }
}

/// A path on its way from the camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Path {
    /// Its next ray.
    pub(crate) ray: Ray,
    /// What it has found.
    pub(crate) radiance: Rgb,
    throughput: Rgb,
    /// Where the last scattering event was, and with which density its direction was sampled.
    last: Option<(Vec3, f32)>,
    events: u32,
}

/// What happens where a ray of a path ends.
pub(crate) struct Event {
    pub(crate) light: Option<Light>,
    /// Whether the path has a next ray.
    pub(crate) goes_on: bool,
}

/// Radiance that a path finds unless something is in the way.
pub(crate) struct Light {
    pub(crate) shadow_ray: Ray,
    pub(crate) radiance: Rgb,
}

impl Path {
    #[inline]
    pub(crate) fn new(ray: Ray) -> Self {
        Self {
            ray,
            radiance: Rgb::ZERO,
            throughput: Rgb::ONE,
            last: None,
            events: 0,
        }
    }

    /// Goes to what its ray hits, and from there on if it does.
    #[inline]
    pub(crate) fn scatter(
        &mut self,
        world: &World,
        hit: Option<&Hit>,
        sampler: &PixelSampler,
        path_length: u32,
    ) -> Event {
        let mut end = Event {
            light: None,
            goes_on: false,
        };
        let Some(hit) = hit else {
            self.radiance += self.throughput * world.environment();
            return end;
        };
        let needs = world.needs();
        let (surface, material) = world.surface(hit);
        let out = -self.ray.direction;
        if material.is_emissive() && surface.normal.dot(out) > 0.0 {
            let weight = self.last.map_or(1.0, |(from, density)| {
                world
                    .emitters
                    .density(hit.geometry_id as usize, &surface, from, self.ray.direction)
                    .map_or(1.0, |light_density| power_heuristic(density, light_density))
            });
            self.radiance += self.throughput * material.emission * weight;
        }
        let from_behind = surface.normal.dot(out) < 0.0;
        if self.events == path_length
            || (from_behind && material.sides == Sides::Front)
            || material.diffuse == Rgb::ZERO
        {
            return end;
        }
        let normal = surface.normal_towards(out);
        let numbers = dimension::event(self.events);
        if needs.next_event {
            let choice = [
                sampler.uniform(numbers + dimension::LIGHT_CHOICE),
                sampler.uniform(numbers + dimension::SPARE),
            ];
            let uniform = sampler.uniform_2d(numbers + dimension::LIGHT_UV);
            let light = world
                .emitters
                .sample(&world.scene().meshes, &surface, choice, uniform);
            end.light = light.and_then(|light| {
                let cosine = normal.dot(light.direction);
                let weight = light
                    .density
                    .map_or(1.0, |density| power_heuristic(density, cosine * FRAC_1_PI));
                (cosine > 0.0).then(|| Light {
                    shadow_ray: light.shadow_ray,
                    radiance: self.throughput
                        * material.diffuse
                        * light.value
                        * (FRAC_1_PI * cosine * weight),
                })
            });
        }
        if self.events + 1 == path_length && !needs.found_by_rays {
            return end;
        }
        let direction = cosine_hemisphere(normal, sampler.uniform_2d(numbers + dimension::BSDF_UV));
        let cosine = normal.dot(direction);
        if cosine <= 0.0 {
            return end;
        }
        // Lambert reflection sampled by the cosine: (albedo / π) · cos θ / (cos θ / π) = albedo.
        self.throughput *= material.diffuse;
        self.last = Some((surface.position, cosine / PI));
        self.ray = surface.ray_towards(direction);
        self.events += 1;
        end.goes_on = true;
        end
    }
}

/// Weight of a sample of density `this` where another strategy has density `other`.
#[inline]
fn power_heuristic(this: f32, other: f32) -> f32 {
    // Of the ratio, since the square of a density can overflow.
    let ratio = other / this;
    1.0 / (1.0 + ratio * ratio)
}
