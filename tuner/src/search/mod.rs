//! Searches: where in the unit cube to look next.
//!
//! A search is a strategy behind [`Tuner`](crate::Tuner). It sees points and costs, never
//! parameters: ranges, constraints, conditions, duplicates and failures are settled by the tuner.
//! Every search passes [`conformance::check`](crate::conformance::check).

mod gaussian_process;
pub(crate) mod latin_hypercube;
mod nelder_mead;
mod random;

use std::fmt::Debug;

pub use gaussian_process::GaussianProcess;
pub use nelder_mead::LatinHypercubeNelderMead;
pub use random::Random;

/// Where a search wants to look.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// One coordinate in `[0, 1]` per axis.
    pub point: Vec<f64>,
    /// Number of measurements the search wants in the mean at this point, at least 1. A point whose
    /// configuration has as many is answered without a trial.
    pub samples: usize,
    /// Name of the move, for reports: `"reflect"`.
    pub step: &'static str,
}

/// What is known about a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Mean cost; infinite if the configuration failed.
    pub mean: f64,
    /// Number of measurements behind it.
    pub samples: usize,
    /// Standard deviation of one measurement, pooled over all configurations of the run that were
    /// measured more than once; 0 while there are none.
    pub noise: f64,
}

/// A strategy over the unit cube.
///
/// Contract, checked by the conformance suite:
///
/// - Everything a search does is a function of the arguments of its calls. No clock, no ambient
///   randomness, no state shared between instances.
/// - `propose` always returns, whatever was or was not observed: several proposals may be open, and
///   the observations come in any order or never.
/// - A ticket names a proposal. Of each ticket comes at most one of `observe` and `withdraw`.
pub trait Search: Debug + Send {
    /// The name under which [`search_by_name`] finds it.
    fn name(&self) -> &'static str;

    /// Starts over in a cube of `steps.len()` axes. `steps[i]` is the width of the narrowest bin of
    /// axis i: points nearer than that on all axes may be one configuration. 0 for a real axis.
    fn begin(&mut self, steps: &[f64], seed: u64);

    /// The next point. `ticket` will name it.
    fn propose(&mut self, ticket: u64) -> Proposal;

    /// An estimate at `point`: of the proposal `ticket`, or, without one, of a point that was tried
    /// for another reason (a given start, a replacement of a known configuration).
    fn observe(&mut self, ticket: Option<u64>, point: &[f64], estimate: Estimate);

    /// The proposal `ticket` will not be observed; the search may propose it again.
    fn withdraw(&mut self, ticket: u64);

    /// By which share of the least cost the last proposal is expected to be better, if the search has an idea
    /// of it: a search whose proposals promise nothing may end.
    fn expected_gain(&self) -> Option<f64> {
        None
    }
}

/// Names of all searches.
pub const SEARCH_NAMES: &[&str] = &[random::NAME, nelder_mead::NAME, gaussian_process::NAME];

/// The search with this name, `None` if there is none.
pub fn search_by_name(name: &str) -> Option<Box<dyn Search>> {
    match name {
        random::NAME => Some(Box::new(Random::new())),
        gaussian_process::NAME => Some(Box::new(GaussianProcess::new())),
        nelder_mead::NAME => Some(Box::new(LatinHypercubeNelderMead::new())),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_search_is_found_by_its_name() {
        for &name in SEARCH_NAMES {
            assert_eq!(search_by_name(name).unwrap().name(), name);
        }
        assert!(search_by_name("simulated-annealing").is_none());
    }

    #[test]
    fn every_search_conforms() {
        for &name in SEARCH_NAMES {
            crate::conformance::check(|| search_by_name(name).unwrap());
        }
    }
}
