//! The slow twin: one ray after the other, every sample of the box, nothing skipped.

use super::{
    Frame, RayResult,
    view::{SMALLEST_STEP, View},
};
use crate::grid::Volume;

/// Casts the ray through the centre of a pixel.
pub(crate) fn cast(frame: &Frame<'_>, x: u32, y: u32) -> RayResult {
    let (step, first, last) = lattice(&frame.view, x as f32 + 0.5, y as f32 + 0.5);
    let mut ray = RayResult {
        colour: [0.0; 3],
        opacity: 0.0,
        end: 0.0,
    };
    let mut k = first;
    while k <= last {
        let position = std::array::from_fn(|axis| k * step[axis] + frame.view.eye[axis]);
        let raw = interpolate(frame.volume, &frame.view, position);
        k += 1.0;
        ray.end = k;
        if raw.is_nan() {
            continue;
        }
        let entry = frame.table.index.of(raw);
        let weight = (1.0 - ray.opacity) * frame.table.opacities[entry];
        for (sum, &colour) in ray.colour.iter_mut().zip(&frame.table.colours[entry]) {
            *sum += weight * f32::from(colour);
        }
        ray.opacity += weight;
        if ray.opacity > frame.termination {
            break;
        }
    }
    ray
}

/// The step of the ray through a point of the picture, in voxels, and its first and last sample.
pub(crate) fn lattice(view: &View, x: f32, y: f32) -> ([f32; 3], f32, f32) {
    let across = x - view.centre[0];
    let down = y - view.centre[1];
    let [forward, right, below] = view.frame;
    let d: [f32; 3] = std::array::from_fn(|i| forward[i] + right[i] * across + below[i] * down);
    let unit = 1.0 / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
    let step = std::array::from_fn(|axis| d[axis] * unit * view.scale[axis]);
    let (mut first, mut last) = (1.0_f32, view.last_sample);
    for axis in 0..3 {
        let (eye, step): (f32, f32) = (view.eye[axis], step[axis]);
        if step.abs() < SMALLEST_STEP {
            if !(view.low[axis]..=view.high[axis]).contains(&eye) {
                last = -1.0;
            }
            continue;
        }
        let reciprocal = 1.0 / step;
        let (a, b) = (
            (view.low[axis] - eye) * reciprocal,
            (view.high[axis] - eye) * reciprocal,
        );
        first = first.max(a.min(b));
        last = last.min(a.max(b));
    }
    (step, first.ceil(), last.floor())
}

/// The raw value at a place.
fn interpolate(volume: &Volume, view: &View, position: [f32; 3]) -> f32 {
    let dims = volume.dims();
    let (mut cell, mut share) = ([0; 3], [0.0; 3]);
    for axis in 0..3 {
        let place = position[axis].max(0.0).min(view.last_voxel[axis]);
        cell[axis] = (place as usize).min(dims[axis].saturating_sub(2));
        share[axis] = place - cell[axis] as f32;
    }
    let raw = |corner: usize| {
        let at = |axis: usize| (cell[axis] + (corner >> axis & 1)).min(dims[axis] - 1);
        volume.raw((at(2) * dims[1] + at(1)) * dims[0] + at(0))
    };
    let lerp = |a: f32, b: f32, share: f32| a + (b - a) * share;
    let along_x = |corner: usize| lerp(raw(corner), raw(corner + 1), share[0]);
    let along_y = |corner: usize| lerp(along_x(corner), along_x(corner + 2), share[1]);
    lerp(along_y(0), along_y(4), share[2])
}
