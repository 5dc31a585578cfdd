//! The tables of the page, each from the part of the record that it shows.

use super::ABSENT;
use super::frames::whole_ms;
use super::table::{Cell, Table};
use super::trials::{Configuration, Failure, parameters, render_ms, value_of};
use super::verdict::{Outcome, metric, outcome};
use crate::report::number;
use crate::report::record::{ComparisonRow, FrameRecord, RunHeader, Spread};

/// Spans of frames that are listed for a reason to fail.
const MOST_SPANS: usize = 16;

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
            cells.extend([frame.cost_ms, frame.build_ms, render_ms(frame)].map(time));
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
            vec![
                Cell::Text(failure.reason.clone()),
                Cell::Number(number::count(failure.frames.len())),
                Cell::Text(spans(&failure.frames)),
            ]
        })
        .collect();
    Table {
        head: titles(&["reason", "trials", "frames"]),
        rows,
    }
}

/// Numbers that follow one another as spans: 0–3, 7. Of many spans the first.
fn spans(numbers: &[usize]) -> String {
    let spans: Vec<String> = numbers
        .chunk_by(|one, next| one + 1 == *next)
        .map(|span| match span {
            [first, .., last] => format!("{first}–{last}"),
            other => other.iter().map(usize::to_string).collect(),
        })
        .collect();
    let shown = spans.iter().take(MOST_SPANS).cloned().collect::<Vec<_>>();
    let rest = if spans.len() > shown.len() {
        ", …"
    } else {
        ""
    };
    shown.join(", ") + rest
}

/// Frames in their order. What no frame has, has no column.
pub(super) fn frames(frames: &[FrameRecord], parameters: &[String]) -> Table {
    let has_whole = frames.iter().any(|frame| frame.frame_ms.is_some());
    let has_probe = frames.iter().any(|frame| frame.probe.is_some());
    let has_reason = frames.iter().any(|frame| frame.reason.is_some());
    let mut head = titles(&[
        "frame",
        "cost (ms)",
        "build (ms)",
        "render (ms)",
        "lowest so far (ms)",
    ]);
    let some = [
        (has_whole, "whole frame (ms)"),
        (has_probe, "probe: candidate ÷ incumbent"),
        (has_reason, "reason"),
        (true, "remark"),
    ];
    let some = some.into_iter().filter(|(has, _)| *has);
    head.extend(some.map(|(_, title)| title.to_string()));
    head.extend(parameters.iter().cloned());
    let row = |frame: &FrameRecord| {
        let mut cells = vec![Cell::Number(frame.frame.to_string())];
        let times = [
            frame.cost_ms,
            frame.build_ms,
            frame.render_ms,
            frame.incumbent_cost_ms,
        ];
        cells.extend(times.map(time));
        if has_whole {
            cells.push(time(whole_ms(frame)));
        }
        if has_probe {
            let ratio = frame.probe.as_ref().map(|probe| number::ratio(probe.ratio));
            cells.push(Cell::Number(ratio.unwrap_or_else(|| ABSENT.to_string())));
        }
        if has_reason {
            cells.push(Cell::Text(frame.reason.clone().unwrap_or_default()));
        }
        cells.push(Cell::Text(remark(frame)));
        cells.extend(parameters.iter().map(|name| parameter(&frame.config, name)));
        cells
    };
    Table {
        head,
        rows: frames.iter().map(row).collect(),
    }
}

fn remark(frame: &FrameRecord) -> String {
    let mut remarks = Vec::new();
    if let Some(reason) = &frame.failure {
        remarks.push(format!("failed: {reason}"));
    }
    if let Some(probe) = &frame.probe {
        remarks.push(probe.decision.clone());
    }
    if frame.is_incumbent && frame.failure.is_none() {
        remarks.push("new incumbent".to_string());
    }
    remarks.join(", ")
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
        (
            "policy",
            header.policy.clone().unwrap_or_else(|| ABSENT.to_string()),
        ),
        (
            "frames per tree",
            header
                .frames_per_tree
                .map_or_else(|| ABSENT.to_string(), |frames| number::brief(frames, 4)),
        ),
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
        // Logs of earlier versions lack some.
        .filter(|(_, value)| value != ABSENT)
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
    fn columns_that_no_frame_fills_are_left_out() {
        let plain = frames(&example::run(12).frames, &[]);
        assert_eq!(plain.head.len(), 6);
        let probed = frames(&example::probed(30).frames, &[]);
        assert_eq!(probed.head.len(), 9);
        assert!(probed.rows.iter().all(|row| row.len() == 9));
        let html = probed.html();
        assert!(html.contains("accepted, new incumbent") && html.contains("rejected"));
    }

    #[test]
    fn frames_that_follow_one_another_are_a_span() {
        assert_eq!(spans(&[0, 1, 2, 5, 7, 8]), "0–2, 5, 7–8");
        assert_eq!(spans(&[]), "");
        let every_other: Vec<usize> = (0..100).map(|number| 2 * number).collect();
        assert!(spans(&every_other).ends_with("30, …"));
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
