//! Small plots as inline SVG: pure functions from data to text.
//!
//! A plot is written for the page around it: colours are classes and custom properties which the
//! page's style sheet defines, so that one drawing serves light and dark. Positions are pixels of
//! the view box with y downwards. Invariants: every coordinate is finite, since [`axis::Axis`] gives
//! no position to what is not; every text is escaped; nothing refers outside the file.

pub(crate) mod axis;
pub(crate) mod bars;
pub(crate) mod color;
pub(crate) mod heat;
mod layer;
pub(crate) mod marker;
pub(crate) mod parallel;
pub(crate) mod xy;

use super::markup::escape;

/// Size of a plot's view box in pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Size {
    pub(crate) width: f64,
    pub(crate) height: f64,
}

/// Height of a line of text: `font-size` of the plots in the style sheet, and some air.
pub(crate) const LINE_HEIGHT: f64 = 18.0;

/// The rectangle in which the data lie.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Area {
    pub(crate) left: f64,
    pub(crate) top: f64,
    pub(crate) right: f64,
    pub(crate) bottom: f64,
}

impl Area {
    /// Position of a fraction of the width, from the left.
    pub(crate) fn x(&self, fraction: f64) -> f64 {
        self.left + fraction * (self.right - self.left)
    }

    /// Position of a fraction of the height, from the bottom.
    pub(crate) fn y(&self, fraction: f64) -> f64 {
        self.bottom - fraction * (self.bottom - self.top)
    }
}

/// Where a text is attached to its position.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Anchor {
    /// The text begins there.
    Start,
    /// The text is centred there.
    Middle,
    /// The text ends there.
    End,
}

impl Anchor {
    fn keyword(self) -> &'static str {
        match self {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        }
    }
}

/// A drawing of the given size; `description` is what a screen reader says instead of it.
pub(crate) fn drawing(size: Size, description: &str, content: &str) -> String {
    let Size { width, height } = size;
    format!(
        "<svg viewBox=\"0 0 {width:.0} {height:.0}\" role=\"img\" aria-label=\"{}\" \
         style=\"min-width:{:.0}px;max-width:{:.0}px\">\n{content}</svg>\n",
        escape(description),
        // Letters keep a size that can be read: a narrow page scrolls the plot, a wide one leaves
        // a margin.
        width * 0.85,
        width * 1.1,
    )
}

/// A straight line.
pub(crate) fn line(class: &str, from: (f64, f64), to: (f64, f64)) -> String {
    format!(
        "<line class=\"{class}\" x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\"/>\n",
        from.0, from.1, to.0, to.1
    )
}

/// A line through points, drawn as one path.
pub(crate) fn path(class: &str, points: &[(f64, f64)], title: &str) -> String {
    let steps: Vec<String> = points
        .iter()
        .map(|(x, y)| format!("{x:.1},{y:.1}"))
        .collect();
    format!(
        "<path class=\"{class}\" d=\"M{}\">{}</path>\n",
        steps.join("L"),
        tooltip(title)
    )
}

/// A text whose base line is at `y`.
pub(crate) fn text(class: &str, x: f64, y: f64, anchor: Anchor, content: &str) -> String {
    format!(
        "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{}\">{}</text>\n",
        anchor.keyword(),
        escape(content)
    )
}

/// A text that reads upwards, centred at (`x`, `y`).
pub(crate) fn upward_text(class: &str, x: f64, y: f64, content: &str) -> String {
    format!(
        "<text class=\"{class}\" transform=\"translate({x:.1} {y:.1}) rotate(-90)\" \
         text-anchor=\"middle\">{}</text>\n",
        escape(content)
    )
}

/// What is shown when the pointer rests on an element.
pub(crate) fn tooltip(title: &str) -> String {
    if title.is_empty() {
        String::new()
    } else {
        format!("<title>{}</title>", escape(title))
    }
}

/// About how wide a text will be. Fonts differ; the factor is on the safe side for sans serif.
pub(crate) fn text_width(text: &str) -> f64 {
    7.0 * text.chars().count() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_and_titles_are_escaped() {
        for drawn in [
            text("tick", 0.0, 0.0, Anchor::Start, "a<b>&\"c"),
            upward_text("label", 0.0, 0.0, "a<b>&\"c"),
            path("step", &[(0.0, 0.0)], "a<b>&\"c"),
            drawing(
                Size {
                    width: 10.0,
                    height: 10.0,
                },
                "a<b>&\"c",
                "",
            ),
        ] {
            assert!(drawn.contains("a&lt;b&gt;&amp;&quot;c"), "{drawn}");
        }
    }

    #[test]
    fn area_counts_y_from_the_bottom() {
        let area = Area {
            left: 10.0,
            top: 20.0,
            right: 110.0,
            bottom: 220.0,
        };
        assert_eq!((area.x(0.0), area.x(1.0)), (10.0, 110.0));
        assert_eq!((area.y(0.0), area.y(1.0)), (220.0, 20.0));
    }
}
