//! The crate tpe (tree-structured Parzen estimators) as a search: an optimizer for each axis.

use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};
use raywright_tuner::{Estimate, Proposal, Search};
use tpe::{TpeOptimizer, parzen_estimator, range};

use super::FAILURE;

pub(super) const NAME: &str = "tpe";

#[derive(Debug, Default)]
pub(crate) struct Tpe {
    axes: Vec<TpeOptimizer>,
    stream: Option<Xoshiro256PlusPlus>,
}

impl Search for Tpe {
    fn name(&self) -> &'static str {
        NAME
    }

    fn begin(&mut self, steps: &[f64], seed: u64) {
        let axis = || TpeOptimizer::new(parzen_estimator(), range(0.0, 1.0).expect("a range"));
        self.axes = steps.iter().map(|_| axis()).collect();
        self.stream = Some(Xoshiro256PlusPlus::seed_from_u64(seed));
    }

    fn propose(&mut self, _ticket: u64) -> Proposal {
        let stream = self.stream.as_mut().expect("it has begun");
        let point = self
            .axes
            .iter_mut()
            .map(|axis| axis.ask(stream).expect("a number"));
        Proposal {
            point: point.collect(),
            samples: 1,
            step: "ask",
        }
    }

    fn observe(&mut self, _ticket: Option<u64>, point: &[f64], estimate: Estimate) {
        let cost = estimate.mean.min(FAILURE);
        for (axis, x) in self.axes.iter_mut().zip(point) {
            // Its range has no end.
            axis.tell(x.min(1.0_f64.next_down()), cost)
                .expect("numbers");
        }
    }

    fn withdraw(&mut self, _ticket: u64) {}
}
