//! Whether what was constant has changed: the test of Page and Hinkley.
//!
//! Page, *Continuous Inspection Schemes*, Biometrika 1954; Hinkley, *Inference about the change-point from
//! cumulative sum tests*, 1971. Two sums run along, one for each direction: each adds what a value is above
//! (below) its mean, less a tolerance, and is never below 0; an alarm is a sum above a threshold. Values are
//! counted in standard deviations, which are learned from the first values and go on being learned slowly,
//! and no value counts more than [`MOST`] of them: one frame that the machine took away is no change.
//!
//! With a tolerance of ½ and a threshold of 8 a normal sequence raises an alarm once in some 10,000 values,
//! and a step of two deviations is noticed after about five (Siegmund's approximation of run lengths).
//!
//! Invariants: a function of the values alone; a value that is no number changes nothing.

/// Values from which mean and deviation are learned at first.
const LEARNED: usize = 12;
/// Values over which they are learned in the long run: what takes longer is drift.
const MEMORY: f64 = 200.0;
/// What is tolerated in each value, in standard deviations.
const TOLERANCE: f64 = 0.5;
/// The sum that is a change, in standard deviations.
const THRESHOLD: f64 = 8.0;
/// The most that a value counts, in standard deviations.
const MOST: f64 = 3.0;

/// Notices when the mean of a sequence changes.
#[derive(Clone, Debug, PartialEq)]
pub struct ChangeDetector {
    least_deviation: f64,
    learned: Vec<f64>,
    /// Values that mean and deviation are of, at most [`MEMORY`].
    count: f64,
    mean: f64,
    deviation: f64,
    above: f64,
    below: f64,
}

impl ChangeDetector {
    /// A detector that has seen nothing; deviations below `least_deviation`, in units of the values, are
    /// taken for it.
    #[must_use]
    pub fn new(least_deviation: f64) -> Self {
        Self {
            least_deviation,
            learned: Vec::with_capacity(LEARNED),
            count: 0.0,
            mean: 0.0,
            deviation: 0.0,
            above: 0.0,
            below: 0.0,
        }
    }

    /// Adds a value; whether there has been a change. After an alarm it begins anew.
    pub fn add(&mut self, value: f64) -> bool {
        if !value.is_finite() {
            return false;
        }
        if self.learned.len() < LEARNED {
            self.learned.push(value);
            if self.learned.len() == LEARNED {
                self.settle();
            }
            return false;
        }
        let z = ((value - self.mean) / self.deviation).clamp(-MOST, MOST);
        self.above = (self.above + z - TOLERANCE).max(0.0);
        self.below = (self.below - z - TOLERANCE).max(0.0);
        self.count = (self.count + 1.0).min(MEMORY);
        let variance = self.deviation.powi(2);
        self.mean += z * self.deviation / self.count;
        // Clipped values have 0.973 of the variance of normal ones.
        let own = (z * self.deviation).powi(2) / 0.973;
        self.deviation = (variance + (own - variance) / self.count)
            .sqrt()
            .max(self.least_deviation);
        let is_change = self.above > THRESHOLD || self.below > THRESHOLD;
        if is_change {
            *self = Self::new(self.least_deviation);
        }
        is_change
    }

    /// Median, and deviation by the median distance from it: neither is moved by a few odd values.
    fn settle(&mut self) {
        self.count = LEARNED as f64;
        self.mean = median(&mut self.learned.clone());
        let mut distances: Vec<f64> = self
            .learned
            .iter()
            .map(|value| (value - self.mean).abs())
            .collect();
        // Of a normal distribution half lies within 0.6745 deviations; few values underrate it.
        let small_sample = 1.0 + 1.0 / LEARNED as f64;
        self.deviation = (small_sample * median(&mut distances) / 0.6745).max(self.least_deviation);
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len().is_multiple_of(2) {
        0.5 * (values[middle - 1] + values[middle])
    } else {
        values[middle]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Stream;

    /// Nearly normal, of deviation 1.
    fn noise(stream: &mut Stream) -> f64 {
        (0..12).map(|_| stream.unit()).sum::<f64>() - 6.0
    }

    /// How many values until an alarm, at most `limit`, after `calm` values of mean 0.
    fn run(seed: u64, calm: usize, shift: f64, limit: usize) -> Option<usize> {
        let mut stream = Stream::new(seed);
        let mut detector = ChangeDetector::new(1e-9);
        for _ in 0..calm {
            detector.add(0.02 * noise(&mut stream));
        }
        (1..=limit).find(|_| detector.add(0.02 * (noise(&mut stream) + shift)))
    }

    #[test]
    fn false_alarms_are_rare() {
        let alarms: usize = (0..200)
            .filter(|&seed| run(seed, LEARNED, 0.0, 2000).is_some())
            .count();
        // Once in 2000 values would be 126 of 200.
        assert!(alarms <= 110, "{alarms} of 200 sequences of 2000 values");
    }

    #[test]
    fn changes_are_noticed_soon() {
        for shift in [-3.0, 3.0] {
            let mut delays: Vec<usize> = (0..200)
                .filter_map(|seed| run(seed, 100, shift, 50))
                .collect();
            assert!(delays.len() >= 190, "{}", delays.len());
            delays.sort_unstable();
            assert!(delays[delays.len() / 2] <= 5, "{delays:?}");
            assert!(delays[delays.len() * 9 / 10] <= 8, "{delays:?}");
        }
    }

    #[test]
    fn odd_values_are_no_change() {
        let mut detector = ChangeDetector::new(0.01);
        for i in 0..500 {
            let value = match i % 100 {
                40 => 1e6,
                60 => f64::NAN,
                80 => f64::INFINITY,
                _ => 0.001 * f64::from(i % 7),
            };
            assert!(!detector.add(value), "{i}");
        }
    }
}
