//! What the run gained or lost so far, against each baseline: trials cost time before they pay.
//!
//! The reference of a frame is the median cost of the baseline in the comparison at the end; a
//! baseline whose cost has no build is charged one, before the first frame. Frames without a time
//! are in neither sum. Break-even is the frame after which the run stays ahead. Poor if the machine
//! changed its speed before the end, which is said where the tuned configuration shows it.

use super::verdict::{Outcome, comparison, outcome};
use super::{figure, frames::whole_ms};
use crate::report::markup::escape;
use crate::report::number;
use crate::report::record::{ComparisonRow, FrameRecord, RunRecord};
use crate::report::svg::Size;
use crate::report::svg::marker::Marker;
use crate::report::svg::xy::{Layer, Mark, Plot, Range};

const SIZE: Size = Size {
    width: 860.0,
    height: 320.0,
};
/// The classes of the baselines: those which they have in the comparison, behind the tuned row.
const CLASSES: [&str; 3] = ["s1", "s2", "s3"];

/// The tuned configuration at the end over its cost in the search: beyond this factor, in either
/// direction, the machine has changed. The winner's curse alone is less.
const DRIFT: f64 = 1.15;

/// Gain over the frames of a run.
#[derive(Clone, Debug, PartialEq)]
struct Gain {
    /// Seconds before the first frame.
    start: f64,
    /// Frames done, and seconds gained until then.
    sums: Vec<(f64, f64)>,
    standing: Standing,
}

/// Where a run stands against a baseline.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Standing {
    /// Ahead in the end, and since so many frames were done.
    Ahead { since: usize },
    /// Behind in the end.
    Behind,
}

impl Gain {
    /// The point after which the run stays ahead; `None` if it was never behind, or still is.
    fn break_even(&self) -> Option<(f64, f64)> {
        let Standing::Ahead { since } = self.standing else {
            return None;
        };
        let mut after = self.sums.iter().filter(|(done, _)| *done >= since as f64);
        (since > 1).then(|| after.next().copied())?
    }
}

fn gain(frames: &[FrameRecord], reference_ms: f64, first_build_ms: f64) -> Gain {
    let start = first_build_ms / 1e3;
    let mut sum = start;
    let mut sums = Vec::new();
    let mut since = 1;
    for (index, frame) in frames.iter().enumerate() {
        let Some(whole) = whole_ms(frame) else {
            continue;
        };
        sum += (reference_ms - whole) / 1e3;
        let done = index + 1;
        sums.push((done as f64, sum));
        if sum < 0.0 {
            since = done + 1;
        }
    }
    let standing = if sum < 0.0 {
        Standing::Behind
    } else {
        Standing::Ahead { since }
    };
    Gain {
        start,
        sums,
        standing,
    }
}

/// The gains against `row`; `None` if its cost is no number or no frame left a time.
fn gain_against(run: &RunRecord, row: &ComparisonRow) -> Option<Gain> {
    let first_build = match run.header.metric.as_str() {
        "render" => row.build_ms.median,
        _ => 0.0,
    };
    let gain = gain(&run.frames, row.cost_ms.median, first_build);
    let known = gain.sums.last()?.1.is_finite();
    known.then_some(gain)
}

/// Plot and sentences; a sentence alone if there is nothing to compare.
pub(super) fn section(run: &RunRecord) -> String {
    let mut html = "<h2>Gain or loss so far</h2>\n".to_string();
    let Some((tuned, baselines)) = comparison(run).filter(|(_, rows)| !rows.is_empty()) else {
        return html
            + "<p>Without a comparison there is no reference: what the search cost or gained in \
               seconds is not known.</p>\n";
    };
    let gains: Vec<(usize, &ComparisonRow, Gain)> = baselines
        .iter()
        .enumerate()
        .filter_map(|(index, row)| Some((index, row, gain_against(run, row)?)))
        .collect();
    if gains.is_empty() {
        return html
            + "<p>No frame left the time that it took, or the baselines left none: nothing can be \
               added up.</p>\n";
    }
    for (_, row, gain) in &gains {
        let sentence = sentence(tuned, row, gain);
        html.push_str(&format!("<p>{}</p>\n", escape(&sentence)));
    }
    if let Some(warning) = drift(run, tuned) {
        html.push_str(&format!("<p class=\"caveat\">{}</p>\n", escape(&warning)));
    }
    let untimed = run.frames.iter().filter(|frame| whole_ms(frame).is_none());
    let remark = match untimed.count() {
        0 => String::new(),
        count => format!(
            " {} left no time and {} missing: the true loss is greater by what they took.",
            number::counted(count, "frame"),
            if count == 1 { "is" } else { "are" }
        ),
    };
    let has_break_even = gains.iter().any(|(_, _, gain)| gain.break_even().is_some());
    html.push_str(&figure(
        &plot(&gains),
        &format!(
            "Time that the same number of frames would have taken with the baseline, less the time \
             that the run took, builds and failures included: above zero the run is ahead.{}{remark}",
            if has_break_even {
                " Diamonds mark break-even, after which it stays ahead."
            } else {
                ""
            }
        ),
    ));
    html
}

/// A warning if the references are of a machine that had another speed than in the search.
fn drift(run: &RunRecord, tuned: &ComparisonRow) -> Option<String> {
    let in_search = run
        .frames
        .iter()
        .rev()
        .find_map(|frame| frame.incumbent_cost_ms)?;
    let ratio = tuned.cost_ms.median / in_search;
    if !ratio.is_finite() {
        return None;
    }
    let (comparative, consequence) = if ratio > DRIFT {
        ("slower", "flatters")
    } else if ratio < 1.0 / DRIFT {
        ("faster", "belittles")
    } else {
        return None;
    };
    Some(format!(
        "At the end the tuned configuration cost {} × what it had cost in the search. The machine \
         was probably {comparative} then, for the baselines too, which {consequence} the sums.",
        number::ratio(ratio)
    ))
}

/// The standing against a baseline in words.
fn sentence(tuned: &ComparisonRow, row: &ComparisonRow, gain: &Gain) -> String {
    let Some(&(done, sum)) = gain.sums.last() else {
        return String::new();
    };
    let name = &row.name;
    let frames = number::counted(done as usize, "frame");
    match gain.standing {
        Standing::Ahead { since } => {
            let when = if since <= 1 {
                "ahead from the first frame on".to_string()
            } else {
                format!("break-even after {} frames", number::count(since))
            };
            format!(
                "Against {name}: {} gained in {frames}; {when}.",
                number::seconds(sum)
            )
        }
        Standing::Behind => format!(
            "Against {name}: {} lost in {frames}; break-even {}.",
            number::seconds(-sum),
            not_yet(tuned, row, -sum)
        ),
    }
}

/// When a loss of `behind` seconds will be made up, if ever.
fn not_yet(tuned: &ComparisonRow, row: &ComparisonRow, behind: f64) -> String {
    match outcome(tuned, row) {
        Outcome::Faster => {
            let ratio = row.cost_ratio_to_tuned;
            let gain = |ratio: f64| tuned.cost_ms.median * (ratio - 1.0) / 1e3;
            let more = |ratio: f64| (behind / gain(ratio)).ceil();
            let frames = more(ratio.median);
            if !frames.is_finite() || frames > 1e9 {
                return "not yet, nor at any time that could be told".into();
            }
            format!(
                "not yet: after about {} more frames at today's gain of {} per frame, if nothing \
                 more is tried ({} to {} by the quartiles)",
                number::count(frames as usize),
                number::milliseconds(1e3 * gain(ratio.median)),
                number::brief(more(ratio.upper), 3),
                number::brief(more(ratio.lower), 3),
            )
        }
        Outcome::Slower => "not at today's costs, since the tuned configuration is slower".into(),
        Outcome::Undecided => {
            "not yet, and not to be foretold, since no difference is clear today".into()
        }
        Outcome::Same => "is out of reach, since the search found the baseline again".into(),
        Outcome::Unknown => "is not known, since no ratio could be formed".into(),
    }
}

fn plot(gains: &[(usize, &ComparisonRow, Gain)]) -> String {
    let mut layers = vec![Layer::Level {
        name: String::new(),
        class: "incumbent".to_string(),
        y: 0.0,
        band: (0.0, 0.0),
    }];
    for (index, row, gain) in gains {
        let class = CLASSES[index % CLASSES.len()];
        layers.push(Layer::Line {
            name: format!("against {}", row.name),
            class,
            points: std::iter::once((0.0, gain.start))
                .chain(gain.sums.iter().copied())
                .collect(),
        });
        if let Some((x, y)) = gain.break_even() {
            layers.push(Layer::Marks {
                name: String::new(),
                marker: Marker::Diamond,
                radius: 6.0,
                marks: vec![Mark {
                    x,
                    y,
                    class: format!("compared {class}"),
                    title: format!("ahead of {} after {x} frames", row.name),
                }],
            });
        }
    }
    Plot {
        size: SIZE,
        description: "Seconds gained or lost over the frames",
        x_label: "frames done",
        y_label: "gain (s)",
        y_range: Range::Fitted,
        layers,
    }
    .draw()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    /// Frames that take these times.
    fn frames(times: &[f64]) -> Vec<FrameRecord> {
        let frame = |(index, &time)| FrameRecord {
            frame_ms: Some(time),
            ..example::frame(index)
        };
        times.iter().enumerate().map(frame).collect()
    }

    #[test]
    fn sums_and_break_even_of_a_known_run() {
        let found = gain(&frames(&[30.0, 10.0, 5.0, 5.0, 5.0]), 10.0, 0.0);
        let sums: Vec<f64> = found.sums.iter().map(|sum| (sum.1 * 1e3).round()).collect();
        assert_eq!(sums, [-20.0, -20.0, -15.0, -10.0, -5.0]);
        assert_eq!(found.standing, Standing::Behind);
        let found = gain(&frames(&[12.0, 9.0, 5.0, 30.0, 0.0, 0.0]), 10.0, 0.0);
        // Ahead after the third frame, but not for long.
        assert_eq!(found.standing, Standing::Ahead { since: 6 });
        let found = gain(&frames(&[12.0, 9.0]), 10.0, 2.0);
        assert_eq!(found.standing, Standing::Ahead { since: 1 });
    }

    #[test]
    fn a_frame_without_time_is_in_neither_sum() {
        let mut some = frames(&[20.0, 0.0, 5.0]);
        (some[1].frame_ms, some[1].build_ms) = (None, None);
        let found = gain(&some, 10.0, 0.0);
        assert_eq!(found.sums.len(), 2);
        assert!((found.sums[1].1 + 0.005).abs() < 1e-12);
    }

    fn run_with(times: &[f64], ratio: f64) -> RunRecord {
        let mut run = example::run(0);
        run.frames = frames(times);
        run.header.metric = "total".to_string();
        let comparison = &mut run.summary.as_mut().unwrap().comparison;
        comparison.truncate(1);
        comparison[0].cost_ms = example::spread(10.0, 0.0);
        let mut weak = example::row("weak", "1", 10.0 * ratio, ratio);
        // Example rows differ from the tuned one by their quality only.
        weak.config[0].1 = "another".to_string();
        comparison.push(weak);
        run
    }

    #[test]
    fn break_even_is_told_or_foretold() {
        // The baseline takes 20 ms: 30 ms are lost in the first frame, 10 gained in each other.
        let html = section(&run_with(&[50.0, 10.0, 10.0, 10.0, 10.0], 2.0));
        assert!(html.contains("break-even after 4 frames."), "{html}");
        assert!(html.contains("<title>ahead of weak after 4 frames"));
        let html = section(&run_with(&[50.0, 10.0], 2.0));
        assert!(html.contains("20.0 ms lost in 2 frames"), "{html}");
        let told = "not yet: after about 2 more frames at today&#39;s gain of 10.0 ms";
        assert!(html.contains(told), "{html}");
        let html = section(&run_with(&[50.0], 0.9));
        assert!(html.contains("not at today&#39;s costs"), "{html}");
        let html = section(&run_with(&[50.0], 1.001));
        assert!(html.contains("not to be foretold"), "{html}");
    }

    #[test]
    fn a_tree_for_all_frames_has_to_be_built_once_with_the_baseline_too() {
        let mut run = run_with(&[21.0], 2.0);
        assert!(section(&run).contains("1.00 ms lost"));
        run.header.metric = "render".to_string();
        // 24 ms of build.
        let html = section(&run);
        assert!(html.contains("23.0 ms gained"), "{html}");
    }

    #[test]
    fn a_machine_that_changed_is_told() {
        let mut run = run_with(&[20.0], 2.0);
        for (in_search, said) in [
            (
                5.0,
                Some("2.00 × what it had cost in the search. The machine was probably slower"),
            ),
            (9.5, None),
            (20.0, Some("probably faster")),
            (0.0, None),
            (f64::NAN, None),
        ] {
            run.frames[0].incumbent_cost_ms = Some(in_search);
            let html = section(&run);
            assert_eq!(html.contains("caveat"), said.is_some(), "{in_search}");
            assert!(said.is_none_or(|said| html.contains(said)), "{html}");
        }
    }

    #[test]
    fn what_is_missing_is_said() {
        let mut run = example::run(20);
        assert!(section(&run).contains("1 frame left no time and is missing"));
        run.summary = None;
        let html = section(&run);
        assert!(html.contains("no reference") && !html.contains("<svg"));
        assert!(!section(&example::run(0)).contains("<svg"));
        assert!(!section(&run_with(&[1.0], f64::NAN)).contains("<svg"));
    }
}
