//! What the frames of a run were, and how long each took: the timeline.
//!
//! Times are those of whole frames, since a user waits for frames, not for trials. A frame is a
//! *trial* if one configuration rendered all of it, a *probe* if a candidate was tried on some of its
//! tiles, *alone* if nothing was tried beside the incumbent, or *failed*. Frames are put together in
//! columns of equally many where there are more of them than the plot can tell apart.

use crate::report::number;
use crate::report::record::{ComparisonRow, FrameRecord};
use crate::report::svg::xy::{Column, Layer, Plot, Range};

use super::plots::{self, WIDE};

/// More columns would be narrower than two pixels.
const MOST_COLUMNS: usize = 400;
/// Columns are cut beyond so many times what most frames or the defaults take.
const CUT: f64 = 2.5;

/// What a frame was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// All of it was rendered with the configuration that was tried.
    Trial,
    /// The incumbent rendered it, and a candidate some of its tiles.
    Probe,
    /// Nothing was tried.
    Alone,
    /// What was tried could not be built, or was given up.
    Failed,
}

impl Kind {
    /// In the order in which a column stacks them, with their colours.
    const STACKED: [(Kind, &'static str, &'static str); 4] = [
        (Kind::Alone, "incumbent alone", "plain"),
        (Kind::Probe, "with a probe", "s3"),
        (Kind::Trial, "trial of a whole frame", "s0"),
        (Kind::Failed, "with a failure", "bad"),
    ];
}

/// The kind of a frame.
pub(super) fn kind(frame: &FrameRecord) -> Kind {
    let is_asked = frame
        .reason
        .as_ref()
        .is_some_and(|reason| reason != "incumbent");
    let probe = frame.probe.as_ref();
    if frame.failure.is_some() || probe.is_some_and(|probe| probe.decision == "failed") {
        Kind::Failed
    } else if probe.is_some() {
        Kind::Probe
    } else if frame.frame_ms.is_some() && !is_asked && !frame.is_incumbent {
        Kind::Alone
    } else if frame.cost_ms.is_none_or(|cost| !cost.is_finite()) {
        Kind::Failed
    } else {
        Kind::Trial
    }
}

/// How long a frame took, in milliseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FrameTime {
    /// Build and everything.
    pub(super) whole: f64,
    /// Its part in which trees were built, as far as is known.
    pub(super) build: f64,
}

/// `None` if the log does not tell, as of failures in logs of earlier versions.
pub(super) fn time(frame: &FrameRecord) -> Option<FrameTime> {
    let both = frame
        .build_ms
        .zip(frame.render_ms)
        .map(|(build, render)| build + render);
    let whole = frame.frame_ms.or(both).filter(|time| time.is_finite())?;
    let build = frame.build_ms.filter(|time| time.is_finite());
    Some(FrameTime {
        whole,
        build: build.unwrap_or(0.0).min(whole),
    })
}

/// Time of every frame, what it was, the incumbent's cost and the defaults; `None` if no frame has a
/// time.
pub(super) fn timeline(frames: &[FrameRecord], compared: &[ComparisonRow]) -> Option<String> {
    let together = frames.len().div_ceil(MOST_COLUMNS).max(1);
    let groups: Vec<Group> = frames.chunks(together).filter_map(Group::of).collect();
    let mut wholes: Vec<f64> = groups.iter().map(|group| group.whole).collect();
    wholes.sort_by(f64::total_cmp);
    let most = *wholes.last()?;
    let baselines = compared.get(1..).unwrap_or_default();
    let usual = baselines
        .iter()
        .map(|row| row.cost_ms.median)
        .filter(|median| median.is_finite())
        .fold(wholes[(wholes.len() - 1) * 3 / 4], f64::max);
    let cut = if most > CUT * usual {
        CUT * usual
    } else {
        most
    };

    let mut layers = vec![Layer::Columns {
        name: "building trees".to_string(),
        class: "build",
        width: together as f64,
        columns: groups
            .iter()
            .filter(|group| group.build > 0.0)
            .map(|group| group.column(0.0, group.build))
            .collect(),
    }];
    for (index, (_, name, class)) in Kind::STACKED.into_iter().enumerate() {
        let columns = groups.iter().filter_map(|group| {
            let below: f64 = group.build + group.rest[..index].iter().sum::<f64>();
            let part = group.rest[index];
            (part > 0.0).then(|| group.column(below, below + part))
        });
        layers.push(Layer::Columns {
            name: name.to_string(),
            class,
            width: together as f64,
            columns: columns.collect(),
        });
    }
    layers.extend(plots::levels(compared).into_iter().skip(1));
    layers.push(Layer::Steps {
        name: "cost of the incumbent".to_string(),
        class: "incumbent",
        points: frames
            .iter()
            .filter_map(|frame| Some((frame.frame as f64, frame.incumbent_cost_ms?)))
            .collect(),
    });
    let untimed = frames.iter().filter(|frame| time(frame).is_none());
    layers.push(Layer::Absences {
        name: "failed, time not known".to_string(),
        places: untimed
            .map(|frame| (frame.frame as f64, format!("frame {}", frame.frame)))
            .collect(),
    });
    let plot = Plot {
        size: WIDE,
        description: "Time of every frame",
        x_label: "frame",
        y_label: "time of the frame (ms)",
        y_range: Range::FromZero(cut),
        layers,
    };
    Some(plot.draw())
}

/// Explains what is in the timeline and nothing that is not.
pub(super) fn caption(frames: &[FrameRecord], compared: &[ComparisonRow]) -> String {
    let together = frames.len().div_ceil(MOST_COLUMNS);
    let mut caption = if together > 1 {
        format!("Each column is the mean of {together} frames")
    } else {
        "Each column is one frame".to_string()
    };
    caption.push_str(", build and everything, with the building of trees at its foot");
    if compared.len() > 1 {
        caption.push_str(
            "; horizontal lines are frames with the defaults, measured at the end, with their \
             quartiles as bands",
        );
    }
    caption.push_str(
        "; the stepped line is what a frame with the incumbent costs by the metric. A column that \
         ends in a triangle is longer than is shown.",
    );
    caption
}

/// Frames that share a column, as means over them.
struct Group {
    first: usize,
    last: usize,
    whole: f64,
    build: f64,
    /// What is not build, by kind.
    rest: [f64; Kind::STACKED.len()],
    title: String,
}

impl Group {
    fn of(frames: &[FrameRecord]) -> Option<Group> {
        let timed: Vec<(&FrameRecord, FrameTime)> = frames
            .iter()
            .filter_map(|frame| Some((frame, time(frame)?)))
            .collect();
        let (first, last) = (timed.first()?.0, timed.last()?.0);
        let share = 1.0 / timed.len() as f64;
        let mut group = Group {
            first: first.frame,
            last: last.frame,
            whole: 0.0,
            build: 0.0,
            rest: [0.0; Kind::STACKED.len()],
            title: String::new(),
        };
        for (frame, time) in &timed {
            let kind = kind(frame);
            group.whole += share * time.whole;
            group.build += share * time.build;
            for (rest, (stacked, ..)) in group.rest.iter_mut().zip(Kind::STACKED) {
                if stacked == kind {
                    *rest += share * (time.whole - time.build);
                }
            }
        }
        let frames = match timed.len() {
            1 => format!("frame {}", group.first),
            _ => format!("frames {} to {}, mean", group.first, group.last),
        };
        group.title = format!(
            "{frames}: {}, of which building {}",
            number::milliseconds(group.whole),
            number::milliseconds(group.build)
        );
        if let (1, Some(reason)) = (timed.len(), &first.reason) {
            group.title.push_str(&format!("\n{reason}"));
        }
        Some(group)
    }

    fn column(&self, from: f64, to: f64) -> Column {
        Column {
            x: 0.5 * (self.first + self.last) as f64,
            from,
            to,
            title: self.title.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn the_kinds_of_frames_are_told_apart() {
        let mut frame = example::frame(0);
        assert_eq!(kind(&frame), Kind::Trial);
        frame.frame_ms = Some(50.0);
        assert_eq!(kind(&frame), Kind::Alone);
        frame.cost_ms = None;
        assert_eq!(kind(&frame), Kind::Alone, "an incumbent need not be told");
        frame.reason = Some("start".to_string());
        assert_eq!(kind(&frame), Kind::Failed);
        frame.cost_ms = Some(40.0);
        assert_eq!(kind(&frame), Kind::Trial);
        frame.probe = Some(example::probe(0.9, "accepted"));
        assert_eq!(kind(&frame), Kind::Probe);
        frame.failure = Some("too deep".to_string());
        assert_eq!(kind(&frame), Kind::Failed);
    }

    #[test]
    fn a_frame_without_its_own_time_took_build_and_render() {
        let mut frame = example::frame(0);
        (frame.build_ms, frame.render_ms) = (Some(5.0), Some(30.0));
        let old = time(&frame).unwrap();
        assert_eq!((old.whole, old.build), (35.0, 5.0));
        frame.frame_ms = Some(33.0);
        assert_eq!(time(&frame).unwrap().whole, 33.0);
        frame.build_ms = Some(99.0);
        assert_eq!(time(&frame).unwrap().build, 33.0);
        (frame.frame_ms, frame.render_ms) = (None, None);
        assert_eq!(time(&frame), None);
    }

    #[test]
    fn a_column_is_as_high_as_its_parts() {
        let frames = example::probed(30).frames;
        let group = Group::of(&frames).unwrap();
        let parts = group.build + group.rest.iter().sum::<f64>();
        assert!((parts - group.whole).abs() < 1e-9 * group.whole);
        assert!(group.title.starts_with("frames 0 to 29, mean"));
    }

    #[test]
    fn many_frames_share_columns() {
        let run = example::probed(5_000);
        let compared = run.summary.unwrap().comparison;
        let drawn = timeline(&run.frames, &compared).unwrap();
        let columns = drawn.matches("class=\"fill build\"").count();
        assert!((100..=MOST_COLUMNS + 1).contains(&columns), "{columns}");
        assert!(caption(&run.frames, &compared).contains("mean of 13 frames"));
    }

    #[test]
    fn no_times_are_no_plot() {
        assert_eq!(timeline(&[], &[]), None);
        assert_eq!(timeline(&[example::frame(11)], &[]), None);
    }
}
