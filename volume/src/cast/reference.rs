//! The slow twin: one ray after the other, every sample of the box, nothing skipped.

use super::{
    Frame, RayResult,
    view::{SMALLEST_STEP, View},
};
use crate::{appearance::Interpolation, grid::Volume, table::TransferTable};

/// Casts the ray through the centre of a pixel.
pub(crate) fn cast(frame: &Frame<'_>, x: u32, y: u32) -> RayResult {
    let (step, first, last) = lattice(&frame.view, x as f32 + 0.5, y as f32 + 0.5);
    let samples = Samples {
        volume: frame.volume,
        view: &frame.view,
        table: frame.table,
        interpolation: frame
            .details
            .map_or(Interpolation::Trilinear, |d| d.interpolation),
    };
    let mut ray = RayResult::NOTHING;
    let (mut k, mut front) = (first, f32::NAN);
    while k <= last {
        let value = samples.value(samples.place(k, step));
        match frame.details {
            Some(details) => details.look(&samples, &mut ray, step, k, [front, value]),
            None if value.is_nan() => {}
            None => {
                let entry = frame.table.index.of(value);
                let [r, g, b, _] = frame.table.colours[entry].map(f32::from);
                add(&mut ray, frame.table.opacities[entry], [r, g, b]);
            }
        }
        front = value;
        k += 1.0;
        ray.end = k;
        if ray.opacity > frame.termination {
            break;
        }
    }
    ray
}

/// Lays something behind what a ray has gathered.
pub(crate) fn add(ray: &mut RayResult, opacity: f32, colour: [f32; 3]) {
    let weight = (1.0 - ray.opacity) * opacity;
    for (sum, colour) in ray.colour.iter_mut().zip(colour) {
        *sum += weight * colour;
    }
    ray.opacity += weight;
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

/// The values along rays.
pub(crate) struct Samples<'a> {
    volume: &'a Volume,
    pub(crate) view: &'a View,
    pub(crate) table: &'a TransferTable<'a>,
    interpolation: Interpolation,
}

impl Samples<'_> {
    /// Where a sample lies, in voxels.
    pub(crate) fn place(&self, k: f32, step: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|axis| {
            let place = k * step[axis] + self.view.eye[axis];
            place.max(0.0).min(self.view.last_voxel[axis])
        })
    }

    /// The raw value at a place.
    pub(crate) fn value(&self, place: [f32; 3]) -> f32 {
        let dims = self.volume.dims();
        if self.interpolation == Interpolation::Nearest {
            let at = |axis: usize| ((place[axis] + 0.5) as usize).min(dims[axis] - 1);
            return self.volume.raw((at(2) * dims[1] + at(1)) * dims[0] + at(0));
        }
        let (mut cell, mut share) = ([0; 3], [0.0; 3]);
        for axis in 0..3 {
            cell[axis] = (place[axis] as usize).min(dims[axis].saturating_sub(2));
            share[axis] = place[axis] - cell[axis] as f32;
        }
        let raw = |corner: usize| {
            let at = |axis: usize| (cell[axis] + (corner >> axis & 1)).min(dims[axis] - 1);
            self.volume.raw((at(2) * dims[1] + at(1)) * dims[0] + at(0))
        };
        let lerp = |a: f32, b: f32, share: f32| a + (b - a) * share;
        let along_x = |corner: usize| lerp(raw(corner), raw(corner + 1), share[0]);
        let along_y = |corner: usize| lerp(along_x(corner), along_x(corner + 2), share[1]);
        lerp(along_y(0), along_y(4), share[2])
    }
}
