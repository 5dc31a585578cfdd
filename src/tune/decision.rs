//! To search, or to take what is known: the choice of the autotuning paper for a state.
//!
//! Herveau, Pfaffe, Tillmann, Tichy, Dachsbacher, *Analysis of Acceleration Structure Parameters and Hybrid
//! Autotuning for Ray Tracing*, section 3: the state is the 17 indicators; with a small probability a search
//! begins, else a predictor that learned from the measurements of other states names a configuration, which is
//! used until the state changes.
//!
//! Invariant: a function of what is known, state and seed.

use raywright_tracer::INDICATORS;
use raywright_tuner::{
    Config, Scale, Space,
    predict::{
        EpsilonGreedy, Feature, Features, NearestNeighbour, PolicySettings, PredictError,
        Predictor, RadialBasis, RadialSettings, Scaling, Step, Subject,
    },
};

/// What predicts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PredictorKind {
    /// The best configuration of the nearest state.
    NearestNeighbour,
    /// The configuration of the highest value by radial functions of state and configuration.
    ValueFunction,
}

/// What a configuration cost in a state.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownState {
    /// The indicators.
    pub state: Vec<f64>,
    /// The configuration.
    pub config: Config,
    /// Its cost, in seconds.
    pub cost: f64,
}

/// The first and the last indicator that depend on the camera.
const VIEW: [&str; 2] = ["camera_x", "vertical_fov_degrees"];

/// The 17 indicators as features, with the ranges of the paper.
///
/// # Panics
/// Never: the ranges are in order.
#[must_use]
pub fn state_features() -> Features {
    let place = |name| INDICATORS.iter().position(|(own, ..)| *own == name);
    let features = INDICATORS
        .iter()
        .enumerate()
        .map(|(index, &(name, low, high))| {
            let is_view = place(VIEW[0]) <= Some(index) && Some(index) <= place(VIEW[1]);
            let subject = if is_view {
                Subject::View
            } else {
                Subject::Scene
            };
            // Counts spread over decades, where the form of features asks for it.
            match name {
                "mesh_count" | "triangle_count" => {
                    Feature::new(name, 1.0, high, Scale::Log, subject)
                }
                _ => Feature::new(name, low, high, Scale::Linear, subject),
            }
        });
    Features::new(features.collect()).expect("the ranges of the indicators are in order")
}

/// What to do in `state`, given what is known of others: nothing known is a search.
///
/// # Errors
/// If a state or a cost is none.
pub fn decide(
    kind: PredictorKind,
    known: &[KnownState],
    space: &Space,
    state: &[f64],
    seed: u64,
) -> Result<Step, PredictError> {
    let axes = space.dimensions();
    let mut predictor: Box<dyn Predictor> = match kind {
        PredictorKind::NearestNeighbour => Box::new(NearestNeighbour::new(
            state_features(),
            axes,
            Scaling::Printed,
        )),
        PredictorKind::ValueFunction => {
            let settings = RadialSettings::printed();
            Box::new(RadialBasis::new(state_features(), axes, settings, seed)?)
        }
    };
    let mut candidates: Vec<Vec<f64>> = Vec::new();
    for one in known {
        let point = space.encode(&one.config);
        predictor.learn(&one.state, &point, one.cost)?;
        if !candidates.contains(&point) {
            candidates.push(point);
        }
    }
    let mut policy = EpsilonGreedy::new(state_features(), PolicySettings::default(), seed)?;
    policy.step(state, predictor.as_ref(), &candidates)
}

#[cfg(test)]
mod tests {
    use raywright_tuner::Param;

    use super::*;

    fn space() -> Space {
        Space::new(vec![Param::integer("leaf", 1..=8, Scale::Linear, "")]).unwrap()
    }

    fn known(triangles: f64, leaf: i64, cost: f64) -> KnownState {
        let mut state = vec![0.5; 17];
        state[1] = triangles;
        let config = space().config(&[("leaf", leaf.into())]).unwrap();
        KnownState {
            state,
            config,
            cost,
        }
    }

    #[test]
    fn views_and_scenes_are_told_apart() {
        let features = state_features();
        let views: Vec<&str> = (features.features().iter())
            .filter(|feature| feature.subject == Subject::View)
            .map(|feature| &*feature.name)
            .collect();
        assert_eq!(views.len(), 7);
        assert!(views.contains(&"target_z") && !views.contains(&"extent"));
    }

    #[test]
    fn the_best_of_the_nearest_state_is_taken_as_a_rule() {
        let all = [known(1e6, 2, 1.0), known(1e6, 5, 0.5), known(9e6, 7, 0.1)];
        let state = known(2e6, 1, 1.0).state;
        let space = space();
        for kind in [
            PredictorKind::NearestNeighbour,
            PredictorKind::ValueFunction,
        ] {
            let steps: Vec<Step> = (0..200)
                .map(|seed| decide(kind, &all, &space, &state, seed).unwrap())
                .collect();
            let searches = steps.iter().filter(|step| **step == Step::Explore).count();
            // A tenth in a scene that is new.
            assert!((5..=40).contains(&searches), "{kind:?} {searches}");
            assert_eq!(decide(kind, &[], &space, &state, 1), Ok(Step::Explore));
            if kind == PredictorKind::NearestNeighbour {
                let point = space.encode(&all[1].config);
                assert!(steps.contains(&Step::Exploit(point)));
            }
        }
        assert!(
            decide(
                PredictorKind::NearestNeighbour,
                &all,
                &space,
                &[f64::NAN; 17],
                1
            )
            .is_err()
        );
    }
}
