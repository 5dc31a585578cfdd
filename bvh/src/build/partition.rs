//! Divides a range of references in two, and finds the bounds of both sides on the way.
//!
//! Small ranges are divided in place by two pointers. Large ones are divided by all threads from
//! one buffer into the other: pieces are counted, every piece gets its place on either side, and
//! all are copied at once. The order within a side differs between the two and has no influence on
//! the tree (leaves are sorted).

use super::{
    binning::Split,
    primitive::{PrimitiveRef, RangeBounds},
    tasks,
};

/// The two sides of a partition.
pub(crate) struct Partition {
    /// How many references are on the left.
    pub(crate) left: usize,
    pub(crate) bounds: [RangeBounds; 2],
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

/// Divides from one buffer into another of the same length, in pieces.
pub(crate) fn into_buffer(
    from: &[PrimitiveRef],
    to: &mut [PrimitiveRef],
    split: &Split,
) -> Partition {
    let pieces: Vec<&[PrimitiveRef]> = from.chunks(tasks::PIECE_SIZE).collect();
    let mut lefts = vec![0; pieces.len()];
    count_left(&pieces, &mut lefts, split);
    let left = lefts.iter().sum();
    let (to_left, to_right) = to.split_at_mut(left);
    let bounds = copy_pieces(&pieces, &lefts, [to_left, to_right], split);
    Partition { left, bounds }
}

fn count_left(pieces: &[&[PrimitiveRef]], lefts: &mut [usize], split: &Split) {
    if let ([piece], [left]) = (pieces, &mut *lefts) {
        *left = piece.iter().filter(|r| split.is_left(r)).count();
        return;
    }
    let middle = pieces.len() / 2;
    let (a, b) = pieces.split_at(middle);
    let (lefts_a, lefts_b) = lefts.split_at_mut(middle);
    tasks::join(
        || count_left(a, lefts_a, split),
        || count_left(b, lefts_b, split),
    );
}

fn copy_pieces(
    pieces: &[&[PrimitiveRef]],
    lefts: &[usize],
    [to_left, to_right]: [&mut [PrimitiveRef]; 2],
    split: &Split,
) -> [RangeBounds; 2] {
    if let [piece] = pieces {
        let mut bounds = [RangeBounds::EMPTY; 2];
        let (mut left, mut right) = (to_left.iter_mut(), to_right.iter_mut());
        for reference in *piece {
            let side = usize::from(!split.is_left(reference));
            bounds[side].extend(reference);
            // The counts were taken with the same test, so that neither side runs out.
            if let Some(place) = if side == 0 { left.next() } else { right.next() } {
                *place = *reference;
            }
        }
        return bounds;
    }
    let middle = pieces.len() / 2;
    let left_count: usize = lefts[..middle].iter().sum();
    let right_count = pieces[..middle].iter().map(|p| p.len()).sum::<usize>() - left_count;
    let (left_a, left_b) = to_left.split_at_mut(left_count);
    let (right_a, right_b) = to_right.split_at_mut(right_count);
    let (a, b) = tasks::join(
        || {
            copy_pieces(
                &pieces[..middle],
                &lefts[..middle],
                [left_a, right_a],
                split,
            )
        },
        || {
            copy_pieces(
                &pieces[middle..],
                &lefts[middle..],
                [left_b, right_b],
                split,
            )
        },
    );
    [a[0].merge(b[0]), a[1].merge(b[1])]
}
