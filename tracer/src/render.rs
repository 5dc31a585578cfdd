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
    integrator::{self, Integrator},
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
        for (x, y) in tile.pixels() {
            let pixel = view.pixel_mut(x, y);
            for sample in samples.clone() {
                let sampler = PixelSampler::new(self.seed, x, y, sample);
                let [dx, dy] = sampler.uniform_2d(dimension::FILM);
                let direction = projection.direction(x as f32 + dx, y as f32 + dy);
                let ray = Ray::new(projection.origin(), direction);
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
