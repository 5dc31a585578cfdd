//! The robust triangle test: Woop, Benthin, Wald, *Watertight Ray/Triangle Intersection*, JCGT
//! 2013. Vertices are moved and sheared so that the ray becomes the axis z; the ray meets a triangle
//! if the point (0, 0) is on no outer side of its three edges.
//!
//! Watertight, because a vertex has the same sheared coordinates in all triangles around it, and
//! the side of an edge is found exactly: products and differences are monotone under rounding, so
//! that an edge value that is not 0 has the sign of the exact one, and where one is 0 (or so small
//! that the quotients would suffer), all is done again in f64, in which products of f32 are exact.
//! So the triangles around (0, 0) cover it as they would in exact arithmetic, edges and vertices
//! included. Only triangles seen exactly edge-on (all three values 0) are left out; the others
//! around them cover the plane without them.
//!
//! The distance is that to the triangle's plane, found as `fast` finds it, from the corners as they
//! are: what shearing rounds moves the point on the triangle by a few ulps of the origin, which along
//! a ray at a flat angle is much, and a ray that starts beside a triangle would hit it. Where the ray
//! is parallel to the plane, the distance is interpolated from the sheared corners.
//!
//! Why no such hit misses its own box: with u, m, r, S of `triangle`, d the direction, z its largest
//! axis, M = m/|d| per axis. The sheared x of a vertex P − o is off by at most
//! u·(2·m_x + 4·|d_x/d_z|·m_z). The weights with which the three computed vertices give (0, 0) make
//! a point p of the triangle, and at the distance t of its z the ray is as far from p along x as
//! that: within u·(2·M_x + 4·M_z) in distance. The computed distances to planes are off by 4·u·M
//! with the pad. So the ray is inside the box at t if it is widened by u·(6·M_x + 4·M_z), and the
//! margin here is M_x + M_z, of which [`TRIANGLE_PAD`] takes 8u. The distance to the plane is clamped
//! to the interval of which this shows that it is not empty. (A component of the direction
//! below 2⁻⁶⁰ acts as 2⁻⁶⁰ in box tests; what that moves, t·2⁻⁵⁹, is below the pad's 16u for
//! origins nearer than 2³⁶ sizes of the scene, 2²⁰ where the direction's largest component is 2⁻¹⁶, the shortest that is
//! taken as it is.)

use glam::DVec3;

use super::{
    setup::RaySetup,
    triangle::{BlockHits, TRIANGLE_PAD, TriangleTest, box_interval, cross, dot, store, sub},
};
use crate::{
    layout::{block::Point, triangles::WithCorners},
    simd::{Lanes, splat_all},
};

/// Edge values below this are found again in f64: quotients of larger ones do not underflow.
pub(crate) const SMALL_EDGE_VALUE: f32 = 1.0 / (1u128 << 80) as f32;

/// Names the test.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Robust;

/// A ray in lanes of triangles. Axes are ordered so that the last is the largest of the direction.
#[derive(Clone, Copy)]
pub(crate) struct RobustRay<L> {
    axes: [usize; 3],
    origin: [L; 3],
    direction: [L; 3],
    /// x/z and y/z of the direction.
    shear: [L; 2],
    reciprocal: [f32; 3],
    pad: [f32; 3],
}

/// The axes in cyclic order, the largest of a direction last; of equal ones, the first.
#[inline(always)]
pub(crate) fn axes_of(direction: [f32; 3]) -> [usize; 3] {
    let [x, y, z] = direction.map(f32::abs);
    if x >= y && x >= z {
        [1, 2, 0]
    } else if y >= z {
        [2, 0, 1]
    } else {
        [0, 1, 2]
    }
}

/// M of every axis and of the largest.
#[inline(always)]
pub(crate) fn margin_of(ray: &RaySetup, z: usize) -> [f32; 3] {
    ray.margin.map(|margin| margin + ray.margin[z])
}

impl<B: WithCorners> TriangleTest<B> for Robust {
    type Ray<L: Lanes<4>> = RobustRay<L>;

    #[inline(always)]
    fn margin(ray: &RaySetup) -> [f32; 3] {
        let [_, _, z] = axes_of(ray.direction);
        margin_of(ray, z)
    }

    #[inline(always)]
    fn prepare<L: Lanes<4>>(ray: &RaySetup) -> RobustRay<L> {
        let axes = axes_of(ray.direction);
        let [x, y, z] = axes.map(|axis| ray.direction[axis]);
        let margin = margin_of(ray, axes[2]);
        RobustRay {
            axes,
            origin: splat_all(axes.map(|axis| ray.origin[axis])),
            direction: splat_all([x, y, z]),
            shear: [L::splat(x / z), L::splat(y / z)],
            reciprocal: axes.map(|axis| ray.reciprocal[axis]),
            pad: axes.map(|axis| margin[axis] * TRIANGLE_PAD),
        }
    }

    #[inline(always)]
    fn test<L: Lanes<4>>(
        ray: &RaySetup,
        prepared: &RobustRay<L>,
        block: &B,
        points: &[Point],
        t_max: f32,
    ) -> BlockHits<L> {
        let corners = block.corners::<L>(points, prepared.axes);
        let a = prepared.sheared(corners[0]);
        let b = prepared.sheared(corners[1]);
        let c = prepared.sheared(corners[2]);
        let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
        let zero = L::splat(0.0);
        let (low, high) = (u.min(v).min(w), u.max(v).max(w));
        let inside = L::bits(zero.le(low)) | L::bits(high.le(zero));
        if inside == 0 {
            return BlockHits::none();
        }
        let to_corner = sub(corners[0], prepared.origin);
        let normal = cross(sub(corners[2], corners[0]), sub(corners[0], corners[1]));
        let approach = dot(normal, prepared.direction);
        let mut hits = BlockHits {
            mask: inside,
            t: dot(normal, to_corner).div(approach),
            u: v,
            v: w,
            den: u.add(v).add(w),
        };
        let smallest = u.abs().min(v.abs()).min(w.abs());
        let clear = L::bits(approach.is_nonzero());
        let doubtful = inside & (L::bits(smallest.le(L::splat(SMALL_EDGE_VALUE))) | !clear);
        if doubtful != 0 {
            decide(ray, prepared.axes, corners, [a, b, c], doubtful, &mut hits);
        }
        let [reciprocal, pad] = [splat_all(prepared.reciprocal), splat_all(prepared.pad)];
        let (enter, leave) = box_interval(corners, prepared.origin, reciprocal, pad);
        hits.t = hits.t.max(enter).min(leave);
        let in_box = enter.le(leave) & L::splat(ray.t_min).le(hits.t);
        hits.mask &= L::bits(in_box & hits.t.le(L::splat(t_max)));
        hits
    }
}

impl<L: Lanes<4>> RobustRay<L> {
    /// A vertex in the space in which the ray is the axis z.
    #[inline(always)]
    fn sheared(&self, corner: [L; 3]) -> [L; 3] {
        let z = corner[2].sub(self.origin[2]);
        let (x, y) = (corner[0].sub(self.origin[0]), corner[1].sub(self.origin[1]));
        [x.sub(self.shear[0].mul(z)), y.sub(self.shear[1].mul(z)), z]
    }
}

/// On which side of the edge from q to p the axis z is.
#[inline(always)]
fn edge<L: Lanes<4>>(p: [L; 3], q: [L; 3]) -> L {
    p[0].mul(q[1]).sub(p[1].mul(q[0]))
}

/// Does the `doubtful` lanes again by [`in_f64`].
#[cold]
#[inline(always)]
fn decide<L: Lanes<4>>(
    ray: &RaySetup,
    axes: [usize; 3],
    corners: [[L; 3]; 3],
    sheared: [[L; 3]; 3],
    mut doubtful: u32,
    hits: &mut BlockHits<L>,
) {
    let [corners, sheared] = [corners, sheared].map(|corners| corners.map(store));
    let mut columns = [
        hits.t.store(),
        hits.u.store(),
        hits.v.store(),
        hits.den.store(),
    ];
    while doubtful != 0 {
        let lane = doubtful.trailing_zeros() as usize & 3;
        doubtful &= doubtful - 1;
        let of_lane = |corner: [[f32; 4]; 3]| corner.map(|row| row[lane]);
        match in_f64(ray, axes, corners.map(of_lane), sheared.map(of_lane)) {
            Some([t, u, v]) => {
                for (column, value) in columns.iter_mut().zip([t, u, v, 1.0]) {
                    column[lane] = value;
                }
            }
            None => hits.mask &= !(1 << lane),
        }
    }
    hits.t = L::load(&columns[0]);
    hits.u = L::load(&columns[1]);
    hits.v = L::load(&columns[2]);
    hits.den = L::load(&columns[3]);
}

/// Distance and weights of vertices 1 and 2 in f64, with edge values of exact sign, from the corners
/// and from what they are sheared to, both with their axes in the order `axes`.
#[inline(never)]
pub(crate) fn in_f64(
    ray: &RaySetup,
    axes: [usize; 3],
    corners: [[f32; 3]; 3],
    sheared: [[f32; 3]; 3],
) -> Option<[f32; 3]> {
    let [a, b, c] = sheared.map(|corner| DVec3::from(corner.map(f64::from)));
    let edge = |p: DVec3, q: DVec3| p.x * q.y - p.y * q.x;
    let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
    let den = u + v + w;
    let mixed = u.min(v).min(w) < 0.0 && u.max(v).max(w) > 0.0;
    if mixed || den == 0.0 {
        return None;
    }
    let (weight_b, weight_c) = (v / den, w / den);
    let [origin, direction] =
        [ray.origin, ray.direction].map(|v| DVec3::from(axes.map(|axis| f64::from(v[axis]))));
    let [p, q, r] = corners.map(|corner| DVec3::from(corner.map(f64::from)));
    let normal = (r - p).cross(p - q);
    let approach = normal.dot(direction);
    let t = if approach == 0.0 {
        (a.z + weight_b * (b.z - a.z) + weight_c * (c.z - a.z)) / direction.z
    } else {
        normal.dot(p - origin) / approach
    };
    // Adding 0 makes a negative 0 a positive one.
    Some([t, weight_b, weight_c].map(|x| x as f32 + 0.0))
}
