//! The lines of an OBJ file.

use std::borrow::Cow;
use std::io::BufRead;

/// How many lines pass between two reports of progress.
const LINES_PER_REPORT: u64 = 1 << 16;

/// A file's lines, one at a time.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    size: usize,
    number: u64,
    progress: &'a dyn Fn(f32),
}

impl<'a> Lines<'a> {
    /// The lines of `bytes`. `progress` is told now and then what part (0 to 1) is behind.
    pub fn new(bytes: &'a [u8], progress: &'a dyn Fn(f32)) -> Self {
        let rest = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        Self { rest, size: bytes.len(), number: 0, progress }
    }

    /// The number of the line that was taken last, counted from 1: of several in one, the last of these.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The next line without its end. Where one ends in a backslash, the next goes on with it (but not after a
    /// comment: those may hold Windows paths).
    pub fn take(&mut self) -> Option<Cow<'a, [u8]>> {
        let mut line = Cow::Borrowed(self.physical()?);
        while line.ends_with(b"\\") && !line.trim_ascii_start().starts_with(b"#") {
            let Some(next) = self.physical() else { break };
            let joined = line.to_mut();
            joined.pop();
            joined.push(b' ');
            joined.extend_from_slice(next);
        }
        Some(line)
    }

    fn physical(&mut self) -> Option<&'a [u8]> {
        let start = self.rest;
        // On a slice this never fails; it finds the end with the standard library's memchr.
        let length = self.rest.skip_until(b'\n').unwrap_or(0);
        if length == 0 {
            return None;
        }
        let line = &start[..length];
        let line = line.strip_suffix(b"\n").unwrap_or(line);
        self.number += 1;
        if self.number.is_multiple_of(LINES_PER_REPORT) {
            (self.progress)(1.0 - self.rest.len() as f32 / self.size as f32);
        }
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }
}

/// A line's first word and what follows it, trimmed.
pub(super) fn split_keyword(line: &[u8]) -> (&[u8], &[u8]) {
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    (&line[..end], line[end..].trim_ascii())
}

/// What stands between spaces.
pub(super) fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// A number in Rust's notation.
pub(super) fn parse_f32(word: &[u8]) -> Option<f32> {
    std::str::from_utf8(word).ok()?.parse().ok()
}
