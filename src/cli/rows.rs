//! Results as rows of name and value, for people.

use comfy_table::{Table, presets};

use super::{Failure, output};

/// Prints a title and rows of name and value.
pub(crate) fn section<'a>(
    title: &str,
    rows: impl IntoIterator<Item = (&'a str, String)>,
) -> Result<(), Failure> {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    for (name, value) in rows {
        table.add_row([name.to_owned(), value]);
    }
    output::line(format_args!("{title}\n{table}\n"))
}

/// Six significant digits, without trailing zeros.
pub(crate) fn number(value: f64) -> String {
    if value == 0.0 || (1e-4..1e7).contains(&value.abs()) {
        let digits = (5 - value.abs().max(1e-9).log10().floor() as i32).clamp(0, 9) as usize;
        let text = format!("{value:.digits$}");
        return if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        };
    }
    format!("{value:.5e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_six_digits() {
        assert_eq!(number(0.0), "0");
        assert_eq!(number(262_204.0), "262204");
        assert_eq!(number(13.810_123_4), "13.8101");
        assert_eq!(number(0.5), "0.5");
        assert_eq!(number(1.234_567_8e-7), "1.23457e-7");
        assert_eq!(number(16_777_216.0), "1.67772e7");
    }
}
