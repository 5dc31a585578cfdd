//! Latin hypercube, then stochastic Nelder–Mead: the search of the autotuning paper.
//!
//! Herveau, Pfaffe, Tillmann, Tichy & Dachsbacher, "Analysis of Acceleration Structure Parameters
//! and Hybrid Autotuning for Ray Tracing" (TVCG): a Latin hypercube of d + 1 points spans the first
//! simplex. Nelder & Mead, "A Simplex Method for Function Minimization", 1965: the worst point is
//! reflected at the centroid of the others. Chang, "Stochastic Nelder–Mead simplex method", EJOR
//! 2012, for noisy costs:
//!
//! 1. Costs are means, and the number of measurements grows slowly with the iterations. We spend
//!    them where they change a decision: a bad point is refused on its first measurement, a good
//!    one is confirmed before it enters, and the best vertex is measured again when it has fallen
//!    behind. A lucky measurement cannot stay for ever.
//! 2. No shrink. When contraction fails, one point is drawn: from the whole cube with a probability
//!    that falls with the iterations, else near the best vertex. It replaces the worst if better.
//!
//! Our additions: points outside the cube are projected; a failed configuration costs infinity;
//! of equal costs the older is better; a simplex that has collapsed is replaced by a new Latin
//! hypercube over the whole cube, beside the best vertex, which is kept.
//!
//! Several open proposals: the hypercube is handed out at once, but an iteration is one chain of
//! decisions. While its point is out, further proposals are uniform random points ("explore") and
//! count like any foreign observation: one that is better than the worst vertex replaces it.
//!
//! Invariants: vertices are sorted by cost, then age; outside the hypercube phase there are at most
//! d + 1; at most one move is out. Not good for: many axes (d above 20), costs that say little about
//! their neighbourhood.

use std::collections::{BTreeMap, VecDeque};

use super::latin_hypercube::latin_hypercube;
use super::{Estimate, Proposal, Search};
use crate::rng::Stream;

pub(super) const NAME: &str = "nelder-mead";

/// Reflection, expansion and contraction: 1, 2 and 1/2 of Nelder & Mead 1965.
const EXPANSION: f64 = 2.0;
const CONTRACTION: f64 = 0.5;
/// Probability of a global instead of a local draw, at the start and in the end.
const GLOBAL_AT_START: f64 = 0.5;
const GLOBAL_IN_THE_END: f64 = 0.1;
/// Iterations after which the probability has fallen half of the way. Ours: well inside a run of
/// the paper, which has 80.
const GLOBAL_HALF_LIFE: f64 = 20.0;
/// One more measurement per vertex whenever the iterations have grown by this factor: logarithmic
/// growth, with a second measurement in the second half of the paper's 80.
const SAMPLES_GROWTH: f64 = 32.0;
/// Extent below which a simplex has collapsed on a real axis, and least radius of a local draw
/// there. A thousandth of a range is below what a cost with one per cent of noise can tell.
const REAL_STEP: f64 = 1e-3;

/// Latin hypercube of d + 1 points followed by stochastic Nelder–Mead.
#[derive(Clone, Debug)]
pub struct LatinHypercubeNelderMead {
    /// Extent per axis below which the simplex has collapsed.
    steps: Vec<f64>,
    stream: Stream,
    /// Points of the hypercube that are not proposed yet.
    hypercube: VecDeque<Vec<f64>>,
    /// Points of the hypercube that are out.
    hypercube_out: BTreeMap<u64, Vec<f64>>,
    vertices: Vec<Vertex>,
    /// Age of the next vertex.
    births: u64,
    iteration: u64,
    /// What to look at next; kept while it is out.
    current: Option<Move>,
    current_out: Option<u64>,
    noise: f64,
}

#[derive(Clone, Debug)]
struct Vertex {
    point: Vec<f64>,
    mean: f64,
    samples: usize,
    birth: u64,
}

/// A point of an iteration.
#[derive(Clone, Debug)]
struct Move {
    point: Vec<f64>,
    samples: usize,
    step: Step,
}

#[derive(Clone, Debug)]
enum Step {
    /// Measure the best vertex again.
    Resample,
    Reflect(Line),
    Expand {
        reflected: Vec<f64>,
        reflection: Estimate,
    },
    ContractOutside {
        reflected: Vec<f64>,
        reflection: Estimate,
    },
    ContractInside,
    Global,
    Local,
}

/// The line an iteration moves along.
#[derive(Clone, Debug)]
struct Line {
    worst: Vec<f64>,
    centroid: Vec<f64>,
}

impl Line {
    /// `centroid + factor (centroid - worst)`, projected onto the cube.
    fn at(&self, factor: f64) -> Vec<f64> {
        let pairs = self.centroid.iter().zip(&self.worst);
        pairs
            .map(|(c, w)| (c + factor * (c - w)).clamp(0.0, 1.0))
            .collect()
    }
}

impl Step {
    fn name(&self) -> &'static str {
        match self {
            Step::Resample => "resample",
            Step::Reflect(_) => "reflect",
            Step::Expand { .. } => "expand",
            Step::ContractOutside { .. } => "contract-outside",
            Step::ContractInside => "contract-inside",
            Step::Global => "draw-global",
            Step::Local => "draw-local",
        }
    }
}

impl LatinHypercubeNelderMead {
    /// A search that waits for [`Search::begin`].
    pub fn new() -> LatinHypercubeNelderMead {
        LatinHypercubeNelderMead {
            steps: Vec::new(),
            stream: Stream::new(0),
            hypercube: VecDeque::new(),
            hypercube_out: BTreeMap::new(),
            vertices: Vec::new(),
            births: 0,
            iteration: 0,
            current: None,
            current_out: None,
            noise: 0.0,
        }
    }

    fn dimensions(&self) -> usize {
        self.steps.len()
    }

    fn hypercube_is_open(&self) -> bool {
        !self.hypercube.is_empty() || !self.hypercube_out.is_empty()
    }

    /// Measurements a vertex needs by now.
    fn samples_wanted(&self) -> usize {
        1 + ((self.iteration as f64 + 1.0).ln() / SAMPLES_GROWTH.ln()) as usize
    }

    /// Puts what is known of a point into the simplex: news of a vertex, a new vertex while the
    /// hypercube is open, or a replacement of a worse one.
    fn absorb(&mut self, point: &[f64], estimate: Estimate) {
        let Estimate { mean, samples, .. } = estimate;
        let known = self
            .vertices
            .iter_mut()
            .find(|vertex| vertex.point == point);
        if let Some(vertex) = known {
            (vertex.mean, vertex.samples) = (mean, samples);
        } else {
            if !self.hypercube_is_open() && self.vertices.len() > self.dimensions() {
                match self.vertices.pop_if(|worst| mean < worst.mean) {
                    Some(_) => {}
                    None => return,
                }
            }
            let (point, birth) = (point.to_vec(), self.births);
            self.vertices.push(Vertex {
                point,
                mean,
                samples,
                birth,
            });
            self.births += 1;
        }
        self.sort();
    }

    fn sort(&mut self) {
        self.vertices
            .sort_by(|a, b| a.mean.total_cmp(&b.mean).then(a.birth.cmp(&b.birth)));
    }

    /// Keeps the best d + 1 vertices once the whole hypercube is known.
    fn close_hypercube_if_known(&mut self) {
        if !self.hypercube_is_open() {
            self.vertices.truncate(self.dimensions() + 1);
        }
    }

    /// Whether the simplex can no longer tell directions: smaller than a step of every axis, costs
    /// equal up to noise, nothing but failures, or vertices lost.
    fn has_collapsed(&self) -> bool {
        let (Some(best), Some(worst)) = (self.vertices.first(), self.vertices.last()) else {
            return true;
        };
        let tiny = (0..self.dimensions()).all(|axis| self.extent(axis) < self.steps[axis]);
        tiny || best.mean.is_infinite()
            || worst.mean - best.mean <= 2.0 * self.noise
            || self.vertices.len() <= self.dimensions()
    }

    /// Length of the simplex along `axis`.
    fn extent(&self, axis: usize) -> f64 {
        let mut low = f64::INFINITY;
        let mut high = f64::NEG_INFINITY;
        for vertex in &self.vertices {
            low = low.min(vertex.point[axis]);
            high = high.max(vertex.point[axis]);
        }
        high - low
    }

    /// A new hypercube. The best vertex stays, unless it is a failure.
    fn restart(&mut self) {
        self.vertices.truncate(1);
        self.vertices.retain(|best| best.mean.is_finite());
        let count = self.dimensions() + 1 - self.vertices.len();
        self.hypercube = latin_hypercube(count, self.dimensions(), &mut self.stream).into();
    }

    /// The first move of an iteration. The simplex has not collapsed.
    fn begin_iteration(&self) -> Move {
        let best = &self.vertices[0];
        let samples = self.samples_wanted();
        if best.samples < samples {
            return Move {
                point: best.point.clone(),
                samples,
                step: Step::Resample,
            };
        }
        let (worst, others) = self
            .vertices
            .split_last()
            .expect("d + 1 vertices, d at least 1");
        let centre = |axis: usize| {
            others.iter().map(|vertex| vertex.point[axis]).sum::<f64>() / others.len() as f64
        };
        let line = Line {
            worst: worst.point.clone(),
            centroid: (0..self.dimensions()).map(centre).collect(),
        };
        Move {
            point: line.at(1.0),
            samples: 1,
            step: Step::Reflect(line),
        }
    }

    /// One draw of the adaptive random search of Chang 2012.
    fn draw(&mut self) -> Move {
        let fallen = GLOBAL_HALF_LIFE / (GLOBAL_HALF_LIFE + self.iteration as f64);
        let global = GLOBAL_IN_THE_END + (GLOBAL_AT_START - GLOBAL_IN_THE_END) * fallen;
        if self.stream.unit() < global {
            let point = self.stream.point(self.dimensions());
            return Move {
                point,
                samples: 1,
                step: Step::Global,
            };
        }
        let mut point = self.vertices[0].point.clone();
        for (axis, coordinate) in point.iter_mut().enumerate() {
            // As far as the simplex reaches, and to the next value of a discrete axis.
            let radius = self.extent(axis).max(self.steps[axis]);
            *coordinate += radius * (2.0 * self.stream.unit() - 1.0);
            *coordinate = coordinate.clamp(0.0, 1.0);
        }
        Move {
            point,
            samples: 1,
            step: Step::Local,
        }
    }

    /// Decides about the point of `current`: the next move of the iteration, or `None` at its end.
    fn decide(&mut self, current: Move, estimate: Estimate) -> Option<Move> {
        let Move { point, step, .. } = current;
        let cost = estimate.mean;
        let one = |point, step| {
            Some(Move {
                point,
                samples: 1,
                step,
            })
        };
        let (best, worst) = (
            self.vertices[0].mean,
            self.vertices[self.vertices.len() - 1].mean,
        );

        if let Step::Resample = step {
            self.absorb(&point, estimate);
            return None;
        }
        let samples = self.samples_wanted();
        if cost < worst && estimate.samples < samples {
            return Some(Move {
                point,
                samples,
                step,
            });
        }
        match step {
            Step::Reflect(line) => {
                let second_worst = self.vertices[self.vertices.len() - 2].mean;
                let (reflected, reflection) = (point, estimate);
                if cost < best {
                    return one(
                        line.at(EXPANSION),
                        Step::Expand {
                            reflected,
                            reflection,
                        },
                    );
                }
                if cost >= worst {
                    return one(line.at(-CONTRACTION), Step::ContractInside);
                }
                if cost >= second_worst {
                    let point = line.at(CONTRACTION);
                    return one(
                        point,
                        Step::ContractOutside {
                            reflected,
                            reflection,
                        },
                    );
                }
                self.absorb(&reflected, reflection);
            }
            Step::Expand {
                reflected,
                reflection,
            } => {
                if cost < reflection.mean {
                    self.absorb(&point, estimate);
                } else {
                    self.absorb(&reflected, reflection);
                }
            }
            Step::ContractOutside {
                reflected,
                reflection,
            } => {
                if cost > reflection.mean {
                    // The reflected point is still better than the worst vertex.
                    self.absorb(&reflected, reflection);
                    return Some(self.draw());
                }
                self.absorb(&point, estimate);
            }
            Step::ContractInside => {
                if cost >= worst {
                    return Some(self.draw());
                }
                self.absorb(&point, estimate);
            }
            Step::Global | Step::Local | Step::Resample => self.absorb(&point, estimate),
        }
        self.iteration += 1;
        None
    }
}

impl Default for LatinHypercubeNelderMead {
    fn default() -> LatinHypercubeNelderMead {
        LatinHypercubeNelderMead::new()
    }
}

impl Search for LatinHypercubeNelderMead {
    fn name(&self) -> &'static str {
        NAME
    }

    fn begin(&mut self, steps: &[f64], seed: u64) {
        *self = LatinHypercubeNelderMead::new();
        self.steps = steps.iter().map(|step| step.max(REAL_STEP)).collect();
        self.stream = Stream::new(seed);
        self.restart();
    }

    fn propose(&mut self, ticket: u64) -> Proposal {
        if !self.hypercube_is_open() && self.current.is_none() && self.has_collapsed() {
            self.restart();
        }
        if let Some(point) = self.hypercube.pop_front() {
            self.hypercube_out.insert(ticket, point.clone());
            return Proposal {
                point,
                samples: 1,
                step: "latin-hypercube",
            };
        }
        if !self.hypercube_out.is_empty() || self.current_out.is_some() {
            let point = self.stream.point(self.dimensions());
            return Proposal {
                point,
                samples: 1,
                step: "explore",
            };
        }
        let current = self
            .current
            .take()
            .unwrap_or_else(|| self.begin_iteration());
        let Move {
            point,
            samples,
            step,
        } = &current;
        let proposal = Proposal {
            point: point.clone(),
            samples: *samples,
            step: step.name(),
        };
        self.current = Some(current);
        self.current_out = Some(ticket);
        proposal
    }

    fn observe(&mut self, ticket: Option<u64>, point: &[f64], estimate: Estimate) {
        self.noise = estimate.noise;
        if ticket.is_some() && ticket == self.current_out {
            self.current_out = None;
            if let Some(current) = self.current.take() {
                self.current = self.decide(current, estimate);
            }
            return;
        }
        // Absorbed before the hypercube may count as known: its last point must not push out a
        // vertex, truncation afterwards keeps the best of all.
        self.absorb(point, estimate);
        if ticket.is_some_and(|ticket| self.hypercube_out.remove(&ticket).is_some()) {
            self.close_hypercube_if_known();
        }
    }

    fn withdraw(&mut self, ticket: u64) {
        if let Some(point) = self.hypercube_out.remove(&ticket) {
            self.hypercube.push_front(point);
        } else if self.current_out == Some(ticket) {
            self.current_out = None;
        }
    }
}

#[cfg(test)]
mod tests;
