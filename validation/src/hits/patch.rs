//! May rounding let a ray pass between triangles that meet where it goes?
//!
//! A watertight test moves every vertex a little, the same way in all triangles around it, and is exact otherwise
//! (see `sheared`). Moved so, a ray changes sides of edges alone that it passes within the bounds of their ends: the
//! near ones. The patch of a triangle is what is reached from it across near edges. A ray is in a triangle if a
//! half-line from it crosses an odd number of its edges, and whoever moves it across an edge moves it into or out of
//! all triangles at that edge. So with one unknown of 0 or 1 for each near edge (is it moved across?), being outside
//! of a triangle is a linear equation modulo 2, and a miss can be right only if all equations have a common solution.
//! They have none where a closed fan surrounds the ray, and they have one at an outline, at a crack between vertices
//! that are not at one place, and where the fan is folded so that all of it lies on one side.
//!
//! Invariant: a miss for which the equations have no solution is no matter of rounding.

use std::collections::{HashMap, HashSet};

use super::sheared::{Point, Shear, Side};

/// Whose place is the same, to the last bit; −0 is 0.
pub(super) type Place = [u32; 3];

/// The two places of an edge, the smaller first.
pub(super) type EdgeKey = [Place; 2];

/// A triangle of a patch: its places and points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners {
    pub(super) places: [Place; 3],
    pub(super) points: [Point; 3],
}

/// Whether a ray may pass the triangles that are reached from `first`. Of triangles that `is_required` leaves out, it
/// does not matter whether they are hit.
pub(super) fn may_be_passed<'n>(
    shear: &Shear,
    first: [u32; 2],
    corners: impl Fn([u32; 2]) -> Corners,
    neighbours: impl Fn(&EdgeKey) -> &'n [[u32; 2]],
    is_required: impl Fn([u32; 2]) -> bool,
) -> bool {
    let mut unknowns: HashMap<EdgeKey, usize> = HashMap::new();
    let mut equations = Vec::new();
    let mut seen = HashSet::from([first]);
    let mut waiting = vec![first];
    while let Some(ids) = waiting.pop() {
        let Corners { places, points } = corners(ids);
        let mut is_inside = false;
        let mut near = Vec::new();
        for i in 0..3 {
            let j = (i + 1) % 3;
            let (mut key, mut ends) = ([places[i], places[j]], [points[i], points[j]]);
            if key[0] == key[1] {
                continue;
            }
            if key[0] > key[1] {
                key.reverse();
                ends.reverse();
            }
            let side = shear.side(ends[0], ends[1]);
            is_inside ^= is_crossed(ends, side);
            if !is_near(ends, side) {
                continue;
            }
            let count = unknowns.len();
            near.push(*unknowns.entry(key).or_insert(count));
            let others = neighbours(&key).iter().copied();
            waiting.extend(others.filter(|&other| seen.insert(other)));
        }
        if is_required(ids) {
            equations.push((near, is_inside));
        }
    }
    let mut system = EquationsModulo2::default();
    equations
        .into_iter()
        .all(|(near, is_inside)| system.add(near, is_inside))
}

/// Whether the half-line along the first axis crosses an edge.
fn is_crossed([p, q]: [Point; 2], side: Side) -> bool {
    let (from, to) = (p[1].value > 0.0, q[1].value > 0.0);
    from != to && (side.value > 0.0) == to
}

/// Whether moved ends may bring the edge to the other side of the ray.
fn is_near([p, q]: [Point; 2], side: Side) -> bool {
    let reaches = |axis: usize| {
        let low = (p[axis].value - p[axis].bound).min(q[axis].value - q[axis].bound);
        let high = (p[axis].value + p[axis].bound).max(q[axis].value + q[axis].bound);
        low <= 0.0 && 0.0 <= high
    };
    side.value.abs() <= side.moved && reaches(0) && reaches(1)
}

/// Sums of unknowns modulo 2, each equal to 0 or 1, in echelon form.
#[derive(Clone, Debug, Default)]
struct EquationsModulo2 {
    /// By the largest unknown of the sum: the unknowns in ascending order, and what they add up to.
    rows: HashMap<usize, (Vec<usize>, bool)>,
}

impl EquationsModulo2 {
    /// Adds an equation; whether all still have a common solution. Unknowns that occur twice cancel.
    fn add(&mut self, unknowns: impl IntoIterator<Item = usize>, sum: bool) -> bool {
        let mut row = (Vec::new(), sum);
        for unknown in unknowns {
            row.0 = symmetric_difference(&row.0, &[unknown]);
        }
        while let Some(&largest) = row.0.last() {
            let Some((unknowns, sum)) = self.rows.get(&largest) else {
                self.rows.insert(largest, row);
                return true;
            };
            row = (symmetric_difference(&row.0, unknowns), row.1 ^ sum);
        }
        !row.1
    }
}

/// What is in one of two ascending lists alone.
fn symmetric_difference(mut a: &[usize], mut b: &[usize]) -> Vec<usize> {
    let mut result = Vec::with_capacity(a.len() + b.len());
    while let (Some((&x, rest_a)), Some((&y, rest_b))) = (a.split_first(), b.split_first()) {
        if x <= y {
            a = rest_a;
        }
        if y <= x {
            b = rest_b;
        }
        if x != y {
            result.push(x.min(y));
        }
    }
    result.extend_from_slice(a);
    result.extend_from_slice(b);
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_are_solved_or_found_to_contradict() {
        let mut system = EquationsModulo2::default();
        assert!(system.add([0, 1], true));
        assert!(system.add([1, 2], true));
        // Their sum.
        assert!(system.add([0, 2], false));
        assert!(!system.clone().add([2, 0], true));
        assert!(system.add([2], true));
        assert!(!system.clone().add([0], false) && !system.clone().add([1], true));
        // What occurs twice is nothing.
        assert!(system.add([5, 5], false) && !system.add([5, 5], true));
    }
}
