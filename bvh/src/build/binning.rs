//! Binned surface area heuristic: Wald, *On fast Construction of SAH-based Bounding Volume
//! Hierarchies*, 2007, section 3, with the bins, costs and tie rules of Embree 4.
//!
//! Invariants: every reference falls in exactly one bin of each axis; only minima, maxima and
//! counts are accumulated, so that the result does not depend on order or threads. Poor where
//! primitives are long and diagonal.

use wide::f32x4;

use super::{
    primitive::{Bounds, PrimitiveRef, RangeBounds},
    tasks,
};

/// The most bins; Embree's object splitter has 32.
const MAX_BINS: usize = 32;

/// Extents of centroids up to this are taken for zero.
const SMALLEST_EXTENT: f32 = 1e-34;

/// A plane between bins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Split {
    pub(crate) axis: usize,
    /// The first bin on the right.
    pub(crate) plane: usize,
    /// Sum over both sides of half area × blocks.
    pub(crate) sah: f32,
    scale: f32,
    offset: f32,
}

impl Split {
    /// Whether a reference lies on the left side.
    #[inline(always)]
    pub(crate) fn is_left(&self, reference: &PrimitiveRef) -> bool {
        let centroid = reference.doubled_centroid().to_array()[self.axis];
        // The plane is a whole number, so comparing with it needs no rounding down.
        (centroid - self.offset) * self.scale < self.plane as f32
    }
}

/// From centroids to bins.
#[derive(Clone, Copy, Debug)]
struct Mapping {
    bins: usize,
    scale: f32x4,
    offset: f32x4,
}

impl Mapping {
    fn new(n: usize, centroid: &Bounds) -> Self {
        let bins = ((4.0 + 0.05 * n as f32) as usize).min(MAX_BINS);
        let extent = (centroid.upper - centroid.lower).to_array();
        let spread = 0.99 * bins as f32;
        let scale = extent.map(|e| if e > SMALLEST_EXTENT { spread / e } else { 0.0 });
        Self {
            bins,
            scale: f32x4::new(scale),
            offset: centroid.lower,
        }
    }

    #[inline(always)]
    fn bins_of(&self, reference: &PrimitiveRef) -> [usize; 3] {
        let place = (reference.doubled_centroid() - self.offset) * self.scale;
        let [x, y, z, _] = place.fast_trunc_int().to_array();
        // Coordinates are finite and not below the offset: only the upper end can be passed, and
        // the mask makes that visible to the compiler as well.
        [x, y, z].map(|bin| (bin as usize).min(self.bins - 1) & (MAX_BINS - 1))
    }
}

#[derive(Clone)]
struct Bins {
    bounds: [[Bounds; MAX_BINS]; 3],
    counts: [[u32; MAX_BINS]; 3],
}

impl Bins {
    fn fill(mapping: &Mapping, references: &[PrimitiveRef]) -> Self {
        let mut bins = Self {
            bounds: [[Bounds::EMPTY; MAX_BINS]; 3],
            counts: [[0; MAX_BINS]; 3],
        };
        for reference in references {
            for (axis, bin) in mapping.bins_of(reference).into_iter().enumerate() {
                bins.bounds[axis][bin].extend(&reference.0);
                bins.counts[axis][bin] += 1;
            }
        }
        bins
    }

    fn merge(mut self, other: &Self) -> Self {
        for axis in 0..3 {
            for bin in 0..MAX_BINS {
                self.bounds[axis][bin].extend(&other.bounds[axis][bin]);
                self.counts[axis][bin] += other.counts[axis][bin];
            }
        }
        self
    }

    /// The cheapest plane of an axis: the cost and the first bin on its right. Ties keep the
    /// lower plane; an empty side costs ∞ · 0 = NaN and is never taken.
    fn best_plane(&self, axis: usize, bins: usize, block_shift: u32) -> (f32, usize) {
        let blocks = |count: u32| ((count + (1 << block_shift) - 1) >> block_shift) as f32;
        let mut right_cost = [0.0; MAX_BINS];
        let (mut bounds, mut count) = (Bounds::EMPTY, 0);
        for bin in (1..bins).rev() {
            bounds.extend(&self.bounds[axis][bin]);
            count += self.counts[axis][bin];
            right_cost[bin] = bounds.half_area() * blocks(count);
        }
        let (mut bounds, mut count) = (Bounds::EMPTY, 0);
        let mut best = (f32::INFINITY, 0);
        for (plane, right_cost) in right_cost.iter().enumerate().take(bins).skip(1) {
            bounds.extend(&self.bounds[axis][plane - 1]);
            count += self.counts[axis][plane - 1];
            let cost = bounds.half_area() * blocks(count) + right_cost;
            if cost < best.0 {
                best = (cost, plane);
            }
        }
        best
    }
}

/// The cheapest plane of all axes; `None` if all centroids coincide or no plane parts them.
pub(crate) fn find_split(
    references: &[PrimitiveRef],
    bounds: &RangeBounds,
    block_shift: u32,
) -> Option<Split> {
    let mapping = Mapping::new(references.len(), &bounds.centroid);
    let bins = if tasks::in_pieces(references.len()) {
        tasks::map_merge(
            references,
            &|piece| Bins::fill(&mapping, piece),
            &|a: Bins, b| a.merge(&b),
        )
    } else {
        Bins::fill(&mapping, references)
    };
    let (scale, offset) = (mapping.scale.to_array(), mapping.offset.to_array());
    let mut best: Option<Split> = None;
    for axis in (0..3).filter(|&axis| scale[axis] != 0.0) {
        let (sah, plane) = bins.best_plane(axis, mapping.bins, block_shift);
        if plane != 0 && best.is_none_or(|best| sah < best.sah) {
            best = Some(Split {
                axis,
                plane,
                sah,
                scale: scale[axis],
                offset: offset[axis],
            });
        }
    }
    best
}
