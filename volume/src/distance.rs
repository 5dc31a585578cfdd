//! How far the nearest block is in which something can be seen: the largest of the distances along
//! the axes, in blocks (Chebyshev). A ray in a block at distance d may move d − 1 blocks along every
//! axis, and to the end of its own, without meeting anything.
//!
//! Two passes over the blocks, each looking at the thirteen neighbours that it has passed, are exact
//! for this distance: Rosenfeld, Pfaltz, *Sequential Operations in Digital Picture Processing*,
//! 1966.

use crate::{blocks::Blocks, table::TransferTable};

/// The distances of the blocks of a volume.
#[derive(Clone, Debug)]
pub(crate) struct DistanceMap {
    /// In blocks, and three items more: words of four bytes are read.
    pub(crate) distances: Vec<u8>,
    /// Blocks along x, y, z.
    pub(crate) dims: [usize; 3],
    /// Binary logarithm of the cells along the edge of a block.
    pub(crate) shift: u32,
}

impl DistanceMap {
    /// What `table` shows of the blocks.
    pub(crate) fn new(blocks: &Blocks, table: &TransferTable) -> Self {
        let mut distances = distances(&blocks.lit(table), blocks.dims);
        distances.extend([0; 3]);
        Self {
            distances,
            dims: blocks.dims,
            shift: blocks.shift,
        }
    }
}

/// The distance of every block, 0 for lit ones, at most 255.
fn distances(lit: &[bool], [across, down, layers]: [usize; 3]) -> Vec<u8> {
    let mut distances: Vec<u8> = lit
        .iter()
        .map(|&lit| if lit { 0 } else { u8::MAX })
        .collect();
    let count = distances.len();
    for backward in [false, true] {
        for step in 0..count {
            let index = if backward { count - 1 - step } else { step };
            if distances[index] == 0 {
                continue;
            }
            let [x, y, z] = [
                index % across,
                index / across % down,
                index / (across * down),
            ];
            let mut nearest = u8::MAX;
            for (dx, dy, dz) in PASSED {
                let sign = if backward { -1 } else { 1 };
                let at = [
                    x.wrapping_add_signed(sign * dx),
                    y.wrapping_add_signed(sign * dy),
                    z.wrapping_add_signed(sign * dz),
                ];
                if at[0] < across && at[1] < down && at[2] < layers {
                    nearest = nearest.min(distances[(at[2] * down + at[1]) * across + at[0]]);
                }
            }
            distances[index] = distances[index].min(nearest.saturating_add(1));
        }
    }
    distances
}

/// The neighbours that come before a block.
const PASSED: [(isize, isize, isize); 13] = [
    (-1, 0, 0),
    (-1, -1, 0),
    (0, -1, 0),
    (1, -1, 0),
    (-1, -1, -1),
    (0, -1, -1),
    (1, -1, -1),
    (-1, 0, -1),
    (0, 0, -1),
    (1, 0, -1),
    (-1, 1, -1),
    (0, 1, -1),
    (1, 1, -1),
];

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn distances_are_those_of_asking_every_block(
            dims in prop::array::uniform3(1usize..7),
            seed in prop::collection::vec(0u8..12, 216),
        ) {
            let count = dims.iter().product::<usize>();
            let lit: Vec<bool> = seed[..count].iter().map(|&s| s == 0).collect();
            let place = |i: usize| [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
            let expected: Vec<u8> = (0..count)
                .map(|from| {
                    let far = |to: usize| {
                        let pairs = place(from).into_iter().zip(place(to));
                        pairs.map(|(a, b)| a.abs_diff(b)).max().unwrap_or(0) as u8
                    };
                    (0..count).filter(|&to| lit[to]).map(far).min().unwrap_or(u8::MAX)
                })
                .collect();
            prop_assert_eq!(distances(&lit, dims), expected);
        }
    }
}
