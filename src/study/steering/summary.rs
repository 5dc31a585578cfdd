//! What a way did, in figures: the columns of Table 1 and more.

use super::Run;

/// What a way did, over all frames of some runs. Errors are shares of the target.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Summary {
    /// How many frames.
    pub frames: usize,
    /// Arithmetic mean of the step, lengths of a voxel.
    pub mean_step: f64,
    /// Geometric mean of the step.
    pub geometric_step: f64,
    /// Root mean square of what frames took beyond the target, over those that did.
    pub rmse_up: f64,
    /// The same of what they took less, over the others.
    pub rmse_low: f64,
    /// Root mean square over all.
    pub rmse: f64,
    /// The slowest frame: its time less the target; negative if no frame was slower.
    pub error_up: f64,
    /// The slowest frame with the camera outside of the volume, likewise.
    pub error_up_outside: f64,
    /// The fastest frame, likewise.
    pub error_low: f64,
    /// Share of frames above the target.
    pub slow: f64,
    /// Share of frames above 1.1 times the target.
    pub above_tenth: f64,
    /// Frames above 1.5 times the target.
    pub lags: usize,
    /// The longest run of frames above the target.
    pub slow_run: usize,
    /// Percentiles 50, 95, 99 of time over target.
    pub percentiles: [f64; 3],
    /// Root mean square of (predicted ÷ measured time − 1), after the first ten frames.
    pub prediction: f64,
    /// Root mean square of (estimated − true samples), over the mean of true ones.
    pub samples: f64,
    /// The same of predicted ÷ true cost of an estimated sample.
    pub cost: f64,
    /// Percentiles 50, 95, 99 of the time that prediction takes, over target.
    pub overhead: [f64; 3],
}

/// Frames that predictors may begin with.
const FIRST_FRAMES: usize = 10;

impl Summary {
    /// Of the runs of one way.
    #[must_use]
    pub fn of<'r>(runs: impl Iterator<Item = &'r Run>) -> Self {
        let mut loads = Vec::new();
        let mut outside = f64::NEG_INFINITY;
        let (mut steps, mut logs) = (0.0, 0.0);
        let (mut slow_run, mut overheads) = (0, Vec::new());
        let mut ratios: [Vec<f64>; 3] = Default::default();
        let mut mean_samples = 0.0;
        for run in runs {
            let mut slow = 0;
            for (index, frame) in run.frames.iter().enumerate() {
                let load = frame.frame_time / run.target;
                loads.push(load);
                if !frame.is_within {
                    outside = outside.max(load - 1.0);
                }
                steps += frame.step;
                logs += frame.step.ln();
                slow = if load > 1.0 { slow + 1 } else { 0 };
                slow_run = slow_run.max(slow);
                overheads.push(frame.overhead / run.target);
                if index < FIRST_FRAMES {
                    continue;
                }
                mean_samples += frame.samples;
                ratios[1].push(frame.estimated - frame.samples);
                let found = [frame.predicted / frame.cast_time, frame.cost_ratio];
                // A frame without samples has no ratio.
                for (all, ratio) in [0, 2].into_iter().zip(found) {
                    let all = &mut ratios[all];
                    all.extend(Some(ratio - 1.0).filter(|r| r.is_finite()));
                }
            }
        }
        loads.sort_by(f64::total_cmp);
        overheads.sort_by(f64::total_cmp);
        let count = loads.len();
        let at = |sorted: &[f64], share: f64| {
            let last = sorted.len().saturating_sub(1);
            sorted
                .get((last as f64 * share).round() as usize)
                .copied()
                .unwrap_or(f64::NAN)
        };
        let share = |limit: f64| {
            loads.iter().filter(|&&load| load > limit).count() as f64 / count.max(1) as f64
        };
        let up: Vec<f64> = loads
            .iter()
            .filter(|&&load| load > 1.0)
            .map(|l| l - 1.0)
            .collect();
        let low: Vec<f64> = loads
            .iter()
            .filter(|&&load| load <= 1.0)
            .map(|l| l - 1.0)
            .collect();
        let all: Vec<f64> = loads.iter().map(|l| l - 1.0).collect();
        Self {
            frames: count,
            mean_step: steps / count.max(1) as f64,
            geometric_step: (logs / count.max(1) as f64).exp(),
            rmse_up: root_mean_square(&up),
            rmse_low: root_mean_square(&low),
            rmse: root_mean_square(&all),
            error_up: at(&loads, 1.0) - 1.0,
            error_up_outside: outside,
            error_low: at(&loads, 0.0) - 1.0,
            slow: share(1.0),
            above_tenth: share(1.1),
            lags: loads.iter().filter(|&&load| load > 1.5).count(),
            slow_run,
            percentiles: [0.5, 0.95, 0.99].map(|p| at(&loads, p)),
            prediction: root_mean_square(&ratios[0]),
            samples: root_mean_square(&ratios[1]) * ratios[1].len() as f64 / mean_samples,
            cost: root_mean_square(&ratios[2]),
            overhead: [0.5, 0.95, 0.99].map(|p| at(&overheads, p)),
        }
    }
}

/// 0 of nothing.
fn root_mean_square(values: &[f64]) -> f64 {
    // The sum of nothing is −0.
    let squares = values.iter().fold(0.0, |sum, v| sum + v * v);
    (squares / values.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::steering::{FrameRow, Way};

    fn row(step: f64, frame_time: f64, predicted: f64) -> FrameRow {
        FrameRow {
            time: 0.0,
            step,
            step_spread: 1.0,
            frame_time,
            cast_time: frame_time,
            preparing: 0.0,
            overhead: 0.0,
            predicted,
            samples: 5.0,
            estimated: 5.0,
            cost_ratio: predicted / frame_time,
            is_switch: false,
            is_within: frame_time > 2.9,
            seam: None,
        }
    }

    #[test]
    fn a_summary_by_hand() {
        let mut frames = vec![row(1.0, 2.0, 2.0); FIRST_FRAMES];
        frames.extend([row(4.0, 3.0, 3.3), row(1.0, 2.1, 2.1), row(2.0, 1.0, 1.0)]);
        let run = Run {
            way: Way::Ours,
            target: 2.0,
            frames,
        };
        let found = Summary::of([&run].into_iter());
        assert_eq!((found.frames, found.lags, found.slow_run), (13, 0, 2));
        assert!((found.mean_step - 17.0 / 13.0).abs() < 1e-12);
        assert!((found.geometric_step - 8.0_f64.powf(1.0 / 13.0)).abs() < 1e-12);
        assert!((found.rmse_up - ((0.25 + 0.0025) / 2.0_f64).sqrt()).abs() < 1e-12);
        assert!((found.rmse_low - (0.25 / 11.0_f64).sqrt()).abs() < 1e-12);
        assert!((found.error_up - 0.5).abs() < 1e-12 && (found.error_low + 0.5).abs() < 1e-12);
        assert!((found.error_up_outside - 0.05).abs() < 1e-12);
        assert!((found.slow - 2.0 / 13.0).abs() < 1e-12);
        assert!((found.above_tenth - 1.0 / 13.0).abs() < 1e-12);
        assert!((found.prediction - (0.01 / 3.0_f64).sqrt()).abs() < 1e-12);
        assert_eq!(found.samples, 0.0);
    }
}
