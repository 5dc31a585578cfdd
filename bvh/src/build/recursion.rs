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
    control::Running,
    introsort, partition,
    primitive::{PrimitiveRef, RangeBounds},
    record::Record,
    spatial::{self, Cutting, SpatialSplit},
    tasks,
};
use crate::{
    error::BuildError,
    params::{BuildParams, Quality},
    simd::Isa,
};

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

/// Builds the records of a binary tree to be collapsed, whatever `max_depth` is: with one reference per leaf if it is
/// optimised before, else with the `min_leaf_size` that are not parted by a collapse anyway. `cuts` are a capacity and corners as for [`build_with_cuts`].
pub(crate) fn build_binary<R: Rounding, C>(
    workspace: &mut BuildWorkspace,
    params: &BuildParams,
    cuts: Option<(usize, C)>,
) -> Result<Record, BuildError>
where
    C: Fn(LeafReference) -> [Vec3; 3] + Sync,
{
    let n = workspace.references.len();
    let leaf_size = match params.quality {
        Quality::Optimized => 1,
        _ => params.canonical().min_leaf_size,
    };
    let params = BuildParams {
        branching_factor: 2,
        min_leaf_size: leaf_size,
        max_leaf_size: leaf_size,
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
    let root = Subtree {
        references: &mut workspace.references,
        scratch: &mut workspace.scratch,
        leaves: &mut workspace.leaves,
        records: &mut workspace.records,
        begin: 0,
        records_begin: 0,
        len: n,
        bounds,
    };
    let mut memory = Memory {
        lists: std::mem::take(&mut workspace.lists),
        ..Memory::default()
    };
    let root = builder.subtree(root, &mut memory, 1);
    // A build that failed leaves some.
    memory.lists.children.clear();
    workspace.lists = memory.lists;
    root
}

/// A range of references, and all memory that belongs to the subtree over it alone.
struct Subtree<'a> {
    /// The references, and behind them room for those that cuts make.
    references: &'a mut [PrimitiveRef],
    /// As long as `references`, between which and it large partitions go back and forth.
    scratch: &'a mut [PrimitiveRef],
    leaves: &'a mut [LeafReference],
    records: &'a mut [Record],
    /// Place of the first reference among all.
    begin: usize,
    /// Place of the first record among all.
    records_begin: usize,
    /// How many references there are.
    len: usize,
    bounds: RangeBounds,
}

/// A part of the range of a subtree: a child of the node that is being made.
#[derive(Clone, Copy, Debug)]
struct Span {
    /// Place of the first reference within the subtree.
    first: usize,
    len: usize,
    /// How many references there is room for.
    capacity: usize,
    /// Whether the references are in the scratch memory.
    in_scratch: bool,
    bounds: RangeBounds,
}

impl Subtree<'_> {
    fn span(&self) -> Span {
        Span {
            first: 0,
            len: self.len,
            capacity: self.references.len(),
            in_scratch: false,
            bounds: self.bounds,
        }
    }

    fn references(&self, span: &Span) -> &[PrimitiveRef] {
        let memory = if span.in_scratch {
            &*self.scratch
        } else {
            &*self.references
        };
        &memory[span.first..span.first + span.len]
    }

    /// The memory of a span, references first.
    fn memory(&mut self, span: &Span) -> [&mut [PrimitiveRef]; 2] {
        let range = span.first..span.first + span.capacity;
        let (references, scratch) = (
            &mut self.references[range.clone()],
            &mut self.scratch[range],
        );
        if span.in_scratch {
            [scratch, references]
        } else {
            [references, scratch]
        }
    }

    fn sort<R: Rounding>(&mut self, span: &Span) {
        let references = &mut self.memory(span)[0][..span.len];
        if R::LIBRARY_ORDER {
            introsort::sort(references, |a, b| a.sort_key() < b.sort_key());
        } else {
            references.sort_unstable_by_key(PrimitiveRef::sort_key);
        }
    }

    /// Parts a span behind `left` references. Room for cuts is shared by what each side may still
    /// cut.
    fn part(&mut self, span: &Span, left: usize, bounds: [RangeBounds; 2]) -> [Span; 2] {
        let (len, room) = (span.len, span.capacity - span.len);
        let mut right_first = left;
        if room > 0 {
            let [references, _] = self.memory(span);
            let (left_side, right_side) = references[..len].split_at(left);
            let left_room = spatial::room_of_left(left_side, right_side, room);
            // The right side moves up; only what would be overwritten has to.
            if left_room < len - left {
                references.copy_within(left..left + left_room, len);
            } else {
                references.copy_within(left..len, left + left_room);
            }
            right_first += left_room;
        }
        [
            Span {
                len: left,
                capacity: right_first,
                bounds: bounds[0],
                ..*span
            },
            Span {
                first: span.first + right_first,
                len: len - left,
                capacity: span.capacity - right_first,
                bounds: bounds[1],
                ..*span
            },
        ]
    }

    /// Halves a span where it stands. The middle is taken of the absolute places, as Embree does,
    /// so that the parity of the first place matters.
    fn halve(&mut self, span: &Span) -> [Span; 2] {
        let begin = self.begin + span.first;
        let middle = (2 * begin + span.len) / 2 - begin;
        let (left, right) = self.references(span).split_at(middle);
        let bounds = [RangeBounds::of(left), RangeBounds::of(right)];
        self.part(span, middle, bounds)
    }
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

/// What is reused from range to range.
#[derive(Default)]
struct Memory {
    bins: binning::BinPair,
    spatial_bins: spatial::Bins,
    lists: Lists,
}

/// What of it is on the heap, and is reused from build to build.
#[derive(Debug, Default)]
pub(crate) struct Lists {
    /// The children of all nodes that are being made, those of the deepest node last. Here and not
    /// on the stack, which a deep tree would else exhaust.
    children: Vec<Span>,
    /// How many references of each piece of a range go to the left.
    lefts: Vec<usize>,
}

impl Lists {
    pub(crate) fn bytes(&self) -> usize {
        self.children.capacity() * size_of::<Span>() + self.lefts.capacity() * size_of::<usize>()
    }

    /// Bytes that they take over `n` references, at most. The children of one node per level are
    /// there at a time; those that are not divided have references of their own, and none is divided
    /// without a sibling. A vector doubles when it grows.
    pub(crate) fn bytes_needed(n: usize, params: &BuildParams) -> usize {
        const SMALLEST_VECTOR: usize = 4;
        let [width, levels] = match params.quality {
            Quality::Morton | Quality::Agglomerative => return 0,
            _ if params.is_collapsed() => [2, BINARY_LEVELS],
            _ => [params.branching_factor, params.max_depth],
        };
        let children = n.saturating_mul(2).min(width as usize * levels as usize);
        2 * children.max(SMALLEST_VECTOR) * size_of::<Span>()
            + n.div_ceil(tasks::PIECE_SIZE) * size_of::<usize>()
    }
}

impl Memory {
    /// The child from `base` on with the largest value among those that qualify; ties keep the
    /// first.
    fn best(
        &self,
        base: usize,
        qualifies: impl Fn(&Span) -> bool,
        value: impl Fn(&Span) -> f32,
    ) -> Option<usize> {
        let mut best: Option<(usize, f32)> = None;
        for (index, span) in self.lists.children.iter().enumerate().skip(base) {
            if qualifies(span) {
                let value = value(span);
                if best.is_none_or(|(_, other)| value > other) {
                    best = Some((index, value));
                }
            }
        }
        best.map(|(index, _)| index)
    }
}

/// Builds a subtree at a level, the root being level 1.
type BuildSubtree<B> = fn(&B, Subtree<'_>, &mut Memory, u32) -> Result<Record, BuildError>;

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
    fn find_split(
        &self,
        of: &Subtree<'_>,
        span: &Span,
        memory: &mut Memory,
    ) -> Result<Option<Split>, BuildError> {
        let (references, bounds) = (of.references(span), &span.bounds);
        self.running.check_range(span.len)?;
        let room = span.capacity - span.len;
        let object = binning::find_split::<R>(
            references,
            bounds,
            self.block_shift,
            self.isa,
            &mut memory.bins,
        );
        let Some(cutting) = self.cutting.as_ref().filter(|_| room > 0) else {
            return Ok(object.map(Split::Object));
        };
        let spatial = cutting.find_split::<R>(
            references,
            room,
            bounds,
            object.as_ref(),
            &mut memory.spatial_bins,
            &self.running,
        )?;
        Ok(spatial.map(Split::Spatial).or(object.map(Split::Object)))
    }

    /// Divides a span by a plane, or halves it in sorted order if there is none.
    fn divide(
        &self,
        of: &mut Subtree<'_>,
        mut span: Span,
        split: Option<Split>,
        lefts: &mut Vec<usize>,
    ) -> [Span; 2] {
        let [memory, scratch] = of.memory(&span);
        let partition = match (split, &self.cutting) {
            (Some(Split::Object(split)), _) => {
                let references = &mut memory[..span.len];
                if self.cutting.is_some() && R::LIBRARY_ORDER {
                    partition::in_place(references, |reference| split.is_left(reference))
                } else if tasks::in_pieces(span.len) {
                    span.in_scratch = !span.in_scratch;
                    partition::into_buffer(references, scratch, &split, self.isa, lefts)
                } else {
                    partition::stable(references, scratch, &split, self.isa)
                }
            }
            (Some(Split::Spatial(split)), Some(cutting)) => {
                span.len = cutting.cut::<R>(memory, span.len, &split);
                let references = &mut memory[..span.len];
                partition::in_place(references, |reference| split.is_left::<R>(reference))
            }
            _ => {
                of.sort::<R>(&span);
                return of.halve(&span);
            }
        };
        of.part(&span, partition.left, partition.bounds)
    }

    fn blocks(&self, n: usize) -> f32 {
        ((n as u32 + (1 << self.block_shift) - 1) >> self.block_shift) as f32
    }

    /// Whether a leaf costs no more than dividing. A NaN on either side (a cost of 0 times the
    /// infinite cost of a missing plane) means that it does.
    fn leaf_is_cheap(&self, subtree: &Subtree<'_>, split: Option<&Split>) -> bool {
        let area = subtree.bounds.geometry.half_area();
        let sah = split.map_or(f32::INFINITY, Split::sah);
        let leaf_cost = self.params.intersection_cost * (area * self.blocks(subtree.len));
        let split_cost = self.params.traversal_cost * area + self.params.intersection_cost * sah;
        leaf_cost <= split_cost
    }

    /// Whether a range at a level must be halved without regard to cost. Embree knows only the
    /// reserve; a range that needs more levels than that to be halved fails there.
    fn is_at_limit(&self, n: usize, level: u32) -> bool {
        let (params, leaves) = (&self.params, n.div_ceil(self.params.max_leaf_size as usize));
        level + self.reserved_levels >= params.max_depth
            || !R::LIBRARY_ORDER && level + levels_below(params, leaves) >= params.max_depth
    }

    /// The subtree over a range at a level, the root being level 1.
    fn subtree(
        &self,
        mut subtree: Subtree<'_>,
        memory: &mut Memory,
        level: u32,
    ) -> Result<Record, BuildError> {
        match self.children(&mut subtree, memory, level)? {
            Some(base) => self.node(subtree, memory, base, level, Self::subtree),
            None => self.leaf_phase(subtree, memory, level),
        }
    }

    /// Divides a range into children, which are those of the memory from the place on that is returned; `None` if it is
    /// to be leaves, for which it is sorted. Not inlined: what it needs on the stack, no level below has to wait for.
    #[inline(never)]
    fn children(
        &self,
        subtree: &mut Subtree<'_>,
        memory: &mut Memory,
        level: u32,
    ) -> Result<Option<usize>, BuildError> {
        let (n, span) = (subtree.len, subtree.span());
        let (min_leaf_size, max_leaf_size) = (
            self.params.min_leaf_size as usize,
            self.params.max_leaf_size as usize,
        );
        if n <= min_leaf_size || self.is_at_limit(n, level) {
            subtree.sort::<R>(&span);
            return Ok(None);
        }
        let split = self.find_split(subtree, &span, memory)?;
        if n <= max_leaf_size && self.leaf_is_cheap(subtree, split.as_ref()) {
            subtree.sort::<R>(&span);
            return Ok(None);
        }
        let base = memory.lists.children.len();
        let halves = self.divide(subtree, span, split, &mut memory.lists.lefts);
        memory.lists.children.extend(halves);
        while memory.lists.children.len() - base < self.params.branching_factor as usize {
            // The largest box first; ties keep the older child.
            let Some(largest) = memory.best(
                base,
                |child| child.len > min_leaf_size,
                |child| child.bounds.geometry.half_area(),
            ) else {
                break;
            };
            let child = memory.lists.children[largest];
            let split = self.find_split(subtree, &child, memory)?;
            let [left, right] = self.divide(subtree, child, split, &mut memory.lists.lefts);
            memory.lists.children[largest] = left;
            memory.lists.children.push(right);
        }
        memory.lists.children[base..].sort_by_key(|child| std::cmp::Reverse(child.len));
        Ok(Some(base))
    }

    /// Leaves, and halving without regard to cost where too many references are left. The
    /// references of the range are sorted.
    fn leaf_phase(
        &self,
        mut subtree: Subtree<'_>,
        memory: &mut Memory,
        level: u32,
    ) -> Result<Record, BuildError> {
        let (n, span) = (subtree.len, subtree.span());
        let max_leaf_size = self.params.max_leaf_size as usize;
        if level > self.params.max_depth {
            return Err(depth_error(&self.params, n, level));
        }
        if n <= max_leaf_size {
            let cuts = self.cutting.is_some();
            for (leaf, reference) in subtree.leaves.iter_mut().zip(&subtree.references[..n]) {
                *leaf = if cuts {
                    reference.cut_leaf_reference()
                } else {
                    reference.leaf_reference()
                };
            }
            return Ok(Record::leaf(&subtree.bounds.geometry, subtree.begin, n));
        }
        let base = memory.lists.children.len();
        memory.lists.children.extend(subtree.halve(&span));
        while memory.lists.children.len() - base < self.params.branching_factor as usize {
            let too_large = |child: &Span| child.len > max_leaf_size;
            let Some(largest) = memory.best(base, too_large, |child| child.len as f32) else {
                break;
            };
            // The last child takes its place, and its halves come to the end.
            let child = memory.lists.children.swap_remove(largest);
            memory.lists.children.extend(subtree.halve(&child));
        }
        self.node(subtree, memory, base, level, Self::leaf_phase)
    }

    /// Builds the children, which are those of the memory from `base` on, and records their node.
    fn node(
        &self,
        subtree: Subtree<'_>,
        memory: &mut Memory,
        base: usize,
        level: u32,
        build: BuildSubtree<Self>,
    ) -> Result<Record, BuildError> {
        let bounds = subtree.bounds.geometry;
        let records_begin = subtree.records_begin;
        let count = memory.lists.children.len() - base;
        let (own, rest) = subtree.records.split_at_mut(count);
        let mut rest = Subtree {
            records: rest,
            records_begin: records_begin + count,
            ..subtree
        };
        if tasks::is_task(rest.len) {
            self.children_in_parallel(rest, own, memory, base, level, build)?;
        } else {
            for (place, record) in own.iter_mut().enumerate() {
                let child = memory.lists.children[base + place];
                let (n, records) = (child.len, 2 * child.capacity - 2);
                let range = child.first..child.first + child.capacity;
                let (mut references, mut scratch) = (
                    &mut rest.references[range.clone()],
                    &mut rest.scratch[range.clone()],
                );
                if child.in_scratch {
                    std::mem::swap(&mut references, &mut scratch);
                }
                let own = Subtree {
                    references,
                    scratch,
                    leaves: &mut rest.leaves[range],
                    records: &mut rest.records[..records],
                    begin: rest.begin + child.first,
                    records_begin: rest.records_begin,
                    len: n,
                    bounds: child.bounds,
                };
                *record = build(self, own, memory, level + 1)?;
                self.running.finished(n, rest.len);
                rest.records = &mut std::mem::take(&mut rest.records)[records..];
                rest.records_begin += records;
            }
        }
        memory.lists.children.truncate(base);
        Ok(Record::inner(&bounds, records_begin, own))
    }

    /// Builds children at the same time. Not inlined, since few nodes need the room on the stack.
    #[inline(never)]
    fn children_in_parallel(
        &self,
        rest: Subtree<'_>,
        own: &mut [Record],
        memory: &mut Memory,
        base: usize,
        level: u32,
        build: BuildSubtree<Self>,
    ) -> Result<(), BuildError> {
        let children = &memory.lists.children[base..];
        // Slices are cut off in the order of the references, records in that of the children.
        let mut in_order: [usize; MAX_CHILDREN] = std::array::from_fn(|i| i);
        in_order[..children.len()].sort_unstable_by_key(|&i| children[i].first);
        let (mut references, mut scratch, mut leaves) =
            (rest.references, rest.scratch, rest.leaves);
        let mut jobs: [Option<Subtree<'_>>; MAX_CHILDREN] = [const { None }; MAX_CHILDREN];
        for &index in &in_order[..children.len()] {
            let child = &children[index];
            let (mut own_references, mut own_scratch, own_leaves);
            (own_references, references) = references.split_at_mut(child.capacity);
            (own_scratch, scratch) = scratch.split_at_mut(child.capacity);
            (own_leaves, leaves) = leaves.split_at_mut(child.capacity);
            if child.in_scratch {
                std::mem::swap(&mut own_references, &mut own_scratch);
            }
            jobs[index] = Some(Subtree {
                references: own_references,
                scratch: own_scratch,
                leaves: own_leaves,
                records: &mut [],
                begin: rest.begin + child.first,
                records_begin: 0,
                len: child.len,
                bounds: child.bounds,
            });
        }
        let (mut records, mut records_begin) = (rest.records, rest.records_begin);
        for job in jobs.iter_mut().flatten() {
            let needed = 2 * job.references.len() - 2;
            (job.records, records) = records.split_at_mut(needed);
            job.records_begin = records_begin;
            records_begin += needed;
        }
        let count = children.len();
        tasks::fill_from_jobs(
            &mut jobs[..count],
            own,
            memory,
            &|subtree: &Subtree<'_>| subtree.len,
            &|subtree, memory| {
                let n = subtree.len;
                build(self, subtree, memory, level + 1)
                    .inspect(|_| self.running.finished(n, rest.len))
            },
        )
    }
}

/// How many levels there are below a node whose range of `parts` equal parts is halved into nodes.
pub(crate) fn levels_below(params: &BuildParams, parts: usize) -> u32 {
    // Halving fills as many equal children as the largest power of two that fits.
    let halvings = params.branching_factor.ilog2();
    parts.next_power_of_two().ilog2().div_ceil(halvings)
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
