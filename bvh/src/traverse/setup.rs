//! What a ray is prepared to before it meets a tree: the tree's scale, a direction of about unit size, reciprocals, and
//! the margins of rounding.
//!
//! Invariant: a ray that could leave the range of f32 on its way, or is none, is not prepared, so that no test after this
//! one has to ask.

use glam::Vec3;
use wide::f32x4;

use crate::{ray::Ray, simd::Lanes};

/// Bound S of the magnitude of scaled coordinates.
pub(crate) const COORDINATE_BOUND: f32 = 2.0;

/// Directions whose largest component lies from the reciprocal of this to this are taken as they are: not far enough from
/// 1 to bring what the tests make of them to the ends of f32.
const LONGEST_AS_IT_IS: f32 = (1 << 16) as f32;

/// Smaller components of such a direction act as this in box tests.
const SMALLEST_COMPONENT: f32 = 1.0 / (1u64 << 60) as f32;

/// Origins farther away than this, in units of [`COORDINATE_BOUND`], hit nothing: the products of
/// the box test would leave the range of f32.
const FARTHEST_ORIGIN: f32 = (1u64 << 60) as f32;

/// The bits of four lanes that all hold.
const ALL_LANES: u32 = 0b1111;

/// A ray in the scaled space of a tree, with all that does not change along it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RaySetup {
    pub(crate) origin: [f32; 3],
    /// Scaled by a power of two so that the largest magnitude lies in 1..2, unless it is about as large.
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
    pub(crate) fn new(ray: &Ray, scale: f32) -> Option<Self> {
        Self::in_lanes::<f32x4>(ray, scale)
    }

    /// As [`Self::new`], the axes in lanes: no other part of a traversal has so long a chain of operations.
    #[inline(always)]
    pub(crate) fn in_lanes<T: Lanes<4>>(ray: &Ray, scale: f32) -> Option<Self> {
        let origin = in_lanes::<T>(ray.origin.to_array()).mul(T::splat(scale));
        let t_min = ray.t_min.max(0.0);
        // Comparisons are written so that NaN fails them.
        let is_near = T::bits(origin.abs().le(T::splat(FARTHEST_ORIGIN))) == ALL_LANES;
        let usable = is_near && t_min <= ray.t_max && !ray.t_min.is_nan();
        if !usable {
            return None;
        }
        let direction = in_lanes::<T>(ray.direction.to_array());
        let length = direction.abs();
        let is_short = T::bits(length.le(T::splat(LONGEST_AS_IT_IS))) == ALL_LANES;
        let is_long = T::bits(T::splat(LONGEST_AS_IT_IS.recip()).le(length)) != 0;
        let (direction, unscale, t_min, t_max) = if is_short && is_long {
            let unscale = [1.0, scale.recip()];
            (direction, unscale, t_min * scale, ray.t_max * scale)
        } else {
            let (direction, [direction_scale, lift]) = scaled_direction(ray.direction)?;
            // t · direction · scale = t' · direction', so t' = t · scale / (lift · direction_scale).
            let unscale = [direction_scale, lift / scale];
            let direction = in_lanes::<T>(direction.to_array());
            (
                direction,
                unscale,
                scaled(t_min, unscale),
                scaled(ray.t_max, unscale),
            )
        };
        // Infinite where a component is 0 or nearly so, and then limited as that of any other small one.
        let reciprocal = T::splat(1.0).div(direction);
        let magnitude = reciprocal.abs().min(T::splat(SMALLEST_COMPONENT.recip()));
        let margin = T::splat(COORDINATE_BOUND).add(origin.abs()).mul(magnitude);
        Some(Self {
            origin: of_lanes(origin),
            direction: of_lanes(direction),
            reciprocal: of_lanes(magnitude.xor_sign(direction)),
            margin: of_lanes(margin),
            t_min,
            t_max,
            octant: ray.direction.is_negative_bitmask() as usize,
            unscale,
        })
    }

    /// Bit a is set if the direction is negative along axis a.
    #[inline(always)]
    pub(super) fn octant(&self) -> usize {
        self.octant
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

/// A direction multiplied by two powers of two so that its largest component lies in 1..2, which changes no bit of what
/// follows. `None` if it is 0 or not finite.
#[inline]
fn scaled_direction(direction: Vec3) -> Option<(Vec3, [f32; 2])> {
    let largest = direction.abs().max_element();
    // max_element may drop a NaN.
    if !direction.is_finite() || largest == 0.0 {
        return None;
    }
    // At both ends of f32 powers of two have no reciprocal that is a normal number.
    let lift = if largest < f32::MIN_POSITIVE {
        (1u32 << 24) as f32
    } else if largest >= 2.0 / f32::MIN_POSITIVE {
        0.5
    } else {
        1.0
    };
    let scale = reciprocal_power_of_two(power_of_two_below(largest * lift));
    Some((direction * lift * scale, [scale, lift]))
}

/// The axes, and 0.
#[inline(always)]
pub(super) fn in_lanes<T: Lanes<4>>([x, y, z]: [f32; 3]) -> T {
    T::load(&[x, y, z, 0.0])
}

/// The axes of [`in_lanes`].
#[inline(always)]
fn of_lanes<T: Lanes<4>>(lanes: T) -> [f32; 3] {
    let [x, y, z, _] = lanes.store();
    [x, y, z]
}

/// The reciprocal of a power of two from 2⁻¹²⁶ to 2¹²⁶, without a division.
#[inline]
fn reciprocal_power_of_two(power: f32) -> f32 {
    f32::from_bits(2 * 1f32.to_bits() - power.to_bits())
}

/// The largest power of two that is not above a positive normal number.
#[inline]
pub(crate) fn power_of_two_below(value: f32) -> f32 {
    f32::from_bits(value.to_bits() & 0x7f80_0000)
}

/// A ray that a kernel is asked about.
pub(crate) trait Asked: Copy {
    /// As the kernel needs it; `None` if it can hit nothing.
    fn setup<T: Lanes<4>>(self) -> Option<RaySetup>;
}

impl Asked for &RaySetup {
    #[inline(always)]
    fn setup<T: Lanes<4>>(self) -> Option<RaySetup> {
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
    fn setup<T: Lanes<4>>(self) -> Option<RaySetup> {
        RaySetup::in_lanes::<T>(self.ray, self.scale)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// From the subnormal to the largest, of both signs, and 0.
    fn component() -> impl Strategy<Value = f32> {
        prop_oneof![
            8 => (-1f64..1.0, -149i32..128)
                .prop_map(|(value, exponent)| (value * 2f64.powi(exponent)) as f32),
            1 => prop::sample::select(vec![0.0, -0.0, 1.0, f32::MAX, -f32::from_bits(1)]),
        ]
    }

    /// Of like size, or of any.
    fn direction() -> impl Strategy<Value = Vec3> {
        prop_oneof![
            (prop::array::uniform3(-1f64..1.0), -149i32..128)
                .prop_map(|(v, exponent)| Vec3::from(v.map(|x| (x * 2f64.powi(exponent)) as f32))),
            prop::array::uniform3(component()).prop_map(Vec3::from),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn a_prepared_ray_is_the_ray(
            origin in prop::array::uniform3(-1f32..1.0), direction in direction(), scale_exponent in -60i32..60,
            t_min in 0f32..1.0, length in 0f32..1.0,
        ) {
            let scale = 2f32.powi(scale_exponent);
            let ray = Ray::new(origin, direction).with_range(t_min, t_min + length);
            let setup = RaySetup::new(&ray, scale);
            prop_assert_eq!(setup.is_some(), direction != Vec3::ZERO);
            prop_assume!(direction != Vec3::ZERO);
            let setup = setup.unwrap();
            let [given, prepared] = [direction, setup.direction.into()].map(|v: Vec3| v.as_dvec3());
            let factor = prepared.abs().max_element() / given.abs().max_element();
            prop_assert_eq!(factor.log2().fract(), 0.0);
            prop_assert!((2f64.powi(-16)..=2f64.powi(16)).contains(&prepared.abs().max_element()));
            for axis in 0..3 {
                // Rounded where a component is so much smaller than the largest that it becomes subnormal.
                prop_assert_eq!(setup.direction[axis], (given[axis] * factor) as f32);
                let reciprocal = (1.0 / setup.direction[axis]).abs().min(2f32.powi(60));
                prop_assert_eq!(setup.reciprocal[axis], reciprocal.copysign(direction[axis]));
                prop_assert_eq!(setup.octant >> axis & 1 == 1, direction[axis].is_sign_negative());
                prop_assert_eq!(setup.origin[axis], origin[axis] * scale);
                prop_assert_eq!(setup.margin[axis], (2.0 + setup.origin[axis].abs()) * reciprocal);
            }
            for (t, prepared) in [(ray.t_min, setup.t_min), (ray.t_max, setup.t_max)] {
                let exact = f64::from(t) * f64::from(scale) / factor;
                prop_assert_eq!(prepared, exact as f32);
                if exact > f64::from(f32::MIN_POSITIVE) && prepared.is_finite() {
                    prop_assert_eq!(setup.unscaled(prepared), t);
                }
            }
        }
    }
}
