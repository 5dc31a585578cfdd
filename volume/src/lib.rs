//! The volume raycaster: grids, transfer functions, empty space, ray casting.
//!
//! It stands on `raywright-bvh` (the non-empty blocks of voxels and their boundary are primitives
//! like any other) and on `raywright-imaging`, and knows nothing of the path tracer.
#![forbid(unsafe_code)]

mod blocks;
pub mod cast;
mod distance;
pub mod generate;
pub mod grid;
pub mod load;
pub mod presets;
pub mod statistics;
mod table;
pub mod transfer;
pub mod view;
mod voxels;

pub use crate::{
    cast::{CastError, CastOptions, Picture, Raycaster, Skipping, Work},
    generate::Generated,
    grid::{GridError, Orientation, ValueScale, Volume, VoxelSlice, Voxels},
    load::{LoadError, LoadOptions, Loaded, RawLayout, load_volume},
    statistics::Statistics,
    transfer::{ControlPoint, TransferError, TransferFunction},
    view::View,
};
