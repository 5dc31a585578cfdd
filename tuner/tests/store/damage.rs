//! Cut and flipped bytes: untouched records stay, touched ones are not believed.

use std::ops::Range;

use raywright_tuner::store::{DamagePlace, LogFile, StoreError, SyncPolicy};

use crate::common::{Numbers, fill, id, log_bytes, put, store, trial, writer};
use crate::common::{machine, scene};

/// Byte range and JSON text of every record of a file.
fn records(log: &LogFile) -> Vec<(Range<usize>, String)> {
    let ranged = log.records.iter().map(|record| {
        let start = record.offset as usize;
        let text = record.entry().expect("all records are stamped").json();
        (start..start + record.bytes as usize, text.to_owned())
    });
    ranged.collect()
}

/// Records and damage cover the file, apart from a good header.
fn assert_covered(log: &LogFile) {
    let good: u64 = log.records.iter().map(|record| record.bytes).sum();
    let bad: u64 = log.damage.iter().map(|damage| damage.bytes).sum();
    let header = if log.version.is_some() { 16 } else { 0 };
    assert_eq!(header + good + bad, log.bytes);
}

#[test]
fn cut_at_every_byte() {
    let whole = log_bytes(1);
    let (_folder, store) = store();
    let path = put(&store, &whole);
    let all = records(&LogFile::read(&path).unwrap());
    for cut in 0..whole.len() {
        put(&store, &whole[..cut]);
        let log = LogFile::read(&path).unwrap();
        assert_covered(&log);
        let left: Vec<_> = all
            .iter()
            .filter(|(range, _)| range.end <= cut)
            .cloned()
            .collect();
        assert_eq!(records(&log), left, "cut at {cut}");
        let is_boundary = cut == 0 || cut == 16 || all.iter().any(|(range, _)| range.end == cut);
        assert_eq!(log.damage.is_empty(), is_boundary, "cut at {cut}");

        // Opening a file forces it to the disk, which takes its time.
        let is_near = |end: usize| cut.abs_diff(end) < 4;
        if cut >= 20 && cut % 5 != 0 && !all.iter().any(|(range, _)| is_near(range.end)) {
            continue;
        }
        // The next writer goes on behind the last good record, with a number of its own.
        let mut writer = writer(&store, "a");
        let stamp = trial(&mut writer, &machine("one"), &scene("hall"), 1.0);
        drop(writer);
        let log = LogFile::read(&path).unwrap();
        assert!(log.damage.is_empty(), "cut at {cut}");
        assert_eq!(log.records.len(), left.len() + 2);
        let mut sequences: Vec<_> = log.entries().map(|entry| entry.stamp().sequence).collect();
        assert_eq!(sequences.last(), Some(&stamp.sequence));
        sequences.dedup();
        assert!(sequences.is_sorted() && sequences.len() == log.records.len());
    }
}

#[test]
fn random_cuts_and_flips() {
    let whole = log_bytes(15);
    let (_folder, store) = store();
    let path = put(&store, &whole);
    let all = records(&LogFile::read(&path).unwrap());
    let mut numbers = Numbers::new(4);
    let mut lost = 0;
    for round in 0..1000 {
        let mut flipped = whole.clone();
        for _ in 0..numbers.below(4) {
            flipped[numbers.below(whole.len())] ^= 1 << numbers.below(8);
        }
        // A part that is missing: in the middle, or up to the end.
        let start = numbers.below(whole.len());
        let removed = match numbers.below(3) {
            0 => 0..0,
            1 => start..whole.len(),
            _ => start..(start + numbers.below(300)).min(whole.len()),
        };
        let mut bytes = flipped.clone();
        bytes.drain(removed.clone());
        put(&store, &bytes);

        let is_touched = |range: &Range<usize>| {
            let is_cut = range.start.max(removed.start) < range.end.min(removed.end);
            is_cut || flipped[range.clone()] != whole[range.clone()]
        };
        let untouched: Vec<_> = all.iter().filter(|(range, _)| !is_touched(range)).collect();
        lost += all.len() - untouched.len();
        let log = LogFile::read(&path).unwrap();
        assert_covered(&log);
        let found: Vec<_> = records(&log).into_iter().map(|(_, text)| text).collect();
        let expected: Vec<_> = untouched.iter().map(|(_, text)| text.clone()).collect();
        assert_eq!(found, expected, "round {round}: {removed:?} removed");
        assert_eq!(store.read().unwrap().records.len(), expected.len());
    }
    assert!(
        lost > 3000,
        "the damage was too mild to say anything: {lost}"
    );
}

#[test]
fn damage_says_where_it_is() {
    let whole = log_bytes(2);
    let (_folder, store) = store();
    let path = put(&store, &whole);
    let all = records(&LogFile::read(&path).unwrap());
    let last = all.last().unwrap().0.clone();
    let mut bytes = whole.clone();
    bytes[3] ^= 1;
    bytes[all[2].0.start + 20] ^= 1;
    bytes[last.end - 1] ^= 1;
    put(&store, &bytes);
    let report = store.fsck().unwrap();
    assert!(!report.is_clean());
    let damage: Vec<_> = report.files[0].damage.iter().collect();
    let places: Vec<_> = damage.iter().map(|damage| damage.place).collect();
    assert_eq!(
        places,
        [DamagePlace::Head, DamagePlace::Middle, DamagePlace::Tail]
    );
    assert_eq!((damage[0].offset, damage[0].bytes), (0, 16));
    let middle = damage[1].offset as usize..(damage[1].offset + damage[1].bytes) as usize;
    assert_eq!(middle, all[2].0);
    assert_eq!(damage[2].offset as usize, last.start);

    // A writer leaves head and middle as they are, but cuts off the tail and does not use the
    // number of what was there.
    let mut writer = writer(&store, "a");
    assert_eq!(writer.recovered().len(), 3);
    let stamp = writer
        .append(0.0, raywright_tuner::store::Note::new("on"))
        .unwrap();
    assert!(stamp.sequence as usize >= all.len());
    drop(writer);
    assert_eq!(store.fsck().unwrap().files[0].damage.len(), 2);
    store.compact(0.0).unwrap();
    assert!(store.fsck().unwrap().is_clean());
    assert_eq!(LogFile::read(&path).unwrap().records.len(), all.len() - 1);
}

#[test]
fn compaction_keeps_the_numbers_of_a_lost_tail() {
    let mut bytes = log_bytes(2);
    let (_folder, store) = store();
    let path = put(&store, &bytes);
    let all = LogFile::read(&path).unwrap().records.len();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    put(&store, &bytes);
    assert!(store.compact(f64::NAN).is_err());
    assert_eq!(store.compact(0.0).unwrap().files, 1);
    assert!(store.fsck().unwrap().is_clean());
    let log = LogFile::read(&path).unwrap();
    assert_eq!(log.records.len(), all, "one is lost and a note was added");
    let numbers = log.entries().map(|entry| entry.stamp().sequence as usize);
    assert!(numbers.max().unwrap() >= all);
    assert_eq!(store.compact(0.0).unwrap().files, 0);
}

#[test]
fn noise_is_no_log_and_left_alone() {
    let (_folder, store) = store();
    let mut numbers = Numbers::new(5);
    for _ in 0..200 {
        let noise: Vec<u8> = (0..1 + numbers.below(400))
            .map(|_| numbers.below(256) as u8)
            .collect();
        let path = put(&store, &noise);
        assert!(LogFile::read(&path).unwrap().records.is_empty());
        let refused = store.writer(&id("a"), SyncPolicy::OnClose);
        let is_zero = noise.iter().all(|&byte| byte == 0);
        assert!(is_zero || matches!(refused, Err(StoreError::NotALog { .. })));
        store.compact(0.0).unwrap();
        assert!(is_zero || std::fs::read(&path).unwrap() == noise);
    }
}

#[test]
fn a_file_of_zeros_becomes_a_log() {
    let (_folder, store) = store();
    put(&store, &[0; 4096]);
    fill(&mut writer(&store, "a"), 1);
    assert!(store.fsck().unwrap().is_clean());
}
