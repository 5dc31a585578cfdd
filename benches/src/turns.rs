//! Measurement in turns.

use std::time::{Duration, Instant};

/// Median and quartiles of ratios.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratio {
    /// The median.
    pub median: f64,
    /// The quartiles.
    pub quartiles: [f64; 2],
}

/// What the turns found: per engine the median time, and the speed relative to engine 0.
#[derive(Clone, Debug)]
pub struct Turns {
    /// Median time of each engine.
    pub times: Vec<Duration>,
    /// Time of engine 0 ÷ time of each engine within a round: above 1, it is faster.
    pub speed: Vec<Ratio>,
}

/// Runs every engine once per round, after a round that does not count.
///
/// # Panics
/// If there is no engine or no round.
pub fn measure(engines: usize, rounds: usize, mut run: impl FnMut(usize)) -> Turns {
    assert!(engines > 0 && rounds > 0, "nothing to measure");
    let mut times = vec![Vec::with_capacity(rounds); engines];
    for round in 0..=rounds {
        for turn in 0..engines {
            let engine = (round + turn) % engines;
            let start = Instant::now();
            run(engine);
            if round > 0 {
                times[engine].push(start.elapsed());
            }
        }
    }
    let speed = times.iter().map(|own| {
        let ratios = times[0]
            .iter()
            .zip(own)
            .map(|(base, own)| base.as_secs_f64() / own.as_secs_f64());
        ratio(ratios.collect())
    });
    let speed = speed.collect();
    let median = |mut times: Vec<Duration>| {
        times.sort();
        times[times.len() / 2]
    };
    Turns {
        times: times.into_iter().map(median).collect(),
        speed,
    }
}

fn ratio(mut ratios: Vec<f64>) -> Ratio {
    ratios.sort_by(f64::total_cmp);
    let at = |share: f64| ratios[(share * (ratios.len() - 1) as f64).round() as usize];
    Ratio {
        median: at(0.5),
        quartiles: [at(0.25), at(0.75)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_engine_runs_in_every_round_and_the_first_changes() {
        let mut order = Vec::new();
        let turns = measure(3, 2, |engine| order.push(engine));
        assert_eq!(order, [0, 1, 2, 1, 2, 0, 2, 0, 1]);
        assert_eq!((turns.times.len(), turns.speed[0].median), (3, 1.0));
    }

    #[test]
    fn ratios_have_median_and_quartiles() {
        let got = ratio(vec![5.0, 1.0, 3.0, 2.0, 4.0]);
        assert_eq!((got.median, got.quartiles), (3.0, [2.0, 4.0]));
    }
}
