//! Which ids mean the same thing.
//!
//! Aliases are an equivalence: symmetric, transitive, and independent of the order in which they
//! were recorded. Disjoint sets with path halving (Tarjan & van Leeuwen, "Worst-case analysis of
//! set union algorithms", JACM 1984).

use std::collections::HashMap;

use super::Records;
use super::body::{AliasOf, Body};

/// Classes of ids.
#[derive(Debug, Default)]
pub(crate) struct SameIds<'a> {
    index: HashMap<&'a str, usize>,
    parent: Vec<usize>,
}

impl<'a> SameIds<'a> {
    /// The classes that the aliases among `records` make.
    pub(crate) fn of(records: &'a Records, of: AliasOf) -> SameIds<'a> {
        let mut same = SameIds::default();
        for entry in records.iter() {
            if let Body::Alias(alias) = entry.body()
                && alias.of == of
            {
                let one = same.index_of(&alias.same.0);
                let other = same.index_of(&alias.same.1);
                let (one, other) = (same.root(one), same.root(other));
                same.parent[one] = other;
            }
        }
        same
    }

    /// Whether both ids mean the same.
    pub(crate) fn are_same(&mut self, one: &str, other: &str) -> bool {
        if one == other {
            return true;
        }
        match (self.index.get(one), self.index.get(other)) {
            (Some(&one), Some(&other)) => self.root(one) == self.root(other),
            _ => false,
        }
    }

    fn index_of(&mut self, id: &'a str) -> usize {
        let next = self.parent.len();
        let index = *self.index.entry(id).or_insert(next);
        if index == next {
            self.parent.push(next);
        }
        index
    }

    fn root(&mut self, mut index: usize) -> usize {
        while self.parent[index] != index {
            self.parent[index] = self.parent[self.parent[index]];
            index = self.parent[index];
        }
        index
    }
}
