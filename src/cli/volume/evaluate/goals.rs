//! What `raywright volume evaluate` is to show: each goal by volume, those of `in parts` with our caster,
//! those of the paper with its own.

use std::collections::BTreeMap;

use raywright::study::steering::{Caster, Seam, Way};

use super::{ClockName, OfVolume, summary};

/// By how much goals were missed, and how many were met.
pub(super) fn goals(clock: ClockName, all: &[OfVolume]) -> Vec<String> {
    let mut sentences = Vec::new();
    let (mut met, mut goals) = (0, 0);
    let mut goal = |what: &str, limit: f64, value_of: &dyn Fn(&OfVolume) -> f64| {
        let values: BTreeMap<&str, f64> =
            all.iter().map(|v| (v.name.as_str(), value_of(v))).collect();
        let missed: Vec<String> = values
            .iter()
            .filter(|(_, value)| value.is_nan() || **value > limit)
            .map(|(name, value)| format!("{name} {value:.3}"))
            .collect();
        goals += 1;
        if missed.is_empty() {
            met += 1;
            return;
        }
        sentences.push(format!(
            "missed: {what} at most {limit}: {}",
            missed.join(", ")
        ))
    };
    let by = |caster: Caster| {
        move |volume: &OfVolume, way: Way| summary([volume].into_iter(), caster, way)
    };
    let (of, of_hull) = (by(Caster::Map), by(Caster::Hull));
    match clock {
        ClockName::Work => {
            goal("paper, RMSE above the target", 0.13, &|v| {
                of_hull(v, Way::Paper).rmse_up
            });
            goal("paper, largest overshoot", 0.62, &|v| {
                of_hull(v, Way::Paper).error_up
            });
            goal("in parts, RMSE above the target", 0.03, &|v| {
                of(v, Way::Parts).rmse_up
            });
            goal("in parts, largest overshoot", 0.15, &|v| {
                of(v, Way::Parts).error_up
            });
            goal("in parts, frames above 1.1", 0.005, &|v| {
                of(v, Way::Parts).above_tenth
            });
            goal("in parts, step ÷ last frame's", 1.03, &|v| {
                of(v, Way::Parts).mean_step / of(v, Way::LastFrame).mean_step
            });
            goal("in parts, step ÷ two pass's", 1.0 / 1.5, &|v| {
                of(v, Way::Parts).mean_step / of(v, Way::TwoPass).mean_step
            });
            goal("ours, prediction", 0.07, &|v| of(v, Way::Ours).prediction);
            goal("in parts, prediction", 0.07, &|v| {
                of(v, Way::Parts).prediction
            });
        }
        ClockName::Wall => {
            goal("in parts, 95th percentile", 1.05, &|v| {
                of(v, Way::Parts).percentiles[1]
            });
            goal("in parts, largest overshoot", 0.2, &|v| {
                of(v, Way::Parts).error_up
            });
            goal("in parts, 95th percentile of overhead", 0.02, &|v| {
                of(v, Way::Parts).overhead[1]
            });
        }
    }
    if clock == ClockName::Work {
        goals += 1;
        let (sentence, holds) = order(all);
        met += usize::from(holds);
        sentences.push(sentence);
        // The paper's interaction turns and zooms, and does not enter the volume.
        let outside: Vec<String> = all
            .iter()
            .map(|v| {
                let overshoot = of_hull(v, Way::Paper).error_up_outside;
                format!("{} {overshoot:+.3}", v.name)
            })
            .collect();
        sentences.push(format!(
            "paper, largest overshoot with the camera outside of the volume: {}",
            outside.join(", ")
        ));
    }
    if let Some(sentence) = seams(all) {
        sentences.push(sentence);
    }
    sentences.push(format!("goals: {met} of {goals} met"));
    sentences
}

/// The order of the ways in Table 1 of the paper, in ours with its caster, and whether it is the same: times
/// above the target are larger by the last frame than by prediction; two pass has hardly a slow frame, and
/// the longest steps. (Its root mean square above the target is that of one or two frames, there as here.)
fn order(all: &[OfVolume]) -> (String, bool) {
    let of = |volumes: &[OfVolume], way| summary(volumes.iter(), Caster::Hull, way);
    let holds = |volumes: &[OfVolume]| {
        let [last, paper, two] =
            [Way::LastFrame, Way::Paper, Way::TwoPass].map(|way| of(volumes, way));
        last.rmse_up > paper.rmse_up
            && two.slow < 0.1 * last.slow.min(paper.slow)
            && two.mean_step > 1.2 * last.mean_step.max(paper.mean_step)
    };
    let own = all
        .iter()
        .filter(|v| holds(std::slice::from_ref(v)))
        .count();
    let columns = [Way::LastFrame, Way::Paper, Way::TwoPass].map(|way| {
        let s = of(all, way);
        format!(
            "{} {:.1} %, {:.1} % slow, step {:.2}",
            way.name(),
            100.0 * s.rmse_up,
            100.0 * s.slow,
            s.mean_step
        )
    });
    let together = holds(all);
    let sentence = format!(
        "order of Table 1 (RMSE above the target, slow frames, step): {}: {}, and on {own} of {} volumes by themselves",
        columns.join("; "),
        if together { "the same" } else { "missed" },
        all.len()
    );
    (sentence, together)
}

/// How frames in parts differ from frames with one step, where that was looked at.
fn seams(all: &[OfVolume]) -> Option<String> {
    let rows = all
        .iter()
        .flat_map(|v| &v.runs)
        .flat_map(|(_, _, run)| &run.frames);
    let seams: Vec<Seam> = rows.filter_map(|row| row.seam).collect();
    let count = seams.len();
    let percentile = |share: usize, of: fn(&Seam) -> f64| {
        let mut values: Vec<f64> = seams.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        Some(*values.get((count * share / 100).min(count.checked_sub(1)?))?)
    };
    let in_8_bits = |share, of| Some(255.0 * percentile(share, of)?);
    Some(format!(
        "seams: {count} frames with steps that differ: {:.1} dB in the median and {:.1} in the worst twentieth against one step; at borders {:.2} of 255 in the median (root mean square), {:.2} in the worst twentieth; largest {:.0}",
        percentile(50, |s| s.decibels)?,
        percentile(5, |s| s.decibels)?,
        in_8_bits(50, |s| s.border)?,
        in_8_bits(95, |s| s.border)?,
        in_8_bits(100, |s| s.largest)?,
    ))
}
