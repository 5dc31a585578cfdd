//! The first clusters: neighbours along the curve that would be in one leaf anyway.

use super::{
    super::{
        LeafReference,
        control::BuildControl,
        primitive::{Bounds, PrimitiveRef},
        tasks::{self, PIECE_SIZE},
    },
    BLOCK, Below, Cluster, Memory, Model, Node, Piece, Place, half_area, lesser,
};
use crate::{
    error::BuildError,
    simd::{
        Isa,
        build::{self, EightLanes, Halves},
    },
};

/// Fills in the ids along the curve, the first clusters and their nodes.
pub(super) fn first_clusters(
    model: &Model,
    references: &[PrimitiveRef],
    isa: Isa,
    memory: &mut Memory,
    control: &BuildControl,
) -> Result<(), BuildError> {
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
        control,
        references,
        places,
        most: model.params.min_leaf_size,
    };
    group_pieces(isa, kernel, ids, clusters, pieces)?;
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
    Ok(())
}

/// Groups the references of some pieces, each at the places of its references.
fn group_pieces(
    isa: Isa,
    kernel: Group<'_>,
    ids: &mut [LeafReference],
    clusters: &mut [Cluster],
    pieces: &mut [Piece],
) -> Result<(), BuildError> {
    if let [piece] = pieces {
        kernel.control.check()?;
        piece.firsts = build::run(
            isa,
            GroupPiece {
                group: kernel,
                ids,
                clusters,
            },
        );
        return Ok(());
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
    let (left, right) = tasks::join(
        || group_pieces(isa, Group { places, ..kernel }, ids, clusters, left),
        || group_pieces(isa, kernel_right, ids_right, clusters_right, right),
    );
    left.and(right)
}

/// Unites neighbours along the curve into the first clusters.
///
/// So few references as `most` become a leaf in any case. Two neighbours are united if no neighbour
/// is nearer and a leaf of both costs no more than two leaves.
#[derive(Clone, Copy)]
struct Group<'a> {
    control: &'a BuildControl,
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
