//! The fast triangle test: Möller, Trumbore, *Fast, Minimum Storage Ray/Triangle Intersection*,
//! 1997, in the form of Embree's fast mode. A ray that meets a shared edge may slip through: both
//! triangles compute the edge from other differences.
//!
//! The numbers of `triangle`: the planes of the triangle's box, found from its edges, are off by at
//! most 3uS, and their distances by 3.1·u·m·|r| more; a box test is off by at most 4.1·u·m·|r|. So a
//! box that is padded by 10.3·u·m·|r| more than the triangle's own contains its interval, and
//! [`NODE_PAD`](super::triangle::NODE_PAD) − [`TRIANGLE_PAD`] is 16u. A true hit lies within
//! 7.3·u·m·|r| of the triangle's computed box, below [`TRIANGLE_PAD`]: no true hit is moved.

use super::{
    setup::RaySetup,
    triangle::{BlockHits, TRIANGLE_PAD, TriangleTest, box_interval, cross, dot, sub},
};
use crate::{
    layout::{block::Point, triangles::WithEdges},
    simd::{Lanes, splat_all},
};

/// Names the test.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fast;

/// A ray in lanes of triangles.
#[derive(Clone, Copy)]
pub(crate) struct FastRay<L> {
    origin: [L; 3],
    direction: [L; 3],
    pad: [f32; 3],
}

impl<B: WithEdges> TriangleTest<B> for Fast {
    type Ray<L: Lanes<4>> = FastRay<L>;

    #[inline(always)]
    fn margin(ray: &RaySetup) -> [f32; 3] {
        ray.margin
    }

    #[inline(always)]
    fn prepare<L: Lanes<4>>(ray: &RaySetup) -> FastRay<L> {
        FastRay {
            origin: splat_all(ray.origin),
            direction: splat_all(ray.direction),
            pad: ray.margin.map(|margin| margin * TRIANGLE_PAD),
        }
    }

    #[inline(always)]
    fn test<L: Lanes<4>>(
        ray: &RaySetup,
        prepared: &FastRay<L>,
        block: &B,
        points: &[Point],
        t_max: f32,
    ) -> BlockHits<L> {
        let [vertex, edge_1, edge_2] = block.edges::<L>(points);
        let to_vertex = sub(vertex, prepared.origin);
        let r = cross(to_vertex, prepared.direction);
        let normal = cross(edge_2, edge_1);
        let den = dot(normal, prepared.direction);
        let u = dot(r, edge_2).xor_sign(den);
        let v = dot(r, edge_1).xor_sign(den);
        let den_abs = den.abs();
        let zero = L::splat(0.0);
        let inside = den.is_nonzero() & zero.le(u) & zero.le(v) & u.add(v).le(den_abs);
        if L::bits(inside) == 0 {
            return BlockHits::none();
        }
        let t = dot(normal, to_vertex).xor_sign(den).div(den_abs);
        let corners = [vertex, sub(vertex, edge_1), add(vertex, edge_2)];
        let (enter, leave) = box_interval(corners, prepared.origin, ray.reciprocal, prepared.pad);
        let t = t.max(enter).min(leave);
        let hit = inside & enter.le(leave) & L::splat(ray.t_min).le(t) & t.le(L::splat(t_max));
        BlockHits {
            mask: L::bits(hit),
            t,
            u,
            v,
            den: den_abs,
        }
    }
}

#[inline(always)]
fn add<L: Lanes<4>>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0].add(b[0]), a[1].add(b[1]), a[2].add(b[2])]
}
