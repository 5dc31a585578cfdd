//! What robust hits cost: per triangle test and leaf format, what is lost at edges, at vertices, far away and at slivers;
//! the errors of hits; and the speed, of which only ratios within a round say anything.
//!
//! Invariant: hits are compared before anything is timed. A leaf format changes no bit.

use std::{
    hash::{DefaultHasher, Hash, Hasher},
    hint::black_box,
    time::Instant,
};

use rayon::prelude::*;
use raywright_bvh::{Accuracy, BuildError, BuildParams, Bvh, LeafFormat, Ray, TriangleMesh};

use super::{
    errors::percentiles,
    leaks::{Aim, misses, rays_from_inside},
    meshes,
    modes::{Bits, Sampler, bits},
    thin::rays_at_strip,
};
use crate::{
    exact,
    hits::{Evaluation, TriangleTestForm},
};

/// What the engine does not have, so that no row is about it.
pub const ABSENT: [(&str, &str); 1] = [(
    "quantised nodes",
    "no parameter of the tree makes them: boxes of nodes are f32",
)];

/// One triangle test with one leaf format.
#[derive(Clone, Debug)]
pub struct Row {
    /// The triangle test.
    pub accuracy: Accuracy,
    /// The leaf format.
    pub leaf_format: LeafFormat,
    /// Rays of each kind below.
    pub rays: usize,
    /// Rays at edges that are lost, of three closed meshes (T05).
    pub lost_at_edges: usize,
    /// Rays at vertices that are lost (T06).
    pub lost_at_vertices: usize,
    /// Rays that are lost where the meshes are 10⁶ from the origin (T12).
    pub lost_far_away: usize,
    /// Rays at a strip of slivers of width 10⁻⁷ that hit none, or another than the exact one (T14).
    pub wrong_at_slivers: usize,
    /// Relative errors of t and errors of u and v, of rays on random triangles: p50, p99 and largest in units of 2⁻²⁴.
    pub errors: [[f64; 3]; 3],
    /// A hash of all hits of the timed rays, to the last bit.
    pub hits: u64,
    /// Timed rays that hit another triangle than by the first row.
    pub unlike_first: usize,
    /// Million rays per second in each round.
    pub rates: Vec<f64>,
    /// Rates relative to that of the first row in the same round.
    pub ratios: Vec<f64>,
    /// Milliseconds of the fastest build of all timed meshes.
    pub build_ms: f64,
    /// Bytes of the trees over all triangles.
    pub bytes_per_triangle: f64,
}

impl Row {
    /// Smallest, median and largest ratio.
    #[must_use]
    pub fn ratio(&self) -> [f64; 3] {
        let mut sorted = self.ratios.clone();
        sorted.sort_by(f64::total_cmp);
        let at = |place: usize| sorted.get(place).copied().unwrap_or(f64::NAN);
        [
            at(0),
            at(sorted.len() / 2),
            at(sorted.len().saturating_sub(1)),
        ]
    }
}

/// A row, and the trees of the timed meshes.
struct Contender {
    row: Row,
    trees: Vec<Bvh>,
}

/// Measures all rows, with so many rays of each kind; times `rounds` rounds over the closed meshes and `scenes`.
///
/// # Errors
/// If a scene cannot be built.
pub fn measure(
    rays: usize,
    rounds: usize,
    scenes: Vec<TriangleMesh>,
) -> Result<Vec<Row>, BuildError> {
    let mut sampler = Sampler::new(1);
    let mut timed: Vec<(TriangleMesh, Vec<Ray>)> = Vec::new();
    for closed in meshes::closed()? {
        let rays = rays_from_inside(&closed, Aim::Anywhere, rays, &mut sampler);
        timed.push((closed.mesh, rays));
    }
    for mesh in scenes {
        let rays = rays_at(&mesh, rays, &mut sampler);
        timed.push((mesh, rays));
    }
    let mut contenders = Vec::new();
    for accuracy in [Accuracy::Fast, Accuracy::Robust] {
        for leaf_format in [LeafFormat::Edges, LeafFormat::Compact] {
            let mut params = BuildParams::default();
            (params.accuracy, params.leaf_format) = (accuracy, leaf_format);
            contenders.push(contender(&params, rays, &timed)?);
        }
    }
    compare(&mut contenders, &timed);
    for round in 0..rounds {
        time(&mut contenders, &timed, round);
    }
    Ok(contenders
        .into_iter()
        .map(|contender| contender.row)
        .collect())
}

/// Rays between random points of a scene.
fn rays_at(mesh: &TriangleMesh, count: usize, sampler: &mut Sampler) -> Vec<Ray> {
    if mesh.triangles().is_empty() {
        return Vec::new();
    }
    let mut point = || {
        let triangle = sampler.triangle(mesh);
        sampler.on(triangle)
    };
    (0..count)
        .map(|_| {
            let (from, to, beyond) = (point(), point(), point());
            // From the middle of two points, which is seldom on a surface.
            let from = 0.5 * (from + to);
            Ray::new(from, beyond - from)
        })
        .collect()
}

/// Builds and counts; nothing is timed but builds.
fn contender(
    params: &BuildParams,
    rays: usize,
    timed: &[(TriangleMesh, Vec<Ray>)],
) -> Result<Contender, BuildError> {
    let mut sampler = Sampler::new(2);
    let mut lost = [0; 3];
    for closed in meshes::closed()? {
        let tree = Bvh::build(&[&closed.mesh], params)?;
        for (lost, aim) in lost.iter_mut().zip([Aim::Edges, Aim::Vertices]) {
            let rays = rays_from_inside(&closed, aim, rays, &mut sampler);
            *lost += misses(&tree, &rays).0;
        }
        let far = meshes::mapped(&closed.mesh, |v| v + 1e6)?;
        let tree = Bvh::build(&[&far], params)?;
        let rays: Vec<Ray> = rays_from_inside(&closed, Aim::Anywhere, rays, &mut sampler)
            .iter()
            .map(|ray| Ray::new(ray.origin + 1e6, ray.direction))
            .collect();
        lost[2] += misses(&tree, &rays).0;
    }
    let (mut build_ms, mut trees) = (f64::INFINITY, Vec::new());
    for _ in 0..3 {
        let start = Instant::now();
        let built: Result<Vec<Bvh>, BuildError> = timed
            .iter()
            .map(|(mesh, _)| Bvh::build(&[mesh], params))
            .collect();
        trees = built?;
        build_ms = build_ms.min(1e3 * start.elapsed().as_secs_f64());
    }
    let bytes: usize = trees.iter().map(|tree| tree.stats().bytes).sum();
    let triangles: usize = timed.iter().map(|(mesh, _)| mesh.triangles().len()).sum();
    let row = Row {
        accuracy: params.accuracy,
        leaf_format: params.leaf_format,
        rays,
        lost_at_edges: lost[0],
        lost_at_vertices: lost[1],
        lost_far_away: lost[2],
        wrong_at_slivers: wrong_at_slivers(params, rays, &mut sampler)?,
        errors: errors(params, rays, &mut sampler)?,
        hits: 0,
        unlike_first: 0,
        rates: Vec::new(),
        ratios: Vec::new(),
        build_ms,
        bytes_per_triangle: bytes as f64 / triangles as f64,
    };
    Ok(Contender { row, trees })
}

fn wrong_at_slivers(
    params: &BuildParams,
    count: usize,
    sampler: &mut Sampler,
) -> Result<usize, BuildError> {
    let mesh = meshes::strip(1e-7, 1000)?;
    let tree = Bvh::build(&[&mesh], params)?;
    let rays = rays_at_strip(1e-7, false, count, sampler);
    let is_wrong = |ray: &&Ray| {
        let exact = exact::all_hits(&[&mesh], ray)
            .first()
            .map(|hit| hit.primitive_id);
        tree.closest_hit(ray).map(|hit| hit.primitive_id) != exact
    };
    Ok(rays.par_iter().filter(is_wrong).count())
}

/// Errors of hits on random triangles.
fn errors(
    params: &BuildParams,
    count: usize,
    sampler: &mut Sampler,
) -> Result<[[f64; 3]; 3], BuildError> {
    let mesh = meshes::random_soup(2000, 3)?;
    let tree = Bvh::build(&[&mesh], params)?;
    let mut errors = [Vec::new(), Vec::new(), Vec::new()];
    for _ in 0..count {
        let triangle = sampler.triangle(&mesh);
        let (from, to) = (3.0 * sampler.vector(), sampler.on(triangle));
        let ray = Ray::new(from, to - from);
        let Some(hit) = tree.closest_hit(&ray) else {
            continue;
        };
        let exact = Evaluation::new(
            mesh.corners(hit.primitive_id),
            &ray,
            TriangleTestForm::of_ours(params.accuracy),
        );
        if exact.is_met {
            errors[0].push((f64::from(hit.t) / exact.t - 1.0).abs());
            errors[1].push((f64::from(hit.u) - exact.uv[0]).abs());
            errors[2].push((f64::from(hit.v) - exact.uv[1]).abs());
        }
    }
    Ok(errors.map(percentiles))
}

/// The hits of all timed rays beside those of the first row.
fn compare(contenders: &mut [Contender], timed: &[(TriangleMesh, Vec<Ray>)]) {
    let hits = |contender: &Contender| -> Vec<Bits> {
        let pairs = contender.trees.iter().zip(timed);
        let hits =
            pairs.flat_map(|(tree, (_, rays))| rays.iter().map(|ray| bits(tree.closest_hit(ray))));
        hits.collect()
    };
    let all: Vec<Vec<Bits>> = contenders.iter().map(hits).collect();
    for (contender, hits) in contenders.iter_mut().zip(&all) {
        let triangle = |hit: &Bits| hit.map(|[_, _, _, geometry, primitive]| [geometry, primitive]);
        let pairs = hits.iter().zip(&all[0]);
        let mut hasher = DefaultHasher::new();
        hits.hash(&mut hasher);
        contender.row.hits = hasher.finish();
        contender.row.unlike_first = pairs.filter(|(a, b)| triangle(a) != triangle(b)).count();
    }
}

/// One round: every row over all rays, forwards and backwards in turn.
fn time(contenders: &mut [Contender], timed: &[(TriangleMesh, Vec<Ray>)], round: usize) {
    let mut order: Vec<usize> = (0..contenders.len()).collect();
    if round % 2 == 1 {
        order.reverse();
    }
    let rays: usize = timed.iter().map(|(_, rays)| rays.len()).sum();
    for index in order {
        let contender = &mut contenders[index];
        let start = Instant::now();
        for (tree, (_, rays)) in contender.trees.iter().zip(timed) {
            for ray in rays {
                black_box(tree.closest_hit(ray));
            }
        }
        let rate = 1e-6 * rays as f64 / start.elapsed().as_secs_f64();
        contender.row.rates.push(rate);
    }
    let first = contenders[0].row.rates[round];
    for contender in contenders {
        let rate = contender.row.rates[round];
        contender.row.ratios.push(rate / first);
    }
}
