//! Tuned parameters beside fixed baselines, measured in turns.
//!
//! Every round builds and renders each row once, beginning with another row each time, and every other round in
//! reverse, so that after six rounds a drift of the machine and what a row leaves in caches and memory have
//! fallen on all alike. All rows render the same samples. A figure is a ratio within a round.

use std::time::Duration;

use raywright_bvh::BuildParams;
use raywright_imaging::CancelToken;

use super::stage::{Clock, FrameTimes, Rendered, SessionError, Stage};

/// A fixed configuration to compare with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Baseline {
    /// The default column of the paper's Table 1, which is Embree's builder interface: weak.
    TableOneDefault,
    /// What Embree uses for its own scenes: strong.
    EmbreeScene,
}

impl Baseline {
    /// Both.
    pub const ALL: [Self; 2] = [Self::TableOneDefault, Self::EmbreeScene];

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::TableOneDefault => "Table 1's default",
            Self::EmbreeScene => "Embree's scene setting",
        }
    }

    /// Its parameters.
    #[must_use]
    pub fn params(self) -> BuildParams {
        match self {
            Self::TableOneDefault => BuildParams::embree_api_default(),
            Self::EmbreeScene => BuildParams::embree_scene_medium(),
        }
    }
}

/// One row of a comparison.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// `tuned`, or the name of the baseline.
    pub name: &'static str,
    /// Its parameters.
    pub params: BuildParams,
    /// What each round took.
    pub rounds: Vec<FrameTimes>,
}

/// All rows, the tuned one first; each has the same number of rounds.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The rows.
    pub rows: Vec<Measurement>,
}

/// The rows of a round in their turns: in any two rounds each row follows those that it precedes.
fn order(round: usize, rows: usize) -> impl Iterator<Item = usize> {
    (0..rows).map(move |turn| {
        let turn = if round.is_multiple_of(2) {
            turn
        } else {
            rows - 1 - turn
        };
        (round / 2 + turn) % rows
    })
}

impl<C: Clock> Stage<'_, C> {
    /// Measures `tuned` beside both baselines; see [`Session::compare`](super::Session::compare).
    pub(super) fn compare(
        &mut self,
        tuned: &BuildParams,
        rounds: usize,
        cancel: &CancelToken,
        progress: impl Fn(usize, usize),
    ) -> Result<Comparison, SessionError> {
        let mut rows = vec![Measurement {
            name: "tuned",
            params: *tuned,
            rounds: vec![],
        }];
        rows.extend(Baseline::ALL.map(|baseline| Measurement {
            name: baseline.name(),
            params: baseline.params(),
            rounds: vec![],
        }));
        for round in 0..=rounds {
            progress(round, rounds + 1);
            let mut times: Vec<Option<FrameTimes>> = vec![None; rows.len()];
            for row in order(round, rows.len()) {
                let (tree, build) = self.build(&rows[row].params).map_err(SessionError::Build)?;
                let rendered = self.render(&tree, round as u32, Duration::MAX, cancel)?;
                self.recycle(tree);
                let Rendered::Finished { time: render, .. } = rendered else {
                    return Ok(Comparison { rows });
                };
                times[row] = Some(FrameTimes { build, render });
            }
            if round > 0 {
                for (row, times) in rows.iter_mut().zip(times) {
                    row.rounds.extend(times);
                }
            }
        }
        Ok(Comparison { rows })
    }
}

impl Measurement {
    /// The cost of each round, in milliseconds.
    #[must_use]
    pub fn costs_ms(&self, metric: super::Metric) -> Vec<f64> {
        self.rounds
            .iter()
            .map(|times| times.cost(metric) * 1e3)
            .collect()
    }
}

/// A duration in milliseconds.
#[must_use]
pub fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_behind_and_before_every_other_alike() {
        let mut pairs = [[0; 3]; 3];
        for round in 0..6 {
            let order: Vec<usize> = order(round, 3).collect();
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2]);
            for pair in order.windows(2) {
                pairs[pair[0]][pair[1]] += 1;
            }
        }
        assert_eq!(pairs, [[0, 2, 2], [2, 0, 2], [2, 2, 0]]);
    }
}
