//! How far the nearest block is in which something can be seen: the largest of the distances along
//! the axes, in blocks (Chebyshev). A ray in a block at distance d may move d − 1 blocks along every
//! axis, and to the end of its own, without meeting anything.
//!
//! The cubes of distance d are the lit blocks after d dilations by a cube, and a dilation is three
//! along the axes, of 64 blocks at a time (van den Boomgaard, van Balen, *Methods for Fast
//! Morphological Image Transforms Using Bitmapped Binary Images*, 1992).

use crate::{blocks::Blocks, table::BakedFunction};

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
    /// What `function` shows of the blocks.
    pub(crate) fn new(blocks: &Blocks, function: &BakedFunction) -> Self {
        let mut distances = distances(blocks.lit(function), blocks.dims);
        distances.extend([0; 3]);
        Self {
            distances,
            dims: blocks.dims,
            shift: blocks.shift,
        }
    }
}

/// The distance of every block, 0 for lit ones, at most 255.
fn distances(lit: impl Iterator<Item = bool>, [across, down, layers]: [usize; 3]) -> Vec<u8> {
    let words = across.div_ceil(64);
    let last_word = u64::MAX >> (words * 64 - across);
    let mut distances = vec![u8::MAX; across * down * layers];
    let mut reached = vec![0_u64; words * down * layers];
    for (index, lit) in lit.enumerate() {
        if lit {
            distances[index] = 0;
            reached[index / across * words + index % across / 64] |= 1 << (index % across % 64);
        }
    }
    let mut wider = reached.clone();
    let mut scratch = reached.clone();
    for distance in 1..u8::MAX {
        for row in wider.chunks_exact_mut(words) {
            dilate_row(row);
            row[words - 1] &= last_word;
        }
        for (from, to) in wider
            .chunks_exact(words * down)
            .zip(scratch.chunks_exact_mut(words * down))
        {
            dilate(from, to, words);
        }
        dilate(&scratch, &mut wider, words * down);
        let mut is_done = true;
        for (word, (old, new)) in reached.iter_mut().zip(&wider).enumerate() {
            let mut found = new & !*old;
            is_done &= found == 0;
            let first = word / words * across + word % words * 64;
            while found != 0 {
                distances[first + found.trailing_zeros() as usize] = distance;
                found &= found - 1;
            }
            *old = *new;
        }
        if is_done {
            break;
        }
    }
    distances
}

/// Sets every bit beside one that is set.
fn dilate_row(row: &mut [u64]) {
    let mut before = 0;
    for word in 0..row.len() {
        let own = row[word];
        let after = row.get(word + 1).map_or(0, |next| next << 63);
        row[word] = own | own << 1 | own >> 1 | before | after;
        before = own >> 63;
    }
}

/// Each word with those `stride` words before and behind it.
fn dilate(from: &[u64], to: &mut [u64], stride: usize) {
    to.copy_from_slice(from);
    let inner = from.len() - stride;
    for (to, from) in to[stride..].iter_mut().zip(from) {
        *to |= from;
    }
    for (to, from) in to[..inner].iter_mut().zip(&from[stride..]) {
        *to |= from;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn distances_are_those_of_asking_every_block(
            dims in (1usize..150, 1usize..7, 1usize..7).prop_map(|(x, y, z)| [x, y, z]),
            seed in prop::collection::vec(0u8..60, 150 * 36),
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
            prop_assert_eq!(distances(lit.iter().copied(), dims), expected);
        }
    }
}
