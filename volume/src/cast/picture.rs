//! Pictures of volumes and what they took.

use raywright_imaging::Image;

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
    /// Jumps over empty space; by an enclosure, intervals in which rays are followed.
    pub skips: u64,
    /// Turns of the loops in which all lanes of an instruction set take part, each a jump or one or two
    /// samples per lane. The fewer for the samples, the fuller the lanes.
    pub packet_steps: u64,
}

impl Work {
    /// Adds what another picture took.
    pub fn add(&mut self, other: &Self) {
        self.rays += other.rays;
        self.samples += other.samples;
        self.lit_samples += other.lit_samples;
        self.skips += other.skips;
        self.packet_steps += other.packet_steps;
    }
}

/// What one ray took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct RayWork {
    /// As in [`Work::samples`].
    pub samples: u32,
    /// As in [`Work::skips`].
    pub skips: u32,
}

/// A picture of a volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// RGB over black, in the colours of the transfer function: those of a screen, as a rule.
    pub image: Image,
    /// Opacity of each pixel, row by row.
    pub opacity: Vec<f32>,
    /// For each pixel, the number of the sample behind the last one that was looked at; 0 where the
    /// ray has none. With `base` it is the distance from the eye, or from the plane through an
    /// orthographic one, in steps.
    pub end: Vec<f32>,
    /// The number of the sample from which numbers in `end` count: 0 unless the camera is far from
    /// the volume or orthographic.
    pub base: f64,
    /// What it took.
    pub work: Work,
    /// What each pixel took, row by row; empty unless [`Counts::PerRay`](super::Counts) asks for it.
    pub ray_work: Vec<RayWork>,
}
