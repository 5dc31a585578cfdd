//! What tells the time in the experiment.

use std::time::Instant;

use crate::volume::{FrameClock, Work, WorkClock, WorkTimer, predict::WorkCosts};

/// What parts of a frame cost by the work clock: within what was fitted to frames of two volumes by the wall
/// clock on one core of 2024 with AVX-512. The fits differ much (a sample 2.4 to 8.5 ns, what is seen of it
/// 0 to 3.7 ns more), and how well a model with one cost per sample does depends on that share. It is not
/// what predictors begin with.
pub const CLOCK_COSTS: WorkCosts = WorkCosts {
    ray: 20e-9,
    skip: 8e-9,
    sample: 5e-9,
    lit: 0.9e-9,
    fixed: 110e-6,
};

/// What tells the time.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Clock {
    /// Work times [`CLOCK_COSTS`], with noise of this standard deviation and seed.
    Work {
        /// Of the logarithm of times.
        noise: f64,
        /// Of the noise.
        seed: u64,
    },
    /// The wall.
    Wall,
}

/// Either clock of a loop.
#[derive(Debug)]
pub(super) enum Timer {
    Work(WorkTimer),
    Wall(Instant),
}

impl Timer {
    pub(super) fn new(clock: Clock) -> Self {
        match clock {
            Clock::Work { noise, seed } => {
                let clock = WorkClock::new(CLOCK_COSTS).with_noise(noise, seed);
                Self::Work(WorkTimer::new(clock))
            }
            Clock::Wall => Self::Wall(Instant::now()),
        }
    }
}

impl FrameClock for Timer {
    fn start(&mut self, frame: u64) {
        match self {
            Self::Work(timer) => timer.start(frame),
            Self::Wall(start) => *start = Instant::now(),
        }
    }

    fn overhead(&self) -> f64 {
        match self {
            Self::Work(timer) => timer.overhead(),
            Self::Wall(start) => start.elapsed().as_secs_f64(),
        }
    }

    fn elapsed(&self, work: &Work) -> f64 {
        match self {
            Self::Work(timer) => timer.elapsed(work),
            Self::Wall(start) => start.elapsed().as_secs_f64(),
        }
    }
}
