//! T14, T15: triangles with little area, seen nearly edge-on, and triangles with none.

use std::f32::consts::PI;

use raywright_bvh::{Accuracy, Hit, Ray, Vec3};

use super::{
    ExtremesError, Findings, Settings, meshes,
    modes::{ACCURACIES, Bits, Judged, Sampler, ask_all, bits, cuts, exact_hits, name},
};
use crate::hits::Class;

/// Triangles of a strip.
const STRIP: u32 = 1000;

/// Rays at points well within a strip: from anywhere, or at a hundredth of a degree to one to its plane.
pub(super) fn rays_at_strip(
    width: f32,
    grazing: bool,
    count: usize,
    sampler: &mut Sampler,
) -> Vec<Ray> {
    let length = 0.5 * width * STRIP as f32;
    let mut ray = || {
        let across = 0.1 + 0.8 * sampler.unit();
        let to = Vec3::new(length * (0.1 + 0.8 * sampler.unit()), across, 0.0);
        let from = if grazing {
            let slope = 10f32.powf(-2.0 * sampler.unit()).to_radians();
            let (sin, cos) = (2.0 * PI * sampler.unit()).sin_cos();
            // So far along the plane that the rounding of the direction stays within the strip.
            to + length.min(1.0) * Vec3::new(cos, sin, slope)
        } else {
            let from = sampler.vector();
            Vec3::new(from.x, from.y, 1.0 + from.z.abs())
        };
        Ray::new(from, to - from)
    };
    (0..count).map(|_| ray()).collect()
}

/// T14.
pub(super) fn slivers(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let embree = [["0", "0"], ["25", "64"], ["2634", "4988"]];
    let mut sampler = Sampler::new(14);
    for (width, embree) in [1e-3, 1e-5, 1e-7].into_iter().zip(embree) {
        let mesh = meshes::strip(width, STRIP)?;
        for grazing in [false, true] {
            let rays = rays_at_strip(width, grazing, settings.rays, &mut sampler);
            let exact = exact_hits(&[&mesh], &rays);
            for accuracy in ACCURACIES {
                let judged = Judged::new(&[&mesh], &rays, &exact, accuracy)?;
                findings.faults.extend(judged.first_fault().cloned());
                let answers = ask_all(&[&mesh], accuracy, |tree| {
                    let hits = rays.iter().map(|ray| tree.closest_hit(ray));
                    (cuts(tree.params().quality), hits.collect::<Vec<_>>())
                })?;
                let (_, first) = &answers[0];
                let pairs = || first.iter().zip(&exact);
                let missed = pairs().filter(|(ours, exact)| ours.is_none() && !exact.is_empty());
                let missed = missed.count();
                let wrong = pairs().filter(|(ours, exact)| {
                    let other =
                        |hit: Hit| exact.first().map(|e| e.primitive_id) != Some(hit.primitive_id);
                    ours.is_some_and(other)
                });
                let wrong = wrong.count();
                let uncut = answers.iter().filter(|(cut, _)| !cut);
                let differ = |hits: &[_]| {
                    let differ = hits
                        .iter()
                        .zip(first)
                        .filter(|(a, b)| bits(**a) != bits(**b));
                    differ.count()
                };
                let unlike: usize = uncut.map(|(_, hits)| differ(hits)).sum();
                findings.demand(unlike == 0, || {
                    format!(
                        "{}, width {width:e}: trees differ in {unlike} hits",
                        name(accuracy)
                    )
                });
                let cut = answers.iter().filter(|(cut, _)| *cut);
                let unlike = cut.map(|(_, hits)| differ(hits)).max().unwrap_or(0);
                if unlike > 0 {
                    findings.figure(
                        format!(
                            "{}, width {width:e}, unlike by trees with cut triangles",
                            name(accuracy)
                        ),
                        unlike,
                        "",
                    );
                }
                let title = format!(
                    "{}, width {width:e}{}",
                    name(accuracy),
                    if grazing { ", grazing" } else { "" }
                );
                let embree = if grazing {
                    ""
                } else {
                    embree[accuracy as usize]
                };
                findings.figure(
                    format!("{title}, wrong triangle"),
                    format!("{wrong} of {}", rays.len()),
                    embree,
                );
                findings.figure(
                    format!("{title}, missed"),
                    format!("{missed} of {}", rays.len()),
                    if grazing { "" } else { "0" },
                );
                if missed > 0 && accuracy == Accuracy::Robust {
                    findings.deviates("rays that begin nearer to a grazed sliver than the error of its distance can miss it, by either test");
                }
                if missed > 0 && accuracy == Accuracy::Fast {
                    findings
                        .deviates("the fast test misses slivers thinner than rounding, as Embree's does of slanted rays, though its table has none");
                }
                if judged.of(Class::IllConditioned) > 0 {
                    findings.figure(format!("{title}, judged"), &judged, "");
                }
            }
        }
    }
    findings.deviations.sort();
    findings.deviations.dedup();
    Ok(())
}

/// Triangles without area, in whole multiples of 1/16 so that this is exact: points, lines with a corner twice in each
/// order; or three corners on a line.
fn without_area(count: usize, on_line: bool, sampler: &mut Sampler) -> Vec<[Vec3; 3]> {
    let mut triangle = |index: usize| {
        let a = (4.0 * sampler.vector()).round() / 8.0;
        let step = (4.0 * sampler.vector()).round() / 16.0 + 0.5 * Vec3::X;
        let b = a + step;
        if on_line {
            return [a, a + 0.5 * step, b];
        }
        [[a, a, a], [a, a, b], [a, b, a], [b, a, a]][index % 4]
    };
    (0..count).map(&mut triangle).collect()
}

/// T15.
pub(super) fn degenerate(
    settings: &Settings,
    findings: &mut Findings,
) -> Result<(), ExtremesError> {
    let mut sampler = Sampler::new(15);
    let count = (settings.rays / 4).max(10);
    for closed in meshes::small_closed()? {
        let mesh = &closed.mesh;
        let valid: Vec<_> = (0..mesh.triangles().len() as u32)
            .map(|id| mesh.corners(id))
            .collect();
        let rays: Vec<Ray> = (0..count)
            .map(|index| {
                let from = sampler.within(closed.inside);
                // Anywhere, or at a corner that triangles without area may have.
                let direction = match index % 2 {
                    0 => sampler.vector(),
                    _ => (4.0 * sampler.vector()).round() / 8.0 - from,
                };
                Ray::new(from, direction)
            })
            .collect();
        let plain = meshes::soup(&valid)?;
        let tiny = [Vec3::ZERO, 1e-22 * Vec3::X, 1e-22 * Vec3::Y];
        let subnormal = meshes::soup(&[tiny.map(|v| v + closed.inside.min); 40])?;
        for on_line in [false, true] {
            let flat = without_area(valid.len(), on_line, &mut sampler);
            let mixed: Vec<_> = valid.iter().zip(flat).flat_map(|(&a, b)| [a, b]).collect();
            let mixed = meshes::soup(&mixed)?;
            for accuracy in ACCURACIES {
                let alone = ask_all(&[&plain], accuracy, |tree| hits(tree, &rays, 1))?;
                let among = ask_all(&[&mixed, &subnormal], accuracy, |tree| hits(tree, &rays, 2))?;
                let changed = |(alone, among): (&Vec<Bits>, &Vec<Bits>)| {
                    alone.iter().zip(among).filter(|(a, b)| a != b).count()
                };
                let changed = alone.iter().zip(&among).map(changed).max().unwrap_or(0);
                let what = if on_line {
                    "three on a line"
                } else {
                    "a corner twice"
                };
                findings.figure(
                    format!("{}, {}, {what}: hits changed", name(accuracy), closed.name),
                    format!("{changed} of {}", rays.len()),
                    "",
                );
                let is_promised = !on_line || accuracy == Accuracy::Fast;
                findings.demand(changed == 0 || !is_promised, || {
                    format!(
                        "{}, {}, {what}: {changed} hits change",
                        name(accuracy),
                        closed.name
                    )
                });
                if changed > 0 && !is_promised {
                    findings.deviates(
                        "the robust test hits triangles with three corners on a line, as thin as rounding makes them: without them their neighbours would leave a gap",
                    );
                }
            }
        }
    }
    findings.deviations.dedup();
    Ok(())
}

/// Hits with primitive ids divided by `stride`, which those of the plain mesh are.
fn hits(tree: &raywright_bvh::Bvh, rays: &[Ray], stride: u32) -> Vec<Bits> {
    let hit = |ray: &Ray| {
        bits(tree.closest_hit(ray)).map(|[t, u, v, geometry, primitive]| {
            // An odd id names a triangle without area, and becomes one that no mesh has.
            let id = if primitive % stride == 0 {
                primitive / stride
            } else {
                u32::MAX
            };
            [t, u, v, geometry, id]
        })
    };
    rays.iter().map(hit).collect()
}
