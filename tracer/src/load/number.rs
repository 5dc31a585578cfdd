//! Decimal text to `f32`, exactly rounded, fast for what scene files contain.
//!
//! Clinger, "How to read floating point numbers accurately", 1990: if the digits are a whole
//! number of at most 53 bits and the power of ten is at most 22, both are exact in `f64`, and one
//! multiplication or division rounds once. Rounding that to `f32` is a second rounding; it can
//! differ from a single one only if the `f64` lies exactly half-way between two `f32`, because
//! half-way points are themselves `f64` values and rounding is monotonic. That case, and numbers
//! that are not normal in `f32`, go to the standard library, as does everything unusual.

/// Powers of ten that are exact in `f64`.
const POWERS_OF_TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// Any number of digits up to this cannot overflow a `u64`.
const MAX_DIGITS: usize = 19;

/// The number that `token` is, bit for bit what `str::parse` gives; NaN and infinities in words
/// are numbers too, also as the C runtime of Microsoft prints them.
pub(super) fn parse(token: &[u8]) -> Option<f32> {
    fast(token).or_else(|| slow(token))
}

fn slow(token: &[u8]) -> Option<f32> {
    let text = str::from_utf8(token).ok()?;
    text.parse().ok().or_else(|| microsoft_non_finite(text))
}

/// `1.#INF`, `1.#QNAN`, `1.#IND` and `nan(ind)`, with or without a sign. The sign of a NaN is
/// not kept.
fn microsoft_non_finite(text: &str) -> Option<f32> {
    let magnitude = text.strip_prefix(['-', '+']).unwrap_or(text);
    let lower = magnitude.to_ascii_lowercase();
    match lower.as_str() {
        "1.#inf" if text.starts_with('-') => Some(f32::NEG_INFINITY),
        "1.#inf" => Some(f32::INFINITY),
        "1.#ind" | "1.#qnan" | "1.#snan" | "nan(ind)" | "nan(snan)" => Some(f32::NAN),
        _ => None,
    }
}

fn fast(token: &[u8]) -> Option<f32> {
    let (negative, unsigned) = match token {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        rest => (false, rest),
    };
    let mut mantissa = 0;
    let (whole, rest) = digits(unsigned, &mut mantissa);
    let (fraction, rest) = match rest {
        [b'.', rest @ ..] => digits(rest, &mut mantissa),
        rest => (0, rest),
    };
    if !(1..=MAX_DIGITS).contains(&(whole + fraction)) || mantissa > 1 << 53 {
        return None;
    }
    let written_exponent = match rest {
        [] => 0,
        [b'e' | b'E', rest @ ..] => exponent(rest)?,
        _ => return None,
    };
    let power = written_exponent - fraction as i32;
    let factor = *POWERS_OF_TEN.get(power.unsigned_abs() as usize)?;
    let scaled = if power < 0 {
        mantissa as f64 / factor
    } else {
        mantissa as f64 * factor
    };
    let magnitude = narrow(scaled)?;
    Some(if negative { -magnitude } else { magnitude })
}

/// Takes leading digits into `mantissa`; gives their number and what follows. Wraps silently from
/// the twentieth digit on: the caller looks at the number first.
fn digits<'a>(text: &'a [u8], mantissa: &mut u64) -> (usize, &'a [u8]) {
    let count = text.iter().take_while(|byte| byte.is_ascii_digit()).count();
    for byte in &text[..count] {
        *mantissa = mantissa
            .wrapping_mul(10)
            .wrapping_add(u64::from(byte - b'0'));
    }
    (count, &text[count..])
}

/// An exponent of one or two digits, which is all that the fast path can use.
fn exponent(text: &[u8]) -> Option<i32> {
    let (sign, magnitude) = match text {
        [b'-', rest @ ..] => (-1, rest),
        [b'+', rest @ ..] => (1, rest),
        rest => (1, rest),
    };
    let mut value = 0;
    match digits(magnitude, &mut value) {
        (1..=2, []) => Some(sign * value as i32),
        _ => None,
    }
}

/// Rounds an exactly rounded `f64` to `f32` where that gives what a single rounding gives.
fn narrow(scaled: f64) -> Option<f32> {
    const DROPPED_BITS: u64 = (1 << 29) - 1;
    const HALF_WAY: u64 = 1 << 28;
    let normal = f64::from(f32::MIN_POSITIVE)..=f64::from(f32::MAX);
    let safe =
        scaled == 0.0 || (normal.contains(&scaled) && scaled.to_bits() & DROPPED_BITS != HALF_WAY);
    safe.then_some(scaled as f32)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn assert_as_standard(text: &str) {
        let expected: f32 = text.parse().unwrap();
        let got = parse(text.as_bytes()).unwrap();
        assert!(
            got.to_bits() == expected.to_bits() || (got.is_nan() && expected.is_nan()),
            "{text}: {got:e}, expected {expected:e}"
        );
    }

    #[test]
    fn usual_and_unusual_spellings() {
        for text in [
            "0",
            "-0",
            "+0.0",
            "1",
            "-1.",
            ".5",
            "5E-1",
            "1e+0",
            "1e-06",
            "3.40282347e38",
            "1e39",
            "1e-45",
            "1e-46",
            "1e999",
            "-1e999",
            "1.17549435e-38",
            "nan",
            "-NaN",
            "inf",
            "-Infinity",
            "0.000000000000000000000001",
            "123456789012345678901234567890",
        ] {
            assert_as_standard(text);
        }
    }

    /// 16777217 is half-way between two `f32`; the digits behind decide, and `f64` loses them.
    #[test]
    fn half_way_cases_are_rounded_once() {
        for text in [
            "16777217",
            "16777217.000000001",
            "16777216.99999999999",
            "1.00000005960464477539",
        ] {
            assert_as_standard(text);
        }
    }

    #[test]
    fn the_fast_path_is_taken_for_ordinary_numbers() {
        for text in ["-0.108324", "127.5", "1e-06", "3", "-1618.93"] {
            assert!(fast(text.as_bytes()).is_some(), "{text}");
        }
    }

    #[test]
    fn what_is_no_number() {
        for text in [
            "", "-", ".", "e5", "1e", "1e+", "0x10", "1,5", "1.2.3", "--1", "1f", "1 ",
        ] {
            assert_eq!(parse(text.as_bytes()), None, "{text:?}");
        }
        assert_eq!(parse(b"\xff1"), None);
    }

    #[test]
    fn microsoft_spellings() {
        assert_eq!(parse(b"-1.#INF"), Some(f32::NEG_INFINITY));
        assert_eq!(parse(b"1.#INF"), Some(f32::INFINITY));
        for text in ["1.#QNAN", "-1.#IND", "-nan(ind)"] {
            assert!(parse(text.as_bytes()).unwrap().is_nan(), "{text}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn decimals_as_written(text in "[-+]?[0-9]{1,12}(\\.[0-9]{0,12})?([eE][-+]?[0-9]{1,2})?") {
            assert_as_standard(&text);
        }

        /// Six to nine digits of any float: near half-way points more often than random digits.
        #[test]
        fn floats_printed_with_few_digits(bits: u32, digits in 0_usize..10) {
            let value = f32::from_bits(bits);
            prop_assume!(value.is_finite());
            assert_as_standard(&format!("{value:.digits$e}"));
            assert_as_standard(&format!("{value}"));
        }

        /// The exact decimal of the middle between neighbours, and one digit beside it.
        #[test]
        fn middles_between_neighbours(exponent in 120_u32..160, fraction in 0_u32..(1 << 23)) {
            let lower = f32::from_bits(exponent << 23 | fraction);
            let middle = 0.5 * (f64::from(lower) + f64::from(lower.next_up()));
            let text = format!("{middle}");
            assert_as_standard(&text);
            assert_as_standard(&format!("{text}1"));
        }
    }
}
