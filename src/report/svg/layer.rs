//! What a plot of two axes is made of: marks, lines, columns, intervals, levels.
//!
//! A layer knows its values and how they are drawn; where they lie is known by [`Place`].

use super::axis::Axis;
use super::marker::Marker;
use super::{Area, line, path, tooltip};

/// Width of the symbol before a name in the legend.
pub(super) const SYMBOL_WIDTH: f64 = 26.0;

/// A value with its look.
#[derive(Clone, Debug)]
pub(crate) struct Mark {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Class that gives the colour.
    pub(crate) class: String,
    /// Shown when the pointer rests on the mark.
    pub(crate) title: String,
}

/// A rectangle that stands on another one, or on zero.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    /// Its middle.
    pub(crate) x: f64,
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) title: String,
}

/// A value with its bounds, which are not finite where there are none.
#[derive(Clone, Debug)]
pub(crate) struct Interval {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    pub(crate) title: String,
}

/// One kind of thing in a plot. The legend names what has a name and a value.
#[derive(Clone, Debug)]
pub(crate) enum Layer {
    /// Separate values.
    Marks {
        name: String,
        marker: Marker,
        radius: f64,
        marks: Vec<Mark>,
    },
    /// A value that holds until the next one: (x, y) in order of x. Extends to the end of the axis.
    Steps {
        name: String,
        class: &'static str,
        points: Vec<(f64, f64)>,
    },
    /// A value that holds everywhere, with its quartiles as a band.
    Level {
        name: String,
        class: String,
        y: f64,
        band: (f64, f64),
    },
    /// Values joined by straight lines: (x, y) in order of x.
    Line {
        name: String,
        class: &'static str,
        points: Vec<(f64, f64)>,
    },
    /// Upright rectangles, this wide in units of x. One that is higher than the axis is cut there
    /// and has a mark at its upper end.
    Columns {
        name: String,
        class: &'static str,
        width: f64,
        columns: Vec<Column>,
    },
    /// Values with bounds. A bound that does not exist lies beyond the axis.
    Intervals {
        name: String,
        class: &'static str,
        marker: Marker,
        intervals: Vec<Interval>,
    },
    /// Places that have an x but no y: crosses along the upper edge.
    Absences {
        name: String,
        /// x and what the pointer shows.
        places: Vec<(f64, String)>,
    },
}

/// Where values lie in a plot.
pub(super) struct Place {
    pub(super) area: Area,
    pub(super) x_axis: Axis,
    pub(super) y_axis: Axis,
}

impl Place {
    fn x(&self, value: f64) -> Option<f64> {
        let position = self.x_axis.fraction(value)?;
        Some(self.area.x(position))
    }

    fn y(&self, value: f64) -> Option<f64> {
        let position = self.y_axis.fraction(value)?;
        Some(self.area.y(position))
    }

    /// The corners of a line of steps, up to the end of the axis.
    fn steps(&self, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let mut corners: Vec<(f64, f64)> = Vec::new();
        for &(x, y) in points {
            let (Some(x), Some(y)) = (self.x(x), self.y(y)) else {
                continue;
            };
            if let Some(&(_, before)) = corners.last() {
                corners.push((x, before));
            }
            corners.push((x, y));
        }
        if let Some(&(_, last)) = corners.last() {
            corners.push((self.area.right, last));
        }
        corners
    }

    fn column(&self, class: &str, width: f64, column: &Column) -> Option<String> {
        let (left, right) = (
            self.x(column.x - 0.5 * width)?,
            self.x(column.x + 0.5 * width)?,
        );
        let (bottom, top) = (self.y(column.from)?, self.y(column.to)?);
        let (bottom, end) = (bottom.max(self.area.top), top.max(self.area.top));
        // A gap between neighbours, where there is room for one.
        let gap = if right - left > 4.0 { 0.5 } else { 0.0 };
        let mut drawn = rectangle(
            class,
            (left + gap, end),
            (right - gap, bottom),
            &column.title,
        );
        if top < self.area.top - 0.5 {
            let x = 0.5 * (left + right);
            drawn.push_str(&Marker::Triangle.draw(
                class,
                x,
                self.area.top - 4.0,
                3.5,
                &column.title,
            ));
        }
        Some(drawn)
    }

    fn interval(&self, class: &str, marker: Marker, one: &Interval) -> Option<String> {
        let (x, y) = (self.x(one.x)?, self.y(one.y)?);
        let inside = |y: f64| y.clamp(self.area.top, self.area.bottom);
        let (lower, upper) = (self.y(one.lower), self.y(one.upper));
        let open = if lower.is_none() || upper.is_none() {
            " unbounded"
        } else {
            ""
        };
        let lower = lower.map_or(self.area.bottom, inside);
        let upper = upper.map_or(self.area.top, inside);
        let whisker = line(&format!("error{open} {class}"), (x, lower), (x, upper));
        Some(whisker + &marker.draw(class, x, y, 3.5, &one.title))
    }
}

/// From the upper left to the lower right corner.
fn rectangle(class: &str, from: (f64, f64), to: (f64, f64), title: &str) -> String {
    format!(
        "<rect class=\"fill {class}\" x=\"{:.2}\" y=\"{:.1}\" width=\"{:.2}\" height=\"{:.1}\">{}</rect>\n",
        from.0,
        from.1,
        (to.0 - from.0).max(0.0),
        (to.1 - from.1).max(0.0),
        tooltip(title)
    )
}

impl Layer {
    pub(super) fn name(&self) -> &str {
        match self {
            Layer::Marks { name, .. }
            | Layer::Steps { name, .. }
            | Layer::Level { name, .. }
            | Layer::Line { name, .. }
            | Layer::Columns { name, .. }
            | Layer::Intervals { name, .. }
            | Layer::Absences { name, .. } => name,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        match self {
            Layer::Level { y, .. } => !y.is_finite(),
            _ => self.x_values().is_empty() && self.y_values().is_empty(),
        }
    }

    pub(super) fn x_values(&self) -> Vec<f64> {
        match self {
            Layer::Marks { marks, .. } => marks.iter().map(|mark| mark.x).collect(),
            Layer::Steps { points, .. } | Layer::Line { points, .. } => {
                points.iter().map(|point| point.0).collect()
            }
            Layer::Columns { width, columns, .. } => columns
                .iter()
                .flat_map(|column| [column.x - 0.5 * width, column.x + 0.5 * width])
                .collect(),
            Layer::Intervals { intervals, .. } => intervals.iter().map(|one| one.x).collect(),
            Layer::Level { .. } => Vec::new(),
            Layer::Absences { places, .. } => places.iter().map(|place| place.0).collect(),
        }
    }

    pub(super) fn y_values(&self) -> Vec<f64> {
        match self {
            Layer::Marks { marks, .. } => marks.iter().map(|mark| mark.y).collect(),
            Layer::Steps { points, .. } | Layer::Line { points, .. } => {
                points.iter().map(|point| point.1).collect()
            }
            Layer::Columns { columns, .. } => columns.iter().map(|column| column.to).collect(),
            Layer::Intervals { intervals, .. } => intervals
                .iter()
                .flat_map(|one| [one.y, one.lower, one.upper])
                .collect(),
            Layer::Level { y, band, .. } => vec![*y, band.0, band.1],
            Layer::Absences { .. } => Vec::new(),
        }
    }

    pub(super) fn draw(&self, place: &Place) -> String {
        let area = &place.area;
        let (x_of, y_of) = (|value| place.x(value), |value| place.y(value));
        match self {
            Layer::Marks {
                marker,
                radius,
                marks,
                ..
            } => marks
                .iter()
                .filter_map(|mark| {
                    let (x, y) = (x_of(mark.x)?, y_of(mark.y)?);
                    Some(marker.draw(&mark.class, x, y, *radius, &mark.title))
                })
                .collect(),
            Layer::Steps { class, points, .. } => {
                let corners = place.steps(points);
                if corners.is_empty() {
                    return String::new();
                }
                path(&format!("steps {class}"), &corners, self.name())
            }
            Layer::Line { class, points, .. } => {
                let points: Vec<(f64, f64)> = points
                    .iter()
                    .filter_map(|&(x, y)| Some((x_of(x)?, y_of(y)?)))
                    .collect();
                if points.is_empty() {
                    return String::new();
                }
                path(&format!("steps {class}"), &points, self.name())
            }
            Layer::Columns {
                class,
                width,
                columns,
                ..
            } => columns
                .iter()
                .filter_map(|column| place.column(class, *width, column))
                .collect(),
            Layer::Intervals {
                class,
                marker,
                intervals,
                ..
            } => intervals
                .iter()
                .filter_map(|one| place.interval(class, *marker, one))
                .collect(),
            Layer::Level { class, y, band, .. } => {
                let mut content = String::new();
                if let (Some(below), Some(above)) = (y_of(band.0), y_of(band.1)) {
                    content.push_str(&format!(
                        "<rect class=\"band {class}\" x=\"{:.1}\" y=\"{above:.1}\" \
                         width=\"{:.1}\" height=\"{:.1}\"/>\n",
                        area.left,
                        area.right - area.left,
                        (below - above).max(0.0),
                    ));
                }
                if let Some(y) = y_of(*y) {
                    let class = format!("level {class}");
                    content.push_str(&path(
                        &class,
                        &[(area.left, y), (area.right, y)],
                        self.name(),
                    ));
                }
                content
            }
            Layer::Absences { places, .. } => places
                .iter()
                .filter_map(|(x, title)| {
                    Some(Marker::Cross.draw("bad", x_of(*x)?, area.top, 4.0, title))
                })
                .collect(),
        }
    }

    /// What stands before the name in the legend, from `x` on and centred at `y`.
    pub(super) fn symbol(&self, x: f64, y: f64) -> String {
        let middle = x + SYMBOL_WIDTH / 2.0 - 3.0;
        let right = x + SYMBOL_WIDTH - 6.0;
        match self {
            Layer::Marks { marker, marks, .. } => {
                let class = marks.first().map_or("plain", |mark| &mark.class);
                marker.draw(class, middle, y, 4.5, "")
            }
            Layer::Columns { class, .. } => {
                rectangle(class, (x + 4.0, y - 6.0), (right, y + 6.0), "")
            }
            Layer::Intervals { class, marker, .. } => {
                line(
                    &format!("error {class}"),
                    (middle, y - 8.0),
                    (middle, y + 8.0),
                ) + &marker.draw(class, middle, y, 3.5, "")
            }
            Layer::Steps { class, .. } | Layer::Line { class, .. } => {
                path(&format!("steps {class}"), &[(x, y), (right, y)], "")
            }
            Layer::Level { class, .. } => {
                path(&format!("level {class}"), &[(x, y), (right, y)], "")
            }
            Layer::Absences { .. } => Marker::Cross.draw("bad", middle, y, 4.0, ""),
        }
    }
}
