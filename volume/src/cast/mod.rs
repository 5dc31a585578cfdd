//! Ray casting: pictures of volumes.
//!
//! What is known of a volume is found once, by [`Raycaster::new`]; what a transfer function makes of
//! it by [`Raycaster::prepare`]; a picture needs neither again.

mod detailed;
mod details;
mod field;
mod kernel;
mod lanes;
mod options;
mod partly;
mod picture;
pub(crate) mod reference;
mod space;
mod sparse;
mod tiles;
pub(crate) mod view;

use std::sync::Arc;

use raywright_bvh::{BuildWorkspace, TreeStats};
use raywright_imaging::{AnyCamera, Image, PictureFrame};

use crate::{
    appearance::{Appearance, AppearanceError, Integration, IsoSurface},
    blocks::Blocks,
    distance::DistanceMap,
    enclosure::{Enclosure, EnclosureError, EnclosureParams, LitBlocks},
    grid::Volume,
    slabs,
    table::{BakedFunction, DEFAULT_SIZE, FULL_COLOUR, TableIndex, TransferTable},
    transfer::TransferFunction,
};
use details::{Details, RawSurface};
use field::Layout;
pub use options::{Behind, CastError, CastOptions, Counts, Jitter, Skipping};
pub use picture::{Picture, RayWork, Work};
use sparse::Chosen;
pub use sparse::PixelsPerRay;
use tiles::cast_tiles;
pub use tiles::parts;
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
    enclosure: Option<&'a Enclosure>,
    counts: Counts,
    /// What else is asked for.
    details: Option<&'a Details>,
}

impl Frame<'_> {
    /// Whether two samples that follow each other matter together.
    fn needs_front(&self) -> bool {
        self.details.is_some_and(Details::needs_front)
    }

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
    /// What it took, if that is counted.
    pub(crate) work: RayWork,
}

impl RayResult {
    /// Of a ray without samples.
    pub(crate) const NOTHING: Self = Self {
        colour: [0.0; 3],
        opacity: 0.0,
        end: 0.0,
        work: RayWork {
            samples: 0,
            skips: 0,
        },
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
    /// [`CastError::TooLarge`], [`CastError::TooLong`], before any memory is taken.
    pub fn new(volume: &'a Volume) -> Result<Self, CastError> {
        check_size(volume.dims(), volume.len())?;
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
        self.prepared(function.clone().into())
    }

    /// Prepares the volume for more than a transfer function.
    ///
    /// # Errors
    /// [`AppearanceError`] if a number of the shading or of a surface has no meaning.
    pub fn prepare_appearance(
        &self,
        appearance: Appearance,
    ) -> Result<Prepared<'_>, AppearanceError> {
        appearance.check()?;
        Ok(self.prepared(appearance))
    }

    fn prepared(&self, appearance: Appearance) -> Prepared<'_> {
        let baked = BakedFunction::new(&appearance.function, self.volume, DEFAULT_SIZE);
        let scale = self.volume.scale();
        let raw = |surface: &IsoSurface| RawSurface {
            raw: (surface.value - scale.intercept) / scale.slope,
            colour: surface.colour.map(|c| c * FULL_COLOUR),
            opacity: surface.opacity,
        };
        let mut surfaces: Vec<RawSurface> = appearance.surfaces.iter().map(raw).collect();
        surfaces.sort_by(|a, b| a.raw.total_cmp(&b.raw));
        let [low, high] = self.volume.raw_range();
        let inside = surfaces.iter().filter(|s| (low..=high).contains(&s.raw));
        let entries: Vec<usize> = inside.map(|s| baked.index().of(s.raw)).collect();
        let reach = match appearance.integration {
            Integration::Samples => 0,
            Integration::PreIntegrated => slabs::reach(DEFAULT_SIZE),
        };
        let baked = baked.with(&entries, reach);
        Prepared {
            caster: self,
            distances: Arc::new(DistanceMap::new(&self.blocks, &baked)),
            baked,
            surfaces,
            appearance,
            enclosure: None,
        }
    }

    /// A picture of `width` × `height` pixels.
    ///
    /// # Errors
    /// [`CastError`] if the camera, the size or an option has no meaning.
    pub fn render(
        &self,
        function: &TransferFunction,
        camera: impl Into<AnyCamera>,
        size: [u32; 2],
        options: &CastOptions,
    ) -> Result<Picture, CastError> {
        self.prepare(function).render(camera, size, options)
    }
}

/// Whether a volume of `dims` sizes, `voxels` in all, can be cast.
fn check_size(dims: [usize; 3], voxels: usize) -> Result<(), CastError> {
    // What is read behind the last voxel must have an index too.
    let limit = i32::MAX as usize - 8;
    if voxels > limit {
        return Err(CastError::TooLarge { voxels, limit });
    }
    // Floats near 2^20 are 1/16 apart.
    let limit = 1 << 20;
    match dims.iter().position(|&size| size > limit) {
        Some(axis) => Err(CastError::TooLong {
            axis,
            size: dims[axis],
            limit,
        }),
        None => Ok(()),
    }
}

/// An appearance by steps of one length.
struct Tables<'a> {
    step: f32,
    transfer: TransferTable<'a>,
    /// What is more than a transfer function.
    details: Option<Details>,
}

/// A volume as a transfer function shows it.
#[derive(Clone, Debug)]
pub struct Prepared<'a> {
    caster: &'a Raycaster<'a>,
    appearance: Appearance,
    baked: BakedFunction,
    /// By rising value.
    surfaces: Vec<RawSurface>,
    distances: Arc<DistanceMap>,
    enclosure: Option<Enclosure>,
}

impl Prepared<'_> {
    /// How far from what can be seen each block is.
    pub(crate) fn distances(&self) -> &Arc<DistanceMap> {
        &self.distances
    }

    /// Builds a tree around what can be seen, for [`Skipping::Enclosure`]; the tree that there was goes,
    /// and gives its memory to the workspace. Returns what the tree is like.
    ///
    /// # Errors
    /// [`EnclosureError`] if a parameter has no meaning, or the build is refused.
    pub fn enclose(
        &mut self,
        params: &EnclosureParams,
        workspace: &mut BuildWorkspace,
    ) -> Result<TreeStats, EnclosureError> {
        if let Some(old) = self.enclosure.take() {
            old.recycle(workspace);
        }
        let map = &self.distances;
        let count = map.dims.iter().product();
        let sides = view::sides(self.caster.volume);
        let blocks = LitBlocks {
            dims: map.dims,
            lit: map.distances[..count].iter().map(|&d| d == 0).collect(),
            shift: map.shift,
            low: sides.map(|side| side[0]),
            high: sides.map(|side| side[1]),
        };
        let enclosure = Enclosure::new(&blocks, params, workspace)?;
        let stats = enclosure.stats();
        self.enclosure = Some(enclosure);
        Ok(stats)
    }

    /// A picture of `width` × `height` pixels.
    ///
    /// # Errors
    /// [`CastError`] if the camera, the size or an option has no meaning.
    pub fn render(
        &self,
        camera: impl Into<AnyCamera>,
        size: [u32; 2],
        options: &CastOptions,
    ) -> Result<Picture, CastError> {
        self.picture(camera.into(), size, options, |frame, picture, chosen| {
            cast_tiles(frame, picture, chosen, options.isa);
        })
    }

    /// The same picture by one ray after the other, which skips nothing and uses no lanes: slow, and
    /// short enough to be checked by eye. What it took is counted by ray alone.
    ///
    /// # Errors
    /// As [`Prepared::render`].
    pub fn render_slowly(
        &self,
        camera: impl Into<AnyCamera>,
        size: [u32; 2],
        options: &CastOptions,
    ) -> Result<Picture, CastError> {
        self.picture(camera.into(), size, options, |frame, picture, chosen| {
            for y in 0..size[1] {
                for x in 0..size[0] {
                    if !chosen.has(x, y) {
                        continue;
                    }
                    let result = reference::cast(frame, x, y);
                    let pixel = y as usize * size[0] as usize + x as usize;
                    let (colour, opacity) = frame.finish(&result);
                    picture.image.pixels_mut()[pixel] = colour;
                    picture.opacity[pixel] = opacity;
                    picture.end[pixel] = result.end;
                    if let Some(work) = picture.ray_work.get_mut(pixel) {
                        *work = result.work;
                    }
                }
            }
        })
    }

    fn picture(
        &self,
        camera: AnyCamera,
        size: [u32; 2],
        options: &CastOptions,
        mut cast: impl FnMut(&Frame<'_>, &mut Picture, Chosen<'_>),
    ) -> Result<Picture, CastError> {
        let rays = camera.picture_frame(size[0], size[1])?;
        let mut picture = blank(size, options)?;
        self.with_frame(&rays, options, |frame| {
            picture.base = frame.view.base();
            let lattice = options.pixels_per_ray;
            cast(frame, &mut picture, Chosen::Lattice(lattice));
            complete(&mut picture, lattice, |picture, chosen| {
                cast(frame, picture, chosen);
            });
        })?;
        Ok(picture)
    }

    /// Does something with what all rays of a picture read.
    fn with_frame<R>(
        &self,
        rays: &PictureFrame,
        options: &CastOptions,
        then: impl FnOnce(&Frame<'_>) -> R,
    ) -> Result<R, CastError> {
        options.check()?;
        self.with_tables(rays, options, &self.tables(options.step), then)
    }

    /// What the appearance is by steps of `step` > 0 lengths of a voxel.
    fn tables(&self, step: f32) -> Tables<'_> {
        let volume = self.caster.volume;
        let (appearance, surfaces) = (&self.appearance, &self.surfaces);
        Tables {
            step,
            transfer: self.baked.table(step),
            details: (!appearance.is_plain())
                .then(|| Details::new(appearance, surfaces, &self.baked, volume, step)),
        }
    }

    /// Does something with what all rays of a picture read, by the tables of the step of `options`, which
    /// have been checked.
    fn with_tables<R>(
        &self,
        rays: &PictureFrame,
        options: &CastOptions,
        tables: &Tables<'_>,
        then: impl FnOnce(&Frame<'_>) -> R,
    ) -> Result<R, CastError> {
        let Raycaster { volume, layout, .. } = self.caster;
        let clip = options.clip.as_ref();
        let view = View::new(volume, rays, options.step, clip, options.jitter)?;
        let details = tables.details.as_ref();
        // Between two samples beside a missing value anything might be.
        let needs_front = details.is_some_and(Details::needs_front);
        let skipping = if needs_front && volume.missing() > 0 {
            Skipping::None
        } else {
            options.skipping
        };
        Ok(then(&Frame {
            volume,
            layout,
            view,
            table: &tables.transfer,
            termination: options.termination,
            behind: options.behind,
            distances: match skipping {
                Skipping::Distance => Some(&self.distances),
                Skipping::None | Skipping::Enclosure => None,
            },
            enclosure: match (skipping, &self.enclosure) {
                (Skipping::Enclosure, None) => return Err(CastError::NotEnclosed),
                (Skipping::Enclosure, enclosure) => enclosure.as_ref(),
                _ => None,
            },
            counts: options.counts,
            details,
        }))
    }
}

/// Makes the pixels of a picture that are not on the lattice.
fn complete(
    picture: &mut Picture,
    lattice: PixelsPerRay,
    cast: impl FnOnce(&mut Picture, Chosen<'_>),
) {
    if lattice == PixelsPerRay::One {
        return;
    }
    let marks = sparse::silhouettes(picture, lattice);
    let width = picture.image.width();
    let chosen = Chosen::Marked {
        marks: &marks,
        width,
    };
    cast(picture, chosen);
    sparse::fill(picture, lattice, &marks);
}

/// A picture in which there is nothing yet.
fn blank([width, height]: [u32; 2], options: &CastOptions) -> Result<Picture, CastError> {
    let image = Image::new(width, height)?;
    let pixels = image.pixels().len();
    Ok(Picture {
        image,
        opacity: vec![0.0; pixels],
        end: vec![0.0; pixels],
        base: 0.0,
        work: Work::default(),
        ray_work: match options.counts {
            Counts::Total => Vec::new(),
            Counts::PerRay => vec![RayWork::default(); pixels],
        },
    })
}

#[cfg(test)]
mod tests;
