//! Records from many logs as one set.
//!
//! Merging is the union of sets by stamp (writer and sequence number). Invariants: it is
//! commutative, associative and idempotent, conflicts included. Two different records of one stamp
//! come about when a folder was copied and written to in both places: then the one with the lesser
//! bytes stays in the set, wherever it came from, and the stamp is listed.

use std::collections::BTreeSet;
use std::collections::btree_map::{BTreeMap, Entry as Slot};

use super::body::{Body, Machine, Scene, State};
use super::entry::Entry;
use super::frame::Frame;
use super::log::LogFile;
use super::space::SpaceFacts;
use super::{MachineId, SceneId, SpaceId, Stamp};

/// A set of records.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Records {
    entries: BTreeMap<Stamp, Entry>,
    /// Good records that do not say who wrote them.
    unstamped: BTreeSet<Frame>,
    conflicts: BTreeSet<Stamp>,
}

impl Records {
    /// The union of both sets.
    #[must_use]
    pub fn merge(mut self, other: Records) -> Records {
        for entry in other.entries.into_values() {
            self.insert(entry);
        }
        self.unstamped.extend(other.unstamped);
        self.conflicts.extend(other.conflicts);
        self
    }

    /// Adds the records of a file.
    pub fn add(&mut self, log: LogFile) {
        for record in log.records {
            match record.content {
                Ok(entry) => self.insert(entry),
                Err(frame) => {
                    self.unstamped.insert(frame);
                }
            }
        }
    }

    /// The records in the order of their stamps.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &Entry> {
        self.entries.values()
    }

    /// The record with this stamp.
    pub fn get(&self, stamp: &Stamp) -> Option<&Entry> {
        self.entries.get(stamp)
    }

    /// Number of records, unstamped ones not counted.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there is nothing at all.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty() && self.unstamped.is_empty()
    }

    /// Stamps for which different records were found.
    pub fn conflicts(&self) -> impl Iterator<Item = &Stamp> {
        self.conflicts.iter()
    }

    /// Number of records that do not say who wrote them. They are kept, and no more.
    pub fn unstamped(&self) -> usize {
        self.unstamped.len()
    }

    /// The description of a space, the latest if there are several.
    pub fn space(&self, id: &SpaceId) -> Option<&SpaceFacts> {
        self.latest(|body| match body {
            Body::Space(space) if space.id == *id => Some(space),
            _ => None,
        })
    }

    /// The description of a machine, the latest if there are several.
    pub fn machine(&self, id: &MachineId) -> Option<&Machine> {
        self.latest(|body| match body {
            Body::Machine(machine) if machine.id == *id => Some(machine),
            _ => None,
        })
    }

    /// The description of a scene, the latest if there are several.
    pub fn scene(&self, id: &SceneId) -> Option<&Scene> {
        self.latest(|body| match body {
            Body::Scene(scene) if scene.id == *id => Some(scene),
            _ => None,
        })
    }

    /// The latest state of a name.
    pub fn state(&self, name: &str) -> Option<&State> {
        self.latest(|body| match body {
            Body::State(state) if state.name == name => Some(state),
            _ => None,
        })
    }

    /// Of the records that `select` wants, the latest: by time, then by stamp.
    fn latest<'a, T>(&'a self, select: impl Fn(&'a Body) -> Option<&'a T>) -> Option<&'a T> {
        let wanted = self.iter().filter_map(|entry| {
            let selected = select(entry.body())?;
            Some((entry.time(), selected))
        });
        let latest = wanted.max_by(|(a, _), (b, _)| a.total_cmp(b));
        Some(latest?.1)
    }

    pub(crate) fn insert(&mut self, entry: Entry) {
        match self.entries.entry(entry.stamp().clone()) {
            Slot::Vacant(slot) => {
                slot.insert(entry);
            }
            Slot::Occupied(mut slot) => {
                if slot.get().frame() != entry.frame() {
                    self.conflicts.insert(entry.stamp().clone());
                }
                if entry.frame() < slot.get().frame() {
                    slot.insert(entry);
                }
            }
        }
    }

    /// Keeps the records that `wanted` accepts, and all unstamped ones.
    pub(crate) fn retain(&mut self, mut wanted: impl FnMut(&Entry) -> bool) {
        self.entries.retain(|_, entry| wanted(entry));
    }

    /// All records as bytes: by stamp, then those without.
    pub(crate) fn frames(&self) -> impl Iterator<Item = &Frame> {
        self.iter().map(Entry::frame).chain(&self.unstamped)
    }

    /// One set per writer, and what is unstamped.
    pub(crate) fn by_writer(&self) -> (BTreeMap<&super::WriterId, Records>, Records) {
        let mut by_writer: BTreeMap<_, Records> = BTreeMap::new();
        for entry in self.iter() {
            let records = by_writer.entry(&entry.stamp().writer).or_default();
            records.insert(entry.clone());
        }
        let unstamped = Records {
            unstamped: self.unstamped.clone(),
            ..Records::default()
        };
        (by_writer, unstamped)
    }
}
