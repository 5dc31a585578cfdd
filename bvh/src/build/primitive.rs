//! References to primitives, and boxes in SIMD registers.
//!
//! Arithmetic is that of Embree's builder: centroids are doubled (min + max, never halved), areas
//! are half areas with one fixed order of operations, so that trees can be compared with those of
//! Embree to the last bit.

use wide::f32x4;

use super::LeafReference;
use crate::bounds::Aabb;

/// A box in two registers; the fourth lanes are free.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Bounds {
    pub(crate) lower: f32x4,
    pub(crate) upper: f32x4,
}

impl Bounds {
    pub(crate) const EMPTY: Self = Self {
        lower: f32x4::new([f32::INFINITY; 4]),
        upper: f32x4::new([f32::NEG_INFINITY; 4]),
    };

    #[inline(always)]
    pub(crate) fn extend(&mut self, other: &Self) {
        self.lower = self.lower.fast_min(other.lower);
        self.upper = self.upper.fast_max(other.upper);
    }

    #[inline(always)]
    pub(crate) fn extend_by_point(&mut self, point: f32x4) {
        self.lower = self.lower.fast_min(point);
        self.upper = self.upper.fast_max(point);
    }

    /// Half the surface area: dx·(dy + dz) + dy·dz, rounded in this order. +∞ for the empty box.
    #[inline(always)]
    pub(crate) fn half_area(&self) -> f32 {
        let [dx, dy, dz, _] = (self.upper - self.lower).to_array();
        dx * (dy + dz) + dy * dz
    }

    #[inline(always)]
    pub(crate) fn intersection(&self, other: &Self) -> Self {
        Self {
            lower: self.lower.fast_max(other.lower),
            upper: self.upper.fast_min(other.upper),
        }
    }

    pub(crate) fn to_aabb(self) -> Aabb {
        let corner = |v: f32x4| glam::Vec3::from_slice(&v.to_array()[..3]);
        Aabb {
            min: corner(self.lower),
            max: corner(self.upper),
        }
    }
}

const BUDGET_SHIFT: u32 = 27;

/// Geometry ids from this on leave no room for a budget of cuts.
pub(crate) const CUT_ID_LIMIT: u32 = 1 << BUDGET_SHIFT;

/// A primitive's box; the fourth lanes carry the geometry id and the primitive id as bits.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct PrimitiveRef(pub(crate) Bounds);

impl PrimitiveRef {
    pub(crate) fn new(bounds: Aabb, geometry_id: u32, primitive_id: u32) -> Self {
        let lanes = |v: glam::Vec3, id: u32| f32x4::new([v.x, v.y, v.z, f32::from_bits(id)]);
        Self(Bounds {
            lower: lanes(bounds.min, geometry_id),
            upper: lanes(bounds.max, primitive_id),
        })
    }

    pub(crate) fn geometry_id(&self) -> u32 {
        self.0.lower.to_array()[3].to_bits()
    }

    pub(crate) fn primitive_id(&self) -> u32 {
        self.0.upper.to_array()[3].to_bits()
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
        let mut lower = bounds.lower.to_array();
        let mut upper = bounds.upper.to_array();
        let geometry_id = self.geometry_id() & (CUT_ID_LIMIT - 1) | budget << BUDGET_SHIFT;
        lower[3] = f32::from_bits(geometry_id);
        upper[3] = f32::from_bits(self.primitive_id());
        Self(Bounds {
            lower: f32x4::new(lower),
            upper: f32x4::new(upper),
        })
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

    /// Twice the centroid.
    #[inline(always)]
    pub(crate) fn doubled_centroid(&self) -> f32x4 {
        self.0.lower + self.0.upper
    }

    /// The order in which Embree sorts the primitives of a leaf.
    pub(crate) fn sort_key(&self) -> u64 {
        u64::from(self.primitive_id()) << 32 | u64::from(self.geometry_id())
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
