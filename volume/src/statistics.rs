//! Mean and percentiles of a volume, by one pass over its voxels.
//!
//! Idea: a histogram of raw values. For integers it has a bin per value and everything is exact;
//! for floating-point numbers the range is cut into equal bins, and a percentile is known to one
//! bin. Voxels without a value count nowhere.

use crate::grid::{Volume, VoxelSlice};

/// Bins for 16 bits, and for floating-point numbers.
const BINS: usize = 1 << 16;

/// Mean and distribution of the values of a volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Statistics {
    /// The mean of all values; 0 if there is none.
    pub mean: f64,
    /// How many voxels have a value.
    pub present: u64,
    /// Voxels per bin, by ascending raw value.
    bins: Vec<u64>,
    /// The value in the middle of bin 0, and from there to the next.
    first: f64,
    step: f64,
}

impl Statistics {
    /// Looks at all voxels.
    #[must_use]
    pub fn of(volume: &Volume) -> Self {
        let [low, high] = volume.raw_range().map(f64::from);
        let mut bins = vec![0; BINS];
        let mut sum = 0.0;
        let (mut first, mut step) = (0.0, 1.0);
        match volume.voxels() {
            VoxelSlice::U8(values) => count(&mut bins, values),
            VoxelSlice::U16(values) => count(&mut bins, values),
            VoxelSlice::F32(values) => {
                step = (high - low) / (BINS - 1) as f64;
                first = low;
                let scale = if step > 0.0 { 1.0 / step } else { 0.0 };
                for &value in values.iter().filter(|value| !value.is_nan()) {
                    let value = f64::from(value);
                    sum += value;
                    // From 0 to BINS − 1, up to rounding.
                    let bin = ((value - low) * scale + 0.5) as usize;
                    bins[bin.min(BINS - 1)] += 1;
                }
            }
        }
        if !matches!(volume.voxels(), VoxelSlice::F32(_)) {
            let weighted = bins.iter().zip(0_u64..).map(|(&n, raw)| n * raw);
            sum = weighted.sum::<u64>() as f64;
        }
        let present: u64 = bins.iter().sum();
        let (slope, intercept) = (volume.scale().slope, volume.scale().intercept);
        let value = |raw: f64| raw * f64::from(slope) + f64::from(intercept);
        let raw_mean = sum / present.max(1) as f64;
        Self {
            mean: if present > 0 { value(raw_mean) } else { 0.0 },
            present,
            bins,
            first: value(first),
            step: step * f64::from(slope),
        }
    }

    /// The value that a share of the voxels does not exceed, 0 ≤ `share` ≤ 1.
    #[must_use]
    pub fn percentile(&self, share: f64) -> f64 {
        // A negative slope turns the order of raw values round.
        let ascending = self.step >= 0.0;
        let rank = (share.clamp(0.0, 1.0) * self.present as f64)
            .ceil()
            .max(1.0) as u64;
        let rank = if ascending {
            rank
        } else {
            (self.present + 1).saturating_sub(rank)
        };
        let mut seen = 0;
        let bin = self.bins.iter().position(|&n| {
            seen += n;
            seen >= rank
        });
        self.first + self.step * bin.unwrap_or(0) as f64
    }
}

fn count<T: Copy + Into<usize>>(bins: &mut [u64], values: &[T]) {
    for &value in values {
        bins[value.into()] += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{ValueScale, Voxels};

    fn of(voxels: Voxels, slope: f32, intercept: f32) -> Statistics {
        let scale = ValueScale { slope, intercept };
        let volume = Volume::new([voxels.len(), 1, 1], [1.0; 3], voxels, scale);
        Statistics::of(&volume.unwrap())
    }

    #[test]
    fn integers_are_exact() {
        let statistics = of(Voxels::U8(vec![4, 1, 2, 3]), 2.0, 10.0);
        assert_eq!((statistics.mean, statistics.present), (15.0, 4));
        let at = |share| statistics.percentile(share);
        assert_eq!(
            [0.0, 0.25, 0.26, 0.5, 1.0].map(at),
            [12.0, 12.0, 14.0, 14.0, 18.0]
        );
        let turned = of(Voxels::U16(vec![40_000, 1, 2, 3]), -1.0, 0.0);
        assert_eq!(
            [0.0, 0.25, 0.5, 1.0].map(|s| turned.percentile(s)),
            [-40_000.0, -40_000.0, -3.0, -1.0]
        );
    }

    #[test]
    fn missing_values_count_nowhere() {
        let statistics = of(Voxels::F32(vec![f32::NAN, 1.0, 3.0, 2.0]), 1.0, 0.0);
        assert_eq!((statistics.mean, statistics.present), (2.0, 3));
        assert!((statistics.percentile(0.5) - 2.0).abs() < 1e-4);
        assert_eq!(statistics.percentile(1.0), 3.0);
        let none = of(Voxels::F32(vec![f32::NAN]), 1.0, 5.0);
        assert_eq!((none.mean, none.present), (0.0, 0));
    }

    #[test]
    fn extremes() {
        let constant = of(Voxels::F32(vec![7.0; 3]), 1.0, 0.0);
        assert_eq!((constant.mean, constant.percentile(0.5)), (7.0, 7.0));
        let wide = of(Voxels::F32(vec![f32::MIN, f32::MAX]), 1.0, 0.0);
        assert_eq!(wide.mean, 0.0);
        assert_eq!(wide.percentile(0.0), f64::from(f32::MIN));
    }
}
