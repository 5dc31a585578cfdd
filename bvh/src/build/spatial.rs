//! Splits that cut primitives: Stich, Friedrich, Dietrich, *Spatial Splits in Bounding Volume
//! Hierarchies*, 2009, with the bins, budgets and tie rules of Embree 4.
//!
//! Every reference has a budget of cuts in the top five bits of its geometry id, larger for larger
//! boxes. Invariants: a cut covers the primitive's part of the box it came from; references never
//! exceed the room that the range was given; the result depends on the order of the references,
//! which only serial code changes, and not on threads.

use glam::Vec3;
use wide::{f32x4, f32x8};

use super::{
    LeafReference,
    binning::{self, Rounding},
    control::Running,
    primitive::{Bounds, BoxLanes, PrimitiveRef, RangeBounds},
    tasks,
};
use crate::{
    error::BuildError,
    simd::{
        self, Isa,
        build::{EightLanes, Halves},
    },
};

/// Bins of spatial splits.
const BINS: usize = 16;

/// Extents up to this share of the largest coordinate are taken for zero.
const SMALLEST_EXTENT: f32 = 1.0 / (1 << 16) as f32;

/// A spatial split is tried if the object split's sides overlap in this share of the root's area …
const ROOT_OVERLAP: f32 = 5e-6;
/// … and in this share of the range's own area.
const OVERLAP: f32 = 0.1;
/// It is taken if it costs less than this share of the object split.
const GAIN: f32 = 0.99;

/// What cutting needs to know besides the range.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cutting<F> {
    /// The corners of a primitive.
    pub(crate) corners: F,
    /// Surface area of the root box.
    root_area: f32,
    /// Whether a cut with an empty side takes away the rest of the reference's budget.
    empty_side_ends_budget: bool,
    block_shift: u32,
    isa: Isa,
}

/// A plane between spatial bins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SpatialSplit {
    axis: usize,
    plane: usize,
    pub(crate) sah: f32,
    mapping: Mapping,
    /// References on both sides together.
    count: usize,
}

/// From coordinates to bins.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Mapping {
    offset: f32x4,
    scale: f32x4,
    /// Width of a bin; +∞ where the scale is 0.
    width: f32x4,
}

impl Mapping {
    fn new(bounds: &Bounds) -> Self {
        let (lower, upper) = (bounds.lower().to_array(), bounds.upper().to_array());
        let scale: [f32; 4] = std::array::from_fn(|axis| {
            let epsilon = SMALLEST_EXTENT * lower[axis].abs().max(upper[axis].abs());
            let size = upper[axis] - lower[axis];
            if axis == 3 || size <= epsilon {
                0.0
            } else {
                BINS as f32 / epsilon.max(size)
            }
        });
        Self {
            offset: bounds.lower(),
            scale: f32x4::new(scale),
            width: f32x4::new(scale.map(f32::recip)),
        }
    }

    #[inline(always)]
    fn bins_of<R: Rounding>(&self, point: f32x4) -> [usize; 3] {
        let place = (point - self.offset) * self.scale - f32x4::splat(R::SHIFT);
        let [x, y, z, _] = R::floor(place).to_array();
        [x, y, z].map(|bin| bin.clamp(0, BINS as i32 - 1) as usize)
    }

    /// Where bin `plane` begins on an axis.
    #[inline(always)]
    fn position(&self, axis: usize, plane: usize) -> f32 {
        let axis = axis & 3;
        plane as i32 as f32 * self.width.to_array()[axis] + self.offset.to_array()[axis]
    }
}

/// The bins of the three axes.
pub(crate) struct Bins {
    bounds: [[Bounds; BINS]; 3],
    begins: [[u32; BINS]; 3],
    ends: [[u32; BINS]; 3],
}

impl Default for Bins {
    fn default() -> Self {
        Self {
            bounds: [[Bounds::EMPTY; BINS]; 3],
            begins: [[0; BINS]; 3],
            ends: [[0; BINS]; 3],
        }
    }
}

impl Bins {
    fn merge(mut self, other: &Self) -> Self {
        for axis in 0..3 {
            for bin in 0..BINS {
                self.bounds[axis][bin].extend(&other.bounds[axis][bin]);
                self.begins[axis][bin] += other.begins[axis][bin];
                self.ends[axis][bin] += other.ends[axis][bin];
            }
        }
        self
    }

    /// The cheapest plane of an axis: cost, plane, references on both sides.
    fn best_plane(&self, axis: usize, block_shift: u32) -> (f32, usize, usize) {
        let blocks = |count: u32| ((count + (1 << block_shift) - 1) >> block_shift) as f32;
        let mut right = [(0.0, 0); BINS];
        let (mut bounds, mut count) = (Bounds::EMPTY, 0);
        for bin in (1..BINS).rev() {
            bounds.extend(&self.bounds[axis][bin]);
            count += self.ends[axis][bin];
            right[bin] = (bounds.half_area() * blocks(count), count);
        }
        let (mut bounds, mut count) = (Bounds::EMPTY, 0);
        let mut best = (f32::INFINITY, 0, 0);
        for (plane, (right_cost, right_count)) in right.into_iter().enumerate().skip(1) {
            bounds.extend(&self.bounds[axis][plane - 1]);
            count += self.begins[axis][plane - 1];
            let cost = bounds.half_area() * blocks(count) + right_cost;
            if cost < best.0 {
                best = (cost, plane, (count + right_count) as usize);
            }
        }
        best
    }
}

impl<C: Fn(LeafReference) -> [Vec3; 3] + Sync> Cutting<C> {
    pub(crate) fn new<R: Rounding>(corners: C, root: &Bounds, block_shift: u32, isa: Isa) -> Self {
        Self {
            block_shift,
            isa,
            corners,
            root_area: 2.0 * root.half_area(),
            empty_side_ends_budget: R::EMPTY_SIDE_ENDS_BUDGET,
        }
    }

    /// The cheapest plane that cuts, if it is worth it: the sides of the best object split overlap,
    /// cutting is cheaper than that split, and there is room for the new references. Where cuts
    /// would be takes long to find, so that each piece asks whether to go on.
    ///
    /// # Errors
    /// If the build is cancelled.
    pub(crate) fn find_split<R: Rounding>(
        &self,
        references: &[PrimitiveRef],
        room: usize,
        bounds: &RangeBounds,
        object: Option<&binning::Split>,
        bins: &mut Bins,
        running: &Running<'_>,
    ) -> Result<Option<SpatialSplit>, BuildError> {
        let (object_sah, overlap) = object.map_or((f32::INFINITY, Bounds::EMPTY), |split| {
            (split.sah, split.sides[0].intersection(&split.sides[1]))
        });
        let overlap_area = area(&overlap);
        if !(overlap_area >= ROOT_OVERLAP * self.root_area
            && overlap_area >= OVERLAP * area(&bounds.geometry))
        {
            return Ok(None);
        }
        let mapping = Mapping::new(&bounds.geometry);
        let fill = |references: &[PrimitiveRef], bins: &mut Bins| {
            let kernel = Fill::<R, C> {
                cutting: self,
                mapping: &mapping,
                references,
                bins,
                rounding: std::marker::PhantomData,
            };
            simd::build::run(self.isa, kernel)
        };
        if tasks::in_pieces(references.len()) {
            let of_piece = |piece: &[PrimitiveRef]| {
                running.check()?;
                let mut bins = Bins::default();
                fill(piece, &mut bins);
                Ok(bins)
            };
            let merge = |a: Result<Bins, BuildError>, b: Result<_, _>| Ok(a?.merge(&b?));
            *bins = tasks::map_merge(references, &of_piece, &merge)?;
        } else {
            *bins = Bins::default();
            for piece in references.chunks(tasks::PIECE_SIZE) {
                if references.len() > tasks::PIECE_SIZE {
                    running.check()?;
                }
                fill(piece, bins);
            }
        }
        let scale = mapping.scale.to_array();
        let mut best: Option<SpatialSplit> = None;
        for axis in (0..3).filter(|&axis| scale[axis] != 0.0) {
            let (sah, plane, count) = bins.best_plane(axis, self.block_shift);
            if plane != 0 && best.is_none_or(|best| sah < best.sah) {
                best = Some(SpatialSplit {
                    axis,
                    plane,
                    sah,
                    mapping,
                    count,
                });
            }
        }
        Ok(best.filter(|split| {
            // As in Embree the difference wraps round: a count below that of the range (parts
            // can be lost to rounding) is no room.
            split.sah < GAIN * object_sah && split.count.wrapping_sub(references.len()) <= room
        }))
    }

    #[inline(always)]
    fn fill<R: Rounding, L: Halves>(
        &self,
        bins: &mut Bins,
        mapping: &Mapping,
        references: &[PrimitiveRef],
    ) {
        let scale = mapping.scale.to_array();
        for reference in references {
            if reference.budget() <= 1 {
                let centre = reference.doubled_centroid() * f32x4::splat(0.5);
                for (axis, bin) in mapping.bins_of::<R>(centre).into_iter().enumerate() {
                    bins.begins[axis][bin] += 1;
                    bins.ends[axis][bin] += 1;
                    bins.bounds[axis][bin].extend(&reference.0);
                }
                continue;
            }
            let first = mapping.bins_of::<R>(reference.0.lower());
            let last = mapping.bins_of::<R>(reference.0.upper());
            let mut triangle = None;
            for axis in 0..3 {
                if scale[axis] == 0.0 {
                    continue;
                }
                let (first, last) = (first[axis], last[axis]);
                if first == last {
                    bins.begins[axis][first] += 1;
                    bins.ends[axis][last] += 1;
                    bins.bounds[axis][first].extend(&reference.0);
                    continue;
                }
                if triangle.is_none() {
                    triangle = Some(Triangle::<L>::new(&self.corners_of(reference)));
                }
                let Some(triangle) = &triangle else { continue };
                chop::<L>(bins, mapping, axis, (first, last), reference, triangle);
            }
        }
    }

    /// Cuts the references that the plane meets; new ones take the room behind the first `n`.
    /// Returns how many there are then.
    pub(crate) fn cut<R: Rounding>(
        &self,
        references: &mut [PrimitiveRef],
        n: usize,
        split: &SpatialSplit,
    ) -> usize {
        let position = split.mapping.position(split.axis, split.plane);
        let mut count = n;
        for index in 0..n {
            let reference = references[index];
            let budget = reference.budget();
            if budget <= 1 {
                continue;
            }
            let first = split.mapping.bins_of::<R>(reference.0.lower())[split.axis];
            let last = split.mapping.bins_of::<R>(reference.0.upper())[split.axis];
            if !(first < split.plane && split.plane <= last) {
                continue;
            }
            let corners = self.corners_of(&reference);
            let [left, right] = Triangle::<f32x8>::new(&corners)
                .across(split.axis)
                .cut(position, f32x8::of(&reference.0))
                .map(BoxLanes::to_bounds);
            if left.is_empty() || right.is_empty() {
                if self.empty_side_ends_budget {
                    references[index] = reference.with_budget(0);
                }
            } else if count == references.len() {
                references[index] = reference.with_budget(0);
                break;
            } else {
                references[index] = reference.part(&left, budget - 1);
                references[count] = reference.part(&right, budget - 1);
                count += 1;
            }
        }
        count
    }

    #[inline(always)]
    fn corners_of(&self, reference: &PrimitiveRef) -> [Vec3; 3] {
        (self.corners)(reference.cut_leaf_reference())
    }
}

/// Bins references, cut at the planes.
struct Fill<'a, R, C> {
    cutting: &'a Cutting<C>,
    mapping: &'a Mapping,
    references: &'a [PrimitiveRef],
    bins: &'a mut Bins,
    rounding: std::marker::PhantomData<R>,
}

impl<R: Rounding, C: Fn(LeafReference) -> [Vec3; 3] + Sync> EightLanes for Fill<'_, R, C> {
    type Output = ();

    #[inline(always)]
    fn run<L: Halves>(self) {
        self.cutting
            .fill::<R, L>(self.bins, self.mapping, self.references);
    }
}

impl SpatialSplit {
    /// Whether a reference lies on the left side.
    #[inline(always)]
    pub(crate) fn is_left<R: Rounding>(&self, reference: &PrimitiveRef) -> bool {
        let centre = reference.doubled_centroid() * f32x4::splat(0.5);
        self.mapping.bins_of::<R>(centre)[self.axis] < self.plane
    }
}

/// A triangle, prepared for being cut by planes across any axis. Points are boxes of one point.
///
/// Edges run from each corner to the next: rounding depends on their direction. Closures are
/// spelled out here: one that were not inlined would lose the instruction set.
struct Triangle<L> {
    corners: [L; 3],
    directions: [L; 3],
    coordinates: [[f32; 4]; 3],
    /// 1 / direction; 0 where an edge does not cross the axis.
    reciprocals: [[f32; 4]; 3],
}

impl<L: Halves> Triangle<L> {
    #[inline(always)]
    fn new([a, b, c]: &[Vec3; 3]) -> Self {
        let corners = [L::of_point(*a), L::of_point(*b), L::of_point(*c)];
        let [a, b, c] = [lanes(a), lanes(b), lanes(c)];
        Self {
            directions: [
                corners[1].sub(corners[0]),
                corners[2].sub(corners[1]),
                corners[0].sub(corners[2]),
            ],
            corners,
            coordinates: [a.to_array(), b.to_array(), c.to_array()],
            reciprocals: [
                finite_reciprocal(b - a).to_array(),
                finite_reciprocal(c - b).to_array(),
                finite_reciprocal(a - c).to_array(),
            ],
        }
    }

    /// Makes ready for planes across an axis.
    #[inline(always)]
    fn across(&self, axis: usize) -> Cutter<'_, L> {
        let axis = axis & 3;
        let heights = [
            self.coordinates[0][axis],
            self.coordinates[1][axis],
            self.coordinates[2][axis],
        ];
        // Sorted by counting, since nobody can predict the order.
        let [a, b, c] = heights;
        let mut order = [0; 4];
        order[usize::from(b < a) + usize::from(c < a)] = 0;
        order[usize::from(a <= b) + usize::from(c < b)] = 1;
        order[usize::from(a <= c) + usize::from(b <= c)] = 2;
        let [low, middle, high, _] = order;
        let [a, b, c] = [self.corners[low], self.corners[middle], self.corners[high]];
        // The edge opposite to a corner begins at the next one.
        const NEXT: [usize; 3] = [1, 2, 0];
        let long = NEXT[middle];
        Cutter {
            triangle: self,
            axis,
            heights: [heights[low], heights[middle], heights[high]],
            below: [a, a.min(b), a.min(b)],
            above: [b.min(c), c, b.min(c)],
            long,
            short: [NEXT[high], NEXT[low], long],
            ends: [a, c],
        }
    }

    /// Where an edge crosses a plane.
    #[inline(always)]
    fn crossing(&self, edge: usize, axis: usize, position: f32) -> L {
        let t = (position - self.coordinates[edge][axis]) * self.reciprocals[edge][axis];
        L::splat(t)
            .mul(self.directions[edge])
            .add(self.corners[edge])
    }
}

#[inline(always)]
fn lanes(v: &Vec3) -> f32x4 {
    f32x4::new([v.x, v.y, v.z, 1.0])
}

/// 1 / x, and 0 for 0.
#[inline(always)]
fn finite_reciprocal(x: f32x4) -> f32x4 {
    (f32x4::ONE / x) & x.simd_ne(f32x4::ZERO)
}

/// A triangle that is cut by planes across one axis. Arrays of three are for planes below the
/// middle corner, above it, and at its height.
struct Cutter<'a, L> {
    triangle: &'a Triangle<L>,
    axis: usize,
    /// From the lowest corner to the highest.
    heights: [f32; 3],
    /// The corners on the lower side.
    below: [L; 3],
    /// The corners on the upper side.
    above: [L; 3],
    /// The edge from the lowest corner to the highest.
    long: usize,
    /// The other edge that the plane crosses; the long one again where there is none.
    short: [usize; 3],
    /// The lowest and the highest corner.
    ends: [L; 2],
}

impl<L: Halves> Cutter<'_, L> {
    /// The boxes of the two parts of the triangle on both sides of a plane, within `bounds`.
    #[inline(always)]
    fn cut(&self, position: f32, bounds: L) -> [L; 2] {
        let [low, middle, high] = self.heights;
        let place = usize::from(middle < position) + 2 * usize::from(middle == position);
        let (mut left, mut right) = (self.below[place], self.above[place]);
        if low < position && position < high {
            let long = self.triangle.crossing(self.long, self.axis, position);
            let short = self
                .triangle
                .crossing(self.short[place], self.axis, position);
            let crossing = long.min(short);
            left = left.min(crossing);
            right = right.min(crossing);
        } else {
            [left, right] = self.not_crossed(position, place);
        }
        [left.max(bounds), right.max(bounds)]
    }

    /// The sides of a plane that parts no two corners: it can only touch.
    #[inline(always)]
    fn not_crossed(&self, position: f32, place: usize) -> [L; 2] {
        let [low, _, high] = self.heights;
        let nothing = L::of(&Bounds::EMPTY);
        let (mut left, mut right) = (nothing, nothing);
        if high <= position {
            left = self.below[1].min(self.ends[1]);
            if position <= high {
                right = self.above[place].min(self.ends[1]);
            }
        }
        if position <= low {
            right = self.above[0].min(self.ends[0]).min(right);
            if low <= position {
                left = self.below[place].min(self.ends[0]).min(left);
            }
        }
        [left, right]
    }
}

/// Adds a primitive that spans several bins of an axis, part by part.
#[inline(always)]
fn chop<L: Halves>(
    bins: &mut Bins,
    mapping: &Mapping,
    axis: usize,
    (mut first, mut last): (usize, usize),
    reference: &PrimitiveRef,
    triangle: &Triangle<L>,
) {
    let (mut begin, mut end) = (first, last);
    // The bins were found by one rounding, the planes have another.
    let (lower, upper) = reference.range_on(axis);
    while first < last && mapping.position(axis, first + 1) <= lower {
        first += 1;
    }
    while first < last && mapping.position(axis, last) >= upper {
        last -= 1;
    }
    let cutter = triangle.across(axis);
    let mut rest = L::of(&reference.0);
    for bin in first..last {
        let [left, right] = cutter.cut(mapping.position(axis, bin + 1), rest);
        begin += usize::from(left.is_empty());
        let bounds = &mut bins.bounds[axis][bin];
        *bounds = L::of(bounds).min(left).to_bounds();
        rest = right;
    }
    end -= usize::from(rest.is_empty());
    bins.begins[axis][begin] += 1;
    bins.ends[axis][end] += 1;
    let bounds = &mut bins.bounds[axis][last];
    *bounds = L::of(bounds).min(rest).to_bounds();
}

/// Surface area; 0 of an empty box.
fn area(bounds: &Bounds) -> f32 {
    if bounds.is_empty() {
        0.0
    } else {
        2.0 * bounds.half_area()
    }
}

/// Gives every reference its budget of cuts, by its share of the summed area of all boxes.
pub(crate) fn give_budgets(references: &mut [PrimitiveRef]) {
    let n = references.len() as f32;
    let area = |reference: &PrimitiveRef| 2.0 * reference.0.half_area();
    let total: f64 = references.iter().map(|r| f64::from(area(r))).sum();
    let per_total = 1.0 / total as f32;
    for reference in references {
        let share = (10.0 * n * area(reference) * per_total).ceil();
        // NaN (no area at all) is treated as the least share.
        let cuts = if share >= 1.0 {
            (share as u32).min(27)
        } else {
            1
        };
        *reference = reference.with_budget(4 + cuts);
    }
}

/// The room for new references that the left of two sides gets: its share of the budgets.
pub(crate) fn room_of_left(left: &[PrimitiveRef], right: &[PrimitiveRef], room: usize) -> usize {
    let sum = |references: &[PrimitiveRef]| -> u64 {
        references.iter().map(|r| u64::from(r.budget())).sum()
    };
    let (left, right) = (sum(left), sum(right));
    let share = left as f32 / (left + right) as f32 * room as f32;
    if share.is_nan() {
        room
    } else {
        (share as usize).min(room)
    }
}
