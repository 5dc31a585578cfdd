//! What a ray is prepared to before it meets a tree: the tree's scale, a direction of about unit size, reciprocals, and
//! the margins of rounding.
//!
//! Invariant: a ray that could leave the range of f32 on its way, or is none, is not prepared, so that no test after this
//! one has to ask.

use glam::Vec3;

use super::triangle::NODE_PAD;
use crate::ray::Ray;

/// Bound S of the magnitude of scaled coordinates.
pub(crate) const COORDINATE_BOUND: f32 = 2.0;

/// Smaller components of a direction whose largest lies in 1/2..2 act as this in box tests.
const SMALLEST_COMPONENT: f32 = 1.0 / (1u64 << 60) as f32;

/// Origins farther away than this, in units of [`COORDINATE_BOUND`], hit nothing: the products of
/// the box test would leave the range of f32.
const FARTHEST_ORIGIN: f32 = (1u64 << 60) as f32;

/// A ray in the scaled space of a tree, with all that does not change along it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RaySetup {
    pub(crate) origin: [f32; 3],
    /// Scaled by a power of two so that the largest magnitude lies in 1/2..2.
    pub(crate) direction: [f32; 3],
    pub(crate) reciprocal: [f32; 3],
    /// (S + |origin|) · |reciprocal|: errors of distances are multiples of it.
    pub(crate) margin: [f32; 3],
    pub(crate) t_min: f32,
    pub(crate) t_max: f32,
    octant: usize,
    /// Distances in the caller's unit are those here times this, twice: the product of two powers
    /// of two, which may leave the range of f32 if formed first.
    unscale: [f32; 2],
}

impl RaySetup {
    /// Prepares a ray for a tree whose coordinates are those of the caller times `scale`, a power
    /// of two. `None` if the ray can hit nothing: not finite, without direction, an empty
    /// interval, or an origin so far away that it has no precision left.
    #[inline(always)]
    pub(crate) fn new(ray: &Ray, scale: f32) -> Option<Self> {
        let origin = ray.origin * scale;
        let largest = ray.direction.abs().max_element();
        let t_min = ray.t_min.max(0.0);
        // Comparisons are written so that NaN fails them; max_element may drop a NaN, so the
        // components are asked too.
        let usable = largest > 0.0
            && ray.direction.is_finite()
            && origin.abs().cmple(Vec3::splat(FARTHEST_ORIGIN)).all()
            && t_min <= ray.t_max
            && !ray.t_min.is_nan();
        if !usable {
            return None;
        }
        let [direction_scale, lift] = direction_scale(largest);
        // Both are 1 or neither is.
        let direction = if direction_scale == 1.0 {
            ray.direction
        } else {
            ray.direction * lift * direction_scale
        };
        let reciprocal = direction.to_array().map(|d| {
            if d.abs() < SMALLEST_COMPONENT {
                SMALLEST_COMPONENT.copysign(d)
            } else {
                d
            }
            .recip()
        });
        let margin = std::array::from_fn(|axis| {
            (COORDINATE_BOUND + origin[axis].abs()) * reciprocal[axis].abs()
        });
        // t · direction · scale = t' · direction', so t' = t · scale / (lift · direction_scale).
        let unscale = [direction_scale, lift / scale];
        // As `scaled`: without what is 1, and with a product by a power of two for the quotient by its reciprocal.
        let scaled_by = |t: f32| {
            if direction_scale == 1.0 {
                t * scale
            } else {
                scaled(t, unscale)
            }
        };
        Some(Self {
            origin: origin.to_array(),
            direction: direction.to_array(),
            reciprocal,
            margin,
            t_min: scaled_by(t_min),
            t_max: scaled_by(ray.t_max),
            // The signs are those of the reciprocals, but known before these are.
            octant: ray.direction.is_negative_bitmask() as usize,
            unscale,
        })
    }

    /// Bit a is set if the direction is negative along axis a.
    #[inline(always)]
    pub(super) fn octant(&self) -> usize {
        self.octant
    }

    /// What the box test adds to the product of a near plane and a far plane of an axis with the reciprocal.
    #[inline(always)]
    pub(super) fn addends(&self, margin: [f32; 3], axis: usize) -> [f32; 2] {
        let offset = -self.origin[axis] * self.reciprocal[axis];
        let pad = margin[axis] * NODE_PAD;
        [offset - pad, offset + pad]
    }

    /// A distance along the scaled ray in the caller's unit.
    #[inline]
    pub(crate) fn unscaled(&self, t: f32) -> f32 {
        t * self.unscale[0] * self.unscale[1]
    }

    /// A distance in the caller's unit along the scaled ray.
    #[inline]
    pub(crate) fn scaled(&self, t: f32) -> f32 {
        scaled(t, self.unscale)
    }

    /// The same ray up to a distance in the caller's unit. Where distances are so small or large
    /// that scaling rounds them, and a hit at `t` might be lost, it is not shortened.
    #[inline]
    pub(crate) fn limited_to(self, t: f32) -> Self {
        let limit = self.scaled(t);
        // Scaling keeps order, so this asks it of all distances beyond the limit.
        if limit < self.t_max && self.unscaled(limit.next_up()) > t {
            Self {
                t_max: limit,
                ..self
            }
        } else {
            self
        }
    }
}

#[inline]
fn scaled(t: f32, unscale: [f32; 2]) -> f32 {
    t / unscale[1] / unscale[0]
}

/// Two powers of two whose product brings the largest component of a direction into 1/2..2, where
/// most are already: no power of two changes a bit of what follows, but divisions take time.
#[inline]
fn direction_scale(largest: f32) -> [f32; 2] {
    if (0.5..2.0).contains(&largest) {
        [1.0, 1.0]
    } else {
        // A subnormal direction is lifted first: its power of two has no reciprocal in f32.
        let lift = if largest < f32::MIN_POSITIVE {
            (1u32 << 24) as f32
        } else {
            1.0
        };
        [power_of_two_below(largest * lift).recip(), lift]
    }
}

/// The largest power of two that is not above a positive normal number.
#[inline]
pub(crate) fn power_of_two_below(value: f32) -> f32 {
    f32::from_bits(value.to_bits() & 0x7f80_0000)
}

/// A ray that a kernel is asked about.
pub(crate) trait Asked: Copy {
    /// As the kernel needs it; `None` if it can hit nothing.
    fn setup(self) -> Option<RaySetup>;
}

impl Asked for &RaySetup {
    #[inline(always)]
    fn setup(self) -> Option<RaySetup> {
        Some(*self)
    }
}

/// A ray that the kernel prepares itself, as [`RaySetup::new`] does: what it finds stays in registers. Prepared
/// outside, its parts would be stored one by one and loaded several at once, which waits for the stores: about 4 ns,
/// a sixth of the time of a ray that misses the root.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unprepared<'a> {
    pub(crate) ray: &'a Ray,
    pub(crate) scale: f32,
}

impl Asked for Unprepared<'_> {
    #[inline(always)]
    fn setup(self) -> Option<RaySetup> {
        RaySetup::new(self.ray, self.scale)
    }
}
