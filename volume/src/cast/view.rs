//! What all rays of a picture share, in the space of voxels, and where each of them has its samples.
//!
//! Samples lie at t = (k + j)·Δ along a ray, k = 1, 2, …, the jitter j being 0 as a rule: one lattice
//! that is anchored at the eye, or at the plane through it, and not where a ray enters. So whatever is
//! left out, by blocks, tiles or a clip box, moves no sample.
//!
//! Rays are set up in f32 and in lanes as long as that is good to 10⁻³ voxels. If the eye is far away,
//! or rays are parallel, a ray is set up in f64, and its samples are counted from a number shortly
//! before the volume instead of from the eye: the positions are those of the same lattice.
//!
//! Invariant: the position of sample k is `k · step + origin`, two roundings in f32, in every kernel.

use raywright_bvh::Aabb;
use raywright_imaging::{Bundle, PictureFrame};

use super::{CastError, Jitter};
use crate::grid::Volume;

/// The rays of a picture over a volume, with the distance between samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    pub(crate) rays: Rays,
    pub(crate) jitter: Jitter,
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

/// How rays are set up.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Rays {
    /// From an eye that is not far, in f32.
    Near(NearRays),
    /// In f64.
    Exact(ExactRays),
}

/// A pinhole camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearRays {
    /// Where rays begin, in voxels.
    pub(crate) eye: [f32; 3],
    /// World directions: to the centre of the picture, and of one pixel to the right and down.
    pub(crate) frame: [[f32; 3]; 3],
    /// Picture coordinates of the centre.
    pub(crate) centre: [f32; 2],
    /// A unit of direction, times this, is a step in voxels.
    pub(crate) scale: [f32; 3],
}

/// Any camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExactRays {
    frame: PictureFrame,
    spacing: [f64; 3],
    /// A unit of direction, times this, is a step in voxels.
    scale: [f64; 3],
    /// The box of the whole volume, in voxels.
    low: [f64; 3],
    high: [f64; 3],
    /// From here on samples are counted in a picture.
    base: f64,
}

/// The samples of a ray: sample k is at `k · step + origin` voxels, for k from `first` to `last`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RayLattice {
    pub(crate) origin: [f32; 3],
    pub(crate) step: [f32; 3],
    pub(crate) first: f32,
    pub(crate) last: f32,
    /// In the picture sample 0 has this number.
    pub(crate) number: f32,
}

impl RayLattice {
    /// A ray without samples.
    pub(crate) const NONE: Self = Self {
        origin: [0.0; 3],
        step: [0.0; 3],
        first: 1.0,
        last: 0.0,
        number: 0.0,
    };
}

impl View {
    /// Rays of `frame` with a sample every `step` lengths of a voxel, inside `clip` alone if there is
    /// such a box in world units.
    pub(crate) fn new(
        volume: &Volume,
        frame: &PictureFrame,
        step: f32,
        clip: Option<&Aabb>,
        jitter: Jitter,
    ) -> Result<Self, CastError> {
        let (dims, spacing) = (volume.dims(), volume.spacing());
        let last_voxel = dims.map(|n| (n - 1) as f32);
        let sides = sides(volume);
        let low: [f32; 3] = std::array::from_fn(|axis| {
            let low = sides[axis][0];
            clip.map_or(low, |clip| low.max(clip.min[axis] / spacing[axis]))
        });
        let high: [f32; 3] = std::array::from_fn(|axis| {
            let high = sides[axis][1];
            clip.map_or(high, |clip| high.min(clip.max[axis] / spacing[axis]))
        });
        let is_empty = (0..3).any(|axis| low[axis] > high[axis]);
        let exact = ExactRays::new(volume, frame, step, sides)?;
        let eye = exact.voxels(frame.origin.to_array());
        let farthest = |axis: usize| eye[axis].abs() + f64::from(last_voxel[axis]);
        let farthest = farthest(0).max(farthest(1)).max(farthest(2));
        let is_near = frame.bundle == Bundle::FromPoint
            && farthest <= NEAR
            && exact.farthest_sample(eye) <= f64::from(LAST_SAMPLE);
        let (rays, farthest) = if is_near {
            let narrow = |v: [f64; 3]| v.map(|v| v as f32);
            let directions = [frame.forward, frame.right_per_pixel, frame.down_per_pixel];
            let rays = NearRays {
                eye: narrow(eye),
                frame: directions.map(|v| narrow(v.to_array())),
                centre: frame.centre.map(|v| v as f32),
                scale: narrow(exact.scale),
            };
            (Rays::Near(rays), farthest as f32)
        } else {
            // Numbers begin within two samples of the box.
            let side = |axis: usize| last_voxel[axis] + 3.0 * exact.scale[axis].min(1e30) as f32;
            (Rays::Exact(exact), side(0).max(side(1)).max(side(2)))
        };
        Ok(Self {
            rays,
            jitter,
            low,
            high,
            last_sample: if is_empty { -1.0 } else { LAST_SAMPLE },
            last_voxel,
            border: (1.0 / 64.0_f32).max(4.0 * f32::EPSILON * farthest),
        })
    }

    /// The number of the sample of a ray from which samples are counted in a picture.
    pub(crate) fn base(&self) -> f64 {
        match &self.rays {
            Rays::Near(_) => 0.0,
            Rays::Exact(rays) => rays.base,
        }
    }

    /// The smallest number that a sample may have: none lies at the eye itself.
    pub(crate) fn first_sample(&self) -> f32 {
        match self.jitter {
            Jitter::None => 1.0,
            Jitter::PerPixel => 0.0,
        }
    }

    /// By how much of a step the samples of a pixel are moved away from the eye.
    pub(crate) fn jitter_of(&self, x: u32, y: u32) -> f32 {
        match self.jitter {
            Jitter::None => 0.0,
            Jitter::PerPixel => {
                // The finaliser of splitmix64 (Steele, Lea, Flood 2014), which mixes all bits.
                let mut bits =
                    (u64::from(y) << 32 | u64::from(x)).wrapping_add(0x9e37_79b9_7f4a_7c15);
                bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
                // In the middle of one of 2^23 intervals, so that no sample lies at the eye.
                ((bits ^ bits >> 31) >> 41) as f32 / 8_388_608.0 + 0.5 / 8_388_608.0
            }
        }
    }
}

impl ExactRays {
    fn new(
        volume: &Volume,
        frame: &PictureFrame,
        step: f32,
        sides: [[f32; 2]; 3],
    ) -> Result<Self, CastError> {
        let spacing = volume.spacing().map(f64::from);
        let step = f64::from(step) * f64::from(volume.unit_length());
        let mut rays = Self {
            frame: *frame,
            spacing,
            scale: spacing.map(|s| step / s),
            low: sides.map(|side| side[0].into()),
            high: sides.map(|side| side[1].into()),
            base: 0.0,
        };
        let origin = frame.origin.to_array();
        let eye = rays.voxels(origin);
        let distance = eye.into_iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        if distance > FARTHEST {
            return Err(CastError::TooFar {
                distance,
                limit: FARTHEST,
            });
        }
        let samples = length(std::array::from_fn(|axis| {
            (rays.high[axis] - rays.low[axis]) * spacing[axis]
        })) / step;
        // A few more: rays begin before the box.
        let limit = f64::from(LAST_SAMPLE) - 8.0;
        if samples > limit {
            return Err(CastError::TooManySamples { samples, limit });
        }
        // The distance from the eye, or from the plane through it, to the box.
        let distance = match frame.bundle {
            Bundle::FromPoint => length(std::array::from_fn(|axis| {
                let inside = eye[axis].clamp(rays.low[axis], rays.high[axis]);
                (inside - eye[axis]) * spacing[axis]
            })),
            Bundle::Parallel => (0..3)
                .map(|axis| {
                    let along = frame.forward[axis];
                    let nearest = if along > 0.0 {
                        rays.low[axis]
                    } else {
                        rays.high[axis]
                    };
                    (nearest - eye[axis]) * spacing[axis] * along
                })
                .sum(),
        };
        rays.base = base_before(distance / step);
        Ok(rays)
    }

    fn voxels(&self, world: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| world[axis] / self.spacing[axis])
    }

    /// More than the number of any sample of a ray from a point in the box, or from the point to it.
    fn farthest_sample(&self, eye: [f64; 3]) -> f64 {
        let step = self.scale[0] * self.spacing[0];
        let farthest = |axis: usize| {
            let side = (eye[axis] - self.low[axis])
                .abs()
                .max((eye[axis] - self.high[axis]).abs());
            side * self.spacing[axis]
        };
        length([farthest(0), farthest(1), farthest(2)]) / step
    }

    /// The ray through a point of the picture; `view` has the box that may be cut.
    pub(crate) fn lattice(&self, view: &View, x: f32, y: f32, jitter: f32) -> RayLattice {
        let [start, direction] = self.frame.ray(x.into(), y.into());
        let start = self.voxels(start.to_array());
        let step: [f64; 3] = std::array::from_fn(|axis| direction[axis] * self.scale[axis]);
        // The whole volume decides where numbers begin: a clip box must move nothing.
        let [first, _] = interval(start, step, self.low, self.high);
        let base = base_before(first);
        let from = base + f64::from(jitter);
        let start: [f64; 3] = std::array::from_fn(|axis| start[axis] + from * step[axis]);
        let [first, last] = interval(
            start,
            step,
            view.low.map(f64::from),
            view.high.map(f64::from),
        );
        RayLattice {
            origin: start.map(|v| v as f32),
            step: step.map(|v| v as f32),
            first: first.max(f64::from(view.first_sample())).ceil() as f32,
            last: last.min(f64::from(view.last_sample)).floor() as f32,
            number: (base - self.base) as f32,
        }
    }
}

/// Where there are samples along each axis, in voxels.
pub(crate) fn sides(volume: &Volume) -> [[f32; 2]; 3] {
    volume.dims().map(|n| {
        // A single layer has the thickness of one voxel.
        if n == 1 {
            [-0.5, 0.5]
        } else {
            [0.0, (n - 1) as f32]
        }
    })
}

/// Where a ray is inside a box, in samples; the first is larger if it is not.
fn interval(start: [f64; 3], step: [f64; 3], low: [f64; 3], high: [f64; 3]) -> [f64; 2] {
    let (mut first, mut last) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        if step[axis].abs() < f64::from(SMALLEST_STEP) {
            if !(low[axis]..=high[axis]).contains(&start[axis]) {
                last = f64::NEG_INFINITY;
            }
            continue;
        }
        let [a, b] = [low[axis], high[axis]].map(|side| (side - start[axis]) / step[axis]);
        first = first.max(a.min(b));
        last = last.min(a.max(b));
    }
    [first, last]
}

/// A number at least one sample before the box that is `samples` away; 0 if it is not away.
fn base_before(samples: f64) -> f64 {
    (samples.floor() - 1.0).max(0.0)
}

fn length(v: [f64; 3]) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

/// Largest number of a sample: above, floats do not hold every integer.
pub(crate) const LAST_SAMPLE: f32 = (1 << 24) as f32;

/// Up to here, in voxels, rays that are set up in f32 have their samples where they belong to less
/// than 10⁻³ voxels.
pub(crate) const NEAR: f64 = 2048.0;

/// Up to here, in voxels, f64 places samples to 10⁻³ voxels.
const FARTHEST: f64 = (1_u64 << 40) as f64;

/// Components of a step below this are taken for 0: their reciprocal might be infinite.
pub(crate) const SMALLEST_STEP: f32 = 1e-30;
