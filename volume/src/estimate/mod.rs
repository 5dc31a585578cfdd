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
mod march;
mod small_blocks;
mod tausworthe;

use std::sync::Arc;

use rayon::prelude::*;

use raywright_imaging::AnyCamera;

use crate::{
    blocks::Blocks,
    cast::{CastError, CastOptions, Jitter, Prepared, view::View},
    grid::Volume,
    table::{BakedFunction, DEFAULT_SIZE, TableIndex},
    transfer::TransferFunction,
};
use histograms::{Cut, Histograms, OpacityHistograms};
use march::March;
use small_blocks::SmallBlocks;

/// Binary logarithm of the edge of a block.
const BLOCK_SHIFT: u32 = 4;

/// Side of the square of pixels for which one ray stands, at least.
pub const TILE_SIZE: u32 = 8;

/// Rays of an estimate, at most: squares of large pictures are larger.
const MOST_RAYS: u64 = 2048;

/// From so many rays on, the jumps of one in four are followed.
const RAYS_WITH_JUMPS: u32 = 512;

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
    /// Expected number of jumps over empty space: 0 where a neighbour tells those of both; where the blocks of
    /// a caster are not known, the blocks that were looked at.
    pub jumps: f32,
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
    /// Side of the squares, pixels: [`TILE_SIZE`], doubled until there are few enough.
    pub tile_size: u32,
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
        let pixels = f64::from(self.tile_size).powi(2);
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
    /// The blocks that a caster skips by, if they are known.
    small: Option<SmallBlocks>,
}

#[derive(Clone, Debug)]
enum Medium {
    Drawn(OpacityHistograms),
    Mean(Vec<f32>),
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
            small: None,
        }
    }
}

impl PreparedEstimate<'_> {
    /// Lets the estimate know the small blocks by which a caster skips, for the same transfer function:
    /// samples are expected in those of them alone in which something can be seen, surfaces too. Where
    /// rays enter and leave is not changed by it. Draws know nothing of it, as in the paper.
    #[must_use]
    pub fn with_blocks_of(mut self, prepared: &Prepared<'_>) -> Self {
        if let Medium::Mean(_) = self.medium {
            let small = SmallBlocks::new(Arc::clone(prepared.distances()), self.dims);
            for (lit, mask) in self.lit.iter_mut().zip(&small.masks) {
                *lit |= *mask != 0;
            }
            self.small = Some(small);
        }
        self
    }

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
            most_depth: -(-options.termination.min(1.0)).ln_1p(),
        };
        let tile_size = tile_size(width, height);
        let tiles = [width, height].map(|n| n.div_ceil(tile_size));
        // To follow jumps takes longer than all the rest.
        let jumps_every = if tiles[0] * tiles[1] < RAYS_WITH_JUMPS {
            1
        } else {
            2
        };
        let rays = (0..tiles[0] * tiles[1]).into_par_iter().map(|tile| {
            let middle = |index: u32, size: u32| {
                let first = index * tile_size;
                (first + (first + tile_size).min(size)) as f32 * 0.5
            };
            let (x, y) = (tile % tiles[0], tile / tiles[0]);
            let with_jumps = (x | y).is_multiple_of(jumps_every);
            march.ray(
                [middle(x, width), middle(y, height)],
                [frame, tile],
                with_jumps.then_some((jumps_every * jumps_every) as f32),
            )
        });
        let (rays, steps): (Vec<_>, Vec<_>) = rays.unzip();
        Ok(Estimate {
            tile_size,
            tiles,
            rays,
            // A ray that meets the box passes at least one block.
            in_box: steps.iter().filter(|&&steps| steps > 0).count() as u32,
            steps: steps.iter().sum(),
        })
    }
}

/// The side of squares of a picture.
fn tile_size(width: u32, height: u32) -> u32 {
    let mut side = TILE_SIZE;
    while u64::from(width.div_ceil(side)) * u64::from(height.div_ceil(side)) > MOST_RAYS {
        side *= 2;
    }
    side
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use raywright_imaging::Camera;

    use super::*;
    use crate::{
        Raycaster,
        appearance::{Appearance, IsoSurface},
        generate,
        grid::{ValueScale, Voxels},
        presets::preset,
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

    /// What a picture takes, and what is expected of it without and with the blocks of the caster: samples
    /// and jumps.
    fn counts_of(camera: Camera, function: &TransferFunction, volume: &Volume) -> [[f64; 2]; 3] {
        let caster = Raycaster::new(volume).unwrap();
        let prepared = caster.prepare(function);
        let (size, options) = ([160, 120], CastOptions::default());
        let work = prepared.render(camera, size, &options).unwrap().work;
        let estimator = Estimator::new(volume);
        let plain = estimator.prepare(function, EstimateMethod::MeanExtinction);
        let fine = plain.clone().with_blocks_of(&prepared);
        let sums = |estimate: &PreparedEstimate<'_>| {
            let estimate = estimate.estimate(camera, size, &options, 0).unwrap();
            let pixels = f64::from(TILE_SIZE).powi(2);
            let sum = |of: fn(&EstimatedRay) -> f32| {
                pixels
                    * estimate
                        .rays
                        .iter()
                        .map(|ray| f64::from(of(ray)))
                        .sum::<f64>()
            };
            [sum(|ray| ray.lit), sum(|ray| ray.jumps)]
        };
        let taken = [work.samples as f64, work.skips as f64];
        [taken, sums(&plain), sums(&fine)]
    }

    #[test]
    fn the_blocks_of_a_caster_tell_its_samples_and_jumps() {
        let made = generate::by_name("nebula", [96; 3], 1).unwrap();
        let function = preset("fire", [0.55, 0.8]).unwrap();
        let centre = made.camera.target;
        for distance in [1.0, 0.4] {
            let camera = Camera {
                origin: centre + (made.camera.origin - centre) * distance,
                ..made.camera
            };
            let [taken, plain, fine] = counts_of(camera, &function, &made.volume);
            let ratios = |of: [f64; 2]| [of[0] / taken[0], of[1] / taken[1]];
            let (plain, fine) = (ratios(plain), ratios(fine));
            // A caster takes some samples more behind each block that it looked at.
            assert!((0.55..1.1).contains(&fine[0]), "{distance}: {fine:?}");
            assert!((0.85..1.2).contains(&fine[1]), "{distance}: {fine:?}");
            assert!(plain[0] > 3.0 && plain[1] > 1.5, "{distance}: {plain:?}");
        }
    }

    #[test]
    fn a_surface_in_empty_space_is_expected_too() {
        let made = generate::by_name("marschner-lobb", [48; 3], 1).unwrap();
        let nothing = TransferFunction::new(vec![ControlPoint {
            value: 0.0,
            colour: [1.0; 3],
            opacity: 0.0,
        }]);
        let mut appearance = Appearance::from(nothing.unwrap());
        let surface = IsoSurface {
            value: 0.5,
            colour: [1.0; 3],
            opacity: 1.0,
        };
        appearance.surfaces.push(surface);
        let caster = Raycaster::new(&made.volume).unwrap();
        let prepared = caster.prepare_appearance(appearance.clone()).unwrap();
        let estimator = Estimator::new(&made.volume);
        let plain = estimator.prepare(&appearance.function, EstimateMethod::MeanExtinction);
        let fine = plain.clone().with_blocks_of(&prepared);
        let options = CastOptions::default();
        let lit = |of: &PreparedEstimate<'_>| -> f32 {
            let estimate = of.estimate(made.camera, [64; 2], &options, 0).unwrap();
            estimate.rays.iter().map(|ray| ray.lit).sum()
        };
        assert_eq!(lit(&plain), 0.0);
        assert!(lit(&fine) > 0.0);
    }

    #[test]
    fn large_pictures_have_large_squares() {
        for (size, side) in [
            ([1, 1], 8),
            ([256, 256], 8),
            ([512, 512], 16),
            ([1920, 1080], 32),
        ] {
            assert_eq!(tile_size(size[0], size[1]), side, "{size:?}");
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
            let nothing = |ray: &EstimatedRay| ray.samples() == 0.0 && ray.lit == 0.0;
            assert!(estimate.rays.iter().all(nothing));
            assert!(estimate.steps > 0);
        }
    }
}
