//! HTML tables that scroll sideways on a narrow screen.

use crate::report::markup::escape;

/// A cell: text is aligned left, numbers right.
#[derive(Clone, Debug)]
pub(in crate::report) enum Cell {
    Text(String),
    Number(String),
}

/// Rows below a head. The first cell of a row is its heading.
#[derive(Clone, Debug)]
pub(in crate::report) struct Table {
    pub(in crate::report) head: Vec<String>,
    pub(in crate::report) rows: Vec<Vec<Cell>>,
}

impl Table {
    /// The table as an HTML element.
    pub(in crate::report) fn html(&self) -> String {
        let mut html = "<div class=\"scroll\" tabindex=\"0\"><table>\n<thead><tr>".to_string();
        for (column, title) in self.head.iter().enumerate() {
            let numeric = self.rows.iter().any(|row| {
                row.get(column)
                    .is_some_and(|cell| matches!(cell, Cell::Number(_)))
            });
            let class = if numeric { " class=\"n\"" } else { "" };
            // Names of parameters may break after an underscore: more columns fit side by side.
            let title = escape(title).replace('_', "_<wbr>");
            html.push_str(&format!("<th scope=\"col\"{class}>{title}</th>"));
        }
        html.push_str("</tr></thead>\n<tbody>\n");
        for row in &self.rows {
            html.push_str("<tr>");
            for (column, cell) in row.iter().enumerate() {
                let (class, text) = match cell {
                    Cell::Text(text) => ("", text),
                    Cell::Number(text) => (" class=\"n\"", text),
                };
                let text = escape(text);
                if column == 0 {
                    html.push_str(&format!("<th scope=\"row\"{class}>{text}</th>"));
                } else {
                    html.push_str(&format!("<td{class}>{text}</td>"));
                }
            }
            html.push_str("</tr>\n");
        }
        html.push_str("</tbody></table></div>\n");
        html
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heads_and_cells_are_escaped_and_aligned() {
        let table = Table {
            head: vec!["a<_b".to_string(), "cost".to_string()],
            rows: vec![vec![
                Cell::Text("c&d".to_string()),
                Cell::Number("3".to_string()),
            ]],
        };
        let html = table.html();
        assert!(html.contains("<th scope=\"col\">a&lt;_<wbr>b</th>"));
        assert!(html.contains("<th scope=\"col\" class=\"n\">cost</th>"));
        assert!(html.contains("<th scope=\"row\">c&amp;d</th><td class=\"n\">3</td>"));
    }
}
