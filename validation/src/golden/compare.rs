//! A golden line against our builder.

use raywright_bvh::{BuildParams, BuildPrimitive, BuildWorkspace, Hierarchy, Quality, Rounding};

use super::{Expected, Figures, GoldenQuality, Line, has_golden_reciprocal};
use crate::{tree::Tree, triangles::TriangleSet};

/// What came of a line.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// The same tree in the same order, or refused as Embree refuses it.
    Equal,
    /// The same number of references, where more cannot be asked (`tbb_sort`).
    EqualReferences,
    /// The same tree but for the order of children or of primitives.
    Unordered,
    /// Another tree, or only one of both refused; with what differs.
    Different(String),
    /// Not compared; with the reason.
    Skipped(String),
}

/// Our parameters for the arguments of a line. Embree takes a branching factor of 0 or 1 for 2 and
/// leaves of at least 0 for 1 (with a branching factor of 2); ours refuses them.
///
/// # Errors
/// If no split budget stands for the capacity: above 8 references per primitive.
pub fn parameters(line: &Line) -> Result<BuildParams, String> {
    let mut params = BuildParams::embree_api_default();
    params.quality = match line.quality {
        GoldenQuality::Low => Quality::Morton,
        GoldenQuality::Medium => Quality::BinnedSah,
        GoldenQuality::High => Quality::SpatialSplits,
    };
    params.branching_factor = line.branching.max(2);
    params.max_depth = line.max_depth;
    params.sah_block_size = line.block_size;
    params.min_leaf_size = line.min_leaf.max(1);
    params.max_leaf_size = line.max_leaf;
    params.traversal_cost = line.traversal_cost;
    params.intersection_cost = line.intersection_cost;
    params.rounding = Rounding::Embree;
    params.split_budget = split_budget(line.capacity, line.n)
        .ok_or_else(|| format!("no split budget gives {} of {}", line.capacity, line.n))?;
    Ok(params)
}

/// A budget per primitive whose product with `n`, rounded down, is `capacity`: the middle of such
/// budgets, or the least where the middle is more than the 8 that are allowed.
#[must_use]
pub fn split_budget(capacity: usize, n: usize) -> Option<f32> {
    let middle = ((capacity as f64 + 0.5) / n as f64) as f32;
    let least = (capacity as f64 / n as f64) as f32;
    [middle, least]
        .into_iter()
        .find(|&budget| budget <= 8.0 && (f64::from(budget) * n as f64).floor() == capacity as f64)
}

/// Our tree over a set; the message of our error if there is none.
///
/// # Errors
/// What the builder refuses.
pub fn build(
    set: &TriangleSet,
    primitives: &[BuildPrimitive],
    params: &BuildParams,
    workspace: &mut BuildWorkspace,
) -> Result<Tree, String> {
    let corners = |reference| set.corners(reference);
    Hierarchy::build(primitives, Some(&corners), params, workspace)
        .map(|hierarchy| Tree::of(&hierarchy))
        .map_err(|error| error.to_string())
}

/// Compares a line with our builder. The second value is our tree if one was built.
#[must_use]
pub fn compare(
    line: &Line,
    set: &TriangleSet,
    primitives: &[BuildPrimitive],
    workspace: &mut BuildWorkspace,
) -> (Outcome, Option<Tree>) {
    if set.triangles.len() != line.n {
        let what = format!("{} triangles, expected {}", set.triangles.len(), line.n);
        return (Outcome::Different(what), None);
    }
    if line.needs.iter().any(|need| need == "rcp") && !has_golden_reciprocal() {
        let why = "this processor's reciprocal estimate is not that of the golden machine (rcp)";
        return (Outcome::Skipped(why.into()), None);
    }
    let params = match parameters(line) {
        Ok(params) => params,
        Err(what) => return (Outcome::Different(what), None),
    };
    let ours = build(set, primitives, &params, workspace);
    let outcome = match (&line.expected, &ours) {
        (Expected::Error { .. }, Err(_)) => Outcome::Equal,
        (Expected::Error { error }, Ok(_)) => {
            Outcome::Different(format!("a tree, expected Embree's error {error}"))
        }
        (Expected::Tree(_), Err(error)) => {
            Outcome::Different(format!("refused ({error}), expected a tree"))
        }
        (Expected::Tree(expected), Ok(tree)) => {
            let got = Figures::of(tree, &set.bounds(), params.sah_block_size);
            judge(&got, expected, line.tbb_sort)
        }
    };
    (outcome, ours.ok())
}

fn judge(got: &Figures, expected: &Figures, tbb_sort: bool) -> Outcome {
    if tbb_sort {
        return if got.refs == expected.refs {
            Outcome::EqualReferences
        } else {
            Outcome::Different(format!("refs {}, expected {}", got.refs, expected.refs))
        };
    }
    let differences = got.differences(expected);
    if !differences.is_empty() {
        return Outcome::Different(differences.join("; "));
    }
    if got.hash == expected.hash {
        Outcome::Equal
    } else if got.hash_unordered == expected.hash_unordered {
        Outcome::Unordered
    } else {
        Outcome::Different("hashes; all counts and costs agree".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn split_budgets_land_on_the_capacity() {
        for n in [1, 2, 7, 33, 1000, 262_205, 331_179] {
            for factor in [1.0, 1.049, 1.2, 1.5, 2.0, 3.0, 4.0, 8.0] {
                let capacity = (n as f64 * factor) as usize;
                let budget = split_budget(capacity, n).expect("a budget");
                assert_eq!((f64::from(budget) * n as f64) as usize, capacity);
            }
        }
        assert_eq!(split_budget(90, 10), None);
    }

    #[test]
    fn outcomes_tell_order_from_shape() {
        let expected = Figures {
            refs: 3,
            hash: 1,
            hash_unordered: 2,
            ..Figures::default()
        };
        assert_eq!(judge(&expected, &expected, false), Outcome::Equal);
        let mut got = expected.clone();
        got.hash = 5;
        assert_eq!(judge(&got, &expected, false), Outcome::Unordered);
        got.hash_unordered = 5;
        assert!(matches!(
            judge(&got, &expected, false),
            Outcome::Different(_)
        ));
        assert_eq!(judge(&got, &expected, true), Outcome::EqualReferences);
        got.refs = 4;
        assert!(matches!(
            judge(&got, &expected, true),
            Outcome::Different(_)
        ));
    }
}
