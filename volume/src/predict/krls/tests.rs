use super::*;

/// The same model with full matrices, each step solved anew: slow, and short enough to be checked by
/// eye. What it knows is c, the values at the vectors of the dictionary; the weights are K⁻¹c.
struct Twin<const D: usize> {
    params: KrlsParams,
    vectors: Vec<[f64; D]>,
    values: Vec<f64>,
    p: Vec<Vec<f64>>,
}

/// The solution of A·x = b, by elimination with pivots.
fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for column in 0..n {
        let largest =
            (column..n).max_by(|&i, &j| a[i][column].abs().total_cmp(&a[j][column].abs()));
        let pivot = largest.unwrap();
        a.swap(column, pivot);
        b.swap(column, pivot);
        for row in column + 1..n {
            let factor = a[row][column] / a[column][column];
            let above = a[column].clone();
            for (own, above) in a[row].iter_mut().zip(&above).skip(column) {
                *own -= factor * above;
            }
            b[row] -= factor * b[column];
        }
    }
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|k| a[row][k] * b[k]).sum();
        b[row] = (b[row] - known) / a[row][row];
    }
    b
}

impl<const D: usize> Twin<D> {
    fn new(params: KrlsParams) -> Self {
        Self {
            params,
            vectors: Vec::new(),
            values: Vec::new(),
            p: Vec::new(),
        }
    }

    fn kernels(&self, x: &[f64; D]) -> Vec<f64> {
        let gamma = self.params.gamma;
        self.vectors.iter().map(|v| kernel(gamma, v, x)).collect()
    }

    fn matrix(&self) -> Vec<Vec<f64>> {
        self.vectors.iter().map(|v| self.kernels(v)).collect()
    }

    fn predict(&self, x: &[f64; D]) -> f64 {
        let weights = solve(self.matrix(), self.values.clone());
        self.kernels(x)
            .iter()
            .zip(weights)
            .map(|(k, w)| k * w)
            .sum()
    }

    fn learn(&mut self, x: &[f64; D], y: f64) {
        let h = self.kernels(x);
        let b = solve(self.matrix(), h.clone());
        let residual = KAPPA - h.iter().zip(&b).map(|(h, b)| h * b).sum::<f64>();
        if residual > self.params.tolerance {
            if self.vectors.len() == self.params.limit {
                self.vectors.remove(0);
                self.values.remove(0);
                self.p.remove(0);
                for row in &mut self.p {
                    row.remove(0);
                }
            }
            self.p.iter_mut().for_each(|row| row.push(0.0));
            self.vectors.push(*x);
            let mut row = vec![0.0; self.vectors.len()];
            *row.last_mut().unwrap() = 1.0;
            self.p.push(row);
            self.values.push(y);
            return;
        }
        let error = y - self.predict(x);
        let n = b.len();
        let pb: Vec<f64> = (0..n)
            .map(|i| (0..n).map(|j| self.p[i][j] * b[j]).sum())
            .collect();
        let trace: f64 = (0..n).map(|i| self.p[i][i]).sum();
        let lambda = if trace > MAX_MEAN_P * n as f64 {
            1.0
        } else {
            self.params.forgetting
        };
        let denominator = lambda + (0..n).map(|i| b[i] * pb[i]).sum::<f64>();
        for i in 0..n {
            self.values[i] += pb[i] / denominator * error;
            for j in 0..n {
                self.p[i][j] = (self.p[i][j] - pb[i] * pb[j] / denominator) / lambda;
            }
        }
    }
}

/// Numbers in 0..1 that look random.
fn numbers(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005);
        state = state.wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn params() -> KrlsParams {
    KrlsParams::default()
}

#[test]
fn ten_thousand_steps_are_those_of_the_slow_twin() {
    for (limit, forgetting, scale) in [(12, 1.0, 60.0), (24, 0.98, 30.0), (1, 0.9, 80.0)] {
        let params = params().with_limit(limit).with_forgetting(forgetting);
        let mut model = Krls::<2>::new(params).unwrap();
        let mut twin = Twin::<2>::new(params);
        let mut next = numbers(7);
        for step in 0..10_000 {
            let x = [scale * next(), scale * next()];
            let y = (x[0] / 20.0).sin() + x[1] / 50.0 + 0.1 * next();
            if step % 7 == 0 {
                let (got, expected) = (model.predict(&x).unwrap(), twin.predict(&x));
                assert!(
                    (got - expected).abs() < 1e-7,
                    "limit {limit}, step {step}: {got} {expected}"
                );
            }
            model.learn(&x, y).unwrap();
            twin.learn(&x, y);
            assert_eq!(model.vectors, twin.vectors, "limit {limit}, step {step}");
        }
        assert_eq!(model.repairs(), 0);
    }
}

#[test]
fn without_forgetting_the_weights_are_those_of_all_pairs_at_once() {
    let mut model = Krls::<1>::new(params().with_gamma(0.1)).unwrap();
    let mut next = numbers(3);
    // What each pair is a combination of, and its target.
    let (mut combinations, mut targets) = (Vec::new(), Vec::new());
    for _ in 0..400 {
        let x = [12.0 * next()];
        let y = x[0].cos() + 0.05 * next();
        let known = model.learn(&x, y).unwrap() == Learned::Known;
        let m = model.vectors.len();
        let mut b = vec![0.0; m];
        if known {
            let kernels = |v: &[f64; 1]| -> Vec<f64> {
                model.vectors.iter().map(|u| kernel(0.1, u, v)).collect()
            };
            b = solve(model.vectors.iter().map(kernels).collect(), kernels(&x));
        } else {
            b[m - 1] = 1.0;
        }
        combinations.push(b);
        targets.push(y);
    }
    let m = model.vectors.len();
    let part = |b: &Vec<f64>, i: usize| b.get(i).copied().unwrap_or(0.0);
    let normal = (0..m).map(|i| {
        let row = (0..m).map(|j| combinations.iter().map(|b| part(b, i) * part(b, j)).sum());
        row.collect()
    });
    let right = (0..m).map(|i| {
        let products = combinations
            .iter()
            .zip(&targets)
            .map(|(b, y)| part(b, i) * y);
        products.sum()
    });
    let values = solve(normal.collect(), right.collect());
    for (vector, value) in model.vectors.iter().zip(values) {
        let got = model.predict(vector).unwrap();
        assert!((got - value).abs() < 1e-8, "{got} {value}");
    }
}

#[test]
fn a_jump_is_forgotten_sooner_with_a_smaller_factor() {
    let after = |forgetting| {
        let mut model = Krls::<1>::new(params().with_forgetting(forgetting)).unwrap();
        for step in 0..60 {
            model
                .learn(&[0.0], if step < 30 { 4.0 } else { 8.0 })
                .unwrap();
        }
        model.predict(&[0.0]).unwrap()
    };
    assert!((after(1.0) - 6.0).abs() < 1e-9);
    assert!(after(0.98) > 6.5);
    assert!(after(0.8) > 7.9);
}

#[test]
fn a_million_steps_keep_memory_and_numbers_bounded() {
    let params = params().with_limit(32).with_forgetting(0.98);
    let mut model = Krls::<2>::new(params).unwrap();
    let mut next = numbers(11);
    let mut x = [0.0; 2];
    for step in 0..1_000_000_u32 {
        if step % 10 < 8 {
            // A walk, with pauses and jumps.
            x = x.map(|x| (x + 20.0 * (next() - 0.5)).clamp(-200.0, 200.0));
        } else if step % 1000 == 999 {
            x = x.map(|_| 400.0 * next() - 200.0);
        }
        model.learn(&x, (x[0] / 80.0).sin() + x[1] / 200.0).unwrap();
        if step % 100_000 == 99_999 {
            assert!(model.vectors.len() <= 32);
            assert!(model.inverse_kernel.order() <= 32 && model.p.order() <= 32);
            assert!(!model.is_ill(), "step {step}");
            assert!(model.p.trace() <= MAX_MEAN_P * 32.0 / 0.98);
            // As good as a model that has seen the last of it alone.
            let expected = (x[0] / 80.0).sin() + x[1] / 200.0;
            let got = model.predict(&x).unwrap();
            assert!((got - expected).abs() < 0.05, "{got} {expected}");
        }
    }
    assert_eq!(model.repairs(), 0);
}

#[test]
fn equal_points_and_equal_targets() {
    let mut model = Krls::<3>::new(params().with_forgetting(0.98)).unwrap();
    let x = [1.0, 2.0, 3.0];
    assert_eq!(model.learn(&x, 5.0).unwrap(), Learned::Novel);
    for _ in 0..10_000 {
        assert_eq!(model.learn(&x, 5.0).unwrap(), Learned::Known);
    }
    assert_eq!(model.dictionary(), [x]);
    assert!((model.predict(&x).unwrap() - 5.0).abs() < 1e-12);
    // All zero diverges elsewhere (padasip, issue 5).
    let mut model = Krls::<3>::new(params().with_forgetting(0.5)).unwrap();
    for _ in 0..10_000 {
        model.learn(&[0.0; 3], 0.0).unwrap();
    }
    assert_eq!(model.predict(&[0.0; 3]).unwrap(), 0.0);
    assert!(model.p.trace().is_finite());
}

#[test]
fn a_limit_of_one_keeps_the_newest() {
    let mut model = Krls::<1>::new(params().with_limit(1)).unwrap();
    assert_eq!(model.learn(&[0.0], 1.0).unwrap(), Learned::Novel);
    assert_eq!(model.learn(&[500.0], 2.0).unwrap(), Learned::Replaced);
    assert_eq!(model.dictionary(), [[500.0]]);
    assert!((model.predict(&[500.0]).unwrap() - 2.0).abs() < 1e-12);
}

#[test]
fn a_cleared_model_is_a_new_one() {
    let mut model = Krls::<1>::new(params().with_limit(3)).unwrap();
    let new = model.clone();
    let learn = |model: &mut Krls<1>| {
        for step in 0..50 {
            let x = f64::from(step * step % 41) * 20.0;
            model.learn(&[x], x.sin()).unwrap();
        }
    };
    learn(&mut model);
    let first = model.clone();
    assert_ne!(model, new);
    model.clear();
    assert_eq!(model, new);
    learn(&mut model);
    assert_eq!(model, first);
}

#[test]
fn novelty_goes_from_one_to_nothing() {
    let mut model = Krls::<1>::new(params()).unwrap();
    assert_eq!(model.predict_with_deviation(&[3.0]).unwrap().novelty, 1.0);
    model.learn(&[0.0], 1.0).unwrap();
    model.learn(&[40.0], 3.0).unwrap();
    let at = |x: f64| model.predict_with_deviation(&[x]).unwrap();
    assert!(at(0.0).novelty < 1e-12 && at(0.0).deviation < 1e-6);
    assert!(at(10.0).novelty < at(60.0).novelty && at(60.0).novelty < at(90.0).novelty);
    assert!(at(1000.0).novelty > 0.97);
    assert!((at(1000.0).deviation - 1.0).abs() < 0.02);
    for x in [-5.0, 17.0, 900.0] {
        assert!((at(x).mean - model.predict(&[x]).unwrap()).abs() < 1e-12);
    }
}

#[test]
fn what_is_refused_changes_nothing() {
    let mut model = Krls::<2>::new(params()).unwrap();
    model.learn(&[1.0, 2.0], 3.0).unwrap();
    let before = model.clone();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let x = [0.0, bad];
        let refused = |error| matches!(error, KrlsError::Feature { index: 1, .. });
        assert!(refused(model.predict(&x).unwrap_err()));
        assert!(refused(model.predict_with_deviation(&x).unwrap_err()));
        assert!(refused(model.learn(&x, 1.0).unwrap_err()));
        let error = model.learn(&[0.0; 2], bad).unwrap_err();
        assert!(matches!(error, KrlsError::Target { .. }));
    }
    assert!(model.learn(&[0.0; 2], 1e101).is_err());
    assert_eq!(model, before);
    for bad in [
        params().with_gamma(0.0),
        params().with_gamma(f64::NAN),
        params().with_tolerance(0.0),
        params().with_tolerance(f64::INFINITY),
        params().with_limit(0),
        params().with_forgetting(0.0),
        params().with_forgetting(1.5),
    ] {
        let error = Krls::<1>::new(bad).unwrap_err();
        assert!(matches!(error, KrlsError::Parameter { .. }), "{bad:?}");
    }
}

#[test]
fn the_largest_targets_and_features_stay_finite() {
    let mut model = Krls::<1>::new(params().with_limit(4)).unwrap();
    for step in 0..100 {
        let x = [f64::from(step % 5) * 1e150];
        model
            .learn(&x, if step % 2 == 0 { 1e100 } else { -1e100 })
            .unwrap();
        assert!(model.predict(&x).unwrap().is_finite());
    }
}

#[test]
fn a_spoilt_inverse_is_repaired() {
    let mut model = Krls::<1>::new(params()).unwrap();
    let mut next = numbers(5);
    for _ in 0..20 {
        let x = 400.0 * next();
        model.learn(&[x], x / 100.0).unwrap();
    }
    let whole = model.clone();
    model
        .inverse_kernel
        .add_outer(1e-3, &vec![1.0; model.vectors.len()], 1.0);
    assert!(model.is_ill());
    model.repair();
    assert!(!model.is_ill());
    assert_eq!(model.repairs(), 1);
    for row in 0..model.vectors.len() {
        for column in 0..=row {
            let (a, b) = (&model.inverse_kernel, &whole.inverse_kernel);
            assert!((a.at(row, column) - b.at(row, column)).abs() < 1e-7);
        }
    }
}
