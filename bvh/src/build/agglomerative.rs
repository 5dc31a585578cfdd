//! Trees from the bottom up: Meister, Bittner, *Parallel Locally-Ordered Clustering for Bounding
//! Volume Hierarchy Construction*, 2018.
//!
//! Clusters, at first one or a few primitives each, lie along a Morton curve of 63 bits. Each looks among the
//! [`RADIUS`] clusters on either side for the one with which its box would be smallest; two that
//! choose each other become one, in the place of the first; and so on until one is left.
//!
//! Two things make it fast. Neighbours along the curve that would be in one leaf anyway are united
//! before the first round, so that there is less than half a cluster per primitive. And leaves are
//! chosen while clusters merge, by the surface area heuristic: of the costs of a leaf and of a node
//! with the best trees below it. Wide nodes are then filled from the root down, the child with the
//! largest box being the first to be replaced by its own two.
//!
//! Invariants: the tree does not depend on threads. Every round merges one cluster in
//! [`LEAST_SHARE`] or more, except among the last [`FREE_BELOW`], so that time is bounded for any
//! input. An inner node stands behind the first clusters and in front of the inner nodes below it.
//! No leaf and no level is beyond its limit: a subtree that might else become too deep is halved by
//! the number of its clusters.

use std::ops::Range;

use super::{
    BuildWorkspace, LeafReference,
    control::BuildControl,
    primitive::{Bounds, PrimitiveRef},
    radix,
    record::Record,
    recursion::{MAX_CHILDREN, depth_error, levels_below},
    tasks::{self, PIECE_SIZE},
};
use crate::{
    bounds::Aabb,
    error::BuildError,
    params::BuildParams,
    simd::{
        Isa,
        build::{self, EightLanes, Halves},
    },
};

/// How many clusters on either side are looked at.
const RADIUS: usize = 8;

/// Bits of a key that tell the distance to a cluster, minus one.
const DISTANCE_MASK: u32 = RADIUS.next_power_of_two() as u32 - 1;

/// If fewer clusters than one in so many would merge, neighbours merge too, whatever their boxes:
/// growing boxes around one centre would else merge one by one.
const LEAST_SHARE: usize = 16;

/// So few clusters may merge one by one.
const FREE_BELOW: usize = 512;

/// Bits of a Morton code per axis.
const AXIS_BITS: u32 = 21;

/// How many leading bits of a code are sorted by in passes over all.
const LEADING_BITS: u32 = 44;

/// Clusters that are looked at together, in memory of the innermost cache.
const BLOCK: usize = 256;
/// Pairs of a block begin at so many clusters: those of the block and those within reach before.
const SPAN: usize = BLOCK + RADIUS;
/// Clusters that a block needs: those within reach on both sides too.
const REACH: usize = SPAN + RADIUS;

/// A place on the Morton curve.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Place {
    code: u64,
    /// Index of the reference.
    index: u32,
}

/// A node of the binary tree.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Aabb,
    below: Below,
    summary: Summary,
}

#[derive(Clone, Copy, Debug)]
enum Below {
    Children([u32; 2]),
    /// A cluster of the first round: a range of references along the curve.
    Cluster {
        first: u32,
    },
}

/// What is known of a subtree.
#[derive(Clone, Copy, Debug)]
struct Summary {
    area: f32,
    /// Least cost of what is below as at most `branching_factor` trees, and of how many. A single
    /// one is a leaf.
    cost: f32,
    trees: u32,
    /// How many references and how many first clusters are below.
    references: u32,
    clusters: u32,
}

impl Summary {
    const NONE: Self = Self {
        area: 0.0,
        cost: 0.0,
        trees: 1,
        references: 0,
        clusters: 1,
    };

    fn is_leaf(&self) -> bool {
        self.trees == 1
    }
}

impl Node {
    const UNUSED: Self = Self {
        bounds: Aabb::EMPTY,
        below: Below::Cluster { first: 0 },
        summary: Summary::NONE,
    };
}

/// The memory of a build.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    places: Vec<Place>,
    places_scratch: Vec<Place>,
    /// The ids of the references along the curve.
    ids: Vec<LeafReference>,
    clusters: Vec<Cluster>,
    /// The clusters of the next round.
    merged: Vec<Cluster>,
    /// Which other cluster each chose, as a distance along the curve; 0 is none.
    choices: Vec<i8>,
    /// What happens to each piece of the clusters in a round.
    pieces: Vec<Piece>,
    nodes: Vec<Node>,
    /// The first clusters in the order of the tree.
    order: Vec<u32>,
}

impl Memory {
    pub(crate) fn bytes(&self) -> usize {
        (self.places.capacity() + self.places_scratch.capacity()) * size_of::<Place>()
            + self.ids.capacity() * size_of::<LeafReference>()
            + (self.clusters.capacity() + self.merged.capacity()) * size_of::<Cluster>()
            + self.choices.capacity()
            + self.pieces.capacity() * size_of::<Piece>()
            + self.nodes.capacity() * size_of::<Node>()
            + self.order.capacity() * size_of::<u32>()
    }
}

/// A subtree that waits for others, with all that merging needs to know.
#[derive(Clone, Copy, Debug)]
struct Cluster {
    /// The free lanes are 0.
    bounds: Bounds,
    node: u32,
    summary: Summary,
}

impl Cluster {
    const NONE: Self = Self {
        bounds: Bounds::EMPTY,
        node: 0,
        summary: Summary::NONE,
    };
}

/// Builds the records of a tree over `workspace.references`, of which there is at least one.
/// Returns the root.
pub(crate) fn build(
    workspace: &mut BuildWorkspace,
    params: &BuildParams,
) -> Result<Record, BuildError> {
    let n = workspace.references.len();
    let model = Model::new(params);
    let memory = &mut workspace.agglomerative;
    encode(&workspace.references, &mut memory.places);
    sort(&mut memory.places, &mut memory.places_scratch);
    let isa = Isa::best();
    first_clusters(&model, &workspace.references, isa, memory);
    merge_all(&model, isa, memory, &workspace.control)?;
    workspace.leaves.resize(n, LeafReference::default());
    workspace.records.clear();
    // The root stands behind the first clusters, or is the only one of them.
    let clusters = memory.order.len();
    let root = if clusters > 1 { clusters } else { 0 };
    let mut emission = Emission {
        model,
        nodes: &memory.nodes,
        ids: &memory.ids,
        order: &mut memory.order,
        leaves: &mut workspace.leaves,
        used_leaves: 0,
        records: &mut workspace.records,
    };
    emission.node(root as u32, 1)
}

/// Parameters in the form in which costs need them.
struct Model {
    params: BuildParams,
    block_shift: u32,
}

impl Model {
    fn new(params: &BuildParams) -> Self {
        Self {
            params: params.canonical(),
            block_shift: params.sah_block_shift(),
        }
    }

    fn leaf_cost(&self, area: f32, references: u32) -> f32 {
        let blocks = (references + (1 << self.block_shift) - 1) >> self.block_shift;
        self.params.intersection_cost * (area * blocks as f32)
    }

    /// A cluster of the first round.
    fn first(&self, area: f32, references: u32) -> Summary {
        Summary {
            area,
            cost: self.leaf_cost(area, references),
            references,
            ..Summary::NONE
        }
    }

    /// Two clusters as one. If they do not become a leaf, what is below is as many trees as fit
    /// into one node of the wide tree.
    fn merged(&self, area: f32, left: &Summary, right: &Summary) -> Summary {
        let params = &self.params;
        let references = left.references + right.references;
        let closed = |side: &Summary| match side.trees {
            1 => side.cost,
            _ => params.traversal_cost * side.area + side.cost,
        };
        let (mut cost, mut trees) = (left.cost + right.cost, left.trees + right.trees);
        if trees > params.branching_factor {
            (cost, trees) = (closed(left) + closed(right), 2);
        }
        let leaf_cost = self.leaf_cost(area, references);
        // Written so that costs that are not numbers never forbid or demand what limits do.
        if references <= params.min_leaf_size
            || references <= params.max_leaf_size
                && leaf_cost <= params.traversal_cost * area + cost
        {
            (cost, trees) = (leaf_cost, 1);
        }
        Summary {
            area,
            cost,
            trees,
            references,
            clusters: left.clusters + right.clusters,
        }
    }
}

/// Sorts by the codes, equal ones by the index: by their leading bits in few passes over memory,
/// and where those are equal, which is rare, by comparison.
fn sort(places: &mut [Place], scratch: &mut Vec<Place>) {
    const LOW_BIT: u32 = 3 * AXIS_BITS - LEADING_BITS;
    radix::sort(places, scratch, LOW_BIT, 3 * AXIS_BITS, |place| place.code);
    for run in places.chunk_by_mut(|a, b| a.code >> LOW_BIT == b.code >> LOW_BIT) {
        if run.len() > 1 {
            run.sort_unstable_by_key(|place| (place.code, place.index));
        }
    }
}

/// Fills in the ids along the curve, the first clusters and their nodes.
fn first_clusters(model: &Model, references: &[PrimitiveRef], isa: Isa, memory: &mut Memory) {
    let n = references.len();
    let Memory {
        places,
        ids,
        clusters,
        pieces,
        ..
    } = memory;
    clusters.resize(n, Cluster::NONE);
    ids.resize(n, LeafReference::default());
    pieces.resize(n.div_ceil(PIECE_SIZE), Piece::default());
    let kernel = Group {
        references,
        places,
        most: model.params.min_leaf_size,
    };
    group_pieces(isa, kernel, ids, clusters, pieces);
    // Closes the gaps behind the clusters of each piece.
    let mut count = 0;
    for (piece, begin) in pieces.iter().zip((0..).step_by(PIECE_SIZE)) {
        let firsts = piece.firsts as usize;
        clusters.copy_within(begin..begin + firsts, count);
        count += firsts;
    }
    clusters.truncate(count);
    memory.merged.resize(count, Cluster::NONE);
    memory.choices.resize(count, 0);
    memory.order.resize(count, 0);
    memory.nodes.resize(2 * count - 1, Node::UNUSED);
    let mut first = 0;
    let nodes = memory.nodes.iter_mut();
    for ((index, cluster), node) in (0..).zip(&mut memory.clusters).zip(nodes) {
        let references = cluster.summary.references;
        cluster.summary = model.first(cluster.bounds.half_area(), references);
        cluster.node = index;
        *node = Node {
            bounds: cluster.bounds.to_aabb(),
            below: Below::Cluster { first },
            summary: cluster.summary,
        };
        first += references;
    }
}

/// Groups the references of some pieces, each at the places of its references.
fn group_pieces(
    isa: Isa,
    kernel: Group<'_>,
    ids: &mut [LeafReference],
    clusters: &mut [Cluster],
    pieces: &mut [Piece],
) {
    if let [piece] = pieces {
        piece.firsts = build::run(
            isa,
            GroupPiece {
                group: kernel,
                ids,
                clusters,
            },
        );
        return;
    }
    let (left, right) = pieces.split_at_mut(pieces.len() / 2);
    let middle = left.len() * PIECE_SIZE;
    let (places, places_right) = kernel.places.split_at(middle);
    let (ids, ids_right) = ids.split_at_mut(middle);
    let (clusters, clusters_right) = clusters.split_at_mut(middle);
    let kernel_right = Group {
        places: places_right,
        ..kernel
    };
    tasks::join(
        || group_pieces(isa, Group { places, ..kernel }, ids, clusters, left),
        || group_pieces(isa, kernel_right, ids_right, clusters_right, right),
    );
}

/// Unites neighbours along the curve into the first clusters.
///
/// So few references as `most` become a leaf in any case. Two neighbours are united if no neighbour
/// is nearer and a leaf of both costs no more than two leaves.
#[derive(Clone, Copy)]
struct Group<'a> {
    references: &'a [PrimitiveRef],
    places: &'a [Place],
    most: u32,
}

/// The same for one piece.
struct GroupPiece<'a> {
    group: Group<'a>,
    ids: &'a mut [LeafReference],
    clusters: &'a mut [Cluster],
}

impl EightLanes for GroupPiece<'_> {
    /// The number of clusters.
    type Output = u32;

    // Loops over plain arrays, which the compiler turns into the lanes of the instruction set.
    #[inline(always)]
    fn run<L: Halves>(self) -> u32 {
        let mut count = 0;
        let blocks = self.group.places.chunks(BLOCK);
        for (places, ids) in blocks.zip(self.ids.chunks_mut(BLOCK)) {
            let mut boxes = Boxes {
                sides: [[0.0; BLOCK + 1]; 6],
                references: [1; BLOCK + 1],
                len: places.len(),
            };
            for (i, (place, id)) in places.iter().zip(ids).enumerate() {
                let reference = &self.group.references[place.index as usize];
                *id = reference.leaf_reference();
                let [x, y, z, _, u, v, w, _] = reference.0.0;
                for (side, value) in boxes.sides.iter_mut().zip([x, y, z, u, v, w]) {
                    side[i] = value;
                }
            }
            let mut size = 1;
            while size < self.group.most {
                boxes.unite(self.group.most);
                size *= 2;
            }
            for i in 0..boxes.len {
                let [x, y, z, u, v, w] = &boxes.sides;
                let bounds = Bounds([x[i], y[i], z[i], 0.0, u[i], v[i], w[i], 0.0]);
                let cluster = &mut self.clusters[count];
                cluster.bounds = bounds;
                cluster.summary.references = boxes.references[i];
                count += 1;
            }
        }
        count as u32
    }
}

/// Boxes in the innermost cache.
struct Boxes {
    sides: [[f32; BLOCK + 1]; 6],
    references: [u32; BLOCK + 1],
    len: usize,
}

impl Boxes {
    /// Unites neighbours once.
    #[inline(always)]
    fn unite(&mut self, most: u32) {
        // The area of each, and of each with the next.
        let (mut own, mut pair) = ([0.0; BLOCK + 1], [f32::INFINITY; BLOCK + 1]);
        let sides = &self.sides;
        // Written out here and below: a call of `map` would not be compiled for the lanes.
        for i in 0..BLOCK {
            let [a, b, c, d, e, f] = sides;
            own[i] = half_area([a[i], b[i], c[i], d[i], e[i], f[i]]);
            let united = |side: &[f32; BLOCK + 1]| lesser(side[i], side[i + 1]);
            pair[i] = half_area([
                united(a),
                united(b),
                united(c),
                united(d),
                united(e),
                united(f),
            ]);
        }
        let len = self.len;
        for i in 0..len {
            let fits = i + 1 < len
                && self.references[i] + self.references[i + 1] <= most
                && pair[i] <= own[i] + own[i + 1];
            if !fits {
                pair[i] = f32::INFINITY;
            }
        }
        let (mut i, mut kept) = (0, 0);
        while i < len {
            // The pair before is not nearer, or has lost its second box.
            let united = pair[i] < f32::INFINITY && pair[i] <= pair[i + 1];
            for side in &mut self.sides {
                side[kept] = if united {
                    lesser(side[i], side[i + 1])
                } else {
                    side[i]
                };
            }
            self.references[kept] = self.references[i];
            if united {
                self.references[kept] += self.references[i + 1];
                i += 1;
            }
            i += 1;
            kept += 1;
        }
        self.len = kept;
    }
}

/// The half area of a box, given by its lower and its negated upper sides: the signs of the negated
/// lengths cancel out.
#[inline(always)]
fn half_area([a, b, c, d, e, f]: [f32; 6]) -> f32 {
    let (x, y, z) = (a + d, b + e, c + f);
    x * (y + z) + y * z
}

/// Merges the clusters into one tree. Its root is the first node behind those of the clusters.
fn merge_all(
    model: &Model,
    isa: Isa,
    memory: &mut Memory,
    control: &BuildControl,
) -> Result<(), BuildError> {
    let Memory {
        clusters,
        merged,
        choices,
        pieces,
        nodes,
        ids,
        ..
    } = memory;
    let mut len = clusters.len();
    // Nodes behind this one are taken.
    let mut end = nodes.len();
    let count = len;
    while len > 1 {
        control.check()?;
        let choices = &mut choices[..len];
        tasks::for_each_piece_from(0, choices, &|begin, choices: &mut [i8]| {
            let clusters = &clusters[..len];
            build::run(
                isa,
                Choose {
                    clusters,
                    begin,
                    choices,
                },
            );
        });
        pieces.resize(len.div_ceil(PIECE_SIZE), Piece::default());
        let mut round = Round {
            model,
            clusters: &clusters[..len],
            choices,
            forced: false,
        };
        let mut loss = round.count(pieces, 0);
        if loss == 0 || len > FREE_BELOW && loss < len / LEAST_SHARE {
            round.forced = true;
            loss = round.count(pieces, 0);
        }
        end -= loss;
        let pairs = &mut nodes[end..end + loss];
        round.merge(pieces, 0, &mut merged[..len - loss], pairs, end as u32);
        std::mem::swap(clusters, merged);
        len -= loss;
        if let Some(progress) = &control.progress {
            progress(ids.len() * (count - len) / count, ids.len());
        }
    }
    Ok(())
}

/// What is needed to write the wide tree.
struct Emission<'a> {
    model: Model,
    nodes: &'a [Node],
    ids: &'a [LeafReference],
    /// Memory for the first clusters of a subtree.
    order: &'a mut [u32],
    leaves: &'a mut [LeafReference],
    used_leaves: usize,
    records: &'a mut Vec<Record>,
}

impl Emission<'_> {
    fn node(&mut self, index: u32, level: u32) -> Result<Record, BuildError> {
        let params = &self.model.params;
        let node = &self.nodes[index as usize];
        let Below::Children(children) = node.below else {
            return self.by_number(index, level);
        };
        let levels = levels_below(params, node.summary.clusters as usize);
        if node.summary.is_leaf() || level + levels >= params.max_depth {
            return self.by_number(index, level);
        }
        let (nodes, len) = self.opened(children);
        let first = self.take_records(len);
        for (place, &child) in (first..).zip(&nodes[..len]) {
            self.records[place] = self.node(child, level + 1)?;
        }
        let bounds = Bounds::of_aabb(&node.bounds);
        let records = &self.records[first..first + len];
        Ok(Record::inner(&bounds, first, records))
    }

    /// Replaces nodes by their children, the largest first, until a wide node is full.
    fn opened(&self, children: [u32; 2]) -> ([u32; MAX_CHILDREN], usize) {
        // What does not open has an area below all others.
        let area = |index: u32| {
            let summary = &self.nodes[index as usize].summary;
            if summary.is_leaf() {
                -1.0
            } else {
                summary.area
            }
        };
        let (mut nodes, mut areas) = ([0; MAX_CHILDREN], [-1.0; MAX_CHILDREN]);
        nodes[..2].copy_from_slice(&children);
        areas[..2].copy_from_slice(&children.map(area));
        let mut len = 2;
        while len < self.model.params.branching_factor as usize {
            // Ties keep the older child.
            let mut largest = 0;
            for place in 1..len {
                if areas[place] > areas[largest] {
                    largest = place;
                }
            }
            let opened = &self.nodes[nodes[largest] as usize];
            let Below::Children([left, right]) = opened.below else {
                break;
            };
            if opened.summary.is_leaf() {
                break;
            }
            (nodes[largest], nodes[len]) = (left, right);
            (areas[largest], areas[len]) = (area(left), area(right));
            len += 1;
        }
        (nodes, len)
    }

    fn take_records(&mut self, count: usize) -> usize {
        let first = self.records.len();
        self.records.resize(first + count, Record::UNUSED);
        first
    }

    /// A leaf, or a tree of which, for lack of levels, only numbers of references decide.
    fn by_number(&mut self, index: u32, level: u32) -> Result<Record, BuildError> {
        let clusters = self.nodes[index as usize].summary.clusters as usize;
        // Each node stands where its clusters begin until it is replaced by its children.
        self.order[0] = index;
        let mut place = 0;
        while place < clusters {
            match self.nodes[self.order[place] as usize].below {
                Below::Cluster { .. } => place += 1,
                Below::Children([left, right]) => {
                    let middle = self.nodes[left as usize].summary.clusters as usize;
                    self.order[place] = left;
                    self.order[place + middle] = right;
                }
            }
        }
        self.halves(0..clusters, level)
    }

    /// The tree over a range of [`Self::order`], halved again and again.
    fn halves(&mut self, range: Range<usize>, level: u32) -> Result<Record, BuildError> {
        let params = &self.model.params;
        let (width, max_leaf_size) = (params.branching_factor as usize, params.max_leaf_size);
        let references = self.references(&range);
        if level > params.max_depth {
            return Err(depth_error(params, references as usize, level));
        }
        if references <= max_leaf_size {
            return Ok(self.leaf(range));
        }
        let mut parts = [const { (0..0, 0) }; MAX_CHILDREN];
        parts[0] = (range, references);
        let mut len = 1;
        while len < width {
            // No cluster is too large, so that what is too large has two or more.
            let Some(most) = (0..len)
                .filter(|&part| parts[part].1 > max_leaf_size)
                .max_by_key(|&part| parts[part].0.len())
            else {
                break;
            };
            let (Range { start, end }, all) = parts[most].clone();
            let middle = start.midpoint(end);
            let left = self.references(&(start..middle));
            parts[most] = (start..middle, left);
            parts[len] = (middle..end, all - left);
            len += 1;
        }
        let first = self.take_records(len);
        for (place, (part, _)) in (first..).zip(parts).take(len) {
            self.records[place] = self.halves(part, level + 1)?;
        }
        let records = &self.records[first..first + len];
        Ok(Record::inner_around(first, records))
    }

    /// How many references a range of [`Self::order`] has.
    fn references(&self, range: &Range<usize>) -> u32 {
        let of = |&cluster: &u32| self.nodes[cluster as usize].summary.references;
        self.order[range.clone()].iter().map(of).sum()
    }

    fn leaf(&mut self, range: Range<usize>) -> Record {
        let mut bounds = Bounds::EMPTY;
        let begin = self.used_leaves;
        for &cluster in &self.order[range] {
            let node = &self.nodes[cluster as usize];
            bounds.extend(&Bounds::of_aabb(&node.bounds));
            if let Below::Cluster { first } = node.below {
                let count = node.summary.references as usize;
                self.leaves[self.used_leaves..][..count]
                    .copy_from_slice(&self.ids[first as usize..][..count]);
                self.used_leaves += count;
            }
        }
        let leaf = &mut self.leaves[begin..self.used_leaves];
        leaf.sort_unstable_by_key(|leaf| {
            u64::from(leaf.primitive_id) << 32 | u64::from(leaf.geometry_id)
        });
        Record::leaf(&bounds, begin, leaf.len())
    }
}

/// Fills in the place of each reference by its centroid, in a grid of cubes.
fn encode(references: &[PrimitiveRef], places: &mut Vec<Place>) {
    let centroids = tasks::map_merge(
        references,
        &|references: &[PrimitiveRef]| {
            let mut bounds = Bounds::EMPTY;
            for reference in references {
                bounds.extend_by_point(reference.doubled_centroid());
            }
            bounds
        },
        &|mut a: Bounds, b| {
            a.extend(&b);
            a
        },
    );
    let lower = centroids.lower().to_array();
    let [x, y, z, _] = centroids.extent().to_array();
    let largest = x.max(y).max(z);
    const CELLS: f32 = (1 << AXIS_BITS) as f32;
    let scale = if largest > 0.0 { CELLS / largest } else { 0.0 };
    places.resize(references.len(), Place::default());
    tasks::for_each_piece_from(0, places, &|begin, places: &mut [Place]| {
        let references = &references[begin..][..places.len()];
        for ((index, place), reference) in (begin as u32..).zip(places).zip(references) {
            let code = |axis: usize| {
                let cell = (reference.doubled_centroid_on(axis) - lower[axis]) * scale;
                // A conversion of a float saturates and makes 0 of what is not a number.
                spread_bits((cell as u32).min((1 << AXIS_BITS) - 1))
            };
            *place = Place {
                code: code(0) | code(1) << 1 | code(2) << 2,
                index,
            };
        }
    });
}

/// Moves bit i of 21 to bit 3i.
fn spread_bits(x: u32) -> u64 {
    let x = u64::from(x);
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

/// Finds the choices of some clusters.
///
/// A pair has one key, the area with the distance in its lowest bits, by which both of its
/// clusters judge it; of two pairs with the same key, a cluster takes that which begins at an even
/// multiple of their distance. So the pairs are in a strict order for all, and the first pair of
/// it always merges.
struct Choose<'a> {
    clusters: &'a [Cluster],
    /// Place of the first cluster that chooses.
    begin: usize,
    choices: &'a mut [i8],
}

impl EightLanes for Choose<'_> {
    type Output = ();

    // Loops over plain arrays, which the compiler turns into the lanes of the instruction set.
    #[inline(always)]
    fn run<L: Halves>(self) {
        let mut begin = self.begin;
        for choices in self.choices.chunks_mut(BLOCK) {
            choose_block(self.clusters, begin, choices);
            begin += BLOCK;
        }
    }
}

#[inline(always)]
fn choose_block(clusters: &[Cluster], begin: usize, choices: &mut [i8]) {
    // Where there is no cluster, the box is so large that every pair is worse than others.
    let mut sides = [[f32::NEG_INFINITY; REACH]; 6];
    let first = begin.saturating_sub(RADIUS);
    let offset = first + RADIUS - begin;
    let end = (begin + BLOCK + RADIUS).min(clusters.len());
    for (place, cluster) in (offset..REACH).zip(&clusters[first..end]) {
        let [x, y, z, _, u, v, w, _] = cluster.bounds.0;
        for (side, value) in sides.iter_mut().zip([x, y, z, u, v, w]) {
            side[place] = value;
        }
    }
    // The best keys of pairs that begin and that end at a cluster.
    let (mut forward, mut backward) = ([u32::MAX; REACH], [u32::MAX; REACH]);
    for distance in 1..=RADIUS {
        let forward = &mut forward[..SPAN];
        let backward = &mut backward[distance..distance + SPAN];
        for i in 0..SPAN {
            let smaller = |side: usize| lesser(sides[side][i], sides[side][i + distance]);
            let sides = [
                smaller(0),
                smaller(1),
                smaller(2),
                smaller(3),
                smaller(4),
                smaller(5),
            ];
            let area = lesser(half_area(sides), f32::MAX);
            // Areas are not negative, so that their bits are in the order of their values.
            let key = area.to_bits() & !DISTANCE_MASK | (distance as u32 - 1);
            forward[i] = forward[i].min(key);
            backward[i] = backward[i].min(key);
        }
    }
    for (i, choice) in choices.iter_mut().enumerate() {
        let (forward, backward) = (forward[RADIUS + i], backward[RADIUS + i]);
        let distance = (forward.min(backward) & DISTANCE_MASK) as usize + 1;
        let is_forward =
            forward < backward || forward == backward && ((begin + i) / distance).is_multiple_of(2);
        let exists = if is_forward {
            begin + i + distance < clusters.len()
        } else {
            begin + i >= distance
        };
        let signed = if is_forward {
            distance as i8
        } else {
            -(distance as i8)
        };
        *choice = if exists { signed } else { 0 };
    }
}

/// The lesser of two; the second if one is not a number. One instruction.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Clusters that have chosen.
struct Round<'a> {
    model: &'a Model,
    clusters: &'a [Cluster],
    choices: &'a [i8],
    /// Whether neighbours merge too if neither is chosen by whom it chose.
    forced: bool,
}

impl Round<'_> {
    /// The cluster that chose cluster `i` and was chosen by it.
    #[inline(always)]
    fn mutual(&self, i: usize) -> Option<usize> {
        let choice = self.choices[i];
        let other = i.wrapping_add_signed(isize::from(choice));
        (choice != 0 && self.choices[other] == -choice).then_some(other)
    }

    /// The cluster with which cluster `i` merges.
    #[inline(always)]
    fn partner(&self, i: usize) -> Option<usize> {
        let partner = self.mutual(i);
        if partner.is_some() || !self.forced {
            return partner;
        }
        let neighbour = i ^ 1;
        (neighbour < self.clusters.len() && self.mutual(neighbour).is_none()).then_some(neighbour)
    }

    /// Counts what happens in each piece, the first of which is number `first`. Returns how many
    /// clusters merge into those before them.
    fn count(&self, pieces: &mut [Piece], first: usize) -> usize {
        if let [piece] = pieces {
            let range = self.range(first, 1);
            *piece = Piece::default();
            for i in range {
                let other = self.partner(i);
                piece.lasts += u32::from(other.is_some_and(|other| other < i));
                piece.firsts += u32::from(other.is_some_and(|other| other > i));
            }
            return piece.lasts as usize;
        }
        let middle = pieces.len() / 2;
        let (left, right) = pieces.split_at_mut(middle);
        let (left, right) = tasks::join(
            || self.count(left, first),
            || self.count(right, first + middle),
        );
        left + right
    }

    /// The clusters of some pieces.
    fn range(&self, first: usize, pieces: usize) -> Range<usize> {
        first * PIECE_SIZE..((first + pieces) * PIECE_SIZE).min(self.clusters.len())
    }

    /// Writes the clusters and nodes that some pieces become. The first piece is number `first`,
    /// the first node of `nodes` number `node`.
    fn merge(
        &self,
        pieces: &[Piece],
        first: usize,
        merged: &mut [Cluster],
        nodes: &mut [Node],
        node: u32,
    ) {
        if pieces.len() > 1 {
            let (left, right) = pieces.split_at(pieces.len() / 2);
            let lost: u32 = left.iter().map(|piece| piece.lasts).sum();
            let new: u32 = left.iter().map(|piece| piece.firsts).sum();
            let kept = self.range(first, left.len()).len() - lost as usize;
            let (merged_left, merged_right) = merged.split_at_mut(kept);
            let (nodes_left, nodes_right) = nodes.split_at_mut(new as usize);
            tasks::join(
                || self.merge(left, first, merged_left, nodes_left, node),
                || {
                    let first = first + left.len();
                    self.merge(right, first, merged_right, nodes_right, node + new);
                },
            );
            return;
        }
        let (mut merged, mut nodes) = (merged.iter_mut(), (node..).zip(nodes));
        for i in self.range(first, 1) {
            let cluster = &self.clusters[i];
            let cluster = match self.partner(i) {
                Some(other) if other < i => continue,
                Some(other) => {
                    let other = &self.clusters[other];
                    let mut bounds = cluster.bounds;
                    bounds.extend(&other.bounds);
                    let area = bounds.half_area();
                    let summary = self.model.merged(area, &cluster.summary, &other.summary);
                    let Some((node, place)) = nodes.next() else {
                        continue;
                    };
                    *place = Node {
                        bounds: bounds.to_aabb(),
                        below: Below::Children([cluster.node, other.node]),
                        summary,
                    };
                    Cluster {
                        bounds,
                        node,
                        summary,
                    }
                }
                None => *cluster,
            };
            if let Some(place) = merged.next() {
                *place = cluster;
            }
        }
    }
}

/// What happens to the clusters of a piece: how many are the first or the last of two that merge.
#[derive(Clone, Copy, Debug, Default)]
struct Piece {
    firsts: u32,
    lasts: u32,
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{BuildPrimitive, Hierarchy, HierarchyNode, Quality};

    fn params() -> BuildParams {
        BuildParams {
            quality: Quality::Agglomerative,
            ..BuildParams::embree_scene_medium()
        }
    }

    fn primitives(boxes: impl Iterator<Item = (Vec3, Vec3)>) -> Vec<BuildPrimitive> {
        (0..)
            .zip(boxes)
            .map(|(primitive_id, (min, max))| BuildPrimitive {
                bounds: Aabb { min, max },
                geometry_id: primitive_id % 3,
                primitive_id,
            })
            .collect()
    }

    /// Numbers in 0..1 without a pattern.
    fn noise(n: usize) -> Vec<f32> {
        let mut state = 1_u32;
        (0..n)
            .map(|_| {
                state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                let mixed = (state >> (state >> 28)) ^ state;
                (mixed.wrapping_mul(277_803_737) >> 8) as f32 / (1 << 24) as f32
            })
            .collect()
    }

    fn scattered(n: usize) -> Vec<BuildPrimitive> {
        let numbers = noise(6 * n);
        primitives(numbers.chunks_exact(6).map(|c| {
            let corner = Vec3::new(c[0], c[1], c[2] * c[2]);
            (corner, corner + Vec3::new(c[3], c[4], c[5]) * 0.01)
        }))
    }

    /// Checks a tree and returns its depth.
    fn check(tree: &Hierarchy, primitives: &[BuildPrimitive], params: &BuildParams) -> u32 {
        fn walk(
            node: HierarchyNode<'_>,
            primitives: &[BuildPrimitive],
            params: &BuildParams,
            seen: &mut [bool],
        ) -> u32 {
            if let Some(leaf) = node.leaf() {
                assert!((1..=params.max_leaf_size as usize).contains(&leaf.len()));
                assert!(leaf.is_sorted_by_key(|leaf| (leaf.primitive_id, leaf.geometry_id)));
                let mut bounds = Aabb::EMPTY;
                for reference in leaf {
                    let id = reference.primitive_id as usize;
                    assert_eq!(reference.geometry_id, primitives[id].geometry_id);
                    assert!(!std::mem::replace(&mut seen[id], true), "{id} twice");
                    bounds = bounds.union(primitives[id].bounds);
                }
                assert_eq!(node.bounds(), bounds);
                return 1;
            }
            assert!((2..=params.branching_factor as usize).contains(&node.children().len()));
            let bounds = node
                .children()
                .fold(Aabb::EMPTY, |all, child| all.union(child.bounds()));
            assert_eq!(node.bounds(), bounds);
            let depth = |child| walk(child, primitives, params, seen);
            1 + node.children().map(depth).max().unwrap_or(0)
        }
        let mut seen = vec![false; primitives.len()];
        let root = tree.root().expect("there are primitives");
        let depth = walk(root, primitives, params, &mut seen);
        assert!(depth <= params.max_depth);
        assert!(seen.into_iter().all(|seen| seen));
        depth
    }

    #[test]
    fn trees_over_anything_hold_every_primitive_once_in_exact_boxes() {
        let zero = Vec3::ZERO;
        let line = |n: usize| (0..n).map(|i| (Vec3::X * i as f32, Vec3::X * (i + 1) as f32));
        let sizes = |n: usize| (1..=n).map(|i| (Vec3::splat(-(i as f32)), Vec3::splat(i as f32)));
        let powers = (0..=20).map(|e| Vec3::splat(2_f32.powi(e)));
        let mut workspace = BuildWorkspace::default();
        for input in [
            scattered(1),
            scattered(2),
            scattered(3),
            scattered(5000),
            primitives((0..10_000).map(|_| (zero, Vec3::ONE))),
            primitives((0..10_000).map(|_| (zero, zero))),
            primitives(line(10_000)),
            primitives(line(300).map(|(a, _)| (a, a))),
            primitives(powers.map(|corner| (-corner, corner))),
            primitives(sizes(20_000)),
            primitives(sizes(20_000).map(|(_, corner)| (zero, corner))),
            primitives((0..100).map(|_| (Vec3::splat(-1e30), Vec3::splat(1e30)))),
        ] {
            for (branching_factor, min_leaf_size, max_leaf_size, max_depth) in [
                (2, 1, 1, 64),
                (2, 1, 8, 32),
                (3, 4, 4, 17),
                (4, 64, 64, 20),
                (8, 4, 28, 40),
                (8, 5, 7, 9),
                (16, 1, 28, 5),
            ] {
                let params = BuildParams {
                    branching_factor,
                    min_leaf_size,
                    max_leaf_size,
                    max_depth,
                    ..params()
                };
                let tree = Hierarchy::build(&input, None, &params, &mut workspace);
                check(&tree.expect("fits"), &input, &params);
            }
        }
    }

    #[test]
    fn threads_do_not_change_the_tree() {
        let input = scattered(100_000);
        let build = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let pool = pool.build().expect("threads");
            pool.install(|| {
                let tree =
                    Hierarchy::build(&input, None, &params(), &mut BuildWorkspace::default())
                        .expect("fits");
                check(&tree, &input, &params());
                format!("{tree:?}")
            })
        };
        let one = build(1);
        assert!(one == build(2));
        assert!(one == build(8));
    }

    #[test]
    fn a_second_build_allocates_nothing_and_is_the_same() {
        let input = scattered(3000);
        let mut workspace = BuildWorkspace::default();
        let mut build = || {
            let tree = Hierarchy::build(&input, None, &params(), &mut workspace).expect("fits");
            (format!("{tree:?}"), workspace.bytes())
        };
        assert_eq!(build(), build());
    }

    #[test]
    fn too_few_levels_are_an_error() {
        let params = BuildParams {
            max_depth: 2,
            ..params()
        };
        let result = Hierarchy::build(
            &scattered(1000),
            None,
            &params,
            &mut BuildWorkspace::default(),
        );
        assert!(matches!(result, Err(BuildError::DepthLimit { .. })));
    }

    #[test]
    fn a_small_stack_suffices() {
        let sizes = (1..=100_000).map(|i| (Vec3::ZERO, Vec3::splat(i as f32)));
        let input = primitives(sizes);
        let build = move || {
            let params = BuildParams {
                branching_factor: 2,
                max_depth: 64,
                ..params()
            };
            Hierarchy::build(&input, None, &params, &mut BuildWorkspace::default()).is_ok()
        };
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .stack_size(128 << 10);
        assert!(pool.build().expect("threads").install(build));
    }

    #[test]
    fn bits_are_spread_by_three() {
        for x in (0..1 << AXIS_BITS).step_by(97) {
            let expected = (0..AXIS_BITS).map(|bit| u64::from(x >> bit & 1) << (3 * bit));
            assert_eq!(spread_bits(x), expected.sum::<u64>());
        }
    }
}
