//! Our trees, by single rays and by batches of them.

use std::fmt;

use raywright_bvh::{
    Accuracy, BuildParams, Bvh, Isa, LeafFormat, Quality, Ray, RayPackets, TriangleMesh,
};

use super::engine::{Answers, Engine, Role, Trace, stored};

/// The ways in which batches are traced.
const BATCHES: [Calls; 5] = [
    Calls::Batch(4, RayPackets::Off),
    Calls::Batch(8, RayPackets::Off),
    Calls::Batch(16, RayPackets::Off),
    Calls::Batch(1, RayPackets::On),
    Calls::Batch(8, RayPackets::On),
];

/// What a ray is traced through. Where the width is not said, it is that of [`TreeKind::same`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TreeKind {
    /// Binned SAH by Embree's rules, with eight children.
    AsEmbree,
    /// Binned SAH collapsed at least cost, with so many children.
    Binned(u32),
    /// Binned SAH with eight children by the kernels for AVX2.
    Avx2,
    SpatialSplits,
    /// Reinsertion and collapse at least cost, with so many children.
    Optimized(u32),
    Robust,
    Compact,
}

/// How a tree is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Calls {
    /// A call for each ray.
    Single,
    /// A call for many, with so many of them in flight, and neighbours together or not.
    Batch(u32, RayPackets),
}

/// A tree and how it is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ours {
    pub(crate) tree: TreeKind,
    pub(crate) calls: Calls,
}

impl TreeKind {
    /// The kind of tree that Embree's medium is, with as many children as one register holds.
    pub(crate) fn same() -> Self {
        match Isa::best() {
            Isa::Avx512 => Self::Binned(16),
            _ => Self::Binned(8),
        }
    }

    fn params(self) -> BuildParams {
        match self {
            Self::Binned(children) => BuildParams::least_cost(children),
            Self::Avx2 => BuildParams::least_cost(8),
            Self::AsEmbree => BuildParams::embree_scene_medium(),
            Self::SpatialSplits => {
                let mut params = Self::same().params();
                params.quality = Quality::SpatialSplits;
                params
            }
            Self::Optimized(children) => {
                let mut params = BuildParams::least_cost(children);
                params.quality = Quality::Optimized;
                params.split_budget = 1.1;
                params
            }
            Self::Robust => {
                let mut params = Self::same().params();
                params.accuracy = Accuracy::Robust;
                params
            }
            Self::Compact => {
                let mut params = Self::same().params();
                params.leaf_format = LeafFormat::Compact;
                params
            }
        }
    }

    /// Whether it is also traced by batches.
    fn takes_batches(self) -> bool {
        matches!(self, Self::Binned(_) | Self::Optimized(_))
    }
}

impl Ours {
    pub(crate) fn single(tree: TreeKind) -> Self {
        Self {
            tree,
            calls: Calls::Single,
        }
    }

    /// Whether the automatic choice may take it: it gives what Embree's medium gives, by the
    /// kernels that the machine's user has.
    pub(crate) fn can_be_chosen(self) -> bool {
        matches!(
            self.tree,
            TreeKind::AsEmbree
                | TreeKind::Binned(_)
                | TreeKind::SpatialSplits
                | TreeKind::Optimized(_)
        )
    }
}

impl fmt::Display for Ours {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.tree {
            TreeKind::AsEmbree => write!(f, "as Embree's medium"),
            TreeKind::Binned(children) => write!(f, "binned {children}"),
            TreeKind::Avx2 => write!(f, "binned 8, held to AVX2"),
            TreeKind::SpatialSplits => write!(f, "spatial splits"),
            TreeKind::Optimized(children) => write!(f, "optimized {children}"),
            TreeKind::Robust => write!(f, "robust"),
            TreeKind::Compact => write!(f, "compact"),
        }?;
        match self.calls {
            Calls::Single => Ok(()),
            Calls::Batch(n, RayPackets::Off) => write!(f, ", {n} in flight"),
            Calls::Batch(1, RayPackets::On) => write!(f, ", packets"),
            Calls::Batch(n, RayPackets::On) => write!(f, ", packets, {n} in flight"),
        }
    }
}

/// All of them. A kind that cannot be built or traced here is left out, and said.
pub(crate) fn engines(mesh: &TriangleMesh) -> Vec<Engine<'static>> {
    use TreeKind::{AsEmbree, Avx2, Binned, Compact, Optimized, Robust, SpatialSplits};
    let kinds = [
        AsEmbree,
        Binned(8),
        Binned(16),
        Avx2,
        SpatialSplits,
        Optimized(8),
        Optimized(16),
        Robust,
        Compact,
    ];
    let (mut single, mut batches) = (Vec::new(), Vec::new());
    for kind in kinds {
        let tree = match Bvh::build(&[mesh], &kind.params()) {
            Ok(tree) => tree,
            Err(error) => {
                println!("without {}: {error}", Ours::single(kind));
                continue;
            }
        };
        let isa = if kind == Avx2 { Isa::Avx2 } else { tree.isa() };
        let Some(tree) = tree.with_isa(isa) else {
            println!("without {}: not on this machine", Ours::single(kind));
            continue;
        };
        let bytes = tree.stats().bytes as f64 / mesh.triangles().len() as f64;
        let engine = |calls: Calls, tracer: Box<dyn Trace>| Engine {
            role: Role::Ours(Ours { tree: kind, calls }),
            bytes_per_triangle: Some(bytes),
            tracer,
        };
        if kind.takes_batches() {
            batches.extend(BATCHES.map(|calls| engine(calls, tracer(tree.clone(), calls))));
        }
        single.push(engine(Calls::Single, tracer(tree, Calls::Single)));
    }
    single.append(&mut batches);
    single
}

/// A tree that is asked so.
fn tracer(tree: Bvh, calls: Calls) -> Box<dyn Trace> {
    match calls {
        Calls::Single => Box::new(OneByOne(tree)),
        Calls::Batch(in_flight, packets) => {
            let tree = tree.with_rays_in_flight(in_flight);
            Box::new(InBatches(tree.with_ray_packets(packets)))
        }
    }
}

struct OneByOne(Bvh);

impl Trace for OneByOne {
    fn closest(&self, rays: &[Ray], answers: &mut Answers) {
        answers.fill_closest(rays, |ray| stored(self.0.closest_hit(ray)));
    }

    fn any(&self, rays: &[Ray], answers: &mut Answers) {
        answers.fill_any(rays, |ray| self.0.any_hit(ray));
    }
}

struct InBatches(Bvh);

impl Trace for InBatches {
    fn closest(&self, rays: &[Ray], answers: &mut Answers) {
        self.0.closest_hits(rays, &mut answers.hits);
        answers.closest.clear();
        let hits = answers.hits.iter();
        answers.closest.extend(hits.map(|&hit| stored(hit)));
    }

    fn any(&self, rays: &[Ray], answers: &mut Answers) {
        self.0.any_hits(rays, &mut answers.is_hit);
    }
}
