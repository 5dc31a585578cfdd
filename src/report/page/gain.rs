//! What tuning gained or lost in seconds, frame by frame, against never having tuned.
//!
//! The reference is a default that was compared at the end: each frame is taken to have cost its
//! median, its tree included as the metric has it, and where the tree serves all frames it is built
//! once, in the first. The account of a frame is what the default would have taken less what the
//! frame took; the sum over the frames is what is shown. It is paid back from the first frame on after
//! which the sum is never again below zero. Not good for runs during which the machine changed its
//! speed: the reference is of the end.

use crate::report::number;
use crate::report::record::{ComparisonRow, RunRecord};
use crate::report::svg::marker::Marker;
use crate::report::svg::xy::{Layer, Mark, Plot, Range};

use super::frames;
use super::plots::{self, WIDE};
use super::verdict::{self, Outcome};

/// Frames against one default.
#[derive(Debug)]
pub(super) struct Account<'a> {
    row: &'a ComparisonRow,
    outcome: Outcome,
    /// Frame, and seconds gained up to its end.
    points: Vec<(f64, f64)>,
    /// The index in `points` from which on nothing is owed; `None` if something is at the end.
    break_even: Option<usize>,
    /// What a frame with the tuned configuration takes less, in seconds, by the fresh comparison.
    gain_per_frame: f64,
}

/// One for each default whose times are known; none if no frame has a time.
pub(super) fn accounts(run: &RunRecord) -> Vec<Account<'_>> {
    let Some((tuned, baselines)) = verdict::comparison(run) else {
        return Vec::new();
    };
    let is_built_once = run.header.metric == "render";
    let mut accounts = Vec::new();
    for row in baselines {
        let first = if is_built_once { row.build_ms.median } else { 0.0 };
        let mut sum = -0.0;
        let mut points = Vec::new();
        for frame in &run.frames {
            if let Some(time) = frames::time(frame) {
                if points.is_empty() {
                    sum += first;
                }
                sum += row.cost_ms.median - time.whole;
                points.push((frame.frame as f64, sum / 1e3));
            }
        }
        if points.is_empty() || !points.iter().all(|point| point.1.is_finite()) {
            continue;
        }
        let owed = points.iter().rposition(|point| point.1 < 0.0);
        let break_even = owed.map_or(0, |last| last + 1);
        accounts.push(Account {
            row,
            outcome: verdict::outcome(tuned, row),
            break_even: (break_even < points.len()).then_some(break_even),
            points,
            gain_per_frame: (row.cost_ratio_to_tuned.median - 1.0) * tuned.cost_ms.median / 1e3,
        });
    }
    accounts
}

/// The accounts over the frames; break-even is a diamond.
pub(super) fn plot(accounts: &[Account<'_>]) -> String {
    let mut layers = vec![Layer::Level {
        name: String::new(),
        class: "plain".to_string(),
        y: 0.0,
        band: (0.0, 0.0),
    }];
    for (index, account) in accounts.iter().enumerate() {
        layers.push(Layer::Line {
            name: format!("against {}", account.row.name),
            class: plots::line_class(index + 1),
            points: account.points.clone(),
        });
    }
    let marks = accounts.iter().enumerate().filter_map(|(index, account)| {
        let (x, y) = account.points[account.break_even?];
        Some(Mark {
            x,
            y,
            class: format!("compared {}", plots::series(index + 1)),
            title: sentence(account),
        })
    });
    layers.push(Layer::Marks {
        name: "break-even".to_string(),
        marker: Marker::Diamond,
        radius: 6.0,
        marks: marks.collect(),
    });
    Plot {
        size: WIDE,
        description: "Accumulated gain or loss against the defaults",
        x_label: "frame",
        y_label: "accumulated gain (s)",
        y_range: Range::Fitted,
        layers,
    }
    .draw()
}

/// Explains the plot; `untimed` frames are left out of it.
pub(super) fn caption(run: &RunRecord, untimed: usize) -> String {
    let mut caption = "What all frames up to each one took less than with a default: above the line \
                       at zero the run is ahead. The default is taken to cost its median of the \
                       comparison in every frame"
        .to_string();
    caption.push_str(if run.header.metric == "render" {
        ", and its tree to be built once."
    } else {
        ", with the share of the build that the metric has."
    });
    if untimed > 0 {
        caption.push_str(&format!(
            " The log does not tell how long {} frames took that failed: they are left out, and \
             the account is too good by them.",
            number::count(untimed)
        ));
    }
    caption
}

/// The account in words.
pub(super) fn sentence(account: &Account<'_>) -> String {
    let frames = number::count(account.points.len());
    let Some(&(_, end)) = account.points.last() else {
        return String::new();
    };
    let size = seconds(end.abs());
    let state = match account.break_even {
        Some(0) => format!("never behind, and {size} ahead after {frames} frames"),
        Some(index) => format!(
            "paid back from frame {} on, and {size} ahead after {frames} frames",
            account.points[index].0
        ),
        None => format!("not yet paid back: {size} behind after {frames} frames"),
    };
    let per_frame = number::milliseconds(account.gain_per_frame.abs() * 1e3);
    let outlook = match (account.outcome, account.break_even) {
        (Outcome::Faster, None) => {
            let more = (-end / account.gain_per_frame).ceil();
            if more.is_finite() && more < 1e9 {
                format!(
                    "; after about {} more frames with the tuned configuration at today's gain of \
                     {per_frame} a frame",
                    number::count(more.max(1.0) as usize)
                )
            } else {
                "; today's gain is too small for it ever to be".to_string()
            }
        }
        (Outcome::Faster, Some(_)) => format!("; today's gain is {per_frame} a frame"),
        (Outcome::Same, None) => {
            "; nor will it be, since the search came back to this default".to_string()
        }
        (Outcome::Slower, _) => format!("; today {per_frame} a frame are lost"),
        (Outcome::Undecided | Outcome::Unknown, None) => {
            "; when it will be cannot be said, as there is no clear gain today".to_string()
        }
        _ => String::new(),
    };
    format!("Against {}: {state}{outlook}.", account.row.name)
}

fn seconds(value: f64) -> String {
    if value < 1.0 {
        number::milliseconds(value * 1e3)
    } else {
        format!("{} s", number::significant(value, 3))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    /// A run by the total metric whose frames took `times`, against a default of 10 ms with `ratio`.
    fn run(times: &[f64], ratio: f64) -> RunRecord {
        let mut run = example::run(times.len());
        run.header.metric = "total".to_string();
        for (frame, &time) in run.frames.iter_mut().zip(times) {
            frame.frame_ms = Some(time);
        }
        let comparison = &mut run.summary.as_mut().unwrap().comparison;
        comparison.truncate(1);
        comparison[0].cost_ms = example::spread(10.0 / ratio, 0.01);
        comparison.push(example::row("base", "1", 10.0, ratio));
        run
    }

    fn told(run: &RunRecord) -> String {
        sentence(&accounts(run)[0])
    }

    #[test]
    fn the_account_is_the_sum_of_the_differences() {
        let run = run(&[14.0, 12.0, 6.0, 5.0, 5.0], 2.0);
        let account = &accounts(&run)[0];
        let gained: Vec<f64> = account.points.iter().map(|point| point.1 * 1e3).collect();
        for (gained, expected) in gained.iter().zip([-4.0, -6.0, -2.0, 3.0, 8.0]) {
            assert!((gained - expected).abs() < 1e-9, "{gained} {expected}");
        }
        assert_eq!(account.break_even, Some(3));
        assert_eq!(
            sentence(account),
            "Against base: paid back from frame 3 on, and 8.00 ms ahead after 5 frames; \
             today's gain is 5.00 ms a frame."
        );
    }

    #[test]
    fn a_second_loss_moves_break_even() {
        let run = run(&[14.0, 1.0, 18.0, 5.0], 2.0);
        assert_eq!(accounts(&run)[0].break_even, Some(3));
    }

    #[test]
    fn what_is_not_paid_back_has_an_outlook() {
        let more = told(&run(&[20.0, 11.0, 10.0], 2.0));
        assert!(more.contains("11.0 ms behind after 3 frames"), "{more}");
        assert!(more.contains("after about 3 more frames"), "{more}");
        let unclear = told(&run(&[20.0], 1.0));
        assert!(unclear.contains("no clear gain"), "{unclear}");
        let worse = told(&run(&[20.0], 0.5));
        assert!(worse.contains("today 10.0 ms a frame are lost"), "{worse}");
        let mut same = run(&[20.0], 1.0);
        let comparison = &mut same.summary.as_mut().unwrap().comparison;
        comparison[1].config = comparison[0].config.clone();
        assert!(told(&same).contains("came back to this default"));
        let never = told(&run(&[5.0, 5.0], 2.0));
        assert!(never.contains("never behind, and 10.0 ms ahead"), "{never}");
    }

    #[test]
    fn a_tree_that_serves_all_frames_is_built_once() {
        let mut run = run(&[10.0, 10.0], 1.0);
        run.header.metric = "render".to_string();
        let build = run.summary.as_ref().unwrap().comparison[1].build_ms.median;
        let account = &accounts(&run)[0];
        assert!((account.points[0].1 * 1e3 - build).abs() < 1e-9);
        assert!((account.points[1].1 * 1e3 - build).abs() < 1e-9);
    }

    #[test]
    fn nothing_is_claimed_without_times_or_a_comparison() {
        let mut run = run(&[10.0], 1.0);
        run.frames[0].frame_ms = Some(f64::NAN);
        run.frames[0].render_ms = None;
        assert!(accounts(&run).is_empty());
        run.frames[0].frame_ms = Some(10.0);
        run.summary.as_mut().unwrap().comparison[1].cost_ms.median = f64::INFINITY;
        assert!(accounts(&run).is_empty());
        run.summary = None;
        assert!(accounts(&run).is_empty());
    }
}
