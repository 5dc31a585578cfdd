//! Many paths together, ray by ray: first the next rays of all of them, then all shadow rays, so that several rays are
//! in flight at once (`raywright_bvh::Bvh::closest_hits`). After Laine, Karras, Aila, *Megakernels Considered Harmful:
//! Wavefront Path Tracing on GPUs*, 2013, on lists that fit in a cache.
//!
//! Invariant: each path finds to the last bit what it finds alone (`path`).

use raywright_bvh::Bvh;
use raywright_imaging::sampler::PixelSampler;

use super::path::Path;
use crate::{scene::Rgb, world::World};

/// Side of the squares of pixels in the order of which paths best come, so that sixteen neighbours are a packet.
pub(crate) const SQUARE: u32 = 4;

/// Follows all paths to their ends.
pub(crate) fn follow(
    world: &World,
    bvh: &Bvh,
    paths: &mut [(Path, PixelSampler)],
    path_length: u32,
) {
    let mut on_their_way: Vec<usize> = (0..paths.len()).collect();
    let (mut rays, mut hits) = (vec![], vec![]);
    let (mut shadow_rays, mut are_hit) = (vec![], vec![]);
    let mut lights: Vec<(usize, Rgb)> = vec![];
    while !on_their_way.is_empty() {
        rays.clear();
        rays.extend(on_their_way.iter().map(|&place| paths[place].0.ray));
        bvh.closest_hits(&rays, &mut hits);
        shadow_rays.clear();
        lights.clear();
        let mut hits = hits.iter();
        on_their_way.retain(|&place| {
            let (path, sampler) = &mut paths[place];
            let hit = hits.next().and_then(Option::as_ref);
            let event = path.scatter(world, hit, sampler, path_length);
            if let Some(light) = event.light {
                shadow_rays.push(light.shadow_ray);
                lights.push((place, light.radiance));
            }
            event.goes_on
        });
        bvh.any_hits(&shadow_rays, &mut are_hit);
        for (&(place, radiance), _) in lights.iter().zip(&are_hit).filter(|(_, is_hit)| !**is_hit) {
            paths[place].0.radiance += radiance;
        }
    }
}
