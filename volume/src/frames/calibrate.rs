//! What parts of a frame cost on this machine, before the first frame.
//!
//! Three pictures, each with one kind of work more: the volume is out of view, is transparent, is thin
//! fog. What is common to rays and jumps over nothing cannot be told apart by them, nor samples from
//! those of which something is seen: these keep the ratio that they were given.
//!
//! Invariant: costs are above 0 and finite, whatever the clock says.

use glam::Vec3;
use raywright_bvh::BuildWorkspace;
use raywright_imaging::Camera;

use super::{Control, FrameClock, FrameError, FrameLoopParams};
use crate::{
    cast::{CastOptions, Prepared, Raycaster, Work},
    grid::Volume,
    predict::{Counts, WorkCosts},
    transfer::{ControlPoint, TransferFunction},
};

/// Each picture is drawn so many times, and the median of times counts.
const REPETITIONS: usize = 5;

/// Opacity of the fog: no ray of usual length ends in it.
const FOG: f32 = 1e-5;

/// The step in the fog, lengths of a voxel, as usual; and the side of its picture over that of others,
/// so that it is not long in drawing.
const STEP: f32 = 1.0;
const FOG_SIDE: f32 = 0.5;

/// The costs that a loop with these parameters would see.
pub(super) fn costs(
    volume: &Volume,
    caster: &Raycaster<'_>,
    params: &FrameLoopParams,
    clock: &mut impl FrameClock,
) -> Result<WorkCosts, FrameError> {
    let given = params.predictor.cold_start;
    let [towards, away] = cameras(volume);
    let mut workspace = BuildWorkspace::default();
    let mut prepare =
        |opacity| super::prepare(caster, params, &mut workspace, &uniform(opacity).into());
    let (nothing, fog) = (prepare(0.0)?, prepare(FOG)?);
    let mut measure = |prepared: &Prepared<'_>, camera, side: f32| {
        let size = params.size.map(|n| (n as f32 * side).ceil() as u32);
        median(prepared, camera, size, params, clock)
    };
    let (_, fixed) = measure(&nothing, away, 1.0)?;
    let (jumps, jumps_time) = measure(&nothing, towards, 1.0)?;
    let (samples, samples_time) = measure(&fog, towards, FOG_SIDE)?;

    let mut costs = given;
    costs.fixed = positive(fixed, given.fixed);
    let rays_and_jumps =
        |counts: &Counts, costs: &WorkCosts| costs.ray * counts.rays + costs.skip * counts.skips;
    let ratio = (jumps_time - costs.fixed) / rays_and_jumps(&jumps, &given);
    let ratio = positive(ratio, costs.fixed / given.fixed);
    costs.ray *= ratio;
    costs.skip *= ratio;
    let others = costs.fixed + rays_and_jumps(&samples, &costs);
    let expected = given.sample * samples.samples + given.lit * samples.lit;
    let ratio = positive((samples_time - others) / expected, ratio);
    costs.sample *= ratio;
    costs.lit *= ratio;
    Ok(costs)
}

/// A picture's work and its median time.
fn median(
    prepared: &Prepared<'_>,
    camera: Camera,
    size: [u32; 2],
    params: &FrameLoopParams,
    clock: &mut impl FrameClock,
) -> Result<(Counts, f64), FrameError> {
    let options = CastOptions {
        step: STEP,
        clip: None,
        ..params.options
    };
    let (mut work, mut times) = (Work::default(), [0.0; REPETITIONS]);
    for time in &mut times {
        clock.start(0);
        let picture = match params.control {
            Control::Whole => prepared.render(camera, size, &options)?,
            Control::Parts => prepared.render_in_parts(camera, size, &options, |_, _| STEP)?,
        };
        work = picture.work;
        *time = clock.elapsed(&work);
    }
    times.sort_by(f64::total_cmp);
    Ok((Counts::from(&work), times[REPETITIONS / 2]))
}

/// A camera that has the volume in its picture, and one that has not.
fn cameras(volume: &Volume) -> [Camera; 2] {
    let extent = volume.extent();
    let origin = extent * 0.5 + extent.length() * Vec3::new(0.3, 0.4, 1.0);
    let camera = |target| Camera {
        origin,
        target,
        up: Vec3::Y,
        vertical_fov_degrees: 45.0,
    };
    [camera(extent * 0.5), camera(origin * 2.0 - extent * 0.5)]
}

/// A function that has one opacity everywhere.
fn uniform(opacity: f32) -> TransferFunction {
    let point = ControlPoint {
        value: 0.0,
        colour: [1.0; 3],
        opacity,
    };
    TransferFunction::new(vec![point]).expect("one point in range")
}

/// A number that can be a cost, or else another.
fn positive(value: f64, otherwise: f64) -> f64 {
    if value > 0.0 && value.is_finite() {
        value
    } else {
        otherwise
    }
}
