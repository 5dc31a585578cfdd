//! Regret: how far the search still was from the best that it ever saw, in percent.
//!
//! On a logarithmic axis, since a search that halves its regret again and again is a straight line
//! there. It is zero from the frame of the best on, which a logarithm has no place for: the line falls
//! to the foot of the plot instead. The best of many noisy costs is lower than it would be measured
//! again, so that regret against it is too great, and only the shape is worth looking at.

use crate::report::number;
use crate::report::svg::marker::Marker;
use crate::report::svg::xy::{Layer, Mark, Plot, Range};

use super::plots::{self, WIDE};
use super::trials::Trial;

/// Regret in percent below which nothing is told apart: less than any measurement repeats to.
const LEAST: f64 = 0.01;
/// More marks than this hide each other.
const MOST_SHOWN: usize = 1_000;

/// Costs over the best of the run; `None` if there are fewer than two different ones.
pub(super) fn plot(trials: &[Trial<'_>]) -> Option<String> {
    let best = best(trials)?;
    let percent = |cost: f64| 100.0 * (cost / best - 1.0);
    let least = trials
        .iter()
        .map(|trial| percent(trial.cost_ms))
        .filter(|&regret| regret > 0.0 && regret.is_finite())
        .fold(f64::INFINITY, f64::min);
    if !least.is_finite() {
        return None;
    }
    let foot = 10f64.powf(least.max(LEAST).log10().floor());
    let shown = |cost: f64| percent(cost).max(foot);

    let mut points: Vec<(f64, f64)> = Vec::new();
    let mut lowest = f64::INFINITY;
    for trial in trials {
        if trial.cost_ms < lowest {
            let x = trial.frame.frame as f64;
            if lowest.is_finite() {
                points.push((x, shown(lowest)));
            }
            lowest = trial.cost_ms;
            points.push((x, shown(lowest)));
        }
    }
    let last = trials.last()?.frame.frame as f64;
    points.push((last, shown(lowest)));
    let marks = plots::thinned(trials, MOST_SHOWN).map(|trial| Mark {
        x: trial.frame.frame as f64,
        y: shown(trial.cost_ms),
        class: "plain".to_string(),
        title: format!(
            "frame {}: {} % over the best",
            trial.frame.frame,
            number::significant(percent(trial.cost_ms), 3)
        ),
    });
    let plot = Plot {
        size: WIDE,
        description: "Cost over the best of the run",
        x_label: "frame",
        y_label: "regret (%)",
        y_range: Range::Decades,
        layers: vec![
            Layer::Marks {
                name: "of each trial".to_string(),
                marker: Marker::Circle,
                radius: 3.0,
                marks: marks.collect(),
            },
            Layer::Line {
                name: "of the lowest cost so far".to_string(),
                class: "incumbent",
                points,
            },
        ],
    };
    Some(plot.draw())
}

/// Explains the plot and what it is not good for.
pub(super) fn caption(trials: &[Trial<'_>]) -> String {
    let best = best(trials)
        .and_then(|best| trials.iter().find(|trial| trial.cost_ms == best))
        .map_or_else(String::new, |trial| {
            format!(", that of frame {}", trial.frame.frame)
        });
    format!(
        "How much more each trial cost than the best one of the run{best}; at the foot of the plot \
         it is zero. Caution: the best of many noisy costs is biased low, and the regret against it \
         too high. What was gained is told by the comparison, which measured anew."
    )
}

fn best(trials: &[Trial<'_>]) -> Option<f64> {
    trials
        .iter()
        .map(|trial| trial.cost_ms)
        .filter(|&cost| cost > 0.0)
        .reduce(f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;
    use crate::report::page::trials::measured;
    use crate::report::record::FrameRecord;

    fn frames(costs: &[f64]) -> Vec<FrameRecord> {
        let frame = |(index, &cost): (usize, &f64)| FrameRecord {
            cost_ms: Some(cost),
            failure: None,
            ..example::frame(index)
        };
        costs.iter().enumerate().map(frame).collect()
    }

    #[test]
    fn regret_is_against_the_best_of_the_run() {
        let frames = frames(&[20.0, 30.0, 11.0, 10.0, 12.0]);
        let trials = measured(&frames);
        let drawn = plot(&trials).unwrap();
        for said in [
            "frame 0: 100 %",
            "frame 2: 10.0 %",
            "frame 3: 0 %",
            "frame 4: 20.0 %",
        ] {
            assert!(drawn.contains(said), "{said}");
        }
        assert!(drawn.contains("regret (%), log scale"));
        assert!(caption(&trials).contains("that of frame 3"));
    }

    #[test]
    fn the_line_never_rises() {
        let frames = frames(&[20.0, 30.0, 11.0, 10.0, 12.0]);
        let drawn = plot(&measured(&frames)).unwrap();
        let line = drawn.rsplit("d=\"M").next().unwrap();
        let heights: Vec<f64> = line
            .split('"')
            .next()
            .unwrap()
            .split('L')
            .map(|corner| corner.split_once(',').unwrap().1.parse().unwrap())
            .collect();
        assert!(heights.len() > 4 && heights.is_sorted(), "{heights:?}");
    }

    #[test]
    fn equal_costs_have_no_regret() {
        assert_eq!(plot(&[]), None);
        for costs in [vec![5.0], vec![5.0, 5.0], vec![0.0, 0.0]] {
            let frames = frames(&costs);
            assert_eq!(plot(&measured(&frames)), None, "{costs:?}");
        }
    }
}
