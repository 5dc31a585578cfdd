//! Records to test with.

use std::path::PathBuf;

use crc::{CRC_32_ISCSI, Crc};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use raywright_tuner::store::{
    Fact, Facts, Machine, Note, Query, Scene, SpaceFacts, Stamp, State, Store, SyncPolicy,
    TrialOpen, TrialOutcome, Writer, WriterId,
};
use raywright_tuner::{Config, Outcome, Param, Scale, Space};
use tempfile::TempDir;

/// Numbers that look random and are the same in every run.
pub(crate) struct Numbers(Xoshiro256PlusPlus);

impl Numbers {
    pub(crate) fn new(seed: u64) -> Numbers {
        Numbers(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    pub(crate) fn below(&mut self, bound: usize) -> usize {
        (self.0.next_u64() % bound as u64) as usize
    }
}

pub(crate) fn id(writer: &str) -> WriterId {
    WriterId::new(writer).unwrap()
}

pub(crate) fn store() -> (TempDir, Store) {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path().join("store")).unwrap();
    (folder, store)
}

pub(crate) fn writer(store: &Store, name: &str) -> Writer {
    store.writer(&id(name), SyncPolicy::OnClose).unwrap()
}

pub(crate) fn space() -> Space {
    Space::new(vec![
        Param::integer("bins", 2..=64, Scale::Log, "Number of bins."),
        Param::real("alpha", 1e-7..=0.1, Scale::Log, "Overlap that is accepted."),
        Param::boolean("rotate", "Whether the tree is rotated."),
    ])
    .unwrap()
}

pub(crate) fn config(bins: i64) -> Config {
    let values = [
        ("bins", bins.into()),
        ("alpha", 1.25e-3.into()),
        ("rotate", true.into()),
    ];
    space().config(&values).unwrap()
}

pub(crate) fn machine(name: &str) -> Machine {
    Machine::new(Facts::from([
        ("processor".to_owned(), Fact::from(name)),
        ("cores".to_owned(), Fact::from(8)),
        ("ghz".to_owned(), Fact::from(3.7)),
    ]))
}

pub(crate) fn scene(name: &str) -> Scene {
    Scene::new(Facts::from([("hash".to_owned(), Fact::from(name))]))
}

/// Opens and ends a trial; the stamp is that of the outcome.
pub(crate) fn trial(writer: &mut Writer, machine: &Machine, scene: &Scene, cost: f64) -> Stamp {
    let space = SpaceFacts::new(&space()).id;
    let (machine, scene) = (machine.id.clone(), scene.id.clone());
    let open = TrialOpen::new(space, machine, scene, &config(8), "test");
    let trial = writer.append(1.5e9, open).unwrap();
    let outcome = TrialOutcome::new(trial, Outcome::Done { cost });
    writer
        .append(1.5e9 + 1.0, outcome.with_measure("build_ms", 12.5))
        .unwrap()
}

/// One record of every kind and some trials, of one writer.
pub(crate) fn fill(writer: &mut Writer, trials: usize) {
    let (machine, scene) = (machine("one"), scene("hall"));
    writer.append(1.5e9, SpaceFacts::new(&space())).unwrap();
    writer.append(1.5e9, machine.clone()).unwrap();
    writer.append(1.5e9, scene.clone()).unwrap();
    let state = serde_json::json!({"simplex": [[1.0, 0.1], [2, 3]], "seed": u64::MAX});
    writer
        .append(1.5e9, State::new("nelder-mead", state))
        .unwrap();
    writer
        .append(1.5e9, Note::new("a \"note\"\nof two lines, ünïcode"))
        .unwrap();
    for index in 0..trials {
        trial(writer, &machine, &scene, 0.1 * index as f64);
    }
}

/// A log of one record per kind and some trials, as bytes.
pub(crate) fn log_bytes(trials: usize) -> Vec<u8> {
    let (_folder, store) = store();
    let mut writer = writer(&store, "a");
    fill(&mut writer, trials);
    writer.close().unwrap();
    std::fs::read(store.log_of(&id("a"))).unwrap()
}

/// Puts a log of writer `a` into the store.
pub(crate) fn put(store: &Store, bytes: &[u8]) -> PathBuf {
    let path = store.log_of(&id("a"));
    std::fs::write(&path, bytes).unwrap();
    path
}

/// All outcomes of a machine.
pub(crate) fn all_of(machine: &Machine) -> Query {
    Query::new(machine.id.clone())
}

const CRC32C: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// A header, written independently of the crate.
pub(crate) fn header(version: u32) -> Vec<u8> {
    let mut bytes = b"raywtune".to_vec();
    bytes.extend(version.to_le_bytes());
    bytes.extend(CRC32C.checksum(&bytes).to_le_bytes());
    bytes
}

/// A record, written independently of the crate.
pub(crate) fn record(kind: u32, json: &str) -> Vec<u8> {
    let mut summed = (json.len() as u32 + 1).to_le_bytes().to_vec();
    summed.extend(kind.to_le_bytes());
    summed.extend(json.as_bytes());
    summed.push(b'\n');
    let mut bytes = vec![0xff, b'R', b'W', 0xfe];
    bytes.extend(&summed);
    bytes.extend(CRC32C.checksum(&summed).to_le_bytes());
    bytes
}
