//! The volume raycaster: an empty room with its door open.
//!
//! Here will live grids and their loaders, transfer functions, voxel blocks with empty-space
//! skipping, ray casting with early ray termination, and the model that predicts the time of the
//! next frame. It will stand on `raywright-bvh` (the boundary of the non-empty blocks is a
//! primitive set like any other) and on `raywright-imaging`, and know nothing of the path tracer.
#![forbid(unsafe_code)]
