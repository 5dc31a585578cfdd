//! Times without a clock: what a frame would take on a machine of known costs.
//!
//! With it the whole of prediction and steering can be repeated to the last bit, so that studies are
//! tests. What is real about a clock can be added: noise, as a factor exp(σz) with a normal z that is
//! a function of seed and frame, and times in which the machine is slower. Models must not see the
//! costs, of course. Time by the wall is measured by the caller.
//!
//! Invariant: a time is a function of clock, work and frame.

use std::ops::Range;

use crate::{
    cast::Work,
    predict::{Counts, WorkCosts},
};

/// A time in which the machine has another speed.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedChange {
    /// The frames of it.
    pub frames: Range<u64>,
    /// Speed relative to the usual; 0.7 makes times longer by 1/0.7. Above 0.
    pub speed: f64,
}

/// A machine of known costs.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkClock {
    costs: WorkCosts,
    noise: f64,
    seed: u64,
    changes: Vec<SpeedChange>,
}

impl Default for WorkClock {
    fn default() -> Self {
        Self::new(WorkCosts {
            fixed: 0.0,
            ..WorkCosts::default()
        })
    }
}

impl WorkClock {
    /// A clock without noise.
    #[must_use]
    pub fn new(costs: WorkCosts) -> Self {
        Self {
            costs,
            noise: 0.0,
            seed: 0,
            changes: Vec::new(),
        }
    }

    /// With noise: `deviation` is the standard deviation of the logarithm of times.
    #[must_use]
    pub fn with_noise(self, deviation: f64, seed: u64) -> Self {
        Self {
            noise: deviation,
            seed,
            ..self
        }
    }

    /// With one more change of speed.
    #[must_use]
    pub fn with_change(mut self, change: SpeedChange) -> Self {
        self.changes.push(change);
        self
    }

    /// What some work takes in a frame, in seconds. Passes of one frame may be told apart by numbers
    /// of their own.
    #[must_use]
    pub fn time(&self, work: &Work, frame: u64) -> f64 {
        let mut time = self.costs.time(&Counts::from(work));
        for change in &self.changes {
            if change.frames.contains(&frame) {
                time /= change.speed;
            }
        }
        if self.noise > 0.0 {
            time *= (self.noise * normal(self.seed, frame)).exp();
        }
        time
    }
}

/// A number of the standard normal distribution: Box and Muller, 1958, from two numbers of
/// splitmix64.
fn normal(seed: u64, frame: u64) -> f64 {
    let [a, b] = [0, 1].map(|index| unit(seed, frame.wrapping_mul(2).wrapping_add(index)));
    (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}

/// A number in 0..1: number `index` of splitmix64 begun with `seed`.
pub(crate) fn unit(seed: u64, index: u64) -> f64 {
    let state = index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let state = seed.wrapping_add(state);
    let z = (state ^ state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn work() -> Work {
        Work {
            rays: 1_000_000,
            skips: 2_000_000,
            samples: 10_000_000,
            lit_samples: 4_000_000,
            ..Work::default()
        }
    }

    #[test]
    fn a_frame_of_known_work() {
        let time = WorkClock::default().time(&work(), 7);
        assert!((time - 77e-3).abs() < 1e-12, "{time}");
    }

    #[test]
    fn a_slower_machine_for_some_frames() {
        let clock = WorkClock::default().with_change(SpeedChange {
            frames: 10..12,
            speed: 0.5,
        });
        let times = [9, 10, 11, 12].map(|frame| clock.time(&work(), frame));
        assert_eq!(times[0] * 2.0, times[1]);
        assert_eq!((times[1], times[0]), (times[2], times[3]));
    }

    #[test]
    fn noise_is_normal_and_repeatable() {
        let clock = WorkClock::default().with_noise(0.1, 3);
        let usual = WorkClock::default().time(&work(), 0);
        let logs = |clock: &WorkClock| -> Vec<f64> {
            let frames = 0..20_000;
            frames
                .map(|frame| (clock.time(&work(), frame) / usual).ln())
                .collect()
        };
        let values = logs(&clock);
        assert_eq!(values, logs(&clock));
        assert_ne!(values, logs(&WorkClock::default().with_noise(0.1, 4)));
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let square = values.iter().map(|v| v * v).sum::<f64>() / count;
        assert!(mean.abs() < 0.003, "{mean}");
        assert!((square.sqrt() / 0.1 - 1.0).abs() < 0.02, "{square}");
        let far = values.iter().filter(|v| v.abs() > 0.196).count() as f64 / count;
        assert!((far - 0.05).abs() < 0.006, "{far}");
        let product = |lag: usize| {
            let pairs = values.iter().zip(&values[lag..]);
            pairs.map(|(a, b)| a * b).sum::<f64>() / count / square
        };
        assert!(product(1).abs() < 0.03 && product(2).abs() < 0.03);
    }
}
