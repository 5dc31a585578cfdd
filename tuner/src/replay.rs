//! A recorded table in place of the machine: searches are compared in seconds, without one frame.
//!
//! A search may ask for any configuration; the recorded one that lies nearest in the unit cube and was
//! not used yet answers, and the tuner is told of that one ([`Tuner::tell_instead`]). So no cost is
//! invented: a model fitted to the table would promise optima that do not exist, and favour the searches
//! that are like it.
//!
//! Invariant: each row answers once; a row is used for its own configuration if that is asked for.

use crate::{Config, Outcome, Space, TellError, Told, Trial, Tuner};

/// Recorded configurations and how they ended.
#[derive(Clone, Debug)]
pub struct Pool {
    rows: Vec<Row>,
}

#[derive(Clone, Debug)]
struct Row {
    point: Vec<f64>,
    config: Config,
    outcome: Outcome,
    is_used: bool,
}

impl Pool {
    /// A pool of configurations of `space`, and their outcomes.
    #[must_use]
    pub fn new(space: &Space, rows: impl IntoIterator<Item = (Config, Outcome)>) -> Pool {
        let rows = rows.into_iter().map(|(config, outcome)| Row {
            point: space.encode(&config),
            config,
            outcome,
            is_used: false,
        });
        Pool {
            rows: rows.collect(),
        }
    }

    /// Rows that are left.
    #[must_use]
    pub fn left(&self) -> usize {
        self.rows.iter().filter(|row| !row.is_used).count()
    }

    /// Answers a trial by the nearest row that is left, and tells the tuner; `None` if none is left.
    ///
    /// # Errors
    /// As [`Tuner::tell`].
    pub fn answer(
        &mut self,
        tuner: &mut Tuner,
        trial: &Trial,
    ) -> Result<Option<(Outcome, Told)>, TellError> {
        let asked = tuner.space().encode(&trial.config);
        let distance = |row: &Row| -> f64 {
            let pairs = row.point.iter().zip(&asked);
            pairs.map(|(a, b)| (a - b) * (a - b)).sum()
        };
        let left = self.rows.iter_mut().filter(|row| !row.is_used);
        let Some(row) = left.min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
            return Ok(None);
        };
        row.is_used = true;
        let told = tuner.tell_instead(trial.id, &row.config, row.outcome.clone())?;
        Ok(Some((row.outcome.clone(), told)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Param, SEARCH_NAMES, Scale, Value, search_by_name};

    fn space() -> Space {
        Space::new(vec![
            Param::integer("a", 1..=8, Scale::Linear, ""),
            Param::real("b", 0.0..=1.0, Scale::Linear, ""),
        ])
        .unwrap()
    }

    fn pool(space: &Space) -> Pool {
        let rows = (1..=8).flat_map(|a| {
            (0..5).map(move |b| {
                let b = f64::from(b) * 0.25;
                let values = [("a", Value::Integer(a)), ("b", Value::Real(b))];
                let cost = 1.0 + (a as f64 - 3.0).abs() + b;
                (values, cost)
            })
        });
        let rows = rows.map(|(values, cost)| {
            let config = space.config(&values).unwrap();
            let outcome = if cost > 5.0 {
                Outcome::Failed {
                    reason: "too far".into(),
                }
            } else {
                Outcome::Done { cost }
            };
            (config, outcome)
        });
        Pool::new(space, rows.collect::<Vec<_>>())
    }

    #[test]
    fn every_row_answers_once_and_the_tuner_knows_rows_only() {
        for name in SEARCH_NAMES {
            let space = space();
            let mut pool = pool(&space);
            let mut tuner = Tuner::new(space, search_by_name(name).unwrap(), 5);
            for left in (0..40).rev() {
                let trial = tuner.ask();
                assert!(pool.answer(&mut tuner, &trial).unwrap().is_some());
                assert_eq!(pool.left(), left);
            }
            let trial = tuner.ask();
            assert!(pool.answer(&mut tuner, &trial).unwrap().is_none());
            assert_eq!(tuner.records().len(), 40, "{name}");
            assert_eq!(tuner.incumbent().unwrap().cost, 1.0);
        }
    }

    #[test]
    fn a_row_answers_for_its_own_configuration() {
        let space = space();
        let start = space
            .config(&[("a", Value::Integer(7)), ("b", Value::Real(0.5))])
            .unwrap();
        let mut pool = pool(&space);
        let search = search_by_name("random").unwrap();
        let mut tuner = Tuner::new(space, search, 5).with_start(start.clone());
        let trial = tuner.ask();
        pool.answer(&mut tuner, &trial).unwrap();
        assert_eq!(tuner.records()[0].config, start);
    }
}
