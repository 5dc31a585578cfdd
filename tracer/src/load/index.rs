//! Indices of face corners: as written, and checked against the lists so far.

use super::error::{IndexKind, ParseError};

/// The three indices of a face corner as written. The first is always there; others may be left
/// out or empty.
pub(super) fn corner(token: &[u8]) -> Option<[Option<i64>; 3]> {
    let mut indices = [None; 3];
    for (place, part) in token.split(|&byte| byte == b'/').enumerate() {
        let slot = indices.get_mut(place)?;
        if place == 0 || !part.is_empty() {
            *slot = Some(whole_number(part)?);
        }
    }
    Some(indices)
}

/// A whole number; too large ones become the largest, which is out of range everywhere.
fn whole_number(text: &[u8]) -> Option<i64> {
    let (sign, digits) = match text {
        [b'-', digits @ ..] => (-1, digits),
        [b'+', digits @ ..] => (1, digits),
        digits => (1, digits),
    };
    if digits.is_empty() {
        return None;
    }
    let mut magnitude = 0_i64;
    for digit in digits {
        let value = digit.is_ascii_digit().then(|| i64::from(digit - b'0'))?;
        magnitude = magnitude.saturating_mul(10).saturating_add(value);
    }
    Some(sign * magnitude)
}

/// From an index as written, from 1 or backwards from -1, to one from 0.
pub(super) fn place_in_list(
    index: i64,
    count: usize,
    kind: IndexKind,
    line: usize,
) -> Result<u32, ParseError> {
    let from_start = match index {
        0 => return Err(ParseError::ZeroIndex { line, kind }),
        1.. => index - 1,
        _ => index + count as i64,
    };
    // What does not fit 32 bits is out of range too: more vertices than that cannot be told apart
    // in a mesh.
    u32::try_from(from_start)
        .ok()
        .filter(|&place| (place as usize) < count)
        .ok_or(ParseError::IndexOutOfRange {
            line,
            kind,
            index,
            count,
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_of_a_corner() {
        for (text, expected) in [
            ("7", [Some(7), None, None]),
            ("-7/+2", [Some(-7), Some(2), None]),
            ("1//3", [Some(1), None, Some(3)]),
            ("1/2/-3", [Some(1), Some(2), Some(-3)]),
            ("1/", [Some(1), None, None]),
            ("99999999999999999999", [Some(i64::MAX), None, None]),
        ] {
            assert_eq!(corner(text.as_bytes()), Some(expected), "{text}");
        }
        for text in ["", "/1", "1/2/3/4", "1.0", "1/x", "-", "--1", "1\\2"] {
            assert_eq!(corner(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn both_ends_of_the_list() {
        let place = |index| place_in_list(index, 3, IndexKind::Normal, 8);
        let refused = |index| {
            Err(ParseError::IndexOutOfRange {
                line: 8,
                kind: IndexKind::Normal,
                index,
                count: 3,
            })
        };
        assert_eq!(
            [place(1), place(3), place(-1), place(-3)],
            [Ok(0), Ok(2), Ok(2), Ok(0)]
        );
        for index in [4, -4, i64::MAX, -i64::MAX, 1 << 32] {
            assert_eq!(place(index), refused(index));
        }
        let zero = ParseError::ZeroIndex {
            line: 8,
            kind: IndexKind::Normal,
        };
        assert_eq!(place(0), Err(zero));
    }
}
