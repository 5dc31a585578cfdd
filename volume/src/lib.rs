//! The volume raycaster: grids, transfer functions, empty space, ray casting.
//!
//! It stands on `raywright-bvh` (the non-empty blocks of voxels and their boundary are primitives
//! like any other) and on `raywright-imaging`, and knows nothing of the path tracer.
//!
//! | module | what it answers |
//! | --- | --- |
//! | [`grid`] | what a volume is |
//! | [`load`] | which volume a file has: NRRD, NIfTI, raw |
//! | [`generate`] | a volume without a file |
//! | [`transfer`], [`presets`] | what a value looks like |
//! | [`view`] | transfer functions and cameras of a file; a camera without one |
//! | [`statistics`] | mean and percentiles |
//! | [`appearance`] | shading, surfaces, pre-integration |
//! | [`cast`] | a picture of a volume |
//! | [`enclosure`] | where a ray can see something, by trees |
//! | [`estimate`] | how long rays will be, before they are cast |
//! | [`predict`] | what a frame will take, before it is drawn |
//! | [`steer`] | in which quality a frame takes a given time |
//! | [`frames`] | frame after frame, each in its time |
//! | [`sequence`] | what is to be seen at each moment of a recording |
#![forbid(unsafe_code)]

pub mod appearance;
mod blocks;
pub mod cast;
mod distance;
pub mod enclosure;
pub mod estimate;
pub mod frames;
pub mod generate;
pub mod grid;
pub mod load;
pub mod predict;
pub mod presets;
pub mod sequence;
mod slabs;
pub mod statistics;
pub mod steer;
mod table;
pub mod transfer;
pub mod view;
mod voxels;

pub use crate::{
    appearance::{
        Appearance, AppearanceError, Integration, Interpolation, IsoSurface, Light, Shading,
    },
    cast::{
        Behind, CastError, CastOptions, Counts, Jitter, Picture, Prepared, RayWork, Raycaster,
        Skipping, Work,
    },
    enclosure::{EnclosureError, EnclosureKind, EnclosureParams},
    estimate::{Estimate, EstimateMethod, Estimator, PreparedEstimate},
    frames::{Control, Drawn, FrameClock, FrameLoop, FrameLoopParams, Refined, WorkTimer},
    generate::Generated,
    grid::{GridError, Orientation, ValueScale, Volume, VoxelSlice, Voxels},
    load::{LoadError, LoadOptions, Loaded, RawLayout, load_volume},
    predict::{FramePredictor, Outlook, PixelsPerRay, Prediction, PredictorParams, Quality},
    sequence::Sequence,
    statistics::Statistics,
    steer::{Mode, Next, Steering, SteeringParams, WorkClock},
    transfer::{ControlPoint, TransferError, TransferFunction},
    view::View,
};
