//! What is in a block of voxels: a histogram of values, and what a transfer function makes of it.
//!
//! After Bruder, Frey, Ertl, *Real-Time Performance Prediction and Tuning for Interactive Volume
//! Raycasting*, 2016, section 5: 64 bins of values per block, found once per volume; per transfer
//! function, 16 bins of opacities of one byte. Where the paper is silent: bin 0 holds what is
//! exactly transparent; the others are cut linearly and stand for their middles, as the paper's seem
//! to, or are cut by the cube root of the opacity, since clouds have opacities of a few thousandths,
//! and stand for the mean of what fell into them.
//!
//! Beside the paper, the mean extinction of a block: −ln(1 − α), averaged over its voxels.
//!
//! Invariants: every voxel is counted once, in the block that owns it, except where it has no value;
//! a count above 0 stays above 0 in a byte. Histograms are for estimates: what can be skipped is
//! decided by `blocks`.

use rayon::prelude::*;

use crate::{
    blocks::Blocks,
    grid::{Volume, VoxelSlice},
    transfer::TransferFunction,
};

/// Bins of values.
pub(crate) const VALUE_BINS: usize = 64;

/// Bins of opacities.
pub(crate) const OPACITY_BINS: usize = 16;

/// Opacities above this count as this: extinction would be infinite.
const MOST_OPACITY: f64 = 0.9999;

/// Histograms of values of all blocks.
#[derive(Clone, Debug)]
pub(crate) struct Histograms {
    counts: Vec<[u16; VALUE_BINS]>,
    /// How many values each block has.
    totals: Vec<u32>,
    /// The values between which the bins lie.
    range: [f64; 2],
}

impl Histograms {
    /// Histograms of the blocks of `blocks`. The last voxel along an axis, which has no cell of its
    /// own, belongs to the last block.
    pub(crate) fn new(volume: &Volume, blocks: &Blocks) -> Self {
        let (dims, shift) = (blocks.dims, blocks.shift);
        // 33³ voxels can be counted.
        assert!(shift <= 5, "blocks are small");
        let raw_range = volume.raw_range();
        let counts = match volume.voxels() {
            VoxelSlice::U8(values) => count(values, volume.dims(), dims, shift, raw_range),
            VoxelSlice::U16(values) => count(values, volume.dims(), dims, shift, raw_range),
            VoxelSlice::F32(values) => count(values, volume.dims(), dims, shift, raw_range),
        };
        let total = |counts: &[u16; VALUE_BINS]| counts.iter().copied().map(u32::from).sum();
        Self {
            totals: counts.iter().map(total).collect(),
            counts,
            range: raw_range.map(|raw| f64::from(volume.value_of(raw))),
        }
    }

    /// The mean opacity of each bin of values by a transfer function.
    fn bin_opacities(&self, function: &TransferFunction) -> [f64; VALUE_BINS] {
        let [start, end] = self.range;
        let edge = |bin: usize| start + (end - start) * bin as f64 / VALUE_BINS as f64;
        std::array::from_fn(|bin| function.mean_opacity(edge(bin), edge(bin + 1)))
    }

    /// Histograms of opacities of all blocks.
    pub(crate) fn opacities(&self, function: &TransferFunction, cut: Cut) -> OpacityHistograms {
        let opacities = self.bin_opacities(function);
        let bins = opacities.map(|opacity| cut.bin(opacity));
        let (mut sums, mut totals) = ([0.0; OPACITY_BINS], [0.0; OPACITY_BINS]);
        let counts = self.counts.iter().map(|values| {
            let mut counts = [0_u32; OPACITY_BINS];
            for (bin, &n) in values.iter().enumerate() {
                counts[bins[bin]] += u32::from(n);
                sums[bins[bin]] += f64::from(n) * opacities[bin];
                totals[bins[bin]] += f64::from(n);
            }
            bytes(&counts)
        });
        OpacityHistograms {
            counts: counts.collect(),
            opacities: std::array::from_fn(|bin| match (bin, cut) {
                (0, _) => 0.0,
                (_, Cut::Linear) => (bin as f32 - 0.5) / (OPACITY_BINS - 1) as f32,
                _ if totals[bin] == 0.0 => 0.0,
                _ => (sums[bin] / totals[bin]) as f32,
            }),
        }
    }

    /// The mean extinction per length of a voxel of all blocks.
    pub(crate) fn extinctions(&self, function: &TransferFunction) -> Vec<f32> {
        let of_bin = self
            .bin_opacities(function)
            .map(|opacity| -(-opacity.min(MOST_OPACITY)).ln_1p());
        self.means(&of_bin)
    }

    /// The share of voxels of which something is seen, of all blocks.
    pub(crate) fn seen_shares(&self, function: &TransferFunction) -> Vec<f32> {
        let is_seen = |opacity| f64::from(u8::from(opacity > 0.0));
        self.means(&self.bin_opacities(function).map(is_seen))
    }

    /// The mean over the voxels of each block of what their bins have.
    fn means(&self, of_bin: &[f64; VALUE_BINS]) -> Vec<f32> {
        let mean = |(values, &total): (&[u16; VALUE_BINS], &u32)| {
            if total == 0 {
                return 0.0;
            }
            // Sums beside each other: additions of one would wait for each other.
            let mut sums = [0.0; 8];
            let eights = values.chunks_exact(8).zip(of_bin.chunks_exact(8));
            for (counts, means) in eights {
                for ((sum, &n), mean) in sums.iter_mut().zip(counts).zip(means) {
                    *sum += f64::from(n) * mean;
                }
            }
            (sums.iter().sum::<f64>() / f64::from(total)) as f32
        };
        self.counts.iter().zip(&self.totals).map(mean).collect()
    }
}

/// How opacities are cut into bins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cut {
    /// In equal parts.
    Linear,
    /// In equal parts of the cube root.
    CubeRoot,
}

impl Cut {
    fn bin(self, opacity: f64) -> usize {
        let parts = (OPACITY_BINS - 1) as f64;
        let place = match self {
            _ if opacity <= 0.0 => return 0,
            Self::Linear => opacity,
            Self::CubeRoot => opacity.cbrt(),
        };
        1 + ((parts * place) as usize).min(OPACITY_BINS - 2)
    }
}

/// Histograms of opacities.
#[derive(Clone, Debug)]
pub(crate) struct OpacityHistograms {
    /// Shares of 255; all 0 for a block without values.
    counts: Vec<[u8; OPACITY_BINS]>,
    /// What each bin stands for.
    opacities: [f32; OPACITY_BINS],
}

impl OpacityHistograms {
    /// A random opacity of a block, by a number in 0..1.
    pub(crate) fn draw(&self, block: usize, unit: f32) -> f32 {
        let mut place = unit * 255.0;
        for (&count, &opacity) in self.counts[block].iter().zip(&self.opacities) {
            if place < f32::from(count) {
                return opacity;
            }
            place -= f32::from(count);
        }
        0.0
    }
}

/// Counts as shares of 255, by the largest remainders.
fn bytes(counts: &[u32; OPACITY_BINS]) -> [u8; OPACITY_BINS] {
    let total: u32 = counts.iter().sum();
    if total == 0 {
        return [0; OPACITY_BINS];
    }
    // What is there at all has at least 1.
    let mut shares = counts.map(|n| (n * 255 / total).max(u32::from(n > 0)));
    let given: u32 = shares.iter().sum();
    let remainder = |bin: usize| counts[bin] * 255 % total;
    let mut order: [usize; OPACITY_BINS] = std::array::from_fn(|bin| bin);
    order.sort_by_key(|&bin| std::cmp::Reverse((remainder(bin), counts[bin])));
    for &bin in order
        .iter()
        .cycle()
        .take(255_usize.saturating_sub(given as usize))
    {
        shares[bin] += u32::from(counts[bin] > 0);
    }
    // Too many were given where many bins have next to nothing: the largest can do without.
    for _ in 255..shares.iter().sum() {
        if let Some(largest) = shares.iter_mut().max() {
            *largest -= 1;
        }
    }
    shares.map(|share| share as u8)
}

fn count<T: Copy + Into<f32> + Sync>(
    values: &[T],
    [width, height, depth]: [usize; 3],
    [across, down, layers]: [usize; 3],
    shift: u32,
    [low, high]: [f32; 2],
) -> Vec<[u16; VALUE_BINS]> {
    let scale = if high > low {
        VALUE_BINS as f32 / (high - low)
    } else {
        0.0
    };
    let owned = |block: usize, blocks: usize, size: usize| {
        let end = (block + 1) << shift;
        block << shift..if block + 1 == blocks { size } else { end }
    };
    let mut counts = vec![[0; VALUE_BINS]; across * down * layers];
    counts
        .par_chunks_mut(across * down)
        .enumerate()
        .for_each(|(layer, counts)| {
            for z in owned(layer, layers, depth) {
                for y in 0..height {
                    let row = &values[(z * height + y) * width..][..width];
                    let line = (y >> shift).min(down - 1);
                    let blocks = &mut counts[line * across..][..across];
                    for (block, counts) in blocks.iter_mut().enumerate() {
                        for &value in &row[owned(block, across, width)] {
                            let value: f32 = value.into();
                            if value.is_nan() {
                                continue;
                            }
                            let bin = ((value - low) * scale) as usize;
                            counts[bin.min(VALUE_BINS - 1)] += 1;
                        }
                    }
                }
            }
        });
    counts
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::table::{DEFAULT_SIZE, TableIndex};
    use crate::{
        grid::{ValueScale, Voxels},
        transfer::ControlPoint,
    };

    proptest! {
        #[test]
        fn shares_sum_to_255_and_keep_what_is_there(
            counts in prop::array::uniform16(prop_oneof![Just(0_u32), 1u32..40, 1u32..32768]),
        ) {
            let shares = bytes(&counts);
            let total: u32 = counts.iter().sum();
            prop_assert_eq!(shares.iter().map(|&s| u32::from(s)).sum::<u32>(), if total > 0 { 255 } else { 0 });
            for (share, count) in shares.iter().zip(counts) {
                prop_assert_eq!(*share > 0, count > 0);
                let exact = f64::from(count) * 255.0 / f64::from(total.max(1));
                prop_assert!((f64::from(*share) - exact).abs() < 16.0);
            }
        }
    }

    fn ramp() -> TransferFunction {
        let point = |value, opacity| ControlPoint {
            value,
            colour: [1.0; 3],
            opacity,
        };
        TransferFunction::new(vec![point(0.0, 0.0), point(64.0, 0.0), point(128.0, 0.5)]).unwrap()
    }

    fn volume(slope: f32) -> Volume {
        // Two blocks: all of 0, and half of 0 and half of 128.
        let values = (0..33 * 17 * 17).map(|i| if i % 33 >= 25 { 128 } else { 0 });
        let scale = ValueScale {
            slope,
            intercept: if slope < 0.0 { 128.0 } else { 0.0 },
        };
        Volume::new([33, 17, 17], [1.0; 3], Voxels::U8(values.collect()), scale).unwrap()
    }

    fn histograms(slope: f32) -> Histograms {
        let volume = volume(slope);
        let index = TableIndex::new(&volume, DEFAULT_SIZE);
        Histograms::new(&volume, &Blocks::new(&volume, 4, index))
    }

    #[test]
    fn extinction_is_the_mean_over_the_voxels() {
        let histograms = histograms(1.0);
        assert_eq!(histograms.counts.len(), 2);
        assert_eq!(histograms.counts[0][0], 16 * 17 * 17);
        assert_eq!(histograms.counts[1][0], 9 * 17 * 17);
        assert_eq!(histograms.counts[1][VALUE_BINS - 1], 8 * 17 * 17);
        let extinctions = histograms.extinctions(&ramp());
        // The last bin holds opacities from 0.4844 to 0.5.
        let expected = -(1.0_f32 - 0.492_187_5).ln();
        assert!(extinctions[0] == 0.0 && (extinctions[1] - expected * 8.0 / 17.0).abs() < 1e-6);
        let seen = histograms.seen_shares(&ramp());
        assert!(seen[0] == 0.0 && (seen[1] - 8.0 / 17.0).abs() < 1e-6);
        // With the values turned round, what was 0 is 128.
        let turned = self::histograms(-1.0).extinctions(&ramp());
        assert!((turned[0] - expected).abs() < 1e-6, "{turned:?}");
    }

    #[test]
    fn drawn_opacities_are_those_of_the_block() {
        let histograms = histograms(1.0);
        for cut in [Cut::Linear, Cut::CubeRoot] {
            let opacities = histograms.opacities(&ramp(), cut);
            let drawn = |block: usize| {
                (0..1000)
                    .map(|i| i as f32 / 1000.0)
                    .map(|unit| opacities.draw(block, unit))
                    .collect::<Vec<_>>()
            };
            assert!(drawn(0).iter().all(|&opacity| opacity == 0.0));
            let lit: Vec<f32> = drawn(1).into_iter().filter(|&o| o > 0.0).collect();
            assert!(lit.len().abs_diff(470) < 5, "{}", lit.len());
            let expected = match cut {
                Cut::Linear => 7.5 / 15.0,
                Cut::CubeRoot => 0.492_187_5,
            };
            assert!(lit.iter().all(|o| (o - expected).abs() < 1e-6));
        }
        assert_eq!(
            [0.0, 1e-9, 0.05, 1.0].map(|o| Cut::Linear.bin(o)),
            [0, 1, 1, 15]
        );
        assert_eq!(
            [0.0, 1e-9, 0.05, 1.0].map(|o| Cut::CubeRoot.bin(o)),
            [0, 1, 6, 15]
        );
    }
}
