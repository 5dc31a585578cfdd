//! The lines of the golden files, section 1 of the README beside them.

use std::{fs, path::Path};

use raywright_bvh::{Aabb, LeafReference, Vec3};
use serde::{Deserialize, Deserializer, de::DeserializeOwned, de::Error as _};

use super::{Figures, GoldenError};
use crate::tree::{Node, Tree};

/// Embree's build quality.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, PartialOrd, Ord)]
#[serde(rename_all = "lowercase")]
pub enum GoldenQuality {
    /// Morton order.
    Low,
    /// Binned SAH.
    Medium,
    /// Binned SAH with spatial splits.
    High,
}

impl GoldenQuality {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Low, Self::Medium, Self::High];

    /// Its name in the files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
        }
    }
}

/// A line of `sets.jsonl` or `scenes.jsonl`: what was built, with which arguments, and the result.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct Line {
    /// The triangle set or scene.
    pub set: String,
    /// The number of the arguments.
    pub case: u32,
    /// Triangles.
    pub n: usize,
    /// The quality asked for.
    pub quality: GoldenQuality,
    /// Length of the primitive array, at least n.
    pub capacity: usize,
    /// `maxBranchingFactor`.
    #[serde(rename = "maxBranchingFactor")]
    pub branching: u32,
    /// `maxDepth`.
    #[serde(rename = "maxDepth")]
    pub max_depth: u32,
    /// `sahBlockSize`.
    #[serde(rename = "sahBlockSize")]
    pub block_size: u32,
    /// `minLeafSize`.
    #[serde(rename = "minLeafSize")]
    pub min_leaf: u32,
    /// `maxLeafSize`.
    #[serde(rename = "maxLeafSize")]
    pub max_leaf: u32,
    /// `traversalCost`.
    #[serde(rename = "traversalCost")]
    pub traversal_cost: f32,
    /// `intersectionCost`.
    #[serde(rename = "intersectionCost")]
    pub intersection_cost: f32,
    /// Details without which the line fails.
    #[serde(default)]
    pub needs: Vec<String>,
    /// Whether the tree depends on Embree's thread library.
    #[serde(default)]
    pub tbb_sort: bool,
    /// What Embree did.
    #[serde(flatten)]
    pub expected: Expected,
}

/// What Embree did with a line's arguments.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(untagged)]
pub enum Expected {
    /// It refused.
    Error {
        /// Embree's error code.
        error: u32,
    },
    /// It built a tree.
    Tree(Figures),
}

/// A line of `debug_trees.jsonl`: a line and its whole tree.
#[derive(Clone, Debug, Deserialize)]
pub struct DebugTree {
    /// The line.
    #[serde(flatten)]
    pub line: Line,
    /// The tree; absent where Embree refused.
    pub tree: Option<JsonNode>,
}

/// A line of `debug_steps.jsonl`, as far as it can be seen from outside the builder.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct Steps {
    /// The triangle set.
    pub set: String,
    /// Triangles.
    pub n: usize,
    /// Geometries.
    pub geometries: u32,
    /// The hash of all vertex coordinates.
    #[serde(deserialize_with = "hex")]
    pub vertices_hash: u64,
    /// The first triangle, nine digits.
    pub first_triangle: [f32; 9],
}

/// A line of `scene_level.jsonl`: what the library printed after `rtcCommitScene` of one mesh.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct SceneLevel {
    /// The scene.
    pub set: String,
    /// The quality of the scene.
    pub scene_quality: GoldenQuality,
    /// The flags of the scene, joined by plus signs, or `none`.
    pub scene_flags: String,
    /// The quality of the mesh.
    pub geometry_quality: GoldenQuality,
    /// The tree: `BVH4` or `BVH8`.
    pub bvh: String,
    /// The builder's name.
    pub builder: String,
    /// Triangles.
    pub primitives: usize,
    /// Inner nodes on the longest way.
    pub depth_inner: usize,
    /// Σ A(inner)/A(root).
    pub sah_nodes: f64,
    /// Inner nodes.
    pub nodes: usize,
    /// Children over slots for children, in percent.
    pub fill_nodes: f64,
    /// Σ A(leaf)·⌈size/4⌉/A(root).
    pub sah_leaf_blocks: f64,
    /// Leaves.
    pub leaves: usize,
    /// Primitives over slots in blocks of four, in percent.
    pub fill_leaves: f64,
}

/// A node as the files write it.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub enum JsonNode {
    /// Geometry id and primitive id of each reference.
    Leaf {
        /// The references.
        leaf: Vec<(u32, u32)>,
    },
    /// Boxes and children.
    Inner {
        /// Lower and upper corner of each child.
        bounds: Vec<[f32; 6]>,
        /// The children.
        children: Vec<JsonNode>,
    },
}

/// The tree that a file describes.
#[must_use]
pub fn tree_of_json(node: &JsonNode) -> Tree {
    Tree {
        root: Some(convert(node)),
    }
}

fn convert(node: &JsonNode) -> Node {
    match node {
        JsonNode::Leaf { leaf } => {
            let reference = |&(geometry_id, primitive_id): &(u32, u32)| LeafReference {
                geometry_id,
                primitive_id,
            };
            Node::Leaf(leaf.iter().map(reference).collect())
        }
        JsonNode::Inner { bounds, children } => {
            let bounds = bounds.iter().map(|b| Aabb {
                min: Vec3::from_slice(&b[..3]),
                max: Vec3::from_slice(&b[3..]),
            });
            Node::Inner(bounds.zip(children.iter().map(convert)).collect())
        }
    }
}

/// All lines of a file.
///
/// # Errors
/// If the file cannot be read or a line is not of type `T`.
pub fn read_lines<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, GoldenError> {
    let text = fs::read_to_string(path).map_err(|source| GoldenError::Io {
        path: path.into(),
        source,
    })?;
    text.lines()
        .enumerate()
        .map(|(number, line)| {
            serde_json::from_str(line).map_err(|source| GoldenError::Json {
                path: path.into(),
                line: number + 1,
                source,
            })
        })
        .collect()
}

/// A number of 64 bits in hexadecimal digits.
pub(super) fn hex<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
    let text = String::deserialize(deserializer)?;
    u64::from_str_radix(&text, 16).map_err(D::Error::custom)
}
