//! Divides a range of references in two, and finds the bounds of both sides on the way.
//!
//! [`stable`] keeps the order within a side and has no branch that depends on the data. Large
//! ranges are divided by all threads from one buffer into the other: pieces are counted, every
//! piece gets its place on either side, and all are copied at once; the order is that of `stable`.
//! [`in_place`] is the classical exchange of two pointers that Embree uses, whose order its trees
//! with cut primitives depend on.

use super::{
    binning::Split,
    primitive::{Bounds, BoxLanes, PrimitiveRef, RangeBounds},
    tasks,
};
use crate::simd::{
    self, Isa,
    build::{EightLanes, Halves},
};

/// The two sides of a partition.
pub(crate) struct Partition {
    /// How many references are on the left.
    pub(crate) left: usize,
    pub(crate) bounds: [RangeBounds; 2],
}

impl Partition {
    /// A partition by a split that knows the boxes of its sides.
    fn new(left: usize, split: &Split, centroids: [Bounds; 2]) -> Self {
        let bounds = std::array::from_fn(|side| RangeBounds {
            geometry: split.sides[side],
            centroid: centroids[side],
        });
        Self { left, bounds }
    }
}

/// Divides in place: two pointers that walk towards each other.
pub(crate) fn in_place(
    references: &mut [PrimitiveRef],
    is_left: impl Fn(&PrimitiveRef) -> bool,
) -> Partition {
    let (mut left, mut right) = (0, references.len());
    let mut bounds = [RangeBounds::EMPTY; 2];
    loop {
        while left < right && is_left(&references[left]) {
            bounds[0].extend(&references[left]);
            left += 1;
        }
        while left < right && !is_left(&references[right - 1]) {
            bounds[1].extend(&references[right - 1]);
            right -= 1;
        }
        if left == right {
            return Partition { left, bounds };
        }
        references.swap(left, right - 1);
    }
}

/// Divides in place and keeps the order within each side; `scratch` is as long as `references`.
pub(crate) fn stable(
    references: &mut [PrimitiveRef],
    scratch: &mut [PrimitiveRef],
    split: &Split,
    isa: Isa,
) -> Partition {
    let kernel = Stable {
        references,
        scratch,
        split,
    };
    simd::build::run(isa, kernel)
}

struct Stable<'a> {
    references: &'a mut [PrimitiveRef],
    scratch: &'a mut [PrimitiveRef],
    split: &'a Split,
}

impl EightLanes for Stable<'_> {
    type Output = Partition;

    #[inline(always)]
    fn run<L: Halves>(self) -> Partition {
        let mut centroids = [L::of(&Bounds::EMPTY); 2];
        let (mut left, mut right) = (0, 0);
        let Self {
            references,
            scratch,
            split,
        } = self;
        let scratch = &mut scratch[..references.len()];
        for index in 0..references.len() {
            let behind = split.behind(&references[index]);
            let lanes = L::of(&references[index].0);
            // Both places are written; the counters say which of them counts. The left one has
            // been read already.
            references[left] = PrimitiveRef(lanes.to_bounds());
            scratch[right] = PrimitiveRef(lanes.to_bounds());
            let is_left = (behind.to_bits() >> 31) as usize;
            left += is_left;
            right += 1 - is_left;
            extend_side(&mut centroids, lanes.doubled_centroid(), behind);
        }
        references[left..].copy_from_slice(&scratch[..right]);
        Partition::new(left, split, centroids.map(BoxLanes::to_bounds))
    }
}

/// Adds a box to the first of two where `behind` is negative, otherwise to the second; without a
/// branch, since nobody can predict it: the other gets a box that changes nothing.
#[inline(always)]
fn extend_side<L: Halves>(sides: &mut [L; 2], bounds: L, behind: f32) {
    // A minimum with −∞ in place keeps the box and with +∞ drops it; they differ in the sign.
    let sign = behind.to_bits() & 1 << 31;
    let infinity = f32::INFINITY.to_bits();
    let (left, right) = (infinity | sign, infinity | sign ^ 1 << 31);
    sides[0] = sides[0].min(bounds.max(L::splat(f32::from_bits(left))));
    sides[1] = sides[1].min(bounds.max(L::splat(f32::from_bits(right))));
}

/// Divides from one buffer into another of the same length, in pieces. `lefts` is memory for the
/// number of references of each piece that go to the left.
pub(crate) fn into_buffer(
    from: &[PrimitiveRef],
    to: &mut [PrimitiveRef],
    split: &Split,
    isa: Isa,
    lefts: &mut Vec<usize>,
) -> Partition {
    lefts.clear();
    lefts.resize(from.len().div_ceil(tasks::PIECE_SIZE), 0);
    count_left(from, lefts, split);
    let left = lefts.iter().sum();
    let (to_left, to_right) = to.split_at_mut(left);
    let to_right = &mut to_right[..from.len() - left];
    let centroids = copy_pieces(from, lefts, [to_left, to_right], split, isa);
    Partition::new(left, split, centroids)
}

/// Counts in pieces, of which there are as many as places for the result.
fn count_left(from: &[PrimitiveRef], lefts: &mut [usize], split: &Split) {
    if let [left] = lefts {
        *left = from.iter().filter(|r| split.is_left(r)).count();
        return;
    }
    let middle = lefts.len() / 2;
    let (a, b) = from.split_at(middle * tasks::PIECE_SIZE);
    let (lefts_a, lefts_b) = lefts.split_at_mut(middle);
    tasks::join(
        || count_left(a, lefts_a, split),
        || count_left(b, lefts_b, split),
    );
}

fn copy_pieces(
    from: &[PrimitiveRef],
    lefts: &[usize],
    [to_left, to_right]: [&mut [PrimitiveRef]; 2],
    split: &Split,
    isa: Isa,
) -> [Bounds; 2] {
    if lefts.len() == 1 {
        let kernel = CopyPiece {
            piece: from,
            to_left,
            to_right,
            split,
        };
        return simd::build::run(isa, kernel);
    }
    let middle = lefts.len() / 2;
    let (from_a, from_b) = from.split_at(middle * tasks::PIECE_SIZE);
    let left_count: usize = lefts[..middle].iter().sum();
    let right_count = from_a.len() - left_count;
    let (left_a, left_b) = to_left.split_at_mut(left_count);
    let (right_a, right_b) = to_right.split_at_mut(right_count);
    let (lefts_a, lefts_b) = lefts.split_at(middle);
    let (a, b) = tasks::join(
        || copy_pieces(from_a, lefts_a, [left_a, right_a], split, isa),
        || copy_pieces(from_b, lefts_b, [left_b, right_b], split, isa),
    );
    std::array::from_fn(|side| {
        let mut bounds = a[side];
        bounds.extend(&b[side]);
        bounds
    })
}

struct CopyPiece<'a> {
    piece: &'a [PrimitiveRef],
    to_left: &'a mut [PrimitiveRef],
    to_right: &'a mut [PrimitiveRef],
    split: &'a Split,
}

impl EightLanes for CopyPiece<'_> {
    type Output = [Bounds; 2];

    #[inline(always)]
    fn run<L: Halves>(self) -> [Bounds; 2] {
        let mut centroids = [L::of(&Bounds::EMPTY); 2];
        let (mut left, mut right) = (self.to_left.iter_mut(), self.to_right.iter_mut());
        for reference in self.piece {
            let behind = self.split.behind(reference);
            let is_left = behind.is_sign_negative();
            let centroid = L::of(&reference.0).doubled_centroid();
            extend_side(&mut centroids, centroid, behind);
            // The counts were taken with the same test, so that neither side runs out.
            if let Some(place) = if is_left { left.next() } else { right.next() } {
                *place = *reference;
            }
        }
        centroids.map(BoxLanes::to_bounds)
    }
}
