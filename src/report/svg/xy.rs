//! Plots of two numeric axes: layers over one another.
//!
//! The axes are fitted to all layers together. What has no position, because it is not finite or
//! not positive on a logarithmic axis, is left out. Layers and their marks are drawn in the order
//! given: the last lies on top.

use super::axis::Axis;
pub(crate) use super::layer::{Column, Interval, Layer, Mark};
use super::layer::{Place, SYMBOL_WIDTH};
use super::{Anchor, Area, LINE_HEIGHT, Size, drawing, line, text, text_width, upward_text};
use crate::report::markup::shorten;

/// Names in the legend are cut beyond this.
const LONGEST_NAME: usize = 44;

/// A plot before it is drawn.
#[derive(Clone, Debug)]
pub(crate) struct Plot<'a> {
    pub(crate) size: Size,
    /// What a screen reader says instead of the plot.
    pub(crate) description: &'a str,
    /// Quantity and unit.
    pub(crate) x_label: &'a str,
    /// Quantity and unit.
    pub(crate) y_label: &'a str,
    pub(crate) y_range: Range,
    pub(crate) layers: Vec<Layer>,
}

/// Which values an axis shows.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Range {
    /// Those of the layers, on the scale that tells them apart best.
    Fitted,
    /// Zero to the largest value, or to this if that is less: columns beyond are cut.
    FromZero(f64),
    /// Whole decades.
    Decades,
}

impl Plot<'_> {
    /// The plot as an SVG element.
    pub(crate) fn draw(&self) -> String {
        let x_axis = Axis::fitting(self.layers.iter().flat_map(Layer::x_values));
        let y_values = self.layers.iter().flat_map(Layer::y_values);
        let y_axis = match self.y_range {
            Range::Fitted => Axis::fitting(y_values),
            Range::FromZero(most) => Axis::from_zero(y_values.map(|y| (1.03 * y).min(most))),
            Range::Decades => Axis::decades(y_values),
        };
        let (legend, legend_height) = self.legend();
        let widest = y_axis
            .ticks()
            .map(|(_, tick)| text_width(&tick.label))
            .fold(0.0, f64::max);
        let area = Area {
            left: widest + 42.0,
            top: legend_height + 12.0,
            right: self.size.width - 14.0,
            bottom: self.size.height - 46.0,
        };
        let mut content = legend;
        content.push_str(&self.axes(&area, &x_axis, &y_axis));
        let place = Place {
            area,
            x_axis,
            y_axis,
        };
        for layer in &self.layers {
            content.push_str(&layer.draw(&place));
        }
        drawing(self.size, self.description, &content)
    }

    fn axes(&self, area: &Area, x_axis: &Axis, y_axis: &Axis) -> String {
        let mut content = String::new();
        for (position, tick) in x_axis.ticks() {
            let x = area.x(position);
            content.push_str(&line("grid", (x, area.top), (x, area.bottom)));
            let y = area.bottom + LINE_HEIGHT;
            content.push_str(&text("tick", x, y, Anchor::Middle, &tick.label));
        }
        for (position, tick) in y_axis.ticks() {
            let y = area.y(position);
            content.push_str(&line("grid", (area.left, y), (area.right, y)));
            let x = area.left - 7.0;
            content.push_str(&text("tick", x, y + 4.0, Anchor::End, &tick.label));
        }
        let corner = (area.left, area.bottom);
        content.push_str(&line("axis", corner, (area.right, area.bottom)));
        content.push_str(&line("axis", corner, (area.left, area.top)));
        content.push_str(&text(
            "label",
            area.x(0.5),
            self.size.height - 8.0,
            Anchor::Middle,
            &format!("{}{}", self.x_label, x_axis.remark()),
        ));
        content.push_str(&upward_text(
            "label",
            15.0,
            (area.top + area.bottom) / 2.0,
            &format!("{}{}", self.y_label, y_axis.remark()),
        ));
        content
    }

    /// Symbols with names in as many rows as the width needs, and the height of the rows.
    fn legend(&self) -> (String, f64) {
        let mut content = String::new();
        let left = 14.0;
        let (mut x, mut y) = (left, LINE_HEIGHT / 2.0 + 2.0);
        let mut height = 0.0;
        for layer in &self.layers {
            let name = shorten(layer.name(), LONGEST_NAME);
            if name.is_empty() || layer.is_empty() {
                continue;
            }
            let width = SYMBOL_WIDTH + text_width(&name) + 16.0;
            if x > left && x + width > self.size.width {
                x = left;
                y += LINE_HEIGHT;
            }
            content.push_str(&layer.symbol(x, y));
            let after_symbol = x + SYMBOL_WIDTH;
            content.push_str(&text("key", after_symbol, y + 4.0, Anchor::Start, &name));
            x += width;
            height = y + LINE_HEIGHT / 2.0;
        }
        (content, height)
    }
}

#[cfg(test)]
mod tests {
    use super::super::marker::Marker;
    use super::*;

    fn plot(layers: Vec<Layer>) -> String {
        Plot {
            size: Size {
                width: 400.0,
                height: 300.0,
            },
            description: "a <plot>",
            x_label: "frame",
            y_label: "cost (ms)",
            y_range: Range::Fitted,
            layers,
        }
        .draw()
    }

    fn marks(values: &[(f64, f64)]) -> Layer {
        Layer::Marks {
            name: "tried & told".to_string(),
            marker: Marker::Circle,
            radius: 4.0,
            marks: values
                .iter()
                .map(|&(x, y)| Mark {
                    x,
                    y,
                    class: "plain".to_string(),
                    title: format!("at {x}"),
                })
                .collect(),
        }
    }

    #[test]
    fn every_mark_is_drawn_and_lies_inside() {
        let drawn = plot(vec![marks(&[(0.0, 3.0), (1.0, 70.0), (2.0, 1.0)])]);
        // One more circle is the symbol of the legend.
        assert_eq!(drawn.matches("<circle").count(), 4);
        for (attribute, limit) in [("cx=\"", 400.0), ("cy=\"", 300.0)] {
            for piece in drawn.split(attribute).skip(1) {
                let value: f64 = piece.split('"').next().unwrap().parse().unwrap();
                assert!((0.0..=limit).contains(&value), "{attribute}{value}");
            }
        }
    }

    #[test]
    fn a_higher_value_is_drawn_higher() {
        let drawn = plot(vec![marks(&[(0.0, 10.0), (1.0, 11.0)])]);
        let heights: Vec<f64> = drawn
            .split("cy=\"")
            .skip(2)
            .map(|piece| piece.split('"').next().unwrap().parse().unwrap())
            .collect();
        assert!(heights[1] < heights[0], "{heights:?}");
    }

    #[test]
    fn a_step_line_holds_its_value_until_the_next_point() {
        let drawn = plot(vec![Layer::Steps {
            name: String::new(),
            class: "incumbent",
            points: vec![(0.0, 9.0), (4.0, 5.0)],
        }]);
        let d = drawn.split("d=\"M").nth(1).unwrap();
        let corners: Vec<(f64, f64)> = d
            .split('"')
            .next()
            .unwrap()
            .split('L')
            .map(|corner| {
                let (x, y) = corner.split_once(',').unwrap();
                (x.parse().unwrap(), y.parse().unwrap())
            })
            .collect();
        assert_eq!(corners.len(), 4);
        assert_eq!(corners[0].1, corners[1].1);
        assert_eq!(corners[1].0, corners[2].0);
        assert_eq!(corners[2].1, corners[3].1);
        assert!(corners[2].1 > corners[1].1);
    }

    #[test]
    fn names_and_labels_are_escaped() {
        let drawn = plot(vec![marks(&[(0.0, 1.0)])]);
        assert!(drawn.contains("tried &amp; told"));
        assert!(drawn.contains("a &lt;plot&gt;"));
    }

    #[test]
    fn a_logarithmic_axis_says_so() {
        let wide = plot(vec![marks(&[(0.0, 1.0), (1.0, 10.0), (2.0, 100.0)])]);
        assert!(wide.contains("cost (ms), log scale"));
        let narrow = plot(vec![marks(&[(0.0, 50.0), (1.0, 100.0)])]);
        assert!(!narrow.contains("log scale"));
    }

    #[test]
    fn what_is_not_finite_is_left_out() {
        let drawn = plot(vec![
            marks(&[(0.0, f64::NAN), (f64::INFINITY, 2.0), (3.0, 4.0)]),
            Layer::Level {
                name: "level".to_string(),
                class: "s0".to_string(),
                y: f64::NAN,
                band: (f64::NAN, f64::INFINITY),
            },
            Layer::Steps {
                name: "steps".to_string(),
                class: "incumbent",
                points: vec![(0.0, f64::NAN)],
            },
        ]);
        assert_eq!(drawn.matches("<circle").count(), 2);
        assert!(!drawn.contains("NaN") && !drawn.contains("inf"), "{drawn}");
    }

    #[test]
    fn a_legend_too_wide_for_one_row_makes_room() {
        let layer = |name: &str| Layer::Absences {
            name: name.to_string(),
            places: vec![(0.0, String::new())],
        };
        let rows = |names: &[&str]| {
            let layers = names.iter().map(|name| layer(name)).collect();
            let plot = Plot {
                size: Size {
                    width: 400.0,
                    height: 300.0,
                },
                description: "",
                x_label: "",
                y_label: "",
                y_range: Range::Fitted,
                layers,
            };
            plot.legend().1
        };
        let long = "a name of about thirty letters";
        assert_eq!(rows(&[]), 0.0);
        assert!(rows(&[long, long]) > rows(&[long]));
        assert_eq!(rows(&["a", "b"]), rows(&["a"]));
    }
}
