//! The comparison at the end of a run: for the log, and as a table.

use comfy_table::{Table, presets};
use raywright::{
    report::record::{ComparisonRow, RunSummary, Spread},
    tune::{self, Comparison, Metric, milliseconds},
};

use super::super::{Failure, output};

/// Medians and quartiles of all rows.
pub(super) fn summary(comparison: &Comparison, metric: Metric, interrupted: bool) -> RunSummary {
    let tuned = comparison.rows[0].costs_ms(metric);
    let rows = comparison.rows.iter().map(|row| {
        let costs = row.costs_ms(metric);
        let ratios: Vec<f64> = costs
            .iter()
            .zip(&tuned)
            .map(|(cost, tuned)| cost / tuned)
            .collect();
        let builds: Vec<f64> = row
            .rounds
            .iter()
            .map(|times| milliseconds(times.build))
            .collect();
        let renders: Vec<f64> = row
            .rounds
            .iter()
            .map(|times| milliseconds(times.render))
            .collect();
        Some(ComparisonRow {
            name: row.name.into(),
            config: tune::described(&row.params),
            build_ms: spread(&builds)?,
            render_ms: spread(&renders)?,
            cost_ms: spread(&costs)?,
            cost_ratio_to_tuned: spread(&ratios)?,
        })
    });
    RunSummary {
        rounds: tuned.len(),
        comparison: rows.flatten().collect(),
        interrupted,
    }
}

/// Median and quartiles, interpolated between neighbours; `None` of nothing.
fn spread(values: &[f64]) -> Option<Spread> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let quantile = |q: f64| {
        let place = q * last as f64;
        let (below, share) = (place as usize, place.fract());
        sorted[below] + (sorted[(below + 1).min(last)] - sorted[below]) * share
    };
    Some(Spread {
        median: quantile(0.5),
        lower: quantile(0.25),
        upper: quantile(0.75),
    })
}

pub(super) fn print_comparison(summary: &RunSummary) -> Result<(), Failure> {
    let mut table = Table::new();
    table.load_style(presets::UTF8_FULL_CONDENSED);
    table.set_header([
        "",
        "build ms",
        "render ms",
        "cost ms",
        "cost ÷ tuned (quartiles)",
    ]);
    for row in &summary.comparison {
        table.add_row([
            row.name.clone(),
            format!("{:.1}", row.build_ms.median),
            format!("{:.1}", row.render_ms.median),
            format!("{:.1}", row.cost_ms.median),
            format!(
                "{:.3} ({:.3} … {:.3})",
                row.cost_ratio_to_tuned.median,
                row.cost_ratio_to_tuned.lower,
                row.cost_ratio_to_tuned.upper
            ),
        ]);
    }
    output::line(format_args!(
        "\n{table}\n{} rounds in turns, medians; above 1, tuning won\n",
        summary.rounds
    ))?;
    let Some(tuned) = summary.comparison.first() else {
        return Ok(());
    };
    let config: Vec<String> = tuned
        .config
        .iter()
        .map(|(name, value)| format!("{name}={value}"))
        .collect();
    output::line(format_args!("tuned: {}\n", config.join(" ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_are_interpolated() {
        let got = spread(&[4.0, 1.0, 3.0, 2.0]).unwrap();
        assert_eq!((got.lower, got.median, got.upper), (1.75, 2.5, 3.25));
        assert_eq!(spread(&[]), None);
        assert_eq!(
            spread(&[7.0]).map(|s| (s.lower, s.median, s.upper)),
            Some((7.0, 7.0, 7.0))
        );
    }
}
