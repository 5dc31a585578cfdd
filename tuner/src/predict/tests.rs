//! What every predictor keeps: the same in, the same out; extremes; refusals without a trace.

use proptest::prelude::*;

use super::*;
use crate::Scale;

const AXES: usize = 2;

fn features() -> Features {
    Features::new(vec![
        Feature::new("triangles", 1.0, 1e6, Scale::Log, Subject::Scene),
        Feature::new("x", -1.0, 1.0, Scale::Linear, Subject::View),
    ])
    .unwrap()
}

fn predictors() -> Vec<Box<dyn Predictor>> {
    let mut all: Vec<Box<dyn Predictor>> = Vec::new();
    for scaling in [Scaling::Raw, Scaling::Printed, Scaling::Rescaled] {
        all.push(Box::new(NearestNeighbour::new(features(), AXES, scaling)));
    }
    for settings in [RadialSettings::printed(), RadialSettings::rescaled()] {
        let model = RadialBasis::new(features(), AXES, settings, 4);
        all.push(Box::new(model.unwrap()));
    }
    let kernel = Kernel::Gaussian;
    for terms in [Terms::Quadratic, Terms::Radial { kernel, seed: 4 }] {
        let model = LeastSquares::new(features(), AXES, terms, 0.01);
        all.push(Box::new(model.unwrap()));
    }
    let portfolio = Portfolio::new(features(), Scaling::Rescaled, candidates());
    all.push(Box::new(portfolio.unwrap()));
    all
}

fn candidates() -> Vec<Vec<f64>> {
    vec![vec![0.1, 0.5], vec![0.9, 0.5], vec![0.5, 0.5]]
}

#[test]
fn nothing_known_predicts_nothing() {
    // A portfolio begins with its first member: it is known to be good.
    for predictor in &predictors()[..7] {
        let predicted = predictor.predict(&[5.0, 0.0], &candidates()).unwrap();
        assert_eq!(predicted, None, "{predictor:?}");
    }
}

#[test]
fn without_candidates_a_model_predicts_nothing() {
    for predictor in &mut predictors()[3..7] {
        predictor.learn(&[5.0, 0.0], &[0.1, 0.5], 1.0).unwrap();
        assert_eq!(predictor.predict(&[5.0, 0.0], &[]).unwrap(), None);
    }
}

#[test]
fn one_sample_is_enough_for_all() {
    for (index, mut predictor) in predictors().into_iter().enumerate() {
        predictor.learn(&[5.0, 0.0], &[0.1, 0.5], 0.5).unwrap();
        let predicted = predictor.predict(&[5.0, 0.0], &candidates()).unwrap();
        // Functions overlap: one good point may speak for another candidate.
        let is_model = (3..7).contains(&index);
        let own = Some(vec![0.1, 0.5]);
        assert!(predicted == own || is_model && predicted.is_some());
    }
}

#[test]
fn identical_states_are_no_fault() {
    for mut predictor in predictors() {
        for _ in 0..50 {
            for (point, cost) in candidates().iter().zip([3.0, 2.0, 2.9]) {
                predictor.learn(&[5.0, 0.0], point, cost).unwrap();
            }
        }
        let predicted = predictor.predict(&[5.0, 0.0], &candidates()).unwrap();
        assert_eq!(predicted, Some(vec![0.9, 0.5]), "{predictor:?}");
    }
}

#[test]
fn extreme_costs_and_states_are_no_fault() {
    for mut predictor in predictors() {
        for cost in [1e-300, 1e300, 1.0, f64::MIN_POSITIVE] {
            for state in [[1e300, -1e300], [-1e300, 1e300], [0.0, 0.0]] {
                for point in candidates() {
                    predictor.learn(&state, &point, cost).unwrap();
                    let predicted = predictor.predict(&state, &candidates()).unwrap();
                    assert!(candidates().contains(&predicted.unwrap()));
                }
            }
        }
    }
}

#[test]
fn what_is_refused_leaves_no_trace() {
    let nonsense = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    for mut predictor in predictors() {
        predictor.learn(&[5.0, 0.0], &[0.1, 0.5], 0.5).unwrap();
        let before = format!("{predictor:?}");
        for bad in nonsense {
            assert!(predictor.learn(&[bad, 0.0], &[0.1, 0.5], 1.0).is_err());
            assert!(predictor.learn(&[5.0, 0.0], &[bad, 0.5], 1.0).is_err());
            assert!(predictor.learn(&[5.0, 0.0], &[0.1, 0.5], bad).is_err());
            assert!(predictor.predict(&[5.0, bad], &candidates()).is_err());
        }
        for cost in [0.0, -1.0, 1e-320] {
            assert!(predictor.learn(&[5.0, 0.0], &[0.1, 0.5], cost).is_err());
        }
        assert!(predictor.learn(&[5.0], &[0.1, 0.5], 1.0).is_err());
        assert!(predictor.learn(&[5.0, 0.0], &[0.1], 1.0).is_err());
        assert!(predictor.learn(&[5.0, 0.0], &[0.1, 1.5], 1.0).is_err());
        assert_eq!(format!("{predictor:?}"), before);
    }
    for model in &mut predictors()[3..7] {
        let candidates = [vec![0.1, 0.5], vec![f64::NAN, 0.5]];
        assert!(model.predict(&[5.0, 0.0], &candidates).is_err());
    }
}

proptest! {
    #[test]
    fn the_same_learned_predicts_the_same(
        samples in proptest::collection::vec(
            ((1.0..1e6, -1.0..1.0), (0usize..3), 0.01..100.0f64), 1..30),
        asked in (1.0..1e6, -1.0..1.0),
    ) {
        for (mut one, mut other) in predictors().into_iter().zip(predictors()) {
            for ((triangles, x), index, cost) in &samples {
                let point = &candidates()[*index];
                one.learn(&[*triangles, *x], point, *cost).unwrap();
                other.learn(&[*triangles, *x], point, *cost).unwrap();
            }
            let state = [asked.0, asked.1];
            let predicted = one.predict(&state, &candidates()).unwrap();
            prop_assert_eq!(&predicted, &other.predict(&state, &candidates()).unwrap());
            prop_assert!(candidates().contains(&predicted.unwrap()));
            prop_assert_eq!(format!("{one:?}"), format!("{other:?}"));
        }
    }
}
