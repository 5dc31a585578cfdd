//! What the user waited for: the time of every whole frame, and what the frame was used for.
//!
//! A frame is not a trial. In a probed frame most tiles are rendered with the incumbent, so that its
//! time says little about the candidate; here stands the time, with the search the candidate.

use std::ops::Range as Part;

use super::{figure, plots::compared_levels};
use crate::report::number;
use crate::report::record::{ComparisonRow, FrameRecord, RunRecord};
use crate::report::svg::Size;
use crate::report::svg::marker::Marker;
use crate::report::svg::xy::{Column, Layer, Mark, Plot, Range};

const SIZE: Size = Size {
    width: 860.0,
    height: 400.0,
};
/// Columns that a plot has room for; of more frames neighbours share a column.
const MOST_COLUMNS: usize = 400;
/// The axis ends this far above what 95 % of the frames and the baselines take…
const HEADROOM: f64 = 1.25;
/// …if the slowest frame takes more than this many times as long.
const CUT_FROM: f64 = 1.6;

/// What a frame was used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// All of it was rendered with the incumbent, nothing was tried.
    Incumbent,
    /// All of it was rendered with what was tried.
    Trial,
    /// Some tiles were, and the incumbent stayed.
    Probe,
    /// Some tiles were, and what was tried became the incumbent.
    AcceptedProbe,
    /// What was tried could not be built or was given up.
    Failed,
}

impl Kind {
    const ALL: [Self; 5] = [
        Self::Incumbent,
        Self::Trial,
        Self::Probe,
        Self::AcceptedProbe,
        Self::Failed,
    ];

    pub(super) fn of(frame: &FrameRecord) -> Self {
        let decision = frame.probe.as_ref().map(|probe| probe.decision.as_str());
        if frame.failure.is_some() || decision == Some("failed") {
            Self::Failed
        } else if decision == Some("accepted") {
            Self::AcceptedProbe
        } else if decision.is_some() {
            Self::Probe
        } else if is_of_the_incumbent(frame) {
            Self::Incumbent
        } else {
            Self::Trial
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Incumbent => "incumbent alone",
            Self::Trial => "trial",
            Self::Probe => "probe",
            Self::AcceptedProbe => "probe, accepted",
            Self::Failed => "failed trial",
        }
    }

    fn class(self) -> &'static str {
        match self {
            Self::Incumbent => "kind-incumbent",
            Self::Trial => "kind-trial",
            Self::Probe => "kind-probe",
            Self::AcceptedProbe => "kind-accepted",
            Self::Failed => "bad",
        }
    }
}

/// Whether nothing was tried in a frame without a probe. Logs that have no times of whole frames have
/// no such frames: there, no reason means that none was kept.
fn is_of_the_incumbent(frame: &FrameRecord) -> bool {
    match frame.reason.as_deref() {
        Some(reason) => reason == "incumbent",
        None => frame.frame_ms.is_some() && !frame.is_incumbent,
    }
}

/// What the whole frame took: as recorded, or build and render where frames had no other part.
pub(super) fn whole_ms(frame: &FrameRecord) -> Option<f64> {
    let sum = || Some(frame.build_ms? + frame.render_ms?);
    frame
        .frame_ms
        .or_else(sum)
        .filter(|time| time.is_finite() && *time >= 0.0)
}

/// The part of the frame in which a tree was built.
pub(super) fn build_part_ms(frame: &FrameRecord) -> f64 {
    let whole = whole_ms(frame).unwrap_or(0.0);
    let build = frame.build_ms.filter(|time| time.is_finite());
    build.unwrap_or(0.0).clamp(0.0, whole)
}

/// The plot of all frames with its caption; a sentence if no frame left a time.
pub(super) fn section(run: &RunRecord, compared: &[ComparisonRow]) -> String {
    let mut html = "<h2>Frames</h2>\n".to_string();
    let times: Vec<f64> = run.frames.iter().filter_map(whole_ms).collect();
    if times.is_empty() {
        return html + "<p>No frame left the time that it took.</p>\n";
    }
    let total: f64 = times.iter().sum();
    html.push_str(&format!(
        "<p>{} took {}; one took {} on average and {} at most.</p>\n",
        number::counted(times.len(), "frame"),
        number::seconds(total / 1e3),
        number::milliseconds(total / times.len() as f64),
        number::milliseconds(times.iter().copied().fold(0.0, f64::max)),
    ));
    let per_column = run.frames.len().div_ceil(MOST_COLUMNS);
    let most = axis_end(&times, compared);
    html.push_str(&figure(
        &timeline(run, compared, per_column, most),
        &caption(run, compared, per_column, most.is_finite()),
    ));
    html
}

/// Where the axis ends; infinite if it shows everything.
fn axis_end(times: &[f64], compared: &[ComparisonRow]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted[(sorted.len() - 1) * 95 / 100];
    let base = compared
        .iter()
        .map(|row| row.cost_ms.upper)
        .filter(|time| time.is_finite())
        .fold(usual, f64::max);
    if base > 0.0 && sorted[sorted.len() - 1] > CUT_FROM * base {
        HEADROOM * base
    } else {
        f64::INFINITY
    }
}

/// Means of neighbours that share a column.
struct Group {
    middle: f64,
    build: f64,
    whole: f64,
    kind: Kind,
    title: String,
}

fn group(frames: &[FrameRecord]) -> Option<Group> {
    let timed: Vec<(&FrameRecord, f64)> = frames
        .iter()
        .filter_map(|frame| Some((frame, whole_ms(frame)?)))
        .collect();
    let (&(first, _), &(last, _)) = (timed.first()?, timed.last()?);
    let count = timed.len() as f64;
    let whole = timed.iter().map(|(_, whole)| whole).sum::<f64>() / count;
    let builds = timed.iter().map(|(frame, _)| build_part_ms(frame));
    let build = builds.sum::<f64>() / count;
    let often = |kind: Kind| {
        let of_kind = timed.iter().filter(|(frame, _)| Kind::of(frame) == kind);
        of_kind.count()
    };
    let kind = Kind::ALL.into_iter().max_by_key(|&kind| often(kind))?;
    let times = format!(
        "{}, of it build {}",
        number::milliseconds(whole),
        number::milliseconds(build)
    );
    let title = if first.frame == last.frame {
        format!("whole frame {}: {times}\n{}", first.frame, kind.name())
    } else {
        format!("frames {} to {}: mean {times}", first.frame, last.frame)
    };
    Some(Group {
        middle: 0.5 * (first.frame + last.frame) as f64,
        build,
        whole,
        kind,
        title,
    })
}

fn timeline(run: &RunRecord, compared: &[ComparisonRow], per_column: usize, most: f64) -> String {
    let groups: Vec<Group> = run.frames.chunks(per_column).filter_map(group).collect();
    let columns = |name: &str, class, part: &dyn Fn(&Group) -> Option<Part<f64>>| {
        let columns = groups.iter().filter_map(|group| {
            let part = part(group)?;
            Some(Column {
                x: group.middle,
                from: part.start,
                to: part.end,
                title: group.title.clone(),
            })
        });
        Layer::Columns {
            name: name.to_string(),
            class,
            width: per_column as f64,
            columns: columns.collect(),
        }
    };
    let mut layers = vec![columns("build", "kind-build", &|group| {
        (group.build > 0.0).then_some(0.0..group.build)
    })];
    for kind in Kind::ALL {
        layers.push(columns(kind.name(), kind.class(), &|group| {
            (group.kind == kind).then_some(group.build..group.whole)
        }));
    }
    layers.extend(compared_levels(compared));
    layers.push(Layer::Steps {
        name: "cost of the incumbent".to_string(),
        class: "incumbent",
        points: run
            .frames
            .iter()
            .filter_map(|frame| Some((frame.frame as f64, frame.incumbent_cost_ms?)))
            .collect(),
    });
    let incumbents = run.frames.iter().filter(|frame| frame.is_incumbent);
    layers.push(Layer::Marks {
        name: "new incumbent".to_string(),
        marker: Marker::Diamond,
        radius: 4.0,
        marks: incumbents
            .filter_map(|frame| {
                Some(Mark {
                    x: frame.frame as f64,
                    y: frame.incumbent_cost_ms?,
                    class: "incumbent".to_string(),
                    title: format!("new incumbent in frame {}", frame.frame),
                })
            })
            .collect(),
    });
    let untimed = run.frames.iter().filter(|frame| whole_ms(frame).is_none());
    layers.push(Layer::Absences {
        name: "no time".to_string(),
        places: untimed
            .step_by(per_column)
            .map(|frame| {
                let title = format!("whole frame {} left no time", frame.frame);
                (frame.frame as f64, title)
            })
            .collect(),
    });
    Plot {
        size: SIZE,
        description: "Time of every whole frame",
        x_label: "frame",
        y_label: "time (ms)",
        y_range: Range::FromZero(most),
        layers,
    }
    .draw()
}

fn caption(run: &RunRecord, compared: &[ComparisonRow], per_column: usize, is_cut: bool) -> String {
    let mut caption = if per_column == 1 {
        "Each column is one frame from its beginning to its end, its lower part the building of a \
         tree"
            .to_string()
    } else {
        format!(
            "Each column is the mean of {per_column} frames, its lower part the building of trees; \
             its colour is what most of them were used for"
        )
    };
    if is_cut {
        caption.push_str("; columns that reach beyond the plot bear a triangle");
    }
    if !compared.is_empty() {
        caption.push_str(
            "; horizontal lines are the costs of the compared configurations, measured at the end",
        );
    }
    caption.push('.');
    if run.header.metric == "render" {
        caption.push_str(
            " Costs are times to render, without a build: with one tree for all frames there is \
             none.",
        );
    }
    caption
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn the_time_of_a_frame_is_the_recorded_one_or_the_sum() {
        let mut frame = example::frame(0);
        (frame.build_ms, frame.render_ms) = (Some(2.0), Some(3.0));
        assert_eq!(whole_ms(&frame), Some(5.0));
        frame.frame_ms = Some(4.0);
        assert_eq!(whole_ms(&frame), Some(4.0));
        assert_eq!(build_part_ms(&frame), 2.0);
        // A build in the background may take longer than the frame.
        frame.build_ms = Some(9.0);
        assert_eq!(build_part_ms(&frame), 4.0);
        for none in [f64::NAN, f64::INFINITY, -1.0] {
            frame.frame_ms = Some(none);
            assert_eq!(whole_ms(&frame), None);
        }
        (frame.frame_ms, frame.build_ms) = (None, None);
        assert_eq!(whole_ms(&frame), None);
    }

    #[test]
    fn frames_are_told_apart_by_their_use() {
        let frames = example::probed(60).frames;
        for kind in [
            Kind::Incumbent,
            Kind::Probe,
            Kind::AcceptedProbe,
            Kind::Failed,
        ] {
            let found = frames.iter().any(|frame| Kind::of(frame) == kind);
            assert!(found, "{kind:?}");
        }
        assert_eq!(Kind::of(&example::frame(0)), Kind::Trial);
        let mut alone = FrameRecord {
            frame_ms: Some(40.0),
            cost_ms: None,
            ..example::frame(0)
        };
        assert_eq!(Kind::of(&alone), Kind::Incumbent);
        alone.reason = Some("start".to_string());
        assert_eq!(Kind::of(&alone), Kind::Trial);
        (alone.reason, alone.is_incumbent) = (None, true);
        assert_eq!(Kind::of(&alone), Kind::Trial, "the first of all");
        assert_eq!(Kind::of(&example::frame(11)), Kind::Failed);
    }

    #[test]
    fn every_frame_has_a_column_until_there_are_too_many() {
        let run = example::run(40);
        let html = section(&run, &[]);
        let timed = run.frames.iter().filter(|frame| whole_ms(frame).is_some());
        for frame in timed {
            assert!(html.contains(&format!("whole frame {}: ", frame.frame)));
        }
        let html = section(&example::run(4001), &[]);
        assert!(html.contains("mean of 11 frames"));
        assert!(html.matches("<rect").count() <= 2 * MOST_COLUMNS + 10);
    }

    #[test]
    fn one_slow_frame_does_not_flatten_the_others() {
        let mut run = example::run(40);
        assert!(!section(&run, &[]).contains("triangle"));
        run.frames[3].frame_ms = Some(1e5);
        assert!(section(&run, &[]).contains("bear a triangle"));
    }

    #[test]
    fn without_times_there_is_a_sentence() {
        let mut run = example::run(3);
        for frame in &mut run.frames {
            frame.render_ms = None;
        }
        let html = section(&run, &[]);
        assert!(html.contains("No frame left") && !html.contains("<svg"));
    }
}
