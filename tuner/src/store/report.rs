//! The state of a store in numbers: `fsck` looks at files, `stats` at records.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use super::body::Body;
use super::frame::Damage;
use super::log::LogFile;
use super::{MachineId, Records, SceneId, Store, StoreError, WriterId};
use crate::Outcome;

/// The state of one file.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FileReport {
    /// Where it is.
    pub path: PathBuf,
    /// Its length.
    pub bytes: u64,
    /// Version in its header; `None` if the header is missing or damaged.
    pub version: Option<u32>,
    /// Number of good records by kind; [`kind_name`](super::kind_name) names the known ones.
    pub by_kind: BTreeMap<u32, usize>,
    /// Good records that do not say who wrote them; counted in `by_kind` too.
    pub unstamped: usize,
    /// Stamped records of an unknown kind or form; counted in `by_kind` too.
    pub unknown: usize,
    /// What belongs to no good record, in the order of the file.
    pub damage: Vec<Damage>,
}

impl FileReport {
    pub(crate) fn of(log: &LogFile) -> FileReport {
        let mut by_kind = BTreeMap::new();
        for record in &log.records {
            *by_kind.entry(record.kind()).or_insert(0) += 1;
        }
        let is_unknown = |body: &Body| matches!(body, Body::Other { .. });
        FileReport {
            path: log.path.clone(),
            bytes: log.bytes,
            version: log.version,
            by_kind,
            unstamped: log.records.len() - log.entries().count(),
            unknown: log.entries().filter(|e| is_unknown(e.body())).count(),
            damage: log.damage.clone(),
        }
    }
}

/// What is wrong with a store.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct StoreReport {
    /// The files that could be read.
    pub files: Vec<FileReport>,
    /// Files of a later format version.
    pub newer: Vec<PathBuf>,
    /// Stamps for which there are different records.
    pub conflicts: usize,
}

impl StoreReport {
    /// Whether there is no damage and no conflict, and nothing that could not be read.
    pub fn is_clean(&self) -> bool {
        let is_clean = |file: &FileReport| file.damage.is_empty() && file.unstamped == 0;
        self.files.iter().all(is_clean) && self.newer.is_empty() && self.conflicts == 0
    }
}

/// What a set of records holds.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Stats {
    /// Number of records by kind; [`kind_name`](super::kind_name) names the known ones.
    pub by_kind: BTreeMap<u32, usize>,
    /// Number of records by writer.
    pub by_writer: BTreeMap<WriterId, usize>,
    /// Number of outcomes by machine.
    pub by_machine: BTreeMap<MachineId, usize>,
    /// Number of outcomes by scene.
    pub by_scene: BTreeMap<SceneId, usize>,
    /// Outcomes that are measured costs.
    pub done: usize,
    /// Outcomes that are failures.
    pub failed: usize,
    /// Outcomes that say nothing.
    pub cancelled: usize,
    /// Trials without outcome: running, or lost with their program.
    pub open: usize,
    /// Outcomes whose trial is missing. They belong to no machine and are not counted above.
    pub orphans: usize,
    /// Records that do not say who wrote them.
    pub unstamped: usize,
    /// Stamps for which there are different records.
    pub conflicts: usize,
}

impl Store {
    /// Looks for damage in all files; changes nothing.
    ///
    /// # Errors
    ///
    /// If the system refuses.
    pub fn fsck(&self) -> Result<StoreReport, StoreError> {
        let contents = self.read()?;
        Ok(StoreReport {
            files: contents.files,
            newer: contents.newer,
            conflicts: contents.records.conflicts().count(),
        })
    }
}

impl Records {
    /// Counts what there is.
    pub fn stats(&self) -> Stats {
        let mut stats = Stats {
            unstamped: self.unstamped(),
            conflicts: self.conflicts().count(),
            ..Stats::default()
        };
        let (mut opened, mut outcomes) = (BTreeSet::new(), 0);
        for entry in self.iter() {
            *stats.by_kind.entry(entry.kind()).or_insert(0) += 1;
            let writer = entry.stamp().writer.clone();
            *stats.by_writer.entry(writer).or_insert(0) += 1;
            match entry.body() {
                Body::TrialOpen(_) => {
                    opened.insert(entry.stamp());
                }
                Body::Outcome(_) => outcomes += 1,
                _ => {}
            }
        }
        for (_, trial, ended) in self.ended() {
            outcomes -= 1;
            opened.remove(&ended.trial);
            *stats.by_machine.entry(trial.machine.clone()).or_insert(0) += 1;
            *stats.by_scene.entry(trial.scene.clone()).or_insert(0) += 1;
            match ended.outcome {
                Outcome::Done { .. } => stats.done += 1,
                Outcome::Failed { .. } => stats.failed += 1,
                Outcome::Cancelled => stats.cancelled += 1,
            }
        }
        stats.open = opened.len();
        stats.orphans = outcomes;
        stats
    }
}
