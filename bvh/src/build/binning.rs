//! Binned surface area heuristic: Wald, *On fast Construction of SAH-based Bounding Volume
//! Hierarchies*, 2007, section 3, with the bins, costs and tie rules of Embree 4.
//!
//! Invariants: every reference falls in exactly one bin of each axis, and the partition decides by
//! the same rounded number as the bins did; only minima, maxima and counts are accumulated, so that
//! the result does not depend on order or threads. Poor where primitives are long and diagonal.

use wide::{f32x4, i32x4};

use super::{
    primitive::{Bounds, BoxLanes, PrimitiveRef, RangeBounds, THREE_LANES},
    tasks,
};
use crate::simd::{
    self, Isa,
    build::{EightLanes, Halves},
};

/// The most bins; Embree's object splitter has 32.
const MAX_BINS: usize = 32;

/// Extents of centroids up to this are taken for zero.
const SMALLEST_EXTENT: f32 = 1e-34;

/// Whose rounding is followed: how real numbers become bins, and what goes with it.
pub(crate) trait Rounding: Copy + Send + Sync + 'static {
    /// Taken away before rounding.
    const SHIFT: f32;
    /// Whether equal elements come out of a sort in the order of Embree's library.
    const LIBRARY_ORDER: bool;
    /// Whether a cut with an empty side takes the rest of its budget from a reference.
    const EMPTY_SIDE_ENDS_BUDGET: bool;
    /// 1 / x in a Morton build.
    fn reciprocal(x: f32) -> f32;
    fn floor(shifted: f32x4) -> i32x4;
    /// `x - SHIFT < threshold(plane)` says whether the bin of x is below `plane`.
    fn threshold(plane: usize) -> f32;
}

/// A true floor, of numbers that are not negative.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exact;

impl Rounding for Exact {
    const SHIFT: f32 = 0.0;
    const LIBRARY_ORDER: bool = false;
    const EMPTY_SIDE_ENDS_BUDGET: bool = false;

    fn reciprocal(x: f32) -> f32 {
        1.0 / x
    }

    #[inline(always)]
    fn floor(shifted: f32x4) -> i32x4 {
        shifted.fast_trunc_int()
    }

    fn threshold(plane: usize) -> f32 {
        plane as f32
    }
}

/// The nearest whole number to x − 1/2, ties to even: Embree's builder interface, which is compiled
/// for SSE2.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AsEmbree;

impl Rounding for AsEmbree {
    const SHIFT: f32 = 0.5;
    const LIBRARY_ORDER: bool = true;
    const EMPTY_SIDE_ENDS_BUDGET: bool = true;

    /// The processor's estimate, whose bits are its maker's affair, and one step of Newton's.
    fn reciprocal(x: f32) -> f32 {
        let estimate = f32x4::splat(x).recip().to_array()[0];
        estimate + estimate * (1.0 - x * estimate)
    }

    #[inline(always)]
    fn floor(shifted: f32x4) -> i32x4 {
        shifted.fast_round_int()
    }

    /// A tie at `plane` − 1/2 goes to the even neighbour, which is below the plane if that is odd.
    fn threshold(plane: usize) -> f32 {
        let middle = plane as f32 - 0.5;
        if plane % 2 == 1 {
            middle.next_up()
        } else {
            middle
        }
    }
}

/// A plane between bins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Split {
    pub(crate) axis: usize,
    /// The first bin on the right.
    pub(crate) plane: usize,
    /// Sum over both sides of half area × blocks.
    pub(crate) sah: f32,
    pub(crate) scale: f32,
    pub(crate) offset: f32,
    pub(crate) shift: f32,
    pub(crate) threshold: f32,
    /// The boxes of both sides.
    pub(crate) sides: [Bounds; 2],
}

impl Split {
    /// How far a reference lies behind the plane, in bins: negative on the left side.
    #[inline(always)]
    pub(crate) fn behind(&self, reference: &PrimitiveRef) -> f32 {
        let coordinate = reference.doubled_centroid_on(self.axis);
        (coordinate - self.offset) * self.scale - self.shift - self.threshold
    }

    /// Whether a reference lies on the left side.
    #[inline(always)]
    pub(crate) fn is_left(&self, reference: &PrimitiveRef) -> bool {
        self.behind(reference).is_sign_negative()
    }
}

/// From centroids to bins.
#[derive(Clone, Copy, Debug)]
struct Mapping {
    bins: usize,
    /// The number of the last bin.
    last: f32x4,
    scale: f32x4,
    offset: f32x4,
}

impl Mapping {
    fn new(n: usize, centroid: &Bounds) -> Self {
        let bins = ((4.0 + 0.05 * n as f32) as usize).min(MAX_BINS);
        let spread = 0.99 * bins as f32;
        let scale = centroid
            .extent()
            .to_array()
            .map(|e| if e > SMALLEST_EXTENT { spread / e } else { 0.0 });
        Self {
            bins,
            last: f32x4::splat((bins - 1) as f32),
            scale: f32x4::new(scale),
            offset: centroid.lower() & THREE_LANES,
        }
    }

    #[inline(always)]
    fn bins_of<R: Rounding>(&self, centroid: f32x4) -> [usize; 3] {
        let place = (centroid - self.offset) * self.scale - f32x4::splat(R::SHIFT);
        // Coordinates are not below the offset: only the upper end can be passed.
        let [x, y, z, _] = R::floor(place.fast_min(self.last)).to_array();
        // The mask tells the compiler that no index leaves the arrays.
        [x, y, z].map(|bin| bin as usize & (MAX_BINS - 1))
    }
}

/// The bins of the three axes side by side, of which the first few are in use: memory that is
/// reused from range to range.
#[derive(Clone, Debug)]
pub(crate) struct Bins {
    bounds: [[Bounds; 3]; MAX_BINS],
    counts: [[u32; 4]; MAX_BINS],
}

impl Default for Bins {
    fn default() -> Self {
        Self {
            bounds: [[Bounds::EMPTY; 3]; MAX_BINS],
            counts: [[0; 4]; MAX_BINS],
        }
    }
}

/// Bins for references at even places and at odd ones: where neighbours fall in the same bin, the
/// processor need not wait for the first to be stored before it reads the bin for the second.
pub(crate) type BinPair = [Bins; 2];

/// From this size on ranges are binned in pairs; below, clearing and merging take longer.
const PAIRS_FROM: usize = 64;

/// Adds references to cleared bins.
struct Fill<'a, R> {
    bins: &'a mut BinPair,
    mapping: &'a Mapping,
    references: &'a [PrimitiveRef],
    rounding: std::marker::PhantomData<R>,
}

impl<R: Rounding> EightLanes for Fill<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Halves>(self) {
        let mapping = *self.mapping;
        let add = |bins: &mut Bins, reference: &PrimitiveRef| {
            let lanes = L::of(&reference.0);
            let indices = mapping.bins_of::<R>(reference.doubled_centroid());
            for (axis, bin) in indices.into_iter().enumerate() {
                let bounds = &mut bins.bounds[bin][axis];
                *bounds = L::of(bounds).min(lanes).to_bounds();
                bins.counts[bin][axis] += 1;
            }
        };
        let [even, odd] = self.bins;
        let mut rest = self.references;
        if self.references.len() >= PAIRS_FROM {
            let (pairs, last) = self.references.as_chunks::<2>();
            for [a, b] in pairs {
                add(even, a);
                add(odd, b);
            }
            rest = last;
        }
        for reference in rest {
            add(even, reference);
        }
    }
}

impl Bins {
    fn clear(&mut self, bins: usize) {
        self.bounds[..bins].fill([Bounds::EMPTY; 3]);
        self.counts[..bins].fill([0; 4]);
    }

    fn merge(&mut self, other: &Self, bins: usize) {
        for bin in 0..bins {
            for axis in 0..3 {
                self.bounds[bin][axis].extend(&other.bounds[bin][axis]);
                self.counts[bin][axis] += other.counts[bin][axis];
            }
        }
    }

    /// The cheapest plane of an axis: the cost and the first bin on its right. Ties keep the
    /// lower plane; an empty side costs ∞ · 0 = NaN and is never taken.
    fn best_plane(&self, axis: usize, bins: usize, block_shift: u32) -> (f32, usize) {
        let blocks = |count: u32| ((count + (1 << block_shift) - 1) >> block_shift) as f32;
        let mut right_cost = [0.0; MAX_BINS];
        let (mut bounds, mut count) = (Bounds::EMPTY, 0);
        for bin in (1..bins).rev() {
            bounds.extend(&self.bounds[bin][axis]);
            count += self.counts[bin][axis];
            right_cost[bin] = bounds.half_area() * blocks(count);
        }
        let (mut bounds, mut count) = (Bounds::EMPTY, 0);
        let mut best = (f32::INFINITY, 0);
        for (plane, right_cost) in right_cost.iter().enumerate().take(bins).skip(1) {
            bounds.extend(&self.bounds[plane - 1][axis]);
            count += self.counts[plane - 1][axis];
            let cost = bounds.half_area() * blocks(count) + right_cost;
            if cost < best.0 {
                best = (cost, plane);
            }
        }
        best
    }

    fn best_split<R: Rounding>(&self, mapping: &Mapping, block_shift: u32) -> Option<Split> {
        let (scale, offset) = (mapping.scale.to_array(), mapping.offset.to_array());
        let mut best: Option<Split> = None;
        for axis in (0..3).filter(|&axis| scale[axis] != 0.0) {
            let (sah, plane) = self.best_plane(axis, mapping.bins, block_shift);
            if plane != 0 && best.is_none_or(|best| sah < best.sah) {
                best = Some(Split {
                    axis,
                    plane,
                    sah,
                    scale: scale[axis],
                    offset: offset[axis],
                    shift: R::SHIFT,
                    threshold: R::threshold(plane),
                    sides: [Bounds::EMPTY; 2],
                });
            }
        }
        let best = best.as_mut()?;
        for (bin, bounds) in self.bounds[..mapping.bins].iter().enumerate() {
            best.sides[usize::from(bin >= best.plane)].extend(&bounds[best.axis]);
        }
        Some(*best)
    }
}

/// Bins references; the first of the pair has the result.
fn fill<R: Rounding>(bins: &mut BinPair, mapping: &Mapping, references: &[PrimitiveRef], isa: Isa) {
    let in_pairs = references.len() >= PAIRS_FROM;
    bins[0].clear(mapping.bins);
    if in_pairs {
        bins[1].clear(mapping.bins);
    }
    let kernel = Fill::<R> {
        bins,
        mapping,
        references,
        rounding: std::marker::PhantomData,
    };
    simd::build::run(isa, kernel);
    if in_pairs {
        let [even, odd] = bins;
        even.merge(odd, mapping.bins);
    }
}

/// The cheapest plane of all axes; `None` if all centroids coincide or no plane parts them.
pub(crate) fn find_split<R: Rounding>(
    references: &[PrimitiveRef],
    bounds: &RangeBounds,
    block_shift: u32,
    isa: Isa,
    bins: &mut BinPair,
) -> Option<Split> {
    let mapping = Mapping::new(references.len(), &bounds.centroid);
    if tasks::in_pieces(references.len()) {
        let of_piece = |piece: &[PrimitiveRef]| {
            let mut bins = BinPair::default();
            fill::<R>(&mut bins, &mapping, piece, isa);
            bins
        };
        let merge = |mut a: BinPair, b: BinPair| {
            a[0].merge(&b[0], mapping.bins);
            a
        };
        *bins = tasks::map_merge(references, &of_piece, &merge);
    } else {
        fill::<R>(bins, &mapping, references, isa);
    }
    bins[0].best_split::<R>(&mapping, block_shift)
}
