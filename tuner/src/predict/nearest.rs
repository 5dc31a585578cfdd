//! A table of states and the best point of each; the nearest state answers.
//!
//! Herveau, Pfaffe, Tillmann, Tichy & Dachsbacher, "Analysis of Acceleration Structure Parameters and Hybrid
//! Autotuning for Ray Tracing" (TVCG), after Cover & Hart, "Nearest Neighbor Pattern Classification", IEEE
//! Transactions on Information Theory 1967: Euclidean distance of scaled states, and a known state answers
//! for itself. As printed it is [`Scaling::Printed`].
//!
//! Invariants: one entry per state; of equal costs and of equal distances the older stays. The least cost of
//! noisy ones is luck: tell means, not single measurements, where there are many. Time and memory grow with
//! the number of states. Not good for: states unlike all known ones.

use super::features::squared_distance;
use super::{Features, PredictError, Predictor, Scaling, check_cost, check_point};

/// The nearest neighbour among known states.
#[derive(Clone, Debug)]
pub struct NearestNeighbour {
    features: Features,
    axes: usize,
    scaling: Scaling,
    entries: Vec<Entry>,
}

#[derive(Clone, Debug)]
struct Entry {
    state: Vec<f64>,
    scaled: Vec<f64>,
    point: Vec<f64>,
    cost: f64,
}

impl NearestNeighbour {
    /// An empty table for points of `axes` axes.
    #[must_use]
    pub fn new(features: Features, axes: usize, scaling: Scaling) -> NearestNeighbour {
        NearestNeighbour {
            features,
            axes,
            scaling,
            entries: Vec::new(),
        }
    }

    /// Number of states in the table.
    #[must_use]
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether nothing was learned yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Distance of the nearest known state, in the units of the scaling: how much a prediction is a guess.
    ///
    /// # Errors
    /// For a state that is none.
    pub fn distance(&self, state: &[f64]) -> Result<Option<f64>, PredictError> {
        let scaled = self.features.scaled(state, self.scaling)?;
        Ok(self.nearest(state, &scaled).map(|entry| {
            if entry.state == state {
                0.0
            } else {
                squared_distance(&entry.scaled, &scaled).sqrt()
            }
        }))
    }

    fn nearest(&self, state: &[f64], scaled: &[f64]) -> Option<&Entry> {
        let known = self.entries.iter().find(|entry| entry.state == state);
        known.or_else(|| {
            let distance = |entry: &Entry| squared_distance(&entry.scaled, scaled);
            // The first of equals.
            let entries = self.entries.iter();
            entries.min_by(|a, b| distance(a).total_cmp(&distance(b)))
        })
    }
}

impl Predictor for NearestNeighbour {
    fn learn(&mut self, state: &[f64], point: &[f64], cost: f64) -> Result<(), PredictError> {
        let scaled = self.features.scaled(state, self.scaling)?;
        check_point(point, self.axes)?;
        check_cost(cost)?;
        let known = self.entries.iter_mut().find(|entry| entry.state == state);
        match known {
            Some(entry) if entry.cost <= cost => {}
            Some(entry) => {
                entry.point = point.to_vec();
                entry.cost = cost;
            }
            None => self.entries.push(Entry {
                state: state.to_vec(),
                scaled,
                point: point.to_vec(),
                cost,
            }),
        }
        Ok(())
    }

    fn predict(
        &self,
        state: &[f64],
        _candidates: &[Vec<f64>],
    ) -> Result<Option<Vec<f64>>, PredictError> {
        let scaled = self.features.scaled(state, self.scaling)?;
        let nearest = self.nearest(state, &scaled);
        Ok(nearest.map(|entry| entry.point.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scale;
    use crate::predict::{Feature, Subject};
    use crate::rng::Stream;

    fn table(scaling: Scaling) -> NearestNeighbour {
        let features = Features::new(vec![
            Feature::new("triangles", 1.0, 1e7, Scale::Log, Subject::Scene),
            Feature::new("x", -10.0, 10.0, Scale::Linear, Subject::View),
        ])
        .unwrap();
        NearestNeighbour::new(features, 1, scaling)
    }

    #[test]
    fn the_scaling_decides_who_is_near() {
        // The same scene from elsewhere, or another scene from nearly the same place.
        let answer = |scaling| {
            let mut table = table(scaling);
            table.learn(&[262e3, -9.0], &[0.1], 1.0).unwrap();
            table.learn(&[75e1, 5.0], &[0.9], 1.0).unwrap();
            table.predict(&[262e3, 4.0], &[]).unwrap().unwrap()[0]
        };
        assert_eq!(answer(Scaling::Printed), 0.9);
        assert_eq!(answer(Scaling::Rescaled), 0.1);
        assert_eq!(answer(Scaling::Raw), 0.1);
    }

    #[test]
    fn a_known_state_answers_with_its_least_cost() {
        let mut table = table(Scaling::Printed);
        // Beyond the bounds both states scale to the same.
        for (x, point, cost) in [
            (20.0, 0.1, 2.0),
            (30.0, 0.2, 2.0),
            (30.0, 0.3, 1.0),
            (30.0, 0.4, 1.0),
            (30.0, 0.5, 3.0),
        ] {
            table.learn(&[5.0, x], &[point], cost).unwrap();
        }
        assert_eq!(table.len(), 2);
        assert_eq!(table.predict(&[5.0, 30.0], &[]).unwrap(), Some(vec![0.3]));
        assert_eq!(table.predict(&[5.0, 20.0], &[]).unwrap(), Some(vec![0.1]));
        // Equally far from both: the older.
        assert_eq!(table.predict(&[5.0, 40.0], &[]).unwrap(), Some(vec![0.1]));
        assert_eq!(table.distance(&[5.0, 30.0]).unwrap(), Some(0.0));
    }

    #[test]
    fn the_nearest_is_that_of_sorted_distances() {
        let mut stream = Stream::new(8);
        let mut table = table(Scaling::Printed);
        let mut known = Vec::new();
        for index in 0..60 {
            let state = [1e7 * stream.unit(), 20.0 * stream.unit() - 10.0];
            let point = f64::from(index) / 60.0;
            table.learn(&state, &[point], 1.0).unwrap();
            known.push((state, point));
        }
        for _ in 0..200 {
            let state = [1e7 * stream.unit(), 20.0 * stream.unit() - 10.0];
            let mut sorted: Vec<(f64, f64)> = known
                .iter()
                .map(|(other, point)| {
                    let triangles = (state[0] - other[0]) / (1e7 - 1.0);
                    let x = (state[1] - other[1]) / 20.0;
                    (triangles.hypot(x), *point)
                })
                .collect();
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
            assert_eq!(table.predict(&state, &[]).unwrap().unwrap()[0], sorted[0].1);
            let distance = table.distance(&state).unwrap().unwrap();
            assert!((distance - sorted[0].0).abs() < 1e-12);
        }
    }
}
