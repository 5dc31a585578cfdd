//! One HTML page of a whole run, for people.
//!
//! The page is a single file without script: style sheet, plots and picture are inside, and a
//! content security policy forbids the browser to load anything else. The order is the reader's:
//! what came out, how sure that is, how it was found, and at the end everything else that is needed
//! to repeat it. Text from records is escaped on its way in; numbers that are none are shown as
//! `n/a`.

mod base64;
mod plots;
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
        body.push_str("<h2>Search</h2>\n");
        body.push_str(&figure(
            &plots::history(&run.frames, &trials, compared),
            &history_caption(compared, &failures),
        ));
    }
    if !trials.is_empty() {
        body.push_str(&search_space(run, compared, &trials, &parameters));
        body.push_str(&best(&trials, &parameters));
    }
    if !failures.is_empty() {
        let failed: usize = failures.iter().map(|failure| failure.frames.len()).sum();
        body.push_str(&format!(
            "<h2>Failed trials</h2>\n<p>{} of {} trials failed.</p>\n{}",
            number::count(failed),
            number::count(run.frames.len()),
            tables::failures(&failures).html()
        ));
    }
    if !run.frames.is_empty() {
        body.push_str(&format!(
            "<details><summary>All {} frames</summary>\n{}</details>\n",
            number::count(run.frames.len()),
            tables::frames(&run.frames, &parameters).html()
        ));
    }
    body.push_str(&format!(
        "<h2>Settings</h2>\n<div class=\"pair\">\n<div>{}</div>\n<div>{}</div>\n</div>\n",
        tables::manifest(header, run.frames.len()).html(),
        indicators(run)
    ));
    document(&format!("{}: tuning of the tree", header.scene), &body)
}

/// Explains what is in the plot and nothing that is not.
fn history_caption(compared: &[ComparisonRow], failures: &[Failure]) -> String {
    let mut caption = "Each mark is one frame with one configuration; the stepped line is the \
                       lowest cost so far"
        .to_string();
    if !compared.is_empty() {
        caption.push_str(
            "; horizontal lines are the compared configurations, measured at the end, with their \
             quartiles as bands",
        );
    }
    if !failures.is_empty() {
        caption.push_str("; crosses at the upper edge are failed trials");
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
    for caveat in verdict::caveats(run, run.frames.len() - trials.len()) {
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
    let legend = plots::rank_legend(&run.frames);
    let mut html = format!(
        "<h2>Configurations</h2>\n<div class=\"scroll\" tabindex=\"0\">{legend}</div>\n<div class=\"pair\">\n"
    );
    html.push_str(&figure(
        &plots::build_and_render(trials, compared),
        "Each circle is one frame: the further left, the faster its tree was built, the lower, the \
         faster the picture was rendered.",
    ));
    if let Some(plot) = plots::leaf_sizes(trials) {
        html.push_str(&figure(
            &plot,
            "Each circle is one frame at its two leaf sizes: where circles of the best colour \
             gather, leaves have a good size; of equal configurations the best is on top.",
        ));
    }
    html.push_str("</div>\n");
    html.push_str(&figure(
        &plots::parameters(trials, parameters),
        "Each line is one configuration and crosses every axis at its value, the last axis at its \
         cost: where lines of the best colour run together, a parameter matters; the thick line is \
         the best. Failed trials are not shown.",
    ));
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
mod tests {
    use super::*;
    use crate::report::example;
    use crate::report::record::{FrameRecord, Spread};

    /// What a page must not have, whatever the run: foreign files, script, numbers that are none.
    fn assert_sound(html: &str) {
        for foreign in [
            "http://", "https://", "src=\"//", "url(", "@import", "<script",
        ] {
            assert!(!html.contains(foreign), "{foreign}");
        }
        for number in ["NaN", "inf\"", ">inf", "-inf", "\"-0.0\""] {
            assert!(!html.contains(number), "{number}");
        }
        let mut open: Vec<&str> = Vec::new();
        for piece in html.split('<').skip(1) {
            let tag = piece.split('>').next().unwrap();
            let name = tag.split([' ', '\n']).next().unwrap();
            let void = tag.ends_with('/') || ["!DOCTYPE", "meta", "img", "wbr"].contains(&name);
            if let Some(closed) = name.strip_prefix('/') {
                assert_eq!(open.pop(), Some(closed), "{tag}");
            } else if !void {
                open.push(name);
            }
        }
        assert_eq!(open, [""; 0]);
    }

    fn failed(frame: &mut FrameRecord) {
        frame.build_ms = None;
        frame.render_ms = None;
        frame.cost_ms = None;
        frame.incumbent_cost_ms = None;
        frame.failure = Some("too deep".to_string());
    }

    #[test]
    fn the_page_has_every_frame_parameter_indicator_and_configuration() {
        let run = example::run(80);
        let html = page(&run, None);
        assert_sound(&html);
        for frame in &run.frames {
            let number = frame.frame;
            assert!(html.contains(&format!("<tr><th scope=\"row\" class=\"n\">{number}</th>")));
            assert!(
                html.contains(&format!("<title>frame {number}:")),
                "{number}"
            );
        }
        for (name, value) in &run.frames[0].config {
            assert!(html.contains(&format!(">{name}</th>")), "{name}");
            assert!(html.contains(&format!("{name} = {value}")), "{name}");
        }
        for (name, _) in &run.header.indicators {
            assert!(html.contains(name.as_str()), "{name}");
        }
        assert!(html.contains("Tuned for render time: 1.32 × faster than Table 1&#39;s default"));
        assert!(html.contains("1.040 × faster than Embree&#39;s scene setting"));
        assert_eq!(html.matches("<figcaption>").count(), 5);
    }

    #[test]
    fn the_picture_is_inside() {
        let html = page(&example::run(2), Some(b"foobar"));
        assert!(html.contains("src=\"data:image/png;base64,Zm9vYmFy\""));
        assert!(!page(&example::run(2), None).contains("<img"));
    }

    #[test]
    fn names_with_special_characters_are_harmless() {
        let evil = "</title><script>&\"'";
        let mut run = example::run(20);
        run.header.scene = evil.to_string();
        run.header.search = evil.to_string();
        run.header.indicators[0].0 = evil.to_string();
        for frame in &mut run.frames {
            frame.config[0] = (evil.to_string(), evil.to_string());
        }
        run.frames[11].failure = Some(evil.to_string());
        let comparison = &mut run.summary.as_mut().unwrap().comparison;
        comparison[1].name = evil.to_string();
        comparison[1].config[0].1 = evil.to_string();
        let html = page(&run, None);
        assert_sound(&html);
        assert!(html.contains("&lt;/title&gt;&lt;script&gt;&amp;&quot;&#39;"));
    }

    #[test]
    fn no_frame_is_a_page() {
        let mut run = example::run(0);
        run.summary = None;
        run.header.frames_planned = 80;
        run.header.indicators.clear();
        let html = page(&run, None);
        assert_sound(&html);
        assert!(html.contains("no frame has been tried"));
        assert!(html.contains("0 of 80 planned frames"));
        assert!(html.contains("no comparison"));
    }

    #[test]
    fn one_frame_is_a_page() {
        let html = page(&example::run(1), None);
        assert_sound(&html);
        assert!(html.contains("<title>frame 0:"));
    }

    #[test]
    fn only_failures_are_a_page() {
        let mut run = example::run(9);
        run.frames.iter_mut().for_each(failed);
        run.summary = None;
        let html = page(&run, None);
        assert_sound(&html);
        assert!(html.contains("9 of 9 trials failed"));
        assert!(
            !html.contains(">tried<"),
            "the legend names what is not there"
        );
        assert!(html.contains("All frames failed"));
    }

    #[test]
    fn an_interrupted_run_says_so() {
        let mut run = example::run(9);
        run.header.frames_planned = 80;
        let summary = run.summary.as_mut().unwrap();
        summary.interrupted = true;
        summary.comparison.clear();
        let html = page(&run, None);
        assert_sound(&html);
        assert!(html.contains("interrupted: 9 of 80"));
        assert!(html.contains("no comparison"));
    }

    #[test]
    fn extreme_and_equal_numbers_are_drawn() {
        for cost in [
            0.0,
            5e-324,
            1e-12,
            31.0,
            1e15,
            1e300,
            f64::MAX,
            f64::NAN,
            f64::INFINITY,
        ] {
            let mut run = example::run(12);
            for frame in &mut run.frames {
                frame.build_ms = Some(cost);
                frame.render_ms = Some(cost);
                frame.cost_ms = Some(cost);
                frame.incumbent_cost_ms = Some(cost);
            }
            let spread = Spread {
                median: cost,
                lower: cost,
                upper: cost,
            };
            for row in &mut run.summary.as_mut().unwrap().comparison {
                row.build_ms = spread;
                row.render_ms = spread;
                row.cost_ms = spread;
                row.cost_ratio_to_tuned = spread;
            }
            run.header.indicators[0].1 = cost;
            assert_sound(&page(&run, None));
            // And one frame among them that is ordinary.
            run.frames[5].cost_ms = Some(40.0);
            assert_sound(&page(&run, None));
        }
    }
}
