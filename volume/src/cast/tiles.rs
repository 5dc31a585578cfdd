//! Pictures tile by tile, on all threads.
//!
//! Invariant: what a tile is, and who casts it, changes no pixel.

use std::{ops::Range, sync::Mutex};

use rayon::prelude::*;
use raywright_bvh::Isa;

use super::{Frame, Picture, RayResult, Work, field::Layout, kernel::TileKernel};

/// Side of a tile, pixels.
const TILE_SIZE: u32 = 32;

/// Casts all rays of a picture by lanes.
pub(crate) fn cast_tiles(frame: &Frame<'_>, picture: &mut Picture, isa: Isa) {
    let (width, height) = (picture.image.width(), picture.image.height());
    let total = Mutex::new(Work::default());
    let band = TILE_SIZE as usize * width as usize;
    let colours = picture.image.pixels_mut().par_chunks_mut(band);
    let opacities = picture.opacity.par_chunks_mut(band);
    let ends = picture.end.par_chunks_mut(band);
    // One chunk for each band, empty if nobody asked.
    let mut ray_work = Vec::from_iter(picture.ray_work.chunks_mut(band));
    ray_work.resize_with(height.div_ceil(TILE_SIZE) as usize, Default::default);
    let bands = colours.zip(opacities).zip(ends).zip(ray_work).enumerate();
    bands.for_each(|(band, (((colours, opacities), ends), ray_work))| {
        let top = band as u32 * TILE_SIZE;
        let rows = top..(top + TILE_SIZE).min(height);
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
                &mut tile,
                &mut work,
            );
            for (row, own) in tile.chunks_exact(columns.len()).enumerate() {
                let start = row * width as usize + columns.start as usize;
                for (pixel, result) in (start..).zip(own) {
                    let (colour, opacity) = frame.finish(result);
                    colours[pixel] = colour;
                    opacities[pixel] = opacity;
                    ends[pixel] = result.end;
                    if let Some(work) = ray_work.get_mut(pixel) {
                        *work = result.work;
                    }
                }
            }
        }
        total.lock().unwrap_or_else(|e| e.into_inner()).add(&work);
    });
    picture.work = total.into_inner().unwrap_or_else(|e| e.into_inner());
}

fn cast_tile(
    frame: &Frame<'_>,
    isa: Isa,
    columns: Range<u32>,
    rows: Range<u32>,
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
