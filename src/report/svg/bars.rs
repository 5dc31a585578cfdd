//! Horizontal bars from zero, with whiskers for the spread: few values, compared by length.

use super::axis::Axis;
use super::{Anchor, Area, LINE_HEIGHT, Size, drawing, line, text, text_width, tooltip};
use crate::report::markup::shorten;
use crate::report::record::Spread;

/// Names are cut beyond this; the bars need room too.
const LONGEST_NAME: usize = 26;
/// Height of a bar with the gap below it.
const PITCH: f64 = 34.0;
const THICKNESS: f64 = 20.0;

/// One bar.
#[derive(Clone, Debug)]
pub(crate) struct Bar {
    pub(crate) name: String,
    /// Class that gives the colour.
    pub(crate) class: String,
    /// The bar ends at the median; the whisker reaches from the lower to the upper quartile.
    pub(crate) spread: Spread,
    /// The median with its unit: written after the bar.
    pub(crate) label: String,
}

/// The bars below one another in the given order; `label` is the quantity with its unit.
pub(crate) fn bars(width: f64, description: &str, label: &str, bars: &[Bar]) -> String {
    let size = Size {
        width,
        height: bars.len() as f64 * PITCH + 58.0,
    };
    let widest = |texts: &mut dyn Iterator<Item = &str>| {
        texts
            .map(|name| text_width(&shorten(name, LONGEST_NAME)))
            .fold(0.0, f64::max)
    };
    let area = Area {
        left: widest(&mut bars.iter().map(|bar| bar.name.as_str())) + 14.0,
        top: 8.0,
        right: size.width - widest(&mut bars.iter().map(|bar| bar.label.as_str())) - 16.0,
        bottom: size.height - 46.0,
    };
    let axis = Axis::from_zero(
        bars.iter()
            .flat_map(|bar| [bar.spread.median, bar.spread.upper]),
    );
    let mut content = String::new();
    for (position, tick) in axis.ticks() {
        let x = area.x(position);
        content.push_str(&line("grid", (x, area.top), (x, area.bottom)));
        let y = area.bottom + LINE_HEIGHT;
        content.push_str(&text("tick", x, y, Anchor::Middle, &tick.label));
    }
    for (index, bar) in bars.iter().enumerate() {
        let middle = area.top + (index as f64 + 0.5) * PITCH;
        content.push_str(&draw_bar(bar, &area, &axis, middle));
    }
    content.push_str(&line(
        "axis",
        (area.left, area.top),
        (area.left, area.bottom),
    ));
    let y = size.height - 8.0;
    content.push_str(&text("label", area.x(0.5), y, Anchor::Middle, label));
    drawing(size, description, &content)
}

fn draw_bar(bar: &Bar, area: &Area, axis: &Axis, middle: f64) -> String {
    let x_of = |value: f64| {
        axis.fraction(value)
            .map(|position| area.x(position.max(0.0)))
    };
    let name = shorten(&bar.name, LONGEST_NAME);
    let base_line = middle + 4.0;
    let mut content = text("key", area.left - 8.0, base_line, Anchor::End, &name);
    let mut end = area.left;
    if let Some(x) = x_of(bar.spread.median) {
        content.push_str(&format!(
            "<rect class=\"fill {}\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" \
             height=\"{THICKNESS:.1}\">{}</rect>\n",
            bar.class,
            area.left,
            middle - THICKNESS / 2.0,
            x - area.left,
            tooltip(&format!("{}: {}", bar.name, bar.label)),
        ));
        end = x;
    }
    if let (Some(lower), Some(upper)) = (x_of(bar.spread.lower), x_of(bar.spread.upper)) {
        content.push_str(&line("whisker", (lower, middle), (upper, middle)));
        for x in [lower, upper] {
            content.push_str(&line("whisker", (x, middle - 5.0), (x, middle + 5.0)));
        }
        end = end.max(upper);
    }
    content.push_str(&text(
        "key",
        end + 8.0,
        base_line,
        Anchor::Start,
        &bar.label,
    ));
    content
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar(median: f64, lower: f64, upper: f64) -> Bar {
        Bar {
            name: "Table 1's <default>".to_string(),
            class: "s1".to_string(),
            spread: Spread {
                median,
                lower,
                upper,
            },
            label: "50 ms".to_string(),
        }
    }

    fn lengths(drawn: &str) -> Vec<f64> {
        drawn
            .split("<rect")
            .skip(1)
            .map(|rect| {
                let width = rect.split(" width=\"").nth(1).unwrap();
                width.split('"').next().unwrap().parse().unwrap()
            })
            .collect()
    }

    #[test]
    fn lengths_are_in_proportion() {
        let drawn = bars(
            600.0,
            "cost",
            "ms",
            &[bar(50.0, 49.0, 51.0), bar(25.0, 24.0, 26.0)],
        );
        let lengths = lengths(&drawn);
        assert_eq!(lengths.len(), 2);
        assert!((lengths[0] / lengths[1] - 2.0).abs() < 0.01, "{lengths:?}");
    }

    #[test]
    fn a_whisker_is_three_lines() {
        let drawn = bars(600.0, "cost", "ms", &[bar(50.0, 45.0, 58.0)]);
        assert_eq!(drawn.matches("class=\"whisker\"").count(), 3);
    }

    #[test]
    fn names_are_escaped() {
        let drawn = bars(600.0, "cost", "ms", &[bar(50.0, 45.0, 58.0)]);
        assert!(drawn.contains("Table 1&#39;s &lt;default&gt;"));
    }

    #[test]
    fn degenerate_spreads_are_drawn_without_nan() {
        let drawn = bars(
            600.0,
            "cost",
            "ms",
            &[
                bar(0.0, 0.0, 0.0),
                bar(-1.0, -2.0, 0.0),
                bar(f64::NAN, f64::NAN, f64::INFINITY),
                bar(1e-320, 0.0, f64::MAX),
            ],
        );
        assert!(!drawn.contains("NaN") && !drawn.contains("inf"), "{drawn}");
        assert!(lengths(&drawn).iter().all(|&length| length >= 0.0));
    }
}
