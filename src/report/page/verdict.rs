//! The result of a run in plain sentences: what was gained, also when it is a loss.
//!
//! A ratio is called faster or slower only if both quartiles lie on the same side of 1. The numbers
//! come from the interleaved comparison at the end, never from the lowest cost of the search: the
//! minimum of noisy values is biased low.

use super::trials::{self, Trial};
use crate::report::number;
use crate::report::record::{ComparisonRow, RunRecord};

/// How the tuned configuration did against one baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Both quartiles of the ratio are above 1.
    Faster,
    /// Both quartiles of the ratio are below 1.
    Slower,
    /// The spread reaches over 1.
    Undecided,
    /// The baseline is the tuned configuration itself: a ratio other than 1 is noise.
    Same,
    /// The ratio is not a number.
    Unknown,
}

/// The outcome against the baseline in `row`.
pub(super) fn outcome(tuned: &ComparisonRow, row: &ComparisonRow) -> Outcome {
    let ratio = row.cost_ratio_to_tuned;
    if tuned.config == row.config {
        Outcome::Same
    } else if ![ratio.median, ratio.lower, ratio.upper]
        .iter()
        .all(|value| value.is_finite())
    {
        Outcome::Unknown
    } else if ratio.lower > 1.0 {
        Outcome::Faster
    } else if ratio.upper < 1.0 {
        Outcome::Slower
    } else {
        Outcome::Undecided
    }
}

/// Class of the box around the sentence: `good` if every baseline was beaten, `bad` if one won,
/// `open` otherwise.
pub(super) fn class(run: &RunRecord) -> &'static str {
    let outcomes: Vec<Outcome> = comparison(run)
        .map(|(tuned, baselines)| baselines.iter().map(|row| outcome(tuned, row)).collect())
        .unwrap_or_default();
    if outcomes.contains(&Outcome::Slower) {
        "bad"
    } else if !outcomes.is_empty() && outcomes.iter().all(|&it| it == Outcome::Faster) {
        "good"
    } else {
        "open"
    }
}

/// What is minimised, in words.
pub(super) fn metric(metric: &str) -> &str {
    match metric {
        "render" => "render time",
        "total" => "total time (build + render)",
        other => other,
    }
}

/// The tuned row and the baselines; `None` if nothing was compared.
pub(super) fn comparison(run: &RunRecord) -> Option<(&ComparisonRow, &[ComparisonRow])> {
    run.summary.as_ref()?.comparison.split_first()
}

/// The result in one sentence.
pub(super) fn headline(run: &RunRecord, trials: &[Trial<'_>]) -> String {
    let metric = metric(&run.header.metric);
    if let Some((tuned, baselines)) = comparison(run)
        && !baselines.is_empty()
    {
        let clauses: Vec<String> = baselines.iter().map(|row| clause(tuned, row)).collect();
        return format!("Tuned for {metric}: {}.", clauses.join("; "));
    }
    let best = trials
        .iter()
        .min_by(|one, other| one.cost_ms.total_cmp(&other.cost_ms));
    match best {
        Some(best) => format!(
            "Tuned for {metric}: lowest cost {}, in frame {}; not compared with any baseline.",
            number::milliseconds(best.cost_ms),
            best.frame.frame
        ),
        None if run.frames.is_empty() => {
            format!("To be tuned for {metric}: no frame has been tried yet.")
        }
        None if trials::tried(&run.frames).next().is_none() => {
            format!("Not tuned for {metric}: nothing was tried beside the incumbent.")
        }
        None => format!("Not tuned for {metric}: every trial failed."),
    }
}

fn clause(tuned: &ComparisonRow, row: &ComparisonRow) -> String {
    let name = &row.name;
    let ratio = row.cost_ratio_to_tuned;
    let quartiles = format!(
        "quartiles {} to {}",
        number::ratio(ratio.lower),
        number::ratio(ratio.upper)
    );
    let median = number::ratio(ratio.median);
    match outcome(tuned, row) {
        Outcome::Faster => format!("{median} × faster than {name} ({quartiles})"),
        Outcome::Slower => {
            format!("{median} ×, that is slower than {name} ({quartiles})")
        }
        Outcome::Undecided => {
            format!("{median} ×, no clear difference from {name} ({quartiles})")
        }
        Outcome::Same => {
            format!("the same configuration as {name}, so {median} × is noise ({quartiles})")
        }
        Outcome::Unknown => format!("no ratio to {name} could be formed"),
    }
}

/// What the reader must know about how complete the run is; empty if nothing is missing.
pub(super) fn caveats(run: &RunRecord, failed: usize) -> Vec<String> {
    let mut caveats = Vec::new();
    let (done, planned) = (run.frames.len(), run.header.frames_planned);
    let interrupted = run
        .summary
        .as_ref()
        .is_some_and(|summary| summary.interrupted);
    if interrupted {
        caveats.push(format!(
            "The run was interrupted: {done} of {planned} planned frames are done."
        ));
    } else if done < planned {
        caveats.push(format!(
            "The run is not complete: {done} of {planned} planned frames are done."
        ));
    }
    if comparison(run).is_none_or(|(_, baselines)| baselines.is_empty()) {
        caveats.push(
            "There is no comparison with baselines: whether anything was gained is not known."
                .to_string(),
        );
    }
    if done > 0 && failed == done {
        caveats.push("All frames failed; the reasons are listed below.".to_string());
    }
    caveats
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;
    use crate::report::page::trials::measured;
    use crate::report::record::Spread;

    fn sentence(ratio: Spread) -> String {
        let mut run = example::run(20);
        let summary = run.summary.as_mut().unwrap();
        summary.comparison.truncate(2);
        summary.comparison[1].cost_ratio_to_tuned = ratio;
        headline(&run, &measured(&run.frames))
    }

    fn spread(lower: f64, median: f64, upper: f64) -> Spread {
        Spread {
            median,
            lower,
            upper,
        }
    }

    #[test]
    fn a_gain_a_loss_and_a_draw_are_named() {
        assert_eq!(
            sentence(spread(1.31, 1.32, 1.34)),
            "Tuned for render time: 1.32 × faster than Table 1's default \
             (quartiles 1.31 to 1.34)."
        );
        let loss = sentence(spread(0.96, 0.97, 0.98));
        assert!(loss.contains("0.970 ×, that is slower than Table 1's default"));
        assert!(!loss.contains("faster"));
        let draw = sentence(spread(0.99, 1.01, 1.03));
        assert!(draw.contains("no clear difference"), "{draw}");
        for reaching_over in [spread(0.95, 0.97, 1.01), spread(0.99, 1.03, 1.05)] {
            assert!(sentence(reaching_over).contains("no clear difference"));
        }
        let unknown = sentence(spread(f64::NAN, f64::NAN, f64::NAN));
        assert!(unknown.contains("no ratio"), "{unknown}");
    }

    #[test]
    fn a_baseline_that_was_found_again_is_not_a_gain() {
        let mut run = example::run(20);
        let comparison = &mut run.summary.as_mut().unwrap().comparison;
        comparison[1].config = comparison[0].config.clone();
        let sentence = headline(&run, &measured(&run.frames));
        assert!(
            sentence.contains("the same configuration as Table 1's default"),
            "{sentence}"
        );
        assert_eq!(class(&run), "open");
    }

    #[test]
    fn the_box_is_good_only_if_every_baseline_was_beaten() {
        let class_of = |ratios: &[f64]| {
            let mut run = example::run(1);
            let comparison = &mut run.summary.as_mut().unwrap().comparison;
            comparison.truncate(1);
            comparison.extend(
                ratios
                    .iter()
                    .map(|&ratio| example::row("baseline", "1", 40.0, ratio)),
            );
            class(&run)
        };
        assert_eq!(class_of(&[1.2, 1.1]), "good");
        assert_eq!(class_of(&[1.2, 1.0]), "open");
        assert_eq!(class_of(&[1.2, 0.9]), "bad");
        assert_eq!(class_of(&[]), "open");
    }

    #[test]
    fn without_a_comparison_nothing_is_claimed() {
        let mut run = example::run(20);
        run.summary = None;
        let sentence = headline(&run, &measured(&run.frames));
        assert!(sentence.contains("not compared"), "{sentence}");
        assert!(!sentence.contains("faster"), "{sentence}");
        assert_eq!(caveats(&run, 0).len(), 1);
    }

    #[test]
    fn an_interrupted_run_says_so() {
        let mut run = example::run(20);
        run.header.frames_planned = 80;
        run.summary.as_mut().unwrap().interrupted = true;
        assert_eq!(
            caveats(&run, 0),
            ["The run was interrupted: 20 of 80 planned frames are done."]
        );
    }

    #[test]
    fn a_complete_run_has_no_caveat() {
        assert_eq!(caveats(&example::run(20), 2), [""; 0]);
    }

    #[test]
    fn no_frames_and_only_failures_are_told_apart() {
        let mut run = example::run(0);
        run.summary = None;
        assert!(headline(&run, &[]).contains("no frame has been tried"));
        run.frames = vec![example::frame(11)];
        assert!(headline(&run, &[]).contains("every trial failed"));
        run.frames[0].failure = None;
        run.frames[0].frame_ms = Some(9.0);
        assert!(headline(&run, &[]).contains("nothing was tried"));
        run.frames = vec![example::frame(11)];
        assert!(
            caveats(&run, 1)
                .iter()
                .any(|text| text.contains("All frames failed"))
        );
    }
}
