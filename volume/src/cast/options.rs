//! What can be asked of a picture, and why there may be none.

use raywright_bvh::{Aabb, Isa, Vec3};
use raywright_imaging::{CameraError, FilmError};

use super::PixelsPerRay;

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
    /// How many pixels share a ray; those without one are made of their neighbours.
    pub pixels_per_ray: PixelsPerRay,
    /// How empty space is left out. Changes no pixel.
    pub skipping: Skipping,
    /// Whether samples are moved along their rays.
    pub jitter: Jitter,
    /// Whether the work of each ray is told. Changes no pixel.
    pub counts: Counts,
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
            pixels_per_ray: PixelsPerRay::One,
            skipping: Skipping::Distance,
            jitter: Jitter::None,
            counts: Counts::Total,
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
    /// By a tree around what can be seen, of [`Prepared::enclose`](super::Prepared::enclose): its hull
    /// or all segments of a ray.
    Enclosure,
}

/// Whose work is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Counts {
    /// That of all rays together.
    Total,
    /// That of each ray too.
    PerRay,
}

/// Whether samples are moved along their rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Jitter {
    /// They lie at whole steps from the eye, or from the plane through an orthographic one.
    None,
    /// The samples of each pixel lie farther away by the same share of a step, from 0 to 1, which is
    /// a hash of the pixel: rings become noise.
    PerPixel,
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
    /// Empty space is to be left out by an enclosure, and there is none.
    #[error("there is no enclosure to skip by: build one first")]
    NotEnclosed,
    /// A corner of the clip box is not a number.
    #[error("a clip box from {min} to {max}: its corners must be numbers")]
    Clip {
        /// Its lower corner.
        min: Vec3,
        /// Its upper corner.
        max: Vec3,
    },
    /// The camera is so far away that double precision cannot place samples.
    #[error("a camera {distance:e} voxels away: at most {limit:e} can be told apart")]
    TooFar {
        /// How far it is along one axis, in distances between voxels.
        distance: f64,
        /// How far it may be.
        limit: f64,
    },
    /// The step is so small that the samples across the volume cannot be counted.
    #[error(
        "a step that takes {samples:e} samples across the volume: at most {limit:e} are counted"
    )]
    TooManySamples {
        /// How many samples the diagonal has.
        samples: f64,
        /// How many it may have.
        limit: f64,
    },
    /// A side of the volume is so long that samples cannot be placed between voxels.
    #[error(
        "{size} voxels along axis {axis} are more than the {limit} between which samples are placed"
    )]
    TooLong {
        /// 0, 1 or 2 for x, y or z.
        axis: usize,
        /// Voxels along it.
        size: usize,
        /// How many there may be.
        limit: usize,
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
