//! The lines of an NRRD header, and which field each of them is.
//!
//! Comments and pairs `key:=value` are passed over, fields keep their text. Names of fields are
//! compared without regard to case.

use std::io::{self, BufRead, Read};

use super::super::{HeaderError, error::quote};

/// Bytes of a line at most.
const MAX_LINE: usize = 1 << 16;
/// Bytes of a header at most.
const MAX_HEADER: usize = 1 << 24;

/// Fields by their name in the definition, and other ways to write it. Those without a meaning for
/// a picture are known too, so that a misspelt one is not.
const FIELDS: &[(&str, &[&str])] = &[
    ("dimension", &[]),
    ("type", &[]),
    ("block size", &["blocksize"]),
    ("encoding", &[]),
    ("endian", &[]),
    ("content", &[]),
    ("min", &[]),
    ("max", &[]),
    ("old min", &["oldmin"]),
    ("old max", &["oldmax"]),
    ("data file", &["datafile"]),
    ("line skip", &["lineskip"]),
    ("byte skip", &["byteskip"]),
    ("number", &[]),
    ("sample units", &["sampleunits"]),
    ("space", &[]),
    ("space dimension", &[]),
    ("space units", &[]),
    ("space origin", &[]),
    ("space directions", &[]),
    ("measurement frame", &[]),
    ("sizes", &[]),
    ("spacings", &[]),
    ("thicknesses", &[]),
    ("axis mins", &["axismins"]),
    ("axis maxs", &["axismaxs"]),
    ("centers", &["centerings"]),
    ("labels", &[]),
    ("units", &[]),
    ("kinds", &[]),
];

/// A field of a header.
#[derive(Debug)]
pub(super) struct Field {
    /// Its name in the definition.
    pub(super) name: &'static str,
    pub(super) line: usize,
    /// Without blanks at both ends.
    pub(super) value: Vec<u8>,
}

/// What a header says, line by line.
#[derive(Debug, Default)]
pub(super) struct Lines {
    pub(super) fields: Vec<Field>,
    /// Lines read.
    pub(super) count: usize,
    /// Whether the empty line was found; the stream is directly behind it then.
    pub(super) ended: bool,
    /// The number of fields that are unknown, and line and beginning of the first.
    pub(super) unknown: Option<(usize, usize, String)>,
}

/// Reads a header and its empty line, and not a byte more.
pub(super) fn read(stream: &mut impl BufRead) -> io::Result<Result<Lines, HeaderError>> {
    let mut lines = Lines::default();
    let mut bytes = 0;
    let mut line = Vec::new();
    loop {
        line.clear();
        let limit = MAX_LINE.min(MAX_HEADER - bytes);
        let mut limited = stream.by_ref().take(limit as u64 + 1);
        let count = limited.read_until(b'\n', &mut line)?;
        bytes += count;
        if count > limit {
            let line = lines.count + 1;
            return Ok(Err(HeaderError::TooLong { line, limit }));
        }
        if count == 0 {
            if lines.count == 0 {
                return Ok(Err(magic(&[])));
            }
            return Ok(Ok(lines));
        }
        lines.count += 1;
        let text = line.strip_suffix(b"\n").unwrap_or(&line);
        let text = text.strip_suffix(b"\r").unwrap_or(text);
        let result = if lines.count == 1 {
            version(text)
        } else if text.is_empty() {
            lines.ended = true;
            return Ok(Ok(lines));
        } else {
            lines.add(text)
        };
        if let Err(error) = result {
            return Ok(Err(error));
        }
    }
}

fn magic(found: &[u8]) -> HeaderError {
    HeaderError::Magic {
        format: "NRRD (version 1 to 5)",
        found: quote(found),
    }
}

fn version(text: &[u8]) -> Result<(), HeaderError> {
    match text.trim_ascii_end() {
        [b'N', b'R', b'R', b'D', b'0', b'0', b'0', b'1'..=b'5'] => Ok(()),
        _ => Err(magic(text)),
    }
}

impl Lines {
    fn add(&mut self, text: &[u8]) -> Result<(), HeaderError> {
        if text.starts_with(b"#") {
            return Ok(());
        }
        let colon = text.iter().position(|&byte| byte == b':');
        let Some(colon) = colon else {
            return Err(HeaderError::NoField {
                line: self.count,
                found: quote(text),
            });
        };
        let (name, value) = (&text[..colon], &text[colon + 1..]);
        if value.starts_with(b"=") {
            return Ok(());
        }
        let is = |known: &str| name.trim_ascii().eq_ignore_ascii_case(known.as_bytes());
        let known = FIELDS
            .iter()
            .find(|(known, others)| is(known) || others.iter().any(|other| is(other)));
        let Some(&(name, _)) = known else {
            let first = self.unknown.take();
            let (count, line, example) = first.unwrap_or((0, self.count, quote(text)));
            self.unknown = Some((count + 1, line, example));
            return Ok(());
        };
        if let Some(first) = self.fields.iter().find(|field| field.name == name) {
            return Err(HeaderError::Duplicate {
                line: self.count,
                first: first.line,
                field: name,
            });
        }
        self.fields.push(Field {
            name,
            line: self.count,
            value: value.trim_ascii().to_vec(),
        });
        Ok(())
    }

    /// The field of that name.
    pub(super) fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &[u8]) -> Result<Lines, HeaderError> {
        read(&mut { text }).unwrap()
    }

    #[test]
    fn fields_comments_and_pairs() {
        let text = b"NRRD0004\r\n# c: d\nType: short \r\nkey:=value\nk: y:=v\nDATAFILE:x\n\nabc";
        let mut rest = &text[..];
        let lines = read(&mut rest).unwrap().unwrap();
        assert_eq!((lines.count, lines.ended), (7, true));
        assert_eq!(rest, b"abc");
        assert_eq!(lines.field("type").unwrap().value, b"short");
        assert_eq!(lines.field("data file").unwrap().line, 6);
        assert_eq!(lines.unknown, Some((1, 5, "k: y:=v".into())));
    }

    #[test]
    fn what_is_no_header() {
        for (text, expected) in [
            (&b""[..], "begins with ``"),
            (b"\n", "begins with ``"),
            (b"NRRD0006\n", "NRRD0006"),
            (b"NRRD00.01\n", "NRRD00.01"),
            (b"P5 3 3\n", "P5 3 3"),
            (b"NRRD0004\nhello\n", "line 2: `hello`"),
            (
                b"NRRD0004\ntype: int\ntype: int\n",
                "line 3: `type` is given again, first in line 2",
            ),
        ] {
            let error = lines(text).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn lines_without_an_end() {
        let text = [b"NRRD0004\n#", &[b'x'; MAX_LINE][..], b"\n\n"].concat();
        let error = lines(&text).unwrap_err();
        assert_eq!(
            error,
            HeaderError::TooLong {
                line: 2,
                limit: MAX_LINE
            }
        );
        assert!(lines(&text[..MAX_LINE]).is_ok());
    }

    #[test]
    fn headers_without_an_end() {
        let line = [&[b'#'; 1000][..], b"\n"].concat();
        let text = [b"NRRD0004\n".to_vec(), line.repeat(MAX_HEADER / 1000)].concat();
        assert!(matches!(lines(&text), Err(HeaderError::TooLong { line, .. }) if line > 16_000));
    }
}
