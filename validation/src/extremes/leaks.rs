//! T03, T05, T06: rays from strictly inside a closed mesh hit it, wherever they aim. A ray that hits nothing is a leak,
//! and needs no oracle but the topology. Embree's counts are those of its scenes of low quality, the worst of three.

use std::collections::BTreeSet;

use raywright_bvh::{Accuracy, Bvh, Ray, Vec3};

use super::{
    ExtremesError, Findings, Settings,
    meshes::{self, ClosedMesh},
    modes::{ACCURACIES, Sampler, ask_all, label, name},
};

/// Where rays aim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Aim {
    Anywhere,
    /// Along an axis, from a lattice of sixteenths, with zeros of both signs.
    Axes,
    /// At a point of an edge, as exactly as f32 has it.
    Edges,
    /// At a vertex.
    Vertices,
}

/// Rays from inside a mesh.
pub(super) fn rays_from_inside(
    closed: &ClosedMesh,
    aim: Aim,
    count: usize,
    sampler: &mut Sampler,
) -> Vec<Ray> {
    let mut ray = |index: usize| {
        let from = sampler.within(closed.inside);
        match aim {
            Aim::Anywhere => Ray::new(from, sampler.vector()),
            Aim::Axes => {
                let mut direction = Vec3::ZERO;
                for axis in 0..3 {
                    direction[axis] = if sampler.unit() < 0.5 { 0.0 } else { -0.0 };
                }
                direction[index % 3] = if sampler.unit() < 0.5 { 1.0 } else { -1.0 };
                Ray::new((from * 16.0).round() / 16.0, direction)
            }
            Aim::Edges => {
                let [a, b, _] = sampler.triangle(&closed.mesh);
                Ray::new(from, a + sampler.unit() * (b - a) - from)
            }
            Aim::Vertices => {
                let [vertex, ..] = sampler.triangle(&closed.mesh);
                Ray::new(from, vertex - from)
            }
        }
    };
    (0..count).map(&mut ray).collect()
}

/// How many rays hit nothing; of which closest hit and any hit disagree is a fault.
pub(super) fn misses(tree: &Bvh, rays: &[Ray]) -> (usize, Option<String>) {
    let mut count = 0;
    let mut fault = None;
    for ray in rays {
        let is_hit = tree.closest_hit(ray).is_some();
        count += usize::from(!is_hit);
        if tree.any_hit(ray) != is_hit && fault.is_none() {
            fault = Some(format!(
                "closest and any hit disagree: {}, {ray:?}",
                label(tree)
            ));
        }
    }
    (count, fault)
}

/// One cell: all trees lose as many rays; the number.
fn cell(
    closed: &ClosedMesh,
    rays: &[Ray],
    accuracy: Accuracy,
    findings: &mut Findings,
) -> Result<usize, ExtremesError> {
    let answers = ask_all(&[&closed.mesh], accuracy, |tree| misses(tree, rays))?;
    let counts: BTreeSet<usize> = answers.iter().map(|&(count, _)| count).collect();
    findings.demand(counts.len() == 1, || {
        format!(
            "{}, {}: trees differ: {counts:?}",
            closed.name,
            name(accuracy)
        )
    });
    findings
        .faults
        .extend(answers.into_iter().find_map(|(_, fault)| fault));
    Ok(counts.last().copied().unwrap_or(0))
}

/// Cells of all closed meshes; `embree` has the counts of each mesh, fast and robust, of 40 000.
fn cells(
    seed: u64,
    aims: &[(Aim, [[&'static str; 2]; 3])],
    fast_may_leak: bool,
    settings: &Settings,
    findings: &mut Findings,
) -> Result<(), ExtremesError> {
    let mut sampler = Sampler::new(seed);
    for (mesh, closed) in settings.closed()?.iter().enumerate() {
        for &(aim, embree) in aims {
            let rays = rays_from_inside(closed, aim, settings.rays, &mut sampler);
            for accuracy in ACCURACIES {
                let count = cell(closed, &rays, accuracy, findings)?;
                let of = rays.len();
                findings.figure(
                    format!("{}, {}, {aim:?}", name(accuracy), closed.name).to_lowercase(),
                    format!("{count} of {of}"),
                    embree[mesh][accuracy as usize],
                );
                let must_hold = accuracy == Accuracy::Robust || !fast_may_leak;
                findings.demand(count == 0 || !must_hold, || {
                    format!(
                        "{} {} leaks {count} of {of}, {aim:?}",
                        name(accuracy),
                        closed.name
                    )
                });
            }
        }
    }
    Ok(())
}

const NONE: [[&str; 2]; 3] = [["0", "0"]; 3];

/// T03.
pub(super) fn random(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let aims = [(Aim::Anywhere, NONE), (Aim::Axes, NONE)];
    cells(3, &aims, false, settings, findings)
}

/// T05; also the diagonals of a cube's squares, which are met exactly.
pub(super) fn edges(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let aims = [(Aim::Edges, [["1253", "0"], ["3322", "0"], ["3310", "0"]])];
    cells(5, &aims, true, settings, findings)?;
    let mut sampler = Sampler::new(50);
    let closed = meshes::cube(16)?;
    let rays: Vec<Ray> = (0..settings.rays)
        .map(|_| {
            let from = (sampler.within(closed.inside) * 16.0).round() / 16.0;
            // Two corners of a diagonal are those without a right angle.
            let [a, b, c] = sampler.triangle(&closed.mesh);
            let sides = [(a, b), (b, c), (c, a)].map(|(p, q)| (p.distance_squared(q), p, q));
            let longest = sides.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
            let middle = longest.map_or(a, |(_, p, q)| 0.5 * (p + q));
            Ray::new(from, middle - from)
        })
        .collect();
    for accuracy in ACCURACIES {
        let count = cell(&closed, &rays, accuracy, findings)?;
        findings.figure(
            format!("{}, cube, exact diagonals", name(accuracy)),
            format!("{count} of {}", rays.len()),
            "",
        );
        findings.demand(count == 0 || accuracy == Accuracy::Fast, || {
            format!("robust leaks {count} at exact diagonals")
        });
    }
    Ok(())
}

/// T06.
pub(super) fn vertices(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let embree = [["7124", "368"], ["12280", "17"], ["10595", "129"]];
    cells(6, &[(Aim::Vertices, embree)], true, settings, findings)
}
