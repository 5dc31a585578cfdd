//! Records as text for other programs: a table, or one JSON object per line.

use std::collections::BTreeSet;
use std::io::{self, Write};

use super::Records;
use super::entry::kind_name;
use crate::Outcome;

const COLUMNS: [&str; 12] = [
    "writer",
    "sequence",
    "time",
    "trial_writer",
    "trial_sequence",
    "machine",
    "scene",
    "space",
    "reason",
    "outcome",
    "cost",
    "failure",
];

impl Records {
    /// Writes all outcomes that have a trial as CSV (RFC 4180, but lines end with a line feed):
    /// one row each, one column per parameter (`config.name`) and per measure (`measure.name`).
    /// Numbers are written so that reading them gives the same number. Times are seconds since
    /// 1970.
    ///
    /// # Errors
    ///
    /// Those of `out`.
    pub fn write_csv(&self, mut out: impl Write) -> io::Result<()> {
        let mut params = BTreeSet::new();
        let mut measures = BTreeSet::new();
        for (_, trial, outcome) in self.ended() {
            params.extend(trial.config.keys());
            measures.extend(outcome.measures.keys());
        }
        let mut row: Vec<String> = COLUMNS.map(String::from).to_vec();
        row.extend(params.iter().map(|name| format!("config.{name}")));
        row.extend(measures.iter().map(|name| format!("measure.{name}")));
        write_row(&mut out, &row)?;
        for (entry, trial, ended) in self.ended() {
            let (word, cost, failure) = match &ended.outcome {
                Outcome::Done { cost } => ("done", cost.to_string(), ""),
                Outcome::Failed { reason } => ("failed", String::new(), reason.as_str()),
                Outcome::Cancelled => ("cancelled", String::new(), ""),
            };
            let mut row = vec![
                entry.stamp().writer.to_string(),
                entry.stamp().sequence.to_string(),
                entry.time().to_string(),
                ended.trial.writer.to_string(),
                ended.trial.sequence.to_string(),
                trial.machine.to_string(),
                trial.scene.to_string(),
                trial.space.to_string(),
                trial.reason.clone(),
                word.to_owned(),
                cost,
                failure.to_owned(),
            ];
            for name in &params {
                let value = trial.config.get(*name);
                row.push(value.map(|value| value.to_string()).unwrap_or_default());
            }
            for name in &measures {
                let value = ended.measures.get(*name);
                row.push(value.map(|value| value.to_string()).unwrap_or_default());
            }
            write_row(&mut out, &row)?;
        }
        out.flush()
    }

    /// Writes every stamped record, of unknown kinds too, as one line
    /// `{"kind":6,"name":"outcome","record":{…}}`; the record is the stored text. `name` is `null`
    /// for unknown kinds.
    ///
    /// # Errors
    ///
    /// Those of `out`.
    pub fn write_json_lines(&self, mut out: impl Write) -> io::Result<()> {
        for entry in self.iter() {
            let name = match kind_name(entry.kind()) {
                Some(name) => format!("\"{name}\""),
                None => "null".to_owned(),
            };
            // In JSON a raw line break is white space between tokens and nothing else.
            let record = entry.json().replace(['\n', '\r'], " ");
            writeln!(
                out,
                "{{\"kind\":{},\"name\":{name},\"record\":{record}}}",
                entry.kind()
            )?;
        }
        out.flush()
    }
}

/// Writes one row; fields with special characters in quotes, quotes doubled.
fn write_row(out: &mut impl Write, row: &[String]) -> io::Result<()> {
    for (index, field) in row.iter().enumerate() {
        let gap = if index == 0 { "" } else { "," };
        if field.contains([',', '"', '\n', '\r']) {
            write!(out, "{gap}\"{}\"", field.replace('"', "\"\""))?;
        } else {
            write!(out, "{gap}{field}")?;
        }
    }
    writeln!(out)
}
