//! Where a ray is in a box, in f64.
//!
//! Invariant: an interval contains the exact one, and that of each box within the box: distances to planes are three
//! roundings off, are widened by eight, and every operation is monotone.

use glam::DVec3;
use raywright_bvh::Ray;

/// Widening of a distance to a plane, as a share of it.
const WIDENING: f64 = 8.0 * f64::EPSILON;

/// A ray without its ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    origin: DVec3,
    reciprocal: DVec3,
}

impl Line {
    pub(super) fn new(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.as_dvec3(),
            reciprocal: ray.direction.as_dvec3().recip(),
        }
    }

    /// The distances at which a box is entered and left; the first is larger if it is missed.
    #[inline]
    pub(super) fn interval(&self, min: DVec3, max: DVec3) -> [f64; 2] {
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..3 {
            let (low, high) = (min[axis] - self.origin[axis], max[axis] - self.origin[axis]);
            let reciprocal = self.reciprocal[axis];
            if reciprocal.is_infinite() {
                if low > 0.0 || high < 0.0 {
                    return [f64::INFINITY, f64::NEG_INFINITY];
                }
                continue;
            }
            let (a, b) = (low * reciprocal, high * reciprocal);
            let (near, far) = (a.min(b), a.max(b));
            enter = enter.max(near - WIDENING * near.abs());
            leave = leave.min(far + WIDENING * far.abs());
        }
        [enter, leave]
    }
}
