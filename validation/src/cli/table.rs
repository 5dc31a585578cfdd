//! Counts of outcomes, one row per quality, with the first difference of each row named.

use std::collections::BTreeMap;

use raywright_validation::golden::{GoldenQuality, Outcome};

/// The outcomes of one file.
#[derive(Debug, Default)]
pub(crate) struct Table {
    rows: BTreeMap<GoldenQuality, Row>,
}

#[derive(Debug, Default)]
struct Row {
    equal: usize,
    equal_references: usize,
    unordered: usize,
    different: usize,
    skipped: BTreeMap<String, usize>,
    /// The first line that is not equal: which, and how.
    first: Option<String>,
}

impl Table {
    /// Counts an outcome. `details` is asked once per row, for the first line that is not equal.
    pub(crate) fn add(
        &mut self,
        quality: GoldenQuality,
        name: &str,
        outcome: Outcome,
        details: impl FnOnce() -> Option<String>,
    ) {
        let row = self.rows.entry(quality).or_default();
        let what = match outcome {
            Outcome::Equal => {
                row.equal += 1;
                return;
            }
            Outcome::EqualReferences => {
                row.equal_references += 1;
                return;
            }
            Outcome::Skipped(why) => {
                *row.skipped.entry(why).or_default() += 1;
                return;
            }
            Outcome::Unordered => {
                row.unordered += 1;
                "only the order differs".to_owned()
            }
            Outcome::Different(what) => {
                row.different += 1;
                what
            }
        };
        row.first.get_or_insert_with(|| match details() {
            Some(details) => format!("{name}: {what}\n    {details}"),
            None => format!("{name}: {what}"),
        });
    }

    /// Whether a line differs, if only in order.
    pub(crate) fn differs(&self) -> bool {
        self.rows
            .values()
            .any(|row| row.unordered + row.different > 0)
    }

    /// Whether no line was counted.
    pub(crate) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Prints the rows under a title.
    pub(crate) fn print(&self, title: &str) {
        println!("\n{title}");
        if self.rows.is_empty() {
            println!("  no lines");
            return;
        }
        println!(
            "  {:<8}{:>8}{:>8}{:>12}{:>12}{:>11}{:>9}",
            "quality", "lines", "equal", "equal refs", "only order", "different", "skipped"
        );
        for (quality, row) in &self.rows {
            let skipped: usize = row.skipped.values().sum();
            let lines = row.equal + row.equal_references + row.unordered + row.different + skipped;
            println!(
                "  {:<8}{lines:>8}{:>8}{:>12}{:>12}{:>11}{skipped:>9}",
                quality.name(),
                row.equal,
                row.equal_references,
                row.unordered,
                row.different,
            );
        }
        for (quality, row) in &self.rows {
            if let Some(first) = &row.first {
                println!("  first difference of {}: {first}", quality.name());
            }
            for (why, count) in &row.skipped {
                println!("  skipped, {}: {count} lines, {why}", quality.name());
            }
        }
    }
}
