//! Where bytes come from: files of a folder on disk or in memory, and gzip.
//!
//! Idea: everything is read as a stream, so that a volume is in memory once; streams know how many
//! stored bytes are left, so that sizes are compared with them before memory is asked for.
//!
//! Gzip (RFC 1952): members follow one another and are joined; what follows the last one is told,
//! not refused, since tapes and disk images pad with zeros. The decoder of flate2 for several
//! members refuses it, hence the loop over single members here.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{self, BufRead, BufReader, Read},
    path::{Component, Path, PathBuf},
};

use flate2::bufread::GzDecoder;

use super::{CompanionFiles, DataError, HeaderError, LoadError, Place, error::quote};

/// Bytes of a path in a header at most.
const MAX_NAME: usize = 800;

/// A folder whose files can be read.
pub(super) trait Folder {
    /// The file of that name from its start.
    fn open(&self, name: &Path) -> io::Result<Stream<'_>>;

    /// How the file is called in messages.
    fn shown(&self, name: &Path) -> PathBuf;
}

/// A folder on disk.
pub(super) struct Disk<'a>(pub(super) &'a Path);

impl Folder for Disk<'_> {
    fn open(&self, name: &Path) -> io::Result<Stream<'_>> {
        let path = self.0.join(name);
        let found = fs::metadata(&path)?;
        if !found.is_file() {
            // A pipe would wait for ever, a folder fail at the first byte.
            return Err(io::Error::other("not a regular file"));
        }
        let file = File::open(path)?;
        Ok(Stream {
            reader: Box::new(BufReader::with_capacity(1 << 16, file)),
            left: found.len(),
        })
    }

    fn shown(&self, name: &Path) -> PathBuf {
        self.0.join(name)
    }
}

/// Files in memory, by name.
impl Folder for BTreeMap<String, Vec<u8>> {
    fn open(&self, name: &Path) -> io::Result<Stream<'_>> {
        let bytes = name.to_str().and_then(|name| self.get(name));
        let bytes = bytes.ok_or(io::ErrorKind::NotFound)?;
        Ok(Stream {
            reader: Box::new(bytes.as_slice()),
            left: bytes.len() as u64,
        })
    }

    fn shown(&self, name: &Path) -> PathBuf {
        name.into()
    }
}

/// A file while it is read.
pub(super) struct Stream<'a> {
    reader: Box<dyn BufRead + 'a>,
    left: u64,
}

impl Stream<'_> {
    /// Stored bytes not yet read. A file that grows or shrinks meanwhile makes this a guess.
    pub(super) fn left(&self) -> u64 {
        self.left
    }
}

impl Read for Stream<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.reader.read(buffer)?;
        self.left = self.left.saturating_sub(count as u64);
        Ok(count)
    }
}

impl BufRead for Stream<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.reader.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.left = self.left.saturating_sub(count as u64);
        self.reader.consume(count);
    }
}

/// The bytes that voxels are made of.
pub(super) enum Body<'a> {
    /// As they are stored.
    Plain(Stream<'a>),
    /// Decompressed.
    Gzip(Members<'a>),
}

impl<'a> Body<'a> {
    pub(super) fn gzip(stream: Stream<'a>) -> Self {
        Self::Gzip(Members {
            state: State::Between(stream),
            garbage: false,
        })
    }

    /// Gzip if the first bytes are those of gzip.
    pub(super) fn sniffed(mut stream: Stream<'a>) -> io::Result<Self> {
        Ok(match stream.fill_buf()? {
            [0x1f, 0x8b, ..] => Self::gzip(stream),
            _ => Self::Plain(stream),
        })
    }

    /// Bytes left, if that is known.
    pub(super) fn left(&self) -> Option<u64> {
        match self {
            Self::Plain(stream) => Some(stream.left()),
            Self::Gzip(_) => None,
        }
    }

    /// Whether something else was found behind gzip data.
    pub(super) fn garbage(&self) -> bool {
        matches!(self, Self::Gzip(members) if members.garbage)
    }

    /// What an error of this stream means.
    pub(super) fn fault(&self, source: io::Error) -> DataError {
        match (self, source.kind()) {
            (Self::Gzip(_), io::ErrorKind::UnexpectedEof) => DataError::TruncatedGzip,
            (Self::Gzip(_), io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData) => {
                DataError::Gzip { source }
            }
            _ => DataError::Io { source },
        }
    }

    /// Passes over bytes; how many there were, at most `count`.
    pub(super) fn skip(&mut self, count: u64) -> Result<u64, DataError> {
        let mut taken = self.take(count);
        io::copy(&mut taken, &mut io::sink()).map_err(|error| self.fault(error))
    }

    /// Fills `buffer` as far as there are bytes.
    pub(super) fn read_up_to(&mut self, buffer: &mut [u8]) -> Result<usize, DataError> {
        let mut filled = 0;
        while filled < buffer.len() {
            match self.read(&mut buffer[filled..]) {
                Ok(0) => break,
                Ok(count) => filled += count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(self.fault(error)),
            }
        }
        Ok(filled)
    }
}

impl Read for Body<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Plain(stream) => stream.read(buffer),
            Self::Gzip(members) => members.read(buffer),
        }
    }
}

/// The content of gzip members that follow one another.
pub(super) struct Members<'a> {
    state: State<'a>,
    garbage: bool,
}

enum State<'a> {
    /// Before a member.
    Between(Stream<'a>),
    /// The header of a member that is not the first has not been accepted yet.
    Trying(Box<GzDecoder<Stream<'a>>>),
    /// Within a member.
    Inside(Box<GzDecoder<Stream<'a>>>),
    End,
}

impl Read for Members<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut first = matches!(self.state, State::Between(_));
        loop {
            match std::mem::replace(&mut self.state, State::End) {
                State::End => return Ok(0),
                State::Between(mut stream) => match stream.fill_buf()?.first() {
                    None if first => return Err(io::ErrorKind::UnexpectedEof.into()),
                    None => return Ok(0),
                    Some(0x1f) if !first => {
                        self.state = State::Trying(Box::new(GzDecoder::new(stream)));
                    }
                    Some(_) if !first => {
                        self.garbage = true;
                        return Ok(0);
                    }
                    // The decoder would wait for ten bytes before it says so.
                    Some(byte) if *byte != 0x1f => {
                        let what = "the data do not begin as gzip data do";
                        return Err(io::Error::new(io::ErrorKind::InvalidData, what));
                    }
                    Some(_) => self.state = State::Inside(Box::new(GzDecoder::new(stream))),
                },
                State::Trying(mut decoder) => match decoder.read(buffer) {
                    Err(error) if decoder.header().is_none() && is_format_fault(&error) => {
                        self.garbage = true;
                        return Ok(0);
                    }
                    result => {
                        self.state = State::Inside(decoder);
                        match result? {
                            0 if !buffer.is_empty() => self.advance(),
                            count => return Ok(count),
                        }
                    }
                },
                State::Inside(mut decoder) => {
                    let count = decoder.read(buffer)?;
                    self.state = State::Inside(decoder);
                    if count > 0 || buffer.is_empty() {
                        return Ok(count);
                    }
                    self.advance();
                }
            }
            first = false;
        }
    }
}

/// Whether an error is about the bytes and not about reading them.
fn is_format_fault(error: &io::Error) -> bool {
    use io::ErrorKind::{InvalidData, InvalidInput, UnexpectedEof};
    matches!(error.kind(), InvalidData | InvalidInput | UnexpectedEof)
}

impl Members<'_> {
    /// From the end of a member to what is behind it.
    fn advance(&mut self) {
        if let State::Inside(decoder) = std::mem::replace(&mut self.state, State::End) {
            self.state = State::Between(decoder.into_inner());
        }
    }
}

/// The file of the header's folder that `name` means.
///
/// Windows separators are accepted. A header is not trusted to name a file elsewhere: absolute
/// names and names with `..` are refused unless the caller permits them.
pub(super) fn companion(
    header: &Path,
    shown: &Path,
    name: &str,
    allowed: CompanionFiles,
) -> Result<PathBuf, LoadError> {
    // What a header says ends up in messages.
    if name.len() > MAX_NAME || name.chars().any(char::is_control) {
        return Err(LoadError::Header {
            path: shown.into(),
            source: HeaderError::Value {
                place: Place::Nowhere,
                field: "file",
                found: quote(name.as_bytes()),
                expected: "a path of at most 800 bytes without control characters",
            },
        });
    }
    let name = name.replace('\\', "/");
    let whole = Path::new(&name);
    let inside = whole
        .components()
        .all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
        && whole.file_name().is_some()
        // A drive of Windows, which on other systems is a name like any other.
        && name.as_bytes().get(1) != Some(&b':');
    if inside || allowed == CompanionFiles::Anywhere {
        let clean: PathBuf = whole
            .components()
            .filter(|part| *part != Component::CurDir)
            .collect();
        Ok(header.parent().unwrap_or(Path::new("")).join(clean))
    } else {
        Err(LoadError::OutsideFolder {
            path: shown.into(),
            name: quote(name.as_bytes()),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn zipped(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    fn read(bytes: &[u8]) -> (Result<Vec<u8>, DataError>, bool) {
        let stream = Stream {
            reader: Box::new(bytes),
            left: bytes.len() as u64,
        };
        let mut body = Body::gzip(stream);
        let mut content = Vec::new();
        let result = match body.read_to_end(&mut content) {
            Ok(_) => Ok(content),
            Err(error) => Err(body.fault(error)),
        };
        (result, body.garbage())
    }

    #[test]
    fn members_are_joined_empty_ones_too() {
        let bytes = [zipped(b"ab"), zipped(b""), zipped(b"c")].concat();
        assert!(matches!(read(&bytes), (Ok(content), false) if content == b"abc"));
    }

    #[test]
    fn garbage_behind_is_told() {
        for garbage in [
            &[0_u8; 512][..],
            b"x",
            b"\x1f",
            b"\x1f\x8b",
            b"\x1fabcdefghijklm",
        ] {
            let bytes = [&zipped(b"ab"), garbage].concat();
            assert!(matches!(read(&bytes), (Ok(content), true) if content == b"ab"));
        }
    }

    #[test]
    fn cut_and_damaged() {
        let bytes = [zipped(b"abcdefgh"), zipped(b"ijkl")].concat();
        let first = zipped(b"abcdefgh").len();
        for end in 0..bytes.len() {
            let (result, garbage) = read(&bytes[..end]);
            // A second member that ends within its header cannot be told from garbage.
            let header_cut = end > first && end < first + 10;
            assert_eq!(garbage, header_cut, "{end}");
            assert_eq!(result.is_ok(), header_cut || end == first, "{end}");
        }
        let (result, _) = read(b"no gzip at all");
        assert!(matches!(result, Err(DataError::Gzip { .. })), "{result:?}");
        let mut damaged = zipped(b"abcdefgh");
        let checksum = damaged.len() - 6;
        damaged[checksum] ^= 1;
        assert!(matches!(read(&damaged).0, Err(DataError::Gzip { .. })));
    }

    #[test]
    fn names_that_leave_the_folder() {
        let header = Path::new("h.nhdr");
        let find = |name: &str, allowed| companion(header, header, name, allowed).ok();
        let below = CompanionFiles::BelowFolder;
        assert_eq!(find("a.raw", below), Some("a.raw".into()));
        assert_eq!(find("./sub\\a.raw", below), Some("sub/a.raw".into()));
        for name in [
            "../a.raw",
            "/etc/passwd",
            "a/../../b",
            "C:\\a.raw",
            "..",
            "",
            ".",
        ] {
            assert_eq!(find(name, below), None, "{name}");
        }
        let anywhere = find("../a.raw", CompanionFiles::Anywhere);
        assert_eq!(anywhere, Some("../a.raw".into()));
        for name in [&*"x".repeat(801), "a\u{1b}[31m", "a\nb"] {
            assert_eq!(find(name, CompanionFiles::Anywhere), None);
        }
    }
}
