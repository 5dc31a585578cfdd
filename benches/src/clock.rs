//! Clocks. On a machine with other jobs, processor time is the one to believe: a job that is put
//! aside for another does not grow older by it.

use std::time::Duration;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// Time on the wall.
    Wall,
    /// Processor time of all threads of the process.
    ProcessCpu,
    /// Processor time of the calling thread.
    ThreadCpu,
}

impl Clock {
    /// Its name in tables. Where the system has no processor time, all are wall time, and say so.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ProcessCpu if cfg!(unix) => "CPU time of the process",
            Self::ThreadCpu if cfg!(unix) => "CPU time of the thread",
            _ => "wall time",
        }
    }

    /// The time since a moment that does not change.
    #[must_use]
    #[cfg(unix)]
    pub fn now(self) -> Duration {
        use rustix::time::{ClockId, clock_gettime};

        let time = clock_gettime(match self {
            Self::Wall => ClockId::Monotonic,
            Self::ProcessCpu => ClockId::ProcessCPUTime,
            Self::ThreadCpu => ClockId::ThreadCPUTime,
        });
        Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
    }

    /// The time since a moment that does not change.
    #[must_use]
    #[cfg(not(unix))]
    pub fn now(self) -> Duration {
        static START: std::sync::LazyLock<std::time::Instant> =
            std::sync::LazyLock::new(std::time::Instant::now);
        START.elapsed()
    }

    /// How long `run` takes. Its result is dropped after the clock has stopped.
    pub fn time<T>(self, run: impl FnOnce() -> T) -> Duration {
        let start = self.now();
        let result = std::hint::black_box(run());
        let time = self.now() - start;
        drop(result);
        time
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn sleep_takes_no_processor_time_and_work_does() {
        let sleep = || std::thread::sleep(Duration::from_millis(30));
        assert!(Clock::Wall.time(sleep) >= Duration::from_millis(30));
        assert!(Clock::ThreadCpu.time(sleep) < Duration::from_millis(10));
        let work = || (0..3_000_000_u64).map(std::hint::black_box).sum::<u64>();
        assert!(Clock::ThreadCpu.time(work) > Duration::ZERO);
        assert!(Clock::ProcessCpu.time(work) > Duration::ZERO);
    }
}
