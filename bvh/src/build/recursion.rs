//! Top-down construction of a tree with up to N children per node, by the rules of Embree 4's
//! builder for medium quality: when a range becomes a leaf, which child is divided next, how the
//! depth limit is kept.
//!
//! Invariants: the tree is a function of the references and the parameters, not of threads; every
//! reference is in exactly one leaf; no leaf has more than `max_leaf_size` references; no level is
//! deeper than `max_depth`, the root being level 1.

use glam::Vec3;

use super::{
    BuildWorkspace, LeafReference,
    binning::{self, Rounding},
    control::{CHECK_SIZE, Running},
    introsort, partition,
    primitive::{Bounds, PrimitiveRef, RangeBounds},
    record::Record,
    spatial::{self, Cutting, SpatialSplit},
    tasks,
};
use crate::{error::BuildError, params::BuildParams, simd::Isa};

/// Levels kept free below a tree built by costs, in which oversized ranges are halved.
pub(crate) const RESERVED_LEVELS: u32 = 8;

/// Levels of a binary tree that is to be collapsed: more than surface areas in the range of `f32`
/// give reason for, and below them enough to halve any number of references down to one.
const BINARY_LEVELS: u32 = 64 + BINARY_RESERVED_LEVELS;
const BINARY_RESERVED_LEVELS: u32 = u32::BITS;

/// The most children that a node can have.
pub(crate) const MAX_CHILDREN: usize = 16;

/// How primitives are found again that may be cut.
pub(crate) type NoCorners = fn(LeafReference) -> [Vec3; 3];

/// Builds the records of a tree over `workspace.references`, of which there is at least one.
/// Returns the root.
pub(crate) fn build<R: Rounding>(
    workspace: &mut BuildWorkspace,
    params: &BuildParams,
) -> Result<Record, BuildError> {
    let n = workspace.references.len();
    run::<R, NoCorners>(workspace, params, RESERVED_LEVELS, n, None)
}

/// Builds the records of a binary tree with one reference per leaf, whatever `max_depth` is: one
/// to be collapsed. `cuts` are a capacity and corners as for [`build_with_cuts`].
pub(crate) fn build_binary<R: Rounding, C>(
    workspace: &mut BuildWorkspace,
    params: &BuildParams,
    cuts: Option<(usize, C)>,
) -> Result<Record, BuildError>
where
    C: Fn(LeafReference) -> [Vec3; 3] + Sync,
{
    let n = workspace.references.len();
    let params = BuildParams {
        branching_factor: 2,
        min_leaf_size: 1,
        max_leaf_size: 1,
        max_depth: BINARY_LEVELS,
        ..*params
    };
    let corners = cuts.map(|(capacity, corners)| {
        make_room(workspace, capacity);
        corners
    });
    run::<R, C>(workspace, &params, BINARY_RESERVED_LEVELS, n, corners)
}

/// Builds the records of a tree over at most `capacity` parts of `workspace.references`, of which
/// there is at least one.
pub(crate) fn build_with_cuts<R: Rounding, C>(
    workspace: &mut BuildWorkspace,
    params: &BuildParams,
    capacity: usize,
    corners: C,
) -> Result<Record, BuildError>
where
    C: Fn(LeafReference) -> [Vec3; 3] + Sync,
{
    let n = workspace.references.len();
    make_room(workspace, capacity);
    run::<R, C>(workspace, params, RESERVED_LEVELS, n, Some(corners))
}

/// Gives references budgets for cuts, and room for what cuts make.
fn make_room(workspace: &mut BuildWorkspace, capacity: usize) {
    spatial::give_budgets(&mut workspace.references);
    // Exactly: a vector that grows on its own doubles.
    let room = capacity - workspace.references.len();
    workspace.references.reserve_exact(room);
    workspace
        .references
        .resize(capacity, workspace.references[0]);
}

fn run<R: Rounding, C>(
    workspace: &mut BuildWorkspace,
    params: &BuildParams,
    reserved_levels: u32,
    n: usize,
    corners: Option<C>,
) -> Result<Record, BuildError>
where
    C: Fn(LeafReference) -> [Vec3; 3] + Sync,
{
    let capacity = workspace.references.len();
    workspace.scratch.resize(capacity, workspace.references[0]);
    workspace.leaves.resize(capacity, LeafReference::default());
    workspace.records.resize(2 * capacity - 2, Record::UNUSED);
    let bounds = tasks::map_merge(
        &workspace.references[..n],
        &RangeBounds::of,
        &RangeBounds::merge,
    );
    let builder = Builder::<R, C> {
        running: Running::new(&workspace.control, n),
        params: params.canonical(),
        reserved_levels,
        block_shift: params.sah_block_shift(),
        isa: Isa::best(),
        cutting: corners.map(|corners| {
            Cutting::new::<R>(
                corners,
                &bounds.geometry,
                params.sah_block_shift(),
                Isa::best(),
            )
        }),
        rounding: std::marker::PhantomData,
    };
    let root = Range {
        references: &mut workspace.references,
        scratch: &mut workspace.scratch,
        leaves: &mut workspace.leaves,
        len: n,
        begin: 0,
        bounds,
    };
    let slots = Slots {
        records: &mut workspace.records,
        begin: 0,
    };
    builder.subtree(root, slots, &mut Memory::default(), 1)
}

/// A range of references, with all that belongs to it alone.
struct Range<'a> {
    /// The references, and behind them room for those that cuts make.
    references: &'a mut [PrimitiveRef],
    /// As long as `references`, between which and it large partitions go back and forth.
    scratch: &'a mut [PrimitiveRef],
    leaves: &'a mut [LeafReference],
    /// How many references there are.
    len: usize,
    /// Place of the first reference among all.
    begin: usize,
    bounds: RangeBounds,
}

/// The part of the record array that belongs to a subtree.
struct Slots<'a> {
    records: &'a mut [Record],
    begin: usize,
}

/// A way to divide a range.
enum Split {
    Object(binning::Split),
    Spatial(SpatialSplit),
}

impl Split {
    fn sah(&self) -> f32 {
        match self {
            Self::Object(split) => split.sah,
            Self::Spatial(split) => split.sah,
        }
    }
}

impl<'a> Range<'a> {
    fn len(&self) -> usize {
        self.len
    }

    fn references(&self) -> &[PrimitiveRef] {
        &self.references[..self.len]
    }

    fn room(&self) -> usize {
        self.references.len() - self.len
    }

    fn sort<R: Rounding>(&mut self) {
        let references = &mut self.references[..self.len];
        if R::LIBRARY_ORDER {
            introsort::sort(references, |a, b| a.sort_key() < b.sort_key());
        } else {
            references.sort_unstable_by_key(PrimitiveRef::sort_key);
        }
    }

    /// Parts the range at place `middle`. Room for cuts is shared by what each side may still cut.
    fn split_at(self, middle: usize, bounds: [RangeBounds; 2]) -> [Self; 2] {
        let (len, mut right_begin) = (self.len, middle);
        if self.room() > 0 {
            let (left, right) = self.references().split_at(middle);
            let left_room = spatial::room_of_left(left, right, self.room());
            // The right side moves up; only what would be overwritten has to.
            if left_room < len - middle {
                self.references.copy_within(middle..middle + left_room, len);
            } else {
                self.references.copy_within(middle..len, middle + left_room);
            }
            right_begin += left_room;
        }
        let (references, references_right) = self.references.split_at_mut(right_begin);
        let (scratch, scratch_right) = self.scratch.split_at_mut(right_begin);
        let (leaves, leaves_right) = self.leaves.split_at_mut(right_begin);
        let [left, right] = bounds;
        [
            Self {
                references,
                scratch,
                leaves,
                len: middle,
                begin: self.begin,
                bounds: left,
            },
            Self {
                references: references_right,
                scratch: scratch_right,
                leaves: leaves_right,
                len: len - middle,
                begin: self.begin + right_begin,
                bounds: right,
            },
        ]
    }

    /// Halves the range where it stands. The middle is taken of the absolute places, as Embree
    /// does, so that the parity of the first place matters.
    fn halve(self) -> [Self; 2] {
        let middle = (2 * self.begin + self.len) / 2 - self.begin;
        let (left, right) = self.references().split_at(middle);
        let bounds = [RangeBounds::of(left), RangeBounds::of(right)];
        self.split_at(middle, bounds)
    }
}

/// What is reused from range to range.
#[derive(Default)]
struct Memory {
    bins: binning::BinPair,
    spatial_bins: spatial::Bins,
}

/// Builds the subtree over a range at a level, the root being level 1.
type BuildSubtree<B> = fn(&B, Range<'_>, Slots<'_>, &mut Memory, u32) -> Result<Record, BuildError>;

struct Builder<'a, R, C> {
    running: Running<'a>,
    params: BuildParams,
    reserved_levels: u32,
    block_shift: u32,
    isa: Isa,
    /// How primitives are cut, if they are.
    cutting: Option<Cutting<C>>,
    rounding: std::marker::PhantomData<R>,
}

impl<R: Rounding, C: Fn(LeafReference) -> [Vec3; 3] + Sync> Builder<'_, R, C> {
    fn find_split(&self, range: &Range<'_>, memory: &mut Memory) -> Option<Split> {
        let (references, bounds) = (range.references(), &range.bounds);
        let object = binning::find_split::<R>(
            references,
            bounds,
            self.block_shift,
            self.isa,
            &mut memory.bins,
        );
        let Some(cutting) = self.cutting.as_ref().filter(|_| range.room() > 0) else {
            return object.map(Split::Object);
        };
        let (object_sah, overlap) = match &object {
            Some(split) => (split.sah, split.sides[0].intersection(&split.sides[1])),
            None => (f32::INFINITY, Bounds::EMPTY),
        };
        let spatial = cutting.find_split::<R>(
            references,
            range.room(),
            bounds,
            object_sah,
            &overlap,
            &mut memory.spatial_bins,
        );
        spatial.map(Split::Spatial).or(object.map(Split::Object))
    }

    /// Divides the range by a plane, or halves it in sorted order if there is none.
    fn divide<'a>(&self, mut range: Range<'a>, split: Option<Split>) -> [Range<'a>; 2] {
        let partition = match (split, &self.cutting) {
            (Some(Split::Object(split)), _) => {
                let references = &mut range.references[..range.len];
                if self.cutting.is_some() && R::LIBRARY_ORDER {
                    partition::in_place(references, |reference| split.is_left(reference))
                } else if tasks::in_pieces(range.len) {
                    let partition =
                        partition::into_buffer(references, range.scratch, &split, self.isa);
                    std::mem::swap(&mut range.references, &mut range.scratch);
                    partition
                } else {
                    partition::stable(references, range.scratch, &split, self.isa)
                }
            }
            (Some(Split::Spatial(split)), Some(cutting)) => {
                range.len = cutting.cut::<R>(range.references, range.len, &split);
                let references = &mut range.references[..range.len];
                partition::in_place(references, |reference| split.is_left::<R>(reference))
            }
            _ => {
                range.sort::<R>();
                return range.halve();
            }
        };
        range.split_at(partition.left, partition.bounds)
    }

    fn blocks(&self, n: usize) -> f32 {
        ((n as u32 + (1 << self.block_shift) - 1) >> self.block_shift) as f32
    }

    /// Whether a leaf costs no more than dividing. A NaN on either side (a cost of 0 times the
    /// infinite cost of a missing plane) means that it does.
    fn leaf_is_cheap(&self, range: &Range<'_>, split: Option<&Split>) -> bool {
        let area = range.bounds.geometry.half_area();
        let sah = split.map_or(f32::INFINITY, Split::sah);
        let leaf_cost = self.params.intersection_cost * (area * self.blocks(range.len()));
        let split_cost = self.params.traversal_cost * area + self.params.intersection_cost * sah;
        leaf_cost <= split_cost
    }

    /// The subtree over a range at a level, the root being level 1.
    fn subtree(
        &self,
        mut range: Range<'_>,
        slots: Slots<'_>,
        memory: &mut Memory,
        level: u32,
    ) -> Result<Record, BuildError> {
        let n = range.len();
        if n >= CHECK_SIZE {
            self.running.check()?;
        }
        let at_limit = level + self.reserved_levels >= self.params.max_depth;
        if n <= self.params.min_leaf_size as usize || at_limit {
            range.sort::<R>();
            return self.leaf_phase(range, slots, memory, level);
        }
        let split = self.find_split(&range, memory);
        if n <= self.params.max_leaf_size as usize && self.leaf_is_cheap(&range, split.as_ref()) {
            range.sort::<R>();
            return self.leaf_phase(range, slots, memory, level);
        }
        let bounds = range.bounds;
        let mut children = Children::new(self.divide(range, split));
        while children.len() < self.params.branching_factor as usize {
            // The largest box first; ties keep the older child.
            let Some(largest) = children.best(
                |c| c.len() > self.params.min_leaf_size as usize,
                |c| c.bounds.geometry.half_area(),
            ) else {
                break;
            };
            let child = children.take(largest);
            let split = self.find_split(&child, memory);
            let [left, right] = self.divide(child, split);
            children.put(largest, left);
            children.push(right);
        }
        children.sort_by_descending_size();
        self.node(&bounds, children, slots, memory, level, Self::subtree)
    }

    /// Leaves, and halving without regard to cost where too many references are left. The
    /// references of the range are sorted.
    fn leaf_phase(
        &self,
        range: Range<'_>,
        slots: Slots<'_>,
        memory: &mut Memory,
        level: u32,
    ) -> Result<Record, BuildError> {
        let n = range.len();
        let max_leaf_size = self.params.max_leaf_size as usize;
        if level > self.params.max_depth {
            return Err(depth_error(&self.params, n, level));
        }
        if n <= max_leaf_size {
            let cuts = self.cutting.is_some();
            for (leaf, reference) in range.leaves.iter_mut().zip(&range.references[..n]) {
                *leaf = if cuts {
                    reference.cut_leaf_reference()
                } else {
                    reference.leaf_reference()
                };
            }
            return Ok(Record::leaf(&range.bounds.geometry, range.begin, n));
        }
        let bounds = range.bounds;
        let mut children = Children::new(range.halve());
        while children.len() < self.params.branching_factor as usize {
            let Some(largest) = children.best(|c| c.len() > max_leaf_size, |c| c.len() as f32)
            else {
                break;
            };
            let [left, right] = children.take(largest).halve();
            children.put_last_at(largest);
            children.push(left);
            children.push(right);
        }
        self.node(&bounds, children, slots, memory, level, Self::leaf_phase)
    }

    /// Builds the children, at the same time where they are large, and records their node.
    fn node(
        &self,
        bounds: &RangeBounds,
        children: Children<'_>,
        slots: Slots<'_>,
        memory: &mut Memory,
        level: u32,
        build: BuildSubtree<Self>,
    ) -> Result<Record, BuildError> {
        let (own, mut rest) = slots.records.split_at_mut(children.len());
        let mut rest_begin = slots.begin + own.len();
        let mut jobs: [Option<(Range<'_>, Slots<'_>)>; MAX_CHILDREN] =
            [const { None }; MAX_CHILDREN];
        for (job, range) in jobs.iter_mut().zip(children.into_iter()) {
            let needed = 2 * range.references.len() - 2;
            let (records, others) = rest.split_at_mut(needed);
            *job = Some((
                range,
                Slots {
                    records,
                    begin: rest_begin,
                },
            ));
            rest = others;
            rest_begin += needed;
        }
        let count = own.len();
        let parent = jobs.iter().flatten().map(|(range, _)| range.len).sum();
        tasks::fill_from_jobs(
            &mut jobs[..count],
            own,
            memory,
            &|(range, _): &(Range<'_>, Slots<'_>)| range.len,
            &|(range, slots), memory| {
                let n = range.len;
                build(self, range, slots, memory, level + 1)
                    .inspect(|_| self.running.finished(n, parent))
            },
        )?;
        Ok(Record::inner(&bounds.geometry, slots.begin, own))
    }
}

/// Why `n` references do not fit below a level, and how many levels would surely be needed.
pub(crate) fn depth_error(params: &BuildParams, n: usize, level: u32) -> BuildError {
    let mut needed = level;
    let mut capacity = u64::from(params.max_leaf_size);
    while capacity < n as u64 {
        capacity *= u64::from(params.branching_factor);
        needed += 1;
    }
    BuildError::DepthLimit {
        max_depth: params.max_depth,
        needed,
    }
}

/// The children of the node that is being made: at most [`MAX_CHILDREN`], without allocation.
struct Children<'a> {
    ranges: [Option<Range<'a>>; MAX_CHILDREN],
    len: usize,
}

impl<'a> Children<'a> {
    fn new([left, right]: [Range<'a>; 2]) -> Self {
        let mut children = Self {
            ranges: [const { None }; MAX_CHILDREN],
            len: 0,
        };
        children.push(left);
        children.push(right);
        children
    }

    fn len(&self) -> usize {
        self.len
    }

    fn push(&mut self, range: Range<'a>) {
        self.ranges[self.len] = Some(range);
        self.len += 1;
    }

    /// The child with the largest value among those that qualify; ties keep the first.
    fn best(
        &self,
        qualifies: impl Fn(&Range<'a>) -> bool,
        value: impl Fn(&Range<'a>) -> f32,
    ) -> Option<usize> {
        let mut best: Option<(usize, f32)> = None;
        for (index, range) in self.ranges.iter().enumerate() {
            if let Some(range) = range.as_ref().filter(|range| qualifies(range)) {
                let value = value(range);
                if best.is_none_or(|(_, other)| value > other) {
                    best = Some((index, value));
                }
            }
        }
        best.map(|(index, _)| index)
    }

    /// Takes a child out; its place must be filled again.
    fn take(&mut self, index: usize) -> Range<'a> {
        self.ranges[index]
            .take()
            .expect("`best` names a child that is there")
    }

    fn put(&mut self, index: usize, range: Range<'a>) {
        self.ranges[index] = Some(range);
    }

    /// Moves the last child into the empty place `index` (which may be the last itself).
    fn put_last_at(&mut self, index: usize) {
        self.len -= 1;
        if index != self.len {
            self.ranges[index] = self.ranges[self.len].take();
        }
    }

    fn sort_by_descending_size(&mut self) {
        self.ranges[..self.len]
            .sort_by_key(|range| std::cmp::Reverse(range.as_ref().map_or(0, Range::len)));
    }

    fn into_iter(self) -> impl Iterator<Item = Range<'a>> {
        self.ranges.into_iter().flatten()
    }
}
