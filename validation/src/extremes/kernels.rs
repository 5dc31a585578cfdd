//! T01, T02, T04: the error of every kernel within its bound, its bits those of the loop over all triangles, and no
//! tree that rejects what the triangle test accepts.

use rayon::prelude::*;
use raywright_bvh::{
    Accuracy, BuildParams, BuildWorkspace, Bvh, Hit, Ray, TriangleMesh, Vec3, reference,
};

use super::{
    ExtremesError, Findings, Settings,
    leaks::{Aim, rays_from_inside},
    meshes,
    modes::{ACCURACIES, Sampler, ask_all, bits, cuts, form, isas, label, name},
    overlaps,
};
use crate::{
    exact,
    hits::{Evaluation, RayKind, Rays},
};

/// Rounding of f32, the unit of errors in reports.
pub(super) const UNIT: f64 = 1.0 / (1 << 24) as f64;

/// Of so many rays one is compared with all triangles.
const SLOW_SHARE: usize = 20;

/// p50, p99 and largest, in units of the rounding.
pub(super) fn percentiles(mut errors: Vec<f64>) -> [f64; 3] {
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let place = (share * errors.len() as f64) as usize;
        let last = errors.len().saturating_sub(1);
        errors
            .get(place.min(last))
            .map_or(0.0, |error| error / UNIT)
    };
    [at(0.5), at(0.99), at(1.0)]
}

pub(super) fn shown([p50, p99, max]: [f64; 3]) -> String {
    format!("{p50:.1} / {p99:.0} / {max:.1e}")
}

/// A triangle and a ray at a point of it, or just beside.
fn sample(sampler: &mut Sampler, index: usize, width: Option<f32>) -> ([Vec3; 3], Ray) {
    let (a, b) = (sampler.vector(), sampler.vector());
    let c = match width {
        None => sampler.vector(),
        Some(width) => a + sampler.unit() * (b - a) + width * sampler.vector(),
    };
    let (u, v) = match index % 5 {
        // Anywhere in the parallelogram, half of it outside; an edge; inside.
        0 => (sampler.unit(), sampler.unit()),
        1 => (sampler.unit(), 0.0),
        _ => {
            let (u, v) = (sampler.unit(), sampler.unit());
            if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            }
        }
    };
    let origin = 3.0 * sampler.vector();
    let target = a + u * (b - a) + v * (c - a);
    ([a, b, c], Ray::new(origin, target - origin))
}

/// What the kernels of one accuracy make of many triangles, each alone.
#[derive(Default)]
struct Errors {
    t: Vec<f64>,
    u: Vec<f64>,
    v: Vec<f64>,
    ill_conditioned: usize,
    false_misses: usize,
    false_hits: usize,
    fault: Option<String>,
}

impl Errors {
    fn add(&mut self, corners: [Vec3; 3], ray: &Ray, hit: Option<Hit>, accuracy: Accuracy) {
        let exact = Evaluation::new(corners, ray, form(accuracy));
        // What lies behind, or just before it, is no hit of either.
        if exact.t.is_nan() || exact.t <= exact.t_bound {
            return;
        }
        let ill = exact.is_ill_conditioned;
        self.ill_conditioned += usize::from(ill);
        let wrong = match hit {
            None => {
                self.false_misses += usize::from(exact.is_met);
                !ill && exact.margin() > 1.0
            }
            Some(hit) => {
                let (u, v) = (
                    f64::from(hit.u) - exact.uv[0],
                    f64::from(hit.v) - exact.uv[1],
                );
                let t = f64::from(hit.t) - exact.t;
                if exact.is_met {
                    self.t.push((t / exact.t).abs());
                    self.u.push(u.abs());
                    self.v.push(v.abs());
                } else {
                    self.false_hits += 1;
                }
                let off = t.abs() > exact.t_bound || u.abs().max(v.abs()) > exact.uv_bound;
                !ill && (off || exact.margin() < -1.0)
            }
        };
        if wrong && self.fault.is_none() {
            self.fault = Some(format!(
                "{}: beyond the bound: {corners:?}, {ray:?}, {hit:?}, exact {exact:?}",
                name(accuracy)
            ));
        }
    }
}

/// T01.
pub(super) fn bounds(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let count = settings.rays * 5 / 2;
    let embree = [
        [
            "0.9/26/4.5e4",
            "1.1/69/9.6e4",
            "1.1/73/2.1e5",
            "2297 / 4466 of 20052",
        ],
        [
            "0.8/23/3.6e4",
            "1.4/91/2.1e5",
            "1.5/100/4.5e5",
            "1225 / 6725 of 20052",
        ],
    ];
    let slivers = [
        [
            "114/1.5e4/1.5e6",
            "5.3e3/2.9e5/6.2e6",
            "",
            "2302 / 2101 of 100000",
        ],
        [
            "115/1.7e4/1.4e6",
            "8.6e3/4.3e5/7.9e6",
            "",
            "2927 / 2542 of 100000",
        ],
    ];
    for (kind, width, embree) in [("random", None, embree), ("slivers", Some(1e-4), slivers)] {
        let mut sampler = Sampler::new(1);
        let samples: Vec<_> = (0..count).map(|i| sample(&mut sampler, i, width)).collect();
        for accuracy in ACCURACIES {
            let mut errors = Errors::default();
            let mut workspace = BuildWorkspace::default();
            let mut params = BuildParams::default();
            params.accuracy = accuracy;
            for (corners, ray) in &samples {
                let mesh = meshes::soup(&[*corners])?;
                let tree = Bvh::build_in(&[&mesh], &params, &mut workspace)?;
                let hit = tree.closest_hit(ray);
                for other in isas().filter_map(|isa| tree.clone().with_isa(isa)) {
                    let other_hit = other.closest_hit(ray);
                    findings.demand(bits(other_hit) == bits(hit), || {
                        format!("{}: {ray:?} {corners:?}", label(&other))
                    });
                }
                errors.add(*corners, ray, hit, accuracy);
                tree.recycle(&mut workspace);
            }
            let title = |what: &str| format!("{}, {kind}, {what}", name(accuracy));
            let embree = embree[accuracy as usize];
            let Errors { t, u, v, .. } = errors;
            for (what, list, embree) in [
                ("error of t (relative), in 2^-24", t, embree[0]),
                ("error of u, in 2^-24", u, embree[1]),
                ("error of v, in 2^-24", v, embree[2]),
            ] {
                findings.figure(title(what), shown(percentiles(list)), embree);
            }
            let (misses, hits) = (errors.false_misses, errors.false_hits);
            findings.figure(
                title("inexact misses / hits, near edges"),
                format!("{misses} / {hits} of {count}"),
                embree[3],
            );
            findings.figure(
                title("ill-conditioned"),
                format!("{} of {count}", errors.ill_conditioned),
                "",
            );
            findings.faults.extend(errors.fault);
        }
    }
    Ok(())
}

/// Whether every tree promises a hit of the slow twin: where triangles are cut, the parts cover the triangle and not
/// its box, so that only hits in the triangle, at the right distance to two roundings of the margin, are promised.
fn is_promised(meshes: &[&TriangleMesh], ray: &Ray, hit: Hit, accuracy: Accuracy) -> bool {
    let corners = meshes[hit.geometry_id as usize].corners(hit.primitive_id);
    let evaluation = Evaluation::new(corners, ray, form(accuracy));
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
