//! One page without anything from elsewhere: a table of directions, what differs, a plot for each parameter
//! and quantity, and the numbers.

use std::fmt::Write as _;

use plotters::prelude::*;

use super::{Agreement, ENGINES, Quantity, SWEEPS, Sweep, Trend, TrendsError};

/// One for each scene, told apart by those who see few colours too (after Okabe and Ito, *Color Universal Design*,
/// 2008).
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(160, 120, 0),
    RGBColor(70, 70, 70),
];

/// Pixels.
const PLOT: (u32, u32) = (304, 172);

const STYLE: &str = "\
body{font:15px/1.5 system-ui,sans-serif;color:#222;max-width:1280px;margin:2rem auto;padding:0 1.5rem}\
h1{font-size:1.5rem;margin-bottom:.3rem}h2{font-size:1.15rem;margin:2.2rem 0 .4rem;border-top:1px solid #ddd;padding-top:1rem}\
table{border-collapse:collapse;font-size:13px}td,th{padding:.2rem .55rem;text-align:right;border-bottom:1px solid #eee;white-space:nowrap}\
th{font-weight:600;color:#555}td:first-child,th:first-child,td.t,th.t{text-align:left}\
.c{display:inline-block;border-radius:3px;padding:0 .3rem;margin:1px;font-size:12px}\
.yes{background:#dcf0e4}.no{background:#f7c9c4}.one{background:#fdf0cd}.both{background:#eee}.unknown{color:#aaa}\
.plots{display:flex;flex-wrap:wrap;gap:.3rem}figure{margin:0}figcaption{font-size:12.5px;color:#444;padding-left:3rem}\
.key span{margin-right:1.1rem}i{display:inline-block;width:22px;height:4px;margin-right:.35rem;vertical-align:middle}\
summary{cursor:pointer;color:#555;font-size:13px;margin-top:.4rem}p{max-width:62rem}.n{color:#777;font-size:13px}";

/// The page of some trends, sorted by scene; `about` says what was measured where, `notes` what was not.
///
/// # Errors
/// [`TrendsError::Plot`].
pub fn page(about: &str, trends: &[Trend], notes: &[String]) -> Result<String, TrendsError> {
    let mut scenes: Vec<&str> = trends.iter().map(|trend| &*trend.scene).collect();
    scenes.dedup();
    let mut html = format!(
        "<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport content='width=device-width'>\
         <title>Trends of parameters</title><style>{STYLE}</style>\
         <h1>Do parameters push ours where they push Embree’s?</h1><p class=n>{}</p>",
        escaped(about)
    );
    html += "<p>One parameter is swept, the others stay. Builders: ours without layout beside <code>rtcBuildBVH</code>; \
        trace time and counts of work are those of our kernels over either tree. Flags (dynamics, leaf_format, accuracy): \
        our whole trees beside Embree’s scenes, each traced by its own kernels. SAH cost is by the default’s costs. \
        A direction is the sign of Spearman’s ρ of value and quantity within rounds; it is flat if the interval of 95 % over \
        rounds holds 0. ρ does not see what falls and rises again: the plots do.</p>";
    directions(&mut html, &scenes, trends);
    differences(&mut html, trends);
    if !notes.is_empty() {
        html += "<details><summary>Not measured</summary><ul>";
        for note in notes {
            let _ = write!(html, "<li>{}", escaped(note));
        }
        html += "</ul></details>";
    }
    html += "<h2>Plots</h2><p>Medians over rounds, relative to the same engine at the first value. \
        Wide and pale: ours. Thin with dots: Embree’s.</p>";
    key(&mut html, &scenes);
    for sweep in &SWEEPS {
        let own: Vec<&Trend> = trends.iter().filter(|trend| trend.sweep == sweep).collect();
        if own.is_empty() {
            continue;
        }
        let _ = write!(html, "<h2>{}</h2><div class=plots>", sweep.parameter);
        for quantity in Quantity::ALL {
            let of = own.iter().filter(|trend| trend.quantity == quantity);
            let of: Vec<&Trend> = of.copied().collect();
            if of.is_empty() {
                continue;
            }
            let plot = plot(sweep, &scenes, &of).map_err(TrendsError::Plot)?;
            let name = quantity.name();
            let _ = write!(
                html,
                "<figure><figcaption>{name}</figcaption>{plot}</figure>"
            );
        }
        html += "</div>";
        numbers(&mut html, &own);
    }
    Ok(html)
}

/// Parameters by quantities; in each cell a sign for each scene.
fn directions(html: &mut String, scenes: &[&str], trends: &[Trend]) {
    let _ = write!(
        html,
        "<h2>Directions</h2><p>Ours, then Embree’s, for each of {}, as the parameter grows (words: in the order of the \
         plots): ▲ rises, ▼ falls, – flat, · not told. \
         <span class='c yes'>the same</span><span class='c no'>opposite</span><span class='c one'>one is flat</span>\
         <span class='c both'>both are flat</span></p><table><tr><th>parameter",
        escaped(&scenes.join(", "))
    );
    for quantity in Quantity::ALL {
        let _ = write!(html, "<th class=t>{}", quantity.name());
    }
    for sweep in &SWEEPS {
        if !trends.iter().any(|trend| trend.sweep == sweep) {
            continue;
        }
        let _ = write!(html, "<tr><td>{}", sweep.parameter);
        for quantity in Quantity::ALL {
            *html += "<td class=t>";
            let is_here = |trend: &&Trend| trend.sweep == sweep && trend.quantity == quantity;
            for trend in trends.iter().filter(is_here) {
                let class = match trend.agreement() {
                    Agreement::Yes => "yes",
                    Agreement::No => "no",
                    Agreement::OneFlat => "one",
                    Agreement::BothFlat => "both",
                    Agreement::Unknown => "unknown",
                };
                let [ours, theirs] = trend.correlations.map(|correlation| correlation.arrow());
                let scene = escaped(&trend.scene);
                let _ = write!(
                    html,
                    "<span class='c {class}' title='{scene}'>{ours}{theirs}</span>"
                );
            }
        }
    }
    *html += "</table>";
}

/// What was measured of each trend whose signs differ.
fn differences(html: &mut String, trends: &[Trend]) {
    *html += "<h2>Where a trend differs</h2>";
    let opposite = differing(trends, Agreement::No);
    if opposite.is_empty() {
        *html += "<p>No parameter pushes a quantity in opposite directions.</p>";
    } else {
        *html += "<p>Opposite directions, with ρ, its interval, and the change from the first value to the last:</p>";
        *html += &opposite;
    }
    let flat = differing(trends, Agreement::OneFlat);
    if !flat.is_empty() {
        *html += "<p>One of the two is flat:</p>";
        *html += &flat;
    }
}

/// A table of the trends with an agreement; empty if there are none.
fn differing(trends: &[Trend], wanted: Agreement) -> String {
    let mut html = String::new();
    for trend in trends.iter().filter(|trend| trend.agreement() == wanted) {
        if html.is_empty() {
            html += "<table><tr><th>parameter<th class=t>quantity<th class=t>scene";
            for engine in ENGINES {
                let _ = write!(html, "<th class=t>{engine}<th>ρ<th>interval<th>change");
            }
        }
        let _ = write!(
            html,
            "<tr><td>{}<td class=t>{}<td class=t>{}",
            trend.sweep.parameter,
            trend.quantity.name(),
            escaped(&trend.scene)
        );
        for (correlation, series) in trend.correlations.iter().zip(&trend.series) {
            let does = ["falls", "is flat", "rises"][(correlation.sign() + 1) as usize];
            let [low, high] = correlation.interval;
            let _ = write!(
                html,
                "<td class=t>{does}<td>{:.2}<td>{low:.2} … {high:.2}<td>× {:.3}",
                correlation.rho,
                series.change()
            );
        }
    }
    if !html.is_empty() {
        html += "</table>";
    }
    html
}

fn key(html: &mut String, scenes: &[&str]) {
    *html += "<p class=key>";
    for (scene, colour) in scenes.iter().zip(COLOURS.iter().cycle()) {
        let RGBColor(r, g, b) = colour;
        let scene = escaped(scene);
        let _ = write!(
            html,
            "<span><i style='background:rgb({r},{g},{b})'></i>{scene}</span>"
        );
    }
    *html += "</p>";
}

/// Medians and correlations, folded away.
fn numbers(html: &mut String, trends: &[&Trend]) {
    *html += "<details><summary>Numbers</summary>";
    let values = trends[0].sweep.values;
    *html += "<table><tr><th>scene<th class=t>quantity<th class=t>engine";
    for value in values {
        let _ = write!(html, "<th>{value}");
    }
    *html += "<th>ρ<th>interval<th class=t>the same direction";
    for trend in trends {
        for (engine, name) in ENGINES.into_iter().enumerate() {
            let series = &trend.series[engine];
            if series.rounds.is_empty() {
                continue;
            }
            let _ = write!(
                html,
                "<tr><td>{}<td class=t>{} <span class=n>{}</span><td class=t>{}",
                escaped(&trend.scene),
                trend.quantity.name(),
                trend.quantity.unit(),
                name
            );
            let medians = series.medians();
            for place in 0..values.len() {
                let own = series.places.iter().position(|&own| own == place);
                let text = own.map_or_else(String::new, |own| digits(medians[own]));
                let _ = write!(html, "<td>{text}");
            }
            let correlation = &trend.correlations[engine];
            let [low, high] = correlation.interval;
            let _ = write!(
                html,
                "<td>{:.2}<td>{low:.2} … {high:.2}<td class=t>{}",
                correlation.rho,
                if engine == 0 {
                    trend.agreement().name()
                } else {
                    ""
                }
            );
        }
    }
    *html += "</table></details>";
}

/// Four digits, or all of a whole number.
fn digits(number: f64) -> String {
    if number.fract() == 0.0 || number.abs() >= 1000.0 {
        format!("{number:.0}")
    } else {
        let decimals = (3 - number.abs().log10().floor() as i32).clamp(0, 8) as usize;
        format!("{number:.decimals$}")
    }
}

/// An SVG; both engines, all scenes.
fn plot(sweep: &Sweep, scenes: &[&str], trends: &[&Trend]) -> Result<String, String> {
    let lines = |engine: usize| {
        trends.iter().filter_map(move |trend| {
            let series = &trend.series[engine];
            let medians = series.medians();
            let first = *medians.first()?;
            let colour = scenes.iter().position(|&scene| scene == trend.scene)?;
            let points = series.places.iter().zip(&medians);
            let points: Vec<(f64, f64)> = points
                .map(|(&place, median)| (place as f64, median / first))
                .filter(|point| point.1.is_finite())
                .collect();
            Some((COLOURS[colour % COLOURS.len()], points))
        })
    };
    let heights = || {
        let all = (0..2).flat_map(lines);
        all.flat_map(|(_, points)| points).map(|point| point.1)
    };
    let low = heights().fold(f64::INFINITY, f64::min);
    let high = heights().fold(f64::NEG_INFINITY, f64::max);
    // What differs by less than a fiftieth looks flat.
    let margin = (0.08 * (high - low)).max(0.01);
    let last = sweep.values.len() as f64 - 1.0;
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, PLOT).into_drawing_area();
        draw(&area, sweep, last, [low - margin, high + margin], &lines)
            .map_err(|error| error.to_string())?;
        area.present().map_err(|error| error.to_string())?;
    }
    Ok(svg)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn draw<'s, L: Iterator<Item = (RGBColor, Vec<(f64, f64)>)>>(
    area: &Area<'s>,
    sweep: &Sweep,
    last: f64,
    [low, high]: [f64; 2],
    lines: &impl Fn(usize) -> L,
) -> Result<(), DrawingAreaErrorKind<<SVGBackend<'s> as DrawingBackend>::ErrorType>> {
    let mut chart = ChartBuilder::on(area)
        .margin_right(24)
        .margin_top(6)
        .x_label_area_size(20)
        .y_label_area_size(42)
        .build_cartesian_2d(-0.2..last + 0.2, low..high)?;
    let label = |x: &f64| {
        let place = x.round();
        let is_value = (x - place).abs() < 1e-6 && place >= 0.0;
        let value = is_value.then(|| sweep.values.get(place as usize)).flatten();
        value.map_or_else(String::new, |value| (*value).to_owned())
    };
    let decimals = if high - low < 0.1 {
        3
    } else if high - low < 5.0 {
        2
    } else {
        0
    };
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(232, 232, 232))
        .axis_style(RGBColor(150, 150, 150))
        .label_style(("sans-serif", 11))
        .x_labels(sweep.values.len())
        .x_label_formatter(&label)
        .y_labels(4)
        .y_label_formatter(&|y| format!("{y:.decimals$}"))
        .draw()?;
    for (colour, points) in lines(0) {
        let style = colour.mix(0.35).stroke_width(5);
        chart.draw_series(LineSeries::new(points, style))?;
    }
    for (colour, points) in lines(1) {
        chart.draw_series(LineSeries::new(points.clone(), colour.stroke_width(1)))?;
        let dots = points
            .into_iter()
            .map(|point| Circle::new(point, 2, colour.filled()));
        chart.draw_series(dots)?;
    }
    Ok(())
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('\'', "&#39;")
}
