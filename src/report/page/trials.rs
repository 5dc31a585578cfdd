//! What the frames of a run say, sorted for the page: what was measured, what failed, what was best.
//!
//! A frame in which something was tried counts as measured if its cost is a finite number, and as
//! failed otherwise: it is one or the other, so nothing is lost between the tables. A frame of the
//! incumbent alone is neither, whatever it took: a run that has found its best would be hundreds of
//! times the same trial.

use super::frames::{Kind, build_part_ms, whole_ms};
use crate::report::record::FrameRecord;

/// A measured frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trial<'a> {
    pub(super) frame: &'a FrameRecord,
    pub(super) cost_ms: f64,
    /// Share of the measured frames that cost less: 0 for the best. Ranks and not costs are shown
    /// as colours, since one slow configuration would press all others into one colour.
    pub(super) rank: f64,
}

/// A configuration, with all frames that tried it.
#[derive(Clone, Debug)]
pub(super) struct Configuration<'a> {
    /// The frame with the lowest cost.
    pub(super) best: Trial<'a>,
    /// How many frames measured it.
    pub(super) measurements: usize,
}

/// A reason to fail, with the numbers of its frames.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Failure {
    pub(super) reason: String,
    pub(super) frames: Vec<usize>,
}

/// The frames in which something was tried.
pub(super) fn tried(frames: &[FrameRecord]) -> impl Iterator<Item = &FrameRecord> {
    frames
        .iter()
        .filter(|frame| Kind::of(frame) != Kind::Incumbent)
}

/// The measured frames in their order.
pub(super) fn measured(frames: &[FrameRecord]) -> Vec<Trial<'_>> {
    let costs = sorted_costs(frames);
    let others = costs.len().saturating_sub(1).max(1) as f64;
    tried(frames)
        .filter_map(|frame| {
            let cost_ms = finite_cost(frame)?;
            let lower = costs.partition_point(|&cost| cost < cost_ms);
            Some(Trial {
                frame,
                cost_ms,
                rank: lower as f64 / others,
            })
        })
        .collect()
}

/// At most about `limit` of the trials, in their order: every new incumbent, the best tenth of the
/// limit, and of the others every second, third, …
pub(super) fn thinned<'a>(trials: &[Trial<'a>], limit: usize) -> Vec<Trial<'a>> {
    if trials.len() <= limit {
        return trials.to_vec();
    }
    let mut costs: Vec<f64> = trials.iter().map(|trial| trial.cost_ms).collect();
    costs.sort_by(f64::total_cmp);
    let good = costs[limit / 10];
    let stride = trials.len().div_ceil(limit);
    let kept = trials.iter().enumerate().filter(|(index, trial)| {
        index % stride == 0 || trial.cost_ms < good || trial.frame.is_incumbent
    });
    kept.map(|(_, trial)| *trial).collect()
}

/// Time to render a frame with the configuration that was tried. A frame with a probe was rendered with
/// two: of R, what it takes with the incumbent, it took R (1 − s + s r), and the candidate takes R r.
pub(super) fn render_ms(frame: &FrameRecord) -> Option<f64> {
    let of_the_candidate = || {
        let probe = frame.probe.as_ref()?;
        let rendering = whole_ms(frame)? - build_part_ms(frame);
        let time = rendering * probe.ratio / (1.0 + probe.share * (probe.ratio - 1.0));
        (time.is_finite() && time >= 0.0).then_some(time)
    };
    of_the_candidate().or(frame.render_ms)
}

/// The failed frames by reason, the most frequent first.
pub(super) fn failures(frames: &[FrameRecord]) -> Vec<Failure> {
    let mut failures: Vec<Failure> = Vec::new();
    for frame in tried(frames).filter(|frame| finite_cost(frame).is_none()) {
        let reason = match (&frame.failure, frame.cost_ms) {
            (Some(reason), _) => reason.as_str(),
            (None, Some(_)) => "the cost is not a finite number",
            (None, None) => "no cost was measured",
        };
        match failures.iter_mut().find(|known| known.reason == reason) {
            Some(known) => known.frames.push(frame.frame),
            None => failures.push(Failure {
                reason: reason.to_string(),
                frames: vec![frame.frame],
            }),
        }
    }
    failures.sort_by_key(|failure| std::cmp::Reverse(failure.frames.len()));
    failures
}

/// The different configurations, the one with the lowest cost first.
pub(super) fn configurations<'a>(trials: &[Trial<'a>]) -> Vec<Configuration<'a>> {
    let mut order = trials.to_vec();
    // Equal configurations side by side, the cheapest of each first.
    order.sort_by(|one, other| {
        let by_cost = one.cost_ms.total_cmp(&other.cost_ms);
        one.frame.config.cmp(&other.frame.config).then(by_cost)
    });
    let mut configurations: Vec<Configuration<'a>> = order
        .chunk_by(|one, other| one.frame.config == other.frame.config)
        .map(|group| Configuration {
            best: group[0],
            measurements: group.len(),
        })
        .collect();
    configurations.sort_by(|one, other| {
        let by_frame = one.best.frame.frame.cmp(&other.best.frame.frame);
        one.best
            .cost_ms
            .total_cmp(&other.best.cost_ms)
            .then(by_frame)
    });
    configurations
}

/// The names of all parameters, in the order in which they appear.
pub(super) fn parameters<'a>(
    configs: impl IntoIterator<Item = &'a Vec<(String, String)>>,
) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for (name, _) in configs.into_iter().flatten() {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    names
}

/// The parameters of which the trials have more than one value, or some none, and the others with
/// their value.
pub(super) fn varied(trials: &[Trial<'_>], parameters: &[String]) -> (Vec<String>, Vec<String>) {
    let mut varied = Vec::new();
    let mut constant = Vec::new();
    for name in parameters {
        let mut values = trials
            .iter()
            .map(|trial| value_of(&trial.frame.config, name));
        let first = values.next().flatten();
        match first {
            Some(value) if values.all(|other| other == first) => {
                constant.push(format!("{name} = {value}"));
            }
            _ => varied.push(name.clone()),
        }
    }
    (varied, constant)
}

/// The value of a parameter.
pub(super) fn value_of<'a>(config: &'a [(String, String)], name: &str) -> Option<&'a str> {
    config
        .iter()
        .find(|(known, _)| known == name)
        .map(|(_, value)| value.as_str())
}

/// The costs at the quarters of the ranks: lowest, lower quartile, median, upper quartile, highest.
/// One value if all are equal, none if nothing was measured.
pub(super) fn quarters(frames: &[FrameRecord]) -> Vec<f64> {
    let costs = sorted_costs(frames);
    match (costs.first(), costs.last()) {
        (Some(first), Some(last)) if first < last => (0..=4)
            .map(|quarter| costs[(quarter * (costs.len() - 1) + 2) / 4])
            .collect(),
        (Some(first), _) => vec![*first],
        _ => Vec::new(),
    }
}

fn finite_cost(frame: &FrameRecord) -> Option<f64> {
    frame.cost_ms.filter(|cost| cost.is_finite())
}

fn sorted_costs(frames: &[FrameRecord]) -> Vec<f64> {
    let mut costs: Vec<f64> = tried(frames).filter_map(finite_cost).collect();
    costs.sort_by(f64::total_cmp);
    costs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    fn with_costs(costs: &[f64]) -> Vec<FrameRecord> {
        costs
            .iter()
            .enumerate()
            .map(|(index, &cost)| {
                let mut frame = example::frame(index);
                frame.cost_ms = Some(cost);
                frame.failure = None;
                frame
            })
            .collect()
    }

    fn ranks(costs: &[f64]) -> Vec<f64> {
        let frames = with_costs(costs);
        measured(&frames).iter().map(|trial| trial.rank).collect()
    }

    #[test]
    fn ranks_go_from_zero_to_one() {
        assert_eq!(ranks(&[30.0, 10.0, 20.0]), [1.0, 0.0, 0.5]);
        assert_eq!(ranks(&[5.0]), [0.0]);
        assert_eq!(ranks(&[7.0, 7.0, 7.0]), [0.0, 0.0, 0.0]);
        assert_eq!(ranks(&[]), [0.0; 0]);
    }

    #[test]
    fn of_many_trials_the_best_and_some_others_are_kept() {
        let run = example::run(3000);
        let trials = measured(&run.frames);
        let kept = thinned(&trials, 300);
        assert!((270..=350).contains(&kept.len()), "{}", kept.len());
        for trial in &trials {
            let is_kept = kept.iter().any(|one| one.frame.frame == trial.frame.frame);
            assert!(is_kept || (trial.rank > 0.0 && !trial.frame.is_incumbent));
        }
        assert_eq!(thinned(&trials[..10], 300).len(), 10);
        // Equal costs are no reason to keep all.
        let equal = with_costs(&[5.0; 1000]);
        assert!(thinned(&measured(&equal), 100).len() <= 110);
    }

    #[test]
    fn every_frame_is_measured_or_failed() {
        let mut frames = example::run(80).frames;
        frames[3].cost_ms = Some(f64::NAN);
        frames[4].cost_ms = None;
        let failed: usize = failures(&frames)
            .iter()
            .map(|failure| failure.frames.len())
            .sum();
        assert_eq!(measured(&frames).len() + failed, frames.len());
        assert!(measured(&frames).iter().all(|trial| trial.rank <= 1.0));
    }

    #[test]
    fn a_frame_of_the_incumbent_alone_is_no_trial() {
        let mut frames = with_costs(&[3.0, 1.0, 2.0]);
        frames[1].frame_ms = Some(1.0);
        let of = |frames: &[FrameRecord]| (measured(frames).len(), failures(frames).len());
        assert_eq!(of(&frames), (2, 0));
        frames[1].cost_ms = None;
        assert_eq!(of(&frames), (2, 0));
        assert_eq!(quarters(&frames)[0], 2.0);
        frames[1].reason = Some("start".to_string());
        assert_eq!(of(&frames), (2, 1));
    }

    #[test]
    fn the_time_of_a_candidate_is_found_from_a_part_of_the_frame() {
        let mut frame = FrameRecord {
            build_ms: Some(5.0),
            render_ms: Some(110.0),
            frame_ms: Some(115.0),
            ..example::frame(0)
        };
        assert_eq!(render_ms(&frame), Some(110.0));
        // A fifth of the tiles with half as much again: 110 instead of 100.
        frame.probe = Some(example::probe(0.2, 30, 1.5, "rejected"));
        assert!((render_ms(&frame).unwrap() - 150.0).abs() < 1e-9);
        frame.probe.as_mut().unwrap().ratio = f64::NAN;
        assert_eq!(render_ms(&frame), Some(110.0));
    }

    #[test]
    fn failures_are_counted_by_reason() {
        let mut frames = with_costs(&[1.0, 1.0, 1.0, 1.0, f64::INFINITY]);
        for (index, reason) in [(0, "rare"), (1, "often"), (3, "often")] {
            frames[index].cost_ms = None;
            frames[index].failure = Some(reason.to_string());
        }
        let found: Vec<(String, Vec<usize>)> = failures(&frames)
            .into_iter()
            .map(|failure| (failure.reason, failure.frames))
            .collect();
        assert_eq!(
            found,
            [
                ("often".to_string(), vec![1, 3]),
                ("rare".to_string(), vec![0]),
                ("the cost is not a finite number".to_string(), vec![4]),
            ]
        );
    }

    #[test]
    fn equal_configurations_are_one_with_its_lowest_cost() {
        let mut frames = with_costs(&[30.0, 10.0, 20.0, 25.0]);
        frames[2].config = frames[0].config.clone();
        let trials = measured(&frames);
        let found: Vec<(usize, usize)> = configurations(&trials)
            .iter()
            .map(|configuration| (configuration.best.frame.frame, configuration.measurements))
            .collect();
        assert_eq!(found, [(1, 1), (2, 2), (3, 1)]);
    }

    #[test]
    fn parameters_of_all_configurations_are_found_once() {
        let config = |names: &[&str]| -> Vec<(String, String)> {
            names
                .iter()
                .map(|name| (name.to_string(), "1".to_string()))
                .collect()
        };
        let configs = [config(&["b", "a"]), config(&["a", "c"])];
        assert_eq!(parameters(&configs), ["b", "a", "c"]);
        assert_eq!(value_of(&configs[0], "a"), Some("1"));
        assert_eq!(value_of(&configs[0], "c"), None);
    }

    #[test]
    fn a_parameter_that_some_lack_is_varied() {
        let mut frames = with_costs(&[1.0, 2.0]);
        let config = |names: &[(&str, &str)]| -> Vec<(String, String)> {
            let pair = |(name, value): &(&str, &str)| (name.to_string(), value.to_string());
            names.iter().map(pair).collect()
        };
        frames[0].config = config(&[("a", "1"), ("b", "1"), ("c", "1")]);
        frames[1].config = config(&[("a", "1"), ("b", "2")]);
        let names = ["a", "b", "c"].map(str::to_string);
        let (some, others) = varied(&measured(&frames), &names);
        assert_eq!(some, ["b", "c"]);
        assert_eq!(others, ["a = 1"]);
    }

    #[test]
    fn quarters_of_the_costs() {
        let frames = with_costs(&[5.0, 1.0, 3.0, 2.0, 4.0]);
        assert_eq!(quarters(&frames), [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(quarters(&with_costs(&[2.0, 2.0])), [2.0]);
        assert_eq!(quarters(&[]), [0.0; 0]);
    }
}
