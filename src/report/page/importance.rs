//! How much of the cost each parameter explains by itself.
//!
//! Eta squared of a one-way analysis of variance: the variance between the classes of a parameter
//! over that of all trials, of the logarithm of the cost (Fisher, *Statistical Methods for Research
//! Workers*, 1925, chapter VII, calls it the correlation ratio). Numbers of many values are put into
//! classes of about equally many trials. Of n trials without any effect k classes explain
//! (k − 1)/(n − 1) on average, which is shown beside the share. Beside it the rank correlation of
//! Spearman, *The Proof and Measurement of Association between Two Things*, American Journal of
//! Psychology 15, 1904: it has a sign, but sees only what rises or falls.
//!
//! Only main effects: of some dozens of trials, placed by a search and not by a plan, interactions
//! cannot be told from chance.

use super::table::{Cell, Table};
use super::trials::{Trial, value_of};
use super::{ABSENT, figure};
use crate::report::markup::escape;
use crate::report::record::Spread;
use crate::report::svg::bars::{Bar, bars};

/// With fewer trials nothing is said.
const LEAST_TRIALS: usize = 20;
/// Up to so many different numbers are classes of their own.
const FEW: usize = 6;
/// Classes of a parameter of more numbers.
const CLASSES: usize = 5;

/// What a parameter explains.
#[derive(Clone, Debug, PartialEq)]
struct Effect {
    name: String,
    classes: usize,
    /// Eta squared, 0 to 1.
    share: f64,
    /// What it would be on average without an effect.
    by_chance: f64,
    /// Of value and cost; `None` if the values are words.
    rank_correlation: Option<f64>,
}

/// Bars and table, or why there are none.
pub(super) fn section(trials: &[Trial<'_>], parameters: &[String]) -> String {
    let html = "<h2>Importance of the parameters</h2>\n".to_string();
    let logs: Vec<f64> = trials.iter().map(|trial| trial.cost_ms.ln()).collect();
    if trials.len() < LEAST_TRIALS {
        return html
            + &format!(
                "<p>Shares of variance are told from {LEAST_TRIALS} measured trials on; here are \
                 {}.</p>\n",
                trials.len()
            );
    }
    if logs.iter().any(|log| !log.is_finite()) || logs.iter().all(|log| *log == logs[0]) {
        return html
            + "<p>The costs are all equal or not all positive: there is no variance to be shared \
               out.</p>\n";
    }
    let mut constant = Vec::new();
    let mut effects = Vec::new();
    for name in parameters {
        let values: Vec<Option<&str>> = trials
            .iter()
            .map(|trial| value_of(&trial.frame.config, name))
            .collect();
        match effect(name, &values, &logs) {
            Some(effect) => effects.push(effect),
            None => constant.push(name.as_str()),
        }
    }
    effects.sort_by(|one, other| other.share.total_cmp(&one.share));
    if effects.is_empty() {
        return html + "<p>No parameter was varied.</p>\n";
    }
    let mut html = html + &explanation(trials.len(), &constant);
    html.push_str("<div class=\"pair\">\n");
    html.push_str(&figure(
        &plot(&effects),
        "Share of the variance of the logarithm of the cost between the values of a parameter. \
         Shares do not add up to 100 %: in a search parameters are not varied independently.",
    ));
    html.push_str(&format!("<div>{}</div>\n</div>\n", table(&effects).html()));
    html
}

fn explanation(trials: usize, constant: &[&str]) -> String {
    let mut text = format!(
        "From {trials} trials, each parameter by itself. These are main effects only: what two \
         parameters do together would need a model or a plan of trials, and a search tries most \
         near its best, where differences are small. A share near that of chance is none. A parameter that a trial \
         does not read counts with the value in the log."
    );
    if !constant.is_empty() {
        text.push_str(&format!(" Not varied: {}.", constant.join(", ")));
    }
    format!("<p>{}</p>\n", escape(&text))
}

fn plot(effects: &[Effect]) -> String {
    let bars_of_effects: Vec<Bar> = effects
        .iter()
        .map(|effect| Bar {
            name: effect.name.clone(),
            class: "s0".to_string(),
            spread: Spread {
                median: 100.0 * effect.share,
                lower: f64::NAN,
                upper: f64::NAN,
            },
            label: format!(
                "{:.0} % ({:.0} % by chance)",
                100.0 * effect.share,
                100.0 * effect.by_chance
            ),
        })
        .collect();
    bars(
        520.0,
        "Share of the variance of each parameter",
        "share of variance (%)",
        &bars_of_effects,
    )
}

fn table(effects: &[Effect]) -> Table {
    let rows = effects
        .iter()
        .map(|effect| {
            let correlation = effect.rank_correlation;
            vec![
                Cell::Text(effect.name.clone()),
                Cell::Number(effect.classes.to_string()),
                Cell::Number(format!("{:.0}", 100.0 * effect.share)),
                Cell::Number(format!("{:.0}", 100.0 * effect.by_chance)),
                Cell::Number(correlation.map_or_else(|| ABSENT.into(), |it| format!("{it:+.2}"))),
            ]
        })
        .collect();
    Table {
        head: [
            "parameter",
            "classes",
            "share (%)",
            "by chance (%)",
            "rank correlation",
        ]
        .map(str::to_string)
        .to_vec(),
        rows,
    }
}

/// `None` if the values are all the same.
fn effect(name: &str, values: &[Option<&str>], logs: &[f64]) -> Option<Effect> {
    let classes = classes(values);
    let count = classes.iter().max()? + 1;
    if count < 2 {
        return None;
    }
    let mut sums = vec![(0.0, 0_usize); count];
    for (&class, log) in classes.iter().zip(logs) {
        sums[class] = (sums[class].0 + log, sums[class].1 + 1);
    }
    let mean = logs.iter().sum::<f64>() / logs.len() as f64;
    let between: f64 = sums
        .iter()
        .filter(|(_, size)| *size > 0)
        .map(|&(sum, size)| size as f64 * (sum / size as f64 - mean).powi(2))
        .sum();
    Some(Effect {
        name: name.to_string(),
        classes: count,
        share: (between / total_squares(logs)).clamp(0.0, 1.0),
        by_chance: (count - 1) as f64 / (logs.len() - 1) as f64,
        rank_correlation: rank_correlation(values, logs),
    })
}

fn total_squares(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| (value - mean).powi(2)).sum()
}

fn numeric(value: &str) -> Option<f64> {
    value.parse().ok().filter(|number: &f64| number.is_finite())
}

/// The class of each value, from 0 on without gaps. What is absent is a class, each word is one, and
/// few numbers are; of many numbers classes have about as many values each, equal ones together.
fn classes(values: &[Option<&str>]) -> Vec<usize> {
    let numbers: Option<Vec<Option<f64>>> = values
        .iter()
        .map(|value| match value {
            None => Some(None),
            Some(value) => numeric(value).map(Some),
        })
        .collect();
    let keys: Vec<String> = match numbers {
        Some(numbers) => {
            let mut sorted: Vec<f64> = numbers.iter().flatten().copied().collect();
            sorted.sort_by(f64::total_cmp);
            let mut different = sorted.clone();
            different.dedup();
            let key = |number: f64| {
                if different.len() <= FEW {
                    return number.to_string();
                }
                let below = sorted.partition_point(|&other| other < number);
                (below * CLASSES / sorted.len()).to_string()
            };
            let key = |number: &Option<f64>| number.map_or_else(|| ABSENT.to_string(), key);
            numbers.iter().map(key).collect()
        }
        None => values
            .iter()
            .map(|value| value.unwrap_or(ABSENT).to_string())
            .collect(),
    };
    let mut different: Vec<&String> = keys.iter().collect();
    different.sort();
    different.dedup();
    let class = |key| different.binary_search(&key).unwrap_or(0);
    keys.iter().map(class).collect()
}

/// Of numbers, or of `false` and `true`, over the trials that have the parameter.
fn rank_correlation(values: &[Option<&str>], logs: &[f64]) -> Option<f64> {
    let number = |value: &str| match value {
        "false" => Some(0.0),
        "true" => Some(1.0),
        number => numeric(number),
    };
    let pairs: Vec<(f64, f64)> = values
        .iter()
        .zip(logs)
        .filter_map(|(value, &log)| Some((number((*value)?), log)))
        .map(|(value, log)| Some((value?, log)))
        .collect::<Option<_>>()?;
    let (values, logs): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
    let (values, logs) = (ranks(&values), ranks(&logs));
    let middle = (values.len() as f64 - 1.0) / 2.0;
    let product: f64 = values
        .iter()
        .zip(&logs)
        .map(|(value, log)| (value - middle) * (log - middle))
        .sum();
    let correlation = product / (total_squares(&values) * total_squares(&logs)).sqrt();
    correlation.is_finite().then_some(correlation)
}

/// The place of each value in their order, from 0 on; equal ones have their mean.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    values
        .iter()
        .map(|&value| {
            let below = sorted.partition_point(|&other| other < value);
            let up_to = sorted.partition_point(|&other| other <= value);
            (below + up_to - 1) as f64 / 2.0
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;
    use crate::report::page::trials::{measured, parameters};

    fn effect_of(values: &[&str], costs: &[f64]) -> Option<Effect> {
        let values: Vec<Option<&str>> = values
            .iter()
            .map(|value| (!value.is_empty()).then_some(*value))
            .collect();
        let logs: Vec<f64> = costs.iter().map(|cost| cost.ln()).collect();
        effect("p", &values, &logs)
    }

    #[test]
    fn all_and_nothing_are_explained() {
        let all = effect_of(&["a", "b", "a", "b"], &[1.0, 2.0, 1.0, 2.0]).unwrap();
        assert!((all.share - 1.0).abs() < 1e-12);
        assert_eq!((all.classes, all.rank_correlation), (2, None));
        let nothing = effect_of(&["1", "2", "1", "2"], &[1.0, 1.0, 2.0, 2.0]).unwrap();
        assert!(nothing.share.abs() < 1e-12 && nothing.rank_correlation.unwrap().abs() < 1e-12);
        assert_eq!(effect_of(&["1", "1"], &[1.0, 2.0]), None);
    }

    /// By hand: logarithms 0, 2, 4, 6 in two classes have 4 × 4 = 16 of 20 squares between them.
    #[test]
    fn a_share_found_by_hand() {
        let costs = [0.0, 2.0, 4.0, 6.0].map(f64::exp);
        let found = effect_of(&["1", "1", "2", "2"], &costs).unwrap();
        assert!((found.share - 0.8).abs() < 1e-12, "{found:?}");
        assert!((found.by_chance - 1.0 / 3.0).abs() < 1e-12);
        // Ranks ½, ½, 2½, 2½ and 0, 1, 2, 3: 4 / √(4 × 5).
        let expected = 4.0 / 20f64.sqrt();
        assert!((found.rank_correlation.unwrap() - expected).abs() < 1e-12);
    }

    #[test]
    fn a_valley_is_seen_by_the_share_and_not_by_the_correlation() {
        let values: Vec<String> = (0..50).map(|index| index.to_string()).collect();
        let values: Vec<&str> = values.iter().map(String::as_str).collect();
        let costs: Vec<f64> = (0..50)
            .map(|index| f64::from(index - 25).powi(2) + 1.0)
            .collect();
        let found = effect_of(&values, &costs).unwrap();
        assert_eq!(found.classes, CLASSES);
        assert!(found.share > 0.6, "{found:?}");
        assert!(found.rank_correlation.unwrap().abs() < 0.1, "{found:?}");
    }

    #[test]
    fn what_is_absent_is_a_class() {
        let found = effect_of(&["", "4", "", "4"], &[1.0, 2.0, 1.0, 2.0]).unwrap();
        assert_eq!(found.classes, 2);
        assert!((found.share - 1.0).abs() < 1e-12);
        assert_eq!(found.rank_correlation, None);
    }

    #[test]
    fn the_parameter_that_decides_is_first() {
        let run = example::run(400);
        let trials = measured(&run.frames);
        let names = parameters(run.frames.iter().map(|frame| &frame.config));
        let html = section(&trials, &names);
        let place = |name: &str| html.find(&format!("<th scope=\"row\">{name}")).unwrap();
        assert!(place("branching_factor") < place("sah_block_size"));
        assert!(place("quality") < place("intersection_cost"));
    }

    #[test]
    fn too_few_trials_and_equal_costs_are_said() {
        let run = example::run(15);
        let html = section(&measured(&run.frames), &["quality".to_string()]);
        assert!(
            html.contains("from 20 measured trials on; here are 14"),
            "{html}"
        );
        let mut run = example::run(40);
        for cost in [0.0, 7.0] {
            for frame in &mut run.frames {
                frame.cost_ms = Some(cost);
            }
            let html = section(&measured(&run.frames), &["quality".to_string()]);
            assert!(html.contains("no variance") && !html.contains("<svg"));
        }
    }
}
