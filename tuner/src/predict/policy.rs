//! When to search and when to predict.
//!
//! Herveau, Pfaffe, Tillmann, Tichy & Dachsbacher, "Analysis of Acceleration Structure Parameters and Hybrid
//! Autotuning for Ray Tracing" (TVCG), after Sutton & Barto, *Reinforcement Learning*, 2nd edition 2018,
//! section 2.2: whenever the state changes, explore with a small probability ε, which is a search over many
//! frames; else exploit, which is one prediction that stays until the next change. The paper says neither
//! what ε is nor what a change is; both are settings here.
//!
//! A change is any change of a feature of the scene, or a distance of the features of the view, scaled as
//! printed, above a threshold; it must last for some frames. One random number is drawn for each change,
//! whatever comes of it.
//!
//! Invariants: the same seed and states give the same steps; a state that is refused changes nothing; the
//! first frame is a change.

use super::features::squared_distance;
use super::{Features, PredictError, Predictor, Scaling, Subject, check_range};
use crate::rng::Stream;

/// Settings of [`EpsilonGreedy`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct PolicySettings {
    /// Probability of exploring in a scene that was not seen before, in 0..=1.
    pub epsilon_new: f64,
    /// Probability of exploring in a scene that was, in 0..=1.
    pub epsilon_known: f64,
    /// Distance in the view's features, scaled as printed, above which it is another state; at least 0.
    pub view_distance: f64,
    /// Frames for which a change must last, at least 1.
    pub frames: u32,
}

impl PolicySettings {
    /// The same with other probabilities of exploring.
    #[must_use]
    pub fn with_epsilon(self, new: f64, known: f64) -> PolicySettings {
        PolicySettings {
            epsilon_new: new,
            epsilon_known: known,
            ..self
        }
    }

    /// The same with another idea of a change.
    #[must_use]
    pub fn with_change(self, view_distance: f64, frames: u32) -> PolicySettings {
        PolicySettings {
            view_distance,
            frames,
            ..self
        }
    }
}

impl Default for PolicySettings {
    /// A tenth in a new scene, a fiftieth in a known one; a twentieth of a range, for three frames.
    fn default() -> PolicySettings {
        PolicySettings {
            epsilon_new: 0.1,
            epsilon_known: 0.02,
            view_distance: 0.05,
            frames: 3,
        }
    }
}

/// What to do with a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Nothing has changed: go on, with the search or the configuration there is.
    Keep,
    /// Begin a search.
    Explore,
    /// Use this point until the next step that is not [`Step::Keep`].
    Exploit(Vec<f64>),
}

/// Explores with a small probability, else exploits, at each change of state.
#[derive(Clone, Debug)]
pub struct EpsilonGreedy {
    features: Features,
    settings: PolicySettings,
    stream: Stream,
    /// The state of the last decision.
    settled: Option<Described>,
    /// Frames in a row that were another state.
    changed: u32,
    /// Scenes in which something was decided.
    scenes: Vec<Vec<f64>>,
}

/// A state in its two parts.
#[derive(Clone, Debug, PartialEq)]
struct Described {
    scene: Vec<f64>,
    view: Vec<f64>,
}

impl EpsilonGreedy {
    /// A policy that has seen no frame.
    ///
    /// # Errors
    /// [`PredictError::OutOfRange`] for settings outside their ranges.
    pub fn new(
        features: Features,
        settings: PolicySettings,
        seed: u64,
    ) -> Result<EpsilonGreedy, PredictError> {
        check_range("epsilon_new", settings.epsilon_new, 0.0, 1.0)?;
        check_range("epsilon_known", settings.epsilon_known, 0.0, 1.0)?;
        check_range("view_distance", settings.view_distance, 0.0, f64::MAX)?;
        check_range("frames", settings.frames.into(), 1.0, u32::MAX.into())?;
        Ok(EpsilonGreedy {
            features,
            settings,
            stream: Stream::new(seed),
            settled: None,
            changed: 0,
            scenes: Vec::new(),
        })
    }

    /// What to do with a frame in `state`. A predictor that knows nothing makes it a search.
    ///
    /// # Errors
    /// Those of [`Predictor::predict`].
    pub fn step(
        &mut self,
        state: &[f64],
        predictor: &dyn Predictor,
        candidates: &[Vec<f64>],
    ) -> Result<Step, PredictError> {
        let described = self.described(state)?;
        if let Some(settled) = &self.settled {
            if !self.differ(settled, &described) {
                self.changed = 0;
                return Ok(Step::Keep);
            }
            if self.changed + 1 < self.settings.frames {
                self.changed += 1;
                return Ok(Step::Keep);
            }
        }
        // Asked before anything is changed: it may be refused.
        let predicted = predictor.predict(state, candidates)?;
        let is_known = self.scenes.contains(&described.scene);
        let epsilon = if is_known {
            self.settings.epsilon_known
        } else {
            self.scenes.push(described.scene.clone());
            self.settings.epsilon_new
        };
        self.settled = Some(described);
        self.changed = 0;
        let explores = self.stream.unit() < epsilon;
        Ok(match predicted {
            Some(point) if !explores => Step::Exploit(point),
            _ => Step::Explore,
        })
    }

    /// The scene's features as they are, the view's as printed.
    fn described(&self, state: &[f64]) -> Result<Described, PredictError> {
        let scaled = self.features.scaled(state, Scaling::Printed)?;
        let of = |subject: Subject, values: &[f64]| -> Vec<f64> {
            let pairs = self.features.features().iter().zip(values);
            let own = pairs.filter(|(feature, _)| feature.subject == subject);
            own.map(|(_, value)| *value).collect()
        };
        Ok(Described {
            scene: of(Subject::Scene, state),
            view: of(Subject::View, &scaled),
        })
    }

    fn differ(&self, a: &Described, b: &Described) -> bool {
        let distance = squared_distance(&a.view, &b.view).sqrt();
        a.scene != b.scene || distance > self.settings.view_distance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scale;
    use crate::predict::{Feature, NearestNeighbour};

    fn features() -> Features {
        Features::new(vec![
            Feature::new("triangles", 1.0, 1e6, Scale::Log, Subject::Scene),
            Feature::new("x", 0.0, 1.0, Scale::Linear, Subject::View),
        ])
        .unwrap()
    }

    fn policy(epsilon: f64, seed: u64) -> EpsilonGreedy {
        let settings = PolicySettings::default().with_epsilon(epsilon, epsilon);
        EpsilonGreedy::new(features(), settings, seed).unwrap()
    }

    fn table() -> NearestNeighbour {
        let mut table = NearestNeighbour::new(features(), 1, Scaling::Printed);
        table.learn(&[1e3, 0.5], &[0.25], 1.0).unwrap();
        table
    }

    #[test]
    fn a_choice_is_made_once_for_each_lasting_change() {
        let (mut policy, table) = (policy(0.0, 1), table());
        let mut step = |state: [f64; 2]| policy.step(&state, &table, &[]).unwrap();
        let exploit = Step::Exploit(vec![0.25]);
        assert_eq!(step([10.0, 0.5]), exploit);
        assert_eq!(step([10.0, 0.5]), Step::Keep);
        assert_eq!(step([10.0, 0.54]), Step::Keep);
        // Two frames elsewhere and back are no change.
        for x in [0.6, 0.6, 0.5, 0.6, 0.7] {
            assert_eq!(step([10.0, x]), Step::Keep);
        }
        assert_eq!(step([10.0, 0.8]), exploit);
        for _ in 0..5 {
            assert_eq!(step([10.0, 0.8]), Step::Keep);
        }
        // One triangle more is another scene.
        assert_eq!(step([11.0, 0.8]), Step::Keep);
        assert_eq!(step([11.0, 0.8]), Step::Keep);
        assert_eq!(step([11.0, 0.8]), exploit);
    }

    #[test]
    fn epsilon_is_the_share_of_searches() {
        let table = table();
        let share = |new: f64, known: f64, scenes: u32| {
            let settings = PolicySettings::default().with_epsilon(new, known);
            let settings = settings.with_change(0.05, 1);
            let mut policy = EpsilonGreedy::new(features(), settings, 9).unwrap();
            let count = 4000;
            let explored = (0..count).filter(|index| {
                let state = [f64::from(1 + index % scenes), f64::from(index % 2)];
                policy.step(&state, &table, &[]).unwrap() == Step::Explore
            });
            explored.count() as f64 / f64::from(count)
        };
        assert_eq!(share(0.0, 0.0, 2), 0.0);
        assert_eq!(share(1.0, 1.0, 2), 1.0);
        // Five standard deviations are 0.03.
        assert!((share(0.0, 0.2, 2) - 0.2).abs() < 0.03);
        assert!((share(0.2, 0.0, 4000) - 0.2).abs() < 0.03);
        assert!(share(1.0, 0.0, 2) < 0.001);
    }

    #[test]
    fn the_same_seed_takes_the_same_steps() {
        let table = table();
        let run = |seed| -> Vec<Step> {
            let mut policy = policy(0.5, seed);
            let states = (0..200u32).map(|index| [f64::from(1 + index / 4), 0.5]);
            states
                .map(|state| policy.step(&state, &table, &[]).unwrap())
                .collect()
        };
        assert_eq!(run(3), run(3));
        assert_ne!(run(3), run(4));
    }

    #[test]
    fn nothing_known_is_a_search_and_nonsense_changes_nothing() {
        let empty = NearestNeighbour::new(features(), 1, Scaling::Printed);
        let mut policy = policy(0.0, 1);
        assert!(policy.step(&[f64::NAN, 0.5], &empty, &[]).is_err());
        assert!(policy.settled.is_none());
        let step = policy.step(&[10.0, 0.5], &empty, &[]).unwrap();
        assert_eq!(step, Step::Explore);
        assert!(policy.step(&[10.0, f64::INFINITY], &empty, &[]).is_err());
        assert_eq!(policy.step(&[10.0, 0.5], &empty, &[]).unwrap(), Step::Keep);
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        let usual = PolicySettings::default();
        for settings in [
            usual.with_epsilon(1.5, 0.0),
            usual.with_epsilon(0.0, f64::NAN),
            usual.with_change(-0.1, 3),
            usual.with_change(0.1, 0),
        ] {
            assert!(EpsilonGreedy::new(features(), settings, 1).is_err());
        }
    }
}
