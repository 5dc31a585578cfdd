//! What a run knows: one record per canonical configuration.
//!
//! Invariants: a record has at least one outcome; the incumbent has no failure and the least mean;
//! of equal means the older record is the incumbent.

use std::collections::HashMap;

use crate::search::Estimate;
use crate::{Config, TrialId};

/// All outcomes of one canonical configuration.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Record {
    /// The configuration as it was first told.
    pub config: Config,
    /// Its canonical form, the key.
    pub canonical: Config,
    /// Mean of `costs`; infinite if there are failures.
    pub cost: f64,
    /// Number of costs.
    pub n: usize,
    /// The costs in the order they were told.
    pub costs: Vec<f64>,
    /// Reasons of the failures in the order they were told.
    pub failures: Vec<String>,
    /// The first trial that was told.
    pub first_trial: TrialId,
}

impl Record {
    /// Whether any trial failed.
    pub fn has_failed(&self) -> bool {
        !self.failures.is_empty()
    }

    /// Sum of squared deviations of the costs from their mean.
    fn squared_deviations(&self) -> f64 {
        let mean = mean(&self.costs);
        self.costs.iter().map(|cost| (cost - mean).powi(2)).sum()
    }
}

/// Mean by updates, which cannot overflow where the sum would. 0 without values.
fn mean(values: &[f64]) -> f64 {
    let mut mean = 0.0;
    for (index, value) in values.iter().enumerate() {
        mean += (value - mean) / (index + 1) as f64;
    }
    mean
}

/// The records of a run.
#[derive(Debug, Default)]
pub(crate) struct Database {
    records: Vec<Record>,
    by_canonical: HashMap<Config, usize>,
    incumbent: Option<usize>,
    /// Over all records: sum of squared deviations, and degrees of freedom.
    squared_deviations: f64,
    freedom: usize,
}

impl Database {
    pub(crate) fn records(&self) -> &[Record] {
        &self.records
    }

    pub(crate) fn get(&self, canonical: &Config) -> Option<&Record> {
        Some(&self.records[*self.by_canonical.get(canonical)?])
    }

    pub(crate) fn has_failed(&self, canonical: &Config) -> bool {
        self.get(canonical).is_some_and(Record::has_failed)
    }

    pub(crate) fn incumbent(&self) -> Option<&Record> {
        Some(&self.records[self.incumbent?])
    }

    /// What a search may know about a record.
    pub(crate) fn estimate(&self, record: &Record) -> Estimate {
        let noise = match self.freedom {
            0 => 0.0,
            freedom => (self.squared_deviations / freedom as f64).sqrt(),
        };
        Estimate {
            mean: record.cost,
            samples: record.n + record.failures.len(),
            noise,
        }
    }

    /// Adds a cost, or the reason of a failure, of `config`.
    pub(crate) fn add(
        &mut self,
        trial: TrialId,
        config: &Config,
        canonical: &Config,
        outcome: Result<f64, String>,
    ) {
        let next = self.records.len();
        let index = *self.by_canonical.entry(canonical.clone()).or_insert(next);
        if index == next {
            self.records.push(Record {
                config: config.clone(),
                canonical: canonical.clone(),
                cost: f64::INFINITY,
                n: 0,
                costs: Vec::new(),
                failures: Vec::new(),
                first_trial: trial,
            });
        }
        let record = &mut self.records[index];
        match outcome {
            Ok(cost) => {
                let before = record.squared_deviations();
                record.costs.push(cost);
                self.squared_deviations += record.squared_deviations() - before;
                self.freedom += usize::from(record.n > 0);
                record.n += 1;
            }
            Err(reason) => record.failures.push(reason),
        }
        record.cost = if record.has_failed() {
            f64::INFINITY
        } else {
            mean(&record.costs)
        };
        self.incumbent = self.best();
    }

    /// Index of the best record. A mean can rise, so the former incumbent is no shortcut.
    fn best(&self) -> Option<usize> {
        let measured = self
            .records
            .iter()
            .enumerate()
            .filter(|(_, record)| !record.has_failed());
        let best = measured.min_by(|(_, a), (_, b)| {
            a.cost
                .total_cmp(&b.cost)
                .then(a.first_trial.cmp(&b.first_trial))
        });
        best.map(|(index, _)| index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_of_huge_costs_is_finite() {
        assert_eq!(mean(&[f64::MAX, f64::MAX, f64::MAX]), f64::MAX);
        assert_eq!(mean(&[1.0, 2.0, 6.0]), 3.0);
    }
}
