//! One HTML page of a whole run, for people.
//!
//! The page is a single file without script: style sheet, plots and picture are inside, and a
//! content security policy forbids the browser to load anything else. The order is the reader's:
//! what came out, how sure that is, how it was found, and at the end everything else that is needed
//! to repeat it. Text from records is escaped on its way in; numbers that are none are shown as
//! `n/a`.

mod base64;
mod frames;
mod gain;
mod importance;
mod leaf_map;
mod plots;
mod probes;
mod regret;
pub(super) mod table;
mod tables;
mod trials;
mod verdict;

use super::markup::escape;
use super::number;
use super::record::{ComparisonRow, RunRecord};
use super::svg::color;
use base64::base64;
use trials::{Failure, Trial};

/// Rules that do not depend on the run.
const STYLE_SHEET: &str = include_str!("page/style.css");
/// Length of the table of the best configurations.
const BEST_SHOWN: usize = 10;
/// Of more trials than these only some are drawn one by one: a page should open at once.
const MOST_DRAWN: usize = 600;
/// Of more frames than these the table lists the first and the last.
const MOST_LISTED: usize = 1000;
/// Shown where a value does not exist.
const ABSENT: &str = "–";

/// A picture in a page; `png` is its file.
pub(super) fn picture(alt: &str, png: &[u8]) -> String {
    format!(
        "<img alt=\"{}\" src=\"data:image/png;base64,{}\">",
        escape(alt),
        base64(png)
    )
}

/// The page of `run` as HTML; `picture_png` is the rendered picture as a PNG file.
pub fn page(run: &RunRecord, picture_png: Option<&[u8]>) -> String {
    let header = &run.header;
    let trials = trials::measured(&run.frames);
    let failures = trials::failures(&run.frames);
    let parameters = trials::parameters(run.frames.iter().map(|frame| &frame.config));
    let compared = run
        .summary
        .as_ref()
        .map_or(&[][..], |summary| summary.comparison.as_slice());

    let mut body = result(run, &trials);
    if let Some(png) = picture_png {
        body.push_str(&figure(
            &picture("The rendered scene", png),
            &format!(
                "The scene at {} × {} pixels; the configuration of the tree does not change the \
                 picture, only the time.",
                header.width, header.height
            ),
        ));
    }
    body.push_str(&comparison(run));
    if !run.frames.is_empty() {
        body.push_str(&gain::section(run));
        body.push_str(&frames::section(run, compared));
        body.push_str(&probes::section(run));
        body.push_str(&search(run, compared, &trials, &failures));
    }
    if !trials.is_empty() {
        body.push_str(&search_space(run, compared, &trials, &parameters));
        body.push_str(&importance::section(&trials, &parameters));
        body.push_str(&best(&trials, &parameters));
    }
    if !failures.is_empty() {
        let failed: usize = failures.iter().map(|failure| failure.frames.len()).sum();
        body.push_str(&format!(
            "<h2>Failed trials</h2>\n<p>{} of {} trials failed.</p>\n{}",
            number::count(failed),
            number::count(trials::tried(&run.frames).count()),
            tables::failures(&failures).html()
        ));
    }
    if !run.frames.is_empty() {
        body.push_str(&all_frames(run, &parameters));
    }
    body.push_str(&format!(
        "<h2>Settings</h2>\n<div class=\"pair\">\n<div>{}</div>\n<div>{}</div>\n</div>\n",
        tables::manifest(header, run.frames.len()).html(),
        indicators(run)
    ));
    document(&format!("{}: tuning of the tree", header.scene), &body)
}

/// What the search was told, and how far from its best it was.
fn search(
    run: &RunRecord,
    compared: &[ComparisonRow],
    trials: &[Trial<'_>],
    failures: &[Failure],
) -> String {
    let drawn = trials::thinned(trials, MOST_DRAWN);
    let mut html = "<h2>Search</h2>\n".to_string();
    if drawn.len() < trials.len() {
        html.push_str(&format!(
            "<p>Of {} trials {} are drawn here and below: every new incumbent, the best, and every \
             so many of the others.</p>\n",
            number::count(trials.len()),
            number::count(drawn.len())
        ));
    }
    if drawn.is_empty() {
        return html + "<p>Every trial failed: there are no costs to show.</p>\n";
    }
    html.push_str(&figure(
        &plots::history(&run.frames, &drawn, compared),
        &history_caption(compared, failures),
    ));
    html.push_str(&regret::section(trials, compared));
    html
}

/// The table of the frames, behind a heading that opens it.
fn all_frames(run: &RunRecord, parameters: &[String]) -> String {
    let count = number::count(run.frames.len());
    if run.frames.len() <= MOST_LISTED {
        return format!(
            "<details><summary>All {count} frames</summary>\n{}</details>\n",
            tables::frames(&run.frames, parameters).html()
        );
    }
    let (first, _) = run.frames.split_at(MOST_LISTED / 2);
    let (_, last) = run.frames.split_at(run.frames.len() - MOST_LISTED / 2);
    format!(
        "<details><summary>The first and the last {} of {count} frames</summary>\n<p>The log has \
         all.</p>\n{}</details>\n",
        MOST_LISTED / 2,
        tables::frames(&[first, last].concat(), parameters).html()
    )
}

/// Explains what is in the plot and nothing that is not.
fn history_caption(compared: &[ComparisonRow], failures: &[Failure]) -> String {
    let mut caption =
        "Each mark is what the search was told of one configuration; the stepped line \
                       is the cost of the incumbent, as it was known then"
            .to_string();
    if !compared.is_empty() {
        caption.push_str(
            "; horizontal lines are the compared configurations, measured at the end, with their \
             quartiles as bands",
        );
    }
    if !failures.is_empty() {
        caption.push_str("; crosses at the upper edge are failed trials");
        let failed: usize = failures.iter().map(|failure| failure.frames.len()).sum();
        if failed > plots::MOST_CROSSES {
            caption.push_str(", of many only some");
        }
    }
    caption + "."
}

/// Title, sentence and what limits it.
fn result(run: &RunRecord, trials: &[Trial<'_>]) -> String {
    let mut html = format!(
        "<h1>{}</h1>\n<p class=\"verdict {}\">{}</p>\n",
        escape(&run.header.scene),
        verdict::class(run),
        escape(&verdict::headline(run, trials))
    );
    for caveat in verdict::caveats(run, trials::tried(&run.frames).count() - trials.len()) {
        html.push_str(&format!("<p class=\"caveat\">{}</p>\n", escape(&caveat)));
    }
    html
}

/// The interleaved comparison; empty if there is none, which the caveats have said.
fn comparison(run: &RunRecord) -> String {
    let (Some(summary), Some((tuned, baselines))) = (&run.summary, verdict::comparison(run)) else {
        return String::new();
    };
    let mut html = format!(
        "<h2>Comparison</h2>\n<p>Medians of {} rounds in which all configurations took turns, with \
         lower and upper quartile in parentheses. The ratio is formed within each round, so that \
         slow minutes of the machine cancel; above 1, tuning won.</p>\n",
        number::count(summary.rounds)
    );
    html.push_str(&tables::comparison(tuned, baselines).html());
    html.push_str(&figure(
        &plots::cost_bars(&summary.comparison),
        "Shorter is better: bars end at the median cost, whiskers reach from the lower to the \
         upper quartile.",
    ));
    html.push_str(&tables::compared_parameters(&summary.comparison).html());
    html
}

/// Where in the space of parameters the good configurations lie.
fn search_space(
    run: &RunRecord,
    compared: &[ComparisonRow],
    trials: &[Trial<'_>],
    parameters: &[String],
) -> String {
    let drawn = &trials::thinned(trials, MOST_DRAWN);
    let legend = plots::rank_legend(&run.frames);
    let mut html = format!(
        "<h2>Configurations</h2>\n<div class=\"scroll\" tabindex=\"0\">{legend}</div>\n<div class=\"pair\">\n"
    );
    html.push_str(&figure(
        &plots::build_and_render(drawn, compared),
        "Each circle is one frame: the further left, the faster its tree was built, the lower, the \
         faster the picture was rendered.",
    ));
    if let Some(plot) = plots::leaf_sizes(drawn) {
        html.push_str(&figure(
            &plot,
            "Each circle is one frame at its two leaf sizes: where circles of the best colour \
             gather, leaves have a good size; of equal configurations the best is on top.",
        ));
    }
    html.push_str("</div>\n");
    let (varied, constant) = trials::varied(trials, parameters);
    let constant = match constant.as_slice() {
        [] => String::new(),
        names => format!(" Not varied: {}.", names.join(", ")),
    };
    html.push_str(&figure(
        &plots::parameters(drawn, &varied),
        &format!(
            "Each line is one configuration and crosses every axis at its value, the last axis at \
             its cost: where lines of the best colour run together, a parameter matters; the thick \
             line is the best. Failed trials are not shown.{constant}"
        ),
    ));
    html.push_str(&leaf_map::section(trials));
    html
}

fn best(trials: &[Trial<'_>], parameters: &[String]) -> String {
    let configurations = trials::configurations(trials);
    format!(
        "<h2>Best configurations</h2>\n<p>The {} best of {} different configurations, by the lowest \
         cost that the search saw. The lowest of many noisy values is lower than a new measurement \
         would be: what was gained is told by the comparison alone.</p>\n{}",
        BEST_SHOWN.min(configurations.len()),
        number::count(configurations.len()),
        tables::best(&configurations, parameters, BEST_SHOWN).html()
    )
}

fn indicators(run: &RunRecord) -> String {
    if run.header.indicators.is_empty() {
        "<p>The indicators of the scene were not computed.</p>\n".to_string()
    } else {
        tables::indicators(&run.header).html()
    }
}

/// `content` is HTML, `caption` is text.
pub(super) fn figure(content: &str, caption: &str) -> String {
    format!(
        "<figure><div class=\"scroll\" tabindex=\"0\">{content}</div>\n<figcaption>{}</figcaption></figure>\n",
        escape(caption)
    )
}

pub(super) fn document(title: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <meta http-equiv=\"Content-Security-Policy\" \
         content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">\n\
         <title>{}</title>\n<style>\n{STYLE_SHEET}{}</style>\n</head>\n<body>\n<main>\n{body}\
         </main>\n</body>\n</html>\n",
        escape(title),
        color::style_sheet()
    )
}

#[cfg(test)]
mod tests;
