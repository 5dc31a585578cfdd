//! Tuned parameters beside fixed baselines, measured in turns.
//!
//! Every round builds and renders each row once, beginning with another row each time, so that a
//! drift of the machine falls on all alike. All rows render the same samples. A figure is a ratio
//! within a round.

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
            for turn in 0..rows.len() {
                let row = (round + turn) % rows.len();
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
