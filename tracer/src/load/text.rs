//! Statements and tokens of the Wavefront text formats (OBJ and MTL), without a copy per line.
//!
//! A statement is a line; a backslash directly before the end of a line joins the next line to
//! it. Blanks (space, tab, carriage return, form feed, vertical tab) separate tokens. `#` begins a
//! comment at the start of a token only, since names may contain it; a comment is never continued.

/// A position in the text of a file.
#[derive(Clone, Debug)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\r' | 0x0b | 0x0c)
}

impl<'a> Cursor<'a> {
    /// The start of `bytes`, behind a byte order mark if there is one.
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self {
            bytes: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes),
            at: 0,
            line: 1,
        }
    }

    /// The line of the position, from 1.
    pub(super) fn line(&self) -> usize {
        self.line
    }

    /// The first token of the next line that has one; skips what is left of this line.
    pub(super) fn next_statement(&mut self) -> Option<&'a [u8]> {
        if self.at > 0 {
            self.skip_line();
        }
        while self.at < self.bytes.len() {
            if let Some(keyword) = self.token() {
                return Some(keyword);
            }
            self.skip_line();
        }
        None
    }

    /// The next token of this statement.
    pub(super) fn token(&mut self) -> Option<&'a [u8]> {
        self.skip_blanks();
        if matches!(self.bytes.get(self.at), None | Some(b'\n' | b'#')) {
            return None;
        }
        let start = self.at;
        self.skip_token();
        Some(&self.bytes[start..self.at])
    }

    /// What is left of this statement as one name: without blanks at both ends and without a
    /// comment. Bytes that are not UTF-8 become replacement characters.
    pub(super) fn rest(&mut self) -> String {
        self.skip_blanks();
        let mut name = Vec::new();
        while let Some(&byte) = self.bytes.get(self.at) {
            let after_blank = name.last().is_none_or(|&last| is_blank(last));
            if byte == b'\n' || (byte == b'#' && after_blank) {
                break;
            }
            if let Some(length) = self.continuation() {
                self.at += length;
                self.line += 1;
                name.push(b' ');
            } else {
                self.at += 1;
                name.push(byte);
            }
        }
        let length = name
            .iter()
            .rposition(|&byte| !is_blank(byte))
            .map_or(0, |last| last + 1);
        String::from_utf8_lossy(&name[..length]).into_owned()
    }

    /// What is left of this line up to a line end, for quoting.
    pub(super) fn quote(&self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|&byte| byte == b'\n');
        rest[..length.unwrap_or(rest.len())].trim_ascii()
    }

    fn skip_line(&mut self) {
        while self.token().is_some() {}
        while self.at < self.bytes.len() {
            self.at += 1;
            if self.bytes[self.at - 1] == b'\n' {
                self.line += 1;
                return;
            }
        }
    }

    fn skip_blanks(&mut self) {
        while let Some(&byte) = self.bytes.get(self.at) {
            if is_blank(byte) {
                self.at += 1;
            } else if let Some(length) = self.continuation() {
                self.at += length;
                self.line += 1;
            } else {
                return;
            }
        }
    }

    fn skip_token(&mut self) {
        while let Some(&byte) = self.bytes.get(self.at) {
            if is_blank(byte) || byte == b'\n' || self.continuation().is_some() {
                return;
            }
            self.at += 1;
        }
    }

    /// The length of a backslash and the line end behind it, if they are next.
    fn continuation(&self) -> Option<usize> {
        match &self.bytes[self.at..] {
            [b'\\', b'\n', ..] => Some(2),
            [b'\\', b'\r', b'\n', ..] => Some(3),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statements(text: &str) -> Vec<(usize, Vec<String>)> {
        let mut cursor = Cursor::new(text.as_bytes());
        let mut found = Vec::new();
        while let Some(keyword) = cursor.next_statement() {
            let line = cursor.line();
            let mut tokens = vec![String::from_utf8_lossy(keyword).into_owned()];
            while let Some(token) = cursor.token() {
                tokens.push(String::from_utf8_lossy(token).into_owned());
            }
            found.push((line, tokens));
        }
        found
    }

    #[test]
    fn line_ends_blanks_and_comments() {
        let got = statements("\u{feff}# c\r\n\r\n\ta  b\t\r\nc#d #e f\n#g\\\nh");
        let words = |text: &str| text.split(' ').map(str::to_owned).collect();
        assert_eq!(got, [(3, words("a b")), (4, words("c#d")), (6, words("h"))]);
    }

    #[test]
    fn continued_lines_are_one_statement_and_all_lines_count() {
        let got = statements("a b\\\nc \\\r\n d\n\\\ne\nf\\ g");
        let words = |text: &str| text.split(' ').map(str::to_owned).collect();
        assert_eq!(
            got,
            [(1, words("a b c d")), (5, words("e")), (6, words("f\\ g"))]
        );
    }

    #[test]
    fn a_name_is_the_rest_of_the_statement() {
        for (text, name) in [
            ("k  edge cases.mtl \r\n", "edge cases.mtl"),
            ("k a#b # c", "a#b"),
            ("k\nnext", ""),
            ("k # c", ""),
            ("k a \\\n b", "a   b"),
        ] {
            let mut cursor = Cursor::new(text.as_bytes());
            cursor.next_statement();
            assert_eq!(cursor.rest(), name, "{text:?}");
        }
    }
}
