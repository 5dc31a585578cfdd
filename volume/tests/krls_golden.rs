//! Kernel recursive least squares step by step as dlib 19.24 gives it: predictions before each pair,
//! sizes of the dictionary, predictions afterwards. `data/krls.json` has eight sequences, three of
//! them with many vectors that leave.

use raywright_volume::predict::{Krls, KrlsParams};
use serde::Deserialize;

#[derive(Deserialize)]
struct File {
    sequences: Vec<Sequence>,
}

#[derive(Deserialize)]
struct Sequence {
    name: String,
    gamma: f64,
    tolerance: f64,
    max_dictionary: usize,
    dims: usize,
    steps: Vec<Step>,
    probes_after: Vec<Probe>,
}

#[derive(Deserialize)]
struct Step {
    x: Vec<f64>,
    y: f64,
    predicted_before: f64,
    dictionary_after: usize,
}

#[derive(Deserialize)]
struct Probe {
    x: Vec<f64>,
    predicted: f64,
}

/// Relative error that is let pass.
const TOLERANCE: f64 = 1e-9;

fn check<const D: usize>(sequence: &Sequence) {
    let name = &sequence.name;
    let params = KrlsParams::default()
        .with_gamma(sequence.gamma)
        .with_tolerance(sequence.tolerance)
        .with_limit(sequence.max_dictionary);
    let mut model = Krls::<D>::new(params).expect("parameters");
    let point = |x: &[f64]| <[f64; D]>::try_from(x).expect("as many features as it says");
    let close = |got: f64, expected: f64, step: usize| {
        let scale = expected.abs().max(1e-3);
        assert!(
            (got - expected).abs() <= TOLERANCE * scale,
            "{name}, step {step}: {got} instead of {expected}"
        );
    };
    for (index, step) in sequence.steps.iter().enumerate() {
        let x = point(&step.x);
        close(
            model.predict(&x).expect("finite"),
            step.predicted_before,
            index,
        );
        model.learn(&x, step.y).expect("finite");
        assert_eq!(
            model.dictionary().len(),
            step.dictionary_after,
            "{name}, step {index}"
        );
    }
    for (index, probe) in sequence.probes_after.iter().enumerate() {
        let got = model.predict(&point(&probe.x)).expect("finite");
        close(got, probe.predicted, sequence.steps.len() + index);
    }
}

#[test]
fn every_sequence_is_reproduced() {
    let text = include_str!("data/krls.json");
    let file: File = serde_json::from_str(text).expect("golden sequences");
    assert_eq!(file.sequences.len(), 8);
    for sequence in &file.sequences {
        match sequence.dims {
            1 => check::<1>(sequence),
            2 => check::<2>(sequence),
            3 => check::<3>(sequence),
            5 => check::<5>(sequence),
            other => panic!("{}: {other} features", sequence.name),
        }
    }
}
