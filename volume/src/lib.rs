//! The volume raycaster: grids, transfer functions, empty space, ray casting.
//!
//! It stands on `raywright-bvh` (the non-empty blocks of voxels and their boundary are primitives
//! like any other) and on `raywright-imaging`, and knows nothing of the path tracer.
#![deny(unsafe_code)]

pub mod grid;
pub mod transfer;

pub use crate::{
    grid::{GridError, Orientation, ValueScale, Volume, Voxels},
    transfer::{ControlPoint, TransferError, TransferFunction},
};
