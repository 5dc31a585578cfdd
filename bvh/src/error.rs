//! What can be wrong with parameters and with a build. Fields, not text, so that a caller can act.

use crate::mesh::MeshError;
use crate::params::ParameterRange;

/// What is wrong with one parameter.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ParameterFault {
    /// A number outside its range, or not a number.
    #[error("{name} = {value} is outside {min}..={max}")]
    OutOfRange {
        /// The parameter.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Smallest value allowed.
        min: f64,
        /// Largest value allowed.
        max: f64,
    },
    /// A whole number that is none of those allowed.
    #[error("{name} = {value} is none of {allowed:?}")]
    NotOneOf {
        /// The parameter.
        name: &'static str,
        /// Its value.
        value: u32,
        /// The values allowed.
        allowed: &'static [u32],
    },
    /// Text that is no value of the parameter.
    #[error("{name} = {text:?} is not understood; allowed are {allowed:?}")]
    NotUnderstood {
        /// The parameter.
        name: &'static str,
        /// The text given.
        text: String,
        /// The values allowed.
        allowed: ParameterRange,
    },
    /// No parameter has this name.
    #[error("there is no parameter {name:?}")]
    UnknownName {
        /// The name given.
        name: String,
    },
}

/// Why no tree was built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// Parameters that cannot be built: all of them.
    #[error("{}", join(.0))]
    Parameters(Vec<ParameterFault>),
    /// The tree would need more levels than `max_depth` allows.
    #[error("max_depth = {max_depth} is too small: at least {needed} levels are needed")]
    DepthLimit {
        /// The limit given.
        max_depth: u32,
        /// A limit below which the build surely fails.
        needed: u32,
    },
    /// Coordinates whose largest magnitude is so large or so small that products of two of them
    /// leave the range of `f32` even after scaling.
    #[error("largest coordinate {largest:e} is outside {min:e}..={max:e}")]
    CoordinateRange {
        /// The largest magnitude of a coordinate.
        largest: f32,
        /// Smallest magnitude allowed.
        min: f32,
        /// Largest magnitude allowed.
        max: f32,
    },
    /// A tree with more parts than its references can number.
    #[error("the tree has {count} {parts}, more than the {limit} that can be numbered")]
    TreeTooLarge {
        /// What there are too many of.
        parts: &'static str,
        /// How many there are.
        count: usize,
        /// The largest number allowed.
        limit: usize,
    },
    /// A box that is empty or not finite, where boxes are the primitives.
    #[error("box {index} is empty or not finite")]
    InvalidBox {
        /// Number of the box, from 0.
        index: usize,
    },
    /// The build was told to stop.
    #[error("the build was cancelled")]
    Cancelled,
    /// The build would take more memory than it may.
    #[error("the build needs {needed} bytes, but may take only {limit}")]
    MemoryLimit {
        /// Bytes that the workspace would take.
        needed: usize,
        /// Bytes that it may take.
        limit: usize,
    },
    /// A mesh that cannot be numbered.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Why a tree was not moved to new vertices. It is then as it was before.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RefitError {
    /// Not as many meshes as the tree was built over.
    #[error("{given} meshes, but the tree was built over {built}")]
    MeshCount {
        /// Meshes given.
        given: usize,
        /// Meshes of the build.
        built: usize,
    },
    /// A mesh with another number of triangles.
    #[error(
        "mesh {geometry_id} has {given} triangles, but the tree was built over {built} of them"
    )]
    TriangleCount {
        /// Which mesh.
        geometry_id: usize,
        /// Triangles given.
        given: usize,
        /// Triangles of the build.
        built: usize,
    },
    /// Something that a build refuses as well.
    #[error(transparent)]
    Build(#[from] BuildError),
}

/// Why no tree over instances was built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InstanceError {
    /// An instance of a tree that was not given.
    #[error("instance {instance} is one of tree {tree}, but there are {trees} trees")]
    TreeOutOfRange {
        /// Number of the instance, from 0.
        instance: usize,
        /// The tree that it asks for.
        tree: usize,
        /// How many trees there are.
        trees: usize,
    },
    /// A transform with a number that is infinite or none.
    #[error("the transform of instance {instance} is not finite")]
    TransformNotFinite {
        /// Number of the instance, from 0.
        instance: usize,
    },
    /// A transform without an inverse in the numbers of `f32`: it is flat, or so near to it that
    /// nothing would be left of a ray, or it makes things so small that the inverse is not finite.
    #[error(
        "the transform of instance {instance} cannot be inverted in f32 (condition {condition:e})"
    )]
    TransformNotInvertible {
        /// Number of the instance, from 0.
        instance: usize,
        /// By how much errors grow on the way to the object and back: 1 for an axis-aligned
        /// transform, at most 2²⁴ for one that is taken; not finite if there is no inverse at all.
        condition: f64,
    },
    /// What a build over the boxes of the instances refuses.
    #[error(transparent)]
    Build(#[from] BuildError),
}

fn join(faults: &[ParameterFault]) -> String {
    faults
        .iter()
        .map(ToString::to_string)
        .collect::<Vec<_>>()
        .join("; ")
}
