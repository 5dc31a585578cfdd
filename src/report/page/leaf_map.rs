//! Leaf sizes as a map: mean times over the classes of the least and the greatest leaf.
//!
//! Classes double (1, 2, 3–4, 5–8, …), since few trials would leave most cells of a map of single
//! sizes empty. The least size is at most the greatest, so that the map is a triangle. A cell is the
//! mean over whatever else differs between its trials: a map of what was seen, not of an effect.

use super::figure;
use super::trials::{Trial, render_ms, value_of};
use crate::report::number;
use crate::report::record::FrameRecord;
use crate::report::svg::Size;
use crate::report::svg::heat::{Cell, HeatMap};

const SIZE: Size = Size {
    width: 420.0,
    height: 360.0,
};

/// Both maps side by side, or why there are none.
pub(super) fn section(trials: &[Trial<'_>]) -> String {
    let html = "<h3>Leaf sizes</h3>\n".to_string();
    if !trials.iter().any(|trial| classes(trial.frame).is_some()) {
        return html + "<p>No trial has both min_leaf_size and max_leaf_size.</p>\n";
    }
    let map = |title: &str, time: fn(&FrameRecord) -> Option<f64>| {
        let plot = map(trials, title, time);
        plot.map_or_else(
            || format!("<p>There is no {title}.</p>\n"),
            |plot| {
                figure(
                    &plot,
                    "Mean over the trials in each cell; colours are logarithmic from the least to \
                     the greatest mean. Other parameters differ too.",
                )
            },
        )
    };
    html + &format!(
        "<div class=\"pair\">\n{}{}</div>\n",
        map("mean time to render (ms)", render_ms),
        map("mean time to build (ms)", |frame| frame.build_ms)
    )
}

/// The class of a size: 0 for 1, and k for sizes up to 2^k.
fn class(size: u32) -> usize {
    size.next_power_of_two().trailing_zeros() as usize
}

fn class_name(class: usize) -> String {
    match class {
        0 | 1 => (1 << class).to_string(),
        _ => format!("{}–{}", (1_u64 << (class - 1)) + 1, 1_u64 << class),
    }
}

/// The classes of the least and the greatest leaf.
fn classes(frame: &FrameRecord) -> Option<(usize, usize)> {
    let size = |name| {
        let size = value_of(&frame.config, name)?.parse::<u32>().ok()?;
        (1..=1 << 20).contains(&size).then_some(size)
    };
    let (least, greatest) = (size("min_leaf_size")?, size("max_leaf_size")?);
    Some((class(least), class(greatest)))
}

fn map(
    trials: &[Trial<'_>],
    title: &str,
    time: impl Fn(&FrameRecord) -> Option<f64>,
) -> Option<String> {
    // Cells in order of their classes, each with sum and number.
    let mut cells: std::collections::BTreeMap<(usize, usize), (f64, usize)> = Default::default();
    for trial in trials {
        let time = time(trial.frame).filter(|time| time.is_finite() && *time > 0.0);
        if let (Some(classes), Some(time)) = (classes(trial.frame), time) {
            let cell = cells.entry(classes).or_default();
            *cell = (cell.0 + time, cell.1 + 1);
        }
    }
    let last = cells
        .keys()
        .map(|&(least, greatest)| least.max(greatest))
        .max()?;
    let means = || cells.values().map(|&(sum, count)| sum / count as f64);
    let lowest = means().fold(f64::INFINITY, f64::min);
    let highest = means().fold(0.0, f64::max);
    if !highest.is_finite() {
        return None;
    }
    let names: Vec<String> = (0..=last).map(class_name).collect();
    let cells = cells
        .iter()
        .zip(means())
        .map(|((&(least, greatest), &(_, count)), mean)| Cell {
            column: least,
            row: greatest,
            rank: if highest > lowest {
                (mean / lowest).ln() / (highest / lowest).ln()
            } else {
                0.0
            },
            label: number::significant(mean, 3),
            title: format!(
                "min_leaf_size {}, max_leaf_size {}: {} over {}",
                names[least],
                names[greatest],
                number::milliseconds(mean),
                number::counted(count, "trial")
            ),
        })
        .collect();
    Some(
        HeatMap {
            size: SIZE,
            title,
            x_label: "min_leaf_size (primitives)",
            y_label: "max_leaf_size (primitives)",
            x_names: &names,
            y_names: &names,
            cells,
        }
        .draw(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;
    use crate::report::page::trials::measured;

    #[test]
    fn classes_double() {
        let classes: Vec<usize> = [1, 2, 3, 4, 5, 8, 9, 32].map(class).to_vec();
        assert_eq!(classes, [0, 1, 2, 2, 3, 3, 4, 5]);
        let names: Vec<String> = (0..4).map(class_name).collect();
        assert_eq!(names, ["1", "2", "3–4", "5–8"]);
    }

    #[test]
    fn a_cell_is_the_mean_of_its_trials() {
        let mut frames = example::run(3).frames;
        for (frame, (least, greatest, render)) in
            frames
                .iter_mut()
                .zip([(1, 3, 10.0), (1, 4, 20.0), (2, 2, 60.0)])
        {
            let sizes = [("min_leaf_size", least), ("max_leaf_size", greatest)];
            frame.config = sizes
                .map(|(name, size)| (name.to_string(), size.to_string()))
                .to_vec();
            frame.render_ms = Some(render);
        }
        let html = section(&measured(&frames));
        assert!(
            html.contains("min_leaf_size 1, max_leaf_size 3–4: 15.0 ms over 2 trials"),
            "{html}"
        );
        assert!(html.contains("min_leaf_size 2, max_leaf_size 2: 60.0 ms over 1 trial"));
        // Two cells in each of two maps, and no more.
        assert_eq!(html.matches("<rect").count(), 4);
    }

    #[test]
    fn the_map_is_a_triangle() {
        let run = example::run(200);
        for trial in measured(&run.frames) {
            let (least, greatest) = classes(trial.frame).unwrap();
            assert!(least <= greatest);
        }
    }

    #[test]
    fn missing_sizes_and_times_are_said() {
        let mut run = example::run(5);
        for frame in &mut run.frames {
            frame.build_ms = None;
        }
        let html = section(&measured(&run.frames));
        assert!(html.contains("There is no mean time to build"));
        for frame in &mut run.frames {
            frame.config.retain(|(name, _)| name != "min_leaf_size");
        }
        let html = section(&measured(&run.frames));
        assert!(html.contains("No trial has both") && !html.contains("<svg"));
    }
}
