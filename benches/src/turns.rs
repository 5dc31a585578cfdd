//! Measurement in turns.

use std::time::Duration;

use crate::clock::Clock;

/// Median and quartiles of ratios.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratio {
    /// The median.
    pub median: f64,
    /// The quartiles.
    pub quartiles: [f64; 2],
}

impl Ratio {
    /// Of many ratios.
    ///
    /// # Panics
    /// If there are none.
    #[must_use]
    pub fn of(mut ratios: Vec<f64>) -> Self {
        ratios.sort_by(f64::total_cmp);
        let at = |share: f64| ratios[(share * (ratios.len() - 1) as f64).round() as usize];
        Self {
            median: at(0.5),
            quartiles: [at(0.25), at(0.75)],
        }
    }
}

/// The mean of ratios whose logarithms are averaged; NaN of none.
#[must_use]
pub fn geometric_mean(ratios: &[f64]) -> f64 {
    (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp()
}

/// What the turns found: per engine the median time, and the speed relative to engine 0.
#[derive(Clone, Debug)]
pub struct Turns {
    /// Median time of each engine.
    pub times: Vec<Duration>,
    /// Time of engine 0 ÷ time of each engine within a round: above 1, it is faster.
    pub speed: Vec<Ratio>,
    /// Times by engine and round.
    rounds: Vec<Vec<Duration>>,
}

impl Turns {
    fn of(rounds: Vec<Vec<Duration>>) -> Self {
        let median = |times: &Vec<Duration>| {
            let mut times = times.clone();
            times.sort();
            times[times.len() / 2]
        };
        let mut turns = Self {
            times: rounds.iter().map(median).collect(),
            speed: Vec::new(),
            rounds,
        };
        turns.speed = (0..turns.rounds.len())
            .map(|engine| turns.time_ratio(0, engine))
            .collect();
        turns
    }

    /// Time of engine `engine` ÷ time of engine `base` within a round: below 1, it is faster.
    ///
    /// # Panics
    /// If there is no such engine.
    #[must_use]
    pub fn time_ratio(&self, engine: usize, base: usize) -> Ratio {
        let pairs = self.rounds[engine].iter().zip(&self.rounds[base]);
        Ratio::of(
            pairs
                .map(|(own, base)| own.as_secs_f64() / base.as_secs_f64())
                .collect(),
        )
    }
}

/// Runs every engine once per round, after a round that does not count; by wall time.
///
/// # Panics
/// If there is no engine or no round.
pub fn measure(engines: usize, rounds: usize, mut run: impl FnMut(usize)) -> Turns {
    measure_by(engines, rounds, |engine| Clock::Wall.time(|| run(engine)))
}

/// Runs every engine once per round, after a round that does not count; `run` says how long it
/// took.
///
/// # Panics
/// If there is no engine or no round.
pub fn measure_by(engines: usize, rounds: usize, mut run: impl FnMut(usize) -> Duration) -> Turns {
    assert!(engines > 0 && rounds > 0, "nothing to measure");
    let mut times = vec![Vec::with_capacity(rounds); engines];
    for round in 0..=rounds {
        for turn in 0..engines {
            let engine = (round + turn) % engines;
            let time = run(engine);
            if round > 0 {
                times[engine].push(time);
            }
        }
    }
    Turns::of(times)
}

/// Runs every engine on every chunk in every round, after a round that does not count. Before a
/// chunk is timed, the engine runs the chunk before it untimed, so that no engine profits from the
/// cache of another; engines take turns within each chunk.
///
/// # Panics
/// If there is no engine, no round or no chunk.
pub fn measure_chunks(
    engines: usize,
    rounds: usize,
    chunks: usize,
    clock: Clock,
    mut run: impl FnMut(usize, usize),
) -> Turns {
    assert!(
        engines > 0 && rounds > 0 && chunks > 0,
        "nothing to measure"
    );
    let mut times = vec![Vec::with_capacity(rounds); engines];
    for round in 0..=rounds {
        let mut sums = vec![Duration::ZERO; engines];
        for chunk in 0..chunks {
            for turn in 0..engines {
                let engine = (round + chunk + turn) % engines;
                run(engine, (chunk + chunks - 1) % chunks);
                sums[engine] += clock.time(|| run(engine, chunk));
            }
        }
        if round > 0 {
            for (times, sum) in times.iter_mut().zip(sums) {
                times.push(sum);
            }
        }
    }
    Turns::of(times)
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
        let got = Ratio::of(vec![5.0, 1.0, 3.0, 2.0, 4.0]);
        assert_eq!((got.median, got.quartiles), (3.0, [2.0, 4.0]));
        assert!((geometric_mean(&[2.0, 8.0]) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn ratios_are_taken_within_a_round() {
        let mut round = 0;
        let turns = measure_by(2, 4, |engine| {
            round += 1;
            // Engine 1 takes twice as long, whatever the drift.
            Duration::from_millis((1 + (round - 1) / 2) * (1 + engine as u64))
        });
        assert_eq!(turns.time_ratio(1, 0).quartiles, [2.0, 2.0]);
        assert_eq!(turns.speed[1].median, 0.5);
    }

    #[test]
    fn a_timed_chunk_follows_another_of_the_same_engine() {
        let mut order = Vec::new();
        let turns = measure_chunks(2, 1, 3, Clock::Wall, |engine, chunk| {
            order.push((engine, chunk));
        });
        assert_eq!(order.len(), 2 * 2 * 2 * 3);
        for pair in order.chunks(2) {
            assert_eq!(pair[0].0, pair[1].0);
            assert_eq!((pair[0].1 + 1) % 3, pair[1].1);
        }
        assert_eq!(turns.times.len(), 2);
    }
}
