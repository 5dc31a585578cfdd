//! The fast triangle test: Möller, Trumbore, *Fast, Minimum Storage Ray/Triangle Intersection*,
//! 1997, in the form of Embree's fast mode. A ray that meets a shared edge may slip through: both
//! triangles compute the edge from other differences.
//!
//! The numbers of `triangle`: the planes of the triangle's box, found from its edges, are off by at
//! most 3uS, and their distances by 3.1·u·m·|r| more; a box test is off by at most 4.1·u·m·|r|. So a
//! box that is padded by 10.3·u·m·|r| more than the triangle's own contains its interval, and
//! [`NODE_PAD`](super::triangle::NODE_PAD) − [`TRIANGLE_PAD`] is 16u. A true hit lies within
//! 7.3·u·m·|r| of the triangle's computed box, below [`TRIANGLE_PAD`]: no true hit is moved.

use std::ops::BitAnd;

use super::{
    kernel::Candidate,
    packet::{PACKET_SIZE, PacketRays},
    setup::RaySetup,
    triangle::{BlockHits, TRIANGLE_PAD, TriangleTest, box_interval, cross, dot, store, sub},
};
use crate::{
    layout::{
        block::{NO_PRIMITIVE, Point},
        triangles::WithEdges,
    },
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
        let triangles = block.edges::<L>(points);
        let sides = Sides::new(triangles, prepared.origin, prepared.direction);
        if L::bits(sides.inside) == 0 {
            return BlockHits::none();
        }
        let [reciprocal, pad] = [splat_all(ray.reciprocal), splat_all(prepared.pad)];
        let interval = [L::splat(ray.t_min), L::splat(t_max)];
        sides.hits(triangles, prepared.origin, reciprocal, pad, interval)
    }

    #[inline(always)]
    fn test_packet<L: Lanes<4>, R: Lanes<PACKET_SIZE>>(
        rays: &PacketRays,
        block: &B,
        points: &[Point],
        mut tell: impl FnMut(usize, Candidate),
    ) -> Option<u32> {
        let [vertex, edge_1, edge_2] = block.edges::<L>(points);
        let rows = [store(vertex), store(edge_1), store(edge_2)];
        let mut all_hits = 0;
        for (k, &id) in block.ids().iter().enumerate() {
            if id == NO_PRIMITIVE {
                break;
            }
            let triangle: [[R; 3]; 3] = [
                of_lane(&rows[0], k),
                of_lane(&rows[1], k),
                of_lane(&rows[2], k),
            ];
            let origin = load(&rays.origin);
            let sides = Sides::new(triangle, origin, load(&rays.direction));
            if R::bits(sides.inside) == 0 {
                continue;
            }
            let interval = [R::load(&rays.t_min), R::load(&rays.t_max)];
            let hits = sides.hits(
                triangle,
                origin,
                load(&rays.reciprocal),
                load(&rays.triangle_pad),
                interval,
            );
            if hits.mask == 0 {
                continue;
            }
            all_hits |= hits.mask;
            let (u, v) = (hits.u.div(hits.den), hits.v.div(hits.den));
            let (t, u, v) = (hits.t.store(), u.store(), v.store());
            let mut lanes = hits.mask;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize & (PACKET_SIZE - 1);
                lanes &= lanes - 1;
                let (t, u, v) = (t[lane], u[lane], v[lane]);
                tell(lane, Candidate { t, u, v, id });
            }
        }
        Some(all_hits)
    }
}

/// On which sides of triangles rays pass: one ray and many triangles, or many rays and one.
struct Sides<L, M> {
    to_vertex: [L; 3],
    normal: [L; 3],
    u: L,
    v: L,
    den: L,
    inside: M,
}

impl<L, M: Copy> Sides<L, M> {
    #[inline(always)]
    fn new<const N: usize>(
        [vertex, edge_1, edge_2]: [[L; 3]; 3],
        origin: [L; 3],
        direction: [L; 3],
    ) -> Self
    where
        L: Lanes<N, Mask = M>,
        M: BitAnd<Output = M>,
    {
        let to_vertex = sub(vertex, origin);
        let r = cross(to_vertex, direction);
        let normal = cross(edge_2, edge_1);
        let den = dot(normal, direction);
        let u = dot(r, edge_2).xor_sign(den);
        let v = dot(r, edge_1).xor_sign(den);
        let zero = L::splat(0.0);
        let inside = den.is_nonzero() & zero.le(u) & zero.le(v) & u.add(v).le(den.abs());
        Self {
            to_vertex,
            normal,
            u,
            v,
            den,
            inside,
        }
    }

    /// The hits of those inside, at distances from the first to the second of `interval`.
    #[inline(always)]
    fn hits<const N: usize>(
        self,
        [vertex, edge_1, edge_2]: [[L; 3]; 3],
        origin: [L; 3],
        reciprocal: [L; 3],
        pad: [L; 3],
        [t_min, t_max]: [L; 2],
    ) -> BlockHits<L>
    where
        L: Lanes<N, Mask = M>,
        M: BitAnd<Output = M>,
    {
        let den = self.den.abs();
        let t = dot(self.normal, self.to_vertex).xor_sign(self.den).div(den);
        let corners = [vertex, sub(vertex, edge_1), add(vertex, edge_2)];
        let (enter, leave) = box_interval(corners, origin, reciprocal, pad);
        let t = t.max(enter).min(leave);
        let hit = self.inside & enter.le(leave) & t_min.le(t) & t.le(t_max);
        BlockHits {
            mask: L::bits(hit),
            t,
            u: self.u,
            v: self.v,
            den,
        }
    }
}

/// One of four vectors in every lane.
#[inline(always)]
fn of_lane<R: Lanes<PACKET_SIZE>>([x, y, z]: &[[f32; 4]; 3], lane: usize) -> [R; 3] {
    splat_all([x[lane], y[lane], z[lane]])
}

#[inline(always)]
fn load<R: Lanes<PACKET_SIZE>>([x, y, z]: &[[f32; PACKET_SIZE]; 3]) -> [R; 3] {
    [R::load(x), R::load(y), R::load(z)]
}

#[inline(always)]
fn add<const N: usize, L: Lanes<N>>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0].add(b[0]), a[1].add(b[1]), a[2].add(b[2])]
}
