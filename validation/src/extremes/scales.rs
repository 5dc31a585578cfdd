//! T11, T12, T13: the same scenes larger, smaller, far away, and with large beside small.

use rayon::prelude::*;
use raywright_bvh::{Accuracy, BuildError, BuildParams, Bvh, Hit, Ray, TriangleMesh, Vec3};

use super::{
    ExtremesError, Findings, Settings,
    leaks::{Aim, misses, rays_from_inside},
    meshes::{self, ClosedMesh},
    modes::{
        ACCURACIES, Judged, Sampler, answer, ask_all, ask_each, bits, exact_hits, in_turn, label,
        name,
    },
};
use crate::{
    exact,
    hits::{Class, Judge},
};

/// 2^k, exactly, subnormal numbers included; 0 or infinite beyond.
fn power_of_two(k: i32) -> f32 {
    2f64.powi(k) as f32
}

/// On a lattice of 2⁻²⁰, so that no power of two that is supported makes a coordinate subnormal.
fn on_lattice(v: Vec3) -> Vec3 {
    (v * 1_048_576.0).round() / 1_048_576.0
}

fn ray_on_lattice(ray: &Ray) -> Ray {
    Ray::new(on_lattice(ray.origin), on_lattice(ray.direction))
}

/// A ray as it is in a scene of another scale: with its direction as it was, or scaled too.
fn scaled(ray: &Ray, scale: f32, with_direction: bool) -> Ray {
    let direction = if with_direction { scale } else { 1.0 };
    Ray::new(ray.origin * scale, ray.direction * direction)
}

/// Whether a hit is that at scale 1, but for the exponent of the distance.
fn is_rescaled(hit: Option<Hit>, at_one: Option<Hit>, scale: f32, with_direction: bool) -> bool {
    let factor = if with_direction { 1.0 } else { scale };
    let expected = at_one.map(|mut hit| {
        hit.t *= factor;
        hit
    });
    bits(hit) == bits(expected)
}

/// T11.
pub(super) fn scale(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    range(findings)?;
    let count = (settings.rays / 40).max(10);
    let mut sampler = Sampler::new(11);
    let mut compared = 0;
    for closed in settings.closed()? {
        let mesh = meshes::mapped(&closed.mesh, on_lattice)?;
        let closed = ClosedMesh { mesh, ..closed };
        let rays: Vec<Ray> = [Aim::Anywhere, Aim::Vertices]
            .into_iter()
            .flat_map(|aim| rays_from_inside(&closed, aim, count, &mut sampler))
            .map(|ray| ray_on_lattice(&ray))
            .collect();
        for accuracy in ACCURACIES {
            let mut params = BuildParams::default();
            params.accuracy = accuracy;
            let tree = Bvh::build(&[&closed.mesh], &params)?;
            let at_one: Vec<Option<Hit>> = rays.iter().map(|ray| tree.closest_hit(ray)).collect();
            for (turn, k) in (-100..=100).step_by(5).enumerate() {
                let scale = power_of_two(k);
                let mesh = meshes::mapped(&closed.mesh, |v| v * scale)?;
                let answers = ask_each(&[&mesh], &in_turn(accuracy, turn), |tree| {
                    let is_wrong = |(ray, at_one): &(&Ray, &Option<Hit>)| {
                        [false, true].into_iter().any(|with_direction| {
                            let hit = tree.closest_hit(&scaled(ray, scale, with_direction));
                            !is_rescaled(hit, **at_one, scale, with_direction)
                        })
                    };
                    let first = rays.iter().zip(&at_one).find(is_wrong);
                    first.map(|(ray, _)| format!("2^{k}: {ray:?}, {}", label(tree)))
                })?;
                compared += 2 * rays.len() * answers.len();
                findings.faults.extend(answers.into_iter().flatten().next());
            }
        }
        by_tens(&closed, &rays, findings)?;
    }
    findings.figure(
        "rays compared to the last bit, 2^-100 … 2^100",
        compared,
        "",
    );
    Ok(())
}

/// Powers of ten round vertices: nothing leaks, and every hit is right.
fn by_tens(
    closed: &ClosedMesh,
    rays: &[Ray],
    findings: &mut Findings,
) -> Result<(), ExtremesError> {
    for accuracy in ACCURACIES {
        let (mut leaks, mut wrong) = (0, 0);
        for (turn, k) in (-30..=30).enumerate() {
            let scale = 10f64.powi(k) as f32;
            let mesh = meshes::mapped(&closed.mesh, |v| v * scale)?;
            let scene = [&mesh];
            let judge = Judge::new(&scene, accuracy);
            let params = &in_turn(accuracy, turn)[turn % 5];
            let tree = Bvh::build(&scene, params)?;
            for ray in rays {
                for with_direction in [false, true] {
                    let ray = scaled(ray, scale, with_direction);
                    let hit = tree.closest_hit(&ray).map(answer);
                    leaks += usize::from(hit.is_none());
                    // Beside itself: whether it is right.
                    if judge.class(&ray, hit, hit) == Class::Bug {
                        wrong += 1;
                        findings.demand(wrong > 1, || {
                            format!("10^{k}, {}: {ray:?} gives {hit:?}", label(&tree))
                        });
                    }
                }
            }
        }
        let of = rays.len() * 2 * 61;
        findings.figure(
            format!(
                "{}, {}, 10^-30 … 10^30, leaks / wrong hits",
                name(accuracy),
                closed.name
            ),
            format!("{leaks} / {wrong} of {of}"),
            "right in 1e-13…1e12 fast, 1e-9…1e12 robust; beyond, wrong in silence",
        );
        findings.demand(leaks == 0 || accuracy == Accuracy::Fast, || {
            format!(
                "robust leaks {leaks} of {of} at powers of ten, {}",
                closed.name
            )
        });
    }
    Ok(())
}

/// What comes of a scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AtScale {
    Right,
    Refused,
    Wrong,
}

/// Finds the scales at which a mesh that reaches from 1 to just below 2 is traced, and those at which it is refused.
fn range(findings: &mut Findings) -> Result<(), ExtremesError> {
    let closed = meshes::icosphere(1)?;
    let mesh = meshes::mapped(&closed.mesh, on_lattice)?;
    let closed = ClosedMesh { mesh, ..closed };
    let rays = rays_from_inside(&closed, Aim::Vertices, 40, &mut Sampler::new(110));
    let rays: Vec<Ray> = rays.iter().map(ray_on_lattice).collect();
    for accuracy in ACCURACIES {
        let mut params = BuildParams::default();
        params.accuracy = accuracy;
        let tree = Bvh::build(&[&closed.mesh], &params)?;
        let at_one: Vec<_> = rays.iter().map(|ray| tree.closest_hit(ray)).collect();
        let at = |k: i32| -> AtScale {
            let scale = power_of_two(k);
            // Below the smallest number all is 0, a point, and none of our affair.
            let Ok(mesh) = meshes::mapped(&closed.mesh, |v| v * scale) else {
                return AtScale::Refused;
            };
            match Bvh::build(&[&mesh], &params) {
                Err(BuildError::CoordinateRange { .. }) => AtScale::Refused,
                Err(_) => AtScale::Wrong,
                Ok(tree) => {
                    let mut pairs = rays.iter().zip(&at_one);
                    let right = pairs.all(|(ray, &at_one)| {
                        let hit = tree.closest_hit(&scaled(ray, scale, false));
                        is_rescaled(hit, at_one, scale, false)
                    });
                    if right {
                        AtScale::Right
                    } else {
                        AtScale::Wrong
                    }
                }
            }
        };
        let scales: Vec<(i32, AtScale)> = (-149..=127).map(|k| (k, at(k))).collect();
        let right: Vec<i32> = scales
            .iter()
            .filter(|(_, what)| *what == AtScale::Right)
            .map(|&(k, _)| k)
            .collect();
        let wrong = scales.iter().find(|(_, what)| *what == AtScale::Wrong);
        findings.demand(wrong.is_none(), || {
            format!(
                "{}: at 2^{} neither right nor refused",
                name(accuracy),
                wrong.map_or(0, |w| w.0)
            )
        });
        let (Some(&low), Some(&high)) = (right.first(), right.last()) else {
            findings.demand(false, || format!("{}: right at no scale", name(accuracy)));
            continue;
        };
        findings.demand(right.len() as i32 == high - low + 1, || {
            format!("{}: right in gaps", name(accuracy))
        });
        let (low_f, high_f) = (power_of_two(low), power_of_two(high));
        findings.demand(low_f < 1e-13 && high_f > 1e12, || {
            format!("{}: narrower than Embree's range", name(accuracy))
        });
        findings.figure(
            format!("{}, supported scale; a typed error outside", name(accuracy)),
            format!("2^{low} … 2^{high} = {low_f:.1e} … {high_f:.1e}"),
            [
                "1e-13 … 1e12; hits with t = inf or NaN outside",
                "1e-9 … 1e12; hits with u = v = 0 or t = inf outside",
            ][accuracy as usize],
        );
    }
    Ok(())
}

/// T12: vertices rounded far from the origin; closed as they were, though many triangles are none.
pub(super) fn offset(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let count = (settings.rays / 40).max(10);
    let embree = [
        ["0", "0"],
        ["0", "0"],
        ["0", "0"],
        ["≤6 of 1000", "0"],
        ["≤6 of 1000", "0"],
        ["≤6 of 1000", "0"],
        ["25, 24, 44 of 1000", "0"],
        ["432, 259, 364 of 1000", "0"],
        ["415, 358, 403 of 1000", "0"],
        ["1000 each: points", "1000 each: points"],
    ];
    let offsets = [0.0, 1.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8];
    let mut sampler = Sampler::new(12);
    for (turn, (offset, embree)) in offsets.into_iter().zip(embree).enumerate() {
        let mut counts = [Vec::new(), Vec::new()];
        let mut excused = 0;
        for closed in settings.closed()? {
            let mesh = meshes::mapped(&closed.mesh, |v| v + offset)?;
            let rays: Vec<Ray> = rays_from_inside(&closed, Aim::Anywhere, count, &mut sampler)
                .into_iter()
                .map(|ray| Ray::new(ray.origin + offset, ray.direction))
                .collect();
            for accuracy in ACCURACIES {
                let params = in_turn(accuracy, turn);
                let answers = ask_each(&[&mesh], &params, |tree| misses(tree, &rays))?;
                let lost = answers.iter().map(|&(count, _)| count).max().unwrap_or(0);
                counts[accuracy as usize].push(lost);
                findings
                    .faults
                    .extend(answers.into_iter().find_map(|(_, fault)| fault));
                if accuracy == Accuracy::Robust && lost > 0 {
                    excused += excuse(&mesh, &rays, offset, findings)?;
                }
            }
        }
        for accuracy in ACCURACIES {
            let i = accuracy as usize;
            findings.figure(
                format!("{}, offset {offset:e}, misses by mesh", name(accuracy)),
                format!("{:?} of {count}", counts[i]),
                embree[i],
            );
        }
        if excused > 0 {
            findings.figure(
                format!("robust, offset {offset:e}, of these with no exact hit"),
                excused,
                "",
            );
        }
    }
    Ok(())
}

/// Of robust misses: those that exact arithmetic misses too, since the origin or the whole mesh was rounded to where
/// nothing is ahead. The others are faults.
fn excuse(
    mesh: &TriangleMesh,
    rays: &[Ray],
    offset: f32,
    findings: &mut Findings,
) -> Result<usize, ExtremesError> {
    let mut params = BuildParams::default();
    params.accuracy = Accuracy::Robust;
    let tree = Bvh::build(&[mesh], &params)?;
    let lost: Vec<&Ray> = rays
        .iter()
        .filter(|ray| tree.closest_hit(ray).is_none())
        .collect();
    let leak = lost
        .par_iter()
        .find_any(|ray| !exact::all_hits(&[mesh], ray).is_empty());
    findings.demand(leak.is_none(), || {
        format!("robust leaks at offset {offset:e}: {leak:?}")
    });
    Ok(lost.len())
}

/// T13: dust of size 1e-4 within a sphere of radius 6.4e6, in both orders.
pub(super) fn mixed(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let mut sampler = Sampler::new(13);
    let sphere = meshes::mapped(&meshes::icosphere(3)?.mesh, |v| v * 6.4e6)?;
    let triangles: Vec<[Vec3; 3]> = (0..1000)
        .map(|_| {
            let at = sampler.vector();
            [
                at,
                at + 1e-4 * sampler.vector(),
                at + 1e-4 * sampler.vector(),
            ]
        })
        .collect();
    let dust = meshes::soup(&triangles)?;
    let rays: Vec<Ray> = (0..settings.rays / 4)
        .map(|index| {
            let from = 3.0 * sampler.vector();
            let to = match index % 3 {
                0 => sampler.vector() * 6.4e6,
                _ => {
                    let triangle = sampler.triangle(&dust);
                    sampler.on(triangle)
                }
            };
            Ray::new(from, to - from)
        })
        .collect();
    for (order, scene) in [
        ("dust first", [&dust, &sphere]),
        ("sphere first", [&sphere, &dust]),
    ] {
        let exact = exact_hits(&scene, &rays);
        for accuracy in ACCURACIES {
            let judged = Judged::new(&scene, &rays, &exact, accuracy)?;
            findings.faults.extend(judged.first_fault().cloned());
            let lost = ask_all(&scene, accuracy, |tree| misses(tree, &rays).0)?;
            let lost = lost.into_iter().max().unwrap_or(0);
            findings.demand(lost == 0 || accuracy == Accuracy::Fast, || {
                format!("robust, {order}: {lost} rays leave the sphere")
            });
            findings.figure(format!("{}, {order}", name(accuracy)), judged, "");
        }
    }
    Ok(())
}
