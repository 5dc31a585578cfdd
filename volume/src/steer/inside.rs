//! Control inside a frame: between parts of a picture the step of what is left is solved anew, from the
//! time that has gone and the work that is expected still. So a wrong prediction, or a machine that has
//! something else to do, costs quality at once and time hardly.
//!
//! A part is expected to take its share of the samples, at its step, and its share of everything that
//! does not depend on the step; measured over expected time of the parts that are done says how wrong
//! that is, the more parts the better.
//!
//! Invariants: a step is on a ladder of sixteenths of an octave from that of the frame, at most half an octave
//! shorter and four octaves longer, and within its limits; equal times give equal steps.

use std::ops::Range;

use super::search::StepLimits;
use crate::estimate::Estimate;

/// The share of the target that is aimed at, so that the last part may err too.
const AIM: f64 = 0.99;

/// Expected times of the whole frame, over the target, between which nothing is changed.
const CALM: [f64; 2] = [0.97, 1.0];

/// Rungs of the ladder to an octave.
const RUNGS: f64 = 16.0;

/// Octaves from the step of the frame to the shortest and the longest of its parts.
const FINEST: f64 = -0.5;
const COARSEST: f64 = 4.0;

/// The time of the prediction that measured times are weighed against, as a share of the frame.
const TRUST: f64 = 1.0 / 32.0;

/// The share of a part in the work of its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartShare {
    /// Of the expected length of all rays.
    pub length: f64,
    /// Of the pixels.
    pub pixels: f64,
}

/// The shares of parts with these rows, by an estimate.
#[must_use]
pub fn part_shares(estimate: &Estimate, height: u32, parts: &[Vec<Range<u32>>]) -> Vec<PartShare> {
    let across = estimate.tiles[0] as usize;
    let lengths: Vec<f64> = estimate
        .rays
        .chunks_exact(across)
        .map(|row| row.iter().map(|ray| f64::from(ray.samples())).sum())
        .collect();
    let length_of = |rows: &Range<u32>| -> f64 {
        let squares = rows.start / estimate.tile_size..rows.end.div_ceil(estimate.tile_size);
        squares.filter_map(|row| lengths.get(row as usize)).sum()
    };
    let all: f64 = parts.iter().flatten().map(length_of).sum();
    let share = |part: &Vec<Range<u32>>| {
        let pixels: usize = part.iter().map(Range::len).sum();
        let pixels = pixels as f64 / f64::from(height.max(1));
        let length: f64 = part.iter().map(length_of).sum();
        PartShare {
            length: if all > 0.0 { length / all } else { pixels },
            pixels,
        }
    };
    parts.iter().map(share).collect()
}

/// How much of what the last frame taught about its parts is believed.
const RATIO_WEIGHT: f64 = 0.5;

/// The largest ratio of a part, and the smallest as its inverse.
const MOST_RATIO: f64 = 4.0;

/// What parts of earlier frames took over what was expected of them, relative to their frames. An
/// estimate errs in the same places from frame to frame, and what is known before needs no change of
/// step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartRatios {
    ratios: Vec<f64>,
}

impl PartRatios {
    /// Makes the shares of the next frame those that are to be expected.
    pub fn correct(&self, shares: &mut [PartShare]) {
        if self.ratios.len() != shares.len() {
            return;
        }
        let (mut length, mut pixels) = (0.0, 0.0);
        for (share, ratio) in shares.iter_mut().zip(&self.ratios) {
            share.length *= ratio;
            share.pixels *= ratio;
            length += share.length;
            pixels += share.pixels;
        }
        for share in shares {
            share.length /= length;
            share.pixels /= pixels;
        }
    }

    /// Learns from a frame, each part of which took so many seconds; with shares that were corrected.
    pub fn learn(&mut self, inside: &Inside, times: &[f64]) {
        let params = &inside.params;
        let count = params.shares.len();
        if times.len() != count || inside.steps.len() != count {
            return;
        }
        if self.ratios.len() != count {
            self.ratios = vec![1.0; count];
        }
        let expected: Vec<f64> = (0..count).map(|part| inside.expected_share(part)).collect();
        let rate = times.iter().sum::<f64>() / expected.iter().sum::<f64>();
        for ((ratio, time), expected) in self.ratios.iter_mut().zip(times).zip(expected) {
            let error = time / (expected * rate);
            if error > 0.0 && error.is_finite() {
                let wish = *ratio * error.powf(RATIO_WEIGHT);
                *ratio = wish.clamp(1.0 / MOST_RATIO, MOST_RATIO);
            }
        }
    }
}

/// What is known before the first part.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct InsideParams {
    /// Seconds that the frame may take.
    pub target: f64,
    /// Seconds that it is expected to take at its step.
    pub expected: f64,
    /// The share of them that is inverse to the step.
    pub sample_share: f64,
    /// The step of the frame, lengths of a voxel.
    pub step: f64,
    /// No step is shorter or longer.
    pub limits: StepLimits,
    /// The parts.
    pub shares: Vec<PartShare>,
}

impl InsideParams {
    /// A frame with `step`, expected to take `expected` seconds of `target`. Where nothing is expected,
    /// it is the target.
    #[must_use]
    pub fn new(
        target: f64,
        expected: f64,
        sample_share: f64,
        step: f64,
        limits: StepLimits,
        shares: Vec<PartShare>,
    ) -> Self {
        Self {
            target,
            expected: if expected > 0.0 && expected.is_finite() {
                expected
            } else {
                target
            },
            sample_share: sample_share.clamp(0.0, 1.0),
            step,
            limits,
            shares,
        }
    }
}

/// Chooses the steps of the parts of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Inside {
    params: InsideParams,
    /// Seconds before the first part, which belong to none.
    start: f64,
    steps: Vec<f64>,
}

impl Inside {
    /// Control of a frame that has not begun.
    #[must_use]
    pub fn new(params: InsideParams) -> Self {
        Self {
            start: 0.0,
            steps: Vec::with_capacity(params.shares.len()),
            params,
        }
    }

    /// The step of the next part, `elapsed` seconds after the beginning of the frame.
    pub fn next_step(&mut self, elapsed: f64) -> f64 {
        if self.steps.is_empty() {
            self.start = elapsed;
        }
        let step = self.solved(elapsed);
        self.steps.push(step);
        step
    }

    /// The steps of the parts so far.
    #[must_use]
    pub fn steps(&self) -> &[f64] {
        &self.steps
    }

    /// The step with which a whole frame has as many samples; the step of the frame if it has none.
    #[must_use]
    pub fn mean_step(&self) -> f64 {
        let parts = self.steps.iter().zip(&self.params.shares);
        let (mut length, mut samples) = (0.0, 0.0);
        for (step, share) in parts {
            length += share.length;
            samples += share.length / step;
        }
        if samples > 0.0 {
            length / samples
        } else {
            self.params.step
        }
    }

    /// What a part that was begun is expected to take, as a share of the expected time.
    fn expected_share(&self, part: usize) -> f64 {
        let share = &self.params.shares[part];
        let samples = self.params.sample_share * share.length;
        samples * self.params.step / self.steps[part]
            + (1.0 - self.params.sample_share) * share.pixels
    }

    fn solved(&self, elapsed: f64) -> f64 {
        let InsideParams {
            target,
            expected,
            sample_share,
            step,
            limits,
            shares,
        } = &self.params;
        let Some(&last) = self.steps.last() else {
            return *step;
        };
        let samples = |share: &PartShare| sample_share * share.length;
        let others = |share: &PartShare| (1.0 - sample_share) * share.pixels;
        let begun = self.steps.len().min(shares.len());
        let left = &shares[begun..];
        let done: f64 = (0..begun).map(|part| self.expected_share(part)).sum();
        // Seconds for what is expected to take the whole expected time.
        let expected = (expected - self.start).max(0.0);
        let rate = (elapsed - self.start + TRUST * expected) / (done + TRUST);
        let left_samples = rate * left.iter().map(samples).sum::<f64>();
        let left_others = rate * left.iter().map(others).sum::<f64>();
        let total = elapsed + left_others + left_samples * step / last;
        if !total.is_finite() || (CALM[0]..=CALM[1]).contains(&(total / target)) {
            return last;
        }
        let budget = AIM * target - elapsed - left_others;
        let wish = if budget > 0.0 {
            left_samples * step / budget
        } else {
            f64::INFINITY
        };
        // Up, so that the budget holds.
        let rung = ((wish / step).log2() * RUNGS)
            .ceil()
            .clamp(FINEST * RUNGS, COARSEST * RUNGS);
        (step * (rung / RUNGS).exp2()).clamp(limits.shortest, limits.longest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::TILE_SIZE;

    const LIMITS: StepLimits = StepLimits {
        shortest: 0.25,
        longest: 8.0,
    };

    /// Leads a frame on a machine that takes `truth` times what is expected; its time over the target,
    /// and its control.
    fn lead(expected: f64, sample_share: f64, truth: impl Fn(usize) -> f64) -> (f64, Inside) {
        let share = |i: usize| PartShare {
            length: [0.02, 0.105][i % 2],
            pixels: 1.0 / 16.0,
        };
        let shares: Vec<PartShare> = (0..16).map(share).collect();
        let params = InsideParams::new(1.0, expected, sample_share, 1.0, LIMITS, shares.clone());
        let mut inside = Inside::new(params);
        let mut elapsed = 0.0;
        for (part, share) in shares.iter().enumerate() {
            let step = inside.next_step(elapsed);
            let samples = sample_share * share.length / step;
            let others = (1.0 - sample_share) * share.pixels;
            elapsed += truth(part) * expected * (samples + others);
        }
        (elapsed, inside)
    }

    #[test]
    fn a_right_prediction_changes_nothing() {
        let (time, inside) = lead(0.98, 0.8, |_| 1.0);
        assert!((time - 0.98).abs() < 1e-9);
        assert!(inside.steps().iter().all(|&step| step == 1.0));
        assert_eq!(inside.mean_step(), 1.0);
    }

    #[test]
    fn wrong_predictions_hold_the_target_nevertheless() {
        for wrong in [1.1, 1.3, 1.6] {
            let (time, inside) = lead(0.95, 0.8, |_| wrong);
            assert!(time < 1.03, "{wrong}: {time}");
            assert!(inside.mean_step() > 1.0 && inside.mean_step() < 2.5);
        }
        // What is too fast becomes finer.
        let (time, inside) = lead(0.95, 0.8, |_| 0.6);
        assert!(time > 0.7 && time < 1.0, "{time}");
        assert!(inside.mean_step() < 1.0);
    }

    #[test]
    fn a_machine_that_slows_down_on_the_way() {
        let (time, _) = lead(0.95, 0.8, |part| if part < 8 { 1.0 } else { 1.4 });
        assert!(time < 1.1, "{time}");
    }

    #[test]
    fn steps_stay_on_their_ladder() {
        for wrong in [0.01, 100.0, f64::INFINITY, f64::NAN] {
            let (_, inside) = lead(0.95, 0.9, |_| wrong);
            assert!(inside.steps().iter().all(|step| (0.5..=8.0).contains(step)));
        }
    }

    #[test]
    fn what_a_part_takes_is_known_from_the_last_frame() {
        // An estimate that errs by up to four times, in the same places always.
        let truth = |part: usize| [0.5, 1.0, 2.0, 0.7][part % 4];
        let given = vec![
            PartShare {
                length: 1.0 / 16.0,
                pixels: 1.0 / 16.0,
            };
            16
        ];
        let mut ratios = PartRatios::default();
        let spreads: Vec<f64> = (0..12)
            .map(|_| {
                let mut shares = given.clone();
                ratios.correct(&mut shares);
                let params = InsideParams::new(1.0, 0.98, 0.8, 1.0, LIMITS, shares);
                let mut inside = Inside::new(params);
                // Something is done before the first part, and is no part of it.
                let mut elapsed = 0.03;
                let mut times = Vec::new();
                for (part, share) in given.iter().enumerate() {
                    let step = inside.next_step(elapsed);
                    let work = 0.8 * share.length / step + 0.2 * share.pixels;
                    times.push(0.95 * truth(part) / 1.05 * work);
                    elapsed += times[part];
                }
                ratios.learn(&inside, &times);
                let steps = inside.steps().iter().copied();
                steps.clone().fold(0.0, f64::max) / steps.fold(f64::INFINITY, f64::min)
            })
            .collect();
        assert!(spreads[0] > 1.5, "{spreads:?}");
        assert!(spreads[11] < 1.1, "{spreads:?}");
        // Times that cannot be teach nothing.
        let before = ratios.clone();
        let mut inside = Inside::new(InsideParams::new(1.0, 1.0, 0.8, 1.0, LIMITS, given.clone()));
        for _ in 0..16 {
            inside.next_step(f64::NAN);
        }
        ratios.learn(&inside, &[f64::NAN; 16]);
        ratios.learn(&inside, &[0.1; 3]);
        assert_eq!(ratios, before);
    }

    #[test]
    fn shares_add_up() {
        let ray = |end: f32| crate::estimate::EstimatedRay {
            front: 1.0,
            back: end,
            end,
            ..Default::default()
        };
        let estimate = Estimate {
            tile_size: TILE_SIZE,
            tiles: [2, 9],
            rays: (0..18).map(|i| ray(2.0 + i as f32)).collect(),
            in_box: 18,
            steps: 18,
        };
        let parts = crate::cast::parts(70);
        let shares = part_shares(&estimate, 70, &parts);
        let sum = |of: fn(&PartShare) -> f64| shares.iter().map(of).sum::<f64>();
        assert!((sum(|s| s.length) - 1.0).abs() < 1e-12);
        assert!((sum(|s| s.pixels) - 1.0).abs() < 1e-12);
        // The last rows have the longest rays.
        let last = parts.iter().position(|part| part[0].contains(&69)).unwrap();
        assert!(shares[last].length > shares[last].pixels);
    }
}
