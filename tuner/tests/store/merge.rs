//! Merging is a union of sets, in memory and on the disk.

use std::fs;

use proptest::prelude::*;
use raywright_tuner::store::{Changed, LogFile, Note, Records, Store};

use crate::common::{all_of, fill, header, id, machine, put, record, scene, store, trial, writer};

/// Records of three writers as bits of a number; the same bit is the same record. The upper two
/// bits make the records of writer `c` contradict.
fn records_of(choice: u32) -> Records {
    let mut bytes = header(1);
    for (index, writer) in ["a", "b", "c"].iter().enumerate() {
        let text = if *writer == "c" { choice >> 12 } else { 0 };
        for sequence in (0..4).filter(|bit| choice >> (4 * index + bit) & 1 == 1) {
            let json = serde_json::json!({
                "writer": writer, "sequence": sequence, "time": 0, "text": text.to_string(),
            });
            bytes.extend(record(7, &json.to_string()));
        }
    }
    let (_folder, store) = store();
    let log = LogFile::read(&put(&store, &bytes)).unwrap();
    let mut records = Records::default();
    records.add(log);
    assert_eq!(records.len(), (choice & 0xfff).count_ones() as usize);
    records
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn merge_is_a_union(a in 0u32..1 << 14, b in 0u32..1 << 14, c in 0u32..1 << 14) {
        let [a, b, c] = [a, b, c].map(records_of);
        let ab = a.clone().merge(b.clone());
        prop_assert_eq!(&ab, &b.clone().merge(a.clone()));
        prop_assert_eq!(
            ab.clone().merge(c.clone()),
            a.clone().merge(b.clone().merge(c.clone()))
        );
        prop_assert_eq!(&a.clone().merge(a.clone()), &a);
        prop_assert_eq!(&ab.clone().merge(b.clone()), &ab);
        for entry in a.iter() {
            prop_assert!(ab.get(entry.stamp()).is_some());
        }
    }
}

/// Names and bytes of all logs.
fn files(store: &Store) -> Vec<(String, Vec<u8>)> {
    let items = fs::read_dir(store.folder()).unwrap().map(Result::unwrap);
    let mut files: Vec<_> = items
        .filter(|item| item.path().extension().is_some_and(|end| end == "log"))
        .map(|item| {
            (
                item.file_name().into_string().unwrap(),
                fs::read(item.path()).unwrap(),
            )
        })
        .collect();
    files.sort();
    files
}

#[test]
fn folders_merge_in_any_order() {
    let (_one, one) = store();
    fill(&mut writer(&one, "a"), 3);
    let (_two, two) = store();
    fill(&mut writer(&two, "b"), 2);
    // A copy of `a` that was written on.
    fs::copy(one.log_of(&id("a")), two.log_of(&id("a"))).unwrap();
    trial(&mut writer(&two, "a"), &machine("one"), &scene("hall"), 9.0);

    let (_left, left) = store();
    left.import(&one.read().unwrap().records).unwrap();
    left.import(&two.read().unwrap().records).unwrap();
    let (_right, right) = store();
    right.import(&two.read().unwrap().records).unwrap();
    right.import(&one.read().unwrap().records).unwrap();
    assert_eq!(files(&left), files(&right));
    let again = left.import(&two.read().unwrap().records).unwrap();
    assert_eq!(again, Changed::default());
    let records = left.read().unwrap().records;
    assert_eq!(records.conflicts().count(), 0);
    assert_eq!(records.outcomes(&all_of(&machine("one"))).len(), 6);
    assert!(left.fsck().unwrap().is_clean());
}

#[test]
fn merging_into_damage_does_not_free_its_numbers() {
    let (_one, one) = store();
    fill(&mut writer(&one, "a"), 1);
    let early = one.read().unwrap().records;
    let seen = writer(&one, "a").append(0.0, Note::new("seen")).unwrap();
    let mut bytes = fs::read(one.log_of(&id("a"))).unwrap();
    bytes.pop();
    bytes[100] ^= 1;
    let (_two, two) = store();
    put(&two, &bytes);
    assert_eq!(two.read().unwrap().records.len(), early.len() - 1);
    // The damaged folder gets back what it lost in the middle, but not the end.
    two.import(&early).unwrap();
    assert_eq!(two.read().unwrap().records.len(), early.len());
    let next = writer(&two, "a").append(0.0, Note::new("on")).unwrap();
    assert!(next.sequence > seen.sequence);
    assert!(two.fsck().unwrap().is_clean());
}

#[test]
fn two_continuations_of_one_log_are_a_conflict() {
    let (_one, one) = store();
    fill(&mut writer(&one, "a"), 1);
    let (_two, two) = store();
    fs::copy(one.log_of(&id("a")), two.log_of(&id("a"))).unwrap();
    let stamp = writer(&one, "a").append(0.0, Note::new("left")).unwrap();
    assert_eq!(
        writer(&two, "a").append(0.0, Note::new("right")).unwrap(),
        stamp
    );
    let (one, two) = (one.read().unwrap().records, two.read().unwrap().records);
    let merged = one.clone().merge(two.clone());
    assert_eq!(merged, two.merge(one));
    assert_eq!(merged.conflicts().collect::<Vec<_>>(), [&stamp]);
}

#[test]
fn pruning_removes_one_machine_and_no_number_comes_twice() {
    let (_folder, store) = store();
    let (one, other) = (machine("one"), machine("other"));
    let mut log = writer(&store, "a");
    trial(&mut log, &other, &scene("hall"), 1.0);
    log.append(1.0, one.clone()).unwrap();
    let last = trial(&mut log, &one, &scene("hall"), 2.0);
    drop(log);
    fill(&mut writer(&store, "b"), 0);

    let changed = store.prune(&one.id, 2e9).unwrap();
    assert_eq!((changed.files, changed.removed), (2, 4));
    let records = store.read().unwrap().records;
    assert!(records.outcomes(&all_of(&one)).is_empty());
    assert!(records.machine(&one.id).is_none());
    assert_eq!(records.outcomes(&all_of(&other)).len(), 1);
    let stamp = writer(&store, "a").append(3.0, Note::new("on")).unwrap();
    assert!(stamp.sequence > last.sequence);
    assert_eq!(store.prune(&one.id, 2e9).unwrap(), Changed::default());
    assert!(store.prune(&one.id, f64::NAN).is_err());
}
