//! Embree as an oracle and as a peer: found and loaded at run time, nothing is linked.
//!
//! The library is looked for in this order:
//! 1. `RAYWRIGHT_EMBREE`: a library file, or a folder with one;
//! 2. names that the system's loader knows, version 4 before 3;
//! 3. the folder `target/embree` of the workspace, which `tools/fetch-embree` fills from the Python
//!    package embreex (Linux x86-64 also has TBB in it).
//!
//! Invariants: all `unsafe` is in the module `sys`, whose functions keep the library's contract for
//! any argument of a safe caller; inputs that are known to crash the library are refused before it
//! is called ([`EmbreeError::Crashes`]). A library is never unloaded, since its worker threads
//! outlive its devices.
//!
//! The number of threads of a device acts on the whole process: of two devices the smaller number
//! holds. Measure different numbers in different processes.

mod find;
#[allow(unsafe_code)]
mod sys;

use std::path::PathBuf;

use raywright_bvh::{Aabb, Accuracy, BuildParams, Collapse, Dynamics, LeafFormat, Quality, Vec3};

pub use find::{SEARCHED_FOLDER, VARIABLE};
pub use sys::{Built, Device, Embree, PreparedScene, Scene};

/// Why Embree did not do something.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EmbreeError {
    /// There is no library, or none that can be loaded.
    #[error("no Embree was found; tried {}", join(.tried))]
    NotFound {
        /// Each name with what the loader said.
        tried: Vec<(String, String)>,
    },
    /// A library without a function that Embree has.
    #[error("{}: {message}", path.display())]
    NotEmbree {
        /// The file or name.
        path: PathBuf,
        /// What is missing.
        message: String,
    },
    /// A version with another interface.
    #[error("Embree {version} is neither 3 nor 4")]
    Version {
        /// As the library gives it: major · 10000 + minor · 100 + patch.
        version: isize,
    },
    /// The library refused.
    #[error("Embree's error {code}: {}", meaning(*.code))]
    Refused {
        /// Its error code.
        code: i32,
    },
    /// The input is known to crash or hang this version, so it was not given to it.
    #[error("not given to Embree: {why}")]
    Crashes {
        /// What would happen.
        why: &'static str,
    },
    /// The library built a tree with nodes that it did not fill.
    #[error("Embree left a node without children or boxes")]
    Incomplete,
}

fn join(tried: &[(String, String)]) -> String {
    let tried = tried.iter().map(|(name, why)| format!("{name} ({why})"));
    tried.collect::<Vec<_>>().join(", ")
}

fn meaning(code: i32) -> &'static str {
    match code {
        1 => "unknown",
        2 => "invalid argument",
        3 => "invalid operation",
        4 => "out of memory",
        5 => "unsupported processor",
        6 => "cancelled",
        _ => "not documented",
    }
}

/// `RTCBuildQuality`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum BuildQuality {
    /// Morton order.
    Low = 0,
    /// Binned SAH.
    Medium = 1,
    /// Binned SAH with spatial splits.
    High = 2,
}

/// The arguments of `rtcBuildBVH`, fields and ranges as in `RTCBuildArguments`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BuildArguments {
    /// `buildQuality`.
    pub quality: BuildQuality,
    /// `maxBranchingFactor`; at most 8 for low quality.
    pub branching_factor: u32,
    /// `maxDepth`.
    pub max_depth: u32,
    /// `sahBlockSize`, 1..=32.
    pub sah_block_size: u32,
    /// `minLeafSize`.
    pub min_leaf_size: u32,
    /// `maxLeafSize`; at most 32 for low quality.
    pub max_leaf_size: u32,
    /// `traversalCost`.
    pub traversal_cost: f32,
    /// `intersectionCost`.
    pub intersection_cost: f32,
    /// `primitiveArrayCapacity`: the number of references that splits may make. Below the number
    /// of primitives it acts as that number.
    pub capacity: usize,
}

impl BuildArguments {
    /// The arguments for our parameters and `n` primitives; `None` for a quality that Embree does
    /// not have, for a collapse at least cost, and for rotations, which it has in its own scenes alone.
    #[must_use]
    pub fn of(params: &BuildParams, n: usize) -> Option<Self> {
        let quality = match params.quality {
            Quality::Morton if params.rotations > 0 => return None,
            Quality::BinnedSah | Quality::SpatialSplits
                if params.collapse == Collapse::LeastCost =>
            {
                return None;
            }
            Quality::Morton => BuildQuality::Low,
            Quality::BinnedSah => BuildQuality::Medium,
            Quality::SpatialSplits => BuildQuality::High,
            Quality::Agglomerative | Quality::Optimized => return None,
        };
        let capacity = match quality {
            BuildQuality::High => (f64::from(params.split_budget) * n as f64) as usize,
            _ => n,
        };
        Some(Self {
            quality,
            branching_factor: params.branching_factor,
            max_depth: params.max_depth,
            sah_block_size: params.sah_block_size,
            min_leaf_size: params.min_leaf_size,
            max_leaf_size: params.max_leaf_size,
            traversal_cost: params.traversal_cost,
            intersection_cost: params.intersection_cost,
            capacity,
        })
    }

    /// Refuses what is known to crash or hang the library of this major version.
    fn check(&self, major: isize) -> Result<(), EmbreeError> {
        let low = self.quality == BuildQuality::Low;
        let costs = [self.traversal_cost, self.intersection_cost];
        let why = if low && self.branching_factor > 8 {
            "low quality with more than 8 children overflows its stack"
        } else if low && self.max_leaf_size > 32 {
            "low quality with leaves of more than 32 overflows its stack"
        } else if !(1..=32).contains(&self.sah_block_size) {
            "a block size of 0 or a very large one shifts by more than a word"
        } else if costs.iter().any(|cost| !cost.is_finite()) {
            "costs that are not finite fail an assertion"
        } else if major < 4 && self.intersection_cost == 0.0 {
            "an intersection cost of 0 fails an assertion in builds of version 3"
        } else {
            return Ok(());
        };
        Err(EmbreeError::Crashes { why })
    }
}

/// What `rtcCommitScene` builds a tree of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneSettings {
    /// Quality of the scene. Low has a tree per mesh under a top tree.
    pub quality: BuildQuality,
    /// Quality of each mesh; matters in a scene of low quality, where low brings Morton order.
    pub geometry_quality: BuildQuality,
    /// Whether the scene will change (flag 1).
    pub dynamics: Dynamics,
    /// Whether leaves hold indices (flag 2).
    pub leaf_format: LeafFormat,
    /// Whether edges are watertight (flag 4).
    pub accuracy: Accuracy,
}

impl SceneSettings {
    /// One quality for scene and meshes, and no flags. Low is then Morton order.
    #[must_use]
    pub fn of_quality(quality: BuildQuality) -> Self {
        Self {
            quality,
            geometry_quality: quality,
            dynamics: Dynamics::Static,
            leaf_format: LeafFormat::Edges,
            accuracy: Accuracy::Fast,
        }
    }

    fn flags(&self) -> i32 {
        i32::from(self.dynamics == Dynamics::Dynamic)
            | (i32::from(self.leaf_format == LeafFormat::Compact) << 1)
            | (i32::from(self.accuracy == Accuracy::Robust) << 2)
    }
}

/// Where a ray meets a triangle, as Embree has it; fields as those of our hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmbreeHit {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// Weight of vertex 1.
    pub u: f32,
    /// Weight of vertex 2.
    pub v: f32,
    /// Which mesh.
    pub geometry_id: u32,
    /// Which triangle.
    pub primitive_id: u32,
}

/// The parts of a triangle within `bounds` on either side of the plane `axis` = `position`, in f32
/// with one rounding per operation, as Embree clips its own triangles (`splitTriangle` in its
/// `kernels/builders/splitter.h`): the second operand wins where two are equal.
fn clip(corners: [Vec3; 3], bounds: &Aabb, axis: usize, position: f32) -> [Aabb; 2] {
    let [mut left, mut right] = [Aabb::EMPTY; 2];
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let (from, to) = (a[axis], b[axis]);
        if from <= position {
            left = left.extended_by(a);
        }
        if from >= position {
            right = right.extended_by(a);
        }
        if (from < position && position < to) || (to < position && position < from) {
            let t = (position - from) * (1.0 / (to - from));
            let c = t * (b - a) + a;
            left = left.extended_by(c);
            right = right.extended_by(c);
        }
    }
    [left, right].map(|part| Aabb {
        min: part.min.max(bounds.min),
        max: part.max.min(bounds.max),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clipping_divides_a_triangle_and_keeps_to_the_box() {
        let corners = [
            Vec3::ZERO,
            Vec3::new(4.0, 0.0, 0.0),
            Vec3::new(0.0, 4.0, 0.0),
        ];
        let bounds = Aabb {
            min: Vec3::ZERO,
            max: Vec3::new(4.0, 2.0, 0.0),
        };
        let [left, right] = clip(corners, &bounds, 0, 1.0);
        assert_eq!((left.min, left.max), (Vec3::ZERO, Vec3::new(1.0, 2.0, 0.0)));
        assert_eq!(right.min, Vec3::X);
        assert_eq!(right.max, Vec3::new(4.0, 2.0, 0.0));
        let [left, right] = clip(corners, &bounds, 0, 5.0);
        assert_eq!(left, bounds);
        assert!(right.is_empty());
    }

    #[test]
    fn what_crashes_embree_is_refused() {
        let params = BuildParams::embree_api_default();
        let arguments = BuildArguments::of(&params, 9).expect("a quality of Embree's");
        assert!(arguments.check(4).is_ok());
        let refused = |change: fn(&mut BuildArguments), major| {
            let mut arguments = arguments;
            change(&mut arguments);
            matches!(arguments.check(major), Err(EmbreeError::Crashes { .. }))
        };
        assert!(refused(
            |a| (a.quality, a.branching_factor) = (BuildQuality::Low, 9),
            4
        ));
        assert!(refused(
            |a| (a.quality, a.max_leaf_size) = (BuildQuality::Low, 33),
            4
        ));
        assert!(refused(|a| a.sah_block_size = 0, 4));
        assert!(refused(|a| a.traversal_cost = f32::NAN, 4));
        assert!(refused(|a| a.intersection_cost = 0.0, 3));
        assert!(!refused(|a| a.intersection_cost = 0.0, 4));
    }
}
