//! Numbers as people read them: a fixed count of significant digits, thousands apart, and one word
//! for what is no number.

/// Shown in place of values that are infinite or not a number.
pub(crate) const NOT_A_NUMBER: &str = "n/a";

/// Thousands are set apart by this: a narrow space at which no line breaks.
const THOUSANDS: char = '\u{202f}';

/// `value` with `digits` significant digits; whole digits are never rounded away below a million.
///
/// Beyond 10⁶ and below 10⁻³ the notation is scientific.
pub(crate) fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return NOT_A_NUMBER.to_string();
    }
    if value == 0.0 {
        return "0".to_string();
    }
    let after_first = digits.saturating_sub(1);
    let magnitude = value.abs();
    if !(1e-3..1e6).contains(&magnitude) {
        return format!("{value:.after_first$e}");
    }
    // The exponent is read from the rounded number: 9.996 has three digits as 10.0, not 10.00.
    let rounded = format!("{magnitude:.after_first$e}");
    let exponent: i32 = rounded
        .split_once('e')
        .and_then(|(_, exponent)| exponent.parse().ok())
        .unwrap_or(0);
    let decimals = usize::try_from(after_first as i32 - exponent).unwrap_or(0);
    let fixed = format!("{value:.decimals$}");
    match fixed.split_once('.') {
        Some((whole, fraction)) => format!("{}.{fraction}", set_thousands_apart(whole)),
        None => set_thousands_apart(&fixed),
    }
}

/// As [`significant`], without zeros at the end: for values that are usually whole.
pub(crate) fn brief(value: f64, digits: usize) -> String {
    let text = significant(value, digits);
    let (number, exponent) = match text.split_once('e') {
        Some((number, exponent)) => (number.to_string(), format!("e{exponent}")),
        None => (text, String::new()),
    };
    if !number.contains('.') {
        return number + &exponent;
    }
    number
        .trim_end_matches('0')
        .trim_end_matches('.')
        .to_string()
        + &exponent
}

/// A time, with its unit.
pub(crate) fn milliseconds(value: f64) -> String {
    if value.is_finite() {
        format!("{} ms", significant(value, 3))
    } else {
        NOT_A_NUMBER.to_string()
    }
}

/// A time in seconds, with the unit that it is read in.
pub(crate) fn seconds(value: f64) -> String {
    if value.is_finite() && value.abs() >= 1.0 {
        format!("{} s", significant(value, 3))
    } else {
        milliseconds(1e3 * value)
    }
}

/// A count with what is counted, a word whose plural ends in s.
pub(crate) fn counted(value: usize, word: &str) -> String {
    let plural = if value == 1 { "" } else { "s" };
    format!("{} {word}{plural}", count(value))
}

/// A ratio of two times: a third decimal within 10 % of equality, where it decides.
pub(crate) fn ratio(value: f64) -> String {
    if (value - 1.0).abs() < 0.1 {
        format!("{value:.3}")
    } else {
        significant(value, 3)
    }
}

/// A count, with its thousands set apart.
pub(crate) fn count(value: usize) -> String {
    set_thousands_apart(&value.to_string())
}

/// `digits` is an optional sign and decimal digits.
fn set_thousands_apart(digits: &str) -> String {
    let length = digits.len();
    let sign = usize::from(digits.starts_with('-'));
    // Four digits are read at one glance; from five on they are grouped.
    if length - sign < 5 {
        return digits.to_string();
    }
    let mut grouped = String::with_capacity(length + length / 3 * THOUSANDS.len_utf8());
    for (index, digit) in digits.chars().enumerate() {
        if index > sign && (length - index).is_multiple_of(3) {
            grouped.push(THOUSANDS);
        }
        grouped.push(digit);
    }
    grouped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_significant_ones() {
        let cases = [
            (31.4159, "31.4"),
            (0.0314159, "0.0314"),
            (3.0, "3.00"),
            (9.996, "10.0"),
            (999.6, "1000"),
            (-2.5, "-2.50"),
            (12345.6, "12\u{202f}346"),
            (-123456.0, "-123\u{202f}456"),
            (0.0, "0"),
            (1.5e9, "1.50e9"),
            (2.5e-7, "2.50e-7"),
        ];
        for (value, text) in cases {
            assert_eq!(significant(value, 3), text, "{value}");
        }
    }

    #[test]
    fn no_value_is_written_as_nan_or_infinity() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(significant(value, 3), NOT_A_NUMBER);
            assert_eq!(brief(value, 3), NOT_A_NUMBER);
            assert_eq!(milliseconds(value), NOT_A_NUMBER);
            assert_eq!(ratio(value), NOT_A_NUMBER);
        }
    }

    #[test]
    fn seconds_below_one_are_milliseconds() {
        let cases = [
            (0.02, "20.0 ms"),
            (1.0, "1.00 s"),
            (-75.0, "-75.0 s"),
            (0.0, "0 ms"),
        ];
        for (value, text) in cases {
            assert_eq!(seconds(value), text);
        }
        assert_eq!(seconds(f64::INFINITY), NOT_A_NUMBER);
    }

    #[test]
    fn one_is_not_a_plural() {
        assert_eq!(counted(1, "frame"), "1 frame");
        assert_eq!(counted(12_000, "frame"), "12\u{202f}000 frames");
        assert_eq!(counted(0, "pair"), "0 pairs");
    }

    #[test]
    fn brief_drops_zeros_after_the_point_only() {
        assert_eq!(brief(8.0, 4), "8");
        assert_eq!(brief(100.0, 4), "100");
        assert_eq!(brief(1.5, 4), "1.5");
        assert_eq!(brief(2.0e8, 4), "2e8");
    }

    #[test]
    fn ratios_near_one_have_a_third_decimal() {
        assert_eq!(ratio(1.3204), "1.32");
        assert_eq!(ratio(1.0042), "1.004");
        assert_eq!(ratio(0.97), "0.970");
        assert_eq!(ratio(12345.0), "12\u{202f}345");
    }

    #[test]
    fn counts_are_grouped_from_five_digits() {
        assert_eq!(count(1080), "1080");
        assert_eq!(count(262_267), "262\u{202f}267");
        assert_eq!(count(1_000_000), "1\u{202f}000\u{202f}000");
    }
}
