//! The axes of a search in which what builds the same tree is one point, and near points build similar
//! trees.
//!
//! | in the parameter table | here |
//! | --- | --- |
//! | traversal_cost, intersection_cost | cost_ratio, their ratio: the leaf rule knows no more |
//! | min_leaf_size, max_leaf_size | min_leaf_size by its logarithm, and leaf_size_ratio, from 1 on |
//! | sah_block_size | its power of two |
//! | max_depth | by its logarithm |
//! | branching_factor | 16 too, which has nodes of its own |
//!
//! Axes are active only where a builder reads them: a Morton build has no cost model, only one with spatial
//! splits has a budget, only Morton trees are rotated, and where there is one collapse there is no choice. A pair of which one is fixed keeps the axis of the
//! other from the table.
//!
//! Invariant: with [`parameters`] every configuration becomes valid parameters.

use raywright_bvh::{Parameter, ParameterRange};
use raywright_tuner::{Param, Scale, Value};

/// Ratio of the costs, and its inverse, beyond which nothing changes any more.
const MOST_COST_RATIO: f64 = 64.0;

/// Larger leaves are not searched, whatever the smallest.
const MOST_LEAF: u32 = 32;

/// What the paper has not: parameters, and among qualities all but these.
pub(super) const OURS: &[&str] = &[
    "split_budget",
    "rounding",
    "rotations",
    "collapse",
    "rays_in_flight",
    "ray_packets",
];
pub(super) const PAPER_QUALITIES: &[&str] = &["morton", "binned-sah", "spatial-splits"];

/// The axis that stands for a parameter of the table; `None`: the usual one.
pub(super) fn axis(parameter: &Parameter, is_searched: impl Fn(&str) -> bool) -> Option<Axis> {
    let doc = parameter.meaning;
    let integers = || match parameter.tuned {
        ParameterRange::Integers(min, max) => Some(i64::from(min)..=i64::from(max)),
        _ => None,
    };
    let param = match parameter.name {
        "branching_factor" => Param::ordinal(parameter.name, vec![2, 4, 8, 16], doc),
        "max_depth" | "min_leaf_size" => {
            Param::integer(parameter.name, integers()?, Scale::Log, doc)
        }
        "sah_block_size" => {
            let range = integers()?;
            let powers = (0..6).map(|power| 1 << power);
            Param::ordinal(
                parameter.name,
                powers.filter(|power| range.contains(power)).collect(),
                doc,
            )
        }
        "max_leaf_size" if is_searched("min_leaf_size") => {
            let most = *integers()?.end() as f64;
            let doc = "max_leaf_size over min_leaf_size";
            Param::real("leaf_size_ratio", 1.0..=most, Scale::Log, doc)
        }
        "intersection_cost" if is_searched("traversal_cost") => {
            let range = 1.0 / MOST_COST_RATIO..=MOST_COST_RATIO;
            let doc = "intersection_cost over traversal_cost";
            Param::real("cost_ratio", range, Scale::Log, doc)
        }
        "traversal_cost" if is_searched("intersection_cost") => return Some(Axis::None),
        _ => return None,
    };
    Some(Axis::Instead(param))
}

/// What takes the place of a parameter.
pub(super) enum Axis {
    /// Another one.
    Instead(Param),
    /// None: it is part of the axis of another parameter.
    None,
}

/// The qualities, by their words, for which a parameter is read; `None`: all.
pub(super) fn readers(name: &str) -> Option<&'static [&'static str]> {
    const WITH_COSTS: &[&str] = &["agglomerative", "binned-sah", "spatial-splits", "optimized"];
    match name {
        "sah_block_size" | "max_leaf_size" | "traversal_cost" | "intersection_cost" => {
            Some(WITH_COSTS)
        }
        "split_budget" => Some(&["spatial-splits", "optimized"]),
        "rotations" => Some(&["morton"]),
        "collapse" => Some(&["binned-sah", "spatial-splits"]),
        _ => None,
    }
}

/// The parameters that an axis of [`axis`] decides, with their values, given the smallest leaf; `None` if it
/// is one of the table.
pub(super) fn parameters(
    axis: &str,
    value: Value,
    min_leaf_size: u32,
) -> Option<Vec<(&'static str, String)>> {
    let Value::Real(ratio) = value else {
        return None;
    };
    match axis {
        "leaf_size_ratio" => {
            let size = (f64::from(min_leaf_size) * ratio).round() as u32;
            let size = size.min(MOST_LEAF).max(min_leaf_size);
            Some(vec![("max_leaf_size", size.to_string())])
        }
        "cost_ratio" => Some(vec![
            ("traversal_cost", "1".to_owned()),
            ("intersection_cost", (ratio as f32).to_string()),
        ]),
        _ => None,
    }
}
