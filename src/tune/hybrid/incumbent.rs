//! The tree that frames are rendered with, and what it costs over that of the first one.
//!
//! When a candidate is accepted its build was timed once, and of many candidates it is the one whose build
//! happened to be short that is accepted. Where trees are built again and again its cost is therefore
//! reckoned from all builds that it has had since, and by their median: one that was interrupted, or was the first
//! to touch its memory, may take four times as long, and whatever is beside it would seem better.

use raywright_bvh::{BuildParams, Bvh};
use raywright_tuner::Config;

use crate::tune::probe::{BUILD_DEVIATION, Costs, ProbeRatio};

/// Standard deviation of a normal distribution over its median distance from the middle.
const NORMAL: f64 = 1.4826;

/// The tree that frames are rendered with.
#[derive(Debug)]
pub(super) struct Incumbent {
    pub(super) config: Config,
    pub(super) params: BuildParams,
    pub(super) tree: Bvh,
    /// Seconds of each of its builds.
    builds: Vec<f64>,
    /// The logarithm of the cost of the one before over that of the first; and by what was sure of each step of
    /// this search.
    log_cost_before: f64,
    sure_before: f64,
    /// By what it was accepted.
    step: Option<Step>,
}

#[derive(Clone, Copy, Debug)]
struct Step {
    costs: Costs,
    ratio: ProbeRatio,
    /// The share of a build that a frame bears.
    build_share: f64,
}

impl Incumbent {
    /// The first one; its build took so many seconds.
    pub(super) fn first(config: Config, params: BuildParams, tree: Bvh, build: f64) -> Self {
        Self {
            config,
            params,
            tree,
            builds: vec![build],
            log_cost_before: 0.0,
            sure_before: 0.0,
            step: None,
        }
    }

    /// Another tree in its place, accepted by this ratio beside these costs; the tree that it had.
    pub(super) fn replace(
        &mut self,
        (config, params, tree, build): (Config, BuildParams, Bvh, f64),
        costs: Costs,
        ratio: ProbeRatio,
        build_share: f64,
    ) -> Bvh {
        (self.log_cost_before, self.sure_before) = (self.log_cost(), self.sure_log_cost());
        self.step = Some(Step {
            costs,
            ratio,
            build_share,
        });
        (self.config, self.params, self.builds) = (config, params, vec![build]);
        std::mem::replace(&mut self.tree, tree)
    }

    /// Its tree built anew in so many seconds; the one that it had.
    pub(super) fn rebuilt(&mut self, tree: Bvh, build: f64) -> Bvh {
        self.builds.push(build);
        std::mem::replace(&mut self.tree, tree)
    }

    /// The same over another scene: what was built before tells nothing of it.
    pub(super) fn moved(&mut self, tree: Bvh, build: f64) -> Bvh {
        self.begin_again();
        self.builds = vec![build];
        std::mem::replace(&mut self.tree, tree)
    }

    /// A new search, of which nothing is saved yet.
    pub(super) fn begin_again(&mut self) {
        (self.log_cost_before, self.sure_before) = (self.log_cost(), 0.0);
        self.step = None;
    }

    /// Seconds of its build: the median of all, the lower of two.
    pub(super) fn build(&self) -> f64 {
        lower_median(self.builds.clone())
    }

    /// The standard deviation of the time of one build, as a share of it.
    pub(super) fn build_deviation(&self) -> f64 {
        let middle = self.build();
        let off = self.builds.iter().map(|build| (build - middle).abs());
        let share = NORMAL * lower_median(off.collect()) / middle;
        // Nothing where builds take no time.
        BUILD_DEVIATION.max(share)
    }

    /// The logarithm of its cost over that of the first incumbent.
    pub(super) fn log_cost(&self) -> f64 {
        let step = self.step.map_or(0.0, |step| {
            let costs = self.costs_of(&step);
            costs.ratio(step.ratio.log.exp()).ln()
        });
        self.log_cost_before + step
    }

    /// The same over that of the first incumbent of this search by what is sure of each step: what was accepted
    /// seems better than it is, since others were not.
    pub(super) fn sure_log_cost(&self) -> f64 {
        let step = self.step.map_or(0.0, |step| {
            let [_, _, upper] = self.costs_of(&step).bounds(step.ratio);
            upper.ln().min(0.0)
        });
        self.sure_before + step
    }

    fn costs_of(&self, step: &Step) -> Costs {
        Costs {
            candidate_build: step.build_share * self.build(),
            ..step.costs
        }
    }
}

/// The middle of some values, the lower one of an even number; NaN of none.
fn lower_median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len().saturating_sub(1) / 2;
    values.get(middle).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use raywright_bvh::TriangleMesh;

    use super::*;
    use crate::tune::{ParameterSpace, SpaceAxes};

    fn tree() -> Bvh {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = TriangleMesh::new(corners.map(Into::into).to_vec(), vec![[0, 1, 2]]).unwrap();
        Bvh::build(&[&mesh], &BuildParams::default()).unwrap()
    }

    #[test]
    fn a_build_that_happened_to_be_short_is_no_gain() {
        let params = BuildParams::default();
        let space = ParameterSpace::new(&params, &[], SpaceAxes::Canonical).unwrap();
        let config = space.config(&params).unwrap();
        let mut incumbent = Incumbent::first(config.clone(), params, tree(), 0.4);
        let costs = Costs {
            render: 0.6,
            incumbent_build: 0.4,
            candidate_build: 0.3,
            build_deviation: BUILD_DEVIATION,
        };
        let ratio = ProbeRatio {
            log: 0.0,
            deviation: 0.003,
            pairs: 100,
        };
        incumbent.replace((config.clone(), params, tree(), 0.3), costs, ratio, 1.0);
        assert!((incumbent.log_cost() - 0.9_f64.ln()).abs() < 1e-12);
        let sure = incumbent.sure_log_cost();
        assert!(sure < -0.05 && sure > incumbent.log_cost(), "{sure}");
        for build in [0.41, 0.4, 0.4] {
            incumbent.rebuilt(tree(), build);
        }
        assert!(incumbent.log_cost().abs() < 1e-12, "{incumbent:?}");
        assert_eq!(incumbent.sure_log_cost(), 0.0);

        // What was saved before stays, and a new search begins with nothing.
        let faster = ProbeRatio {
            log: 0.5_f64.ln(),
            ..ratio
        };
        let costs = Costs {
            candidate_build: 0.4,
            ..costs
        };
        incumbent.replace((config, params, tree(), 0.4), costs, faster, 1.0);
        let cost = incumbent.log_cost();
        assert!((cost - 0.7_f64.ln()).abs() < 1e-12);
        assert!(incumbent.sure_log_cost() < -0.25);
        incumbent.begin_again();
        assert_eq!(
            (incumbent.log_cost(), incumbent.sure_log_cost()),
            (cost, 0.0)
        );
        incumbent.moved(tree(), 7.0);
        assert_eq!((incumbent.build(), incumbent.log_cost()), (7.0, cost));
    }
    #[test]
    fn a_build_that_was_interrupted_is_no_build() {
        let params = BuildParams::default();
        let space = ParameterSpace::new(&params, &[], SpaceAxes::Canonical).unwrap();
        let config = space.config(&params).unwrap();
        // Memory that is new.
        let mut incumbent = Incumbent::first(config, params, tree(), 0.123);
        incumbent.rebuilt(tree(), 0.035);
        assert_eq!(incumbent.build(), 0.035);
        for build in [0.036, 0.2, 0.034, 0.035] {
            incumbent.rebuilt(tree(), build);
        }
        assert_eq!(incumbent.build(), 0.035);
        assert_eq!(incumbent.build_deviation(), BUILD_DEVIATION);
        // Where they differ all the time, one tells little.
        for build in [0.028, 0.05, 0.026, 0.044, 0.043, 0.029, 0.048] {
            incumbent.rebuilt(tree(), build);
        }
        let deviation = incumbent.build_deviation();
        assert!((0.15..0.4).contains(&deviation), "{deviation}");
    }
}
