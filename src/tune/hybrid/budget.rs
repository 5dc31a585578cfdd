//! What trials may cost: builds and slower tiles are an investment, and most of what is tried is no better.
//!
//! Trials may take a share of all time, and from the beginning of a run as long as is usual; and half of what
//! the trees that were found have surely saved. A run that finds nothing so loses that share and no more, and
//! one that finds much may go on. Of the share what a search proposes may take three quarters: starts are known to pay
//! somewhere.
//!
//! What a trial will take is not known before: it is taken for a build, which depends on the quality most.
//!
//! Invariants: nothing is allowed that is expected to take more than what is left; a share of 0 allows what was
//! saved alone, an infinite one everything.

use std::collections::HashMap;

use raywright_bvh::Quality;

/// Frames that a run is taken to have at least.
const RUN_FRAMES: f64 = 120.0;

/// The part of the share that is left to what is no start.
const SEARCHING: f64 = 0.75;

/// The part of what was saved that trials may take.
const REINVESTED: f64 = 0.5;

/// What builds of a quality take beside that of the default parameters until one is timed: medians of our
/// recordings of six scenes, some 1,000 builds each.
const BUILD_FACTORS: [(Quality, f64); 5] = [
    (Quality::Morton, 0.45),
    (Quality::Agglomerative, 0.75),
    (Quality::BinnedSah, 1.0),
    (Quality::SpatialSplits, 2.3),
    (Quality::Optimized, 7.2),
];

/// What trials took and what they may take.
#[derive(Clone, Debug)]
pub(super) struct Budget {
    /// The share of all time that may be lost.
    pub(super) share: f64,
    /// Seconds of a frame that tries nothing, as of late.
    frame: f64,
    /// Seconds of all frames, what trials took of them, and what better trees saved.
    spent: f64,
    trials: f64,
    saved: f64,
    build_factors: HashMap<Quality, f64>,
}

impl Budget {
    pub(super) fn new(share: f64) -> Self {
        Self {
            share,
            frame: 0.0,
            spent: 0.0,
            trials: 0.0,
            saved: 0.0,
            build_factors: HashMap::from(BUILD_FACTORS),
        }
    }

    /// A new search, of which nothing is spent.
    pub(super) fn begin(&mut self) {
        (self.spent, self.trials, self.saved) = (0.0, 0.0, 0.0);
    }

    /// A frame that took `time` seconds where one that tries nothing takes `usual`, `lost` of them for a trial, and
    /// would have taken `saved` more by the tree of the beginning.
    pub(super) fn add_frame(&mut self, time: f64, usual: f64, lost: f64, saved: f64) {
        self.frame = usual;
        self.spent += time;
        self.trials += lost;
        self.saved += saved;
    }

    /// A build took `time` seconds where one of quality `own` takes `own_time`.
    pub(super) fn add_build(&mut self, quality: Quality, time: f64, own: Quality, own_time: f64) {
        let factor = self.factor(own) * time / own_time;
        if factor > 0.0 && factor.is_finite() {
            self.build_factors.insert(quality, factor);
        }
    }

    /// What a build is expected to take where one of quality `own` takes `own_time`.
    pub(super) fn expected_build(&self, quality: Quality, own: Quality, own_time: f64) -> f64 {
        own_time * self.factor(quality) / self.factor(own)
    }

    fn factor(&self, quality: Quality) -> f64 {
        self.build_factors.get(&quality).copied().unwrap_or(1.0)
    }

    /// Whether a trial may take so many seconds.
    pub(super) fn allows(&self, seconds: f64, is_start: bool) -> bool {
        let run = self.spent.max(RUN_FRAMES * self.frame);
        let share = if is_start {
            self.share
        } else {
            SEARCHING * self.share
        };
        share.is_infinite() || self.trials + seconds <= share * run + REINVESTED * self.saved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_a_run_and_of_what_was_saved() {
        let third = 1.0 / 3.0;
        let mut budget = Budget::new(0.02);
        budget.begin();
        budget.add_frame(third, third, 0.0, 0.0);
        assert!(budget.allows(0.8, true) && !budget.allows(0.81, true));
        assert!(budget.allows(0.6, false) && !budget.allows(0.61, false));
        budget.add_frame(1.0, third, 0.7, 0.0);
        assert!(budget.allows(0.09, true) && !budget.allows(0.11, true));
        // A better tree pays for more trials.
        for _ in 0..10 {
            budget.add_frame(0.4, third, 0.0, 0.1);
        }
        assert!(budget.allows(0.59, true) && !budget.allows(0.61, true));
        // And so does a long run.
        for _ in 0..1000 {
            budget.add_frame(0.4, third, 0.0, 0.0);
        }
        assert!(budget.allows(7.9, true) && !budget.allows(8.0, true));
        budget.begin();
        assert!(budget.allows(0.8, true) && !budget.allows(0.81, true));
    }

    #[test]
    fn nothing_and_everything() {
        let (mut none, mut all) = (Budget::new(0.0), Budget::new(f64::INFINITY));
        for budget in [&mut none, &mut all] {
            budget.begin();
            budget.add_frame(0.0, 0.0, 0.0, 0.0);
        }
        assert!(!none.allows(1e-9, true) && all.allows(1e9, true));
    }

    #[test]
    fn builds_are_expected_to_take_what_they_took() {
        let mut budget = Budget::new(0.1);
        let [binned, morton, optimized] = [Quality::BinnedSah, Quality::Morton, Quality::Optimized];
        assert!((budget.expected_build(optimized, binned, 0.02) - 0.144).abs() < 1e-12);
        budget.add_build(optimized, 0.3, binned, 0.02);
        assert!((budget.expected_build(optimized, binned, 0.02) - 0.3).abs() < 1e-12);
        // On a machine that is twice as slow.
        assert!((budget.expected_build(morton, optimized, 0.6) - 0.018).abs() < 1e-12);
        budget.add_build(morton, f64::NAN, binned, 0.02);
        budget.add_build(morton, 0.0, binned, 0.02);
        budget.add_build(morton, 1.0, binned, 0.0);
        assert!((budget.expected_build(morton, optimized, 0.6) - 0.018).abs() < 1e-12);
    }
}
