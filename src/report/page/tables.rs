//! The tables of the page, each from the part of the record that it shows.

use super::table::{Cell, Table};
use super::trials::{Configuration, Failure, parameters, value_of};
use super::verdict::{Outcome, metric, outcome};
use crate::report::number;
use crate::report::record::{ComparisonRow, FrameRecord, RunHeader, Spread};

/// Shown where a value does not exist.
const ABSENT: &str = "–";

/// Times and ratios of the tuned configuration and the baselines.
pub(super) fn comparison(tuned: &ComparisonRow, baselines: &[ComparisonRow]) -> Table {
    let times = |row: &ComparisonRow| {
        [row.build_ms, row.render_ms, row.cost_ms]
            .map(|spread| Cell::Number(with_quartiles(spread)))
    };
    let mut first = vec![Cell::Text(tuned.name.clone())];
    first.extend(times(tuned));
    first.push(Cell::Number("1 by definition".to_string()));
    first.push(Cell::Text(ABSENT.to_string()));
    let mut rows = vec![first];
    for baseline in baselines {
        let ratio = baseline.cost_ratio_to_tuned;
        let mut row = vec![Cell::Text(baseline.name.clone())];
        row.extend(times(baseline));
        row.push(Cell::Number(format!(
            "{} ({}–{})",
            number::ratio(ratio.median),
            number::ratio(ratio.lower),
            number::ratio(ratio.upper)
        )));
        row.push(Cell::Text(
            match outcome(tuned, baseline) {
                Outcome::Faster => "tuned is faster",
                Outcome::Slower => "tuned is slower",
                Outcome::Undecided => "undecided",
                Outcome::Same => "the same",
                Outcome::Unknown => "unknown",
            }
            .to_string(),
        ));
        rows.push(row);
    }
    Table {
        head: titles(&[
            "configuration",
            "build (ms)",
            "render (ms)",
            "cost (ms)",
            "cost ÷ tuned",
            "result",
        ]),
        rows,
    }
}

/// The parameters of the compared configurations side by side.
pub(super) fn compared_parameters(rows: &[ComparisonRow]) -> Table {
    let mut head = titles(&["parameter"]);
    head.extend(rows.iter().map(|row| row.name.clone()));
    let rows = parameters(rows.iter().map(|row| &row.config))
        .into_iter()
        .map(|name| {
            let mut cells = vec![Cell::Text(name.clone())];
            cells.extend(rows.iter().map(|row| parameter(&row.config, &name)));
            cells
        })
        .collect();
    Table { head, rows }
}

/// The `limit` configurations with the lowest costs.
pub(super) fn best(
    configurations: &[Configuration<'_>],
    parameters: &[String],
    limit: usize,
) -> Table {
    let mut head = titles(&[
        "rank",
        "frame",
        "cost (ms)",
        "build (ms)",
        "render (ms)",
        "measured",
    ]);
    head.extend(parameters.iter().cloned());
    let rows = configurations
        .iter()
        .take(limit)
        .enumerate()
        .map(|(index, configuration)| {
            let frame = configuration.best.frame;
            let mut cells = vec![
                Cell::Number((index + 1).to_string()),
                Cell::Number(frame.frame.to_string()),
            ];
            cells.extend([frame.cost_ms, frame.build_ms, frame.render_ms].map(time));
            cells.push(Cell::Number(format!("{} ×", configuration.measurements)));
            cells.extend(parameters.iter().map(|name| parameter(&frame.config, name)));
            cells
        })
        .collect();
    Table { head, rows }
}

/// Why trials failed, and how often.
pub(super) fn failures(failures: &[Failure]) -> Table {
    let rows = failures
        .iter()
        .map(|failure| {
            let frames: Vec<String> = failure.frames.iter().map(usize::to_string).collect();
            vec![
                Cell::Text(failure.reason.clone()),
                Cell::Number(number::count(failure.frames.len())),
                Cell::Text(frames.join(", ")),
            ]
        })
        .collect();
    Table {
        head: titles(&["reason", "trials", "frames"]),
        rows,
    }
}

/// All frames in their order.
pub(super) fn frames(frames: &[FrameRecord], parameters: &[String]) -> Table {
    let mut head = titles(&[
        "frame",
        "cost (ms)",
        "build (ms)",
        "render (ms)",
        "lowest so far (ms)",
        "remark",
    ]);
    head.extend(parameters.iter().cloned());
    let rows = frames
        .iter()
        .map(|frame| {
            let mut cells = vec![Cell::Number(frame.frame.to_string())];
            cells.extend(
                [
                    frame.cost_ms,
                    frame.build_ms,
                    frame.render_ms,
                    frame.incumbent_cost_ms,
                ]
                .map(time),
            );
            cells.push(Cell::Text(match &frame.failure {
                Some(reason) => format!("failed: {reason}"),
                None if frame.is_incumbent => "new incumbent".to_string(),
                None => String::new(),
            }));
            cells.extend(parameters.iter().map(|name| parameter(&frame.config, name)));
            cells
        })
        .collect();
    Table { head, rows }
}

/// The indicators of the scene.
pub(super) fn indicators(header: &RunHeader) -> Table {
    let rows = header
        .indicators
        .iter()
        .map(|(name, value)| {
            vec![
                Cell::Text(name.clone()),
                Cell::Number(number::brief(*value, 5)),
            ]
        })
        .collect();
    Table {
        head: titles(&["indicator", "value"]),
        rows,
    }
}

/// Everything that is needed to repeat the run.
pub(super) fn manifest(header: &RunHeader, frames_done: usize) -> Table {
    let settings = [
        ("raywright", header.version.clone()),
        ("scene", header.scene.clone()),
        ("triangles", number::count(header.triangles)),
        (
            "resolution",
            format!("{} × {} pixels", header.width, header.height),
        ),
        (
            "path length K",
            format!("{} scattering events", header.path_length),
        ),
        (
            "metric",
            format!("{}: {}", header.metric, metric(&header.metric)),
        ),
        ("search", header.search.clone()),
        // Not grouped: it is copied to a command line.
        ("seed", header.seed.to_string()),
        ("threads", header.threads.to_string()),
        ("instruction set", header.instruction_set.clone()),
        (
            "frames",
            format!(
                "{} of {} planned",
                number::count(frames_done),
                number::count(header.frames_planned)
            ),
        ),
        ("schema of the log", header.schema_version.to_string()),
    ];
    let rows = settings
        .into_iter()
        .map(|(name, value)| vec![Cell::Text(name.to_string()), Cell::Text(value)])
        .collect();
    Table {
        head: titles(&["setting", "value"]),
        rows,
    }
}

fn titles(titles: &[&str]) -> Vec<String> {
    titles.iter().map(|title| title.to_string()).collect()
}

fn with_quartiles(spread: Spread) -> String {
    format!(
        "{} ({}–{})",
        number::significant(spread.median, 3),
        number::significant(spread.lower, 3),
        number::significant(spread.upper, 3)
    )
}

fn time(value: Option<f64>) -> Cell {
    Cell::Number(value.map_or_else(|| ABSENT.to_string(), |value| number::significant(value, 4)))
}

/// The value of a parameter as it was given: rounding it would name another configuration. Words
/// are aligned as numbers are, since a column may have both.
fn parameter(config: &[(String, String)], name: &str) -> Cell {
    Cell::Number(value_of(config, name).unwrap_or(ABSENT).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;
    use crate::report::page::trials;

    #[test]
    fn the_comparison_has_a_row_for_each_configuration() {
        let rows = example::run(3).summary.unwrap().comparison;
        let table = comparison(&rows[0], &rows[1..]);
        assert_eq!(table.rows.len(), 3);
        assert!(table.rows.iter().all(|row| row.len() == table.head.len()));
        let html = table.html();
        assert!(html.contains("50.4 (49.6–51.2)"), "{html}");
        assert!(html.contains("1.32 (1.31–1.33)"), "{html}");
        assert_eq!(html.matches("tuned is faster").count(), 2);
    }

    #[test]
    fn parameters_that_one_configuration_lacks_are_absent_not_lost() {
        let mut rows = example::run(3).summary.unwrap().comparison;
        rows[1].config.clear();
        let html = compared_parameters(&rows).html();
        assert!(html.contains("sah_block_size"));
        assert_eq!(html.matches(ABSENT).count(), rows[0].config.len());
    }

    #[test]
    fn the_best_table_is_sorted_and_limited() {
        let run = example::run(80);
        let trials = trials::measured(&run.frames);
        let configurations = trials::configurations(&trials);
        let table = best(&configurations, &["quality".to_string()], 10);
        assert_eq!(table.rows.len(), 10);
        let lowest = trials
            .iter()
            .min_by(|one, other| one.cost_ms.total_cmp(&other.cost_ms))
            .unwrap();
        let Cell::Number(frame) = &table.rows[0][1] else {
            panic!("the frame is a number");
        };
        assert_eq!(*frame, lowest.frame.frame.to_string());
    }

    #[test]
    fn all_frames_are_listed_with_reasons() {
        let run = example::run(12);
        let table = frames(&run.frames, &[]);
        assert_eq!(table.rows.len(), 12);
        assert!(table.html().contains("failed: the tree is deeper than"));
    }

    #[test]
    fn all_indicators_and_settings_are_listed() {
        let header = example::run(0).header;
        assert_eq!(indicators(&header).rows.len(), 17);
        let html = manifest(&header, 0).html();
        for text in ["262\u{202f}267", "1280 × 720", "hybrid", "avx512", "42"] {
            assert!(html.contains(text), "{text}");
        }
    }
}
