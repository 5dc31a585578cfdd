//! The integral of a transfer function over all values between two: what a step looks like whose ends
//! have these values.
//!
//! Engel, Kraus, Ertl, *High-Quality Pre-Integrated Volume Rendering Using Hardware-Accelerated Pixel
//! Shading*, 2001. With τ = −ln(1 − α) the extinction by value and T, C the integrals of τ and τ · colour
//! up to a value, a step of s lengths of a voxel from f to b has the opacity
//! 1 − exp(−s · (T(b) − T(f)) / (b − f)) and the colour (C(b) − C(f)) / (T(b) − T(f)).
//!
//! Invariant: nothing is seen of a pair exactly if no entry from one place before the smaller to one
//! behind the larger has an extinction, which is what emptiness is decided on.

use crate::table::{BakedFunction, FULL_COLOUR, TableIndex};

/// Places along a side.
pub(crate) const SLAB_SIZE: usize = 256;

/// The extinction of what is opaque: after a thousandth of a length of a voxel nothing is left.
const MOST_EXTINCTION: f64 = 1e4;

/// Opacity and colour of steps by their ends.
#[derive(Clone, Debug)]
pub(crate) struct SlabTable {
    /// The place of a value along a side.
    pub(crate) index: TableIndex,
    /// Opacity of the step from place f to b at f · [`SLAB_SIZE`] + b.
    pub(crate) opacities: Vec<f32>,
    /// Red, green, blue in units of 1 / [`FULL_COLOUR`], and 0.
    pub(crate) colours: Vec<[u16; 4]>,
}

/// Extinction by entry, its integrals, and the same times colours, linear between entries.
struct Integrals {
    /// τ and τ · colour.
    values: Vec<[f64; 4]>,
    sums: Vec<[f64; 4]>,
}

impl Integrals {
    fn new(function: &BakedFunction) -> Self {
        let mut values = Vec::with_capacity(function.logarithms.len());
        let mut sums: Vec<[f64; 4]> = Vec::with_capacity(function.logarithms.len());
        for (&log, colour) in function.logarithms.iter().zip(&function.colours) {
            let extinction = (-log).min(MOST_EXTINCTION);
            let [r, g, b, _] = colour.map(|c| extinction * f64::from(c) / f64::from(FULL_COLOUR));
            let value = [extinction, r, g, b];
            let sum = match (sums.last(), values.last()) {
                (Some(sum), Some(before)) => add(sum, before, &value, 0.5),
                _ => [0.0; 4],
            };
            sums.push(sum);
            values.push(value);
        }
        Self { values, sums }
    }

    /// Value and integral at a place between entries.
    fn at(&self, place: f64) -> ([f64; 4], [f64; 4]) {
        let entry = (place as usize).min(self.values.len() - 2);
        let share = place - entry as f64;
        let [from, to] = [self.values[entry], self.values[entry + 1]];
        let value = std::array::from_fn(|i| from[i] + (to[i] - from[i]) * share);
        (value, add(&self.sums[entry], &from, &value, share * 0.5))
    }
}

/// sum + (a + b) · half.
fn add(sum: &[f64; 4], a: &[f64; 4], b: &[f64; 4], half: f64) -> [f64; 4] {
    std::array::from_fn(|i| sum[i] + (a[i] + b[i]) * half)
}

impl SlabTable {
    /// For steps of `step` > 0 lengths of a voxel; `index` is that of a table of [`SLAB_SIZE`].
    pub(crate) fn new(function: &BakedFunction, index: TableIndex, step: f32) -> Self {
        let integrals = Integrals::new(function);
        let entries = (function.logarithms.len() - 1) as f64;
        let place = |i: usize| entries * i as f64 / (SLAB_SIZE - 1) as f64;
        let ends: Vec<_> = (0..SLAB_SIZE).map(|i| integrals.at(place(i))).collect();
        let mut opacities = Vec::with_capacity(SLAB_SIZE * SLAB_SIZE);
        let mut colours = Vec::with_capacity(SLAB_SIZE * SLAB_SIZE);
        for front in 0..SLAB_SIZE {
            for back in 0..SLAB_SIZE {
                let mean: [f64; 4] = if front == back {
                    ends[front].0
                } else {
                    let length = place(back) - place(front);
                    std::array::from_fn(|i| (ends[back].1[i] - ends[front].1[i]) / length)
                };
                opacities.push(-(-f64::from(step) * mean[0]).exp_m1() as f32);
                let colour = |i: usize| {
                    let share = if mean[0] > 0.0 {
                        mean[i] / mean[0]
                    } else {
                        0.0
                    };
                    (share.clamp(0.0, 1.0) * f64::from(FULL_COLOUR)).round() as u16
                };
                colours.push([colour(1), colour(2), colour(3), 0]);
            }
        }
        Self {
            index,
            opacities,
            colours,
        }
    }

    /// The item of a pair of raw values.
    pub(crate) fn item(&self, front: f32, back: f32) -> usize {
        self.index.of(front) * SLAB_SIZE + self.index.of(back)
    }
}

/// How far beyond the entries of its values a step may look in a table of `entries`: half a place of
/// the coarser table to either side, and the entries around.
pub(crate) fn reach(entries: usize) -> usize {
    entries.div_ceil(SLAB_SIZE) + 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        grid::{ValueScale, Volume, Voxels},
        table::DEFAULT_SIZE,
        transfer::{ControlPoint, TransferFunction},
    };

    fn slabs(points: &[[f32; 5]], step: f32) -> (SlabTable, BakedFunction) {
        let points: Vec<ControlPoint> = points.iter().map(|&p| p.into()).collect();
        let function = TransferFunction::new(points).unwrap();
        let voxels = Voxels::U8((0..=255).collect());
        let volume = Volume::new([256, 1, 1], [1.0; 3], voxels, ValueScale::default()).unwrap();
        let baked = BakedFunction::new(&function, &volume, DEFAULT_SIZE);
        let index = TableIndex::new(&volume, SLAB_SIZE);
        (SlabTable::new(&baked, index, step), baked)
    }

    #[test]
    fn a_constant_function_is_as_opaque_between_any_values() {
        let (slabs, _) = slabs(&[[0.0, 1.0, 0.5, 0.25, 0.3]], 0.5);
        let expected = 1.0 - 0.7_f32.sqrt();
        for (opacity, colour) in slabs.opacities.iter().zip(&slabs.colours) {
            assert!((opacity - expected).abs() < 1e-6, "{opacity}");
            assert_eq!(*colour, [65535, 32768, 16384, 0]);
        }
    }

    #[test]
    fn steps_are_as_opaque_as_many_small_ones() {
        let points = [
            [40.0, 1.0, 0.0, 0.0, 0.0],
            [90.0, 0.0, 1.0, 0.0, 0.6],
            [130.0, 0.0, 0.2, 1.0, 0.1],
            [200.0, 1.0, 1.0, 1.0, 0.0],
        ];
        let (slabs, baked) = slabs(&points, 2.0);
        for (front, back) in [(0, 255), (255, 0), (60, 100), (91, 91), (89, 88), (10, 41)] {
            // The mean extinction over values between the two.
            let samples = 20_000;
            let mean = (0..samples)
                .map(|i| {
                    let share = (f64::from(i) + 0.5) / f64::from(samples);
                    let value = f64::from(front) + f64::from(back - front) * share;
                    let [.., alpha] = baked_function(&points).at(value);
                    -(-alpha).ln_1p()
                })
                .sum::<f64>()
                / f64::from(samples);
            let expected = -(-2.0 * mean).exp_m1();
            let found = slabs.opacities[slabs.item(front as f32, back as f32)];
            assert!(
                (f64::from(found) - expected).abs() < 2e-3,
                "{front} {back}: {found} {expected}"
            );
        }
        assert_eq!(baked.logarithms.len(), DEFAULT_SIZE);
    }

    fn baked_function(points: &[[f32; 5]]) -> TransferFunction {
        TransferFunction::new(
            points
                .iter()
                .map(|&p| p.into())
                .collect::<Vec<ControlPoint>>(),
        )
        .unwrap()
    }

    #[test]
    fn a_peak_between_two_values_is_seen_and_hides_what_is_behind() {
        let points = [
            [100.4, 0.0, 1.0, 0.0, 0.0],
            [100.5, 0.0, 1.0, 0.0, 1.0],
            [101.5, 0.0, 1.0, 0.0, 1.0],
            [101.6, 0.0, 1.0, 0.0, 0.0],
        ];
        let (slabs, _) = slabs(&points, 1.0);
        assert_eq!(slabs.opacities[slabs.item(90.0, 110.0)], 1.0);
        assert_eq!(slabs.opacities[slabs.item(110.0, 90.0)], 1.0);
        assert_eq!(slabs.opacities[slabs.item(90.0, 99.0)], 0.0);
        assert_eq!(slabs.opacities[slabs.item(255.0, 103.0)], 0.0);
        assert_eq!(slabs.colours[slabs.item(90.0, 110.0)], [0, 65535, 0, 0]);
    }
}
