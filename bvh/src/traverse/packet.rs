//! Traversal by sixteen rays that go side by side: the boxes of a node are first tested for all rays at once, by
//! intervals of their origins and reciprocal directions (Boulos, Wald, Shirley, *Geometric and Arithmetic Culling
//! Methods for Entire Ray Packets*, 2006), and those that some ray may enter for each ray, a ray in a lane; so are the
//! triangles of a leaf, if the test can. Where few rays are left together they go on one by one (Benthin, Wald, Woop, Ernst, Mattausch, Ernst, *Combining Single and
//! Packet-Ray Tracing for Arbitrary Ray Distributions on the Intel MIC Architecture*, 2012): rays that part cost
//! little more than if they had never been together.
//!
//! Invariants: the rays of a packet have one octant; boxes are tested as conservatively as for one ray (see `Bundle`), so
//! that answers are those of one ray at a time to the last bit.

use super::{
    kernel::{Best, Candidate, follow, order_of},
    node_test::BoxRay,
    setup::RaySetup,
    triangle::{NODE_PAD, TRIANGLE_PAD, TriangleTest},
};
use crate::{
    layout::{
        block::Block,
        node::{ChildRef, Node},
        tree::Tree,
    },
    ray::Ray,
    simd::{
        Lanes, PushChildren, splat_all,
        stack::{Stack, StackMemory},
    },
};

/// How many rays go together.
pub(crate) const PACKET_SIZE: usize = 16;

/// So many rays are not worth their company: each goes down alone, or is tested with four triangles at a time, which is
/// about as much as testing all rays with one triangle after the other.
const TOO_FEW: u32 = 6;

/// Whether all directions have the same signs.
#[inline(always)]
pub(super) fn go_side_by_side(rays: &[Ray]) -> bool {
    let mut differ = [0; 3];
    for ray in rays {
        for (axis, differ) in differ.iter_mut().enumerate() {
            *differ |= ray.direction[axis].to_bits() ^ rays[0].direction[axis].to_bits();
        }
    }
    (differ[0] | differ[1] | differ[2]) >> 31 == 0
}

/// What a ray of a packet needs for itself.
struct Member<P> {
    place: usize,
    ray: RaySetup,
    prepared: P,
    best: Best,
}

/// A value of each ray, 0 for lanes without.
type OfRays = [f32; PACKET_SIZE];

/// The rays in lanes.
pub(crate) struct PacketRays {
    pub(super) origin: [OfRays; 3],
    pub(super) direction: [OfRays; 3],
    pub(super) reciprocal: [OfRays; 3],
    near_addend: [OfRays; 3],
    far_addend: [OfRays; 3],
    /// What widens the boxes of triangles.
    pub(super) triangle_pad: [OfRays; 3],
    pub(super) t_min: OfRays,
    /// Hits beyond are of no interest: −∞ for rays that need no more.
    pub(super) t_max: OfRays,
}

impl PacketRays {
    const NONE: Self = Self {
        origin: [[0.0; PACKET_SIZE]; 3],
        direction: [[0.0; PACKET_SIZE]; 3],
        reciprocal: [[0.0; PACKET_SIZE]; 3],
        near_addend: [[0.0; PACKET_SIZE]; 3],
        far_addend: [[0.0; PACKET_SIZE]; 3],
        triangle_pad: [[0.0; PACKET_SIZE]; 3],
        t_min: [0.0; PACKET_SIZE],
        t_max: [f32::NEG_INFINITY; PACKET_SIZE],
    };

    /// The operations of `BoxLanes`, with rays in the lanes instead of boxes.
    #[inline(always)]
    fn test<const N: usize, const W: usize, R: Lanes<PACKET_SIZE>>(
        &self,
        node: &Node<N, W>,
        slot: usize,
        near_plane: [usize; 3],
    ) -> (R, u32) {
        let mut enter = R::load(&self.t_min);
        let mut leave = R::load(&self.t_max);
        for (axis, near_plane) in near_plane.into_iter().enumerate() {
            let reciprocal = R::load(&self.reciprocal[axis]);
            let near = R::splat(node.planes[near_plane][slot]);
            let far = R::splat(node.planes[near_plane ^ 1][slot]);
            enter = enter.max(near.mul_add(reciprocal, R::load(&self.near_addend[axis])));
            leave = leave.min(far.mul_add(reciprocal, R::load(&self.far_addend[axis])));
        }
        (enter, R::bits(enter.le(leave)))
    }
}

/// Bounds of all rays, in lanes of children.
///
/// A plane is at (plane − origin) · reciprocal, which is found with three roundings, as far off as the box test of one
/// ray is; the pad is the largest of all rays.
struct Bundle<L> {
    /// The origins that make the distance of a near plane smallest, and that of a far plane largest.
    near_origin: [L; 3],
    far_origin: [L; 3],
    reciprocals: [[L; 3]; 2],
    pad: [L; 3],
    near_plane: [usize; 3],
    t_min: L,
}

impl<L> Bundle<L> {
    #[inline(always)]
    fn new<const N: usize, B, A: TriangleTest<B>, P>(members: &[Member<P>]) -> Self
    where
        L: Lanes<N>,
    {
        let octant = members.first().map_or(0, |member| member.ray.octant());
        let (mut origin, mut reciprocal) = (
            [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]],
            [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]],
        );
        let (mut pad, mut t_min) = ([0.0f32; 3], f32::INFINITY);
        for Member { ray, .. } in members {
            let margin = A::margin(ray);
            t_min = t_min.min(ray.t_min);
            for axis in 0..3 {
                origin[0][axis] = origin[0][axis].min(ray.origin[axis]);
                origin[1][axis] = origin[1][axis].max(ray.origin[axis]);
                reciprocal[0][axis] = reciprocal[0][axis].min(ray.reciprocal[axis]);
                reciprocal[1][axis] = reciprocal[1][axis].max(ray.reciprocal[axis]);
                pad[axis] = pad[axis].max(margin[axis] * NODE_PAD);
            }
        }
        let (mut near_origin, mut far_origin, mut near_plane) = ([0.0; 3], [0.0; 3], [0; 3]);
        for axis in 0..3 {
            let is_negative = octant >> axis & 1;
            near_origin[axis] = origin[1 - is_negative][axis];
            far_origin[axis] = origin[is_negative][axis];
            near_plane[axis] = 2 * axis + is_negative;
        }
        Self {
            near_origin: splat_all(near_origin),
            far_origin: splat_all(far_origin),
            reciprocals: [splat_all(reciprocal[0]), splat_all(reciprocal[1])],
            pad: splat_all(pad),
            near_plane,
            t_min: L::splat(t_min),
        }
    }

    /// One bit per box that some ray may enter before `t_max`.
    #[inline(always)]
    fn test<const N: usize, const W: usize>(&self, node: &Node<N, W>, t_max: f32) -> u32
    where
        L: Lanes<N>,
    {
        let (mut enter, mut leave) = (self.t_min, L::splat(t_max));
        for axis in 0..3 {
            let [low, high] = [self.reciprocals[0][axis], self.reciprocals[1][axis]];
            let near = L::load(&node.planes[self.near_plane[axis]]).sub(self.near_origin[axis]);
            let far = L::load(&node.planes[self.near_plane[axis] ^ 1]).sub(self.far_origin[axis]);
            enter = enter.max(near.mul(low).min(near.mul(high)).sub(self.pad[axis]));
            leave = leave.min(far.mul(low).max(far.mul(high)).add(self.pad[axis]));
        }
        L::bits(enter.le(leave))
    }
}

/// A place that waits, the rays that enter it as bits, and where they do.
struct Entry {
    reference: ChildRef,
    rays: u32,
    enter: OfRays,
}

/// The memory of packets, one after the other.
pub(super) struct Packets<const N: usize, P> {
    members: Vec<Member<P>>,
    waiting: Vec<Entry>,
    memory: StackMemory<N>,
}

impl<const N: usize, P> Packets<N, P> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self {
            members: Vec::new(),
            waiting: Vec::new(),
            memory: StackMemory::new(),
        }
    }

    /// Traces a ray.
    #[inline(always)]
    pub(super) fn trace_one<const ANY: bool, const W: usize, B, A, L, T>(
        &mut self,
        tree: &Tree<N, W, B>,
        ray: &RaySetup,
    ) -> Option<Candidate>
    where
        B: Block,
        A: TriangleTest<B, Ray<T> = P>,
        L: PushChildren<N>,
        T: Lanes<4>,
    {
        let boxes = BoxRay::new::<T>(ray, A::margin(ray));
        let mut best = Best::none(ray.t_max);
        let mut stack = Stack::new(&mut self.memory);
        stack.push_if(1, ChildRef::inner(0).0, ray.t_min);
        follow::<ANY, N, W, B, A, L, T, ()>(
            tree,
            ray,
            &boxes,
            &A::prepare::<T>(ray),
            &mut stack,
            &mut best,
            &mut (),
        );
        best.candidate()
    }

    /// Traces rays of one octant, at most [`PACKET_SIZE`], the first of which has the place `first`; tells of those that
    /// hit something. With `ANY` the hit is any.
    #[inline(always)]
    pub(super) fn trace<const ANY: bool, const W: usize, B, A, L, T, R>(
        &mut self,
        tree: &Tree<N, W, B>,
        rays: &[Ray],
        scale: f32,
        first: usize,
        tell: &mut impl FnMut(usize, &Candidate, &RaySetup),
    ) where
        B: Block,
        A: TriangleTest<B, Ray<T> = P>,
        L: PushChildren<N>,
        T: Lanes<4>,
        R: Lanes<PACKET_SIZE>,
    {
        let mut lanes = PacketRays::NONE;
        self.members.clear();
        for (place, ray) in rays.iter().enumerate() {
            let Some(ray) = RaySetup::in_lanes::<T>(ray, scale) else {
                continue;
            };
            let lane = self.members.len();
            let margin = A::margin(&ray);
            let boxes = BoxRay::new::<T>(&ray, margin);
            for (axis, margin) in margin.into_iter().enumerate() {
                lanes.origin[axis][lane] = ray.origin[axis];
                lanes.direction[axis][lane] = ray.direction[axis];
                lanes.reciprocal[axis][lane] = ray.reciprocal[axis];
                lanes.triangle_pad[axis][lane] = margin * TRIANGLE_PAD;
                lanes.near_addend[axis][lane] = boxes.near_addend[axis];
                lanes.far_addend[axis][lane] = boxes.far_addend[axis];
            }
            (lanes.t_min[lane], lanes.t_max[lane]) = (ray.t_min, ray.t_max);
            self.members.push(Member {
                place: first + place,
                prepared: A::prepare::<T>(&ray),
                best: Best::none(ray.t_max),
                ray,
            });
        }
        let Some(one) = self.members.first() else {
            return;
        };
        let octant = one.ray.octant();
        let bundle = Bundle::<L>::new::<N, B, A, P>(&self.members);
        let mut t_max = largest(&lanes.t_max);
        self.waiting.clear();
        self.waiting.push(Entry {
            reference: ChildRef::inner(0),
            rays: (1 << self.members.len()) - 1,
            enter: lanes.t_min,
        });
        while let Some(Entry {
            reference,
            rays,
            enter,
        }) = self.waiting.pop()
        {
            let mut rays = rays & R::bits(R::load(&enter).le(R::load(&lanes.t_max)));
            let together = rays.count_ones() > TOO_FEW;
            if together && !reference.is_leaf() {
                let node = &tree.nodes[reference.0 as usize];
                let boxes = bundle.test(node, t_max);
                let order = order_of::<ANY, N, W>(node, octant);
                for k in 0..N as u32 {
                    let slot = (order >> (k * N.trailing_zeros())) as usize & (N - 1);
                    if boxes >> slot & 1 == 0 {
                        continue;
                    }
                    let (enter, bits) = lanes.test::<N, W, R>(node, slot, bundle.near_plane);
                    if bits & rays != 0 {
                        self.waiting.push(Entry {
                            reference: ChildRef(node.children[slot]),
                            rays: bits & rays,
                            enter: enter.store(),
                        });
                    }
                }
                continue;
            }
            if together && self.test_together::<ANY, W, B, A, T, R>(tree, reference, &mut lanes) {
                t_max = largest(&lanes.t_max);
                continue;
            }
            while rays != 0 {
                let lane = rays.trailing_zeros() as usize & (PACKET_SIZE - 1);
                rays &= rays - 1;
                let Some(member) = self.members.get_mut(lane) else {
                    break;
                };
                let Member {
                    ray,
                    prepared,
                    best,
                    ..
                } = member;
                if reference.is_leaf() {
                    for block in &tree.blocks[reference.blocks()] {
                        let hits = A::test::<T>(ray, prepared, block, &tree.points, best.t);
                        if hits.mask != 0 {
                            best.keep_first(&hits, block.ids());
                        }
                    }
                } else {
                    let boxes = BoxRay::new::<T>(ray, A::margin(ray));
                    let mut stack = Stack::new(&mut self.memory);
                    stack.push_if(1, reference.0, enter[lane]);
                    follow::<ANY, N, W, B, A, L, T, ()>(
                        tree,
                        ray,
                        &boxes,
                        prepared,
                        &mut stack,
                        best,
                        &mut (),
                    );
                }
                lanes.t_max[lane] = best.limit::<ANY>();
            }
            t_max = largest(&lanes.t_max);
        }
        for Member {
            place, ray, best, ..
        } in &self.members
        {
            if let Some(hit) = best.candidate() {
                tell(*place, &hit, ray);
            }
        }
    }

    /// Tests all rays with the triangles of a leaf, if the test can.
    #[inline(always)]
    fn test_together<const ANY: bool, const W: usize, B, A, T, R>(
        &mut self,
        tree: &Tree<N, W, B>,
        leaf: ChildRef,
        lanes: &mut PacketRays,
    ) -> bool
    where
        B: Block,
        A: TriangleTest<B, Ray<T> = P>,
        T: Lanes<4>,
        R: Lanes<PACKET_SIZE>,
    {
        for block in &tree.blocks[leaf.blocks()] {
            let members = &mut self.members;
            let hits = A::test_packet::<T, R>(lanes, block, &tree.points, |lane, hit| {
                if let Some(member) = members.get_mut(lane) {
                    member.best.keep_if_first(hit);
                }
            });
            let Some(mut hits) = hits else {
                return false;
            };
            while hits != 0 {
                let lane = hits.trailing_zeros() as usize & (PACKET_SIZE - 1);
                hits &= hits - 1;
                if let Some(member) = self.members.get(lane) {
                    lanes.t_max[lane] = member.best.limit::<ANY>();
                }
            }
        }
        true
    }
}

#[inline(always)]
fn largest(of_rays: &OfRays) -> f32 {
    let mut largest = f32::NEG_INFINITY;
    for &value in of_rays {
        largest = if value > largest { value } else { largest };
    }
    largest
}
