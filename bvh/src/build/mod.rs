//! From boxes of primitives to a binary or wide tree of records, whatever the layout in memory
//! that is made of it afterwards.

use glam::Vec3;

use crate::{
    error::BuildError,
    layout::spares::Spares,
    params::{BuildParams, Quality, Rounding},
};
use binning::{AsEmbree, Exact};

mod agglomerative;
mod binary;
pub(crate) mod binning;
mod collapse;
pub(crate) mod control;
mod curve;
mod introsort;
mod morton;
pub(crate) mod partition;
pub(crate) mod primitive;
mod radix;
pub(crate) mod record;
pub(crate) mod recursion;
mod reinsertion;
mod rotations;
mod spatial;
pub(crate) mod tasks;

/// Builds the records of a tree over `workspace.references` with valid parameters. `corners` gives
/// the triangle of a primitive; without it no primitive is cut. Returns the root, if there is any.
pub(crate) fn build<C: Fn(LeafReference) -> [Vec3; 3] + Sync>(
    workspace: &mut BuildWorkspace,
    corners: Option<C>,
    params: &BuildParams,
) -> Result<Option<record::Record>, BuildError> {
    if workspace.references.is_empty() {
        return Ok(None);
    }
    // What comes before, the references, and what follows, the layout, do not ask.
    workspace.control.check()?;
    let n = workspace.references.len();
    let root = match params.rounding {
        Rounding::Exact => build_rounded::<Exact, C>(workspace, corners, params),
        Rounding::Embree => build_rounded::<AsEmbree, C>(workspace, corners, params),
    }?;
    workspace.control.check()?;
    if let Some(progress) = &workspace.control.progress {
        progress(n, n);
    }
    Ok(Some(root))
}

fn build_rounded<R: binning::Rounding, C: Fn(LeafReference) -> [Vec3; 3] + Sync>(
    workspace: &mut BuildWorkspace,
    corners: Option<C>,
    params: &BuildParams,
) -> Result<record::Record, BuildError> {
    let n = workspace.references.len();
    let capacity = params.reference_capacity(n);
    let corners = corners.filter(|_| {
        matches!(params.quality, Quality::SpatialSplits | Quality::Optimized)
            && capacity > n
            && workspace
                .references
                .iter()
                .all(|reference| reference.geometry_id() < primitive::CUT_ID_LIMIT)
    });
    match (params.quality, corners) {
        (Quality::Agglomerative, _) => agglomerative::build(workspace, params),
        (Quality::Morton, _) => morton::build::<R>(workspace, params),
        (_, corners) if params.is_collapsed() => collapsed::<R, C>(
            workspace,
            corners.map(|corners| (capacity, corners)),
            params,
        ),
        (_, Some(corners)) => {
            recursion::build_with_cuts::<R, C>(workspace, params, capacity, corners)
        }
        (_, None) => recursion::build::<R>(workspace, params),
    }
}

/// A binary tree, collapsed; optimised before, if the quality says so.
fn collapsed<R: binning::Rounding, C: Fn(LeafReference) -> [Vec3; 3] + Sync>(
    workspace: &mut BuildWorkspace,
    cuts: Option<(usize, C)>,
    params: &BuildParams,
) -> Result<record::Record, BuildError> {
    let root = recursion::build_binary::<R, C>(workspace, params, cuts)?;
    workspace.binary.load(&workspace.records, &root);
    if params.quality == Quality::Optimized {
        reinsertion::optimize(
            &mut workspace.binary,
            &mut workspace.reinsertion,
            &workspace.control,
        )?;
    }
    collapse::collapse(workspace, params)
}

/// A primitive in a leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LeafReference {
    /// Which geometry.
    pub geometry_id: u32,
    /// Which of its primitives.
    pub primitive_id: u32,
}

/// The temporary memory of a build, for reuse by the next one, and that of trees that are no longer
/// needed ([`Bvh::recycle`](crate::Bvh::recycle)).
#[derive(Debug, Default)]
pub struct BuildWorkspace {
    /// Cancellation, progress and the limit of memory of the builds in this workspace.
    pub control: control::BuildControl,
    pub(crate) references: Vec<primitive::PrimitiveRef>,
    pub(crate) scratch: Vec<primitive::PrimitiveRef>,
    pub(crate) leaves: Vec<LeafReference>,
    pub(crate) records: Vec<record::Record>,
    pub(crate) keys: Vec<u64>,
    pub(crate) keys_scratch: Vec<u64>,
    /// Number of each mesh's first vertex over all meshes, and the total at the end.
    pub(crate) first_points: Vec<u32>,
    pub(crate) spares: Spares,
    lists: recursion::Lists,
    binary: binary::BinaryTree,
    reinsertion: reinsertion::Memory,
    collapse: collapse::Memory,
    agglomerative: agglomerative::Memory,
    announced: control::Announced,
}

impl BuildWorkspace {
    /// Bytes held for the next build, those of recycled trees included.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.temporary_bytes() + self.spares.bytes()
    }

    /// Bytes held apart from those of recycled trees.
    fn temporary_bytes(&self) -> usize {
        (self.references.capacity() + self.scratch.capacity())
            * size_of::<primitive::PrimitiveRef>()
            + self.leaves.capacity() * size_of::<LeafReference>()
            + self.records.capacity() * size_of::<record::Record>()
            + (self.keys.capacity() + self.keys_scratch.capacity()) * size_of::<u64>()
            + self.first_points.capacity() * size_of::<u32>()
            + self.lists.bytes()
            + self.binary.bytes()
            + self.reinsertion.bytes()
            + self.collapse.bytes()
            + self.agglomerative.bytes()
    }
}
