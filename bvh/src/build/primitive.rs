//! References to primitives, and boxes in SIMD registers.
//!
//! A box is eight lanes: the lower corner and the negated upper corner, so that one minimum unites
//! two boxes. Arithmetic is that of Embree's builder: centroids are doubled (min + max, never
//! halved), areas are half areas with one fixed order of operations, so that trees can be compared
//! with those of Embree to the last bit.

use glam::Vec3;
use wide::{f32x4, f32x8};

use super::LeafReference;
use crate::{bounds::Aabb, simd::build::Halves};

/// Keeps three lanes and sets the fourth to 0. Ids in the fourth lane would be subnormal numbers,
/// with which processors multiply slowly (a third of the time of binning, measured on Zen 4).
pub(crate) const THREE_LANES: f32x4 = f32x4::new([
    f32::from_bits(u32::MAX),
    f32::from_bits(u32::MAX),
    f32::from_bits(u32::MAX),
    0.0,
]);

/// A box: lower x, y, z, a free lane, −upper x, −y, −z, a free lane.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct Bounds(pub(crate) [f32; 8]);

impl Bounds {
    pub(crate) const EMPTY: Self = Self([f32::INFINITY; 8]);

    pub(crate) fn new(lower: f32x4, upper: f32x4) -> Self {
        let ([a, b, c, d], [e, f, g, h]) = (lower.to_array(), (-upper).to_array());
        Self([a, b, c, d, e, f, g, h])
    }

    pub(crate) fn of_aabb(aabb: &Aabb) -> Self {
        let ([a, b, c], [d, e, f]) = (aabb.min.to_array(), aabb.max.to_array());
        Self([a, b, c, 0.0, -d, -e, -f, 0.0])
    }

    #[inline(always)]
    pub(crate) fn lower(&self) -> f32x4 {
        let [x, y, z, w, ..] = self.0;
        f32x4::new([x, y, z, w])
    }

    #[inline(always)]
    pub(crate) fn negated_upper(&self) -> f32x4 {
        let [.., x, y, z, w] = self.0;
        f32x4::new([x, y, z, w])
    }

    #[inline(always)]
    pub(crate) fn upper(&self) -> f32x4 {
        -self.negated_upper()
    }

    #[inline(always)]
    pub(crate) fn extend(&mut self, other: &Self) {
        self.0 = f32x8::new(self.0).fast_min(f32x8::new(other.0)).to_array();
    }

    #[inline(always)]
    pub(crate) fn extend_by_point(&mut self, point: f32x4) {
        self.extend(&Self::new(point, point));
    }

    #[inline(always)]
    pub(crate) fn intersection(&self, other: &Self) -> Self {
        Self(f32x8::new(self.0).fast_max(f32x8::new(other.0)).to_array())
    }

    /// Upper − lower.
    #[inline(always)]
    pub(crate) fn extent(&self) -> f32x4 {
        f32x4::ZERO - (self.lower() + self.negated_upper())
    }

    /// Half the surface area: dx·(dy + dz) + dy·dz, rounded in this order. +∞ for the empty box.
    #[inline(always)]
    pub(crate) fn half_area(&self) -> f32 {
        let [dx, dy, dz, _] = self.extent().to_array();
        dx * (dy + dz) + dy * dz
    }

    /// Whether it holds no point.
    pub(crate) fn is_empty(&self) -> bool {
        let (lower, upper) = (self.lower().to_array(), self.upper().to_array());
        (0..3).any(|axis| lower[axis] > upper[axis])
    }

    pub(crate) fn to_aabb(self) -> Aabb {
        let corner = |v: f32x4| glam::Vec3::from_slice(&v.to_array()[..3]);
        Aabb {
            min: corner(self.lower()),
            max: corner(self.upper()),
        }
    }
}

const BUDGET_SHIFT: u32 = 27;

/// Geometry ids from this on leave no room for a budget of cuts.
pub(crate) const CUT_ID_LIMIT: u32 = 1 << BUDGET_SHIFT;

/// A primitive's box; the free lanes carry the geometry id and the primitive id as bits.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(crate) struct PrimitiveRef(pub(crate) Bounds);

impl PrimitiveRef {
    pub(crate) fn new(bounds: Aabb, geometry_id: u32, primitive_id: u32) -> Self {
        Self::with_ids(Bounds::of_aabb(&bounds), geometry_id, primitive_id)
    }

    #[inline(always)]
    fn with_ids(mut bounds: Bounds, geometry_id: u32, primitive_id: u32) -> Self {
        bounds.0[3] = f32::from_bits(geometry_id);
        bounds.0[7] = f32::from_bits(primitive_id);
        Self(bounds)
    }

    #[inline(always)]
    pub(crate) fn geometry_id(&self) -> u32 {
        self.0.0[3].to_bits()
    }

    #[inline(always)]
    pub(crate) fn primitive_id(&self) -> u32 {
        self.0.0[7].to_bits()
    }

    /// Twice the centroid; the fourth lane is 0.
    #[inline(always)]
    pub(crate) fn doubled_centroid(&self) -> f32x4 {
        (self.0.lower() - self.0.negated_upper()) & THREE_LANES
    }

    /// A coordinate of the doubled centroid; `axis` is below 3.
    #[inline(always)]
    pub(crate) fn doubled_centroid_on(&self, axis: usize) -> f32 {
        // The mask tells the compiler that both lanes exist.
        let axis = axis & 3;
        self.0.0[axis] - self.0.0[axis + 4]
    }

    /// The lower and the upper end of the box on an axis, which is below 3.
    #[inline(always)]
    pub(crate) fn range_on(&self, axis: usize) -> (f32, f32) {
        let axis = axis & 3;
        (self.0.0[axis], -self.0.0[axis + 4])
    }

    /// The order in which Embree sorts the primitives of a leaf.
    pub(crate) fn sort_key(&self) -> u64 {
        u64::from(self.primitive_id()) << 32 | u64::from(self.geometry_id())
    }

    /// How often it may still be cut in two, in the top bits of the geometry id: for builds that
    /// cut, whose geometry ids are below [`CUT_ID_LIMIT`].
    #[inline(always)]
    pub(crate) fn budget(&self) -> u32 {
        self.geometry_id() >> BUDGET_SHIFT
    }

    pub(crate) fn with_budget(&self, budget: u32) -> Self {
        self.part(&self.0, budget)
    }

    /// A part of the primitive, in a smaller box.
    #[inline(always)]
    pub(crate) fn part(&self, bounds: &Bounds, budget: u32) -> Self {
        let geometry_id = self.geometry_id() & (CUT_ID_LIMIT - 1) | budget << BUDGET_SHIFT;
        Self::with_ids(*bounds, geometry_id, self.primitive_id())
    }

    /// Its ids in a build that cuts.
    pub(crate) fn cut_leaf_reference(&self) -> LeafReference {
        LeafReference {
            geometry_id: self.geometry_id() & (CUT_ID_LIMIT - 1),
            primitive_id: self.primitive_id(),
        }
    }

    pub(crate) fn leaf_reference(&self) -> LeafReference {
        LeafReference {
            geometry_id: self.geometry_id(),
            primitive_id: self.primitive_id(),
        }
    }
}

/// What is known of a range of references: the box of the primitives and that of their doubled
/// centroids.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RangeBounds {
    pub(crate) geometry: Bounds,
    pub(crate) centroid: Bounds,
}

impl RangeBounds {
    pub(crate) const EMPTY: Self = Self {
        geometry: Bounds::EMPTY,
        centroid: Bounds::EMPTY,
    };

    #[inline(always)]
    pub(crate) fn extend(&mut self, reference: &PrimitiveRef) {
        self.geometry.extend(&reference.0);
        self.centroid.extend_by_point(reference.doubled_centroid());
    }

    pub(crate) fn merge(mut self, other: Self) -> Self {
        self.geometry.extend(&other.geometry);
        self.centroid.extend(&other.centroid);
        self
    }

    pub(crate) fn of(references: &[PrimitiveRef]) -> Self {
        let mut bounds = Self::EMPTY;
        for reference in references {
            bounds.extend(reference);
        }
        bounds
    }
}

/// Boxes in lanes, for the loops over all references.
pub(crate) trait BoxLanes: Halves {
    #[inline(always)]
    fn of(bounds: &Bounds) -> Self {
        Self::load(&bounds.0)
    }

    #[inline(always)]
    fn to_bounds(self) -> Bounds {
        Bounds(self.store())
    }

    /// The box of a point.
    #[inline(always)]
    fn of_point(p: Vec3) -> Self {
        Self::load(&[p.x, p.y, p.z, 0.0, -p.x, -p.y, -p.z, 0.0])
    }

    /// Whether the box holds no point: lower + −upper is positive on an axis.
    #[inline(always)]
    fn is_empty(self) -> bool {
        let excess = self.add(self.swap_halves());
        Self::bits(excess.le(Self::splat(0.0))) & 0b111 != 0b111
    }

    /// The box of the doubled centroid: (lower, −upper) − (−upper, lower).
    #[inline(always)]
    fn doubled_centroid(self) -> Self {
        self.sub(self.swap_halves())
    }
}

impl<L: Halves> BoxLanes for L {}
