//! The printed space of the paper, and the canonical one: seven axes instead of eleven, in which what
//! builds the same tree is one point.

use raywright_tuner::{CanonRule, Config, Param, Scale, Space, SpaceError, Value};

use super::shared::TableRow;

/// Ratios of costs beyond which leaves are as small or as large as they may be.
const MOST_RATIO: f64 = 64.0;

const MAX_LEAF: i64 = 32;
const MAX_COST: f64 = 10.0;

/// A space that recorded rows have a place in. Here that of the shared tables is made; our own recordings
/// have the engine's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpaceKind {
    /// As printed, without what changes no tree of ours.
    Printed,
    /// What builds the same tree is one point.
    Canonical,
}

impl SpaceKind {
    pub(super) fn space(self) -> Result<Space, SpaceError> {
        let quality = Param::ordinal("quality", vec![1, 2, 3], "Builder.");
        let branching = Param::ordinal("branching", vec![2, 4, 8], "Children.");
        let max_depth = Param::integer("max_depth", 8..=64, Scale::Log, "Depth limit.");
        match self {
            Self::Printed => {
                let cost = |name| Param::real(name, 0.0..=MAX_COST, Scale::Linear, "Cost.");
                let leaf = |name| Param::integer(name, 1..=MAX_LEAF, Scale::Linear, "Leaf size.");
                Space::new(vec![
                    quality,
                    branching,
                    max_depth,
                    Param::integer("block", 1..=32, Scale::Linear, "Block size."),
                    leaf("min_leaf"),
                    leaf("max_leaf"),
                    cost("trav_cost"),
                    cost("int_cost"),
                ])?
                .with_at_most("min_leaf", "max_leaf")?
                .with_canon(CanonRule::FloorToPowerOfTwo("block".into()))?
                .with_canon(CanonRule::OnlyRatio {
                    numerator: "trav_cost".into(),
                    denominator: "int_cost".into(),
                })
            }
            Self::Canonical => Space::new(vec![
                quality,
                branching,
                max_depth,
                Param::ordinal("block", vec![1, 2, 4, 8, 16, 32], "Block size.")
                    .active_if("quality", [2, 3]),
                Param::integer("min_leaf", 1..=MAX_LEAF, Scale::Log, "Smallest leaf."),
                Param::real(
                    "leaf_ratio",
                    1.0..=32.0,
                    Scale::Log,
                    "Largest over smallest leaf.",
                )
                .active_if("quality", [2, 3]),
                Param::real(
                    "cost_ratio",
                    1.0 / MOST_RATIO..=MOST_RATIO,
                    Scale::Log,
                    "Cost of a block over that of a node.",
                )
                .active_if("quality", [2, 3]),
            ]),
        }
    }

    /// The configuration of a row.
    pub(super) fn config(self, space: &Space, row: &TableRow) -> Result<Config, SpaceError> {
        let (min_leaf, max_leaf) = (row.min_leaf.min(row.max_leaf), row.max_leaf);
        let mut values = vec![
            ("quality", Value::Integer(row.quality)),
            ("branching", Value::Integer(row.branching)),
            ("max_depth", Value::Integer(row.max_depth)),
            ("min_leaf", Value::Integer(min_leaf)),
        ];
        match self {
            Self::Printed => {
                // Only the ratio of the costs matters; some were measured beyond the printed range.
                let scale = (MAX_COST / row.trav_cost.max(row.int_cost)).min(1.0);
                values.extend([
                    ("block", Value::Integer(row.block)),
                    ("max_leaf", Value::Integer(max_leaf)),
                    ("trav_cost", Value::Real(scale * row.trav_cost)),
                    ("int_cost", Value::Real(scale * row.int_cost)),
                ]);
            }
            // A Morton build has no use for the others.
            Self::Canonical if row.quality == 1 => {}
            Self::Canonical => {
                let ratio = row.int_cost / row.trav_cost;
                let ratio = if ratio.is_nan() { 1.0 } else { ratio };
                let leaf_ratio = max_leaf as f64 / min_leaf as f64;
                values.extend([
                    ("block", Value::Integer(1 << row.block.ilog2())),
                    ("leaf_ratio", Value::Real(leaf_ratio.clamp(1.0, 32.0))),
                    (
                        "cost_ratio",
                        Value::Real(ratio.clamp(1.0 / MOST_RATIO, MOST_RATIO)),
                    ),
                ]);
            }
        }
        space.config(&values)
    }
}
