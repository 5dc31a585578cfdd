//! A Gaussian process of the logarithm of costs, and the point at which the most improvement is
//! expected: Bayesian optimisation.
//!
//! Jones, Schonlau, Welch, *Efficient Global Optimization of Expensive Black-Box Functions*, 1998. Costs
//! of a build or a frame differ by factors, so that their logarithms are what is smooth. Good starts, which
//! the tuner asks first, replace most of an initial design; what is missing is made up by a Latin
//! hypercube. Candidates are random points of the cube and neighbours of the best point, each along one
//! axis or a little along all.
//!
//! Failures are no values: a candidate counts as much less as it is near to points that failed. Points that
//! are out count as if they had been told what the model expects of them, so that several may be open.
//! Whenever there are enough single measurements the best point is measured once more.
//!
//! Lengths of axes are found by the likelihood, one axis for each proposal in turns: a proposal takes the
//! time of some factorisations whatever the number of axes.
//!
//! Invariants: a function of its calls; at most [`MOST_POINTS`] points are kept, so that time and memory
//! are bounded; the best point is always among them. Not good for: thousands of cheap trials.

mod improvement;
mod model;

use std::collections::BTreeMap;

use super::latin_hypercube::latin_hypercube;
use super::{Estimate, Proposal, Search};
use crate::rng::Stream;
use improvement::log_expected_improvement;
use model::{Known, Model};

pub(super) const NAME: &str = "gaussian-process";

/// Points with a cost below which the cube is filled by a Latin hypercube.
const FIRST_POINTS: usize = 4;
/// Points that are kept.
const MOST_POINTS: usize = 100;
/// Points that are out and count as if told, the latest.
const MOST_OPEN: usize = 16;
/// Random candidates in the whole cube; and near the best point.
const FAR_CANDIDATES: usize = 96;
const NEAR_CANDIDATES: usize = 48;
/// Standard deviations of near candidates along each axis.
const NEAR: [f64; 3] = [0.3, 0.1, 0.03];
/// Lengths of axes that are tried, in sides of the cube.
const LENGTHS: [f64; 6] = [0.1, 0.2, 0.4, 0.8, 1.6, 4.0];
/// The index of the length that axes begin with.
const FIRST_LENGTH: usize = 3;
/// Standard deviation of the logarithm of one measurement while none was repeated.
const USUAL_NOISE: f64 = 0.01;
/// Points around which failures are counted.
const NEIGHBOURS: usize = 5;
/// Distance, in sides of the cube, below which neighbours count alike.
const FAILURE_REACH: f64 = 0.01;
/// The best point is measured again after so many proposals.
const REPLICATE_EVERY: u64 = 8;
/// Measurements of it that are enough.
const ENOUGH_SAMPLES: usize = 5;

/// Bayesian optimisation by a Gaussian process.
#[derive(Clone, Debug)]
pub struct GaussianProcess {
    /// Bins of discrete axes: their number, 0 of a real one.
    bins: Vec<f64>,
    stream: Stream,
    /// What was observed, at most once for a point.
    seen: Vec<Seen>,
    /// Points that are out, and the logarithm of the cost that is expected of them.
    open: BTreeMap<u64, (Vec<f64>, Option<f64>)>,
    hypercube: Vec<Vec<f64>>,
    /// Indices into [`LENGTHS`].
    lengths: Vec<usize>,
    next_axis: usize,
    proposals: u64,
    /// The improvement of the logarithm that is expected of the last proposal.
    expected_gain: Option<f64>,
}

/// An observed point.
#[derive(Clone, Debug, PartialEq)]
struct Seen {
    point: Vec<f64>,
    /// Logarithm of the mean cost; `None`: it failed.
    value: Option<f64>,
    samples: usize,
    /// Variance of the logarithm of the mean.
    noise: f64,
}

impl GaussianProcess {
    /// A search that has not begun.
    #[must_use]
    pub fn new() -> Self {
        Self {
            bins: Vec::new(),
            stream: Stream::new(0),
            seen: Vec::new(),
            open: BTreeMap::new(),
            hypercube: Vec::new(),
            lengths: Vec::new(),
            next_axis: 0,
            proposals: 0,
            expected_gain: None,
        }
    }

    /// The best point that was seen.
    fn best(&self) -> Option<&Seen> {
        let measured = self.seen.iter().filter(|seen| seen.value.is_some());
        measured.min_by(|a, b| {
            let [a, b] = [a, b].map(|seen| seen.value.unwrap_or(f64::INFINITY));
            a.total_cmp(&b)
        })
    }

    /// A point moved to the middle of its bins, so that equal configurations are equal points.
    fn snapped(&self, mut point: Vec<f64>) -> Vec<f64> {
        for (x, bins) in point.iter_mut().zip(&self.bins) {
            *x = x.clamp(0.0, 1.0);
            if *bins > 0.0 {
                *x = ((*x * bins).floor().min(bins - 1.0) + 0.5) / bins;
            }
        }
        point
    }

    fn candidates(&mut self) -> Vec<Vec<f64>> {
        let dimensions = self.bins.len();
        let mut candidates: Vec<Vec<f64>> = (0..FAR_CANDIDATES)
            .map(|_| self.stream.point(dimensions))
            .collect();
        if let Some(best) = self.best().map(|best| best.point.clone()) {
            for axis in 0..dimensions {
                let step = match self.bins[axis] {
                    bins if bins > 0.0 => 1.0 / bins,
                    _ => NEAR[2],
                };
                for reach in [-2.0, -1.0, 1.0, 2.0] {
                    let mut point = best.clone();
                    point[axis] += reach * step;
                    candidates.push(point);
                }
            }
            for index in 0..NEAR_CANDIDATES {
                let reach = NEAR[index % NEAR.len()];
                // The sum of three is nearly normal.
                let point = best
                    .iter()
                    .map(|x| {
                        let sum: f64 = (0..3).map(|_| self.stream.unit()).sum();
                        x + reach * 2.0 * (sum - 1.5)
                    })
                    .collect();
                candidates.push(point);
            }
        }
        candidates
            .into_iter()
            .map(|point| self.snapped(point))
            .collect()
    }

    /// What the model knows: measured points, and those that are out.
    fn known(&self) -> Vec<Known> {
        let values: Vec<f64> = self.seen.iter().filter_map(|seen| seen.value).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let variance = (squares / values.len() as f64).max(USUAL_NOISE * USUAL_NOISE);
        let measured = self.seen.iter().filter_map(|seen| {
            Some(Known {
                point: seen.point.clone(),
                value: seen.value?,
                noise: seen.noise / variance,
            })
        });
        let latest = self.open.values().rev().take(MOST_OPEN);
        let open = latest.filter_map(|(point, value)| {
            Some(Known {
                point: point.clone(),
                value: (*value)?,
                noise: USUAL_NOISE * USUAL_NOISE / variance,
            })
        });
        measured.chain(open).collect()
    }

    fn model(&mut self) -> Option<Model> {
        let known = self.known();
        let lengths = |indices: &[usize]| -> Vec<f64> {
            indices.iter().map(|&index| LENGTHS[index]).collect()
        };
        let mut best = Model::new(&known, &lengths(&self.lengths));
        let axis = self.next_axis % self.lengths.len();
        self.next_axis += 1;
        let own = self.lengths[axis];
        for other in [own.checked_sub(1), Some(own + 1)].into_iter().flatten() {
            if other >= LENGTHS.len() {
                continue;
            }
            let mut indices = self.lengths.clone();
            indices[axis] = other;
            let model = Model::new(&known, &lengths(&indices));
            let likelihood = |model: &Option<Model>| {
                model
                    .as_ref()
                    .map_or(f64::NEG_INFINITY, Model::log_likelihood)
            };
            if likelihood(&model) > likelihood(&best) {
                (best, self.lengths) = (model, indices);
            }
        }
        best
    }

    /// The share of what is around a point that did not fail.
    fn feasibility(&self, point: &[f64]) -> f64 {
        if self.seen.iter().all(|seen| seen.value.is_some()) {
            return 1.0;
        }
        let mut near: Vec<(f64, bool)> = self
            .seen
            .iter()
            .map(|seen| {
                let square: f64 = (seen.point.iter().zip(point))
                    .map(|(a, b)| (a - b) * (a - b))
                    .sum();
                (square, seen.value.is_some())
            })
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut good, mut all) = (0.0, 0.0);
        for (square, is_good) in near.into_iter().take(NEIGHBOURS) {
            let weight = 1.0 / (FAILURE_REACH * FAILURE_REACH + square);
            good += if is_good { weight } else { 0.0 };
            all += weight;
        }
        // Where all failed something may be right nevertheless.
        (good / all).max(1e-3)
    }

    /// The point at which the most is expected, its expected value, and the logarithm of what is expected.
    fn most_promising(&mut self) -> Option<(Vec<f64>, f64, f64)> {
        let best = self.best()?.value?;
        let model = self.model()?;
        let mut chosen: Option<(f64, Vec<f64>, f64)> = None;
        for point in self.candidates() {
            let is_known = self.seen.iter().any(|seen| seen.point == point)
                || self.open.values().any(|(open, _)| *open == point);
            if is_known {
                continue;
            }
            let prediction = model.predict(&point);
            let merit = log_expected_improvement(prediction, best) + self.feasibility(&point).ln();
            if chosen.as_ref().is_none_or(|(most, ..)| merit > *most) {
                chosen = Some((merit, point, prediction.mean));
            }
        }
        chosen.map(|(merit, point, mean)| (point, mean, merit))
    }

    /// Lets go of the point that tells least: a poor one with a near neighbour.
    fn forget_one(&mut self) {
        let best = self.best().map(|best| best.point.clone());
        let distance = |index: usize| {
            let own = &self.seen[index].point;
            let others = self.seen.iter().enumerate().filter(|(i, _)| *i != index);
            others
                .map(|(_, other)| {
                    own.iter()
                        .zip(&other.point)
                        .map(|(a, b)| (a - b) * (a - b))
                        .sum::<f64>()
                })
                .fold(f64::INFINITY, f64::min)
        };
        let least = self.best().and_then(|best| best.value).unwrap_or(0.0);
        let worth = |index: usize| {
            let loss = self.seen[index].value.map_or(1.0, |value| value - least);
            distance(index) / (0.05 + loss)
        };
        let poorest = (0..self.seen.len())
            .filter(|&index| Some(&self.seen[index].point) != best.as_ref())
            .map(|index| (worth(index), index))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, index)) = poorest {
            self.seen.remove(index);
        }
    }
}

impl Default for GaussianProcess {
    fn default() -> Self {
        Self::new()
    }
}

impl Search for GaussianProcess {
    fn name(&self) -> &'static str {
        NAME
    }

    fn begin(&mut self, steps: &[f64], seed: u64) {
        *self = Self::new();
        self.stream = Stream::new(seed);
        // A discrete axis of equal bins; others are taken as real, and the tuner knows equal ones.
        let bins = |step: &f64| {
            let bins = (1.0 / step).round();
            let is_whole = *step > 0.0 && (bins * step - 1.0).abs() < 1e-9;
            if is_whole { bins } else { 0.0 }
        };
        self.bins = steps.iter().map(bins).collect();
        self.lengths = vec![FIRST_LENGTH; steps.len()];
        let points = latin_hypercube(FIRST_POINTS, steps.len(), &mut self.stream);
        self.hypercube = points
            .into_iter()
            .map(|point| self.snapped(point))
            .collect();
    }

    fn propose(&mut self, ticket: u64) -> Proposal {
        self.proposals += 1;
        self.expected_gain = None;
        let proposal = |point: Vec<f64>, samples, step| Proposal {
            point,
            samples,
            step,
        };
        let measured = self.seen.iter().filter(|seen| seen.value.is_some()).count();
        if measured < FIRST_POINTS
            && let Some(point) = self.hypercube.pop()
        {
            self.open.insert(ticket, (point.clone(), None));
            return proposal(point, 1, "hypercube");
        }
        if self.proposals.is_multiple_of(REPLICATE_EVERY)
            && let Some(best) = self.best()
            && best.samples < ENOUGH_SAMPLES
        {
            let (point, samples) = (best.point.clone(), best.samples + 1);
            self.open.insert(ticket, (point.clone(), None));
            return proposal(point, samples, "replicate");
        }
        let (point, value, step) = match self.most_promising() {
            Some((point, value, merit)) => {
                self.expected_gain = Some(merit.exp());
                (point, Some(value), "improve")
            }
            None => {
                let point = self.stream.point(self.bins.len());
                (self.snapped(point), None, "explore")
            }
        };
        self.open.insert(ticket, (point.clone(), value));
        proposal(point, 1, step)
    }

    fn observe(&mut self, ticket: Option<u64>, point: &[f64], estimate: Estimate) {
        if let Some(ticket) = ticket {
            self.open.remove(&ticket);
        }
        let point = self.snapped(point.to_vec());
        let relative = if estimate.noise > 0.0 && estimate.mean > 0.0 {
            (estimate.noise / estimate.mean).min(1.0)
        } else {
            USUAL_NOISE
        };
        let seen = Seen {
            // A cost of 0 is as good as can be, and has no logarithm.
            value: estimate
                .mean
                .is_finite()
                .then(|| estimate.mean.max(f64::MIN_POSITIVE).ln()),
            samples: estimate.samples,
            noise: relative * relative / estimate.samples.max(1) as f64,
            point,
        };
        match self.seen.iter_mut().find(|own| own.point == seen.point) {
            Some(own) => *own = seen,
            None => self.seen.push(seen),
        }
        if self.seen.len() > MOST_POINTS {
            self.forget_one();
        }
    }

    fn withdraw(&mut self, ticket: u64) {
        self.open.remove(&ticket);
    }

    fn expected_gain(&self) -> Option<f64> {
        self.expected_gain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(mean: f64) -> Estimate {
        Estimate {
            mean,
            samples: 1,
            noise: 0.0,
        }
    }

    /// A valley whose second axis does not matter, and whose third has four bins.
    fn cost(point: &[f64]) -> f64 {
        1.0 + (point[0] - 0.3).powi(2) + 0.5 * (point[2] - 0.625).abs()
    }

    fn search(seed: u64) -> GaussianProcess {
        let mut search = GaussianProcess::new();
        search.begin(&[0.0, 0.0, 0.25], seed);
        search
    }

    #[test]
    fn a_valley_is_found_in_twenty_points() {
        for seed in 0..20 {
            let mut search = search(seed);
            for ticket in 0..25 {
                let point = search.propose(ticket).point;
                search.observe(Some(ticket), &point, told(cost(&point)));
            }
            let best = search.best().unwrap().value.unwrap().exp();
            assert!(best < 1.01, "{seed}: {best}");
        }
    }

    #[test]
    fn open_points_are_spread() {
        let mut search = search(3);
        for ticket in 0..10 {
            let point = search.propose(ticket).point;
            search.observe(Some(ticket), &point, told(cost(&point)));
        }
        let open: Vec<Vec<f64>> = (10..15).map(|t| search.propose(t).point).collect();
        for (i, a) in open.iter().enumerate() {
            for b in &open[..i] {
                assert_ne!(a, b);
            }
        }
    }

    #[test]
    fn less_is_promised_as_more_is_known() {
        let mut search = search(4);
        let mut promised = Vec::new();
        for ticket in 0..60 {
            let point = search.propose(ticket).point;
            promised.extend(search.expected_gain());
            search.observe(Some(ticket), &point, told(cost(&point)));
        }
        let mean = |gains: &[f64]| gains.iter().sum::<f64>() / gains.len() as f64;
        let (first, last) = (&promised[..5], &promised[promised.len() - 5..]);
        assert!(mean(last) < 0.2 * mean(first), "{promised:?}");
        assert!(promised.iter().all(|gain| *gain >= 0.0));
    }

    #[test]
    fn failures_are_kept_away_from() {
        let mut search = search(5);
        let mut far_off = 0;
        for ticket in 0..60 {
            let point = search.propose(ticket).point;
            // The best would be where it fails: at the border it goes on trying.
            let fails = point[0] < 0.5;
            far_off += usize::from(point[0] < 0.4 && ticket >= 30);
            let mean = if fails { f64::INFINITY } else { 1.0 + point[0] };
            search.observe(Some(ticket), &point, told(mean));
        }
        let best = search.best().unwrap();
        assert!(best.point[0] >= 0.5 && best.point[0] < 0.56, "{best:?}");
        assert!(far_off <= 3, "{far_off}");
    }

    #[test]
    fn memory_is_bounded_and_the_best_is_kept() {
        let mut search = search(6);
        let mut stream = Stream::new(1);
        let mut least = f64::INFINITY;
        for _ in 0..400 {
            let point = stream.point(3);
            let mean = cost(&point);
            least = least.min(mean);
            search.observe(None, &point, told(mean));
            assert!(search.seen.len() <= MOST_POINTS);
        }
        assert_eq!(search.best().unwrap().value.unwrap(), least.ln());
    }

    #[test]
    fn odd_costs_are_no_fault() {
        let mut search = search(7);
        let odd = [0.0, f64::MAX, 1e-300, f64::INFINITY, 1.0, 1.0, 1.0];
        for (ticket, mean) in odd.into_iter().cycle().take(60).enumerate() {
            let point = search.propose(ticket as u64).point;
            assert!(point.iter().all(|x| (0.0..=1.0).contains(x)));
            search.observe(Some(ticket as u64), &point, told(mean));
        }
    }
}
