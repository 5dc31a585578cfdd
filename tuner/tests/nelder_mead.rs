//! Nelder–Mead on functions whose minimum is known. All seeds are fixed; bounds leave room.

use raywright_tuner::{Config, Outcome, Param, Scale, Space, Tuner, search_by_name};

const NAMES: [&str; 5] = ["a", "b", "c", "d", "e"];

fn cube(dimensions: usize) -> Space {
    let axis = |name: &&str| Param::real(name, 0.0..=1.0, Scale::Linear, "");
    Space::new(NAMES[..dimensions].iter().map(axis).collect()).unwrap()
}

/// Ill-conditioned (1 to 16), away from the middle, with value `floor` at the minimum.
fn quadratic(config: &Config, floor: f64) -> f64 {
    let terms = config.iter().enumerate().map(|(axis, (name, _))| {
        let weight = [1.0, 4.0, 16.0, 2.0, 8.0][axis];
        let centre = [0.3, 0.6, 0.45, 0.7, 0.2][axis];
        weight * (config.real(name).unwrap() - centre).powi(2)
    });
    floor + terms.sum::<f64>()
}

/// Best configuration after `asks` trials.
fn best(
    search: &str,
    space: &Space,
    seed: u64,
    asks: usize,
    mut cost: impl FnMut(&Config) -> f64,
) -> Config {
    let mut tuner = Tuner::new(space.clone(), search_by_name(search).unwrap(), seed);
    for _ in 0..asks {
        let trial = tuner.ask();
        tuner
            .tell(
                trial.id,
                Outcome::Done {
                    cost: cost(&trial.config),
                },
            )
            .unwrap();
    }
    tuner.incumbent().unwrap().config.clone()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn converges_on_quadratics() {
    for dimensions in 2..=4 {
        let space = cube(dimensions);
        let mut gaps: Vec<f64> = (0..40)
            .map(|seed| {
                let config = best("nelder-mead", &space, seed, 200, |config| {
                    quadratic(config, 1.0)
                });
                quadratic(&config, 0.0)
            })
            .collect();
        gaps.sort_by(f64::total_cmp);
        // The function reaches 3 (two axes) to 8 (four axes). A simplex can go flat: not every run
        // is as good as the median.
        assert!(gaps[20] < 1e-5, "{dimensions} axes, median: {gaps:?}");
        assert!(gaps[36] < 2e-2, "{dimensions} axes, nine of ten: {gaps:?}");
        assert!(gaps[39] < 0.2, "{dimensions} axes, worst: {gaps:?}");
    }
}

#[test]
fn beats_random_on_average() {
    for dimensions in [3, 5] {
        let space = cube(dimensions);
        let gap = |search, seed| {
            let config = best(search, &space, seed, 80, |config| quadratic(config, 1.0));
            quadratic(&config, 0.0)
        };
        let simplex = mean((0..20).map(|seed| gap("nelder-mead", seed)));
        let random = mean((0..20).map(|seed| gap("random", seed)));
        assert!(
            simplex < 0.5 * random,
            "{dimensions} axes: simplex {simplex}, random {random}"
        );
    }
}

#[test]
fn finds_the_minimum_of_a_mixed_space() {
    let space = Space::new(vec![
        Param::ordinal("quality", vec![1, 2, 3], ""),
        Param::ordinal("branching", vec![2, 4, 8], ""),
        Param::integer("depth", 8..=64, Scale::Log, ""),
        Param::integer("least", 1..=32, Scale::Log, ""),
        Param::integer("most", 1..=32, Scale::Log, ""),
    ])
    .and_then(|space| space.with_at_most("least", "most"))
    .unwrap();
    let cost = |config: &Config| {
        let log = |name| (config.integer(name).unwrap() as f64).ln();
        let quality = config.integer("quality").unwrap() as f64;
        1.0 + 0.3 * (quality - 2.0).abs()
            + 0.3 * (8f64.ln() - log("branching"))
            + 0.1 * (log("depth") - 20f64.ln()).powi(2)
            + 0.1 * (log("least") - 4f64.ln()).powi(2)
            + 0.1 * (log("most") - 20f64.ln()).powi(2)
    };
    let gap = |search, seed| cost(&best(search, &space, seed, 200, cost)) - 1.0;
    let simplex: Vec<f64> = (0..20).map(|seed| gap("nelder-mead", seed)).collect();
    let random = mean((0..20).map(|seed| gap("random", seed)));
    let exact = simplex.iter().filter(|&&gap| gap < 1e-3).count();
    assert!(exact >= 12, "{simplex:?}");
    let simplex = mean(simplex.into_iter());
    assert!(
        simplex < 0.25 * random,
        "simplex {simplex}, random {random}"
    );
}

#[test]
fn is_not_fooled_by_noise() {
    // One per cent of uniform noise from a small generator, drawn per measurement.
    let space = cube(3);
    let gap = |search, seed: u64| {
        let mut state = seed;
        let config = best(search, &space, seed, 150, |config| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let noise = (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            quadratic(config, 1.0) * (1.0 + 0.02 * noise)
        });
        quadratic(&config, 0.0)
    };
    let simplex = mean((0..20).map(|seed| gap("nelder-mead", seed)));
    let random = mean((0..20).map(|seed| gap("random", seed)));
    assert!(
        simplex < 0.25 * random,
        "simplex {simplex}, random {random}"
    );
    // Less than the half width of the noise at the minimum.
    assert!(simplex < 0.01, "{simplex}");
}

#[test]
fn leaves_a_local_minimum() {
    // A wide valley near 0.8 with value 1, a narrower one near 0.15 with value 0.
    let space = cube(2);
    let cost = |config: &Config| {
        let square = |centre: f64| -> f64 {
            config
                .iter()
                .map(|(name, _)| (config.real(name).unwrap() - centre).powi(2))
                .sum()
        };
        (1.0 + square(0.8)).min(20.0 * square(0.15))
    };
    let is_global = |&seed: &u64| cost(&best("nelder-mead", &space, seed, 300, cost)) < 0.1;
    let found = (0..40).filter(is_global).count();
    assert!(found >= 24, "{found} of 40");
}
