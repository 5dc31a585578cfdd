//! The path tracer of raywright: scenes and their files, lights, integrators, and the indicators
//! from which a tuner predicts.
//!
//! ```
//! use raywright_tracer::{Integrator, Shot, World, generate};
//! use raywright_tracer::imaging::{film::Film, tiles::TileLoop};
//!
//! let scene = generate::by_name("interior").expect("a built-in scene");
//! let camera = scene.camera.expect("built-in scenes have a camera");
//! let world = World::new(scene);
//! let tree = world.build_tree(&Default::default(), &mut Default::default())?;
//! let mut film = Film::new(32, 18)?;
//! let shot = Shot { world: &world, camera, integrator: Integrator::Path { path_length: 3 }, seed: 1 };
//! shot.render(&mut film, 0..1, &TileLoop::new(), |_tile| &tree)?;
//! assert!(film.mean().mean().iter().all(|channel| *channel > 0.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

mod emitters;
pub mod generate;
mod indicators;
mod integrator;
pub mod load;
mod render;
mod sampling;
pub mod scene;
mod surface;
mod viewpoint;
mod world;

pub use indicators::{INDICATORS, Indicators};
pub use integrator::{Integrator, View};
pub use raywright_bvh as bvh;
pub use raywright_imaging as imaging;
pub use render::Shot;
pub use scene::{Light, Material, Mesh, Rgb, Scene, Sides};
pub use surface::Surface;
pub use viewpoint::{automatic_camera, dark_distance};
pub use world::{Needs, World};
