//! How a frame loop learns what time it is.

use crate::{cast::Work, steer::WorkClock};

/// Something that measures how long a frame takes.
pub trait FrameClock {
    /// A span of frame `frame` begins.
    fn start(&mut self, frame: u64);

    /// Seconds since then, in which no ray was cast.
    fn overhead(&self) -> f64;

    /// Seconds since then, in which rays were cast, with this work.
    fn elapsed(&self, work: &Work) -> f64;
}

/// A [`WorkClock`] at work: preparing takes no time.
#[derive(Clone, Debug, Default)]
pub struct WorkTimer {
    clock: WorkClock,
    frame: u64,
}

impl WorkTimer {
    /// A timer that begins with frame 0.
    #[must_use]
    pub fn new(clock: WorkClock) -> Self {
        Self { clock, frame: 0 }
    }
}

impl FrameClock for WorkTimer {
    fn start(&mut self, frame: u64) {
        self.frame = frame;
    }

    fn overhead(&self) -> f64 {
        0.0
    }

    fn elapsed(&self, work: &Work) -> f64 {
        self.clock.time(work, self.frame)
    }
}
