//! The plots of the page: from frames and comparison to layers and colours.

use super::trials::{Trial, quarters, render_ms, tried, value_of};
use crate::report::number;
use crate::report::record::{ComparisonRow, FrameRecord};
use crate::report::svg::bars::{Bar, bars};
use crate::report::svg::marker::Marker;
use crate::report::svg::parallel::{Strand, parallel_coordinates};
use crate::report::svg::xy::{Layer, Mark, Plot, Range};
use crate::report::svg::{Size, color};

const WIDE: Size = Size {
    width: 860.0,
    height: 400.0,
};
const BARS_WIDTH: f64 = 640.0;
/// Two of these stand side by side on a wide screen.
const NARROW: Size = Size {
    width: 420.0,
    height: 380.0,
};
/// Crosses of failed trials that have room at the upper edge.
pub(super) const MOST_CROSSES: usize = 120;
/// The style sheet tells so many compared configurations apart.
const SERIES: usize = 4;

/// Median costs of the compared configurations.
pub(super) fn cost_bars(rows: &[ComparisonRow]) -> String {
    let bars_of_rows: Vec<Bar> = rows
        .iter()
        .enumerate()
        .map(|(index, row)| Bar {
            name: row.name.clone(),
            class: series(index),
            spread: row.cost_ms,
            label: number::milliseconds(row.cost_ms.median),
        })
        .collect();
    bars(
        BARS_WIDTH,
        "Cost of the compared configurations",
        "cost (ms)",
        &bars_of_rows,
    )
}

/// The costs of the compared configurations as levels, with their quartiles as bands.
pub(super) fn compared_levels(compared: &[ComparisonRow]) -> Vec<Layer> {
    let level = |(index, row): (usize, &ComparisonRow)| Layer::Level {
        name: format!("{}, compared", row.name),
        class: series(index),
        y: row.cost_ms.median,
        band: (row.cost_ms.lower, row.cost_ms.upper),
    };
    compared.iter().enumerate().map(level).collect()
}

/// Cost of every frame, the incumbent's cost so far, and the compared configurations as levels.
pub(super) fn history(
    frames: &[FrameRecord],
    trials: &[Trial<'_>],
    compared: &[ComparisonRow],
) -> String {
    let mut layers = compared_levels(compared);
    layers.push(Layer::Steps {
        name: "cost of the incumbent".to_string(),
        class: "incumbent",
        points: frames
            .iter()
            .filter_map(|frame| Some((frame.frame as f64, frame.incumbent_cost_ms?)))
            .collect(),
    });
    let marks = |wanted: bool, class: &str| -> Vec<Mark> {
        trials
            .iter()
            .filter(|trial| trial.frame.is_incumbent == wanted)
            .map(|trial| Mark {
                x: trial.frame.frame as f64,
                y: trial.cost_ms,
                class: class.to_string(),
                title: title(trial),
            })
            .collect()
    };
    layers.push(Layer::Marks {
        name: "tried".to_string(),
        marker: Marker::Circle,
        radius: 3.5,
        marks: marks(false, "plain"),
    });
    layers.push(Layer::Marks {
        name: "new incumbent".to_string(),
        marker: Marker::Diamond,
        radius: 4.5,
        marks: marks(true, "incumbent"),
    });
    let failed: Vec<&FrameRecord> = tried(frames)
        .filter(|frame| frame.cost_ms.is_none_or(|cost| !cost.is_finite()))
        .collect();
    let stride = failed.len().div_ceil(MOST_CROSSES).max(1);
    let failed: Vec<(f64, String)> = failed
        .into_iter()
        .step_by(stride)
        .map(|frame| {
            let reason = frame.failure.as_deref().unwrap_or("not measured");
            (
                frame.frame as f64,
                format!("frame {}: {reason}", frame.frame),
            )
        })
        .collect();
    layers.push(Layer::Absences {
        name: "failed".to_string(),
        places: failed,
    });
    Plot {
        size: WIDE,
        description: "Cost of every frame in the order of the search",
        x_label: "frame",
        y_label: "cost (ms)",
        y_range: Range::Fitted,
        layers,
    }
    .draw()
}

/// Build time against render time of every frame, and of the compared configurations.
pub(super) fn build_and_render(trials: &[Trial<'_>], compared: &[ComparisonRow]) -> String {
    let mut layers = vec![ranked_marks(trials, |frame| {
        Some((frame.build_ms?, render_ms(frame)?))
    })];
    for (index, row) in compared.iter().enumerate() {
        layers.push(Layer::Marks {
            name: row.name.clone(),
            marker: [Marker::Diamond, Marker::Square, Marker::Triangle][index % 3],
            radius: 6.0,
            marks: vec![Mark {
                x: row.build_ms.median,
                y: row.render_ms.median,
                class: format!("compared {}", series(index)),
                title: format!(
                    "{}: build {}, render {}",
                    row.name,
                    number::milliseconds(row.build_ms.median),
                    number::milliseconds(row.render_ms.median)
                ),
            }],
        });
    }
    Plot {
        size: NARROW,
        description: "Build time and render time of every frame",
        x_label: "build (ms)",
        y_label: "render (ms)",
        y_range: Range::Fitted,
        layers,
    }
    .draw()
}

/// Least and greatest leaf size of every frame; `None` if no frame has both.
pub(super) fn leaf_sizes(trials: &[Trial<'_>]) -> Option<String> {
    let layer = ranked_marks(trials, |frame| {
        let size = |name| value_of(&frame.config, name)?.parse::<f64>().ok();
        Some((size("min_leaf_size")?, size("max_leaf_size")?))
    });
    let empty = matches!(&layer, Layer::Marks { marks, .. } if marks.is_empty());
    (!empty).then(|| {
        Plot {
            size: NARROW,
            description: "Leaf sizes of every frame",
            x_label: "min_leaf_size (primitives)",
            y_label: "max_leaf_size (primitives)",
            y_range: Range::Fitted,
            layers: vec![layer],
        }
        .draw()
    })
}

/// All configurations with all parameters, and the cost as the last axis.
pub(super) fn parameters(trials: &[Trial<'_>], parameters: &[String]) -> String {
    let mut columns = parameters.to_vec();
    columns.push("cost (ms)".to_string());
    let strands: Vec<Strand> = trials
        .iter()
        .map(|trial| {
            let mut values: Vec<Option<String>> = parameters
                .iter()
                .map(|name| value_of(&trial.frame.config, name).map(str::to_string))
                .collect();
            values.push(Some(trial.cost_ms.to_string()));
            Strand {
                values,
                rank: trial.rank,
                title: title(trial),
            }
        })
        .collect();
    parallel_coordinates(
        WIDE.width,
        "All parameters of every configuration",
        &columns,
        &strands,
    )
}

/// The meaning of the colours.
pub(super) fn rank_legend(frames: &[FrameRecord]) -> String {
    let labels: Vec<String> = quarters(frames)
        .into_iter()
        .map(|cost| number::significant(cost, 3))
        .collect();
    color::legend(
        "colour: rank of the cost, with the cost at each quarter (ms)",
        &labels,
    )
}

/// Circles coloured by rank, the best on top; frames without a position are left out.
fn ranked_marks(
    trials: &[Trial<'_>],
    position: impl Fn(&FrameRecord) -> Option<(f64, f64)>,
) -> Layer {
    let mut order: Vec<&Trial<'_>> = trials.iter().collect();
    order.sort_by(|one, other| other.rank.total_cmp(&one.rank));
    let marks = order
        .into_iter()
        .filter_map(|trial| {
            let (x, y) = position(trial.frame)?;
            Some(Mark {
                x,
                y,
                class: color::class(trial.rank),
                title: title(trial),
            })
        })
        .collect();
    Layer::Marks {
        name: String::new(),
        marker: Marker::Circle,
        radius: 5.0,
        marks,
    }
}

fn series(index: usize) -> String {
    format!("s{}", index % SERIES)
}

/// What the pointer shows on a frame.
fn title(trial: &Trial<'_>) -> String {
    let time = |value: Option<f64>| {
        value.map_or_else(|| number::NOT_A_NUMBER.to_string(), number::milliseconds)
    };
    let config: Vec<String> = trial
        .frame
        .config
        .iter()
        .map(|(name, value)| format!("{name} = {value}"))
        .collect();
    format!(
        "frame {}: cost {}, build {}, render {}\n{}",
        trial.frame.frame,
        number::milliseconds(trial.cost_ms),
        time(trial.frame.build_ms),
        time(render_ms(trial.frame)),
        config.join("\n")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;
    use crate::report::page::trials::measured;

    #[test]
    fn the_history_shows_every_frame_once() {
        let run = example::run(80);
        let trials = measured(&run.frames);
        let compared = run.summary.unwrap().comparison;
        let drawn = history(&run.frames, &trials, &compared);
        for frame in &run.frames {
            let title = format!("<title>frame {}:", frame.frame);
            assert_eq!(drawn.matches(&title).count(), 1, "{title}");
        }
        // Each level is drawn once, and once as a symbol in the legend.
        assert_eq!(drawn.matches("class=\"level").count(), 2 * compared.len());
    }

    #[test]
    fn the_best_frame_is_drawn_last() {
        let run = example::run(40);
        let trials = measured(&run.frames);
        let best = trials.iter().find(|trial| trial.rank == 0.0).unwrap();
        let drawn = build_and_render(&trials, &[]);
        let last = drawn.rsplit("<title>").next().unwrap();
        assert!(last.starts_with(&format!("frame {}:", best.frame.frame)));
    }

    #[test]
    fn leaf_sizes_are_drawn_only_where_both_exist() {
        let mut frames = example::run(3).frames;
        frames[1].config.retain(|(name, _)| name != "min_leaf_size");
        let drawn = leaf_sizes(&measured(&frames)).unwrap();
        assert!(drawn.contains("frame 0:") && drawn.contains("frame 2:"));
        assert!(!drawn.contains("frame 1:"));
        for frame in &mut frames {
            frame.config.retain(|(name, _)| name != "max_leaf_size");
        }
        assert_eq!(leaf_sizes(&measured(&frames)), None);
    }

    #[test]
    fn all_parameters_have_an_axis() {
        let run = example::run(5);
        let names: Vec<String> = run.frames[0]
            .config
            .iter()
            .map(|(name, _)| name.clone())
            .collect();
        let drawn = parameters(&measured(&run.frames), &names);
        for name in names {
            assert!(drawn.contains(&format!(">{name}<")), "{name}");
        }
    }
}
