//! Ray casting: pictures of volumes.

mod field;
mod kernel;
mod lanes;
pub(crate) mod reference;
mod space;
pub(crate) mod view;

use std::sync::Mutex;

use rayon::prelude::*;
use raywright_bvh::{Aabb, Isa, Vec3};
use raywright_imaging::{Camera, CameraError, FilmError, Image};

use crate::{
    blocks::Blocks,
    distance::DistanceMap,
    grid::Volume,
    table::{DEFAULT_SIZE, FULL_COLOUR, TransferTable},
    transfer::TransferFunction,
};
use field::Layout;
use kernel::TileKernel;
use view::View;

/// Side of a tile, pixels.
const TILE_SIZE: u32 = 32;

/// Binary logarithm of the cells along the edge of a block, if nobody wishes otherwise.
const BLOCK_SHIFT: u32 = 3;

/// How a picture is made.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct CastOptions {
    /// Distance between samples, in lengths of a voxel (the smallest spacing); above 0.
    pub step: f32,
    /// A ray ends when its opacity is above this; 1 or more: never.
    pub termination: f32,
    /// What is taken to be behind the point at which a ray ends early.
    pub behind: Behind,
    /// The box outside which nothing is seen, world units; `None` for the whole volume. It moves no
    /// sample. An inverted box contains nothing.
    pub clip: Option<Aabb>,
    /// How empty space is left out. Changes no pixel.
    pub skipping: Skipping,
    /// The instruction set. Changes no pixel.
    pub isa: Isa,
}

impl Default for CastOptions {
    fn default() -> Self {
        Self {
            step: 1.0,
            termination: 0.98,
            behind: Behind::TheSame,
            clip: None,
            skipping: Skipping::Distance,
            isa: Isa::best(),
        }
    }
}

impl CastOptions {
    pub(crate) fn check(&self) -> Result<(), CastError> {
        if !(self.step > 0.0 && self.step.is_finite()) {
            return Err(CastError::Step { step: self.step });
        }
        if self.termination.is_nan() || self.termination < 0.0 {
            return Err(CastError::Termination {
                termination: self.termination,
            });
        }
        if let Some(clip) = &self.clip
            && (clip.min.is_nan() || clip.max.is_nan())
        {
            return Err(CastError::Clip {
                min: clip.min,
                max: clip.max,
            });
        }
        Ok(())
    }
}

/// What is taken to be behind the point at which a ray ends early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Behind {
    /// More of what was seen: the colour is divided by the opacity. Most of the error of ending early
    /// goes, save where colours change behind the end.
    TheSame,
    /// Nothing: pixels are darker by up to 1 less the threshold, as in the paper.
    Nothing,
}

/// How empty space is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Skipping {
    /// Not at all.
    None,
    /// By the distance to the next block in which something can be seen.
    Distance,
}

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CastError {
    /// The camera.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The size of the picture.
    #[error(transparent)]
    Size(#[from] FilmError),
    /// The step is not a positive number.
    #[error("a step of {step} voxels: it must be above 0 and finite")]
    Step {
        /// The step.
        step: f32,
    },
    /// The threshold is not a number.
    #[error("a termination threshold of {termination}: it must be a number from 0 on")]
    Termination {
        /// The threshold.
        termination: f32,
    },
    /// A corner of the clip box is not a number.
    #[error("a clip box from {min} to {max}: its corners must be numbers")]
    Clip {
        /// Its lower corner.
        min: Vec3,
        /// Its upper corner.
        max: Vec3,
    },
    /// The volume has more voxels than lanes can index.
    #[error("{voxels} voxels are more than the {limit} that can be indexed")]
    TooLarge {
        /// How many there are.
        voxels: usize,
        /// How many there may be.
        limit: usize,
    },
}

/// What a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Work {
    /// Rays that meet the box of the volume.
    pub rays: u64,
    /// Samples that were interpolated, some of them a little beyond what can be seen.
    pub samples: u64,
    /// Samples of which something is seen.
    pub lit_samples: u64,
    /// Jumps over empty space.
    pub skips: u64,
}

impl Work {
    /// Adds what another picture took.
    pub fn add(&mut self, other: &Self) {
        self.rays += other.rays;
        self.samples += other.samples;
        self.lit_samples += other.lit_samples;
        self.skips += other.skips;
    }
}

/// A picture of a volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// RGB over black, in the colours of the transfer function: those of a screen, as a rule.
    pub image: Image,
    /// Opacity of each pixel, row by row.
    pub opacity: Vec<f32>,
    /// For each pixel, the number of the sample behind the last one that was looked at, as the
    /// distance from the eye in steps; 0 where the ray has none.
    pub end: Vec<f32>,
    /// What it took.
    pub work: Work,
}

/// What all rays of a picture read.
pub(crate) struct Frame<'a> {
    volume: &'a Volume,
    layout: &'a Layout<'a>,
    view: View,
    table: &'a TransferTable,
    termination: f32,
    distances: Option<&'a DistanceMap>,
}

/// What a ray found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RayResult {
    /// Colour, multiplied by opacity, in units of the table.
    pub(crate) colour: [f32; 3],
    pub(crate) opacity: f32,
    /// Number of the sample behind the last that was looked at; 0 if there was none.
    pub(crate) end: f32,
}

/// Casts rays through a volume, from any camera with any transfer function.
#[derive(Clone, Debug)]
pub struct Raycaster<'a> {
    volume: &'a Volume,
    layout: Layout<'a>,
    blocks: Blocks,
}

impl<'a> Raycaster<'a> {
    /// Prepares a volume: finds the bounds of its blocks.
    ///
    /// # Errors
    /// [`CastError::TooLarge`].
    pub fn new(volume: &'a Volume) -> Result<Self, CastError> {
        let limit = i32::MAX as usize - 8;
        if volume.len() > limit {
            return Err(CastError::TooLarge {
                voxels: volume.len(),
                limit,
            });
        }
        Ok(Self {
            volume,
            layout: Layout::of(volume),
            blocks: Blocks::new(volume, BLOCK_SHIFT),
        })
    }

    /// A picture of `width` × `height` pixels.
    ///
    /// # Errors
    /// [`CastError`] if the camera, the size or an option has no meaning.
    pub fn render(
        &self,
        function: &TransferFunction,
        camera: &Camera,
        size: [u32; 2],
        options: &CastOptions,
    ) -> Result<Picture, CastError> {
        self.picture(function, camera, size, options, |frame| {
            cast_tiles(frame, size, options.isa)
        })
    }

    /// The same picture by one ray after the other, which skips nothing and uses no lanes: slow, and
    /// short enough to be checked by eye. What it took is not counted.
    ///
    /// # Errors
    /// As [`Raycaster::render`].
    pub fn render_slowly(
        &self,
        function: &TransferFunction,
        camera: &Camera,
        size: [u32; 2],
        options: &CastOptions,
    ) -> Result<Picture, CastError> {
        self.picture(function, camera, size, options, |frame| {
            let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
            let results = pixels.map(|(x, y)| reference::cast(frame, x, y));
            (results.collect(), Work::default())
        })
    }

    fn picture(
        &self,
        function: &TransferFunction,
        camera: &Camera,
        [width, height]: [u32; 2],
        options: &CastOptions,
        cast: impl FnOnce(&Frame<'_>) -> (Vec<RayResult>, Work),
    ) -> Result<Picture, CastError> {
        options.check()?;
        let projection = camera.projection(width, height)?;
        let mut image = Image::new(width, height)?;
        let table = TransferTable::new(function, self.volume, options.step, DEFAULT_SIZE);
        let map = match options.skipping {
            Skipping::None => None,
            Skipping::Distance => Some(DistanceMap::new(&self.blocks, &table)),
        };
        let step = options.step * self.volume.unit_length();
        let (mut results, work) = cast(&Frame {
            volume: self.volume,
            layout: &self.layout,
            view: View::new(self.volume, &projection, step, options.clip.as_ref()),
            table: &table,
            termination: options.termination,
            distances: map.as_ref(),
        });
        for (pixel, result) in image.pixels_mut().iter_mut().zip(&mut results) {
            let mut full = FULL_COLOUR;
            if result.opacity > options.termination && options.behind == Behind::TheSame {
                full *= result.opacity;
                result.opacity = 1.0;
            }
            *pixel = result.colour.map(|c| c / full);
        }
        Ok(Picture {
            image,
            opacity: results.iter().map(|r| r.opacity).collect(),
            end: results.iter().map(|r| r.end).collect(),
            work,
        })
    }
}

/// The results of all pixels, tile by tile in parallel.
fn cast_tiles(frame: &Frame<'_>, [width, height]: [u32; 2], isa: Isa) -> (Vec<RayResult>, Work) {
    let nothing = RayResult {
        colour: [0.0; 3],
        opacity: 0.0,
        end: 0.0,
    };
    let mut results = vec![nothing; width as usize * height as usize];
    let total = Mutex::new(Work::default());
    let band = TILE_SIZE as usize * width as usize;
    results
        .par_chunks_mut(band)
        .enumerate()
        .for_each(|(band, rows)| {
            let top = band as u32 * TILE_SIZE;
            let bottom = (top + TILE_SIZE).min(height);
            let mut work = Work::default();
            let mut tile = Vec::new();
            for left in (0..width).step_by(TILE_SIZE as usize) {
                let columns = left..(left + TILE_SIZE).min(width);
                tile.clear();
                tile.resize(columns.len() * (bottom - top) as usize, nothing);
                cast_tile(
                    frame,
                    isa,
                    columns.clone(),
                    top..bottom,
                    &mut tile,
                    &mut work,
                );
                let rows = rows.chunks_exact_mut(width as usize);
                for (row, own) in rows.zip(tile.chunks_exact(columns.len())) {
                    row[columns.start as usize..columns.end as usize].copy_from_slice(own);
                }
            }
            total.lock().unwrap_or_else(|e| e.into_inner()).add(&work);
        });
    (
        results,
        total.into_inner().unwrap_or_else(|e| e.into_inner()),
    )
}

fn cast_tile(
    frame: &Frame<'_>,
    isa: Isa,
    columns: std::ops::Range<u32>,
    rows: std::ops::Range<u32>,
    results: &mut [RayResult],
    work: &mut Work,
) {
    macro_rules! run {
        ($voxels:expr) => {
            raywright_bvh::simd::run(
                isa,
                TileKernel {
                    frame,
                    voxels: $voxels,
                    columns,
                    rows,
                    results,
                    work,
                },
            )
        };
    }
    match frame.layout {
        Layout::U8(voxels) => run!(&voxels[..]),
        Layout::U16(voxels) => run!(&voxels[..]),
        Layout::F32(voxels) => run!(*voxels),
    }
}

#[cfg(test)]
mod tests;
