//! Uniform random search: the yardstick every other search has to beat.
//!
//! Bergstra & Bengio, "Random Search for Hyper-Parameter Optimization", JMLR 2012: better than a
//! grid where few parameters matter. It learns nothing from costs.

use super::{Estimate, Proposal, Search};
use crate::rng::Stream;

pub(super) const NAME: &str = "random";

/// Independent uniform points.
#[derive(Clone, Debug)]
pub struct Random {
    dimensions: usize,
    stream: Stream,
}

impl Random {
    /// A search that waits for [`Search::begin`].
    pub fn new() -> Random {
        Random {
            dimensions: 0,
            stream: Stream::new(0),
        }
    }
}

impl Default for Random {
    fn default() -> Random {
        Random::new()
    }
}

impl Search for Random {
    fn name(&self) -> &'static str {
        NAME
    }

    fn begin(&mut self, steps: &[f64], seed: u64) {
        self.dimensions = steps.len();
        self.stream = Stream::new(seed);
    }

    fn propose(&mut self, _ticket: u64) -> Proposal {
        Proposal {
            point: self.stream.point(self.dimensions),
            samples: 1,
            step: "draw",
        }
    }

    fn observe(&mut self, _ticket: Option<u64>, _point: &[f64], _estimate: Estimate) {}

    fn withdraw(&mut self, _ticket: u64) {}
}
