//! Blocks of voxels and the bounds of what interpolation can find in them.
//!
//! A block owns cells, not voxels: cell i lies between voxels i and i + 1, and belongs to block
//! i / edge. So its bounds take in one layer of voxels more than it has cells.
//!
//! Invariant: the bounds of a block contain every voxel value that a sample in one of its cells is
//! interpolated from, NaN aside.

use rayon::prelude::*;

use crate::{
    grid::{Volume, Voxels},
    table::{BakedFunction, TableIndex},
};

/// The blocks of a volume, by what can be looked up in them.
#[derive(Clone, Debug)]
pub(crate) struct Blocks {
    /// Binary logarithm of the cells along an edge.
    pub(crate) shift: u32,
    /// Blocks along x, y, z.
    pub(crate) dims: [usize; 3],
    index: TableIndex,
    /// First and last entry that samples can have, x fastest; none where all voxels are missing.
    entries: Vec<[u16; 2]>,
}

impl Blocks {
    /// Blocks of 2^`shift` cells along each edge, for tables with this index.
    pub(crate) fn new(volume: &Volume, shift: u32, index: TableIndex) -> Self {
        let (dims, bounds) = bounds(volume, shift);
        let entries = |&[low, high]: &[f32; 2]| {
            if low <= high {
                index.range(low, high)
            } else {
                NO_ENTRIES
            }
        };
        Self {
            shift,
            dims,
            index,
            entries: bounds.par_iter().map(entries).collect(),
        }
    }

    /// For each block, whether something can be seen in it.
    pub(crate) fn lit<'a>(
        &'a self,
        function: &'a BakedFunction,
    ) -> impl Iterator<Item = bool> + 'a {
        debug_assert_eq!(self.index, function.index(), "another table");
        self.entries
            .iter()
            .map(|&range| !function.is_transparent(range))
    }
}

/// Blocks along x, y, z, and their smallest and largest raw values; +∞ and −∞ where all are missing.
fn bounds(volume: &Volume, shift: u32) -> ([usize; 3], Vec<[f32; 2]>) {
    let dims = volume.dims().map(|n| (n - 1).max(1).div_ceil(1 << shift));
    let bounds = match volume.padded() {
        Voxels::U8(values) => bounds_of(values, volume.dims(), dims, shift),
        Voxels::U16(values) => bounds_of(values, volume.dims(), dims, shift),
        Voxels::F32(values) => bounds_of(values, volume.dims(), dims, shift),
    };
    (dims, bounds)
}

/// A range without an entry.
const NO_ENTRIES: [u16; 2] = [1, 0];

/// The bounds of blocks, layer by layer of blocks in parallel.
fn bounds_of<T: Copy + PartialOrd + Into<f32> + Sync>(
    values: &[T],
    [width, height, depth]: [usize; 3],
    [across, down, layers]: [usize; 3],
    shift: u32,
) -> Vec<[f32; 2]> {
    let edge = 1 << shift;
    let mut bounds = vec![[f32::INFINITY, f32::NEG_INFINITY]; across * down * layers];
    bounds
        .par_chunks_mut(across * down)
        .enumerate()
        .for_each(|(layer, bounds)| {
            for z in layer * edge..=((layer + 1) * edge).min(depth - 1) {
                for y in 0..height {
                    let row = &values[(z * height + y) * width..][..width];
                    // A row on the border of two blocks bounds both.
                    let own = y >> shift;
                    let before = if y % edge == 0 {
                        own.saturating_sub(1)
                    } else {
                        own
                    };
                    let rows = before..=own.min(down - 1);
                    for x in 0..across {
                        let end = ((x + 1) * edge + 1).min(width);
                        let [low, high] = range(&row[x * edge..end]);
                        for block in rows.clone() {
                            let [block_low, block_high] = &mut bounds[block * across + x];
                            *block_low = block_low.min(low);
                            *block_high = block_high.max(high);
                        }
                    }
                }
            }
        });
    bounds
}

/// The smallest and largest of values, of those that are not NaN; +∞ and −∞ if there is none.
fn range<T: Copy + PartialOrd + Into<f32>>(values: &[T]) -> [f32; 2] {
    values
        .iter()
        .fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], &value| {
            let value: f32 = value.into();
            [
                if value < low { value } else { low },
                if value > high { value } else { high },
            ]
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::ValueScale;

    #[test]
    fn bounds_are_those_of_all_voxels_around_the_cells() {
        for dims in [[1, 1, 1], [2, 1, 5], [8, 9, 10], [17, 16, 3], [5, 33, 4]] {
            let count = dims.iter().product::<usize>();
            let values: Vec<u16> = (0..count).map(|i| (i * 7919 % 1009) as u16).collect();
            let voxels = Voxels::U16(values.clone());
            let volume = Volume::new(dims, [1.0; 3], voxels, ValueScale::default()).unwrap();
            for shift in [1, 2, 3] {
                let (block_dims, found) = bounds(&volume, shift);
                let mut expected = vec![[f32::INFINITY, f32::NEG_INFINITY]; found.len()];
                let cells = dims.map(|n: usize| (n - 1).max(1));
                for z in 0..cells[2] {
                    for y in 0..cells[1] {
                        for x in 0..cells[0] {
                            let [bx, by, bz] = [x, y, z].map(|i| i >> shift);
                            let block = (bz * block_dims[1] + by) * block_dims[0] + bx;
                            for corner in 0..8 {
                                let at = |i: usize, axis: usize| {
                                    (i + (corner >> axis & 1)).min(dims[axis] - 1)
                                };
                                let index = (at(z, 2) * dims[1] + at(y, 1)) * dims[0] + at(x, 0);
                                let value = f32::from(values[index]);
                                let [low, high] = &mut expected[block];
                                *low = low.min(value);
                                *high = high.max(value);
                            }
                        }
                    }
                }
                assert_eq!(found, expected, "{dims:?} {shift}");
            }
        }
    }
}
