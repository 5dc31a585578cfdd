//! Pictures tile by tile, on all threads, at once or part by part.
//!
//! A part is made of bands of rows that are spread over the picture, so that the first parts tell how
//! long the others will take; the order is that of van der Corput (1935), bits of numbers reversed.
//!
//! Invariant: what a tile is, and who casts it and when, changes no pixel.

use std::{ops::Range, sync::Mutex};

use rayon::prelude::*;
use raywright_bvh::Isa;

use super::{
    Frame, Picture, RayResult, RayWork, Work, field::Layout, kernel::TileKernel, sparse::Chosen,
};

/// Side of a tile, pixels.
const TILE_SIZE: u32 = 32;

/// Rows of the pieces of a part that threads share; a band of a part has some of them.
const PIECE_ROWS: u32 = 8;

/// Bands of all parts together, at most.
const MOST_BANDS: u32 = 32;

/// Parts of a picture, at most.
const MOST_PARTS: usize = 16;

/// The bands of rows of each part of a picture that is so many rows high.
#[must_use]
pub fn parts(height: u32) -> Vec<Vec<Range<u32>>> {
    let rows = height.div_ceil(MOST_BANDS).next_multiple_of(PIECE_ROWS);
    let bands = height.div_ceil(rows.max(1));
    let bits = u32::BITS - bands.saturating_sub(1).leading_zeros();
    let mut order: Vec<u32> = (0..bands).collect();
    order.sort_by_key(|band| band.reverse_bits() >> (u32::BITS - bits.max(1)));
    let count = MOST_PARTS.min(order.len());
    let part = |part: usize| {
        let own = order[part * order.len() / count..(part + 1) * order.len() / count].iter();
        own.map(|band| band * rows..((band + 1) * rows).min(height))
            .collect()
    };
    (0..count).map(part).collect()
}

/// Rows of a picture that are still to be cast.
pub(crate) struct Band<'p> {
    rows: Range<u32>,
    colours: &'p mut [[f32; 3]],
    opacities: &'p mut [f32],
    ends: &'p mut [f32],
    /// Empty if nobody asked.
    ray_work: &'p mut [RayWork],
}

impl Band<'_> {
    pub(crate) fn first_row(&self) -> u32 {
        self.rows.start
    }
}

/// A picture in bands of so many rows.
fn bands(picture: &mut Picture, rows: u32) -> Vec<Band<'_>> {
    let (width, height) = (picture.image.width(), picture.image.height());
    let pixels = rows as usize * width as usize;
    let mut ray_work = picture.ray_work.chunks_mut(pixels);
    let colours = picture.image.pixels_mut().chunks_mut(pixels);
    let opacities = picture.opacity.chunks_mut(pixels);
    let ends = picture.end.chunks_mut(pixels);
    let bands = (0_u32..).zip(colours.zip(opacities).zip(ends));
    bands
        .map(|(band, ((colours, opacities), ends))| Band {
            rows: band * rows..((band + 1) * rows).min(height),
            colours,
            opacities,
            ends,
            ray_work: ray_work.next().unwrap_or_default(),
        })
        .collect()
}

/// The bands of each part of a picture.
pub(crate) fn bands_of_parts(picture: &mut Picture) -> Vec<Vec<Band<'_>>> {
    let parts = parts(picture.image.height());
    let mut of_parts: Vec<Vec<Band<'_>>> = parts.iter().map(|_| Vec::new()).collect();
    for band in bands(picture, PIECE_ROWS) {
        let own = |part: &Vec<Range<u32>>| part.iter().any(|rows| rows.contains(&band.rows.start));
        if let Some(part) = parts.iter().position(own) {
            of_parts[part].push(band);
        }
    }
    of_parts
}

/// The bands of a picture from a row on.
pub(crate) fn bands_from(picture: &mut Picture, row: u32) -> Vec<Band<'_>> {
    let mut own = bands(picture, PIECE_ROWS);
    own.retain(|band| band.rows.start >= row);
    own
}

/// Casts the rays of the chosen pixels of a picture by lanes, and adds what they took.
pub(crate) fn cast_tiles(frame: &Frame<'_>, picture: &mut Picture, chosen: Chosen<'_>, isa: Isa) {
    let width = picture.image.width();
    let work = cast_bands(frame, width, bands(picture, TILE_SIZE), chosen, isa);
    picture.work.add(&work);
}

/// Casts the rays of bands of a picture that is so wide.
pub(crate) fn cast_bands(
    frame: &Frame<'_>,
    width: u32,
    bands: Vec<Band<'_>>,
    chosen: Chosen<'_>,
    isa: Isa,
) -> Work {
    let total = Mutex::new(Work::default());
    bands.into_par_iter().for_each(|band| {
        let rows = band.rows;
        let mut work = Work::default();
        let mut tile = Vec::new();
        for left in (0..width).step_by(TILE_SIZE as usize) {
            let columns = left..(left + TILE_SIZE).min(width);
            tile.clear();
            tile.resize(columns.len() * rows.len(), RayResult::NOTHING);
            cast_tile(
                frame,
                isa,
                columns.clone(),
                rows.clone(),
                chosen,
                &mut tile,
                &mut work,
            );
            for (row, own) in tile.chunks_exact(columns.len()).enumerate() {
                let start = row * width as usize + columns.start as usize;
                let y = rows.start + row as u32;
                for ((pixel, x), result) in (start..).zip(columns.clone()).zip(own) {
                    if !chosen.has(x, y) {
                        continue;
                    }
                    let (colour, opacity) = frame.finish(result);
                    band.colours[pixel] = colour;
                    band.opacities[pixel] = opacity;
                    band.ends[pixel] = result.end;
                    if let Some(work) = band.ray_work.get_mut(pixel) {
                        *work = result.work;
                    }
                }
            }
        }
        total.lock().unwrap_or_else(|e| e.into_inner()).add(&work);
    });
    total.into_inner().unwrap_or_else(|e| e.into_inner())
}

fn cast_tile(
    frame: &Frame<'_>,
    isa: Isa,
    columns: Range<u32>,
    rows: Range<u32>,
    chosen: Chosen<'_>,
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
                    chosen,
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
