//! A transfer function baked for one volume and one step: colour and opacity by index, the opacity
//! being that of a step.
//!
//! With α the opacity of one voxel's length and s the step in these lengths, a step has
//! 1 − (1 − α)^s = −expm1(s · ln1p(−α)).
//!
//! Invariant: the index of a value, and so what it looks like, is one sequence of f32 operations,
//! the same for a sample, for the bounds of a block and in every instruction set. So a block is
//! empty only if no sample in it can be seen.

use raywright_bvh::simd::GatherLanes;

use crate::{grid::Volume, transfer::TransferFunction};

/// Entries of a table if nobody wishes otherwise. More than the values of 8 bits, since values
/// between them occur too.
pub(crate) const DEFAULT_SIZE: usize = 1024;

/// What is interpolated between values is outside them by at most this much of the larger magnitude:
/// three interpolations, each a difference, a product and a sum, which are off by half an ulp of
/// twice that magnitude.
const ROUNDING: f32 = 16.0 * f32::EPSILON;

/// A colour of 1 in a table. Colours have 16 bits, so that lanes fetch all three at once.
pub(crate) const FULL_COLOUR: f32 = 65535.0;

/// A transfer function by index, over the values of a volume.
#[derive(Clone, Debug)]
pub(crate) struct BakedFunction {
    index: TableIndex,
    /// ln(1 − α) at each entry.
    pub(crate) logarithms: Vec<f64>,
    /// Red, green, blue at each entry in units of 1 / [`FULL_COLOUR`], and 0.
    pub(crate) colours: Vec<[u16; 4]>,
    /// How many entries before each are seen; one more than there are entries.
    lit_before: Vec<u32>,
    /// How far beyond the entries of values others are looked at.
    reach: usize,
}

impl BakedFunction {
    /// A table of `size` ≥ 2 entries.
    pub(crate) fn new(function: &TransferFunction, volume: &Volume, size: usize) -> Self {
        let [low, high] = volume.raw_range().map(f64::from);
        let [slope, intercept] = [volume.scale().slope, volume.scale().intercept].map(f64::from);
        let mut baked = Self {
            index: TableIndex::new(volume, size),
            logarithms: Vec::with_capacity(size),
            colours: Vec::with_capacity(size),
            lit_before: Vec::new(),
            reach: 0,
        };
        for index in 0..size {
            let raw = low + (high - low) * index as f64 / (size - 1) as f64;
            let [r, g, b, opacity] = function.at(raw * slope + intercept);
            let colour = |of: f64| (of * f64::from(FULL_COLOUR)).round() as u16;
            baked.logarithms.push((-opacity).ln_1p());
            baked.colours.push([colour(r), colour(g), colour(b), 0]);
        }
        baked.count_lit(&[]);
        baked
    }

    /// The same where the entries of `surfaces` are seen too, and entries up to `reach` beyond those
    /// of values are looked at.
    pub(crate) fn with(mut self, surfaces: &[usize], reach: usize) -> Self {
        self.reach = reach;
        self.count_lit(surfaces);
        self
    }

    fn count_lit(&mut self, surfaces: &[usize]) {
        let mut lit = 0;
        let seen = |(entry, &log): (usize, &f64)| log < 0.0 || surfaces.contains(&entry);
        let counts = self.logarithms.iter().enumerate().map(|entry| {
            let before = lit;
            lit += u32::from(seen(entry));
            before
        });
        self.lit_before = counts.collect();
        self.lit_before.push(lit);
    }

    /// What it looks like by steps of `step` > 0 lengths of a voxel.
    pub(crate) fn table(&self, step: f32) -> TransferTable<'_> {
        let of_step = |&log: &f64| -(f64::from(step) * log).exp_m1() as f32;
        TransferTable {
            index: self.index,
            opacities: self.logarithms.iter().map(of_step).collect(),
            colours: &self.colours,
        }
    }

    /// How values become entries.
    pub(crate) fn index(&self) -> TableIndex {
        self.index
    }

    /// Whether nothing can be seen of what has the entries from `first` to `last`, however long
    /// steps are. A range without an entry is.
    pub(crate) fn is_transparent(&self, [first, last]: [u16; 2]) -> bool {
        if first > last {
            return true;
        }
        let first = (first as usize).saturating_sub(self.reach);
        let last = (last as usize + self.reach).min(self.logarithms.len() - 1);
        self.lit_before[first] == self.lit_before[last + 1]
    }
}

/// A transfer function baked for a step.
#[derive(Clone, Debug)]
pub(crate) struct TransferTable<'a> {
    pub(crate) index: TableIndex,
    /// The opacity of a step at each entry.
    pub(crate) opacities: Vec<f32>,
    /// Red, green, blue at each entry in units of 1 / [`FULL_COLOUR`], and 0.
    pub(crate) colours: &'a [[u16; 4]],
}

/// The entry of a raw value: raw · scale + offset, limited and rounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TableIndex {
    pub(crate) scale: f32,
    pub(crate) offset: f32,
    /// The last entry.
    pub(crate) last: f32,
}

impl TableIndex {
    /// For the values of a volume in a table of `size` ≥ 2 entries, at most 2^16.
    pub(crate) fn new(volume: &Volume, size: usize) -> Self {
        let [low, high] = volume.raw_range();
        let last = (size - 1) as f32;
        let scale = if high > low { last / (high - low) } else { 0.0 };
        Self {
            scale,
            offset: -low * scale,
            last,
        }
    }

    /// The entry of a raw value; NaN has the first.
    pub(crate) fn of(&self, raw: f32) -> usize {
        let place = raw * self.scale + self.offset;
        // As lanes do it: NaN becomes the second operand.
        let place = if place > 0.0 { place } else { 0.0 };
        let place = if place < self.last { place } else { self.last };
        place.round_ties_even() as usize
    }

    /// The entries of raw values in lanes.
    #[inline(always)]
    pub(crate) fn lanes<const N: usize, L: GatherLanes<N>>(&self, raw: L) -> L::Int {
        // The first operand of max() is dropped if it is NaN.
        let place = raw.mul(L::splat(self.scale)).add(L::splat(self.offset));
        place.max(L::splat(0.0)).min(L::splat(self.last)).round()
    }

    /// The first and last entry that what is interpolated from raw values from `low` to `high` can
    /// have, rounding included. Of equal values the same is interpolated, without rounding.
    pub(crate) fn range(&self, low: f32, high: f32) -> [u16; 2] {
        let error = if low < high {
            ROUNDING * low.abs().max(high.abs())
        } else {
            0.0
        };
        [self.of(low - error) as u16, self.of(high + error) as u16]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        grid::{ValueScale, Voxels},
        transfer::ControlPoint,
    };

    fn volume(values: Vec<f32>) -> Volume {
        let scale = ValueScale {
            slope: 2.0,
            intercept: -1.0,
        };
        Volume::new([values.len(), 1, 1], [1.0; 3], Voxels::F32(values), scale).unwrap()
    }

    fn function(points: &[[f32; 5]]) -> TransferFunction {
        let points: Vec<ControlPoint> = points.iter().map(|&p| p.into()).collect();
        TransferFunction::new(points).unwrap()
    }

    #[test]
    fn opacity_of_a_step_compounds() {
        let function = function(&[[0.0, 1.0, 0.5, 0.25, 0.3], [9.0, 0.0, 0.0, 0.0, 1.0]]);
        for step in [0.125, 0.5, 1.0, 3.0] {
            let baked = BakedFunction::new(&function, &volume(vec![0.5, 5.0]), 256);
            let table = baked.table(step);
            let expected = 1.0 - 0.7_f64.powf(f64::from(step));
            assert!((f64::from(table.opacities[0]) - expected).abs() < 1e-7);
            assert_eq!(table.opacities[255], 1.0, "opaque stays opaque");
            assert_eq!(table.colours[0], [65535, 32768, 16384, 0]);
        }
    }

    #[test]
    fn tiny_opacities_keep_their_digits() {
        let function = function(&[[0.0, 1.0, 1.0, 1.0, 1e-7]]);
        let baked = BakedFunction::new(&function, &volume(vec![0.0, 1.0]), 16);
        let table = baked.table(0.25);
        assert!(
            (table.opacities[3] / 2.5e-8 - 1.0).abs() < 1e-5,
            "{}",
            table.opacities[3]
        );
    }

    #[test]
    fn transparent_is_what_no_entry_near_shows() {
        // Opaque in 4.0..4.1 (raw 2.5..2.55) alone.
        let points = [
            [4.0, 0.0, 0.0, 0.0, 0.0],
            [4.0, 1.0, 1.0, 1.0, 1.0],
            [4.1, 1.0, 1.0, 1.0, 1.0],
            [4.1, 0.0, 0.0, 0.0, 0.0],
        ];
        let baked = BakedFunction::new(&function(&points), &volume(vec![0.0, 10.0]), 1024);
        let table = baked.table(1.0);
        let is_transparent = |low, high| baked.is_transparent(table.index.range(low, high));
        assert!(is_transparent(0.0, 2.48));
        // Equal values are never interpolated to others.
        let first_lit = table
            .opacities
            .iter()
            .position(|&opacity| opacity > 0.0)
            .unwrap();
        let raw_of = |index: usize| index as f32 * 10.0 / 1023.0;
        assert!(is_transparent(raw_of(first_lit - 1), raw_of(first_lit - 1)));
        assert!(!is_transparent(raw_of(first_lit), raw_of(first_lit)));
        assert!(!is_transparent(0.0, 10.0), "a value that no voxel has");
        assert!(!is_transparent(2.0, 2.52));
        assert!(is_transparent(2.58, 10.0));
    }

    #[test]
    fn a_constant_volume_has_the_first_entry() {
        let baked = BakedFunction::new(&function(&[[0.0; 5]]), &volume(vec![3.0, 3.0]), 8);
        let index = baked.index();
        assert_eq!([3.0, 0.0, 9.0, f32::NAN].map(|raw| index.of(raw)), [0; 4]);
        assert!(baked.is_transparent(index.range(3.0, 3.0)));
    }
}
