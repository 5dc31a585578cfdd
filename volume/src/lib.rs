//! The volume raycaster: grids, transfer functions, empty space, ray casting.
//!
//! It stands on `raywright-bvh` (the non-empty blocks of voxels and their boundary are primitives
//! like any other) and on `raywright-imaging`, and knows nothing of the path tracer.
#![forbid(unsafe_code)]

mod blocks;
pub mod cast;
mod distance;
pub mod grid;
mod table;
pub mod transfer;

pub use crate::{
    cast::{CastError, CastOptions, Picture, Raycaster, Skipping, Work},
    grid::{GridError, Orientation, ValueScale, Volume, VoxelType, Voxels},
    transfer::{ControlPoint, TransferError, TransferFunction},
};
