//! Traversal by a batch of rays: those that go side by side in packets (`packet`), the others by several in turns: while
//! one waits for a node or a block that it asked for, the others work. After the streams of Embree and of Barringer,
//! Akenine-Möller, *Dynamic Ray Stream Traversal*, 2014, but without any sorting: the rays share nothing.
//!
//! Invariants: each ray visits what it would visit alone, but for the child that a single ray goes
//! down to at once and that lies on the stack here; whether and where it hits is a function of ray
//! and triangles alone (see `kernel`), so that answers are those of one ray at a time to the last
//! bit, however many are in flight and in whatever order they come.

use super::{
    kernel::{Best, Candidate, order_of},
    node_test::{BoxLanes, BoxRay},
    packet::{PACKET_SIZE, Packets, go_side_by_side},
    setup::RaySetup,
    triangle::TriangleTest,
};
use crate::{
    layout::{block::Block, node::ChildRef, tree::Tree},
    ray::Ray,
    simd::{
        Lanes, PushChildren, prefetch_all,
        stack::{Stack, StackMemory},
    },
};

/// Most rays in flight: more than a core can have in its queues of misses.
pub(crate) const MAX_IN_FLIGHT: usize = 32;

/// How the rays of a batch are traced.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Together {
    /// How many are in flight, 1 to [`MAX_IN_FLIGHT`].
    pub(crate) in_flight: usize,
    /// Whether those that go side by side are traced as packets.
    pub(crate) in_packets: bool,
}

/// The rays of a batch that have not begun.
pub(crate) struct Waiting<'a> {
    rays: &'a [Ray],
    scale: f32,
    next: usize,
}

/// What begins next.
enum Next<'a> {
    /// Rays that go side by side, the first of which has this place in the batch.
    Packet(usize, &'a [Ray]),
    Alone(usize, RaySetup),
}

impl<'a> Waiting<'a> {
    /// Rays for a tree whose coordinates are those of the caller times `scale`.
    pub(crate) fn new(rays: &'a [Ray], scale: f32) -> Self {
        Self {
            rays,
            scale,
            next: 0,
        }
    }

    /// The next ray that can hit anything, or the next rays if they go side by side.
    #[inline(always)]
    fn next<T: Lanes<4>>(&mut self, in_packets: bool) -> Option<Next<'a>> {
        while let Some(ray) = self.rays.get(self.next) {
            let place = self.next;
            if in_packets
                && place.is_multiple_of(PACKET_SIZE)
                && let Some(rays) = self.rays.get(place..place + PACKET_SIZE)
                && go_side_by_side(rays)
            {
                self.next += PACKET_SIZE;
                return Some(Next::Packet(place, rays));
            }
            self.next += 1;
            if let Some(setup) = RaySetup::in_lanes::<T>(ray, self.scale) {
                return Some(Next::Alone(place, setup));
            }
        }
        None
    }
}

/// A ray on its way.
struct Traveller<const N: usize, L, P> {
    /// Its place in the batch.
    place: usize,
    ray: RaySetup,
    boxes: BoxLanes<L>,
    prepared: P,
    best: Best,
    waiting: StackMemory<N>,
}

impl<const N: usize, L: PushChildren<N>, P> Traveller<N, L, P> {
    #[inline(always)]
    fn new<B, A, T>(place: usize, ray: RaySetup) -> Self
    where
        A: TriangleTest<B, Ray<T> = P>,
        T: Lanes<4>,
    {
        let mut waiting = StackMemory::new();
        start(&mut waiting, ray.t_min);
        Self {
            place,
            boxes: BoxLanes::new(&BoxRay::new::<T>(&ray, A::margin(&ray))),
            prepared: A::prepare::<T>(&ray),
            best: Best::none(ray.t_max),
            waiting,
            ray,
        }
    }

    /// Begins with another ray.
    #[inline(always)]
    fn begin<B, A, T>(&mut self, place: usize, ray: RaySetup)
    where
        A: TriangleTest<B, Ray<T> = P>,
        T: Lanes<4>,
    {
        self.place = place;
        self.boxes = BoxLanes::new(&BoxRay::new::<T>(&ray, A::margin(&ray)));
        self.prepared = A::prepare::<T>(&ray);
        self.best = Best::none(ray.t_max);
        start(&mut self.waiting, ray.t_min);
        self.ray = ray;
    }

    /// Visits the nearest place of the stack. False when nothing is left to be found.
    #[inline(always)]
    fn step<const ANY: bool, const W: usize, B, A, T>(&mut self, tree: &Tree<N, W, B>) -> bool
    where
        B: Block,
        A: TriangleTest<B, Ray<T> = P>,
        T: Lanes<4>,
    {
        let mut stack = Stack::resume(&mut self.waiting);
        let reference = loop {
            let Some((reference, distance)) = stack.pop() else {
                return false;
            };
            if distance <= self.best.t {
                break ChildRef(reference);
            }
        };
        if reference.is_leaf() {
            for block in &tree.blocks[reference.blocks()] {
                let hits =
                    A::test::<T>(&self.ray, &self.prepared, block, &tree.points, self.best.t);
                if hits.mask != 0 {
                    self.best.keep_first(&hits, block.ids());
                    if ANY {
                        return false;
                    }
                }
            }
        } else {
            let node = &tree.nodes[reference.0 as usize];
            let (enter, entered) = self.boxes.test(node, self.best.t);
            if L::bits(entered) != 0 {
                let order = order_of::<ANY, N, W>(node, self.ray.octant());
                enter.push_children(entered, &node.children, order, &mut stack);
            }
        }
        if let Some(next) = stack.peek() {
            ask_for(tree, ChildRef(next));
        }
        stack.leave();
        true
    }
}

/// Leaves the root to be visited.
#[inline(always)]
fn start<const N: usize>(memory: &mut StackMemory<N>, t_min: f32) {
    let mut stack = Stack::new(memory);
    stack.push_if(1, ChildRef::inner(0).0, t_min);
    stack.leave();
}

/// Asks for what is behind a reference.
#[inline(always)]
fn ask_for<const N: usize, const W: usize, B>(tree: &Tree<N, W, B>, reference: ChildRef) {
    if reference.is_leaf() {
        if let Some(block) = tree.blocks.get(reference.blocks().start) {
            prefetch_all(block);
        }
    } else if let Some(node) = tree.nodes.get(reference.0 as usize) {
        prefetch_all(node);
    }
}

/// Traces all rays of a batch and tells of each that hits something, with its place in the batch, in no certain order.
/// With `ANY` the hit is any.
#[inline(always)]
pub(crate) fn trace<
    const ANY: bool,
    const N: usize,
    const W: usize,
    B: Block,
    A: TriangleTest<B>,
    L: PushChildren<N>,
    T: Lanes<4>,
    R: Lanes<PACKET_SIZE>,
>(
    tree: &Tree<N, W, B>,
    mut waiting: Waiting<'_>,
    Together {
        in_flight,
        in_packets,
    }: Together,
    mut tell: impl FnMut(usize, &Candidate, &RaySetup),
) {
    if tree.nodes.is_empty() {
        return;
    }
    let scale = waiting.scale;
    let mut packets = Packets::<N, A::Ray<T>>::new();
    let mut travellers: Vec<Traveller<N, L, A::Ray<T>>> = Vec::new();
    let (mut places, mut turn) = (in_flight, 0);
    loop {
        if turn == places {
            turn = 0;
        }
        if let Some(traveller) = travellers.get_mut(turn) {
            if traveller.step::<ANY, W, B, A, T>(tree) {
                turn += 1;
                continue;
            }
            if let Some(hit) = traveller.best.take() {
                tell(traveller.place, &hit, &traveller.ray);
            }
        }
        // The place in turn is free.
        match waiting.next::<T>(in_packets) {
            Some(Next::Packet(first, rays)) => {
                packets.trace::<ANY, W, B, A, L, T, R>(tree, rays, scale, first, &mut tell)
            }
            Some(Next::Alone(place, ray)) if in_flight == 1 => {
                if let Some(hit) = packets.trace_one::<ANY, W, B, A, L, T>(tree, &ray) {
                    tell(place, &hit, &ray);
                }
            }
            Some(Next::Alone(place, ray)) => {
                match travellers.get_mut(turn) {
                    Some(traveller) => traveller.begin::<B, A, T>(place, ray),
                    None => travellers.push(Traveller::new::<B, A, T>(place, ray)),
                }
                turn += 1;
            }
            None if turn < travellers.len() => {
                travellers.swap_remove(turn);
                places = travellers.len();
            }
            None => {
                places = travellers.len();
                turn = 0;
                if places == 0 {
                    return;
                }
            }
        }
    }
}
