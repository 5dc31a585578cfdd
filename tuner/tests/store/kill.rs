//! A writer that is killed at any moment loses nothing that it was told is stored.

use std::env;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

use raywright_tuner::store::{Note, Store, StoreError, SyncPolicy};

use crate::common::{Numbers, id, store, writer};

const FOLDER: &str = "RAYWRIGHT_TEST_STORE";

/// Not a test by itself: the child process, which appends until it is killed.
#[test]
fn child_appends() {
    let Some(folder) = env::var_os(FOLDER) else {
        return;
    };
    let store = Store::open(folder).unwrap();
    let mut writer = writer(&store, "a");
    println!("opened 0");
    for round in 0..1_000_000 {
        let note = Note::new(&"x".repeat(round * 7919 % 20_000));
        let stamp = writer.append(round as f64, note).unwrap();
        println!("stored {}", stamp.sequence);
    }
}

fn start(store: &Store) -> Child {
    let mut command = Command::new(env::current_exe().unwrap());
    command.args([
        "kill::child_appends",
        "--exact",
        "--nocapture",
        "--test-threads=1",
    ]);
    command.env(FOLDER, store.folder()).stdout(Stdio::piped());
    command.spawn().unwrap()
}

#[test]
fn no_stored_record_is_lost_when_the_writer_is_killed() {
    let mut numbers = Numbers::new(6);
    let (mut checked, mut torn) = (0, 0);
    for round in 0..200 {
        let (_folder, store) = store();
        let mut child = start(&store);
        let mut lines = BufReader::new(child.stdout.take().unwrap()).split(b'\n');
        let mut stored = Vec::new();
        let mut note = |line: Vec<u8>| {
            let line = String::from_utf8(line).unwrap();
            // The last line may be cut, and then its number is not what was printed.
            if let Some(number) = line.strip_prefix("stored ") {
                stored.push(number.parse::<u64>().unwrap_or(0));
            }
        };
        for _ in 0..numbers.below(60) {
            lines.next().unwrap().map(&mut note).unwrap();
        }
        thread::sleep(Duration::from_micros(numbers.below(3000) as u64));
        child.kill().unwrap();
        child.wait().unwrap();
        for line in lines {
            line.map(&mut note).unwrap();
        }
        let contents = store.read().unwrap();
        let found: Vec<u64> = contents
            .records
            .iter()
            .map(|e| e.stamp().sequence)
            .collect();
        for sequence in &stored {
            assert!(
                found.binary_search(sequence).is_ok(),
                "round {round}: {sequence} is lost"
            );
        }
        checked += stored.len();
        torn += contents
            .files
            .iter()
            .filter(|file| !file.damage.is_empty())
            .count();

        // The next writer is not refused, and goes on.
        let mut next = writer(&store, "a");
        let stamp = next.append(0.0, Note::new("on")).unwrap();
        assert!(found.iter().all(|&sequence| sequence < stamp.sequence));
        drop(next);
        assert!(store.fsck().unwrap().is_clean());
        assert_eq!(store.read().unwrap().records.len(), found.len() + 1);
    }
    println!("{checked} records checked, {torn} files torn");
    assert!(
        checked > 2000,
        "the children were killed too soon: {checked}"
    );
}

#[test]
fn a_second_writer_is_refused_until_the_first_is_gone() {
    let (_folder, store) = store();
    let mut child = start(&store);
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    while !lines.next().unwrap().unwrap().starts_with("stored") {}
    let refused = store.writer(&id("a"), SyncPolicy::OnClose);
    assert!(matches!(refused, Err(StoreError::InUse { .. })));
    assert!(matches!(store.compact(0.0), Err(StoreError::InUse { .. })));
    // Reading and other writers are not hindered.
    assert!(!store.read().unwrap().records.is_empty());
    let mut other = writer(&store, "b");
    other.append(0.0, Note::new("beside")).unwrap();
    child.kill().unwrap();
    child.wait().unwrap();
    let mut next = writer(&store, "a");
    let again = store.writer(&id("a"), SyncPolicy::OnClose);
    assert!(
        matches!(again, Err(StoreError::InUse { .. })),
        "also within one process"
    );
    next.append(0.0, Note::new("on")).unwrap();
    next.close().unwrap();
    writer(&store, "a").close().unwrap();
}

#[test]
fn a_reader_beside_a_writer_sees_a_beginning() {
    let (_folder, store) = store();
    let mut child = start(&store);
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut before = 0;
    // The log grows from line to line, and each time all of it is read.
    for _ in 0..25 {
        let line = lines.next().unwrap().unwrap();
        let contents = store.read().unwrap();
        let numbers: Vec<_> = contents
            .records
            .iter()
            .map(|e| e.stamp().sequence)
            .collect();
        assert_eq!(numbers, (0..numbers.len() as u64).collect::<Vec<_>>());
        assert!(numbers.len() >= before);
        before = numbers.len();
        if let Some(number) = line.strip_prefix("stored ") {
            assert!(numbers.contains(&number.parse().unwrap()));
        }
    }
    child.kill().unwrap();
    child.wait().unwrap();
}
