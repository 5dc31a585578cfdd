//! Statistics that Embree prints after `rtcCommitScene`, against trees of our scene presets.
//!
//! The presets follow Embree's own settings for scenes and true floors, so the trees have Embree's
//! nodes, leaves, depth and costs; the library prints costs with three decimals and fills with two.
//! Morton order alone needs the rounding of Embree, since the estimate of a reciprocal decides into
//! which cell a primitive falls: with a true division sibenik has one leaf more.

use raywright_bvh::{BuildParams, LeafFormat, Rounding};

use super::{Figures, GoldenQuality, Outcome, SceneLevel, has_golden_reciprocal};

const COST_TOLERANCE: f64 = 0.0011;
const FILL_TOLERANCE: f64 = 0.0051;

impl SceneLevel {
    /// What was built, whatever the scene and its mesh asked for: flags can turn spatial splits
    /// off, and only the mesh's quality brings Morton order.
    #[must_use]
    pub fn built_quality(&self) -> GoldenQuality {
        if self.scene_quality == GoldenQuality::Low && self.geometry_quality == GoldenQuality::Low {
            GoldenQuality::Low
        } else if self.builder.contains("Spatial") {
            GoldenQuality::High
        } else {
            GoldenQuality::Medium
        }
    }
}

/// Our parameters for what Embree built.
///
/// # Errors
/// Why the line cannot be compared: a processor with another reciprocal estimate.
pub fn scene_level_parameters(line: &SceneLevel) -> Result<BuildParams, String> {
    let width: u32 = line.bvh.trim_start_matches("BVH").parse().unwrap_or(0);
    let mut params = match line.built_quality() {
        GoldenQuality::Low if width == 4 => BuildParams::embree_mesh_morton_compact(),
        GoldenQuality::Low => BuildParams::embree_mesh_morton(),
        GoldenQuality::Medium if width == 4 => BuildParams::embree_scene_compact(),
        GoldenQuality::Medium => BuildParams::embree_scene_medium(),
        GoldenQuality::High => BuildParams::embree_scene_high(),
    };
    if line.built_quality() == GoldenQuality::Low {
        if !has_golden_reciprocal() {
            let why = "this processor's reciprocal estimate is not that of the golden machine";
            return Err(why.into());
        }
        params.rounding = Rounding::Embree;
    }
    params.branching_factor = width;
    // How leaves are stored does not change the tree, and not every way is built yet.
    params.leaf_format = LeafFormat::Edges;
    Ok(params)
}

/// Compares what Embree printed with the figures of our tree (block size 4).
#[must_use]
pub fn compare_scene_level(line: &SceneLevel, got: &Figures, branching: u32) -> Outcome {
    let children: usize = got.arity_hist.iter().map(|(arity, n)| arity * n).sum();
    let percent = |part: usize, all: usize| 100.0 * part as f64 / all as f64;
    let mut found = Vec::new();
    for (name, got, expected) in [
        ("nodes", got.inner, line.nodes),
        ("leaves", got.leaves, line.leaves),
        ("depth", got.depth, line.depth_inner + 1),
    ] {
        if got != expected {
            found.push(format!("{name} {got}, expected {expected}"));
        }
    }
    for (name, got, expected, tolerance) in [
        (
            "SAH of nodes",
            got.sah_trav.unwrap_or(0.0),
            line.sah_nodes,
            COST_TOLERANCE,
        ),
        (
            "SAH of leaf blocks",
            got.sah_block.unwrap_or(0.0),
            line.sah_leaf_blocks,
            COST_TOLERANCE,
        ),
        (
            "fill of nodes",
            percent(children, branching as usize * got.inner),
            line.fill_nodes,
            FILL_TOLERANCE,
        ),
        (
            "fill of leaves",
            percent(got.refs, 4 * got.blocks(4)),
            line.fill_leaves,
            FILL_TOLERANCE,
        ),
    ] {
        if (got - expected).abs() > tolerance {
            found.push(format!("{name} {got:.4}, expected {expected}"));
        }
    }
    if found.is_empty() {
        Outcome::Equal
    } else {
        Outcome::Different(found.join("; "))
    }
}
