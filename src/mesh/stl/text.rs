//! The text of an ASCII file, as `stl_io` likes it.

use std::cell::Cell;
use std::io::{self, BufRead, Read, Seek, SeekFrom};

/// The most bytes of a line: no file needs as many, and one without line ends may be larger than memory.
const LONGEST: usize = 1 << 12;

/// Bytes between two reports of progress.
const BYTES_PER_REPORT: usize = 1 << 22;

/// How many lines begin a facet.
pub(super) fn facets(bytes: &[u8], progress: &dyn Fn(f32)) -> u64 {
    let (mut facets, mut rest, mut told) = (0, bytes, 0);
    while !rest.is_empty() {
        facets += u64::from(is(first_word(next_line(&mut rest)), b"facet"));
        let behind = bytes.len() - rest.len();
        if behind - told >= BYTES_PER_REPORT {
            told = behind;
            progress(behind as f32 / bytes.len() as f32);
        }
    }
    facets
}

/// Takes the first line off a text, with its end.
fn next_line<'a>(rest: &mut &'a [u8]) -> &'a [u8] {
    let start = *rest;
    // On a slice this never fails.
    let length = rest.skip_until(b'\n').unwrap_or(start.len());
    &start[..length]
}

/// A line's first word; nothing of an empty one.
fn first_word(line: &[u8]) -> &[u8] {
    line.trim_ascii_start().split(u8::is_ascii_whitespace).next().unwrap_or_default()
}

/// Whether a word is this one, in whatever case.
fn is(word: &[u8], this: &[u8]) -> bool {
    word.eq_ignore_ascii_case(this)
}

/// An ASCII file, line by line, as `stl_io` likes it: in small letters, as UTF-8, and all solids as one.
pub(super) struct Lines<'a> {
    bytes: &'a [u8],
    rest: &'a [u8],
    /// The number, from 1, of the line that was handed out last: `stl_io` asks for no more than it needs, as each
    /// call to `read` gives it one line.
    line: &'a Cell<u64>,
    /// Bytes of the file that were handed out.
    behind: &'a Cell<usize>,
    /// The cleaned line, and how much of it was read.
    out: Vec<u8>,
    read: usize,
    /// Whether the line that opens and the one that closes the only solid were handed out.
    opened: bool,
    closed: bool,
}

impl<'a> Lines<'a> {
    /// Those of a file. `line` and `behind` are told how far `stl_io` has come.
    pub fn of(bytes: &'a [u8], line: &'a Cell<u64>, behind: &'a Cell<usize>) -> Self {
        line.set(0);
        behind.set(0);
        Self { bytes, rest: bytes, line, behind, out: Vec::new(), read: 0, opened: false, closed: false }
    }

    /// Fills `out` with the next line; leaves it empty at the end.
    ///
    /// # Errors
    /// A line is too long.
    fn refill(&mut self) -> io::Result<()> {
        self.out.clear();
        self.read = 0;
        if !self.opened {
            self.opened = true;
            self.out.extend_from_slice(b"solid \n");
        }
        while self.out.is_empty() && !self.rest.is_empty() {
            let line = next_line(&mut self.rest);
            self.line.set(self.line.get() + 1);
            self.behind.set(self.behind.get() + line.len());
            let (line, word) = (line.trim_ascii(), first_word(line));
            if !(word.is_empty() || is(word, b"solid") || is(word, b"endsolid")) {
                if line.len() > LONGEST {
                    let message = format!("its {} bytes are more than {LONGEST}", line.len());
                    return Err(io::Error::new(io::ErrorKind::InvalidData, message));
                }
                self.out.extend_from_slice(String::from_utf8_lossy(line).to_ascii_lowercase().as_bytes());
                self.out.push(b'\n');
            }
        }
        if self.out.is_empty() && !self.closed {
            self.closed = true;
            self.out.extend_from_slice(b"endsolid\n");
        }
        Ok(())
    }
}

impl Read for Lines<'_> {
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        if self.read == self.out.len() {
            self.refill()?;
        }
        let count = (&self.out[self.read..]).read(buf)?;
        self.read += count;
        Ok(count)
    }
}

impl Seek for Lines<'_> {
    /// Back to the start, where `stl_io` goes when it has looked at the first line; nowhere else.
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        if to != SeekFrom::Start(0) {
            return Err(io::ErrorKind::Unsupported.into());
        }
        *self = Self::of(self.bytes, self.line, self.behind);
        Ok(0)
    }
}
