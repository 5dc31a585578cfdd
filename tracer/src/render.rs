//! From a world to a film: samples of pixels, tile by tile.
//!
//! Invariant: the value of a sample is a function of world, camera, seed, pixel, sample number and
//! integrator. Tree, tile size, order and threads change nothing of it (the view of visited nodes
//! excepted, which shows the tree).

use std::ops::Range;

use raywright_bvh::{Bvh, Ray};
use raywright_imaging::{
    camera::{Camera, CameraError, Projection},
    film::Film,
    sampler::{PixelSampler, dimension},
    tiles::{Completion, Tile, TileLoop, TileView},
};

use crate::{
    integrator::{self, Integrator, path::Path, wave},
    world::World,
};

/// What is rendered, and from where.
#[derive(Clone, Copy, Debug)]
pub struct Shot<'a> {
    /// The scene.
    pub world: &'a World,
    /// The camera.
    pub camera: Camera,
    /// What the colour of a ray is.
    pub integrator: Integrator,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Shot<'_> {
    /// Adds samples to every pixel of a film, each tile traced through the tree that `tree_of`
    /// names for it. Sample numbers of one film must not be repeated, since a sample is a function
    /// of its number.
    ///
    /// # Errors
    /// If the camera cannot be used.
    pub fn render<'t>(
        &self,
        film: &mut Film,
        samples: Range<u32>,
        tiles: &TileLoop<'_>,
        tree_of: impl Fn(&Tile) -> &'t Bvh + Sync,
    ) -> Result<Completion, CameraError> {
        let pixels = self.camera.projection(film.width(), film.height())?;
        Ok(tiles.run(film, |tile, view| {
            self.render_tile(&pixels, tile, view, samples.clone(), tree_of(tile));
        }))
    }

    /// Adds samples to the pixels of one tile; `projection` is that of the camera for the whole film.
    pub fn render_tile(
        &self,
        projection: &Projection,
        tile: &Tile,
        view: &mut TileView<'_, '_>,
        samples: Range<u32>,
        tree: &Bvh,
    ) {
        let ray_of = |(x, y), sample| {
            let sampler = PixelSampler::new(self.seed, x, y, sample);
            let [dx, dy] = sampler.uniform_2d(dimension::FILM);
            let direction = projection.direction(x as f32 + dx, y as f32 + dy);
            (Ray::new(projection.origin(), direction), sampler)
        };
        if let Integrator::Path { path_length } = self.integrator
            && tree.prefers_batches()
        {
            let mut paths = Vec::new();
            for sample in samples {
                paths.clear();
                paths.extend(tile.pixels_by_squares(wave::SQUARE).map(|pixel| {
                    let (ray, sampler) = ray_of(pixel, sample);
                    (Path::new(ray), sampler)
                }));
                wave::follow(self.world, tree, &mut paths, path_length);
                for ((x, y), (path, _)) in tile.pixels_by_squares(wave::SQUARE).zip(&paths) {
                    view.pixel_mut(x, y).add(path.radiance);
                }
            }
            return;
        }
        for (x, y) in tile.pixels() {
            let pixel = view.pixel_mut(x, y);
            for sample in samples.clone() {
                let (ray, sampler) = ray_of((x, y), sample);
                pixel.add(match self.integrator {
                    Integrator::Path { path_length } => {
                        integrator::path::radiance(self.world, tree, ray, &sampler, path_length)
                    }
                    Integrator::NaivePath { path_length } => {
                        integrator::naive::radiance(self.world, tree, ray, &sampler, path_length)
                    }
                    Integrator::View(view) => {
                        integrator::view::colour(view, self.world, tree, &ray)
                    }
                });
            }
        }
    }
}
