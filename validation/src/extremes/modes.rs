//! What classes are run with: both accuracies, every quality, width and leaf format, every instruction set of this
//! machine; and random numbers that are a function of the class.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use raywright_bvh::{
    Aabb, Accuracy, BuildError, BuildParams, Bvh, Hit, Isa, LeafFormat, Quality, Ray, TriangleMesh,
    Vec3,
};

use crate::{
    exact::{ExactHit, ExactTree},
    hits::{Answer, Class, Judge},
};

pub(super) const ACCURACIES: [Accuracy; 2] = [Accuracy::Fast, Accuracy::Robust];

pub(super) const QUALITIES: [Quality; 5] = [
    Quality::Morton,
    Quality::Agglomerative,
    Quality::BinnedSah,
    Quality::SpatialSplits,
    Quality::Optimized,
];

/// Those that have nodes of their own.
pub(super) const WIDTHS: [u32; 4] = [2, 4, 8, 16];

const FORMATS: [LeafFormat; 2] = [LeafFormat::Edges, LeafFormat::Compact];

pub(super) fn name(accuracy: Accuracy) -> &'static str {
    match accuracy {
        Accuracy::Fast => "fast",
        Accuracy::Robust => "robust",
    }
}

pub(super) fn with(quality: Quality, width: u32, accuracy: Accuracy) -> BuildParams {
    let mut params = BuildParams::default();
    (params.quality, params.branching_factor) = (quality, width);
    params.accuracy = accuracy;
    params.max_depth = 64;
    params.split_budget = 1.5;
    params
}

/// Every quality and width.
pub(super) fn qualities_and_widths(accuracy: Accuracy) -> Vec<BuildParams> {
    let pairs = QUALITIES
        .iter()
        .flat_map(|&q| WIDTHS.map(|width| (q, width)));
    pairs.map(|(q, width)| with(q, width, accuracy)).collect()
}

/// Every quality, width and leaf format.
fn all_params(accuracy: Accuracy) -> Vec<BuildParams> {
    let pairs = qualities_and_widths(accuracy);
    let in_format = |params: BuildParams| {
        FORMATS.map(|leaf_format| {
            let mut params = params;
            params.leaf_format = leaf_format;
            params
        })
    };
    pairs.into_iter().flat_map(in_format).collect()
}

/// Every quality, with widths and leaf formats that change from turn to turn: for what is built many times.
pub(super) fn in_turn(accuracy: Accuracy, turn: usize) -> Vec<BuildParams> {
    let chosen = QUALITIES.into_iter().enumerate().map(|(i, quality)| {
        let mut params = with(quality, WIDTHS[(turn + i) % 4], accuracy);
        params.leaf_format = FORMATS[(turn / 4 + i) % 2];
        params
    });
    chosen.collect()
}

pub(super) fn isas() -> impl Iterator<Item = Isa> {
    Isa::ALL.into_iter().filter(|isa| isa.is_available())
}

/// Asks the tree of each of `params` by every instruction set; answers in the same order.
pub(super) fn ask_each<T: Send>(
    meshes: &[&TriangleMesh],
    params: &[BuildParams],
    ask: impl Fn(&Bvh) -> T + Sync,
) -> Result<Vec<T>, BuildError> {
    let answers = params.par_iter().map(|params| {
        let tree = Bvh::build(meshes, params)?;
        let kernels = isas().filter_map(|isa| tree.clone().with_isa(isa));
        Ok(kernels.map(|tree| ask(&tree)).collect::<Vec<T>>())
    });
    let answers: Result<Vec<Vec<T>>, BuildError> = answers.collect();
    Ok(answers?.into_iter().flatten().collect())
}

/// The same of all trees of an accuracy.
pub(super) fn ask_all<T: Send>(
    meshes: &[&TriangleMesh],
    accuracy: Accuracy,
    ask: impl Fn(&Bvh) -> T + Sync,
) -> Result<Vec<T>, BuildError> {
    ask_each(meshes, &all_params(accuracy), ask)
}

/// What a tree is, for messages.
pub(super) fn label(tree: &Bvh) -> String {
    let params = tree.params();
    format!(
        "{}, {:?}, {} children, {:?}, {}",
        name(params.accuracy),
        params.quality,
        params.branching_factor,
        params.leaf_format,
        tree.isa().name()
    )
}

/// Distance and weights as bits, geometry, primitive.
pub(super) type Bits = Option<[u32; 5]>;

pub(super) fn bits(hit: Option<Hit>) -> Bits {
    hit.map(|hit| {
        let [t, u, v] = [hit.t, hit.u, hit.v].map(f32::to_bits);
        [t, u, v, hit.geometry_id, hit.primitive_id]
    })
}

/// Whether triangles may be cut.
pub(super) fn cuts(quality: Quality) -> bool {
    matches!(quality, Quality::SpatialSplits | Quality::Optimized)
}

pub(super) fn answer(hit: Hit) -> Answer {
    Answer {
        t: hit.t,
        uv: [hit.u, hit.v],
        ids: [hit.geometry_id, hit.primitive_id],
    }
}

/// All exact hits of each ray, the closest first.
pub(super) fn exact_hits(meshes: &[&TriangleMesh], rays: &[Ray]) -> Vec<Vec<ExactHit>> {
    let tree = ExactTree::new(meshes);
    let hits = rays
        .par_iter()
        .map(|ray| tree.hits_until(ray, f64::INFINITY));
    hits.collect()
}

/// How many rays are of each class beside exact hits.
#[derive(Clone, Debug, Default)]
pub(super) struct Judged {
    counts: [usize; Class::ALL.len()],
    first_fault: Option<String>,
}

impl Judged {
    /// Judges what a tree of default parameters says of each ray.
    pub(super) fn new(
        meshes: &[&TriangleMesh],
        rays: &[Ray],
        exact: &[Vec<ExactHit>],
        accuracy: Accuracy,
    ) -> Result<Self, BuildError> {
        let tree = Bvh::build(meshes, &with(Quality::BinnedSah, 8, accuracy))?;
        let judge = Judge::new(meshes, accuracy);
        let mut judged = Self::default();
        for (ray, exact) in rays.iter().zip(exact) {
            let ours = tree.closest_hit(ray);
            let farthest = judge.farthest(ray, ours.map(answer));
            let near = exact.partition_point(|hit| hit.t <= farthest);
            let class = judge.class_beside_all(ray, ours.map(answer), &exact[..near]);
            judged.counts[class as usize] += 1;
            if is_fault(class, accuracy) && judged.first_fault.is_none() {
                judged.first_fault = Some(format!(
                    "{} {}: {ray:?}, ours {ours:?}, exact {:?}",
                    name(accuracy),
                    class.name(),
                    exact.first()
                ));
            }
        }
        Ok(judged)
    }

    pub(super) fn of(&self, class: Class) -> usize {
        self.counts[class as usize]
    }

    /// The first ray that is judged wrong.
    pub(super) fn first_fault(&self) -> Option<&String> {
        self.first_fault.as_ref()
    }
}

impl std::fmt::Display for Judged {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let present = Class::ALL.into_iter().filter(|&class| self.of(class) > 0);
        let present: Vec<_> = present
            .map(|class| format!("{} {}", self.of(class), class.name()))
            .collect();
        f.write_str(&present.join(", "))
    }
}

fn is_fault(class: Class, accuracy: Accuracy) -> bool {
    class == Class::Bug || (class == Class::Leak && accuracy == Accuracy::Robust)
}

/// Random numbers by a seed, which is the number of the class.
#[derive(Debug)]
pub(super) struct Sampler(Xoshiro256PlusPlus);

impl Sampler {
    pub(super) fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// In 0..1.
    pub(super) fn unit(&mut self) -> f32 {
        self.0.random()
    }

    /// In the cube −1..1.
    pub(super) fn vector(&mut self) -> Vec3 {
        2.0 * Vec3::new(self.unit(), self.unit(), self.unit()) - 1.0
    }

    pub(super) fn within(&mut self, bounds: Aabb) -> Vec3 {
        let share = Vec3::new(self.unit(), self.unit(), self.unit());
        bounds.min + share * (bounds.max - bounds.min)
    }

    pub(super) fn below(&mut self, count: usize) -> usize {
        self.0.random_range(0..count)
    }

    /// The corners of a triangle of the mesh, beginning with any of them.
    pub(super) fn triangle(&mut self, mesh: &TriangleMesh) -> [Vec3; 3] {
        let mut corners = mesh.corners(self.below(mesh.triangles().len()) as u32);
        corners.rotate_left(self.below(3));
        corners
    }

    /// A point of a triangle.
    pub(super) fn on(&mut self, [a, b, c]: [Vec3; 3]) -> Vec3 {
        let (x, y) = (self.unit().sqrt(), self.unit());
        a + x * (1.0 - y) * (b - a) + x * y * (c - a)
    }
}
