//! Heat maps: one coloured cell for each pair of classes that occurs.
//!
//! Colours are steps of the ramp of [`color`]; the value is also written in the cell, so that it can
//! be read in black and white. Pairs without a value stay empty: nothing is interpolated.

use super::{Anchor, Area, LINE_HEIGHT, Size, color, drawing, line, text, tooltip, upward_text};

/// A cell with a value.
#[derive(Clone, Debug)]
pub(crate) struct Cell {
    /// Index of the name along x.
    pub(crate) column: usize,
    /// Index of the name along y, from the foot.
    pub(crate) row: usize,
    /// 0 for the best colour, 1 for the worst.
    pub(crate) rank: f64,
    /// What is written in it: a few letters.
    pub(crate) label: String,
    pub(crate) title: String,
}

/// A heat map before it is drawn.
#[derive(Clone, Debug)]
pub(crate) struct HeatMap<'a> {
    pub(crate) size: Size,
    /// Written above it, and what a screen reader says.
    pub(crate) title: &'a str,
    pub(crate) x_label: &'a str,
    pub(crate) y_label: &'a str,
    /// Names of the classes, in order from the corner on.
    pub(crate) x_names: &'a [String],
    pub(crate) y_names: &'a [String],
    pub(crate) cells: Vec<Cell>,
}

impl HeatMap<'_> {
    /// The map as an SVG element.
    pub(crate) fn draw(&self) -> String {
        let area = Area {
            left: 74.0,
            top: 30.0,
            right: self.size.width - 8.0,
            bottom: self.size.height - 46.0,
        };
        let columns = self.x_names.len().max(1) as f64;
        let rows = self.y_names.len().max(1) as f64;
        let (wide, high) = (
            (area.right - area.left) / columns,
            (area.bottom - area.top) / rows,
        );
        let mut content = text("label", area.left, 16.0, Anchor::Start, self.title);
        for cell in &self.cells {
            let x = area.left + cell.column as f64 * wide;
            let y = area.bottom - (cell.row as f64 + 1.0) * high;
            content.push_str(&format!(
                "<rect class=\"fill {}\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" \
                 height=\"{:.1}\">{}</rect>\n",
                color::class(cell.rank),
                x + 1.0,
                y + 1.0,
                wide - 2.0,
                high - 2.0,
                tooltip(&cell.title)
            ));
            let middle = (x + wide / 2.0, y + high / 2.0 + 4.0);
            content.push_str(&text(
                "key halo",
                middle.0,
                middle.1,
                Anchor::Middle,
                &cell.label,
            ));
        }
        for (index, name) in self.x_names.iter().enumerate() {
            let x = area.left + (index as f64 + 0.5) * wide;
            let y = area.bottom + LINE_HEIGHT;
            content.push_str(&text("tick", x, y, Anchor::Middle, name));
        }
        for (index, name) in self.y_names.iter().enumerate() {
            let y = area.bottom - (index as f64 + 0.5) * high + 4.0;
            content.push_str(&text("tick", area.left - 7.0, y, Anchor::End, name));
        }
        let corner = (area.left, area.bottom);
        content.push_str(&line("axis", corner, (area.right, area.bottom)));
        content.push_str(&line("axis", corner, (area.left, area.top)));
        content.push_str(&text(
            "label",
            area.x(0.5),
            self.size.height - 8.0,
            Anchor::Middle,
            self.x_label,
        ));
        content.push_str(&upward_text("label", 15.0, area.y(0.5), self.y_label));
        drawing(self.size, self.title, &content)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(cells: Vec<Cell>) -> String {
        HeatMap {
            size: Size {
                width: 420.0,
                height: 380.0,
            },
            title: "a <map>",
            x_label: "least & most",
            y_label: "most",
            x_names: &["1".to_string(), "2".to_string()],
            y_names: &["1".to_string(), "2".to_string(), "4–7".to_string()],
            cells,
        }
        .draw()
    }

    #[test]
    fn cells_are_coloured_by_rank_and_bear_their_value() {
        let cell = |column, row, rank| Cell {
            column,
            row,
            rank,
            label: format!("{column}:{row}"),
            title: "<b>".to_string(),
        };
        let map = drawn(vec![cell(0, 0, 0.0), cell(1, 2, 1.0)]);
        assert_eq!(map.matches("<rect").count(), 2);
        assert!(map.contains("fill r0\"") && map.contains("fill r23\""));
        assert!(map.contains(">1:2<") && map.contains("&lt;b&gt;"));
        assert!(map.contains("a &lt;map&gt;") && map.contains("least &amp; most"));
        // The second row is above the first.
        let ys: Vec<f64> = map
            .split("<rect")
            .skip(1)
            .map(|rect| {
                let y = rect.split(" y=\"").nth(1).unwrap();
                y.split('"').next().unwrap().parse().unwrap()
            })
            .collect();
        assert!(ys[1] < ys[0], "{ys:?}");
    }

    #[test]
    fn an_empty_map_has_axes_alone() {
        let map = drawn(vec![]);
        assert!(!map.contains("<rect") && map.contains(">4–7<"));
    }
}
