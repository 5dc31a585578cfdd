//! Traversal of a tree by one ray, generic over node width, triangle test and lanes.
//!
//! Boxes are tested by slabs (Kay, Kajiya, *Ray Tracing Complex Scenes*, 1986) with one
//! multiplication and addition per plane; rounding is paid for by one pad per ray and axis, added
//! once (see `triangle` for the bound). Children are pushed from the farthest to the nearest by
//! the order stored for the ray's octant.
//!
//! Invariants: no node is passed by whose triangles the slow twin would hit at or before the best
//! distance (so a popped entry is dropped only if it starts strictly behind it); equal distances
//! are decided by the lowest id. Together they make the hit a function of ray and triangles alone.
//!
//! No operation on lanes stands in a closure, here and in the triangle tests: unlike a function that
//! is always inlined, a closure may be compiled by itself, without the instruction set of the
//! kernel, and then each operation becomes a call (seen: 7 times slower).

use std::hint::black_box;

use glam::Vec3;

use super::triangle::{BlockHits, NODE_PAD, TriangleTest};
use crate::{
    layout::{
        block::Block,
        node::{ChildRef, Node},
        tree::Tree,
    },
    ray::{Ray, Work},
    simd::{
        Lanes, PushChildren, splat_all,
        stack::{Stack, StackMemory},
    },
};

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
        let direction = ray.direction * lift * direction_scale;
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
            octant: (0..3)
                .map(|axis| usize::from(reciprocal[axis] < 0.0) << axis)
                .sum(),
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

/// A hit in the scaled space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Candidate {
    pub(crate) t: f32,
    pub(crate) u: f32,
    pub(crate) v: f32,
    pub(crate) id: u32,
}

/// What else is to be done on the way: nothing, which costs nothing, counting work, or asking about
/// hits.
pub(crate) trait Watch {
    /// Whether it is to be asked about hits at all.
    const ASKS: bool = false;

    /// A node is visited.
    #[inline(always)]
    fn node(&mut self) {}

    /// A block is tested.
    #[inline(always)]
    fn block(&mut self) {}

    /// Whether a hit counts as one. A function of the hit: it may be asked of hits that are not the
    /// closest, in no certain order.
    #[inline(always)]
    fn accepts(&mut self, _: &Candidate) -> bool {
        true
    }
}

impl Watch for () {}

impl Watch for Work {
    #[inline(always)]
    fn node(&mut self) {
        self.nodes += 1;
    }

    #[inline(always)]
    fn block(&mut self) {
        self.blocks += 1;
    }
}

/// Asks a function of the caller's. It is `dyn`, so that there is one kernel for all callers: what
/// it asks costs more than the call.
pub(crate) struct Filter<'a>(pub(crate) &'a mut dyn FnMut(&Candidate) -> bool);

impl Watch for Filter<'_> {
    const ASKS: bool = true;

    #[inline(always)]
    fn accepts(&mut self, candidate: &Candidate) -> bool {
        (self.0)(candidate)
    }
}

/// What the box test needs of a ray.
pub(super) struct BoxRay {
    reciprocal: [f32; 3],
    near_addend: [f32; 3],
    far_addend: [f32; 3],
    t_min: f32,
    near_plane: [usize; 3],
}

impl BoxRay {
    #[inline(always)]
    pub(super) fn new(ray: &RaySetup, margin: [f32; 3]) -> Self {
        let (mut near_addend, mut far_addend, mut near_plane) = ([0.0; 3], [0.0; 3], [0; 3]);
        for axis in 0..3 {
            [near_addend[axis], far_addend[axis]] = ray.addends(margin, axis);
            near_plane[axis] = 2 * axis + (ray.octant >> axis & 1);
        }
        Self {
            reciprocal: ray.reciprocal,
            near_addend,
            far_addend,
            t_min: ray.t_min,
            near_plane,
        }
    }
}

/// A ray in lanes of children.
pub(super) struct BoxLanes<L> {
    reciprocal: [L; 3],
    near_addend: [L; 3],
    far_addend: [L; 3],
    near_plane: [usize; 3],
    t_min: L,
}

impl<L> BoxLanes<L> {
    #[inline(always)]
    pub(super) fn new<const N: usize>(ray: &BoxRay) -> Self
    where
        L: Lanes<N>,
    {
        Self {
            reciprocal: splat_all(ray.reciprocal),
            near_addend: splat_all(ray.near_addend),
            far_addend: splat_all(ray.far_addend),
            near_plane: ray.near_plane,
            t_min: L::splat(ray.t_min),
        }
    }

    #[inline(always)]
    fn near<const N: usize, const W: usize>(&self, node: &Node<N, W>, axis: usize) -> L
    where
        L: Lanes<N>,
    {
        L::load(&node.planes[self.near_plane[axis]])
            .mul_add(self.reciprocal[axis], self.near_addend[axis])
    }

    #[inline(always)]
    fn far<const N: usize, const W: usize>(&self, node: &Node<N, W>, axis: usize) -> L
    where
        L: Lanes<N>,
    {
        L::load(&node.planes[self.near_plane[axis] ^ 1])
            .mul_add(self.reciprocal[axis], self.far_addend[axis])
    }

    /// Distances at which the boxes of a node are entered, and one bit per box that is.
    #[inline(always)]
    pub(super) fn test<const N: usize, const W: usize>(
        &self,
        node: &Node<N, W>,
        t_max: f32,
    ) -> (L, u32)
    where
        L: Lanes<N>,
    {
        let enter = self.near(node, 0).max(self.near(node, 1));
        let enter = enter.max(self.near(node, 2).max(self.t_min));
        let leave = self.far(node, 0).min(self.far(node, 1));
        let leave = leave.min(self.far(node, 2).min(L::splat(t_max)));
        (enter, L::bits(enter.le(leave)))
    }
}

/// Takes from the stack, and follows down, until a leaf is reached; the first child in order goes before the others,
/// which wait on the stack. `None` when nothing is left.
///
/// A node of which one child is entered (two of three are) is left without touching the stack:
/// the way through memory is the longest part of a step.
///
/// The lanes of the ray are made anew after each leaf, from what the compiler takes for something new: it would
/// otherwise keep them in memory, since the triangle test needs the registers, and load all of them at every node.
#[inline(always)]
fn next_leaf<const ANY: bool, const N: usize, const W: usize, B, L: PushChildren<N>, O: Watch>(
    tree: &Tree<N, W, B>,
    ray: &BoxRay,
    octant: usize,
    t_max: f32,
    stack: &mut Stack<'_, N>,
    watch: &mut O,
) -> Option<ChildRef> {
    let boxes = BoxLanes::<L>::new(black_box(ray));
    while let Some((reference, distance)) = stack.pop() {
        if !ANY && distance > t_max {
            continue;
        }
        let mut reference = ChildRef(reference);
        loop {
            if reference.is_leaf() {
                return Some(reference);
            }
            watch.node();
            let node = &tree.nodes[reference.0 as usize];
            let (enter, mask) = boxes.test(node, t_max);
            reference = if mask & mask.wrapping_sub(1) != 0 {
                let order = order_of::<ANY, N, W>(node, octant);
                let nearest = enter.push_children(mask, &node.children, order, stack);
                stack.drop_top();
                ChildRef(nearest)
            } else if mask != 0 {
                ChildRef(node.children[mask.trailing_zeros() as usize & (N - 1)])
            } else {
                break;
            };
        }
    }
    None
}

/// What `tell` makes of the closest hit, equal distances decided by the lowest id.
#[inline(always)]
pub(crate) fn closest<
    const N: usize,
    const W: usize,
    B: Block,
    A: TriangleTest<B>,
    L: PushChildren<N>,
    T: Lanes<4>,
    O: Watch,
    H,
>(
    tree: &Tree<N, W, B>,
    ray: impl Asked,
    watch: &mut O,
    tell: impl FnOnce(&Candidate, &RaySetup) -> H,
) -> Option<H> {
    let ray = &ray.setup()?;
    let boxes = BoxRay::new(ray, A::margin(ray));
    let prepared = A::prepare::<T>(ray);
    let mut best = Best::none(ray.t_max);
    let mut memory = StackMemory::new();
    let mut stack = Stack::<N>::new(&mut memory);
    stack.push_if(
        u32::from(!tree.nodes.is_empty()),
        ChildRef::inner(0).0,
        ray.t_min,
    );
    // The loop of `follow` with all that changes in places of its own.
    while let Some(leaf) =
        next_leaf::<false, N, W, B, L, O>(tree, &boxes, ray.octant, best.t, &mut stack, watch)
    {
        for block in &tree.blocks[leaf.blocks()] {
            watch.block();
            let hits = A::test(ray, &prepared, block, &tree.points, best.t);
            if hits.mask != 0 {
                best.keep_first_accepted(&hits, block.ids(), watch);
            }
        }
    }
    best.candidate().map(|hit| tell(&hit, ray))
}

/// In which order children are pushed: the nearest last; by area where any hit will do, which finds one sooner.
#[inline(always)]
pub(super) fn order_of<const ANY: bool, const N: usize, const W: usize>(
    node: &Node<N, W>,
    octant: usize,
) -> u64 {
    if ANY {
        Node::<N, W>::SLOT_ORDER
    } else {
        node.order(octant)
    }
}

/// Visits what waits on the stack and keeps the closest hit; with `ANY` no more after the first.
#[inline(always)]
pub(super) fn follow<
    const ANY: bool,
    const N: usize,
    const W: usize,
    B: Block,
    A: TriangleTest<B>,
    L: PushChildren<N>,
    T: Lanes<4>,
    O: Watch,
>(
    tree: &Tree<N, W, B>,
    ray: &RaySetup,
    boxes: &BoxRay,
    prepared: &A::Ray<T>,
    stack: &mut Stack<'_, N>,
    best: &mut Best,
    watch: &mut O,
) {
    while let Some(leaf) =
        next_leaf::<ANY, N, W, B, L, O>(tree, boxes, ray.octant, best.t, stack, watch)
    {
        for block in &tree.blocks[leaf.blocks()] {
            watch.block();
            let hits = A::test(ray, prepared, block, &tree.points, best.t);
            if hits.mask != 0 {
                best.keep_first_accepted(&hits, block.ids(), watch);
                if ANY && best.is_hit() {
                    return;
                }
            }
        }
    }
}

/// The first hit so far; its weights are still to be divided by `den`.
pub(super) struct Best {
    pub(super) t: f32,
    u: f32,
    v: f32,
    den: f32,
    id: u32,
}

impl Best {
    /// No hit up to a distance.
    #[inline(always)]
    pub(super) fn none(t_max: f32) -> Self {
        Self {
            t: t_max,
            u: 0.0,
            v: 0.0,
            den: 1.0,
            id: u32::MAX,
        }
    }

    #[inline(always)]
    pub(super) fn is_hit(&self) -> bool {
        self.id != u32::MAX
    }

    /// The hit, which is none afterwards.
    #[inline(always)]
    pub(super) fn take(&mut self) -> Option<Candidate> {
        let hit = self.candidate();
        self.id = u32::MAX;
        hit
    }

    #[inline(always)]
    pub(super) fn candidate(&self) -> Option<Candidate> {
        self.is_hit().then(|| self.weighed())
    }

    /// With weights divided.
    #[inline(always)]
    fn weighed(&self) -> Candidate {
        Candidate {
            u: self.u / self.den,
            v: self.v / self.den,
            t: self.t,
            id: self.id,
        }
    }

    /// Takes over the lanes that precede it.
    #[inline(always)]
    pub(super) fn keep_first<T: Lanes<4>>(&mut self, hits: &BlockHits<T>, ids: &[u32; 4]) {
        self.keep_first_accepted(hits, ids, &mut ());
    }

    /// Takes over the lanes that precede it and are accepted.
    #[inline(always)]
    fn keep_first_accepted<T: Lanes<4>, O: Watch>(
        &mut self,
        hits: &BlockHits<T>,
        ids: &[u32; 4],
        watch: &mut O,
    ) {
        let (t, u, v, den) = (
            hits.t.store(),
            hits.u.store(),
            hits.v.store(),
            hits.den.store(),
        );
        let mut lanes = hits.mask;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize & 3;
            lanes &= lanes - 1;
            if precedes((t[lane], ids[lane]), (self.t, self.id)) {
                let first = Self {
                    t: t[lane],
                    u: u[lane],
                    v: v[lane],
                    den: den[lane],
                    id: ids[lane],
                };
                if !O::ASKS || watch.accepts(&first.weighed()) {
                    *self = first;
                }
            }
        }
    }
}

/// Whether a hit, given by distance and number, comes before another: nearer, or as near with a
/// lower number.
#[inline(always)]
pub(crate) fn precedes((t, id): (f32, u32), (other_t, other_id): (f32, u32)) -> bool {
    t < other_t || (t == other_t && id < other_id)
}

/// Whether anything is hit.
#[inline(always)]
pub(crate) fn any<
    const N: usize,
    const W: usize,
    B: Block,
    A: TriangleTest<B>,
    L: PushChildren<N>,
    T: Lanes<4>,
    O: Watch,
>(
    tree: &Tree<N, W, B>,
    ray: impl Asked,
    watch: &mut O,
) -> bool {
    let Some(ray) = &ray.setup() else {
        return false;
    };
    let boxes = BoxRay::new(ray, A::margin(ray));
    let prepared = A::prepare::<T>(ray);
    let mut memory = StackMemory::new();
    let mut stack = Stack::<N>::new(&mut memory);
    stack.push_if(
        u32::from(!tree.nodes.is_empty()),
        ChildRef::inner(0).0,
        ray.t_min,
    );
    while let Some(leaf) =
        next_leaf::<true, N, W, B, L, O>(tree, &boxes, ray.octant, ray.t_max, &mut stack, watch)
    {
        for block in &tree.blocks[leaf.blocks()] {
            watch.block();
            let hits = A::test(ray, &prepared, block, &tree.points, ray.t_max);
            if hits.mask == 0 {
                continue;
            }
            if !O::ASKS {
                return true;
            }
            let mut first = Best::none(f32::INFINITY);
            first.keep_first_accepted(&hits, block.ids(), watch);
            if first.candidate().is_some() {
                return true;
            }
        }
    }
    false
}

/// Tells every hit, in no certain order. A primitive that was cut is told once per part.
#[inline(always)]
pub(crate) fn all<
    const N: usize,
    const W: usize,
    B: Block,
    A: TriangleTest<B>,
    L: PushChildren<N>,
    T: Lanes<4>,
>(
    tree: &Tree<N, W, B>,
    ray: &RaySetup,
    mut visit: impl FnMut(Candidate),
) {
    let boxes = BoxRay::new(ray, A::margin(ray));
    let prepared = A::prepare::<T>(ray);
    let mut memory = StackMemory::new();
    let mut stack = Stack::<N>::new(&mut memory);
    stack.push_if(
        u32::from(!tree.nodes.is_empty()),
        ChildRef::inner(0).0,
        ray.t_min,
    );
    while let Some(leaf) =
        next_leaf::<true, N, W, B, L, ()>(tree, &boxes, ray.octant, ray.t_max, &mut stack, &mut ())
    {
        for block in &tree.blocks[leaf.blocks()] {
            let hits = A::test(ray, &prepared, block, &tree.points, ray.t_max);
            let mut lanes = hits.mask;
            if lanes == 0 {
                continue;
            }
            let (t, u, v, den) = (
                hits.t.store(),
                hits.u.store(),
                hits.v.store(),
                hits.den.store(),
            );
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize & 3;
                lanes &= lanes - 1;
                visit(Candidate {
                    t: t[lane],
                    u: u[lane] / den[lane],
                    v: v[lane] / den[lane],
                    id: block.ids()[lane],
                });
            }
        }
    }
}

/// Visits the primitives that a ray meets, about from the nearest to the farthest. `meet` tells up
/// to which distance others are still of interest; those behind it are passed by.
///
/// `meet` is `dyn`: what it does, the way through another tree, costs far more than the call.
#[inline(always)]
pub(crate) fn visit<
    const N: usize,
    const W: usize,
    B: Block,
    A: TriangleTest<B>,
    L: PushChildren<N>,
    T: Lanes<4>,
>(
    tree: &Tree<N, W, B>,
    ray: &RaySetup,
    meet: &mut dyn FnMut(&Candidate) -> f32,
) {
    let boxes = BoxRay::new(ray, A::margin(ray));
    let prepared = A::prepare::<T>(ray);
    let mut t_max = ray.t_max;
    let mut memory = StackMemory::new();
    let mut stack = Stack::<N>::new(&mut memory);
    stack.push_if(
        u32::from(!tree.nodes.is_empty()),
        ChildRef::inner(0).0,
        ray.t_min,
    );
    while let Some(leaf) =
        next_leaf::<false, N, W, B, L, ()>(tree, &boxes, ray.octant, t_max, &mut stack, &mut ())
    {
        for block in &tree.blocks[leaf.blocks()] {
            let hits = A::test(ray, &prepared, block, &tree.points, t_max);
            let mut lanes = hits.mask;
            if lanes == 0 {
                continue;
            }
            let (t, u, v, den) = (
                hits.t.store(),
                hits.u.store(),
                hits.v.store(),
                hits.den.store(),
            );
            while lanes != 0 {
                let mut lane = lanes.trailing_zeros() as usize & 3;
                for other in lane + 1..4 {
                    if lanes >> other & 1 != 0 && t[other] < t[lane] {
                        lane = other;
                    }
                }
                lanes &= !(1 << lane);
                if t[lane] > t_max {
                    break;
                }
                t_max = meet(&Candidate {
                    t: t[lane],
                    u: u[lane] / den[lane],
                    v: v[lane] / den[lane],
                    id: block.ids()[lane],
                });
            }
        }
    }
}
