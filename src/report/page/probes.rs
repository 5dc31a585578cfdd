//! Probes: how candidates did on some tiles beside the incumbent, what was decided, what it cost.
//!
//! A frame of which the share s was rendered with a candidate that takes r times as long as the
//! incumbent took R (1 − s + s r), R being a frame with the incumbent alone. So R is known without
//! having been measured, and with it what the probe cost: the build, and s (r − 1) R.

use super::frames::{build_part_ms, whole_ms};
use super::table::{Cell, Table};
use super::{ABSENT, figure};
use crate::report::markup::escape;
use crate::report::number;
use crate::report::record::{FrameRecord, ProbeRecord, RunRecord};
use crate::report::svg::Size;
use crate::report::svg::marker::Marker;
use crate::report::svg::xy::{Interval, Layer, Plot, Range};

const SIZE: Size = Size {
    width: 860.0,
    height: 360.0,
};
/// Bounds this far beyond all ratios are taken as none: the axis is for the ratios.
const FAR: f64 = 3.0;
/// Probes that are drawn; of more every second, third, …
const MOST_DRAWN: usize = 600;

/// Decisions with their looks, in the order in which they are listed.
const DECISIONS: [(&str, &str, Marker); 5] = [
    ("accepted", "kind-accepted", Marker::Diamond),
    ("rejected", "kind-probe", Marker::Circle),
    ("undecided", "plain", Marker::Square),
    ("given up", "open", Marker::Triangle),
    ("failed", "bad", Marker::Cross),
];

/// A frame with its probe.
type Probed<'a> = (&'a FrameRecord, &'a ProbeRecord);

/// What a probe cost beyond a frame with the incumbent, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cost {
    build: f64,
    /// Less than nothing if the candidate was faster.
    tiles: f64,
}

/// `None` if the frame left no time or no ratio.
fn cost(&(frame, probe): &Probed<'_>) -> Option<Cost> {
    let build = build_part_ms(frame);
    let render = whole_ms(frame)? - build;
    let excess = probe.share * (probe.ratio - 1.0);
    let tiles = render * excess / (1.0 + excess);
    tiles.is_finite().then_some(Cost {
        build: build / 1e3,
        tiles: tiles / 1e3,
    })
}

/// Plot, table and sentences; a sentence alone if nothing was probed.
pub(super) fn section(run: &RunRecord) -> String {
    let html = "<h2>Probes</h2>\n".to_string();
    let probes: Vec<Probed<'_>> = run
        .frames
        .iter()
        .filter_map(|frame| Some((frame, frame.probe.as_ref()?)))
        .collect();
    if probes.is_empty() {
        return html
            + "<p>No candidate was probed on a part of a frame: what was tried was tried with \
               whole frames.</p>\n";
    }
    let mut html = html + &format!("<p>{}</p>\n", escape(&summary(run, &probes)));
    html.push_str(&table(&probes).html());
    let stride = probes.len().div_ceil(MOST_DRAWN);
    let drawn: Vec<_> = probes.iter().copied().step_by(stride).collect();
    if drawn.iter().any(|(_, probe)| is_ratio(probe.ratio)) {
        let thinned = match stride {
            1 => String::new(),
            _ => format!(" One of {stride} probes is drawn."),
        };
        html.push_str(&figure(
            &plot(&drawn),
            &format!(
                "Each mark is the time of a candidate over that of the incumbent on the same part \
                 of the picture: below 1 it renders faster. Lines are one-sided bounds of 95 %; \
                 dotted ones have no bound on a side where they reach the edge. A candidate that \
                 renders faster may be rejected for its build.{thinned}"
            ),
        ));
    } else {
        html.push_str("<p>No probe has a ratio.</p>\n");
    }
    html
}

fn is_ratio(ratio: f64) -> bool {
    ratio.is_finite() && ratio > 0.0
}

fn summary(run: &RunRecord, probes: &[Probed<'_>]) -> String {
    let rejected = probes
        .iter()
        .filter(|(_, probe)| probe.decision == "rejected");
    let share = 100.0 * rejected.count() as f64 / probes.len() as f64;
    let costs: Vec<Cost> = probes.iter().filter_map(cost).collect();
    let mut text = format!(
        "{} of {} had a probe; {} % of the probes were rejected. ",
        number::count(probes.len()),
        number::counted(run.frames.len(), "frame"),
        number::significant(share, 2)
    );
    if costs.is_empty() {
        return text + "What they cost is not known.";
    }
    let build: f64 = costs.iter().map(|cost| cost.build).sum();
    let tiles: f64 = costs.iter().map(|cost| cost.tiles).sum();
    let all: f64 = run.frames.iter().filter_map(whole_ms).sum::<f64>() / 1e3;
    text.push_str(&format!(
        "Beyond the same frames with the incumbent alone they cost {} to build candidates, and \
         their tiles {} {}: together {} % of the {} of all frames.",
        number::seconds(build),
        number::seconds(tiles.abs()),
        if tiles < 0.0 { "less" } else { "more" },
        number::significant(100.0 * (build + tiles) / all, 2),
        number::seconds(all)
    ));
    match probes.len() - costs.len() {
        0 => text,
        unknown => text + &format!(" Of {unknown} the cost is not known."),
    }
}

/// The decision as listed; what is not known by name is listed last.
fn place(decision: &str) -> usize {
    let known = DECISIONS.iter().position(|(name, ..)| *name == decision);
    known.unwrap_or(DECISIONS.len())
}

fn table(probes: &[Probed<'_>]) -> Table {
    let mut sorted = probes.to_vec();
    sorted.sort_by(|(_, one), (_, other)| {
        let by_place = place(&one.decision).cmp(&place(&other.decision));
        by_place.then_with(|| one.decision.cmp(&other.decision))
    });
    let rows = sorted
        .chunk_by(|(_, one), (_, other)| one.decision == other.decision)
        .map(|group| row(group, probes.len()))
        .collect();
    Table {
        head: [
            "decision",
            "probes",
            "share of the probes (%)",
            "median ratio",
            "mean share of tiles (%)",
            "builds",
            "tiles beyond the incumbent",
        ]
        .map(str::to_string)
        .to_vec(),
        rows,
    }
}

/// The probes of one decision.
fn row(group: &[Probed<'_>], all: usize) -> Vec<Cell> {
    let ratios = group.iter().map(|(_, probe)| probe.ratio);
    let mut ratios: Vec<f64> = ratios.filter(|&ratio| is_ratio(ratio)).collect();
    ratios.sort_by(f64::total_cmp);
    let median = ratios.get(ratios.len() / 2);
    let shares = group.iter().map(|(_, probe)| probe.share).sum::<f64>();
    let costs: Vec<Cost> = group.iter().filter_map(cost).collect();
    let sum = |part: fn(&Cost) -> f64| {
        let sum = || number::seconds(costs.iter().map(part).sum());
        Cell::Number(if costs.is_empty() {
            ABSENT.into()
        } else {
            sum()
        })
    };
    let percent = |share: f64| Cell::Number(number::significant(100.0 * share, 3));
    vec![
        Cell::Text(group[0].1.decision.clone()),
        Cell::Number(number::count(group.len())),
        percent(group.len() as f64 / all as f64),
        Cell::Number(median.map_or_else(|| ABSENT.into(), |&ratio| number::ratio(ratio))),
        percent(shares / group.len() as f64),
        sum(|cost| cost.build),
        sum(|cost| cost.tiles),
    ]
}

fn plot(probes: &[Probed<'_>]) -> String {
    let ratios = || {
        let ratios = probes.iter().map(|(_, probe)| probe.ratio);
        ratios.filter(|&ratio| is_ratio(ratio))
    };
    let least = ratios().fold(1.0, f64::min) / FAR;
    let greatest = ratios().fold(1.0, f64::max) * FAR;
    let bound = |bound: f64| {
        let is_near = (least..=greatest).contains(&bound);
        if is_near { bound } else { f64::NAN }
    };
    let other = ("other", "plain", Marker::Circle);
    let mut layers = vec![Layer::Level {
        name: "as the incumbent".to_string(),
        class: "incumbent".to_string(),
        y: 1.0,
        band: (1.0, 1.0),
    }];
    for (index, (name, class, marker)) in DECISIONS.into_iter().chain([other]).enumerate() {
        let intervals = probes
            .iter()
            .filter(|(_, probe)| place(&probe.decision) == index && is_ratio(probe.ratio))
            .map(|(frame, probe)| Interval {
                x: frame.frame as f64,
                y: probe.ratio,
                lower: bound(probe.lower),
                upper: bound(probe.upper),
                title: title(frame, probe),
            });
        layers.push(Layer::Intervals {
            name: name.to_string(),
            class,
            marker,
            intervals: intervals.collect(),
        });
    }
    Plot {
        size: SIZE,
        description: "Ratios of the probes with their bounds",
        x_label: "frame",
        y_label: "candidate ÷ incumbent",
        y_range: Range::Fitted,
        layers,
    }
    .draw()
}

fn title(frame: &FrameRecord, probe: &ProbeRecord) -> String {
    format!(
        "probe in frame {}: {}, {} ({} to {}), {} on {} % of the tiles",
        frame.frame,
        probe.decision,
        number::ratio(probe.ratio),
        number::ratio(probe.lower),
        number::ratio(probe.upper),
        number::counted(probe.pairs, "pair"),
        number::significant(100.0 * probe.share, 3)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn what_a_probe_costs_is_found_again() {
        // With the incumbent 100 ms; 20 to build; a quarter of the tiles takes twice as long.
        let mut frame = example::frame(0);
        frame.build_ms = Some(20.0);
        frame.frame_ms = Some(20.0 + 100.0 * (0.75 + 0.25 * 2.0));
        let probe = ProbeRecord {
            share: 0.25,
            pairs: 30,
            ratio: 2.0,
            lower: 1.9,
            upper: 2.1,
            decision: "rejected".to_string(),
        };
        let found = cost(&(&frame, &probe)).unwrap();
        assert!((found.build - 0.020).abs() < 1e-12);
        assert!((found.tiles - 0.025).abs() < 1e-12, "{found:?}");
        // A faster candidate gives time back.
        let faster = ProbeRecord {
            ratio: 0.5,
            ..probe.clone()
        };
        assert!(cost(&(&frame, &faster)).unwrap().tiles < 0.0);
        let none = ProbeRecord {
            ratio: f64::NAN,
            ..probe
        };
        assert_eq!(cost(&(&frame, &none)), None);
    }

    #[test]
    fn every_probe_is_drawn_and_counted() {
        let run = example::probed(60);
        let html = section(&run);
        let mut rejected = 0;
        for frame in &run.frames {
            let Some(probe) = &frame.probe else { continue };
            rejected += usize::from(probe.decision == "rejected");
            if probe.decision != "failed" {
                assert!(html.contains(&format!("probe in frame {}:", frame.frame)));
            }
        }
        assert!(html.contains(&format!(
            "<th scope=\"row\">rejected</th><td class=\"n\">{rejected}</td>"
        )));
        assert!(!html.contains("NaN") && !html.contains("inf\""));
    }

    #[test]
    fn a_run_without_probes_says_so() {
        let html = section(&example::run(20));
        assert!(html.contains("No candidate was probed") && !html.contains("<svg"));
    }

    #[test]
    fn probes_without_ratios_are_counted_alone() {
        let mut run = example::probed(20);
        let probes = run.frames.iter_mut();
        for probe in probes.filter_map(|frame| frame.probe.as_mut()) {
            probe.ratio = f64::NAN;
            probe.decision = "a new word".to_string();
        }
        let html = section(&run);
        assert!(html.contains("a new word") && html.contains("No probe has a ratio"));
        assert!(html.contains("What they cost is not known"));
    }
}
