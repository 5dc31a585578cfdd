//! Hashes of trees: one number says whether two trees are the same.
//!
//! FNV-1a with 64 bits (Fowler, Noll, Vo); what is fed to it is section 2 of the README beside the
//! golden files. Invariant: −0 hashes as +0, since the sign of a zero decides nothing.

use raywright_bvh::{Aabb, Vec3};

use crate::tree::Node;

const LEAF: u8 = 0x4c;
const NODE: u8 = 0x4e;

/// FNV-1a over bytes, 64 bits.
#[derive(Clone, Copy, Debug)]
pub struct Fnv(u64);

impl Fnv {
    const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn u32(&mut self, value: usize) {
        self.bytes(&u32::try_from(value).unwrap_or(u32::MAX).to_le_bytes());
    }

    fn vertex(&mut self, v: Vec3) {
        for c in v.to_array() {
            // Adding +0 turns −0 into +0 and changes nothing else.
            self.bytes(&(c + 0.0).to_bits().to_le_bytes());
        }
    }

    fn bounds(&mut self, bounds: &Aabb) {
        self.vertex(bounds.min);
        self.vertex(bounds.max);
    }

    fn references<'a>(&mut self, pairs: impl ExactSizeIterator<Item = &'a (u32, u32)>) {
        self.bytes(&[LEAF]);
        self.u32(pairs.len());
        for (geometry_id, primitive_id) in pairs {
            self.bytes(&geometry_id.to_le_bytes());
            self.bytes(&primitive_id.to_le_bytes());
        }
    }

    /// The hash of some words.
    #[must_use]
    pub fn of_words(words: impl IntoIterator<Item = u32>) -> u64 {
        let mut hash = Self::EMPTY;
        for word in words {
            hash.bytes(&word.to_le_bytes());
        }
        hash.0
    }

    /// The hash of all vertex coordinates in order.
    #[must_use]
    pub fn of_vertices(triangles: &[[Vec3; 3]]) -> u64 {
        let mut hash = Self::EMPTY;
        for v in triangles.iter().flatten() {
            hash.vertex(*v);
        }
        hash.0
    }
}

/// The hash of a tree with the order of children and of primitives.
#[must_use]
pub fn ordered(root: &Node) -> u64 {
    let mut hash = Fnv::EMPTY;
    feed(root, &mut hash);
    hash.0
}

fn feed(node: &Node, hash: &mut Fnv) {
    match node {
        Node::Leaf(_) => hash.references(pairs(node).iter()),
        Node::Inner(children) => {
            hash.bytes(&[NODE]);
            hash.u32(children.len());
            for (bounds, _) in children {
                hash.bounds(bounds);
            }
            for (_, child) in children {
                feed(child, hash);
            }
        }
    }
}

/// The hash of a tree whatever the order of children and of primitives.
#[must_use]
pub fn unordered(node: &Node) -> u64 {
    let mut hash = Fnv::EMPTY;
    match node {
        Node::Leaf(_) => {
            let mut pairs = pairs(node);
            pairs.sort_unstable();
            hash.references(pairs.iter());
        }
        Node::Inner(children) => {
            let child_hash = |(bounds, child): &(Aabb, Node)| {
                let mut hash = Fnv::EMPTY;
                hash.bounds(bounds);
                hash.bytes(&unordered(child).to_le_bytes());
                hash.0
            };
            let mut hashes: Vec<u64> = children.iter().map(child_hash).collect();
            hashes.sort_unstable();
            hash.bytes(&[NODE]);
            hash.u32(hashes.len());
            for value in hashes {
                hash.bytes(&value.to_le_bytes());
            }
        }
    }
    hash.0
}

fn pairs(leaf: &Node) -> Vec<(u32, u32)> {
    match leaf {
        Node::Leaf(references) => references
            .iter()
            .map(|r| (r.geometry_id, r.primitive_id))
            .collect(),
        Node::Inner(_) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use raywright_bvh::LeafReference;

    use super::*;

    fn leaf(ids: [u32; 2]) -> Node {
        Node::Leaf(
            ids.map(|primitive_id| LeafReference {
                geometry_id: 0,
                primitive_id,
            })
            .to_vec(),
        )
    }

    fn node(zero: f32, children: [Node; 2]) -> Node {
        let bounds = Aabb {
            min: Vec3::splat(zero),
            max: Vec3::ONE,
        };
        Node::Inner(children.map(|child| (bounds, child)).to_vec())
    }

    #[test]
    fn fnv_of_nothing_and_of_a_word() {
        // FNV-1a of "foobar" is in the authors' table of test vectors.
        let mut hash = Fnv::EMPTY;
        hash.bytes(b"foobar");
        assert_eq!(hash.0, 0x8594_4171_f739_67e8);
        assert_eq!(Fnv::of_words([]), 0xcbf2_9ce4_8422_2325);
    }

    #[test]
    fn order_matters_only_to_the_ordered_hash_and_the_sign_of_zero_to_none() {
        let a = node(0.0, [leaf([1, 2]), leaf([3, 4])]);
        let b = node(-0.0, [leaf([1, 2]), leaf([3, 4])]);
        let c = node(0.0, [leaf([4, 3]), leaf([1, 2])]);
        assert_eq!(ordered(&a), ordered(&b));
        assert_ne!(ordered(&a), ordered(&c));
        assert_eq!(unordered(&a), unordered(&c));
    }
}
