//! Parallel coordinates: one upright axis for each parameter, one line for each configuration
//! (Inselberg, "The plane with parallel coordinates", The Visual Computer 1, 1985).
//!
//! A column whose values are all numbers is scaled, and marked at the values themselves if these are
//! few; any other column is ordinal, its words in alphabetical order. A configuration that lacks a
//! parameter passes below the axis. Poor with thousands of lines: what lies below is hidden.

use super::axis::{Axis, Tick};
use super::{Anchor, Area, LINE_HEIGHT, Size, color, drawing, line, path, text, text_width};
use crate::report::markup::shorten;
use crate::report::number;

/// Least distance of two axes.
const LEAST_DISTANCE: f64 = 74.0;
const HEIGHT: f64 = 380.0;
/// Names are cut beyond this: they stand in two rows, so that each may take two distances.
const LONGEST_NAME: usize = 20;
/// Words at the ticks are cut beyond this.
const LONGEST_WORD: usize = 14;
/// Room beside the outermost axes for half a name.
const LEAST_MARGIN: f64 = 65.0;
/// Up to so many different numbers are marked each by a tick of its own.
const FEW: usize = 7;
/// Where values begin if the lowest place of the axis is taken by "absent".
const ABOVE_ABSENT: f64 = 0.12;

/// One configuration: a value for each column, or none.
#[derive(Clone, Debug)]
pub(crate) struct Strand {
    pub(crate) values: Vec<Option<String>>,
    /// 0 for the best, 1 for the worst.
    pub(crate) rank: f64,
    /// Shown when the pointer rests on the line.
    pub(crate) title: String,
}

/// The plot of `strands`, whose values are in the order of `columns`. Better ones lie on top.
pub(crate) fn parallel_coordinates(
    least_width: f64,
    description: &str,
    columns: &[String],
    strands: &[Strand],
) -> String {
    let gaps = columns.len().saturating_sub(1) as f64;
    let scales: Vec<Column<'_>> = (0..columns.len())
        .map(|column| Column::new(strands.iter().map(|strand| strand.value(column))))
        .collect();
    // Labels stand to the left of their axis.
    let labels = scales.first().map(Column::ticks).unwrap_or_default();
    let left = labels
        .iter()
        .map(|(_, label)| text_width(label) + 12.0)
        .fold(LEAST_MARGIN, f64::max);
    let size = Size {
        width: least_width.max(gaps * LEAST_DISTANCE + left + LEAST_MARGIN),
        height: HEIGHT,
    };
    let area = Area {
        left,
        top: 2.0 * LINE_HEIGHT + 16.0,
        right: size.width - LEAST_MARGIN,
        bottom: size.height - 14.0,
    };
    let x_of = |column: usize| {
        if gaps == 0.0 {
            area.x(0.5)
        } else {
            area.x(column as f64 / gaps)
        }
    };

    let mut order: Vec<&Strand> = strands.iter().collect();
    order.sort_by(|one, other| other.rank.total_cmp(&one.rank));
    let mut content = String::new();
    for (index, strand) in order.iter().enumerate() {
        let points: Vec<(f64, f64)> = scales
            .iter()
            .enumerate()
            .filter_map(|(column, scale)| {
                let position = scale.fraction(strand.value(column))?;
                Some((x_of(column), area.y(position)))
            })
            .collect();
        if points.is_empty() {
            continue;
        }
        let best = if index + 1 == order.len() {
            " best"
        } else {
            ""
        };
        let class = format!("strand {}{best}", color::class(strand.rank));
        content.push_str(&path(&class, &points, &strand.title));
    }
    for (column, (name, scale)) in columns.iter().zip(&scales).enumerate() {
        content.push_str(&draw_column(column, name, scale, x_of(column), &area));
    }
    drawing(size, description, &content)
}

fn draw_column(index: usize, name: &str, scale: &Column<'_>, x: f64, area: &Area) -> String {
    let mut content = line("axis", (x, area.top), (x, area.bottom));
    // Neighbours stand in different rows, so that long names do not touch.
    let row = LINE_HEIGHT * (1 + index % 2) as f64;
    content.push_str(&text(
        "key",
        x,
        row,
        Anchor::Middle,
        &shorten(name, LONGEST_NAME),
    ));
    let mut lowest_free = f64::INFINITY;
    for (position, label) in scale.ticks() {
        let y = area.y(position);
        content.push_str(&line("axis", (x - 4.0, y), (x, y)));
        // Labels go upwards; one that would touch the label below is left to its tick alone.
        if y <= lowest_free {
            content.push_str(&text("tick halo", x - 7.0, y + 4.0, Anchor::End, &label));
            lowest_free = y - 13.0;
        }
    }
    content
}

impl Strand {
    fn value(&self, column: usize) -> Option<&str> {
        self.values.get(column)?.as_deref()
    }
}

/// How the values of one parameter are placed on its axis.
struct Column<'a> {
    scale: ColumnScale<'a>,
    /// Where values begin: above the place of "absent", if any configuration lacks the parameter.
    begin: f64,
}

enum ColumnScale<'a> {
    Numbers(Axis),
    /// In order, without repetition.
    Words(Vec<&'a str>),
}

impl<'a> Column<'a> {
    fn new(values: impl Iterator<Item = Option<&'a str>>) -> Column<'a> {
        let mut present = Vec::new();
        let mut begin = 0.0;
        for value in values {
            match value {
                Some(value) => present.push(value),
                None => begin = ABOVE_ABSENT,
            }
        }
        let numbers: Option<Vec<f64>> = present.iter().map(|value| parse_number(value)).collect();
        let scale = match numbers {
            Some(numbers) if !numbers.is_empty() => ColumnScale::Numbers(numeric_axis(numbers)),
            _ => {
                present.sort_unstable();
                present.dedup();
                ColumnScale::Words(present)
            }
        };
        Column { scale, begin }
    }

    /// Position of a value on the axis, 0 at its foot. `None` if it cannot be shown.
    fn fraction(&self, value: Option<&str>) -> Option<f64> {
        let Some(value) = value else {
            return Some(0.0);
        };
        let position = match &self.scale {
            ColumnScale::Numbers(axis) => axis.fraction(parse_number(value)?)?,
            ColumnScale::Words(words) => {
                let index = words.binary_search(&value).ok()?;
                (index as f64 + 0.5) / words.len() as f64
            }
        };
        Some(self.begin + (1.0 - self.begin) * position)
    }

    /// Positions and labels, from the foot upwards.
    fn ticks(&self) -> Vec<(f64, String)> {
        let mut ticks = Vec::new();
        if self.begin > 0.0 {
            ticks.push((0.0, "absent".to_string()));
        }
        match &self.scale {
            ColumnScale::Numbers(axis) => {
                for (position, tick) in axis.ticks() {
                    let position = self.begin + (1.0 - self.begin) * position;
                    ticks.push((position, tick.label.clone()));
                }
            }
            ColumnScale::Words(words) => {
                for &word in words {
                    if let Some(position) = self.fraction(Some(word)) {
                        ticks.push((position, shorten(word, LONGEST_WORD)));
                    }
                }
            }
        }
        ticks
    }
}

/// Rust reads `inf` and `nan` as numbers; on an axis they are words.
fn parse_number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

fn numeric_axis(mut numbers: Vec<f64>) -> Axis {
    let axis = Axis::fitting(numbers.iter().copied());
    numbers.sort_by(f64::total_cmp);
    numbers.dedup();
    if numbers.len() > FEW {
        return axis;
    }
    axis.with_ticks_at(
        numbers
            .into_iter()
            .map(|value| Tick {
                value,
                label: number::brief(value, 4),
            })
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strand(values: &[&str], rank: f64) -> Strand {
        Strand {
            values: values
                .iter()
                .map(|value| (!value.is_empty()).then(|| value.to_string()))
                .collect(),
            rank,
            title: format!("rank {:.1}", rank.max(0.0)),
        }
    }

    fn names(count: usize) -> Vec<String> {
        (0..count).map(|index| format!("<{index}>")).collect()
    }

    #[test]
    fn every_strand_crosses_every_axis() {
        let strands = [
            strand(&["2", "true", "1.5"], 0.0),
            strand(&["8", "false", "3.5"], 1.0),
        ];
        let drawn = parallel_coordinates(600.0, "all", &names(3), &strands);
        let paths: Vec<&str> = drawn.split("<path class=\"strand").skip(1).collect();
        assert_eq!(paths.len(), 2);
        for path in paths {
            let d = path
                .split("d=\"")
                .nth(1)
                .unwrap()
                .split('"')
                .next()
                .unwrap();
            assert_eq!(d.split('L').count(), 3);
        }
    }

    #[test]
    fn the_best_lies_on_top_and_only_it_is_marked() {
        let strands = [
            strand(&["1"], 0.0),
            strand(&["2"], 1.0),
            strand(&["3"], 0.5),
        ];
        let drawn = parallel_coordinates(600.0, "all", &names(1), &strands);
        let titles: Vec<&str> = drawn
            .split("<title>")
            .skip(1)
            .map(|rest| rest.split('<').next().unwrap())
            .collect();
        assert_eq!(titles, ["rank 1.0", "rank 0.5", "rank 0.0"]);
        assert_eq!(drawn.matches(" best\"").count(), 1);
    }

    #[test]
    fn numbers_are_scaled_and_words_are_equally_far_apart() {
        let numbers = Column::new(["1", "2", "4"].into_iter().map(Some));
        let at = |value| numbers.fraction(Some(value)).unwrap();
        assert!((at("4") - at("2") - 2.0 * (at("2") - at("1"))).abs() < 1e-12);

        let words = Column::new(["true", "false", "other"].into_iter().map(Some));
        let at = |value| words.fraction(Some(value)).unwrap();
        assert!((at("true") - at("other") - (at("other") - at("false"))).abs() < 1e-12);
        assert!(at("false") < at("true"));
    }

    #[test]
    fn one_word_among_numbers_makes_words_of_all() {
        let column = Column::new(["1", "2", "inf"].into_iter().map(Some));
        assert!(matches!(column.scale, ColumnScale::Words(_)));
    }

    #[test]
    fn few_numbers_are_marked_at_themselves() {
        let column = Column::new(["2", "8", "4", "8"].into_iter().map(Some));
        let labels: Vec<String> = column.ticks().into_iter().map(|tick| tick.1).collect();
        assert_eq!(labels, ["2", "4", "8"]);
    }

    #[test]
    fn the_absent_passes_below_all_values() {
        let column = Column::new([Some("1"), None, Some("3")].into_iter());
        assert_eq!(column.fraction(None), Some(0.0));
        assert!(column.fraction(Some("1")).unwrap() >= ABOVE_ABSENT);
        assert_eq!(column.ticks()[0].1, "absent");
    }

    #[test]
    fn degenerate_input_gives_no_nan() {
        for (columns, strands) in [
            (0, vec![]),
            (0, vec![strand(&[], 0.0)]),
            (2, vec![]),
            (2, vec![strand(&["", ""], 0.0)]),
            (2, vec![strand(&["nan", "1e308"], f64::NAN)]),
            (3, vec![strand(&["5", "5"], 0.0), strand(&["5", "5"], 0.0)]),
        ] {
            let drawn = parallel_coordinates(600.0, "all", &names(columns), &strands);
            assert!(
                !drawn.contains("NaN") && !drawn.contains("\"inf"),
                "{drawn}"
            );
        }
    }

    #[test]
    fn words_at_the_first_axis_are_not_cut_off() {
        let strands = [strand(&["agglomerative", "1"], 0.0)];
        let drawn = parallel_coordinates(600.0, "all", &names(2), &strands);
        assert!(drawn.contains(">agglomerative<"));
        let label = drawn.split("tick halo\" x=\"").nth(1).unwrap();
        let end: f64 = label.split('"').next().unwrap().parse().unwrap();
        assert!(end >= text_width("agglomerative"), "{end}");
    }

    #[test]
    fn many_columns_widen_the_plot() {
        let drawn = parallel_coordinates(600.0, "all", &names(30), &[]);
        let width: f64 = drawn.split("viewBox=\"0 0 ").nth(1).unwrap()[..4]
            .parse()
            .unwrap();
        assert!(width > 29.0 * LEAST_DISTANCE);
        assert!(drawn.contains("&lt;29&gt;"));
    }
}
