//! Bounding volume hierarchies over triangles, with the parameter space of Embree.
//!
//! Triangles in, a tree out, hits out. This room does no input or output, reads no clock and has
//! no global state.
//!
//! ```
//! use raywright_bvh::{Bvh, BuildParams, Ray, TriangleMesh, Vec3};
//!
//! let mesh = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
//! let bvh = Bvh::build(&[&mesh], &BuildParams::default())?;
//! let hit = bvh.closest_hit(&Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0])).unwrap();
//! assert_eq!((hit.geometry_id, hit.primitive_id), (0, 0));
//! assert_eq!((hit.t, hit.u, hit.v), (1.0, 0.25, 0.25));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![deny(unsafe_code)]

mod any_tree;
mod bounds;
mod boxes;
mod build;
mod bvh;
mod error;
mod hierarchy;
mod instances;
mod layout;
mod mesh;
mod params;
mod ray;
#[doc(hidden)]
#[allow(unsafe_code)]
pub mod simd;
mod stats;
mod traverse;

pub use bounds::Aabb;
pub use boxes::{BoxBvh, BoxHit, segments};
pub use build::{
    BuildWorkspace, LeafReference,
    control::{BuildControl, ProgressFn},
};
pub use bvh::{Bvh, Refit};
pub use error::{BuildError, InstanceError, ParameterFault, RefitError};
pub use glam::{Affine3, Vec3};
pub use hierarchy::{BuildPrimitive, Corners, Hierarchy, HierarchyNode};
pub use instances::{Instance, InstanceHit, InstancedBvh};
pub use mesh::{MeshError, TriangleMesh};
pub use params::{
    Accuracy, BuildParams, Collapse, Dynamics, LeafFormat, PARAMETERS, Parameter, ParameterRange,
    ParameterValue, Quality, RayPackets, Rounding,
};
pub use ray::{Hit, Ray, Work};
pub use simd::Isa;
pub use stats::TreeStats;
pub use traverse::reference;
