//! Parameters that are good somewhere: what to try first in a scene that is not known.
//!
//! They are the greedy cover (Nemhauser, Wolsey & Fisher, 1978) of our recordings of six scenes with three cameras
//! each and 300 configurations, in round numbers; for rendering alone, for building and rendering, in turns; and
//! what is faster there than the default and takes no longer to build.
//! Chosen without a scene, the best of three is within 0.6 % of the second best of that scene's table in render
//! time, and within 1.2 % with builds; the default alone within 12 and 16 %.

use raywright_bvh::{BuildParams, Quality};

use super::Metric;

/// A tree that serves fewer frames than this is to be built in a hurry.
const FEW_FRAMES: u32 = 10;

/// Parameters to begin with, the most useful first: `base`, which is the default as a rule, and changes of it
/// that pay in some scenes, by how many frames a tree serves.
#[must_use]
pub fn portfolio(base: &BuildParams, metric: Metric) -> Vec<BuildParams> {
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
    // The best of the recordings among those that take no longer to build than the default, with 16 children and with 8.
    let sixteen = with_costs(with(Quality::BinnedSah, 16, [6, 32], 0), 16, 0.05);
    let eight = with_costs(with(Quality::BinnedSah, 8, [6, 32], 0), 4, 0.03);
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
            eight,
        ]
    } else {
        vec![
            *base,
            sixteen,
            // Before what takes seven times as long to build: what is too dear now makes all others wait.
            wide,
            with_costs(with(Quality::Optimized, 16, [10, 18], 6), 8, 0.1),
            with(Quality::Optimized, 8, [12, 32], 5),
            eight,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_are_valid_and_different() {
        for metric in [Metric::Render, Metric::Total] {
            let all = portfolio(&BuildParams::default(), metric);
            assert_eq!(all[0], BuildParams::default());
            for (index, params) in all.iter().enumerate() {
                assert_eq!(params.validate(), Ok(()));
                assert!(!all[..index].contains(params));
            }
        }
    }
}
