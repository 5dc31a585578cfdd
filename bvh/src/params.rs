//! The parameter space of a tree. Eleven parameters have the meaning that they have in Embree's
//! `RTCBuildArguments` and scene flags, after Table 1 of Herveau, Pfaffe, Tillmann, Tichy,
//! Dachsbacher, *Analysis of Acceleration Structure Parameters and Hybrid Autotuning for Ray
//! Tracing*.
//!
//! [`PARAMETERS`] is the one table of names, ranges and meanings: validation, command line and
//! tuner read it. Invariant: a value that has no meaning here is an error; no value is ever ignored.

use crate::{error::ParameterFault, traverse::stream::MAX_IN_FLIGHT};

/// How primitives are divided into subtrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Quality {
    /// Along a Morton curve: fastest to build, slow to trace. Block size and costs have no effect.
    Morton,
    /// Agglomeration of near clusters along a Morton curve: between Morton and binned SAH in time.
    /// Block size and costs decide which subtrees become leaves; primitives within `min_leaf_size`
    /// are united before all else, so that larger values build faster; levels are
    /// halved only where `max_depth` would else be exceeded; the split budget and the rounding have
    /// no effect. Not part of Embree.
    Agglomerative,
    /// Binned surface area heuristic.
    BinnedSah,
    /// Binned surface area heuristic that may cut primitives in two.
    SpatialSplits,
    /// Cut primitives, optimised by reinsertion and collapsed at least cost: slowest to build,
    /// fastest to trace. Not part of Embree.
    Optimized,
}

/// How nodes come to have more than two children, with binned SAH and spatial splits. (Morton trees have one way, the
/// other qualities are always collapsed at least cost.)
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Collapse {
    /// While the tree is built: the child with the largest box is divided until there are enough. What Embree does, and
    /// the faster build.
    LargestFirst,
    /// Afterwards, from a binary tree whose leaves have at most `min_leaf_size` primitives: the wide nodes and the leaves
    /// that cost least together. The faster tree.
    LeastCost,
}

/// Whose rounding the builder follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Rounding {
    /// True floors and true divisions, and a spatial split that leaves an empty side is not held
    /// against the primitive: what Embree's own scenes do.
    Exact,
    /// To the last bit that of Embree 4's builder interface (`rtcBuildBVH`), which is compiled for
    /// SSE2: for comparisons with it.
    Embree,
}

/// What a [`BuildWorkspace`](crate::BuildWorkspace) keeps for the next build.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Dynamics {
    /// The temporary memory is kept, and that of a recycled tree: it will be built again soon.
    Dynamic,
    /// The temporary memory is freed after the build (the paper's flag `static`), and so is the
    /// tree when it is given up.
    Static,
}

/// How a leaf stores its triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LeafFormat {
    /// One vertex and two edges of each triangle, ready for the intersection test.
    Edges,
    /// Vertex indices only: less memory, more work (the paper's flag `compact`).
    Compact,
}

/// Which triangle test is used. This is a choice of accuracy, not of speed alone: it can change
/// which primitive is hit at an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Accuracy {
    /// Möller–Trumbore on stored edges; a ray that meets a shared edge exactly may slip through.
    Fast,
    /// Watertight (the paper's flag `robust`).
    Robust,
}

/// How rays of a batch that are neighbours and go side by side are traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RayPackets {
    /// As all others.
    Off,
    /// Sixteen at a time where their directions have the same signs, for as long as they find the same nodes. It serves
    /// rays from one point or to one point, in an order in which neighbours are near each other.
    On,
}

/// The value of one parameter, whatever its kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterValue {
    /// A whole number.
    Integer(u32),
    /// A real number.
    Real(f32),
    /// One of a list of words.
    Choice(&'static str),
}

impl std::fmt::Display for ParameterValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Integer(v) => write!(f, "{v}"),
            Self::Real(v) => write!(f, "{v}"),
            Self::Choice(v) => f.write_str(v),
        }
    }
}

/// Which values a parameter may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterRange {
    /// All whole numbers from the first to the second, both included.
    Integers(u32, u32),
    /// Some whole numbers.
    OneOf(&'static [u32]),
    /// All finite reals from the first to the second, both included.
    Reals(f32, f32),
    /// Words.
    Words(&'static [&'static str]),
}

/// One row of the parameter table.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// The name: a field of [`BuildParams`].
    pub name: &'static str,
    /// The values that are allowed.
    pub range: ParameterRange,
    /// The values that a tuner searches: the range of the paper's Table 1 where it gives one.
    pub tuned: ParameterRange,
    /// Whether it changes what is hit and not only how fast; a tuner leaves such a parameter alone.
    pub changes_hits: bool,
    /// One sentence of meaning.
    pub meaning: &'static str,
}

/// The qualities, from the fastest build to the fastest trace.
const QUALITIES: [&str; 5] = [
    "morton",
    "agglomerative",
    "binned-sah",
    "spatial-splits",
    "optimized",
];

const COLLAPSES: [&str; 2] = ["largest-first", "least-cost"];

const COST_LIMIT: f32 = 1000.0;

/// The eleven parameters of the paper's Table 1 in its order, then those of this crate alone.
pub const PARAMETERS: [Parameter; 17] = [
    Parameter {
        name: "quality",
        range: ParameterRange::Words(&QUALITIES),
        tuned: ParameterRange::Words(&QUALITIES),
        changes_hits: false,
        meaning: "how primitives are divided into subtrees",
    },
    Parameter {
        name: "branching_factor",
        range: ParameterRange::Integers(2, 16),
        tuned: ParameterRange::OneOf(&[2, 4, 8]),
        changes_hits: false,
        meaning: "most children of a node",
    },
    Parameter {
        name: "max_depth",
        range: ParameterRange::Integers(1, 64),
        tuned: ParameterRange::Integers(8, 64),
        changes_hits: false,
        meaning: "deepest level, the root being level 1; the last 8 levels halve without a heuristic",
    },
    Parameter {
        name: "sah_block_size",
        range: ParameterRange::Integers(1, 32),
        tuned: ParameterRange::Integers(1, 32),
        changes_hits: false,
        meaning: "primitives that the cost model intersects at once; acts as the power of two below",
    },
    Parameter {
        name: "min_leaf_size",
        range: ParameterRange::Integers(1, 64),
        tuned: ParameterRange::Integers(1, 32),
        changes_hits: false,
        meaning: "so few primitives are never divided; at most max_leaf_size",
    },
    Parameter {
        name: "max_leaf_size",
        range: ParameterRange::Integers(1, 64),
        tuned: ParameterRange::Integers(1, 32),
        changes_hits: false,
        meaning: "more primitives are always divided",
    },
    Parameter {
        name: "traversal_cost",
        range: ParameterRange::Reals(0.0, COST_LIMIT),
        tuned: ParameterRange::Reals(0.0, 10.0),
        changes_hits: false,
        meaning: "cost of visiting a node in the cost model",
    },
    Parameter {
        name: "intersection_cost",
        range: ParameterRange::Reals(0.0, COST_LIMIT),
        tuned: ParameterRange::Reals(0.0, 10.0),
        changes_hits: false,
        meaning: "cost of intersecting a block of primitives in the cost model",
    },
    Parameter {
        name: "dynamics",
        range: ParameterRange::Words(&["dynamic", "static"]),
        tuned: ParameterRange::Words(&["dynamic", "static"]),
        changes_hits: false,
        meaning: "dynamic keeps the temporary memory of a build for the next one",
    },
    Parameter {
        name: "leaf_format",
        range: ParameterRange::Words(&["edges", "compact"]),
        tuned: ParameterRange::Words(&["edges", "compact"]),
        changes_hits: false,
        meaning: "compact stores vertex indices in place of edges",
    },
    Parameter {
        name: "accuracy",
        range: ParameterRange::Words(&["fast", "robust"]),
        tuned: ParameterRange::Words(&["fast", "robust"]),
        changes_hits: true,
        meaning: "robust is watertight at edges and vertices",
    },
    Parameter {
        name: "split_budget",
        range: ParameterRange::Reals(1.0, 8.0),
        tuned: ParameterRange::Reals(1.0, 2.0),
        changes_hits: false,
        meaning: "most references after spatial splits, relative to the number of primitives",
    },
    Parameter {
        name: "rounding",
        range: ParameterRange::Words(&["exact", "embree"]),
        tuned: ParameterRange::Words(&["exact"]),
        changes_hits: false,
        meaning: "embree follows the rounding of Embree's rtcBuildBVH to the last bit",
    },
    Parameter {
        name: "rotations",
        range: ParameterRange::Integers(0, 16),
        tuned: ParameterRange::Integers(0, 8),
        changes_hits: false,
        meaning: "most exchanges of subtrees below each node of a Morton tree; no effect on others",
    },
    Parameter {
        name: "collapse",
        range: ParameterRange::Words(&COLLAPSES),
        tuned: ParameterRange::Words(&COLLAPSES),
        changes_hits: false,
        meaning: "how binned-sah and spatial-splits make wide nodes: dividing the largest child, or from a binary tree",
    },
    Parameter {
        name: "rays_in_flight",
        range: ParameterRange::Integers(1, MAX_IN_FLIGHT as u32),
        // For whoever traces batches; the path tracer traces one ray at a time. (Paths in batches were slower on three
        // scenes out of three, by 2 to 15 %.)
        tuned: ParameterRange::OneOf(&[1]),
        changes_hits: false,
        meaning: "rays of a batch that a core traces in turns",
    },
    Parameter {
        name: "ray_packets",
        range: ParameterRange::Words(&["off", "on"]),
        tuned: ParameterRange::Words(&["off"]),
        changes_hits: false,
        meaning: "on traces neighbours in a batch together for as long as they find the same nodes",
    },
];

/// What a tree is built and traced with. Every combination of values either has a documented meaning or is an
/// error of [`BuildParams::validate`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct BuildParams {
    /// How primitives are divided into subtrees.
    pub quality: Quality,
    /// Most children of a node, 2..=16; fastest where it is the width of a node in memory: 2, 4,
    /// 8 or 16.
    pub branching_factor: u32,
    /// Deepest level of the tree, the root being level 1; 1..=64. The last 8 levels are a reserve
    /// in which ranges are halved without looking at costs; unless rounding is Embree's, halving
    /// begins earlier where more levels are needed for it.
    pub max_depth: u32,
    /// Primitives that the cost model intersects at once, 1..=32; acts as the power of two below.
    pub sah_block_size: u32,
    /// Ranges of so few primitives become leaves, 1..=64. Acts as at most `max_leaf_size`.
    pub min_leaf_size: u32,
    /// Ranges of more primitives never become leaves, 1..=64.
    pub max_leaf_size: u32,
    /// Cost of visiting a node, in the unit of `intersection_cost`; 0..=1000.
    pub traversal_cost: f32,
    /// Cost of intersecting a block of primitives; 0..=1000.
    pub intersection_cost: f32,
    /// What the workspace keeps for the next build.
    pub dynamics: Dynamics,
    /// How a leaf stores its triangles.
    pub leaf_format: LeafFormat,
    /// Which triangle test is used.
    pub accuracy: Accuracy,
    /// Most references that spatial splits may make, relative to the number of primitives; 1..=8.
    pub split_budget: f32,
    /// Whose rounding the builder follows.
    pub rounding: Rounding,
    /// Most exchanges of a child for a grandchild below each node, which make boxes smaller: more
    /// time to build, a tree that is faster to trace; 0..=16. Acts on Morton order alone. 1 is what
    /// Embree does in its own scenes with nodes of four.
    pub rotations: u32,
    /// How nodes come to have more than two children. Acts on binned SAH and spatial splits alone.
    pub collapse: Collapse,
    /// How many rays of a batch (`Bvh::closest_hits`) a core traces in turns, 1..=32, so that one works while another
    /// waits for memory. What is fastest depends on scene and rays: several often serve rays that go in all directions,
    /// 1 those that are short or find the same nodes.
    pub rays_in_flight: u32,
    /// How neighbours in a batch that go side by side are traced.
    pub ray_packets: RayPackets,
}

impl Default for BuildParams {
    /// [`BuildParams::embree_scene_medium`].
    fn default() -> Self {
        Self::embree_scene_medium()
    }
}

impl BuildParams {
    /// The defaults of Embree's builder interface (`rtcDefaultBuildArguments`), which are the
    /// default column of the paper's Table 1. A weak baseline: binary nodes, leaves by cost alone.
    #[must_use]
    pub const fn embree_api_default() -> Self {
        Self {
            quality: Quality::BinnedSah,
            branching_factor: 2,
            max_depth: 32,
            sah_block_size: 1,
            min_leaf_size: 1,
            max_leaf_size: 32,
            traversal_cost: 1.0,
            intersection_cost: 1.0,
            dynamics: Dynamics::Dynamic,
            leaf_format: LeafFormat::Edges,
            accuracy: Accuracy::Fast,
            split_budget: 1.2,
            rounding: Rounding::Exact,
            rotations: 0,
            collapse: Collapse::LargestFirst,
            rays_in_flight: 1,
            ray_packets: RayPackets::Off,
        }
    }

    /// What Embree 4 itself uses for a scene of medium quality on a machine with AVX: the strong
    /// baseline.
    #[must_use]
    pub const fn embree_scene_medium() -> Self {
        Self {
            branching_factor: 8,
            max_depth: 40,
            sah_block_size: 4,
            min_leaf_size: 4,
            max_leaf_size: 28,
            ..Self::embree_api_default()
        }
    }

    /// Binned SAH, collapsed at least cost: a build that takes longer than [`Self::embree_scene_medium`], a tree that is
    /// faster to trace. Nodes of 16 serve AVX-512, which tests one in one go, nodes of 8 the others.
    #[must_use]
    pub const fn least_cost(branching_factor: u32) -> Self {
        Self {
            branching_factor,
            collapse: Collapse::LeastCost,
            min_leaf_size: 3,
            intersection_cost: 0.6,
            ..Self::embree_scene_medium()
        }
    }

    /// What Embree 4 uses for a scene of high quality on a machine with AVX.
    #[must_use]
    pub const fn embree_scene_high() -> Self {
        Self {
            quality: Quality::SpatialSplits,
            ..Self::embree_scene_medium()
        }
    }

    /// What Embree 4 uses for a scene with the flag `COMPACT`: nodes of four.
    #[must_use]
    pub const fn embree_scene_compact() -> Self {
        Self {
            branching_factor: 4,
            leaf_format: LeafFormat::Compact,
            ..Self::embree_scene_medium()
        }
    }

    /// What Embree 4 uses for a mesh of low quality on a machine with AVX.
    #[must_use]
    pub const fn embree_mesh_morton() -> Self {
        Self {
            quality: Quality::Morton,
            max_depth: 32,
            max_leaf_size: 4,
            ..Self::embree_scene_medium()
        }
    }

    /// What Embree 4 uses for a mesh of low quality in a scene with the flag `COMPACT`: nodes of
    /// four, rotated.
    #[must_use]
    pub const fn embree_mesh_morton_compact() -> Self {
        Self {
            branching_factor: 4,
            leaf_format: LeafFormat::Compact,
            rotations: 1,
            ..Self::embree_mesh_morton()
        }
    }

    /// All that is wrong with the values; an empty list means that they can be built.
    #[must_use]
    pub fn faults(&self) -> Vec<ParameterFault> {
        PARAMETERS
            .iter()
            .filter_map(|p| fault_of(p, self.get(p.name)?))
            .collect()
    }

    /// Checks the values.
    ///
    /// # Errors
    /// All faults, not only the first.
    pub fn validate(&self) -> Result<(), Vec<ParameterFault>> {
        let faults = self.faults();
        if faults.is_empty() {
            Ok(())
        } else {
            Err(faults)
        }
    }

    /// The value of the parameter called `name`; `None` if there is none.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<ParameterValue> {
        use ParameterValue::{Choice, Integer, Real};
        Some(match name {
            "quality" => Choice(match self.quality {
                Quality::Morton => "morton",
                Quality::Agglomerative => "agglomerative",
                Quality::BinnedSah => "binned-sah",
                Quality::SpatialSplits => "spatial-splits",
                Quality::Optimized => "optimized",
            }),
            "branching_factor" => Integer(self.branching_factor),
            "max_depth" => Integer(self.max_depth),
            "sah_block_size" => Integer(self.sah_block_size),
            "min_leaf_size" => Integer(self.min_leaf_size),
            "max_leaf_size" => Integer(self.max_leaf_size),
            "traversal_cost" => Real(self.traversal_cost),
            "intersection_cost" => Real(self.intersection_cost),
            "dynamics" => Choice(match self.dynamics {
                Dynamics::Dynamic => "dynamic",
                Dynamics::Static => "static",
            }),
            "leaf_format" => Choice(match self.leaf_format {
                LeafFormat::Edges => "edges",
                LeafFormat::Compact => "compact",
            }),
            "accuracy" => Choice(match self.accuracy {
                Accuracy::Fast => "fast",
                Accuracy::Robust => "robust",
            }),
            "split_budget" => Real(self.split_budget),
            "rounding" => Choice(match self.rounding {
                Rounding::Exact => "exact",
                Rounding::Embree => "embree",
            }),
            "rotations" => Integer(self.rotations),
            "collapse" => Choice(match self.collapse {
                Collapse::LargestFirst => "largest-first",
                Collapse::LeastCost => "least-cost",
            }),
            "rays_in_flight" => Integer(self.rays_in_flight),
            "ray_packets" => Choice(match self.ray_packets {
                RayPackets::Off => "off",
                RayPackets::On => "on",
            }),
            _ => return None,
        })
    }

    /// Sets the parameter called `name` from text, as a command line gives it.
    ///
    /// # Errors
    /// [`ParameterFault::UnknownName`] or [`ParameterFault::NotUnderstood`]. Whether a number lies
    /// in its range is left to [`BuildParams::validate`].
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), ParameterFault> {
        let Some(parameter) = PARAMETERS.iter().find(|p| p.name == name) else {
            return Err(ParameterFault::UnknownName {
                name: name.to_owned(),
            });
        };
        let not_understood = || ParameterFault::NotUnderstood {
            name: parameter.name,
            text: text.to_owned(),
            allowed: parameter.range,
        };
        let integer = || text.parse::<u32>().map_err(|_| not_understood());
        let real = || text.parse::<f32>().map_err(|_| not_understood());
        match name {
            "quality" => {
                self.quality = match text {
                    "morton" => Quality::Morton,
                    "agglomerative" => Quality::Agglomerative,
                    "binned-sah" => Quality::BinnedSah,
                    "spatial-splits" => Quality::SpatialSplits,
                    "optimized" => Quality::Optimized,
                    _ => return Err(not_understood()),
                }
            }
            "branching_factor" => self.branching_factor = integer()?,
            "max_depth" => self.max_depth = integer()?,
            "sah_block_size" => self.sah_block_size = integer()?,
            "min_leaf_size" => self.min_leaf_size = integer()?,
            "max_leaf_size" => self.max_leaf_size = integer()?,
            "traversal_cost" => self.traversal_cost = real()?,
            "intersection_cost" => self.intersection_cost = real()?,
            "dynamics" => {
                self.dynamics = match text {
                    "dynamic" => Dynamics::Dynamic,
                    "static" => Dynamics::Static,
                    _ => return Err(not_understood()),
                }
            }
            "leaf_format" => {
                self.leaf_format = match text {
                    "edges" => LeafFormat::Edges,
                    "compact" => LeafFormat::Compact,
                    _ => return Err(not_understood()),
                }
            }
            "accuracy" => {
                self.accuracy = match text {
                    "fast" => Accuracy::Fast,
                    "robust" => Accuracy::Robust,
                    _ => return Err(not_understood()),
                }
            }
            "split_budget" => self.split_budget = real()?,
            "rounding" => {
                self.rounding = match text {
                    "exact" => Rounding::Exact,
                    "embree" => Rounding::Embree,
                    _ => return Err(not_understood()),
                }
            }
            "rotations" => self.rotations = integer()?,
            "collapse" => {
                self.collapse = match text {
                    "largest-first" => Collapse::LargestFirst,
                    "least-cost" => Collapse::LeastCost,
                    _ => return Err(not_understood()),
                }
            }
            "rays_in_flight" => self.rays_in_flight = integer()?,
            "ray_packets" => {
                self.ray_packets = match text {
                    "off" => RayPackets::Off,
                    "on" => RayPackets::On,
                    _ => return Err(not_understood()),
                }
            }
            _ => unreachable!("every name of the table has an arm"),
        }
        Ok(())
    }

    /// The representative of all values that build the same tree and trace it alike: the smaller leaf limit capped by
    /// the larger, the block size rounded down to a power of two, both costs divided by the power
    /// of two that brings the intersection cost into 1..2 (exact in binary arithmetic; an
    /// intersection cost of 0 leaves the traversal cost alone), and what the quality does not look
    /// at set to one value: block size and costs with Morton order, the split budget without
    /// splits, rotations without Morton order, the collapse where there is one way.
    #[must_use]
    pub fn canonical(&self) -> Self {
        let scale = match self.intersection_cost {
            c if c.is_normal() => 2f32.powi(-(exponent(c))),
            _ => 1.0,
        };
        let mut canonical = Self {
            sah_block_size: 1 << self.sah_block_shift(),
            min_leaf_size: self.min_leaf_size.min(self.max_leaf_size),
            traversal_cost: self.traversal_cost * scale,
            intersection_cost: self.intersection_cost * scale,
            ..*self
        };
        if self.quality == Quality::Morton {
            let default = Self::embree_api_default();
            canonical.sah_block_size = default.sah_block_size;
            canonical.traversal_cost = default.traversal_cost;
            canonical.intersection_cost = default.intersection_cost;
        } else {
            canonical.rotations = 0;
        }
        if !matches!(self.quality, Quality::SpatialSplits | Quality::Optimized) {
            canonical.split_budget = Self::embree_api_default().split_budget;
        }
        if !matches!(self.quality, Quality::BinnedSah | Quality::SpatialSplits) {
            canonical.collapse = Self::embree_api_default().collapse;
        }
        canonical
    }

    /// Whether a binary tree is collapsed at least cost.
    pub(crate) fn is_collapsed(&self) -> bool {
        match self.quality {
            Quality::Morton => false,
            Quality::BinnedSah | Quality::SpatialSplits => self.collapse == Collapse::LeastCost,
            Quality::Agglomerative | Quality::Optimized => true,
        }
    }

    /// The most references that are made of `n` primitives.
    pub(crate) fn reference_capacity(&self, n: usize) -> usize {
        match self.quality {
            Quality::SpatialSplits | Quality::Optimized => {
                (f64::from(self.split_budget) * n as f64) as usize
            }
            _ => n,
        }
    }

    /// The shift that rounds a count up to blocks: ⌊log2 `sah_block_size`⌋.
    pub(crate) fn sah_block_shift(&self) -> u32 {
        self.sah_block_size.max(1).ilog2()
    }
}

/// The exponent e of a normal number in 2^e · [1, 2).
fn exponent(value: f32) -> i32 {
    ((value.to_bits() >> 23) & 0xff) as i32 - 127
}

fn fault_of(parameter: &Parameter, value: ParameterValue) -> Option<ParameterFault> {
    let name = parameter.name;
    match (parameter.range, value) {
        (ParameterRange::Integers(min, max), ParameterValue::Integer(v)) if v < min || v > max => {
            Some(ParameterFault::OutOfRange {
                name,
                value: f64::from(v),
                min: f64::from(min),
                max: f64::from(max),
            })
        }
        // Written so that NaN is a fault.
        (ParameterRange::Reals(min, max), ParameterValue::Real(v)) if !(v >= min && v <= max) => {
            Some(ParameterFault::OutOfRange {
                name,
                value: f64::from(v),
                min: f64::from(min),
                max: f64::from(max),
            })
        }
        (ParameterRange::OneOf(allowed), ParameterValue::Integer(v)) if !allowed.contains(&v) => {
            Some(ParameterFault::NotOneOf {
                name,
                value: v,
                allowed,
            })
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_valid_and_the_table_knows_every_parameter() {
        for params in [
            BuildParams::embree_api_default(),
            BuildParams::embree_scene_medium(),
        ] {
            assert_eq!(params.validate(), Ok(()));
            for parameter in &PARAMETERS {
                assert!(params.get(parameter.name).is_some(), "{}", parameter.name);
            }
        }
    }

    #[test]
    fn set_reads_back_what_get_shows() {
        let mut copy = BuildParams::embree_scene_medium();
        let original = BuildParams {
            quality: Quality::Morton,
            traversal_cost: 0.1,
            leaf_format: LeafFormat::Compact,
            accuracy: Accuracy::Robust,
            dynamics: Dynamics::Static,
            rotations: 3,
            rays_in_flight: 5,
            ray_packets: RayPackets::On,
            ..BuildParams::embree_api_default()
        };
        for parameter in &PARAMETERS {
            let text = original.get(parameter.name).expect("known").to_string();
            copy.set(parameter.name, &text).expect("valid");
        }
        assert_eq!(copy, original);
    }

    #[test]
    fn all_faults_are_reported_at_once() {
        let params = BuildParams {
            branching_factor: 17,
            max_depth: 0,
            sah_block_size: 0,
            min_leaf_size: 0,
            max_leaf_size: 65,
            traversal_cost: f32::NAN,
            intersection_cost: -1.0,
            rotations: 17,
            rays_in_flight: 0,
            leaf_format: LeafFormat::Compact,
            accuracy: Accuracy::Robust,
            ..BuildParams::default()
        };
        assert_eq!(params.faults().len(), 9);
    }

    #[test]
    fn canonical_is_idempotent_and_exact() {
        let params = BuildParams {
            sah_block_size: 7,
            min_leaf_size: 9,
            max_leaf_size: 5,
            traversal_cost: 0.3,
            intersection_cost: 5.5,
            ..BuildParams::default()
        };
        let canonical = params.canonical();
        assert_eq!(canonical.canonical(), canonical);
        assert_eq!(canonical.sah_block_size, 4);
        assert_eq!(canonical.min_leaf_size, 5);
        assert_eq!(canonical.intersection_cost, 1.375);
        assert_eq!(canonical.traversal_cost, 0.075);
    }

    #[test]
    fn canonical_forgets_what_the_quality_does_not_look_at() {
        let params = BuildParams {
            rotations: 3,
            split_budget: 2.0,
            ..BuildParams::default()
        };
        assert_eq!(params.canonical(), BuildParams::default().canonical());
        let morton = |rotations| BuildParams {
            rotations,
            ..BuildParams::embree_mesh_morton()
        };
        assert_ne!(morton(3).canonical(), morton(0).canonical());
    }
}
