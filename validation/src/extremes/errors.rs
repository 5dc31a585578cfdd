//! T01: the errors of distances and weights, of every kernel, within their bounds.

use raywright_bvh::{Accuracy, BuildParams, BuildWorkspace, Bvh, Hit, Ray, Vec3};

use super::{
    ExtremesError, Findings, Settings, meshes,
    modes::{ACCURACIES, Sampler, bits, isas, label, name},
};
use crate::hits::{Evaluation, TriangleTestForm};

/// Rounding of f32, the unit of errors in reports.
pub(super) const UNIT: f64 = 1.0 / (1 << 24) as f64;

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
pub(super) fn sample(sampler: &mut Sampler, index: usize, width: Option<f32>) -> ([Vec3; 3], Ray) {
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
        let exact = Evaluation::new(corners, ray, TriangleTestForm::of_ours(accuracy));
        // What lies behind, or just before it, is no hit of either.
        if exact.t.is_nan() || exact.t_range[0] <= 0.0 {
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
                let [from, to] = exact.t_range;
                let t_is_off = !(from..=to).contains(&f64::from(hit.t));
                let off = t_is_off || u.abs().max(v.abs()) > exact.uv_bound;
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
