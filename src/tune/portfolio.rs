//! Parameters that are good somewhere: what to try first in a scene that is not known.
//!
//! They are the greedy cover (Nemhauser, Wolsey & Fisher, 1978) of our recordings of six scenes with three cameras
//! each and 300 configurations, in round numbers; for rendering alone, for building and rendering, in turns; and
//! trees of sixteen children, by runs on real frames, one of them in place of the cover's optimised tree.
//! Of covers chosen without a scene, the best of three is within 0.6 % of the second best of that scene's table in render
//! time, and within 1.2 % with builds; the default alone within 12 and 16 %.

use raywright_bvh::{BuildParams, Quality};

use super::{Metric, SpaceAxes};

/// A tree that serves fewer frames than this is to be built in a hurry.
const FEW_FRAMES: u32 = 10;

/// Parameters to begin with, the most useful first: `base`, which is the default as a rule, and changes of it
/// that pay in some scenes, by how many frames a tree serves, and which axes there are.
#[must_use]
pub fn portfolio(base: &BuildParams, metric: Metric, axes: SpaceAxes) -> Vec<BuildParams> {
    let with = |quality, branching_factor, leaf_sizes: [u32; 2], rotations| {
        let mut params = *base;
        params.quality = quality;
        params.branching_factor = branching_factor;
        [params.min_leaf_size, params.max_leaf_size] = leaf_sizes;
        params.rotations = rotations;
        params
    };
    let with_costs = |mut params: BuildParams, sah_block_size, intersection_cost| {
        params.sah_block_size = sah_block_size;
        (params.traversal_cost, params.intersection_cost) = (1.0, intersection_cost);
        params
    };
    let wide = with_costs(with(Quality::Agglomerative, 16, [2, 14], 4), 1, 0.05);
    // Hardly any random configuration of the recordings is like it, and it takes no longer to build than the default.
    let sixteen = with_costs(with(Quality::BinnedSah, 16, [4, 28], 0), 4, 0.5);
    let few_frames = metric
        .frames_per_tree()
        .is_some_and(|n| n.get() < FEW_FRAMES);
    if few_frames {
        vec![
            *base,
            sixteen,
            with_costs(with(Quality::Agglomerative, 16, [20, 31], 5), 1, 0.5),
            with(Quality::Morton, 8, [24, 32], 8),
            wide,
        ]
    } else if axes == SpaceAxes::Eleven {
        // Of Embree's qualities there is but one above the default.
        let mut splits = *base;
        splits.quality = Quality::SpatialSplits;
        vec![*base, splits]
    } else {
        // Younger than the recordings.
        let costs = BuildParams::least_cost(16);
        let leaf_sizes = [costs.min_leaf_size, costs.max_leaf_size];
        let least_cost = |quality| {
            let params = with(quality, costs.branching_factor, leaf_sizes, 0);
            with_costs(params, costs.sah_block_size, costs.intersection_cost)
        };
        let mut collapsed = least_cost(Quality::BinnedSah);
        collapsed.collapse = costs.collapse;
        // The cheap ones first: what is too dear now makes all others wait.
        vec![
            *base,
            sixteen,
            collapsed,
            least_cost(Quality::Optimized),
            with(Quality::Optimized, 8, [12, 32], 5),
            wide,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_are_valid_and_different() {
        for axes in [SpaceAxes::Canonical, SpaceAxes::Eleven] {
            for metric in [Metric::Render, Metric::Total] {
                let all = portfolio(&BuildParams::default(), metric, axes);
                assert_eq!(all[0], BuildParams::default());
                assert!(all.len() >= 2);
                for (index, params) in all.iter().enumerate() {
                    assert_eq!(params.validate(), Ok(()));
                    assert!(!all[..index].contains(params));
                }
            }
        }
    }
}
