//! Optimisation of a binary tree by moving subtrees to better places: Bittner, Hapala, Havran,
//! *Fast Insertion-Based Optimization of Bounding Volume Hierarchies*, 2013, searched for many
//! nodes at the same time as in Meister, Bittner, *Parallel Reinsertion for Bounding Volume
//! Hierarchy Optimization*, 2018.
//!
//! A node X is moved to T by taking it and its parent P out, so that its sibling takes the place of
//! P, and putting P back between T and the parent of T, with X and T as children. The sum of the
//! areas of inner nodes, to which the surface area cost is proportional while the leaves stay as
//! they are, changes by the areas of P before and after and of the nodes that shrink and grow.
//!
//! For a batch of nodes the best T is searched in a tree that nobody changes; then the moves are
//! made one after the other, and one that does not pay any more after those before it is taken
//! back. Invariants: the result does not depend on threads; the sum of areas never grows; the
//! leaves stay the same; the root stays node 0 and its children stay below it unless their siblings
//! move; nothing deeper than [`DEEPEST`] is moved or gets a new sibling, which bounds the time of a
//! search for any tree.

use super::{
    binary::{Below, BinaryTree, Node, ROOT},
    control::BuildControl,
    primitive::Bounds,
    tasks,
};
use crate::error::BuildError;

/// The most rounds, and the share of the areas that a round must gain for another one. On Sponza
/// three rounds gain 10 %, 3 % and 0.7 %.
const ROUNDS: usize = 3;
const LEAST_GAIN: f64 = 0.005;

/// One of so many nodes is moved, the largest first: a tenth of them brings nine tenths of the
/// gain of all (Sponza: 9.9 % of the areas in place of 10.9 % in the first round).
const NODES_PER_CANDIDATE: usize = 10;

/// Smaller trees have all their nodes moved.
const SMALL_TREE: usize = 4096;

/// Nodes whose moves are searched in the same tree. Enough for several threads, few enough that
/// most moves still pay when their turn comes.
const BATCH: usize = 1 << 13;

/// Nodes that one thread searches for at a time.
const SEARCHES: usize = 1 << 9;

/// Steps to the root beyond which nodes stay where they are.
const DEEPEST: usize = 256;

/// Places that a search keeps in mind; it forgets those beyond.
const STACK: usize = 128;

/// A move that may pay.
#[derive(Clone, Copy, Debug)]
struct Move {
    from: u32,
    to: u32,
}

/// The memory of an optimisation.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    /// The order of the candidates: the largest first. Inverted area above, index below.
    keys: Vec<u64>,
    moves: Vec<Move>,
}

impl Memory {
    pub(crate) fn bytes(&self) -> usize {
        self.keys.capacity() * size_of::<u64>() + self.moves.capacity() * size_of::<Move>()
    }
}

/// Optimises a tree, which is and will be in preorder.
pub(crate) fn optimize(
    tree: &mut BinaryTree,
    memory: &mut Memory,
    control: &BuildControl,
) -> Result<(), BuildError> {
    for _ in 0..ROUNDS {
        let total = sum_of_areas(tree);
        let gain = round(tree, memory, control)?;
        tree.sort();
        if gain < LEAST_GAIN * total {
            break;
        }
    }
    Ok(())
}

/// The areas of the inner nodes.
fn sum_of_areas(tree: &BinaryTree) -> f64 {
    tree.nodes
        .iter()
        .filter(|node| matches!(node.below, Below::Children(_)))
        .map(|node| f64::from(node.area))
        .sum()
}

/// Tries to move every node once; returns by how much the sum of areas shrank.
fn round(
    tree: &mut BinaryTree,
    memory: &mut Memory,
    control: &BuildControl,
) -> Result<f64, BuildError> {
    let Memory { keys, moves } = memory;
    keys.clear();
    keys.extend((0..).zip(&tree.nodes).map(|(index, node): (u32, _)| {
        // Areas are not negative, so that their bits are in the order of their values.
        u64::from(!node.area.to_bits()) << 32 | u64::from(index)
    }));
    let count = (keys.len() / NODES_PER_CANDIDATE).max(keys.len().min(SMALL_TREE));
    if count < keys.len() {
        keys.select_nth_unstable(count);
    }
    let candidates = &mut keys[..count];
    candidates.sort_unstable();
    let mut gain = 0.0;
    for batch in candidates.chunks(BATCH) {
        control.check()?;
        moves.clear();
        moves.extend(batch.iter().map(|&key| Move {
            from: key as u32,
            to: key as u32,
        }));
        tasks::for_each_piece_of(moves, SEARCHES, &|piece: &mut [Move]| {
            for candidate in piece {
                candidate.to = best_place(&tree.nodes, candidate.from);
            }
        });
        for candidate in moves
            .iter()
            .filter(|candidate| candidate.to != candidate.from)
        {
            gain += reinsert(&mut tree.nodes, candidate);
        }
    }
    Ok(gain)
}

fn united(a: &Bounds, b: &Bounds) -> Bounds {
    let mut bounds = *a;
    bounds.extend(b);
    bounds
}

/// The other child of the parent of a node that is not the root.
fn sibling(nodes: &[Node], index: u32) -> u32 {
    match nodes[nodes[index as usize].parent as usize].below {
        Below::Children([left, right]) if left == index => right,
        Below::Children([left, _]) => left,
        Below::Leaf { .. } => index,
    }
}

/// Where a node costs least; the node itself if that is where it is.
fn best_place(nodes: &[Node], from: u32) -> u32 {
    let node = &nodes[from as usize];
    let parent = node.parent;
    if parent == ROOT {
        return from;
    }
    let mut best = (0.0, from);
    let mut stack = [(0.0_f32, 0_u32); STACK];
    // What is gained above by taking the node and its parent out.
    let mut saved = nodes[parent as usize].area;
    let mut other = sibling(nodes, from);
    // The box that the ancestor below `pivot` will have.
    let mut shrunk = nodes[other as usize].bounds;
    let mut pivot = parent;
    for _ in 0..DEEPEST {
        // Below `pivot`, on the other side of where the node is.
        stack[0] = (saved, other);
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (saved, to) = stack[top];
            // The new parent is at least as large as the node.
            if saved - node.area <= best.0 {
                continue;
            }
            let target = &nodes[to as usize];
            let gain = saved - united(&target.bounds, &node.bounds).half_area();
            // Beside its sibling is where the node is.
            if gain > best.0 && (to != other || pivot != parent) {
                best = (gain, to);
            }
            if let Below::Children(children) = target.below {
                let saved = gain + target.area;
                if saved - node.area > best.0 {
                    for child in children {
                        if top < STACK {
                            stack[top] = (saved, child);
                            top += 1;
                        }
                    }
                }
            }
        }
        if pivot == ROOT {
            break;
        }
        if pivot != parent {
            // Taking the node out makes an ancestor smaller; beside the ancestor, their new parent
            // has the box that the ancestor had.
            shrunk.extend(&nodes[other as usize].bounds);
            let area = nodes[pivot as usize].area;
            saved += area - shrunk.half_area();
            if saved - area > best.0 {
                best = (saved - area, pivot);
            }
        }
        other = sibling(nodes, pivot);
        pivot = nodes[pivot as usize].parent;
    }
    best.1
}

/// Makes a move if it still can be made and pays; returns by how much the sum of areas shrank.
fn reinsert(nodes: &mut [Node], &Move { from, to }: &Move) -> f64 {
    let parent = nodes[from as usize].parent;
    let back = sibling(nodes, from);
    if parent == ROOT || to == parent || to == back || !is_outside(nodes, from, to) {
        return 0.0;
    }
    let gain = take_out(nodes, parent, back) + put_in(nodes, from, parent, to);
    if gain > 0.0 {
        return gain;
    }
    let now = sibling(nodes, from);
    take_out(nodes, parent, now);
    put_in(nodes, from, parent, back);
    0.0
}

/// Whether `to` is neither the root nor below `from` nor too deep.
fn is_outside(nodes: &[Node], from: u32, to: u32) -> bool {
    let mut above = to;
    for _ in 0..DEEPEST {
        if above == from {
            return false;
        }
        if above == ROOT {
            return to != ROOT;
        }
        above = nodes[above as usize].parent;
    }
    false
}

/// Puts `child` where `old` is below the parent of `old`.
fn replace(nodes: &mut [Node], old: u32, child: u32) {
    let parent = nodes[old as usize].parent;
    nodes[child as usize].parent = parent;
    if let Below::Children(children) = &mut nodes[parent as usize].below {
        let place = usize::from(children[0] != old);
        children[place] = child;
    }
}

/// Takes a node and its parent out; its sibling takes the place of the parent. Returns by how much
/// the sum of areas shrank.
fn take_out(nodes: &mut [Node], parent: u32, sibling: u32) -> f64 {
    replace(nodes, parent, sibling);
    f64::from(nodes[parent as usize].area) + refit(nodes, nodes[sibling as usize].parent)
}

/// Puts a node and its parent in at `to`, which becomes its sibling. Returns by how much the sum of
/// areas shrank.
fn put_in(nodes: &mut [Node], from: u32, parent: u32, to: u32) -> f64 {
    replace(nodes, to, parent);
    nodes[to as usize].parent = parent;
    let bounds = united(&nodes[to as usize].bounds, &nodes[from as usize].bounds);
    let node = &mut nodes[parent as usize];
    node.below = Below::Children([to, from]);
    node.bounds = bounds;
    node.area = bounds.half_area();
    refit(nodes, nodes[parent as usize].parent) - f64::from(nodes[parent as usize].area)
}

/// Makes the boxes from a node up to the root those of their children, until one already is.
/// Returns by how much the sum of areas shrank.
fn refit(nodes: &mut [Node], mut index: u32) -> f64 {
    let mut gain = 0.0;
    while let Below::Children([left, right]) = nodes[index as usize].below {
        let bounds = united(&nodes[left as usize].bounds, &nodes[right as usize].bounds);
        let node = &mut nodes[index as usize];
        if bounds.0 == node.bounds.0 {
            break;
        }
        let area = bounds.half_area();
        gain += f64::from(node.area) - f64::from(area);
        node.bounds = bounds;
        node.area = area;
        if index == ROOT {
            break;
        }
        index = node.parent;
    }
    gain
}

#[cfg(test)]
mod tests {
    use super::{
        super::binary::{Shape, random_tree},
        *,
    };

    fn tree(leaves: usize, seed: u64, shape: Shape) -> BinaryTree {
        let (root, records, _) = random_tree(leaves, seed, shape);
        let mut tree = BinaryTree::default();
        tree.load(&records, &root);
        tree
    }

    /// The leaves; checks links and boxes.
    fn leaves(tree: &BinaryTree) -> Vec<(u32, u32)> {
        let mut leaves = Vec::new();
        for (index, node) in (0..).zip(&tree.nodes) {
            match node.below {
                Below::Leaf { first, count } => leaves.push((first, count)),
                Below::Children([left, right]) => {
                    let [l, r] = [left, right].map(|child| &tree.nodes[child as usize]);
                    assert_eq!((left, l.parent, r.parent), (index + 1, index, index));
                    assert_eq!(node.bounds.0, united(&l.bounds, &r.bounds).0);
                    assert_eq!(node.area, node.bounds.half_area());
                }
            }
        }
        leaves.sort_unstable();
        leaves
    }

    #[test]
    fn areas_never_grow_and_leaves_stay() {
        for seed in 0..200 {
            let shape = if seed % 2 == 0 {
                Shape::Random
            } else {
                Shape::Chain
            };
            let mut tree = tree(1 + seed as usize * 3, seed, shape);
            let (before, area) = (leaves(&tree), sum_of_areas(&tree));
            optimize(&mut tree, &mut Memory::default(), &BuildControl::default()).unwrap();
            assert_eq!(leaves(&tree), before);
            let after = sum_of_areas(&tree);
            assert!(after <= area * (1.0 + 1e-12), "{after} {area}");
            // Trees without any order are far from good.
            if seed > 50 {
                assert!(after < 0.7 * area, "{after} {area}");
            }
        }
    }

    /// The search against trying every place, by the areas that the tree then has.
    #[test]
    fn the_best_place_is_found() {
        for seed in 0..40 {
            let tree = tree(12, seed, Shape::Random);
            let area = sum_of_areas(&tree);
            let gain_of = |from, to| {
                let mut nodes = tree.nodes.clone();
                let gain = reinsert(&mut nodes, &Move { from, to });
                let mut changed = BinaryTree::default();
                changed.nodes = nodes;
                let difference = area - sum_of_areas(&changed);
                assert!((gain - difference).abs() < 1e-5, "{gain} {difference}");
                gain
            };
            for from in 1..tree.nodes.len() as u32 {
                let best = (1..tree.nodes.len() as u32)
                    .map(|to| gain_of(from, to))
                    .fold(0.0, f64::max);
                let found = best_place(&tree.nodes, from);
                let gain = if found == from {
                    0.0
                } else {
                    gain_of(from, found)
                };
                assert!((best - gain).abs() < 1e-5, "{seed} {from}: {best} {gain}");
            }
        }
    }
}
