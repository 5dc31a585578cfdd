//! What a tuning run makes small.
//!
//! The two feedback functions of Herveau, Pfaffe, Tillmann, Tichy, Dachsbacher, *Analysis of Acceleration
//! Structure Parameters and Hybrid Autotuning for Ray Tracing*, and what lies between them: a tree is worth
//! its build by the number of frames that it serves.

use std::num::NonZeroU32;

/// What is made small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// Time to render: the tree serves many frames.
    Render,
    /// Time to build and render: the tree is built anew for each frame.
    Total,
    /// Time to render, and the share of the build in each of so many frames.
    PerTree(NonZeroU32),
}

impl Metric {
    /// The metric of a tree that serves so many frames.
    #[must_use]
    pub fn of_frames_per_tree(frames: NonZeroU32) -> Self {
        match frames.get() {
            1 => Self::Total,
            _ => Self::PerTree(frames),
        }
    }

    /// The share of a build that each frame bears, 0..=1.
    #[must_use]
    pub fn build_share(self) -> f64 {
        match self {
            Self::Render => 0.0,
            Self::Total => 1.0,
            Self::PerTree(frames) => 1.0 / f64::from(frames.get()),
        }
    }

    /// The cost of a frame, in the unit of its times.
    #[must_use]
    pub fn cost(self, build: f64, render: f64) -> f64 {
        self.build_share() * build + render
    }

    /// How many frames a tree serves; `None`: any number.
    #[must_use]
    pub fn frames_per_tree(self) -> Option<NonZeroU32> {
        match self {
            Self::Render => None,
            Self::Total => Some(NonZeroU32::MIN),
            Self::PerTree(frames) => Some(frames),
        }
    }

    /// Its name on a command line and in a log; of trees that serve several frames that of the total.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Render => "render",
            Self::Total | Self::PerTree(_) => "total",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_bears_its_share_of_the_build() {
        let frames = |count| NonZeroU32::new(count).unwrap();
        assert_eq!(Metric::Render.cost(8.0, 3.0), 3.0);
        assert_eq!(Metric::Total.cost(8.0, 3.0), 11.0);
        assert_eq!(Metric::of_frames_per_tree(frames(4)).cost(8.0, 3.0), 5.0);
        assert_eq!(Metric::of_frames_per_tree(frames(1)), Metric::Total);
    }
}
