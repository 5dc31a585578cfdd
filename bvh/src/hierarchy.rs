//! A tree before it gets a layout: for those who build over primitives of their own, or look at
//! what the builder does. The counterpart of Embree's `rtcBuildBVH`.
//!
//! Invariant: children, and primitives within a leaf, are in the order in which the builder made
//! them.

use glam::Vec3;

use crate::{
    bounds::Aabb,
    build::{
        self, BuildWorkspace, LeafReference,
        primitive::PrimitiveRef,
        record::{Kind, Record},
    },
    error::BuildError,
    params::BuildParams,
    stats::TreeStats,
};

/// Something to build over: a box and two ids of the caller's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BuildPrimitive {
    /// The box. A box that is not finite or not ordered gives a tree without meaning, no error.
    pub bounds: Aabb,
    /// First id; ties in leaf order are decided by it.
    pub geometry_id: u32,
    /// Second id; leaves are sorted by it.
    pub primitive_id: u32,
}

/// The corners of a primitive, for cutting it by a plane.
pub type Corners<'a> = dyn Fn(LeafReference) -> [Vec3; 3] + Sync + 'a;

/// A tree of boxes with up to `branching_factor` children per node.
#[derive(Clone, Debug, Default)]
pub struct Hierarchy {
    records: Vec<Record>,
    leaves: Vec<LeafReference>,
    root: Option<Record>,
}

/// A node or leaf of a [`Hierarchy`].
#[derive(Clone, Copy, Debug)]
pub struct HierarchyNode<'a> {
    tree: &'a Hierarchy,
    record: &'a Record,
}

impl Hierarchy {
    /// Builds a tree over `primitives`. `corners` gives the triangle of a primitive and is needed
    /// to cut primitives: without it, spatial splits build what binned SAH builds, as in Embree.
    ///
    /// # Errors
    /// [`BuildError`] if the parameters are not valid or `max_depth` is too small.
    pub fn build(
        primitives: &[BuildPrimitive],
        corners: Option<&Corners<'_>>,
        params: &BuildParams,
        workspace: &mut BuildWorkspace,
    ) -> Result<Self, BuildError> {
        params.validate().map_err(BuildError::Parameters)?;
        workspace.begin(primitives.len(), params)?;
        workspace.references.extend(
            primitives
                .iter()
                .map(|p| PrimitiveRef::new(p.bounds, p.geometry_id, p.primitive_id)),
        );
        let root = build::build(workspace, corners, params)?;
        let hierarchy = Self {
            records: workspace.records.clone(),
            leaves: workspace.leaves.clone(),
            root,
        };
        workspace.end(params);
        Ok(hierarchy)
    }

    /// The root; `None` if there are no primitives.
    #[must_use]
    pub fn root(&self) -> Option<HierarchyNode<'_>> {
        self.root
            .as_ref()
            .map(|record| HierarchyNode { tree: self, record })
    }

    /// Counts, depth, fill, cost and overlap, found by walking through the tree; costs and block
    /// size are those of `params`, and its `branching_factor` says what a full node is.
    #[must_use]
    pub fn stats(&self, params: &BuildParams) -> TreeStats {
        TreeStats::of_records(self.root.as_ref(), &self.records, &self.leaves, params)
    }
}

impl<'a> HierarchyNode<'a> {
    /// The box of all primitives below (for cut primitives: of their parts).
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.record.bounds()
    }

    /// The primitives of a leaf; `None` for an inner node.
    #[must_use]
    pub fn leaf(&self) -> Option<&'a [LeafReference]> {
        self.record
            .is_leaf()
            .then(|| &self.tree.leaves[self.record.range()])
    }

    /// The children of an inner node; none for a leaf.
    pub fn children(&self) -> impl ExactSizeIterator<Item = HierarchyNode<'a>> + use<'a> {
        let tree = self.tree;
        let records = match self.record.kind {
            Kind::Inner => &tree.records[self.record.range()],
            Kind::Leaf => &[],
        };
        records
            .iter()
            .map(move |record| HierarchyNode { tree, record })
    }
}
