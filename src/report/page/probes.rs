//! Probes: candidates that were compared with the incumbent on some tiles of a frame.
//!
//! The plot has the ratio of every probe with its bounds and what was decided; the sentences say how
//! many were turned down, and what trying them took. A frame with ratio ρ and share s of the
//! candidate's tiles took 1 − s + s ρ times what it takes with the incumbent: the difference, and
//! the builds, are what probes cost.

use crate::report::number;
use crate::report::record::{FrameRecord, ProbeRecord};
use crate::report::svg::marker::Marker;
use crate::report::svg::xy::{Interval, Layer, Plot, Range};

use super::frames;
use super::plots::{self, WIDE};

/// More intervals than this cannot be told apart.
const MOST_SHOWN: usize = 800;

/// What can be decided, how it is drawn.
const DECISIONS: [(&str, &str, Marker); 4] = [
    ("rejected", "s1", Marker::Triangle),
    ("undecided", "plain", Marker::Circle),
    ("given up", "s3", Marker::Square),
    ("accepted", "s2", Marker::Diamond),
];

/// The probes of a run with their frames.
pub(super) fn probes(frames: &[FrameRecord]) -> Vec<(&FrameRecord, &ProbeRecord)> {
    frames
        .iter()
        .filter_map(|frame| Some((frame, frame.probe.as_ref()?)))
        .collect()
}

/// Ratios with bounds over the frames; `None` if no probe has a ratio.
pub(super) fn plot(probes: &[(&FrameRecord, &ProbeRecord)]) -> Option<String> {
    let with_ratio: Vec<_> = probes
        .iter()
        .filter(|(_, probe)| probe.ratio.is_finite() && probe.ratio > 0.0)
        .collect();
    if with_ratio.is_empty() {
        return None;
    }
    let mut layers = vec![Layer::Level {
        name: "as fast as the incumbent".to_string(),
        class: "incumbent".to_string(),
        y: 1.0,
        band: (1.0, 1.0),
    }];
    for (decision, class, marker) in DECISIONS {
        let of_kind: Vec<_> = with_ratio
            .iter()
            .filter(|(_, probe)| decision_of(probe) == decision)
            .collect();
        layers.push(Layer::Intervals {
            name: decision.to_string(),
            class,
            marker,
            intervals: plots::thinned(&of_kind, MOST_SHOWN)
                .map(|(frame, probe)| interval(frame, probe))
                .collect(),
        });
    }
    let plot = Plot {
        size: WIDE,
        description: "Ratio of every probe with its bounds",
        x_label: "frame",
        y_label: "render time, candidate ÷ incumbent",
        y_range: Range::Fitted,
        layers,
    };
    Some(plot.draw())
}

/// Explains the plot.
pub(super) fn caption(probes: &[(&FrameRecord, &ProbeRecord)]) -> String {
    let mut caption = "Each mark is one candidate beside the incumbent of its frame, as the mean of \
                       pairs of tiles, with one-sided bounds at 95 %; a line that reaches the edge \
                       has no bound there. Below 1 the candidate renders faster."
        .to_string();
    if probes.len() > MOST_SHOWN {
        caption.push_str(" Of each decision only some are drawn, evenly spread over the run.");
    }
    caption
}

/// How many were turned down, and what they cost.
pub(super) fn sentences(probes: &[(&FrameRecord, &ProbeRecord)]) -> Vec<String> {
    let all = probes.len();
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for (_, probe) in probes {
        match counts.iter_mut().find(|known| known.0 == probe.decision) {
            Some(known) => known.1 += 1,
            None => counts.push((&probe.decision, 1)),
        }
    }
    counts.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
    let clauses: Vec<String> = counts
        .iter()
        .map(|(decision, count)| {
            let percent = 100.0 * *count as f64 / all as f64;
            format!("{decision} {} ({percent:.0} %)", number::count(*count))
        })
        .collect();
    let word = if all == 1 { "probe" } else { "probes" };
    let mut sentences = vec![format!(
        "{} {word}: {}.",
        number::count(all),
        clauses.join(", ")
    )];

    let builds: f64 = probes
        .iter()
        .filter_map(|(frame, _)| frame.build_ms)
        .filter(|build| build.is_finite())
        .sum();
    let longer: f64 = probes
        .iter()
        .filter_map(|(frame, probe)| extra_ms(frame, probe))
        .sum();
    let mut shares: Vec<f64> = probes.iter().map(|(_, probe)| probe.share).collect();
    shares.sort_by(f64::total_cmp);
    let median = shares.get(shares.len() / 2).copied().unwrap_or(f64::NAN);
    sentences.push(format!(
        "They cost {} of building, and their tiles took {} {} than with the incumbent. The median \
         probe had {} % of the tiles of its frame.",
        number::milliseconds(builds),
        number::milliseconds(longer.abs()),
        if longer < 0.0 { "less" } else { "more" },
        number::brief(100.0 * median, 3),
    ));
    sentences
}

/// What a frame took more to render than with the incumbent alone; negative if less.
fn extra_ms(frame: &FrameRecord, probe: &ProbeRecord) -> Option<f64> {
    let time = frames::time(frame)?;
    let excess = probe.share * (probe.ratio - 1.0);
    let extra = (time.whole - time.build) * excess / (1.0 + excess);
    extra.is_finite().then_some(extra)
}

/// Unknown words are drawn as undecided.
fn decision_of(probe: &ProbeRecord) -> &str {
    let known = DECISIONS.iter().any(|(name, ..)| *name == probe.decision);
    if known { &probe.decision } else { "undecided" }
}

fn interval(frame: &FrameRecord, probe: &ProbeRecord) -> Interval {
    Interval {
        x: frame.frame as f64,
        y: probe.ratio,
        lower: probe.lower,
        upper: probe.upper,
        title: format!(
            "frame {}: {}, ratio {} ({} to {}), {} pairs, {} % of the tiles\n{}",
            frame.frame,
            probe.decision,
            number::ratio(probe.ratio),
            number::ratio(probe.lower),
            number::ratio(probe.upper),
            probe.pairs,
            number::brief(100.0 * probe.share, 3),
            plots::configuration(frame),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn every_probe_is_drawn_with_its_decision() {
        let run = example::probed(60);
        let probes = probes(&run.frames);
        assert!(probes.len() > 10);
        let drawn = plot(&probes).unwrap();
        for (frame, probe) in &probes {
            if probe.ratio.is_finite() {
                let title = format!("<title>frame {}: {}", frame.frame, probe.decision);
                assert_eq!(drawn.matches(&title).count(), 1, "{title}");
            }
        }
    }

    #[test]
    fn shares_and_costs_are_said() {
        let mut frames = vec![example::frame(0), example::frame(1)];
        for (frame, decision) in frames.iter_mut().zip(["rejected", "accepted"]) {
            frame.frame_ms = Some(115.0);
            frame.build_ms = Some(5.0);
            frame.probe = Some(example::probe(1.5, decision));
            frame.probe.as_mut().unwrap().share = 0.2;
        }
        // 110 ms are 1.1 times the 100 ms that the incumbent would have taken.
        let said = sentences(&probes(&frames));
        assert_eq!(said[0], "2 probes: rejected 1 (50 %), accepted 1 (50 %).");
        assert!(said[1].contains("cost 10.0 ms of building"), "{}", said[1]);
        assert!(said[1].contains("took 20.0 ms more"), "{}", said[1]);
        assert!(said[1].contains("had 20 % of"), "{}", said[1]);
    }

    #[test]
    fn probes_without_a_ratio_are_counted_and_not_drawn() {
        let mut frame = example::frame(0);
        frame.probe = Some(example::probe(f64::NAN, "failed"));
        let frames = [frame];
        assert_eq!(plot(&probes(&frames)), None);
        assert!(sentences(&probes(&frames))[0].contains("failed 1 (100 %)"));
    }

    #[test]
    fn unknown_decisions_are_drawn() {
        let mut frame = example::frame(0);
        frame.probe = Some(example::probe(1.1, "postponed"));
        let drawn = plot(&probes(std::slice::from_ref(&frame))).unwrap();
        assert!(drawn.contains("frame 0: postponed"));
    }
}
