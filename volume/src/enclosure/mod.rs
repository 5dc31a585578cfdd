//! What can be seen of a volume, enclosed by trees of the crate `bvh`: where a ray enters and leaves it.
//!
//! Two ways. The *hull* is that of Bruder, Frey, Ertl, *Real-Time Performance Prediction and Tuning for
//! Interactive Volume Raycasting*, 2016: the faces between blocks in which something can be seen and
//! those in which nothing can, here as triangles, of which a ray's first and last hit count. The
//! *segments* are all parts of a ray in such blocks, here as boxes (Knoll and others, *Full-Resolution
//! Interactive CPU Volume Rendering with Coherent BVH Traversal*, 2011).
//!
//! Invariant: no sample outside the intervals of a ray can be seen. Boxes and faces are wider than their
//! blocks by a margin that is more than any rounding, and faces reach over each other's edges by as
//! much, so that no ray slips between them.

mod boxes;
mod hull;

use raywright_bvh::{
    Accuracy, BoxBvh, BoxHit, BuildError, BuildParams, BuildWorkspace, Bvh, Ray, TreeStats,
    segments,
};

use crate::cast::view::{NEAR, RayLattice};

/// How what can be seen is enclosed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EnclosureKind {
    /// By the faces around it: one interval per ray, from the first to the last.
    Hull,
    /// By boxes: every interval of a ray.
    Segments,
}

/// How an enclosure is built. None of it changes a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct EnclosureParams {
    /// By what.
    pub kind: EnclosureKind,
    /// Cells along the edge of a block, a power of two from 4 on; 16 in the paper.
    pub block_edge: u32,
    /// How the tree is built. A hull is always traced with [`Accuracy::Robust`].
    pub build: BuildParams,
}

impl EnclosureParams {
    /// Blocks of 16³ cells, and a tree with default parameters.
    #[must_use]
    pub fn new(kind: EnclosureKind) -> Self {
        Self {
            kind,
            block_edge: 16,
            build: BuildParams::default(),
        }
    }
}

/// Why there is no enclosure.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnclosureError {
    /// The edge of blocks.
    #[error("blocks with an edge of {block_edge} cells: it must be a power of two from {least} on")]
    BlockEdge {
        /// What was asked for.
        block_edge: u32,
        /// The smallest edge.
        least: u32,
    },
    /// The tree.
    #[error(transparent)]
    Build(#[from] BuildError),
}

/// The blocks of a volume, and in which of them something can be seen.
#[derive(Clone, Debug)]
pub(crate) struct LitBlocks {
    /// Blocks along x, y, z.
    pub(crate) dims: [usize; 3],
    /// x fastest.
    pub(crate) lit: Vec<bool>,
    /// Binary logarithm of the cells along the edge of a block.
    pub(crate) shift: u32,
    /// Where there are samples, in voxels.
    pub(crate) low: [f32; 3],
    pub(crate) high: [f32; 3],
}

impl LitBlocks {
    fn at(&self, [x, y, z]: [usize; 3]) -> bool {
        self.lit[(z * self.dims[1] + y) * self.dims[0] + x]
    }

    /// Larger blocks, of which one is lit if one in it is.
    fn coarser(&self, shift: u32) -> Self {
        let by = shift - self.shift;
        let dims = self.dims.map(|n| n.div_ceil(1 << by));
        let mut lit = vec![false; dims.iter().product()];
        for (row, own) in self.lit.chunks_exact(self.dims[0]).enumerate() {
            let [y, z] = [row % self.dims[1], row / self.dims[1]];
            let start = ((z >> by) * dims[1] + (y >> by)) * dims[0];
            for (x, _) in own.iter().enumerate().filter(|(_, lit)| **lit) {
                lit[start + (x >> by)] = true;
            }
        }
        Self {
            dims,
            lit,
            shift,
            ..*self
        }
    }

    /// The borders of blocks `from..to` along an axis, wider by a margin.
    fn borders(&self, axis: usize, from: usize, to: usize, margin: f32) -> [f32; 2] {
        let low = if from == 0 {
            self.low[axis]
        } else {
            (from << self.shift) as f32
        };
        let high = ((to << self.shift) as f32).min(self.high[axis]);
        [low - margin, high + margin]
    }

    /// Whether something can be seen nearer to a place than `reach` along every axis.
    fn is_near(&self, place: [f32; 3], reach: f32) -> bool {
        let blocks: [_; 3] = std::array::from_fn(|axis| {
            let block =
                |place: f32| ((place.max(0.0) as usize) >> self.shift).min(self.dims[axis] - 1);
            block(place[axis] - reach)..=block(place[axis] + reach)
        });
        let [xs, ys, zs] = blocks;
        zs.clone()
            .any(|z| ys.clone().any(|y| xs.clone().any(|x| self.at([x, y, z]))))
    }
}

/// A tree around what can be seen.
#[derive(Clone, Debug)]
pub(crate) struct Enclosure {
    blocks: LitBlocks,
    /// By which faces and boxes are wider than blocks, in voxels.
    margin: f32,
    tree: Tree,
}

#[derive(Clone, Debug)]
enum Tree {
    Hull(Bvh),
    Segments(BoxBvh),
}

impl Enclosure {
    /// Around the lit ones of the smallest blocks there are.
    pub(crate) fn new(
        blocks: &LitBlocks,
        params: &EnclosureParams,
        workspace: &mut BuildWorkspace,
    ) -> Result<Self, EnclosureError> {
        let (block_edge, least) = (params.block_edge, 1 << blocks.shift);
        if !block_edge.is_power_of_two() || block_edge < least {
            return Err(EnclosureError::BlockEdge { block_edge, least });
        }
        let blocks = blocks.coarser(block_edge.trailing_zeros());
        // Rounding is relative to what is far away.
        let farthest = blocks.high.into_iter().fold(NEAR as f32, f32::max);
        let margin = (1.0_f32 / 64.0).max(16.0 * f32::EPSILON * farthest);
        let tree = match params.kind {
            EnclosureKind::Hull => {
                let mut build = params.build;
                build.accuracy = Accuracy::Robust;
                let mesh = hull::faces(&blocks, margin)?;
                Tree::Hull(Bvh::build_in(&[&mesh], &build, workspace)?)
            }
            EnclosureKind::Segments => {
                let boxes = boxes::boxes(&blocks, margin);
                Tree::Segments(BoxBvh::build(&boxes, &params.build, workspace)?)
            }
        };
        Ok(Self {
            blocks,
            margin,
            tree,
        })
    }

    /// Gives up the tree for its memory.
    pub(crate) fn recycle(self, workspace: &mut BuildWorkspace) {
        match self.tree {
            Tree::Hull(tree) => tree.recycle(workspace),
            Tree::Segments(tree) => tree.recycle(workspace),
        }
    }

    pub(crate) fn stats(&self) -> TreeStats {
        match &self.tree {
            Tree::Hull(tree) => tree.stats(),
            Tree::Segments(tree) => tree.stats(),
        }
    }

    /// Tells the numbers of the first and last samples of the parts of a ray in which something can be
    /// seen, in order and apart from each other: with `beside`, together with the samples beside them.
    pub(crate) fn intervals(
        &self,
        ray: &RayLattice,
        beside: bool,
        hits: &mut Vec<BoxHit>,
        mut tell: impl FnMut(f32, f32),
    ) {
        let lattice = Ray::new(ray.origin, ray.step).with_range(ray.first, ray.last);
        let whole = |enter: f32, exit: f32| {
            let (first, last) = if beside {
                (enter.floor(), exit.ceil())
            } else {
                (enter.ceil(), exit.floor())
            };
            (first.max(ray.first), last.min(ray.last))
        };
        match &self.tree {
            Tree::Hull(tree) => {
                if let Some((enter, exit)) = self.hull(tree, ray, &lattice) {
                    let (first, last) = whole(enter, exit);
                    if first <= last {
                        tell(first, last);
                    }
                }
            }
            Tree::Segments(tree) => {
                tree.intervals(&lattice, hits);
                let mut open: Option<(f32, f32)> = None;
                for (enter, exit) in segments(hits) {
                    let (first, last) = whole(enter, exit);
                    if first > last {
                        continue;
                    }
                    open = match open {
                        Some((start, end)) if first <= end + 1.0 => Some((start, end.max(last))),
                        _ => {
                            if let Some((start, end)) = open {
                                tell(start, end);
                            }
                            Some((first, last))
                        }
                    };
                }
                if let Some((start, end)) = open {
                    tell(start, end);
                }
            }
        }
    }

    /// Where a ray enters the hull first and leaves it last, in samples.
    fn hull(&self, tree: &Bvh, ray: &RayLattice, lattice: &Ray) -> Option<(f32, f32)> {
        let place = |k: f32| std::array::from_fn(|axis| k * ray.step[axis] + ray.origin[axis]);
        // Beyond the margin all faces are ahead.
        let reach = 2.0 * self.margin;
        let enter = if self.blocks.is_near(place(ray.first), reach) {
            ray.first
        } else {
            tree.closest_hit(lattice)?.t
        };
        let end = place(ray.last);
        let exit = if self.blocks.is_near(end, reach) {
            ray.last
        } else {
            let back = Ray::new(end, ray.step.map(|v| -v)).with_range(0.0, ray.last - enter);
            // Whoever only touches a face may miss it on the way back.
            tree.closest_hit(&back)
                .map_or(ray.last, |hit| ray.last - hit.t)
        };
        Some((enter, exit))
    }
}
