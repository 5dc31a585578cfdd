//! How long the rays of a picture will be, before they are cast: the first half of predicting what
//! the picture will take.
//!
//! After Bruder, Frey, Ertl, *Real-Time Performance Prediction and Tuning for Interactive Volume
//! Raycasting*, 2016, section 5: a few rays are followed through blocks instead of voxels. Where they
//! enter and leave the blocks in which something can be seen is exact; where they become opaque is
//! estimated, at random from histograms of opacities as the paper does, or from mean extinctions
//! without any chance.
//!
//! Invariant: an estimate is a function of volume, transfer function, camera and options alone.

mod histograms;
mod tausworthe;

use rayon::prelude::*;

use raywright_imaging::AnyCamera;

use crate::{
    blocks::Blocks,
    cast::{
        CastError, CastOptions, Jitter,
        reference::lattice,
        view::{RayLattice, SMALLEST_STEP, View},
    },
    grid::Volume,
    table::{BakedFunction, DEFAULT_SIZE, TableIndex},
    transfer::TransferFunction,
};
use histograms::{Cut, Histograms, OpacityHistograms};
use tausworthe::HybridTausworthe;

/// Binary logarithm of the edge of a block.
const BLOCK_SHIFT: u32 = 4;

/// Side of the square of pixels for which one ray stands.
pub const TILE_SIZE: u32 = 8;

/// Distance between draws, in lengths of a voxel.
const COARSE_STEP: f32 = 8.0;

/// How the place is estimated where a ray becomes opaque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EstimateMethod {
    /// Draws from opacities in bins of equal size, each standing for its middle, which seems to be
    /// the paper's way: far off for clouds.
    PaperLinear,
    /// Draws from opacities in bins of equal size of the cube root, each standing for its mean.
    CubeRoot,
    /// The mean extinction of each block.
    MeanExtinction,
}

impl EstimateMethod {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::PaperLinear, Self::CubeRoot, Self::MeanExtinction];
}

/// What a ray of the estimate found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EstimatedRay {
    /// Number of the sample, counted as in [`Picture`](crate::Picture), at which it enters the first block in which something can be seen.
    pub front: f32,
    /// Number of the sample at which it leaves the last one.
    pub back: f32,
    /// Number of the sample at which it is expected to end.
    pub end: f32,
    /// Expected number of samples in blocks in which something can be seen.
    pub lit: f32,
    /// Expected number of samples of which something is seen.
    pub seen: f32,
}

impl EstimatedRay {
    /// Expected number of samples.
    #[must_use]
    pub fn samples(&self) -> f32 {
        self.end - self.front
    }
}

/// An estimate for a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Squares of pixels across and down.
    pub tiles: [u32; 2],
    /// The ray through the middle of each square, row by row.
    pub rays: Vec<EstimatedRay>,
    /// How many of them meet the box of the volume.
    pub in_box: u32,
    /// Blocks and draws that were looked at: what the estimate took.
    pub steps: u64,
}

impl Estimate {
    /// Expected number of samples of the whole picture.
    #[must_use]
    pub fn samples(&self) -> f64 {
        let pixels = f64::from(TILE_SIZE * TILE_SIZE);
        self.rays
            .iter()
            .map(|ray| f64::from(ray.samples()))
            .sum::<f64>()
            * pixels
    }
}

/// Estimates pictures of a volume.
#[derive(Clone, Debug)]
pub struct Estimator<'a> {
    volume: &'a Volume,
    blocks: Blocks,
    histograms: Histograms,
}

/// What a transfer function makes of the blocks of a volume.
#[derive(Clone, Debug)]
pub struct PreparedEstimate<'a> {
    volume: &'a Volume,
    dims: [usize; 3],
    lit: Vec<bool>,
    medium: Medium,
    /// Share of the voxels of each block of which something is seen.
    seen_shares: Vec<f32>,
}

#[derive(Clone, Debug)]
enum Medium {
    Drawn(OpacityHistograms),
    Mean(Vec<f32>),
}

/// What the rays of an estimate read.
struct March<'a> {
    view: View,
    prepared: &'a PreparedEstimate<'a>,
    step: f32,
    termination: f32,
}

impl<'a> Estimator<'a> {
    /// Counts the values in the blocks of a volume.
    #[must_use]
    pub fn new(volume: &'a Volume) -> Self {
        let blocks = Blocks::new(volume, BLOCK_SHIFT, TableIndex::new(volume, DEFAULT_SIZE));
        Self {
            volume,
            histograms: Histograms::new(volume, &blocks),
            blocks,
        }
    }

    /// Prepares the blocks for a transfer function. It pays when more than one picture is estimated
    /// with it.
    #[must_use]
    pub fn prepare(
        &self,
        function: &TransferFunction,
        method: EstimateMethod,
    ) -> PreparedEstimate<'a> {
        let baked = BakedFunction::new(function, self.volume, DEFAULT_SIZE);
        let drawn = |cut| Medium::Drawn(self.histograms.opacities(function, cut));
        PreparedEstimate {
            volume: self.volume,
            dims: self.blocks.dims,
            lit: self.blocks.lit(&baked).collect(),
            seen_shares: self.histograms.seen_shares(function),
            medium: match method {
                EstimateMethod::PaperLinear => drawn(Cut::Linear),
                EstimateMethod::CubeRoot => drawn(Cut::CubeRoot),
                EstimateMethod::MeanExtinction => {
                    Medium::Mean(self.histograms.extinctions(function))
                }
            },
        }
    }
}

impl PreparedEstimate<'_> {
    /// An estimate for a picture of `width` × `height` pixels; `frame` numbers the draws.
    ///
    /// # Errors
    /// As [`Prepared::render`](crate::Prepared::render).
    pub fn estimate(
        &self,
        camera: impl Into<AnyCamera>,
        [width, height]: [u32; 2],
        options: &CastOptions,
        frame: u32,
    ) -> Result<Estimate, CastError> {
        options.check()?;
        let rays = camera.into().picture_frame(width, height)?;
        // The ray in the middle stands for all of its square.
        let (clip, jitter) = (options.clip.as_ref(), Jitter::None);
        let march = March {
            view: View::new(self.volume, &rays, options.step, clip, jitter)?,
            prepared: self,
            step: options.step,
            termination: options.termination,
        };
        let tiles = [width, height].map(|n| n.div_ceil(TILE_SIZE));
        let rays = (0..tiles[0] * tiles[1]).into_par_iter().map(|tile| {
            let middle = |index: u32, size: u32| {
                let first = index * TILE_SIZE;
                (first + (first + TILE_SIZE).min(size)) as f32 * 0.5
            };
            let (x, y) = (tile % tiles[0], tile / tiles[0]);
            march.ray(middle(x, width), middle(y, height), [frame, tile])
        });
        let (rays, steps): (Vec<_>, Vec<_>) = rays.unzip();
        Ok(Estimate {
            tiles,
            rays,
            // A ray that meets the box passes at least one block.
            in_box: steps.iter().filter(|&&steps| steps > 0).count() as u32,
            steps: steps.iter().sum(),
        })
    }
}

/// A part of a ray in one block, in numbers of samples.
#[derive(Clone, Copy)]
struct Piece {
    start: f32,
    end: f32,
    block: usize,
}

impl March<'_> {
    /// The ray through a point of the picture, and the steps that it took.
    fn ray(&self, x: f32, y: f32, [frame, tile]: [u32; 2]) -> (EstimatedRay, u64) {
        let samples = lattice(&self.view, x, y, 0.0);
        let mut steps = 0;
        let (mut front, mut back) = (f32::INFINITY, f32::NEG_INFINITY);
        let (mut depth, mut end) = (0.0, f32::INFINITY);
        let (mut lit, mut seen) = (0.0, 0.0);
        // What a ray has to pass to be as opaque as the threshold.
        let most_depth = -(-self.termination.min(1.0)).ln_1p();
        self.pieces(&samples, |piece| {
            steps += 1;
            if !self.prepared.lit[piece.block] {
                return;
            }
            front = front.min(piece.start);
            back = piece.end;
            if let Medium::Mean(extinctions) = &self.prepared.medium {
                let per_sample = extinctions[piece.block] * self.step;
                let more = per_sample * (piece.end - piece.start);
                if depth <= most_depth && depth + more > most_depth {
                    // The sample that passes it is half a step behind, on average.
                    end = piece.start + (most_depth - depth) / per_sample + 0.5;
                }
                depth += more;
            }
            let samples = (piece.end.min(end) - piece.start).max(0.0);
            lit += samples;
            seen += samples * self.prepared.seen_shares[piece.block];
        });
        if front >= back {
            return (EstimatedRay::default(), steps);
        }
        if let Medium::Drawn(opacities) = &self.prepared.medium {
            let mut numbers = HybridTausworthe::new(frame, tile);
            // Samples from draw to draw.
            let stride = COARSE_STEP / self.step;
            let mut opacity = 0.0;
            let mut k = front;
            while k < back {
                let next = (k + stride).min(back);
                let block = self.block_at(&samples, (k + next) * 0.5);
                let drawn = opacities.draw(block, numbers.unit());
                steps += 1;
                opacity += (1.0 - opacity) * (1.0 - (1.0 - drawn).powf((next - k) * self.step));
                k = next;
                if opacity > self.termination {
                    end = k;
                    // As much of what is left as of the whole.
                    let share = (end - front) / (back - front);
                    lit *= share;
                    seen *= share;
                    break;
                }
            }
        }
        let ray = EstimatedRay {
            front: front + samples.number,
            back: back + samples.number,
            end: end.min(back) + samples.number,
            lit,
            seen,
        };
        (ray, steps)
    }

    /// The block along one axis at a sample.
    fn block_along(&self, axis: usize, samples: &RayLattice, k: f32) -> usize {
        let place = (k * samples.step[axis] + samples.origin[axis]).max(0.0);
        (place as usize >> BLOCK_SHIFT).min(self.prepared.dims[axis] - 1)
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        let [across, down, _] = self.prepared.dims;
        (z * down + y) * across + x
    }

    fn block_at(&self, samples: &RayLattice, k: f32) -> usize {
        self.index(std::array::from_fn(|axis| {
            self.block_along(axis, samples, k)
        }))
    }

    /// Tells the parts of a ray in the blocks that it passes, in order: Amanatides, Woo, *A Fast Voxel
    /// Traversal Algorithm for Ray Tracing*, 1987, each border computed anew.
    fn pieces(&self, samples: &RayLattice, mut tell: impl FnMut(Piece)) {
        let RayLattice {
            origin,
            step,
            first,
            last,
            ..
        } = *samples;
        if first > last {
            return;
        }
        let per_step = step.map(|step| 1.0 / step);
        let mut block = [0, 1, 2].map(|axis| self.block_along(axis, samples, first));
        // The number of the sample at which the ray leaves its block along an axis.
        let exit = |axis: usize, block: usize| {
            let inner = if step[axis] < 0.0 { block } else { block + 1 };
            let is_last = inner == 0 || inner == self.prepared.dims[axis];
            if is_last || step[axis].abs() < SMALLEST_STEP {
                f32::INFINITY
            } else {
                ((inner << BLOCK_SHIFT) as f32 - origin[axis]) * per_step[axis]
            }
        };
        let mut exits = [0, 1, 2].map(|axis| exit(axis, block[axis]));
        let mut start = first;
        loop {
            let next = exits[0].min(exits[1]).min(exits[2]);
            let end = next.min(last + 1.0);
            if end > start {
                tell(Piece {
                    start,
                    end,
                    block: self.index(block),
                });
                start = end;
            }
            if next > last {
                return;
            }
            for axis in 0..3 {
                if exits[axis] <= next {
                    // Not beyond the border: there is no exit.
                    block[axis] = if step[axis] < 0.0 {
                        block[axis] - 1
                    } else {
                        block[axis] + 1
                    };
                    exits[axis] = exit(axis, block[axis]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use raywright_imaging::Camera;

    use super::*;
    use crate::{
        Raycaster,
        grid::{ValueScale, Voxels},
        transfer::ControlPoint,
    };

    fn constant(opacity: f32) -> (Volume, TransferFunction, Camera) {
        let voxels = Voxels::U8(vec![7; 65 * 65 * 65]);
        let volume = Volume::new([65; 3], [1.0; 3], voxels, ValueScale::default()).unwrap();
        let point = ControlPoint {
            value: 0.0,
            colour: [1.0; 3],
            opacity,
        };
        let camera = Camera::new(
            Vec3::new(32.0, 30.0, -90.0),
            Vec3::splat(32.0),
            Vec3::Y,
            30.0,
        );
        let function = TransferFunction::new(vec![point]).unwrap();
        (volume, function, camera.unwrap())
    }

    #[test]
    fn in_a_constant_medium_the_estimate_is_exact() {
        for opacity in [0.01, 0.05, 0.3] {
            let (volume, function, camera) = constant(opacity);
            let caster = Raycaster::new(&volume).unwrap();
            let estimator = Estimator::new(&volume);
            for step in [0.5, 1.0, 2.0] {
                let options = CastOptions {
                    step,
                    ..CastOptions::default()
                };
                let size = [96, 96];
                let picture = caster.render(&function, camera, size, &options).unwrap();
                let samples = picture.work.samples as f64;
                for method in EstimateMethod::ALL {
                    let estimate = estimator
                        .prepare(&function, method)
                        .estimate(camera, size, &options, 0)
                        .unwrap();
                    let ratio = estimate.samples() / samples;
                    // Draws end in coarse steps; silhouettes are known by squares of pixels.
                    let allowed = match method {
                        EstimateMethod::MeanExtinction => 0.06,
                        _ => 0.04 + 8.0 / (-(0.02_f64.ln()) / f64::from(opacity)).min(64.0),
                    };
                    assert!(
                        (ratio - 1.0).abs() < allowed,
                        "{method:?} {opacity} {step}: {ratio}"
                    );
                }
            }
        }
    }

    #[test]
    fn nothing_to_see_is_nothing_to_sample() {
        let (volume, function, camera) = constant(0.0);
        let estimator = Estimator::new(&volume);
        for method in EstimateMethod::ALL {
            let options = CastOptions::default();
            let estimate = estimator
                .prepare(&function, method)
                .estimate(camera, [33, 17], &options, 5)
                .unwrap();
            assert_eq!(estimate.tiles, [5, 3]);
            assert!(
                estimate
                    .rays
                    .iter()
                    .all(|ray| *ray == EstimatedRay::default())
            );
            assert!(estimate.steps > 0);
        }
    }
}
