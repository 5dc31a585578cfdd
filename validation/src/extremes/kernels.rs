//! T02, T04: every kernel gives the bits of the loop over all triangles, and no tree rejects what the triangle test
//! accepts.

use rayon::prelude::*;
use raywright_bvh::{Accuracy, BuildParams, Bvh, Hit, Ray, TriangleMesh, reference};

use super::{
    ExtremesError, Findings, Settings,
    errors::{UNIT, sample},
    leaks::{Aim, rays_from_inside},
    meshes,
    modes::{ACCURACIES, Sampler, ask_all, bits, cuts, label},
    overlaps,
};
use crate::{
    exact,
    hits::{Evaluation, RayKind, Rays, TriangleTestForm},
};

/// Of so many rays one is compared with all triangles.
const SLOW_SHARE: usize = 20;

/// Whether every tree promises a hit of the slow twin: where triangles are cut, the parts cover the triangle and not
/// its box, so that only hits in the triangle, at the right distance to two roundings of the margin, are promised.
fn is_promised(meshes: &[&TriangleMesh], ray: &Ray, hit: Hit, accuracy: Accuracy) -> bool {
    let corners = meshes[hit.geometry_id as usize].corners(hit.primitive_id);
    let evaluation = Evaluation::new(corners, ray, TriangleTestForm::of_ours(accuracy));
    let vertices = meshes.iter().flat_map(|mesh| mesh.vertices());
    let largest = vertices.fold(0f32, |largest, v| largest.max(v.abs().max_element()));
    let margin = (ray.origin.abs() + largest).as_dvec3() / ray.direction.abs().as_dvec3();
    let off = (f64::from(hit.t) - evaluation.t).abs();
    exact::is_met(corners, ray) && off <= 2.0 * UNIT * margin.min_element()
}

/// What was compared with the slow twin.
#[derive(Default)]
struct Twins {
    rays: usize,
    hits: usize,
    /// Hits that a tree with cut triangles does not promise and does not have.
    not_promised: usize,
}

impl Twins {
    /// Compares all trees with the loop over all triangles.
    fn compare(
        &mut self,
        what: &str,
        meshes: &[&TriangleMesh],
        rays: &[Ray],
        findings: &mut Findings,
    ) -> Result<(), ExtremesError> {
        for accuracy in ACCURACIES {
            let expected = rays
                .par_iter()
                .map(|ray| reference::closest_hit(meshes, ray, accuracy));
            let expected: Vec<Option<Hit>> = expected.collect::<Result<_, _>>()?;
            self.rays += rays.len();
            self.hits += expected.iter().flatten().count();
            let answers = ask_all(meshes, accuracy, |tree| {
                let (mut not_promised, mut fault) = (0, None);
                for (ray, &expected) in rays.iter().zip(&expected) {
                    let (got, any) = (tree.closest_hit(ray), tree.any_hit(ray));
                    if bits(got) == bits(expected) && any == expected.is_some() {
                        continue;
                    }
                    match expected {
                        Some(hit)
                            if cuts(tree.params().quality)
                                && got.is_none_or(|got| got.t >= hit.t)
                                && !is_promised(meshes, ray, hit, accuracy) =>
                        {
                            not_promised += 1;
                        }
                        _ => {
                            let label = label(tree);
                            fault.get_or_insert(format!(
                                "{what}, {label}: {ray:?} gives {got:?}, any {any}, not {expected:?}"
                            ));
                        }
                    }
                }
                (not_promised, fault)
            })?;
            for (count, fault) in answers {
                self.not_promised += count;
                findings.faults.extend(fault);
            }
        }
        Ok(())
    }

    fn tell(&self, findings: &mut Findings) {
        findings.figure("rays compared, by every tree", self.rays, "");
        findings.figure("of these hits", self.hits, "");
        findings.figure(
            "rounding noise that trees with cut triangles pass by",
            self.not_promised,
            "",
        );
        if self.not_promised > 0 {
            findings.deviates(
                "trees that cut triangles do not promise hits of rays in the plane of a triangle, which are rounding noise",
            );
        }
    }
}

/// T02.
pub(super) fn twins(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let count = (settings.rays / SLOW_SHARE).max(10);
    let mut twins = Twins::default();
    let mut sampler = Sampler::new(2);
    for width in [None, Some(1e-4)] {
        // Many triangles at once: the rays are at one each.
        let (triangles, rays): (Vec<_>, Vec<_>) =
            (0..count).map(|i| sample(&mut sampler, i, width)).unzip();
        twins.compare("random", &[&meshes::soup(&triangles)?], &rays, findings)?;
    }
    for closed in settings.closed()? {
        for aim in [Aim::Edges, Aim::Vertices] {
            let rays = rays_from_inside(&closed, aim, count, &mut sampler);
            twins.compare(closed.name, &[&closed.mesh], &rays, findings)?;
        }
    }
    let [coarse, fine] = overlaps::slanted()?;
    let rays = overlaps::rays_from_above(count, &mut sampler);
    twins.compare("coplanar", &[&coarse, &fine], &rays, findings)?;
    twins.tell(findings);
    findings.deviates(
        "not tested with subnormals flushed to zero: Rust has no such state, and to set it needs unsafe code",
    );
    Ok(())
}

/// T04.
pub(super) fn closure(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let count = (settings.rays / SLOW_SHARE / RayKind::ALL.len()).max(4);
    let mut twins = Twins::default();
    let mut all: Vec<(String, TriangleMesh)> = Vec::new();
    for closed in settings.closed()? {
        all.push((closed.name.to_owned(), closed.mesh));
    }
    for width in [1e-3, 1e-5, 1e-7] {
        all.push((format!("strip of {width:e}"), meshes::strip(width, 1000)?));
    }
    all.push(("grid".to_owned(), meshes::grid(64)?));
    all.push(("soup".to_owned(), meshes::random_soup(2000, 4)?));
    all.push(("series".to_owned(), meshes::series(1.0, 0.5, 90)?));
    for (name, mesh) in &all {
        let tree = Bvh::build(&[mesh], &BuildParams::default())?;
        let mut rays = Rays::new(mesh, &tree, 4);
        let rays: Vec<Ray> = RayKind::ALL
            .into_iter()
            .flat_map(|kind| rays.of(kind, count))
            .collect();
        twins.compare(name, &[mesh], &rays, findings)?;
    }
    twins.tell(findings);
    Ok(())
}
