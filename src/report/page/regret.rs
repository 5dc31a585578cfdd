//! Regret: by how much the lowest cost so far lies above the lowest of the whole search.
//!
//! The lowest of many noisy values is too low (the winner's curse), so that regret has a floor below
//! which it says nothing. The floor is drawn: what the winner cost when it was measured again.

use super::figure;
use super::plots::compared_levels;
use super::trials::Trial;
use crate::report::markup::escape;
use crate::report::number;
use crate::report::record::{ComparisonRow, Spread};
use crate::report::svg::Size;
use crate::report::svg::marker::Marker;
use crate::report::svg::xy::{Layer, Mark, Plot, Range};

const SIZE: Size = Size {
    width: 860.0,
    height: 340.0,
};

/// Number of the frame and regret in percent over `best`, where it changes; the last is 0.
fn regrets(trials: &[Trial<'_>], best: f64) -> Vec<(usize, f64)> {
    let mut lowest = f64::INFINITY;
    let mut regrets = Vec::new();
    for trial in trials {
        if trial.cost_ms < lowest {
            lowest = trial.cost_ms;
            regrets.push((trial.frame.frame, 100.0 * (lowest / best - 1.0)));
        }
    }
    regrets
}

/// The plot with its caution, or why there is none.
pub(super) fn section(trials: &[Trial<'_>], compared: &[ComparisonRow]) -> String {
    let html = "<h3>Regret</h3>\n".to_string();
    let best = trials
        .iter()
        .min_by(|one, other| one.cost_ms.total_cmp(&other.cost_ms));
    let Some(best) = best.filter(|best| best.cost_ms > 0.0) else {
        return html + "<p>No positive cost was measured: there is no best to compare with.</p>\n";
    };
    let regrets = regrets(trials, best.cost_ms);
    let least = regrets
        .iter()
        .map(|(_, regret)| *regret)
        .filter(|&regret| regret > 0.0)
        .fold(f64::INFINITY, f64::min);
    if !least.is_finite() {
        return html
            + &format!(
                "<p>The first measured frame, {}, had the lowest cost: there was no regret at any \
                 time.</p>\n",
                best.frame.frame
            );
    }
    // Zero has no place on a logarithmic axis: the best lies at the foot.
    let foot = 10f64.powi((0.5 * least).log10().floor() as i32);
    let mut points: Vec<(f64, f64)> = regrets
        .iter()
        .map(|&(frame, regret)| (frame as f64, regret.max(foot)))
        .collect();
    // The axis goes on to the end of the search.
    points.extend(trials.last().map(|last| (last.frame.frame as f64, foot)));
    let mut layers = compared_levels(&in_percent(compared, best.cost_ms, foot));
    layers.push(Layer::Steps {
        name: "lowest cost so far".to_string(),
        class: "incumbent",
        points,
    });
    layers.push(Layer::Marks {
        name: "lowest of the search".to_string(),
        marker: Marker::Diamond,
        radius: 5.0,
        marks: vec![Mark {
            x: best.frame.frame as f64,
            y: foot,
            class: "incumbent".to_string(),
            title: format!("frame {} has the lowest cost", best.frame.frame),
        }],
    });
    let plot = Plot {
        size: SIZE,
        description: "Regret over the frames",
        x_label: "frame",
        y_label: "above the lowest cost (%)",
        y_range: Range::Decades,
        layers,
    };
    html + &format!("<p>{}</p>\n", escape(&caution(best, compared)))
        + &figure(
            &plot.draw(),
            "By how much the lowest cost so far lies above the lowest of the search; the foot of \
             the plot stands for zero. Horizontal lines are the compared configurations, measured \
             at the end; what cost less than the lowest of the search has none.",
        )
}

/// The rows with their costs in percent above `best`; none for one below.
fn in_percent(compared: &[ComparisonRow], best: f64, foot: f64) -> Vec<ComparisonRow> {
    let above = |cost: f64| 100.0 * (cost / best - 1.0);
    let row = |row: &ComparisonRow| {
        let median = above(row.cost_ms.median);
        let cost_ms = if median > 0.0 {
            Spread {
                median: median.max(foot),
                lower: above(row.cost_ms.lower).max(foot),
                upper: above(row.cost_ms.upper).max(foot),
            }
        } else {
            Spread {
                median: f64::NAN,
                lower: f64::NAN,
                upper: f64::NAN,
            }
        };
        ComparisonRow {
            cost_ms,
            ..row.clone()
        }
    };
    compared.iter().map(row).collect()
}

/// How much of the regret is luck.
fn caution(best: &Trial<'_>, compared: &[ComparisonRow]) -> String {
    let seen = number::milliseconds(best.cost_ms);
    let again = compared.first().map(|row| row.cost_ms.median);
    let Some(again) = again.filter(|again| again.is_finite()) else {
        return format!(
            "The lowest cost of the search, {seen}, is the lowest of noisy values and therefore \
             too low; it was not measured again."
        );
    };
    let difference = 100.0 * (again / best.cost_ms - 1.0);
    let floor = if difference > 0.0 {
        format!(
            "{} % above it: regret of less than that is luck or the machine of the moment",
            number::significant(difference, 2)
        )
    } else {
        format!(
            "{} % below it: the machine was faster then, or the search was told too much",
            number::significant(-difference, 2)
        )
    };
    format!(
        "The lowest cost of the search is {seen}, the lowest of noisy values and therefore too \
         low. Measured again in the comparison, the tuned configuration took {}, {floor}. The \
         comparison is the estimate to believe.",
        number::milliseconds(again)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;
    use crate::report::page::trials::measured;
    use crate::report::record::FrameRecord;

    fn frames(costs: &[f64]) -> Vec<FrameRecord> {
        let frame = |(index, &cost)| FrameRecord {
            cost_ms: Some(cost),
            ..example::frame(index)
        };
        costs.iter().enumerate().map(frame).collect()
    }

    #[test]
    fn regret_falls_to_zero_at_the_best() {
        let frames = frames(&[30.0, 40.0, 22.0, 20.0, 25.0]);
        let found = regrets(&measured(&frames), 20.0);
        let rounded: Vec<(usize, i64)> = found
            .iter()
            .map(|(frame, regret)| (*frame, regret.round() as i64))
            .collect();
        assert_eq!(rounded, [(0, 50), (2, 10), (3, 0)]);
    }

    #[test]
    fn the_winner_is_measured_again() {
        let frames = frames(&[30.0, 20.0, 25.0]);
        let trials = measured(&frames);
        let html = section(&trials, &[example::row("tuned", "1", 22.0, 1.0)]);
        assert!(html.contains("took 22.0 ms, 10 % above it"), "{html}");
        assert!(html.contains("log scale") && html.contains("tuned, compared"));
        let html = section(&trials, &[example::row("tuned", "1", 19.0, 1.0)]);
        assert!(html.contains("5.0 % below it"), "{html}");
        assert!(!html.contains("tuned, compared"), "there is no such line");
        let html = section(&trials, &[]);
        assert!(html.contains("was not measured again"));
    }

    #[test]
    fn without_regret_there_is_a_sentence() {
        for costs in [vec![], vec![5.0], vec![5.0, 5.0, 5.0], vec![0.0, 1.0]] {
            let frames = frames(&costs);
            let html = section(&measured(&frames), &[]);
            assert!(!html.contains("<svg") && html.contains("<p>"), "{costs:?}");
        }
    }
}
