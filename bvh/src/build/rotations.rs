//! Tree rotations: a node exchanges one of its children for a grandchild below another child, whose
//! box then shrinks. Kensler, *Tree Rotations for Improving Bounding Volume Hierarchies*, 2008; here
//! for nodes of any width, the first exchange by the rules by which Embree 4 rotates Morton trees of
//! four.
//!
//! A node is rotated when all below it is finished. An exchange changes the area of one box alone:
//! the node's own holds the same as before, and the two subtrees that change places keep theirs. So
//! the best exchange is the one that makes that box smallest against what it was.
//!
//! Invariants: expected visits of nodes never rise, but for the rounding of areas; leaves stay whole;
//! no leaf comes below `max_depth`; what is done depends on the subtree and its level alone, not on
//! threads. Gains little where Morton order is good already, as in a finely scanned surface.

use wide::f32x4;

use super::{
    primitive::Bounds,
    record::{Kind, Record},
    recursion::MAX_CHILDREN,
};

/// Embree finishes children of fewer references as subtrees of their own.
const CLOSED_SIZE: usize = 4096;

const LANES: usize = 4;

/// Where a node stands that is to be rotated.
pub(crate) struct Place<'a> {
    /// The records of the subtree, those of the node's children first.
    pub(crate) records: &'a mut [Record],
    /// Place of the first record among all.
    pub(crate) records_begin: usize,
    /// How many children the node has.
    pub(crate) children: usize,
    /// Levels that a subtree below the node may have.
    pub(crate) levels: u32,
}

/// An exchange of a child with a child of another child.
struct Exchange {
    /// What it adds to the area of the box of `opened`; less than 0.
    cost: f32,
    moved_down: usize,
    opened: usize,
    /// Which child of `opened` moves up.
    moved_up: usize,
}

/// Whether the first exchange below a node of `parent` references leaves the children of a child of
/// `n` alone: Embree does not open again what it finished as a subtree of its own.
pub(crate) fn is_closed(n: usize, parent: usize) -> bool {
    n < CLOSED_SIZE && parent >= CLOSED_SIZE
}

/// Does up to `exchanges` exchanges, each the best there is. The first spares children that
/// `is_closed`.
///
/// Not inlined, since its arrays would take room on the stack of the builder's recursion.
#[inline(never)]
pub(crate) fn rotate(mut place: Place<'_>, exchanges: u32, is_closed: impl Fn(usize) -> bool) {
    if let Some(exchange) = place.best(|child| !is_closed(child)) {
        place.make(&exchange);
    }
    for _ in 1..exchanges {
        let Some(exchange) = place.best(|_| true) else {
            break;
        };
        place.make(&exchange);
    }
}

impl Place<'_> {
    fn make(&mut self, exchange: &Exchange) {
        let opened = self.records[exchange.opened];
        let range = self.below(&opened);
        self.records
            .swap(exchange.moved_down, range.start + exchange.moved_up);
        self.records[exchange.opened] =
            Record::inner_around(opened.first as usize, &self.records[range]);
    }

    /// The exchange that makes a box smallest against what it was, the first of equal ones; none if
    /// no box becomes smaller. Only children that `may_open` allows change their children.
    ///
    /// No place is ever free for a subtree to move to without another in return: in a Morton tree, a
    /// node with fewer children than it may have has leaves alone.
    fn best(&self, may_open: impl Fn(usize) -> bool) -> Option<Exchange> {
        let children = &self.records[..self.children];
        let mut areas = [0.0; MAX_CHILDREN];
        for (area, child) in areas.iter_mut().zip(children) {
            *area = half_area(child);
        }
        let mut best: Option<Exchange> = None;
        for (opened, child) in children.iter().enumerate() {
            if child.kind == Kind::Leaf || !may_open(opened) {
                continue;
            }
            // A box that holds one as large as the opened child's is no smaller.
            let smaller = |other: usize| areas[other] < areas[opened];
            if !(0..children.len()).any(smaller) {
                continue;
            }
            let others = Others::of(&self.records[self.below(child)]);
            for (moved_down, moved) in children.iter().enumerate() {
                let fits = u32::from(moved.height) + 2 <= self.levels;
                if !smaller(moved_down) || !fits {
                    continue;
                }
                let limit = areas[opened];
                let Some((moved_up, area)) = others.smallest_with(moved, limit) else {
                    continue;
                };
                let cost = area - limit;
                if cost < best.as_ref().map_or(0.0, |best| best.cost) {
                    best = Some(Exchange {
                        cost,
                        moved_down,
                        opened,
                        moved_up,
                    });
                }
            }
        }
        best
    }

    /// The places of the children of a child.
    fn below(&self, child: &Record) -> std::ops::Range<usize> {
        let range = child.range();
        range.start - self.records_begin..range.end - self.records_begin
    }
}

/// Of a node with `len` children: for each child, the box of all others.
struct Others {
    /// Lower x, y, z, upper x, y, z of four boxes.
    boxes: [[f32x4; 6]; MAX_CHILDREN / LANES],
    len: usize,
}

impl Others {
    #[inline(always)]
    fn of(children: &[Record]) -> Self {
        // behind[i] is the box of the children from i on.
        let mut behind = [Bounds::EMPTY; MAX_CHILDREN + 1];
        for (i, child) in children.iter().enumerate().rev() {
            behind[i] = behind[i + 1];
            behind[i].extend(&bounds(child));
        }
        let mut boxes = [[[f32::INFINITY; LANES]; 6]; MAX_CHILDREN / LANES];
        let mut before = Bounds::EMPTY;
        for (i, child) in children.iter().enumerate() {
            let mut others = before;
            others.extend(&behind[i + 1]);
            before.extend(&bounds(child));
            let (lower, upper) = (others.lower().to_array(), others.upper().to_array());
            for axis in 0..3 {
                boxes[i / LANES][axis][i % LANES] = lower[axis];
                boxes[i / LANES][axis + 3][i % LANES] = upper[axis];
            }
        }
        Self {
            boxes: boxes.map(|group| group.map(f32x4::new)),
            len: children.len(),
        }
    }

    /// The child in whose place `record` makes the smallest box, and the half area of that box; the
    /// first of equal ones, and none if all have at least `limit`.
    #[inline(always)]
    fn smallest_with(&self, record: &Record, limit: f32) -> Option<(usize, f32)> {
        let mut smallest = limit;
        let mut place = None;
        let lower = record.lower.map(f32x4::splat);
        let upper = record.upper.map(f32x4::splat);
        for (group, boxes) in self.boxes[..self.len.div_ceil(LANES)].iter().enumerate() {
            let [x, y, z] = std::array::from_fn(|axis| {
                boxes[axis + 3].fast_max(upper[axis]) - boxes[axis].fast_min(lower[axis])
            });
            let areas = x * y + y * z + z * x;
            if areas.simd_lt(f32x4::splat(smallest)).none() {
                continue;
            }
            let children = self.len - group * LANES;
            for (lane, &area) in areas.to_array().iter().take(children).enumerate() {
                if area < smallest {
                    smallest = area;
                    place = Some(group * LANES + lane);
                }
            }
        }
        place.map(|place| (place, smallest))
    }
}

#[inline(always)]
fn bounds(record: &Record) -> Bounds {
    Bounds::of_aabb(&record.bounds())
}

/// Half the surface area, rounded as that of a box in [`Others::smallest_with`].
fn half_area(record: &Record) -> f32 {
    let [x, y, z] = std::array::from_fn(|axis| record.upper[axis] - record.lower[axis]);
    x * y + y * z + z * x
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::bounds::Aabb;

    /// A node's records, and how many children it has: leaves, and nodes over leaves.
    fn family() -> impl Strategy<Value = (Vec<Record>, usize)> {
        // On a coarse lattice, so that areas are often equal and always exact.
        let corner = || prop::array::uniform3(0u8..8);
        let leaf = (corner(), corner()).prop_map(|(a, b)| {
            let corner = |c: [u8; 3]| glam::Vec3::from(c.map(f32::from));
            let bounds = Aabb::EMPTY.extended_by(corner(a)).extended_by(corner(b));
            Record::leaf(&Bounds::of_aabb(&bounds), 0, 1)
        });
        let child = prop::collection::vec(leaf, 1..=MAX_CHILDREN);
        prop::collection::vec(child, 2..6).prop_map(|below| {
            let mut records = vec![Record::UNUSED; below.len()];
            for (child, leaves) in below.iter().enumerate() {
                records[child] = match leaves[..] {
                    [leaf] => leaf,
                    _ => Record::inner_around(records.len(), leaves),
                };
                records.extend(leaves);
            }
            (records, below.len())
        })
    }

    /// Tries every exchange and keeps the first of the best.
    fn slow_twin(place: &mut Place<'_>) -> Option<(f32, [usize; 3])> {
        let children = 0..place.children;
        let mut best: Option<(f32, [usize; 3])> = None;
        for opened in children.clone() {
            if place.records[opened].is_leaf() {
                continue;
            }
            for moved_down in children.clone().filter(|&c| c != opened) {
                for moved_up in 0..place.records[opened].count as usize {
                    let old = place.records.to_vec();
                    place.make(&Exchange {
                        cost: 0.0,
                        moved_down,
                        opened,
                        moved_up,
                    });
                    let cost = half_area(&place.records[opened]) - half_area(&old[opened]);
                    place.records.copy_from_slice(&old);
                    if cost < best.map_or(0.0, |(best, _)| best) {
                        best = Some((cost, [moved_down, opened, moved_up]));
                    }
                }
            }
        }
        best
    }

    fn place(records: &mut [Record], children: usize, levels: u32) -> Place<'_> {
        Place {
            records,
            records_begin: 0,
            children,
            levels,
        }
    }

    proptest! {
        #[test]
        fn the_exchange_is_that_of_trying_all((mut records, children) in family()) {
            let mut place = place(&mut records, children, 64);
            let found = place.best(|_| true);
            let found = found.map(|e| (e.cost, [e.moved_down, e.opened, e.moved_up]));
            prop_assert_eq!(found, slow_twin(&mut place));
        }

        #[test]
        fn exchanges_end_and_the_node_stays_whole((mut records, children) in family()) {
            let all = |records: &[Record]| Record::inner_around(0, &records[..children]);
            let whole = all(&records);
            rotate(place(&mut records, children, 64), u32::MAX, |_| false);
            prop_assert!(slow_twin(&mut place(&mut records, children, 64)).is_none());
            let after = all(&records);
            prop_assert_eq!((after.lower, after.upper), (whole.lower, whole.upper));
            prop_assert_eq!((after.nodes, after.blocks), (whole.nodes, whole.blocks));
        }
    }

    #[test]
    fn closed_children_and_the_last_level_are_spared() {
        let at = |x: f32| {
            let corner = glam::Vec3::new(x, 0.0, 0.0);
            let bounds = Aabb {
                min: corner,
                max: corner + glam::Vec3::ONE,
            };
            Record::leaf(&Bounds::of_aabb(&bounds), 0, 1)
        };
        // Near and far in one node, and beside it what belongs to the near one.
        let far = [at(0.0), at(9.0)];
        let records = [at(1.0), Record::inner_around(2, &far), far[0], far[1]];
        for (levels, closed, exchanged) in [(2, false, true), (1, false, false), (2, true, false)] {
            let mut records = records;
            rotate(place(&mut records, 2, levels), 1, |_| closed);
            let far_is_above = records[0].lower[0] == 9.0;
            assert_eq!(far_is_above, exchanged, "{levels} {closed}");
        }
    }
}
