//! A tree over boxes of the caller's: first box, any box, or all intervals in which a ray is inside
//! a box. A volume raycaster builds one over the blocks of voxels that are not empty and marches
//! through the intervals alone (Knoll, Thelen, Wald, Hansen, Hagen, Papka, *Full-Resolution
//! Interactive CPU Volume Rendering with Coherent BVH Traversal*, PacificVis 2011, does so with a
//! tree of its own).
//!
//! Invariant: an interval is a function of the ray and the box, and of the largest coordinate of all
//! boxes, by which they are scaled; no build parameter and no instruction set changes a bit of it.

use crate::{
    any_tree::for_width,
    bounds::Aabb,
    build::{self, BuildWorkspace, primitive::PrimitiveRef, recursion::NoCorners},
    bvh::scale_of,
    error::BuildError,
    layout::{
        box_block::{BoxBlock, Boxes, scaled},
        emit::Source,
        spares::Spares,
        tree::Tree,
    },
    mesh::TriangleMesh,
    params::BuildParams,
    ray::Ray,
    simd::{Isa, dispatch},
    stats::TreeStats,
    traverse::{
        box_test::BoxTest,
        kernel::Candidate,
        setup::{RaySetup, Unprepared},
    },
};

/// Where a ray is inside a box.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct BoxHit {
    /// Distance of entry in units of the ray's direction: `t_min` if it starts inside.
    pub t_enter: f32,
    /// Distance of exit: `t_max` if it ends inside.
    pub t_exit: f32,
    /// Which box.
    pub index: u32,
}

/// A bounding volume hierarchy over boxes.
///
/// Intervals are conservative: each contains the exact one, faces, edges and corners included, so
/// that no ray slips between boxes that touch. They are wider by at most 2⁻²⁰ of (the largest
/// coordinate + the distance of the origin on that axis), over the direction's component on the axis
/// that limits the interval. So a ray that passes a box nearer than that may count as touching it.
#[derive(Clone, Debug)]
pub struct BoxBvh {
    tree: BoxTree,
    scale: f32,
    bounds: Aabb,
    params: BuildParams,
    isa: Isa,
}

#[derive(Clone, Debug)]
enum BoxTree {
    Two(Tree<2, 2, BoxBlock>),
    Four(Tree<4, 2, BoxBlock>),
    Eight(Tree<8, 8, BoxBlock>),
    Sixteen(Tree<16, 16, BoxBlock>),
}

impl BoxTree {
    fn new(
        source: &Source<'_, Boxes<'_>>,
        params: &BuildParams,
        spares: &mut Spares,
    ) -> Result<Self, BuildError> {
        Ok(match params.branching_factor {
            ..=2 => Self::Two(source.emit(spares)?),
            3..=4 => Self::Four(source.emit(spares)?),
            5..=8 => Self::Eight(source.emit(spares)?),
            _ => Self::Sixteen(source.emit(spares)?),
        })
    }

    fn closest(&self, isa: Isa, ray: Unprepared<'_>) -> Option<BoxHit> {
        for_width!(self, tree =>
            dispatch::closest::<_, _, _, BoxTest, _, _>(isa, tree, ray, &mut (), BoxHit::new))
    }

    fn any(&self, isa: Isa, ray: Unprepared<'_>) -> bool {
        for_width!(self, tree => dispatch::any::<_, _, _, BoxTest, _>(isa, tree, ray, &mut ()))
    }

    fn all(&self, isa: Isa, ray: &RaySetup, visit: impl FnMut(Candidate)) {
        for_width!(self, tree => dispatch::all::<_, _, _, BoxTest>(isa, tree, ray, visit));
    }

    fn visit(&self, isa: Isa, ray: &RaySetup, meet: &mut dyn FnMut(&Candidate) -> f32) {
        for_width!(self, tree => dispatch::visit::<_, _, _, BoxTest>(isa, tree, ray, meet));
    }

    fn recycle(self, spares: &mut Spares) {
        for_width!(self, tree => tree.recycle(spares));
    }

    fn stats(&self, params: &BuildParams) -> TreeStats {
        for_width!(self, tree => TreeStats::of(tree, params))
    }
}

impl BoxBvh {
    /// Builds a tree over `boxes`; the place in the slice is a box's index. Boxes may be flat or
    /// points, and may overlap. No boxes are a tree that no ray hits. Boxes are never cut, and
    /// `leaf_format` and `accuracy`, which tell how triangles are stored and tested, have no
    /// meaning for them.
    ///
    /// # Errors
    /// [`BuildError::InvalidBox`] for the first box that is empty or not finite; otherwise as
    /// [`Bvh::build`](crate::Bvh::build).
    pub fn build(
        boxes: &[Aabb],
        params: &BuildParams,
        workspace: &mut BuildWorkspace,
    ) -> Result<Self, BuildError> {
        params.validate().map_err(BuildError::Parameters)?;
        let bounds = check(boxes)?;
        let scale = scale_of(&bounds)?;
        workspace.begin(boxes.len(), params)?;
        workspace.references.extend(
            (0..)
                .zip(boxes)
                .map(|(index, bounds)| PrimitiveRef::new(scaled(bounds, scale), 0, index)),
        );
        let root = build::build(workspace, None::<NoCorners>, params)?;
        let source = Source {
            root,
            records: &workspace.records,
            leaves: &workspace.leaves,
            primitives: Boxes { boxes, scale },
        };
        let tree = BoxTree::new(&source, params, &mut workspace.spares)?;
        workspace.end(params);
        Ok(Self {
            tree,
            scale,
            bounds,
            params: *params,
            isa: Isa::best(),
        })
    }

    /// Gives up the tree for its memory, as [`Bvh::recycle`](crate::Bvh::recycle).
    pub fn recycle(self, workspace: &mut BuildWorkspace) {
        let Self { tree, params, .. } = self;
        workspace.keep_parts(&params, |spares| tree.recycle(spares));
    }

    /// The same tree, traced by the kernels of another instruction set. `None` if this machine
    /// does not have it.
    #[must_use]
    pub fn with_isa(self, isa: Isa) -> Option<Self> {
        isa.is_available().then_some(Self { isa, ..self })
    }

    /// The box that a ray enters first; of those that it enters at the same distance (all in which
    /// it starts, say) the one with the lowest index. A ray that is not finite, has no direction or
    /// an empty interval enters none.
    #[must_use]
    pub fn closest_hit(&self, ray: &Ray) -> Option<BoxHit> {
        self.tree.closest(self.isa, self.unprepared(ray))
    }

    /// Whether a ray enters any box.
    #[must_use]
    pub fn any_hit(&self, ray: &Ray) -> bool {
        self.tree.any(self.isa, self.unprepared(ray))
    }

    /// Fills `hits` with all boxes that a ray enters, by distance of entry, then by index. What
    /// `hits` held before is dropped; its memory is kept, for use with the next ray.
    pub fn intervals(&self, ray: &Ray, hits: &mut Vec<BoxHit>) {
        hits.clear();
        if let Some(setup) = RaySetup::new(ray, self.scale) {
            self.tree.all(self.isa, &setup, |candidate| {
                hits.push(BoxHit::new(&candidate, &setup));
            });
            hits.sort_unstable_by(BoxHit::order);
        }
    }

    /// A ray that its kernels prepare.
    fn unprepared<'a>(&self, ray: &'a Ray) -> Unprepared<'a> {
        let scale = self.scale;
        Unprepared { ray, scale }
    }

    /// A ray in the space of the tree; `None` if it can enter nothing.
    pub(crate) fn setup(&self, ray: &Ray) -> Option<RaySetup> {
        RaySetup::new(ray, self.scale)
    }

    /// Visits the boxes that a ray of [`Self::setup`] enters, about in the order of entry. `meet`
    /// is given entry and exit, scaled, and tells up to which distance of entry others are still of
    /// interest.
    pub(crate) fn visit(&self, ray: &RaySetup, meet: &mut dyn FnMut(&Candidate) -> f32) {
        self.tree.visit(self.isa, ray, meet);
    }

    /// The smallest box around all boxes; empty if there are none.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// What it was built with.
    #[must_use]
    pub fn params(&self) -> &BuildParams {
        &self.params
    }

    /// Which instruction set traces it.
    #[must_use]
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// Counts, depth, cost and bytes, found by walking through the tree.
    #[must_use]
    pub fn stats(&self) -> TreeStats {
        self.tree.stats(&self.params)
    }
}

impl BoxHit {
    /// The hit in the caller's units.
    pub(crate) fn new(candidate: &Candidate, setup: &RaySetup) -> Self {
        Self {
            // Which of two zeros is the larger is up to the instruction set.
            t_enter: setup.unscaled(candidate.t) + 0.0,
            t_exit: setup.unscaled(candidate.u) + 0.0,
            index: candidate.id,
        }
    }

    pub(crate) fn order(&self, other: &Self) -> std::cmp::Ordering {
        (self.t_enter.total_cmp(&other.t_enter)).then(self.index.cmp(&other.index))
    }
}

/// The parts `(t_enter, t_exit)` of a ray that are inside at least one box, in order and apart from
/// each other. `hits` is what [`BoxBvh::intervals`] gives.
pub fn segments(hits: &[BoxHit]) -> impl Iterator<Item = (f32, f32)> + '_ {
    let mut rest = hits;
    std::iter::from_fn(move || {
        let (first, others) = rest.split_first()?;
        let (mut exit, mut used) = (first.t_exit, 0);
        while let Some(next) = others.get(used).filter(|next| next.t_enter <= exit) {
            exit = exit.max(next.t_exit);
            used += 1;
        }
        rest = &others[used..];
        Some((first.t_enter, exit))
    })
}

/// The box around all; an error for the first that is empty or not finite, or if there are too many.
pub(crate) fn check(boxes: &[Aabb]) -> Result<Aabb, BuildError> {
    const LIMIT: usize = TriangleMesh::MAX_TRIANGLES;
    if boxes.len() > LIMIT {
        return Err(BuildError::TreeTooLarge {
            parts: "boxes",
            count: boxes.len(),
            limit: LIMIT,
        });
    }
    let mut all = Aabb::EMPTY;
    for (index, bounds) in boxes.iter().enumerate() {
        if bounds.is_empty() || !bounds.min.is_finite() || !bounds.max.is_finite() {
            return Err(BuildError::InvalidBox { index });
        }
        all = all.union(*bounds);
    }
    Ok(all)
}
