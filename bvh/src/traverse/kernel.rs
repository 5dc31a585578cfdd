//! Traversal of a tree by one ray, generic over node width, triangle test and lanes.
//!
//! Children are pushed from the farthest to the nearest by the order stored for the ray's octant.
//!
//! Invariants: no node is passed by whose triangles the slow twin would hit at or before the best
//! distance (so a popped entry is dropped only if it starts strictly behind it); equal distances
//! are decided by the lowest id. Together they make the hit a function of ray and triangles alone.
//!
//! No operation on lanes stands in a closure, here and in the triangle tests: unlike a function that
//! is always inlined, a closure may be compiled by itself, without the instruction set of the
//! kernel, and then each operation becomes a call (seen: 7 times slower).

use std::hint::black_box;

use super::{
    node_test::{BoxLanes, BoxRay},
    setup::{Asked, RaySetup},
    triangle::{BlockHits, TriangleTest},
};
use crate::{
    layout::{
        block::Block,
        node::{ChildRef, Node},
        tree::Tree,
    },
    ray::Work,
    simd::{
        Lanes, PushChildren,
        stack::{Stack, StackMemory},
    },
};

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
    t_max: f32,
    stack: &mut Stack<'_, N, ANY>,
    watch: &mut O,
) -> Option<ChildRef> {
    let boxes = BoxLanes::<L>::new(black_box(ray));
    while let Some((reference, distance)) = stack.pop() {
        if distance > t_max {
            continue;
        }
        let mut reference = ChildRef(reference);
        loop {
            if reference.is_leaf() {
                return Some(reference);
            }
            watch.node();
            let node = &tree.nodes[reference.0 as usize];
            let (enter, entered) = boxes.test(node, t_max);
            let mask = L::bits(entered);
            reference = if mask & mask.wrapping_sub(1) != 0 {
                let order = order_of::<ANY, N, W>(node, ray.octant);
                let nearest = enter.push_children(entered, &node.children, order, stack);
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
    let ray = &ray.setup::<T>()?;
    let boxes = BoxRay::new::<T>(ray, A::margin(ray));
    let prepared = A::prepare::<T>(ray);
    let mut best = Best::none(ray.t_max);
    let mut memory = StackMemory::new();
    let mut stack = Stack::new(&mut memory);
    stack.push_if(
        u32::from(!tree.nodes.is_empty()),
        ChildRef::inner(0).0,
        ray.t_min,
    );
    // The loop of `follow` with all that changes in places of its own.
    while let Some(leaf) =
        next_leaf::<false, N, W, B, L, O>(tree, &boxes, best.t, &mut stack, watch)
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
    stack: &mut Stack<'_, N, ANY>,
    best: &mut Best,
    watch: &mut O,
) {
    while let Some(leaf) = next_leaf::<ANY, N, W, B, L, O>(tree, boxes, best.t, stack, watch) {
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

    /// Up to which distance hits are still of interest; with `ANY` none are after the first.
    #[inline(always)]
    pub(super) fn limit<const ANY: bool>(&self) -> f32 {
        if ANY && self.is_hit() {
            f32::NEG_INFINITY
        } else {
            self.t
        }
    }

    /// Takes over a hit that precedes it.
    #[inline(always)]
    pub(super) fn keep_if_first(&mut self, Candidate { t, u, v, id }: Candidate) {
        if precedes((t, id), (self.t, self.id)) {
            let den = 1.0;
            *self = Self { t, u, v, den, id };
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
    let Some(ray) = &ray.setup::<T>() else {
        return false;
    };
    let boxes = BoxRay::new::<T>(ray, A::margin(ray));
    let prepared = A::prepare::<T>(ray);
    let mut memory = StackMemory::new();
    let mut stack = Stack::new(&mut memory);
    stack.push_if(
        u32::from(!tree.nodes.is_empty()),
        ChildRef::inner(0).0,
        ray.t_min,
    );
    while let Some(leaf) =
        next_leaf::<true, N, W, B, L, O>(tree, &boxes, ray.t_max, &mut stack, watch)
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
    let boxes = BoxRay::new::<T>(ray, A::margin(ray));
    let prepared = A::prepare::<T>(ray);
    let mut memory = StackMemory::new();
    let mut stack = Stack::new(&mut memory);
    stack.push_if(
        u32::from(!tree.nodes.is_empty()),
        ChildRef::inner(0).0,
        ray.t_min,
    );
    while let Some(leaf) =
        next_leaf::<true, N, W, B, L, ()>(tree, &boxes, ray.t_max, &mut stack, &mut ())
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
    let boxes = BoxRay::new::<T>(ray, A::margin(ray));
    let prepared = A::prepare::<T>(ray);
    let mut t_max = ray.t_max;
    let mut memory = StackMemory::new();
    let mut stack = Stack::new(&mut memory);
    stack.push_if(
        u32::from(!tree.nodes.is_empty()),
        ChildRef::inner(0).0,
        ray.t_min,
    );
    while let Some(leaf) =
        next_leaf::<false, N, W, B, L, ()>(tree, &boxes, t_max, &mut stack, &mut ())
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
