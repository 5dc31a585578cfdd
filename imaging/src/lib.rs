//! Camera, sampler, film, tile loop and image files: what every renderer needs and none is about.
//!
//! | module | what it answers |
//! | --- | --- |
//! | [`camera`], [`orthographic`], [`picture_frame`] | which ray belongs to a point of the picture |
//! | [`sampler`] | which number decides a question of a path |
//! | [`film`] | what is known of a pixel after n samples, and how well |
//! | [`tiles`] | which thread renders which pixels, and when to stop |
//! | [`image`], [`tone`], [`files`] | pictures in memory, on a screen, on disk |
//!
//! There is no scene, no ray intersection and no clock in here.
//!
//! A picture is a pure function of the seed, whatever the number of threads and the size of the
//! tiles: numbers are addressed by pixel, sample and [`dimension`] instead of being drawn from a
//! stream, and the samples of a pixel are added up by one thread in the order of their index.
//!
//! ```
//! use glam::Vec3;
//! use raywright_imaging::{
//!     Camera, Completion, Film, PixelSampler, TileLoop, dimension, write_image,
//! };
//!
//! let camera = Camera::new(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, Vec3::Y, 40.0)?;
//! let projection = camera.projection(64, 48)?;
//! let mut film = Film::new(64, 48)?;
//! let completion = TileLoop::new().run(&mut film, |tile, view| {
//!     for (x, y) in tile.pixels() {
//!         for sample in 0..4 {
//!             let sampler = PixelSampler::new(1, x, y, sample);
//!             let [dx, dy] = sampler.uniform_2d(dimension::FILM);
//!             let direction = projection.direction(x as f32 + dx, y as f32 + dy);
//!             // A sky: blue above, white at the horizon.
//!             let height = direction.y.max(0.0);
//!             view.pixel_mut(x, y).add(Vec3::ONE.lerp(Vec3::new(0.3, 0.5, 1.0), height));
//!         }
//!     }
//! });
//! assert_eq!(completion, Completion::Finished);
//! assert_eq!((film.samples(), film.rejected()), (64 * 48 * 4, 0));
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("sky.png");
//! write_image(&path, &film.mean())?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

pub mod camera;
pub mod difference;
pub mod files;
pub mod film;
pub mod image;
pub mod orthographic;
pub mod picture_frame;
pub mod sampler;
pub mod tiles;
pub mod tone;

pub use crate::camera::{Camera, CameraError, Projection};
pub use crate::difference::Difference;
pub use crate::files::{
    ImageError, PfmError, read_exr, read_pfm, write_exr, write_image, write_pfm, write_png,
};
pub use crate::film::{Film, FilmError, Pixel};
pub use crate::image::Image;
pub use crate::orthographic::{AnyCamera, OrthographicCamera};
pub use crate::picture_frame::{Bundle, PictureFrame};
pub use crate::sampler::{PixelSampler, dimension};
pub use crate::tiles::{CancelToken, Completion, Progress, Tile, TileLoop, TileView};
pub use crate::tone::{Display, ToneCurve};
