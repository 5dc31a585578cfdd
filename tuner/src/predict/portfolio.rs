//! A few points that are good somewhere: each is measured in a new state, and the best is kept.
//!
//! Members are chosen one after the other, each to lower the mean logarithm of the loss of the best member
//! over all known states the most: the greedy rule for covering (Nemhauser, Wolsey & Fisher, "An Analysis of
//! Approximations for Maximizing Submodular Set Functions", Mathematical Programming 1978), as portfolios of
//! algorithms are made (Xu, Hoos & Leyton-Brown, "Hydra", AAAI 2010). Until a state has measurements of its
//! own, the nearest state's best member stands in.
//!
//! Invariants: a prediction is a member; in a state in which all members were measured it is the one of least
//! mean cost; equal costs go to the earlier member. Not good for: states in which a measurement costs more
//! than the best member can save.

use std::collections::HashMap;

use super::features::squared_distance;
use super::{Features, PredictError, Predictor, Scaling, check_cost, check_point};

/// Chooses at most `size` points that together are good in all states. Each entry of `states` is what was
/// measured in one state: points and their costs. A point that was not measured in a state does not help
/// there; a state without a member is charged its worst cost. Stops early when nothing is gained any more.
///
/// # Errors
/// [`PredictError::BadCost`].
pub fn greedy_members(
    states: &[Vec<(Vec<f64>, f64)>],
    size: usize,
) -> Result<Vec<Vec<f64>>, PredictError> {
    let mut points: Vec<&[f64]> = Vec::new();
    let mut index_of: HashMap<Vec<u64>, usize> = HashMap::new();
    // For each point, its logarithmic costs: state and cost, in the order they were given.
    let mut costs: Vec<Vec<(usize, f64)>> = Vec::new();
    let mut losses = Vec::with_capacity(states.len());
    for (state, measured) in states.iter().enumerate() {
        let mut worst = f64::NEG_INFINITY;
        for (point, cost) in measured {
            check_cost(*cost)?;
            let key = point.iter().map(|x| (x + 0.0).to_bits()).collect();
            let index = *index_of.entry(key).or_insert_with(|| {
                points.push(point);
                costs.push(Vec::new());
                points.len() - 1
            });
            let value = libm::log(*cost);
            costs[index].push((state, value));
            worst = worst.max(value);
        }
        losses.push(worst);
    }
    let mut members = Vec::new();
    while members.len() < size {
        let gain = |costs: &Vec<(usize, f64)>| -> f64 {
            let own = costs.iter();
            own.map(|&(state, value)| (losses[state] - value).max(0.0))
                .sum()
        };
        let mut best = (0.0, None);
        for (index, costs) in costs.iter().enumerate() {
            let gain = gain(costs);
            if gain > best.0 {
                best = (gain, Some(index));
            }
        }
        // States in which all costs are equal gain nothing, yet need a member.
        let Some(index) = best
            .1
            .or((members.is_empty() && !points.is_empty()).then_some(0))
        else {
            break;
        };
        for &(state, value) in &costs[index] {
            losses[state] = losses[state].min(value);
        }
        members.push(points[index].to_vec());
    }
    Ok(members)
}

/// A portfolio and what its members cost in states.
#[derive(Clone, Debug)]
pub struct Portfolio {
    features: Features,
    scaling: Scaling,
    members: Vec<Vec<f64>>,
    states: Vec<State>,
}

#[derive(Clone, Debug)]
struct State {
    state: Vec<f64>,
    scaled: Vec<f64>,
    /// For each member, the number of its measurements and their mean.
    means: Vec<(u32, f64)>,
}

impl State {
    /// The measured member of least mean, and its mean.
    fn best(&self) -> Option<usize> {
        let measured = (0..self.means.len()).filter(|&member| self.means[member].0 > 0);
        measured.min_by(|&a, &b| self.means[a].1.total_cmp(&self.means[b].1))
    }
}

impl Portfolio {
    /// A portfolio of the given members, the most useful first, of which nothing is known. What is given
    /// twice is one member.
    ///
    /// # Errors
    /// [`PredictError::NoMember`] without one; for members that are no points of one cube.
    pub fn new(
        features: Features,
        scaling: Scaling,
        members: Vec<Vec<f64>>,
    ) -> Result<Portfolio, PredictError> {
        let axes = members.first().ok_or(PredictError::NoMember)?.len();
        let mut different: Vec<Vec<f64>> = Vec::with_capacity(members.len());
        for member in members {
            check_point(&member, axes)?;
            if !different.contains(&member) {
                different.push(member);
            }
        }
        Ok(Portfolio {
            features,
            scaling,
            members: different,
            states: Vec::new(),
        })
    }

    /// The members in their order.
    #[must_use]
    pub fn members(&self) -> &[Vec<f64>] {
        &self.members
    }

    /// The first member that was not measured in `state` yet; `None` when all were.
    ///
    /// # Errors
    /// For a state that is none.
    pub fn next(&self, state: &[f64]) -> Result<Option<&[f64]>, PredictError> {
        self.features.scaled(state, self.scaling)?;
        let known = self.states.iter().find(|known| known.state == state);
        let index = match known {
            Some(known) => known.means.iter().position(|&(count, _)| count == 0),
            None => Some(0),
        };
        Ok(index.map(|index| &self.members[index][..]))
    }
}

impl Predictor for Portfolio {
    /// Learns what a member cost. Other points are no business of a portfolio: nothing is learned of them.
    fn learn(&mut self, state: &[f64], point: &[f64], cost: f64) -> Result<(), PredictError> {
        let scaled = self.features.scaled(state, self.scaling)?;
        check_point(point, self.members[0].len())?;
        check_cost(cost)?;
        let Some(member) = self.members.iter().position(|member| member == point) else {
            return Ok(());
        };
        let index = self.states.iter().position(|known| known.state == state);
        let index = index.unwrap_or_else(|| {
            self.states.push(State {
                state: state.to_vec(),
                scaled,
                means: vec![(0, 0.0); self.members.len()],
            });
            self.states.len() - 1
        });
        let (count, mean) = &mut self.states[index].means[member];
        *count = count.saturating_add(1);
        *mean += (cost - *mean) / f64::from(*count);
        Ok(())
    }

    /// The best member measured in this state; else of the nearest state; else the first.
    fn predict(
        &self,
        state: &[f64],
        _candidates: &[Vec<f64>],
    ) -> Result<Option<Vec<f64>>, PredictError> {
        let scaled = self.features.scaled(state, self.scaling)?;
        let known = self.states.iter().find(|known| known.state == state);
        let nearest = known.or_else(|| {
            let distance = |known: &State| squared_distance(&known.scaled, &scaled);
            let states = self.states.iter();
            states.min_by(|a, b| distance(a).total_cmp(&distance(b)))
        });
        let best = nearest.and_then(State::best).unwrap_or(0);
        Ok(Some(self.members[best].clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scale;
    use crate::predict::{Feature, Subject};

    fn point(x: f64) -> Vec<f64> {
        vec![x]
    }

    fn portfolio(members: &[f64]) -> Portfolio {
        let feature = Feature::new("x", 0.0, 10.0, Scale::Linear, Subject::Scene);
        let features = Features::new(vec![feature]).unwrap();
        let members = members.iter().copied().map(point).collect();
        Portfolio::new(features, Scaling::Printed, members).unwrap()
    }

    #[test]
    fn members_worked_by_hand() {
        // 0.5 is second everywhere: the gains are ln 2 + ln 2, against ln 4 of either specialist.
        let states = [
            vec![(point(0.1), 1.0), (point(0.5), 1.5), (point(0.9), 4.0)],
            vec![(point(0.9), 1.0), (point(0.5), 1.5), (point(0.1), 4.0)],
        ];
        let members = greedy_members(&states, 5).unwrap();
        assert_eq!(members, [point(0.5), point(0.1), point(0.9)]);
        assert_eq!(greedy_members(&states, 2).unwrap(), members[..2]);
        assert!(greedy_members(&states, 0).unwrap().is_empty());
        assert!(greedy_members(&[], 3).unwrap().is_empty());
    }

    #[test]
    fn equal_costs_still_give_a_member() {
        let states = [vec![(point(0.3), 2.0), (point(0.6), 2.0)]];
        assert_eq!(greedy_members(&states, 3).unwrap(), [point(0.3)]);
    }

    #[test]
    fn a_bad_cost_is_refused() {
        for cost in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
            assert!(greedy_members(&[vec![(point(0.3), cost)]], 1).is_err());
        }
    }

    #[test]
    fn members_are_measured_in_turns_and_the_best_is_kept() {
        let mut portfolio = portfolio(&[0.2, 0.4, 0.6]);
        let first = portfolio.predict(&[1.0], &[]).unwrap();
        assert_eq!(first, Some(point(0.2)));
        for (x, cost) in [(0.2, 3.0), (0.4, 2.0), (0.6, 2.0)] {
            assert_eq!(portfolio.next(&[1.0]).unwrap(), Some(&[x][..]));
            portfolio.learn(&[1.0], &[x], cost).unwrap();
        }
        assert_eq!(portfolio.next(&[1.0]).unwrap(), None);
        assert_eq!(portfolio.predict(&[1.0], &[]).unwrap(), Some(point(0.4)));
        // Luck does not last: the mean of 0.4 becomes 3.
        portfolio.learn(&[1.0], &[0.4], 4.0).unwrap();
        assert_eq!(portfolio.predict(&[1.0], &[]).unwrap(), Some(point(0.6)));
        // Another state begins with what is good in the nearest.
        portfolio.learn(&[9.0], &[0.2], 1.0).unwrap();
        assert_eq!(portfolio.predict(&[3.0], &[]).unwrap(), Some(point(0.6)));
        assert_eq!(portfolio.predict(&[7.0], &[]).unwrap(), Some(point(0.2)));
        assert_eq!(portfolio.next(&[3.0]).unwrap(), Some(&[0.2][..]));
    }

    #[test]
    fn without_members_there_is_no_portfolio() {
        let features = Features::new(vec![]).unwrap();
        let error = Portfolio::new(features.clone(), Scaling::Raw, vec![]).unwrap_err();
        assert_eq!(error, PredictError::NoMember);
        assert_eq!(portfolio(&[0.2, 0.4, 0.2]).members().len(), 2);
        let members = vec![vec![0.1], vec![0.1, 0.2]];
        assert!(Portfolio::new(features, Scaling::Raw, members).is_err());
    }
}
