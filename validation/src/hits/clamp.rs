//! Where our tests leave a distance: inside of the triangle's own box, widened by 8 roundings of the margin of the test
//! (`bvh/src/traverse/triangle.rs`).
//!
//! An end of the ray's way through the box is a largest or smallest of distances to planes, and a clamp does not fall
//! where its argument or an end rises. So from the bounds of these follow bounds of what is returned, whatever the
//! quotient was: a ray that passes an edge within the bound, nearly in the plane, meets the plane far away from the
//! box, and is told the box's end. A distance of a plane is off by a subtraction, the reciprocal, a product and the
//! pad, each a rounding of the margin m·|r|, where the pad's own are below another; the fast test finds the planes
//! from edges, three roundings more.

use raywright_bvh::{Accuracy, Ray, Vec3};

use super::{evaluate::gamma, sheared::axes_of};

/// The widening, in roundings of the margin.
const PAD: f64 = 8.0;

/// The largest power of two that is not above a positive normal number.
pub(super) fn power_of_two_below(value: f32) -> f64 {
    f64::from(f32::from_bits(value.to_bits() & 0x7f80_0000))
}

/// What a distance within a range becomes, if coordinates are below `coordinate_bound`: that of which the engine's
/// margins are made.
pub(super) fn clamped(
    [low, high]: [f64; 2],
    corners: [Vec3; 3],
    ray: &Ray,
    accuracy: Accuracy,
    coordinate_bound: f64,
) -> [f64; 2] {
    let direction = ray.direction.as_dvec3();
    let largest = ray.direction.abs().max_element();
    // Smaller components act as this; the direction is scaled by a power of two where it is not near 1.
    let scale = if (0.5..2.0).contains(&largest) {
        1.0
    } else {
        power_of_two_below(largest)
    };
    let smallest = scale / (1_u64 << 60) as f64;
    let [_, _, main] = axes_of(direction);
    let reciprocal = |axis: usize| {
        let component: f64 = direction[axis];
        component.abs().max(smallest).copysign(component).recip()
    };
    let margin = |axis: usize| {
        (coordinate_bound + f64::from(ray.origin[axis]).abs()) * reciprocal(axis).abs()
    };
    let roundings = match accuracy {
        Accuracy::Robust => 5.0,
        Accuracy::Fast => 8.0,
    };
    // The lower and the upper bound of either end.
    let (mut enter, mut leave) = ([f64::NEG_INFINITY; 2], [f64::INFINITY; 2]);
    for axis in 0..3 {
        let planes = corners.map(|corner| {
            (f64::from(corner[axis]) - f64::from(ray.origin[axis])) * reciprocal(axis)
        });
        let first = planes.into_iter().fold(f64::INFINITY, f64::min);
        let last = planes.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let padded = match accuracy {
            Accuracy::Robust => margin(axis) + margin(main),
            Accuracy::Fast => margin(axis),
        };
        let pad = PAD / (1 << 24) as f64 * padded;
        let off = gamma(roundings) * margin(axis);
        enter = [
            enter[0].max(first - pad - off),
            enter[1].max(first - pad + off),
        ];
        leave = [
            leave[0].min(last + pad - off),
            leave[1].min(last + pad + off),
        ];
    }
    [
        low.max(enter[0]).min(leave[0]),
        high.max(enter[1]).min(leave[1]),
    ]
}
