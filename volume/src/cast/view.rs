//! What all rays of a picture share, in the space of voxels.
//!
//! Samples lie at t = k·Δ along a ray, k = 1, 2, …: one lattice that is anchored at the eye and not
//! where a ray enters. So whatever is left out, by blocks, tiles or a clip box, moves no sample.
//!
//! Invariant: the position of sample k is `k · step + eye`, two roundings in f32, in every kernel.

use raywright_bvh::Aabb;
use raywright_imaging::Projection;

use crate::grid::Volume;

/// A pinhole camera over a volume, with the distance between samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    /// Where rays begin, in voxels.
    pub(crate) eye: [f32; 3],
    /// World directions: to the centre of the picture, and of one pixel to the right and down.
    pub(crate) frame: [[f32; 3]; 3],
    /// Picture coordinates of the centre.
    pub(crate) centre: [f32; 2],
    /// A unit of direction, times this, is a step in voxels.
    pub(crate) scale: [f32; 3],
    /// The box in which there are samples, in voxels.
    pub(crate) low: [f32; 3],
    pub(crate) high: [f32; 3],
    /// No sample has a larger number.
    pub(crate) last_sample: f32,
    /// The last voxel; samples beyond are moved onto it.
    pub(crate) last_voxel: [f32; 3],
    /// More than any position of a sample in the box is off by, in voxels.
    pub(crate) border: f32,
}

impl View {
    /// Rays of `projection` with a sample every `step` world units, inside `clip` alone if there is
    /// such a box in world units.
    pub(crate) fn new(
        volume: &Volume,
        projection: &Projection,
        step: f32,
        clip: Option<&Aabb>,
    ) -> Self {
        let (dims, spacing) = (volume.dims(), volume.spacing());
        let origin = projection.origin().to_array();
        let last_voxel = dims.map(|n| (n - 1) as f32);
        // A single layer has the thickness of one voxel.
        let is_thin = dims.map(|n| n == 1);
        let per_axis = |value: fn(f32, f32) -> f32, of: [f32; 3]| {
            std::array::from_fn(|axis| value(of[axis], spacing[axis]))
        };
        let eye = per_axis(|o, s| (f64::from(o) / f64::from(s)) as f32, origin);
        let farthest = |axis: usize| eye[axis].abs() + last_voxel[axis];
        let farthest = farthest(0).max(farthest(1)).max(farthest(2));
        let low: [f32; 3] = std::array::from_fn(|axis| {
            let low: f32 = if is_thin[axis] { -0.5 } else { 0.0 };
            clip.map_or(low, |clip| low.max(clip.min[axis] / spacing[axis]))
        });
        let high: [f32; 3] = std::array::from_fn(|axis| {
            let high = if is_thin[axis] { 0.5 } else { last_voxel[axis] };
            clip.map_or(high, |clip| high.min(clip.max[axis] / spacing[axis]))
        });
        let is_empty = (0..3).any(|axis| low[axis] > high[axis]);
        Self {
            eye,
            frame: projection.frame().map(|v| v.to_array()),
            centre: projection.centre(),
            scale: per_axis(|step, s| step / s, [step; 3]),
            low,
            high,
            last_sample: if is_empty { -1.0 } else { LAST_SAMPLE },
            last_voxel,
            border: (1.0 / 64.0_f32).max(4.0 * f32::EPSILON * farthest),
        }
    }
}

/// Largest number of a sample: above, floats do not hold every integer.
const LAST_SAMPLE: f32 = (1 << 24) as f32;

/// Components of a step below this are taken for 0: their reciprocal might be infinite.
pub(crate) const SMALLEST_STEP: f32 = 1e-30;
