//! How long one prediction and one learning step of kernel recursive least squares take.
//!
//! `cargo run --release -p raywright-volume --example time_krls`; microseconds, the best of some
//! runs. Each model is full: every vector is far from the others, so that the novel ones replace.

use std::time::Instant;

use raywright_volume::predict::{Krls, KrlsParams, Learned};

const FEATURES: usize = 9;

/// Points far enough from each other to be novel: splitmix64 of the number.
fn point(index: usize, shift: f64) -> [f64; FEATURES] {
    std::array::from_fn(|axis| {
        let z = ((index * FEATURES + axis) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        150.0 * ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64 + shift
    })
}

/// Microseconds of one call, the best of some runs of many.
fn best(mut call: impl FnMut(usize)) -> f64 {
    const CALLS: usize = 2000;
    let run = |_| {
        let start = Instant::now();
        (0..CALLS).for_each(&mut call);
        start.elapsed().as_secs_f64() * 1e6 / CALLS as f64
    };
    (0..10).map(run).fold(f64::INFINITY, f64::min)
}

fn main() {
    println!("vectors  predict  with deviation  learn known  learn and replace   (microseconds)");
    for limit in [32, 64, 128, 256] {
        let params = KrlsParams::default()
            .with_limit(limit)
            .with_forgetting(0.98);
        let mut model = Krls::<FEATURES>::new(params).expect("parameters");
        for index in 0..limit {
            model
                .learn(&point(index, 0.0), index as f64)
                .expect("finite");
        }
        assert_eq!(model.dictionary().len(), limit);
        let mut sum = 0.0;
        let predict = best(|i| sum += model.predict(&point(i, 1.0)).expect("finite"));
        let deviation = best(|i| {
            let known = model.predict_with_deviation(&point(i, 1.0));
            sum += known.expect("finite").novelty;
        });
        assert!(sum.is_finite());
        let known = best(|i| {
            let learned = model.learn(&point(i % limit, 0.01), i as f64);
            assert_eq!(learned.expect("finite"), Learned::Known);
        });
        let mut next = limit;
        let novel = best(|_| {
            next += 1;
            let learned = model.learn(&point(next, 0.0), next as f64);
            assert_ne!(learned.expect("finite"), Learned::Known);
        });
        println!("{limit:7} {predict:8.2} {deviation:15.2} {known:12.2} {novel:18.2}");
    }
}
