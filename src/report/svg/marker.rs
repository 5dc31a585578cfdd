//! Marks of single values. Shapes differ, so that a plot is readable without its colours.

use super::tooltip;

/// Shape of a mark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Marker {
    Circle,
    Diamond,
    Square,
    Triangle,
    Cross,
}

impl Marker {
    /// The mark at (`x`, `y`), about `2 * radius` wide; the pointer on it shows `title`.
    pub(crate) fn draw(self, class: &str, x: f64, y: f64, radius: f64, title: &str) -> String {
        let title = tooltip(title);
        let corners = match self {
            Marker::Circle => {
                return format!(
                    "<circle class=\"mark {class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\">\
                     {title}</circle>\n"
                );
            }
            Marker::Cross => {
                let (left, right, top, bottom) = (x - radius, x + radius, y - radius, y + radius);
                return format!(
                    "<path class=\"cross {class}\" d=\"M{left:.1},{top:.1}L{right:.1},{bottom:.1}\
                     M{left:.1},{bottom:.1}L{right:.1},{top:.1}\">{title}</path>\n"
                );
            }
            Marker::Diamond => vec![(0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)],
            Marker::Square => vec![(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)],
            Marker::Triangle => vec![(0.0, -1.3), (1.2, 0.9), (-1.2, 0.9)],
        };
        let corners: Vec<String> = corners
            .into_iter()
            .map(|(right, down)| format!("{:.1},{:.1}", x + right * radius, y + down * radius))
            .collect();
        format!(
            "<path class=\"mark {class}\" d=\"M{}Z\">{title}</path>\n",
            corners.join("L")
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_differ_and_carry_class_and_title() {
        let drawn = [
            Marker::Circle,
            Marker::Diamond,
            Marker::Square,
            Marker::Triangle,
            Marker::Cross,
        ]
        .map(|marker| marker.draw("s1", 10.0, 20.0, 4.0, "frame <3>"));
        for (index, one) in drawn.iter().enumerate() {
            assert!(one.contains(" s1\""), "{one}");
            assert!(one.contains("<title>frame &lt;3&gt;</title>"), "{one}");
            assert!(!drawn[..index].contains(one));
        }
    }
}
