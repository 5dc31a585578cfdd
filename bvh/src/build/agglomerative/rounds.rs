//! Rounds in which clusters choose each other and merge, until one is left.

use std::ops::Range;

use super::{
    super::{
        control::BuildControl,
        tasks::{self, PIECE_SIZE},
    },
    BLOCK, Below, Cluster, Memory, Model, Node, half_area, lesser,
};
use crate::{
    error::BuildError,
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

/// Pairs of a block begin at so many clusters: those of the block and those within reach before.
const SPAN: usize = BLOCK + RADIUS;
/// Clusters that a block needs: those within reach on both sides too.
const REACH: usize = SPAN + RADIUS;

/// Merges the clusters into one tree. Its root is the first node behind those of the clusters.
pub(super) fn merge_all(
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
        let choices = &mut choices[..len];
        tasks::try_for_each_piece_from(0, choices, &|begin, choices: &mut [i8]| {
            control.check()?;
            let clusters = &clusters[..len];
            build::run(
                isa,
                Choose {
                    clusters,
                    begin,
                    choices,
                },
            );
            Ok(())
        })?;
        pieces.resize(len.div_ceil(PIECE_SIZE), Piece::default());
        let mut round = Round {
            model,
            control,
            clusters: &clusters[..len],
            choices,
            forced: false,
        };
        let mut loss = round.count(pieces, 0)?;
        if loss == 0 || len > FREE_BELOW && loss < len / LEAST_SHARE {
            round.forced = true;
            loss = round.count(pieces, 0)?;
        }
        end -= loss;
        let pairs = &mut nodes[end..end + loss];
        round.merge(pieces, 0, &mut merged[..len - loss], pairs, end as u32)?;
        std::mem::swap(clusters, merged);
        len -= loss;
        if let Some(progress) = &control.progress {
            progress(ids.len() * (count - len) / count, ids.len());
        }
    }
    Ok(())
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

/// Clusters that have chosen.
struct Round<'a> {
    model: &'a Model,
    control: &'a BuildControl,
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
    fn count(&self, pieces: &mut [Piece], first: usize) -> Result<usize, BuildError> {
        if let [piece] = pieces {
            self.control.check()?;
            let range = self.range(first, 1);
            *piece = Piece::default();
            for i in range {
                let other = self.partner(i);
                piece.lasts += u32::from(other.is_some_and(|other| other < i));
                piece.firsts += u32::from(other.is_some_and(|other| other > i));
            }
            return Ok(piece.lasts as usize);
        }
        let middle = pieces.len() / 2;
        let (left, right) = pieces.split_at_mut(middle);
        let (left, right) = tasks::join(
            || self.count(left, first),
            || self.count(right, first + middle),
        );
        Ok(left? + right?)
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
    ) -> Result<(), BuildError> {
        if pieces.len() > 1 {
            let (left, right) = pieces.split_at(pieces.len() / 2);
            let lost: u32 = left.iter().map(|piece| piece.lasts).sum();
            let new: u32 = left.iter().map(|piece| piece.firsts).sum();
            let kept = self.range(first, left.len()).len() - lost as usize;
            let (merged_left, merged_right) = merged.split_at_mut(kept);
            let (nodes_left, nodes_right) = nodes.split_at_mut(new as usize);
            let (left, right) = tasks::join(
                || self.merge(left, first, merged_left, nodes_left, node),
                || {
                    let first = first + left.len();
                    self.merge(right, first, merged_right, nodes_right, node + new)
                },
            );
            return left.and(right);
        }
        self.control.check()?;
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
        Ok(())
    }
}

/// What happens to the clusters of a piece: how many are the first or the last of two that merge.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Piece {
    pub(super) firsts: u32,
    lasts: u32,
}
