//! The slow twin: one ray after the other, every sample of the box, nothing skipped.

use super::{
    Frame, RayResult,
    view::{RayLattice, Rays, SMALLEST_STEP, View},
};
use crate::{appearance::Interpolation, grid::Volume, table::TransferTable};

/// Casts the ray through the centre of a pixel.
pub(crate) fn cast(frame: &Frame<'_>, x: u32, y: u32) -> RayResult {
    let view = &frame.view;
    let lattice = lattice(view, x as f32 + 0.5, y as f32 + 0.5, view.jitter_of(x, y));
    let samples = Samples {
        volume: frame.volume,
        lattice: &lattice,
        view,
        table: frame.table,
        interpolation: frame
            .details
            .map_or(Interpolation::Trilinear, |d| d.interpolation),
    };
    let mut ray = RayResult::NOTHING;
    let (mut k, mut front) = (lattice.first, f32::NAN);
    while k <= lattice.last {
        let value = samples.value(samples.place(k));
        match frame.details {
            Some(details) => details.look(&samples, &mut ray, k, [front, value]),
            None if value.is_nan() => {}
            None => {
                let entry = frame.table.index.of(value);
                let [r, g, b, _] = frame.table.colours[entry].map(f32::from);
                add(&mut ray, frame.table.opacities[entry], [r, g, b]);
            }
        }
        front = value;
        k += 1.0;
        ray.end = k + lattice.number;
        ray.work.samples += 1;
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

/// The samples of the ray through a point of the picture, moved by a share of a step.
pub(crate) fn lattice(view: &View, x: f32, y: f32, jitter: f32) -> RayLattice {
    let rays = match &view.rays {
        Rays::Near(rays) => rays,
        Rays::Exact(rays) => return rays.lattice(view, x, y, jitter),
    };
    let across = x - rays.centre[0];
    let down = y - rays.centre[1];
    let [forward, right, below] = rays.frame;
    let d: [f32; 3] = std::array::from_fn(|i| forward[i] + right[i] * across + below[i] * down);
    let unit = 1.0 / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
    let step: [f32; 3] = std::array::from_fn(|axis| d[axis] * unit * rays.scale[axis]);
    let origin = std::array::from_fn(|axis| rays.eye[axis] + jitter * step[axis]);
    let (mut first, mut last) = (view.first_sample(), view.last_sample);
    for axis in 0..3 {
        let (origin, step): (f32, f32) = (origin[axis], step[axis]);
        let (low, high) = (view.low[axis], view.high[axis]);
        if step.abs() < SMALLEST_STEP {
            if !(low..=high).contains(&origin) {
                last = -1.0;
            }
            continue;
        }
        let reciprocal = 1.0 / step;
        let (a, b) = ((low - origin) * reciprocal, (high - origin) * reciprocal);
        first = first.max(a.min(b));
        last = last.min(a.max(b));
    }
    RayLattice {
        origin,
        step,
        first: first.ceil(),
        last: last.floor(),
        number: 0.0,
    }
}

/// The values along rays.
pub(crate) struct Samples<'a> {
    volume: &'a Volume,
    pub(crate) lattice: &'a RayLattice,
    pub(crate) view: &'a View,
    pub(crate) table: &'a TransferTable<'a>,
    interpolation: Interpolation,
}

impl Samples<'_> {
    /// Where a sample lies, in voxels.
    pub(crate) fn place(&self, k: f32) -> [f32; 3] {
        std::array::from_fn(|axis| {
            let place = k * self.lattice.step[axis] + self.lattice.origin[axis];
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
