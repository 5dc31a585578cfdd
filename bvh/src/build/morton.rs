//! Trees along a Morton curve: Lauterbach, Garland, Sengupta, Luebke, Manocha, *Fast BVH
//! Construction on GPUs*, 2009, by the rules of Embree 4's builder for low quality.
//!
//! Centroids are sorted by 30 interleaved bits of a grid of 1015³ cells; ranges are parted at the
//! highest bit in which their first and last code differ. Where all codes of a range are equal
//! they are made again for the range's own box; where they still are, the range is halved.
//!
//! Invariants: as in `recursion`, apart from costs, which have no say. Poor where a large scene
//! surrounds a small dense part.

use wide::f32x4;

use super::{
    BuildWorkspace, LeafReference,
    binning::Rounding,
    control::Running,
    curve::{self, spread_bits},
    introsort,
    primitive::{Bounds, PrimitiveRef},
    radix,
    record::Record,
    recursion::{MAX_CHILDREN, RESERVED_LEVELS, depth_error, levels_below},
    rotations::{self, Place},
    tasks,
};
use crate::{error::BuildError, params::BuildParams};

/// Cells per axis before the last, a share of 2¹⁰ that keeps rounding inside the grid.
const CELLS: f32 = 1024.0 * 0.99;

/// Extents up to this are taken for zero.
const SMALLEST_EXTENT: f32 = 1e-19;

/// Longer ranges are sorted stably; shorter ones, with Embree's rounding, in the order of its
/// library.
const LIBRARY_SORT_LIMIT: usize = 1024;

/// Where the code stands in a key; the index of the reference is below.
const CODE_SHIFT: u32 = 32;

/// Builds the records of a tree over `workspace.references`, of which there is at least one.
/// Returns the root.
pub(crate) fn build<R: Rounding>(
    workspace: &mut BuildWorkspace,
    params: &BuildParams,
) -> Result<Record, BuildError> {
    let n = workspace.references.len();
    workspace.leaves.resize(n, LeafReference::default());
    workspace.records.resize(2 * n - 2, Record::UNUSED);
    workspace.keys.clear();
    workspace.keys.extend(0..n as u64);
    let builder = Builder::<R> {
        running: Running::new(&workspace.control, n),
        params: params.canonical(),
        references: &workspace.references,
        rounding: std::marker::PhantomData,
    };
    builder.encode(&mut workspace.keys);
    if R::LIBRARY_ORDER && n <= LIBRARY_SORT_LIMIT {
        introsort::sort(&mut workspace.keys, |a, b| code(*a) < code(*b));
    } else {
        radix::sort(
            &mut workspace.keys,
            &mut workspace.keys_scratch,
            CODE_SHIFT,
            CODE_SHIFT + 30,
            |key| *key,
            &workspace.control,
        )?;
    }
    let root = Range {
        keys: &mut workspace.keys,
        leaves: &mut workspace.leaves,
        records: &mut workspace.records,
        begin: 0,
        records_begin: 0,
    };
    builder.subtree(root, 1)
}

fn code(key: u64) -> u32 {
    (key >> CODE_SHIFT) as u32
}

/// A range of sorted keys, with the leaves and records that belong to its subtree.
struct Range<'a> {
    keys: &'a mut [u64],
    leaves: &'a mut [LeafReference],
    records: &'a mut [Record],
    begin: usize,
    records_begin: usize,
}

/// Builds the subtree over a range at a level, the root being level 1.
type BuildSubtree<B> = fn(&B, Range<'_>, u32) -> Result<Record, BuildError>;

struct Builder<'a, R> {
    running: Running<'a>,
    params: BuildParams,
    references: &'a [PrimitiveRef],
    rounding: std::marker::PhantomData<R>,
}

impl<R: Rounding> Builder<'_, R> {
    fn reference(&self, key: u64) -> &PrimitiveRef {
        &self.references[key as u32 as usize]
    }

    /// Gives keys the codes of the grid over their own centroids.
    fn encode(&self, keys: &mut [u64]) {
        let centroids = curve::centroid_bounds(keys, |&key| self.reference(key).doubled_centroid());
        let (lower, extent) = (centroids.lower(), centroids.extent().to_array());
        let scale = f32x4::new(extent.map(|e| {
            if e > SMALLEST_EXTENT {
                R::reciprocal(e) * CELLS
            } else {
                0.0
            }
        }));
        tasks::for_each_piece(keys, &|keys: &mut [u64]| {
            for key in keys {
                let centroid = self.reference(*key).doubled_centroid();
                let cell = ((centroid - lower) * scale).fast_round_int();
                let [x, y, z, _] = cell.to_array().map(|c| spread_bits(c as u32));
                *key = (x | y << 1 | z << 2) << CODE_SHIFT | u64::from(*key as u32);
            }
        });
    }

    /// The place in a range at which its codes part it; found by new codes for the range if all
    /// are equal, and in the middle of the absolute places if they stay so.
    fn part(&self, keys: &mut [u64], begin: usize) -> usize {
        for attempt in 0..2 {
            let (first, last) = (code(keys[0]), code(keys[keys.len() - 1]));
            if first != last {
                let bit = CODE_SHIFT + (first ^ last).ilog2();
                return keys.partition_point(|key| key >> bit & 1 == 0);
            }
            if attempt == 0 {
                self.encode(keys);
                if R::LIBRARY_ORDER && keys.len() < LIBRARY_SORT_LIMIT {
                    introsort::sort(keys, |a, b| code(*a) < code(*b));
                } else if R::LIBRARY_ORDER {
                    keys.sort_by_key(|key| code(*key));
                } else {
                    // Equal codes in the order of the references: what a stable sort would give.
                    keys.sort_unstable();
                }
            }
        }
        middle(begin, keys.len())
    }

    fn subtree(&self, range: Range<'_>, level: u32) -> Result<Record, BuildError> {
        let n = range.keys.len();
        self.running.check_range(n)?;
        let leaves = n.div_ceil(self.params.max_leaf_size as usize);
        let at_limit = level + RESERVED_LEVELS >= self.params.max_depth
            || !R::LIBRARY_ORDER
                && level + levels_below(&self.params, leaves) >= self.params.max_depth;
        if n <= self.params.min_leaf_size as usize || at_limit {
            return self.leaf_phase(range, level);
        }
        let min_leaf_size = self.params.min_leaf_size as usize;
        let part = |keys: &mut [u64], begin| self.part(keys, begin);
        let children = self.children(&mut *range.keys, range.begin, min_leaf_size, part);
        self.node(range, &children, level, Self::subtree)
    }

    /// Leaves, and halving where too many references are left.
    fn leaf_phase(&self, range: Range<'_>, level: u32) -> Result<Record, BuildError> {
        let n = range.keys.len();
        let max_leaf_size = self.params.max_leaf_size as usize;
        if level > self.params.max_depth {
            return Err(depth_error(&self.params, n, level));
        }
        if n <= max_leaf_size {
            let mut bounds = Bounds::EMPTY;
            for (leaf, &key) in range.leaves.iter_mut().zip(&*range.keys) {
                let reference = self.reference(key);
                bounds.extend(&reference.0);
                *leaf = reference.leaf_reference();
            }
            return Ok(Record::leaf(&bounds, range.begin, n));
        }
        let halve = |keys: &mut [u64], begin| middle(begin, keys.len());
        let children = self.children(&mut *range.keys, range.begin, max_leaf_size, halve);
        self.node(range, &children, level, Self::leaf_phase)
    }

    /// Divides a range into children: again and again the one with the most references, while it
    /// has more than `limit`. Returns where each begins, in the order of the node, and the sizes.
    fn children(
        &self,
        keys: &mut [u64],
        begin: usize,
        limit: usize,
        part: impl Fn(&mut [u64], usize) -> usize,
    ) -> Children {
        let mut children = Children {
            spans: [(0, 0); MAX_CHILDREN],
            len: 1,
        };
        children.spans[0] = (0, keys.len());
        while children.len < self.params.branching_factor as usize {
            let mut largest: Option<usize> = None;
            for (index, &(_, n)) in children.spans[..children.len].iter().enumerate() {
                if n > limit && largest.is_none_or(|other| n > children.spans[other].1) {
                    largest = Some(index);
                }
            }
            let Some(largest) = largest else { break };
            let (first, n) = children.spans[largest];
            let left = part(&mut keys[first..first + n], begin + first);
            children.spans[largest] = children.spans[children.len - 1];
            children.spans[children.len - 1] = (first, left);
            children.spans[children.len] = (first + left, n - left);
            children.len += 1;
        }
        children
    }

    fn node(
        &self,
        range: Range<'_>,
        children: &Children,
        level: u32,
        build: BuildSubtree<Self>,
    ) -> Result<Record, BuildError> {
        let spans = &children.spans[..children.len];
        let (first, parent) = (range.records_begin, range.keys.len());
        let records = range.records;
        let (own, below) = records.split_at_mut(spans.len());
        let mut rest = Range {
            keys: range.keys,
            leaves: range.leaves,
            records: below,
            begin: range.begin,
            records_begin: first + own.len(),
        };
        if tasks::is_task(parent) {
            self.children_in_parallel(rest, spans, own, level, build)?;
        } else {
            for (&(begin, n), record) in spans.iter().zip(own) {
                let (records, others) = std::mem::take(&mut rest.records).split_at_mut(2 * n - 2);
                let child = Range {
                    keys: &mut rest.keys[begin..begin + n],
                    leaves: &mut rest.leaves[begin..begin + n],
                    records,
                    begin: rest.begin + begin,
                    records_begin: rest.records_begin,
                };
                *record = build(self, child, level + 1)?;
                self.running.finished(n, parent);
                rest.records = others;
                rest.records_begin += 2 * n - 2;
            }
        }
        if self.params.rotations > 0 {
            let place = Place {
                records,
                records_begin: first,
                children: spans.len(),
                levels: self.params.max_depth.saturating_sub(level),
            };
            let is_closed = |child: usize| rotations::is_closed(spans[child].1, parent);
            rotations::rotate(place, self.params.rotations, is_closed);
        }
        Ok(Record::inner_around(first, &records[..spans.len()]))
    }

    /// Builds children at the same time. Not inlined, since few nodes need the room on the stack.
    #[inline(never)]
    fn children_in_parallel(
        &self,
        rest: Range<'_>,
        spans: &[(usize, usize)],
        own: &mut [Record],
        level: u32,
        build: BuildSubtree<Self>,
    ) -> Result<(), BuildError> {
        let parent = rest.keys.len();
        // Slices are cut off in the order of the keys, records in that of the node.
        let mut in_order: [usize; MAX_CHILDREN] = std::array::from_fn(|i| i);
        in_order[..spans.len()].sort_unstable_by_key(|&i| spans[i].0);
        let mut jobs: [Option<Range<'_>>; MAX_CHILDREN] = [const { None }; MAX_CHILDREN];
        let (mut keys, mut leaves) = (rest.keys, rest.leaves);
        for &index in &in_order[..spans.len()] {
            let (begin, n) = spans[index];
            let (own_keys, own_leaves);
            (own_keys, keys) = keys.split_at_mut(n);
            (own_leaves, leaves) = leaves.split_at_mut(n);
            jobs[index] = Some(Range {
                keys: own_keys,
                leaves: own_leaves,
                records: &mut [],
                begin: rest.begin + begin,
                records_begin: 0,
            });
        }
        let (mut records, mut records_begin) = (rest.records, rest.records_begin);
        for job in jobs.iter_mut().flatten() {
            let needed = 2 * job.keys.len() - 2;
            (job.records, records) = records.split_at_mut(needed);
            job.records_begin = records_begin;
            records_begin += needed;
        }
        tasks::fill_from_jobs(
            &mut jobs[..spans.len()],
            own,
            &mut (),
            &|range: &Range<'_>| range.keys.len(),
            &|range, ()| {
                let n = range.keys.len();
                build(self, range, level + 1).inspect(|_| self.running.finished(n, parent))
            },
        )
    }
}

/// Where each child begins within its range, and how many references it has.
struct Children {
    spans: [(usize, usize); MAX_CHILDREN],
    len: usize,
}

/// The middle of the absolute places of a range, within it.
fn middle(begin: usize, n: usize) -> usize {
    (2 * begin + n) / 2 - begin
}
