//! Ray casting: pictures of volumes.
//!
//! What is known of a volume is found once, by [`Raycaster::new`]; what a transfer function makes of
//! it by [`Raycaster::prepare`]; a picture needs neither again.

mod field;
mod kernel;
mod lanes;
mod options;
mod picture;
pub(crate) mod reference;
mod space;
mod tiles;
pub(crate) mod view;

use raywright_imaging::{Camera, Image};

use crate::{
    blocks::Blocks,
    distance::DistanceMap,
    grid::Volume,
    table::{BakedFunction, DEFAULT_SIZE, FULL_COLOUR, TableIndex, TransferTable},
    transfer::TransferFunction,
};
use field::Layout;
pub use options::{Behind, CastError, CastOptions, Skipping};
pub use picture::{Picture, Work};
use tiles::cast_tiles;
use view::View;

/// Binary logarithm of the cells along the edge of a block.
const BLOCK_SHIFT: u32 = 2;

/// What all rays of a picture read.
pub(crate) struct Frame<'a> {
    volume: &'a Volume,
    layout: &'a Layout<'a>,
    view: View,
    table: &'a TransferTable<'a>,
    termination: f32,
    behind: Behind,
    distances: Option<&'a DistanceMap>,
}

impl Frame<'_> {
    /// The colour and opacity of a pixel.
    fn finish(&self, result: &RayResult) -> ([f32; 3], f32) {
        if result.opacity > self.termination && self.behind == Behind::TheSame {
            let full = FULL_COLOUR * result.opacity;
            (result.colour.map(|c| c / full), 1.0)
        } else {
            (result.colour.map(|c| c / FULL_COLOUR), result.opacity)
        }
    }
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

impl RayResult {
    /// Of a ray without samples.
    pub(crate) const NOTHING: Self = Self {
        colour: [0.0; 3],
        opacity: 0.0,
        end: 0.0,
    };
}

/// Casts rays through a volume, from any camera with any transfer function.
#[derive(Clone, Debug)]
pub struct Raycaster<'a> {
    volume: &'a Volume,
    layout: Layout<'a>,
    blocks: Blocks,
}

impl<'a> Raycaster<'a> {
    /// Prepares a volume: lays out its voxels for lanes, which takes two bytes more for each of 8
    /// bits and four for each of 16, and finds the bounds of its blocks.
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
            blocks: Blocks::new(volume, BLOCK_SHIFT, TableIndex::new(volume, DEFAULT_SIZE)),
        })
    }

    /// Prepares the volume for a transfer function: finds what is empty. It pays when more than one
    /// picture is made with it.
    #[must_use]
    pub fn prepare(&self, function: &TransferFunction) -> Prepared<'_> {
        let baked = BakedFunction::new(function, self.volume, DEFAULT_SIZE);
        Prepared {
            caster: self,
            distances: DistanceMap::new(&self.blocks, &baked),
            baked,
        }
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
        self.prepare(function).render(camera, size, options)
    }
}

/// A volume as a transfer function shows it.
#[derive(Clone, Debug)]
pub struct Prepared<'a> {
    caster: &'a Raycaster<'a>,
    baked: BakedFunction,
    distances: DistanceMap,
}

impl Prepared<'_> {
    /// A picture of `width` × `height` pixels.
    ///
    /// # Errors
    /// [`CastError`] if the camera, the size or an option has no meaning.
    pub fn render(
        &self,
        camera: &Camera,
        size: [u32; 2],
        options: &CastOptions,
    ) -> Result<Picture, CastError> {
        self.picture(camera, size, options, |frame, picture| {
            cast_tiles(frame, picture, options.isa);
        })
    }

    /// The same picture by one ray after the other, which skips nothing and uses no lanes: slow, and
    /// short enough to be checked by eye. What it took is not counted.
    ///
    /// # Errors
    /// As [`Prepared::render`].
    pub fn render_slowly(
        &self,
        camera: &Camera,
        size: [u32; 2],
        options: &CastOptions,
    ) -> Result<Picture, CastError> {
        self.picture(camera, size, options, |frame, picture| {
            for y in 0..size[1] {
                for x in 0..size[0] {
                    let result = reference::cast(frame, x, y);
                    let pixel = y as usize * size[0] as usize + x as usize;
                    let (colour, opacity) = frame.finish(&result);
                    picture.image.pixels_mut()[pixel] = colour;
                    picture.opacity[pixel] = opacity;
                    picture.end[pixel] = result.end;
                }
            }
        })
    }

    fn picture(
        &self,
        camera: &Camera,
        [width, height]: [u32; 2],
        options: &CastOptions,
        cast: impl FnOnce(&Frame<'_>, &mut Picture),
    ) -> Result<Picture, CastError> {
        options.check()?;
        let Raycaster { volume, layout, .. } = self.caster;
        let projection = camera.projection(width, height)?;
        let image = Image::new(width, height)?;
        let pixels = image.pixels().len();
        let step = options.step * volume.unit_length();
        let mut picture = Picture {
            image,
            opacity: vec![0.0; pixels],
            end: vec![0.0; pixels],
            work: Work::default(),
        };
        let frame = Frame {
            volume,
            layout,
            view: View::new(volume, &projection, step, options.clip.as_ref()),
            table: &self.baked.table(options.step),
            termination: options.termination,
            behind: options.behind,
            distances: match options.skipping {
                Skipping::None => None,
                Skipping::Distance => Some(&self.distances),
            },
        };
        cast(&frame, &mut picture);
        Ok(picture)
    }
}

#[cfg(test)]
mod tests;
