//! The lines of an OBJ file, checked and cleaned, one at a time, as tobj reads them.

use super::mtl::Library;
use crate::mesh::ReadReport;
use crate::mesh::{color, material};
use std::borrow::Cow;
use std::io::{self, BufRead, Read};

/// A [`BufRead`] that hands out one cleaned line at a time, so that `line` is where tobj is.
///
/// Only vertices, faces and names pass. Of a face's corners only the vertex passes, counted from
/// the file's start and known to exist.
pub(super) struct Feed<'a> {
    rest: &'a [u8],
    size: usize,
    library: &'a Library<'a>,
    all_colored: bool,
    progress: &'a dyn Fn(f32),
    /// The cleaned line, and how much of it has been read.
    out: Vec<u8>,
    read: usize,
    /// The last line that was taken from the file, counted from 1.
    pub line: u64,
    /// How many vertices had a colour of their own.
    pub colored_vertices: u64,
    /// What is wrong with the file, with the line; then tobj sees its end.
    pub error: Option<String>,
    /// For every vertex whether a face uses it.
    used: Vec<bool>,
    /// Vertices that are NaN or infinite: index and line.
    non_finite: Vec<(usize, u64)>,
    unknown_materials: Vec<String>,
    polygons: u64,
    short_faces: u64,
    lines: u64,
    points: u64,
}

/// How many lines pass between two reports of progress.
const LINES_PER_REPORT: u64 = 1 << 16;

impl<'a> Feed<'a> {
    /// A feed of `bytes`. With `all_colored`, vertices without a colour get the default one.
    pub fn new(
        bytes: &'a [u8],
        library: &'a Library<'a>,
        all_colored: bool,
        progress: &'a dyn Fn(f32),
    ) -> Self {
        Self {
            rest: bytes,
            size: bytes.len(),
            library,
            all_colored,
            progress,
            out: Vec::new(),
            read: 0,
            line: 0,
            colored_vertices: 0,
            error: None,
            used: Vec::new(),
            non_finite: Vec::new(),
            unknown_materials: Vec::new(),
            polygons: 0,
            short_faces: 0,
            lines: 0,
            points: 0,
        }
    }

    /// How many vertices have passed.
    pub fn vertices(&self) -> u64 {
        self.used.len() as u64
    }

    /// An error if a face uses a vertex that is NaN or infinite.
    pub fn refuse_non_finite(&self) -> Result<(), String> {
        let mut bad = self.non_finite.iter().filter(|(index, _)| self.used[*index]);
        match bad.next() {
            None => Ok(()),
            Some((_, line)) => Err(format!(
                "NaN or infinite vertices that faces use: {}, the first in line {line}; repair the model",
                1 + bad.count()
            )),
        }
    }

    /// Adds what was dropped or repaired.
    pub fn report(self, report: &mut ReadReport) {
        report.polygons += self.polygons;
        report.short_faces += self.short_faces;
        report.lines += self.lines;
        report.points += self.points;
        report.unknown_materials.extend(self.unknown_materials);
        report.unused_vertices += self.used.iter().filter(|u| !**u).count() as u64;
        report.unused_non_finite += self.non_finite.iter().filter(|(i, _)| !self.used[*i]).count() as u64;
        if self.colored_vertices > 0 {
            report.uncolored_vertices += self.used.len() as u64 - self.colored_vertices;
        }
    }

    /// The next line of the file without its end. Where one ends in a backslash, the next goes on
    /// with it (but not after a comment: those may hold Windows paths).
    fn next_line(&mut self) -> Option<Cow<'a, [u8]>> {
        let mut line = Cow::Borrowed(self.physical_line()?);
        while line.ends_with(b"\\") && !line.trim_ascii_start().starts_with(b"#") {
            let Some(next) = self.physical_line() else { break };
            let joined = line.to_mut();
            joined.pop();
            joined.push(b' ');
            joined.extend_from_slice(next);
        }
        Some(line)
    }

    fn physical_line(&mut self) -> Option<&'a [u8]> {
        let start = self.rest;
        // On a slice this never fails; it finds the end with the standard library's memchr.
        let length = self.rest.skip_until(b'\n').unwrap_or(0);
        if length == 0 {
            return None;
        }
        let line = &start[..length];
        let line = line.strip_suffix(b"\n").unwrap_or(line);
        self.line += 1;
        if self.line.is_multiple_of(LINES_PER_REPORT) {
            (self.progress)(1.0 - self.rest.len() as f32 / self.size as f32);
        }
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }

    /// Fills `out` with the next line that tobj needs; leaves it empty at the file's end.
    fn refill(&mut self) -> Result<(), String> {
        self.out.clear();
        self.read = 0;
        while self.out.is_empty() {
            let Some(line) = self.next_line() else { return Ok(()) };
            let (keyword, rest) = split_keyword(line.trim_ascii());
            match keyword {
                b"v" => self.vertex(rest)?,
                b"f" => self.face(rest)?,
                b"l" => self.lines += 1,
                b"p" => self.points += 1,
                b"o" | b"g" | b"mtllib" => self.name(keyword, rest),
                b"usemtl" => self.use_material(rest),
                // Normals, texture coordinates, comments, smoothing groups, free-form curves.
                _ => {}
            }
        }
        Ok(())
    }

    fn vertex(&mut self, rest: &[u8]) -> Result<(), String> {
        let mut words = [&b""[..]; 8];
        let mut count = 0;
        for word in rest.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).take(words.len()) {
            words[count] = word;
            count += 1;
        }
        let numbers = &words[..count];
        // Without letters (an exponent, "nan", "inf") and with few digits, it is finite for sure.
        let suspicious = rest.len() > 30 || rest.iter().any(u8::is_ascii_alphabetic);
        if suspicious && numbers.iter().take(3).any(|n| parse_f32(n).is_some_and(|x| !x.is_finite())) {
            self.non_finite.push((self.used.len(), self.line));
        }
        // A seventh number is an alpha channel, which tobj refuses.
        let kept = match count {
            6 | 7 => {
                if numbers[3..].iter().any(|n| parse_f32(n).is_none()) {
                    return Err(format!("line {}: a vertex's colour is not three numbers", self.line));
                }
                self.colored_vertices += 1;
                6
            }
            _ => count,
        };
        self.out.push(b'v');
        for number in &numbers[..kept] {
            self.out.push(b' ');
            self.out.extend_from_slice(number);
        }
        if self.all_colored && kept == 3 {
            let grey = f32::from(color::linear_to_srgb(material::DEFAULT_DIFFUSE.x)) / 255.0;
            self.out.extend_from_slice(format!(" {grey} {grey} {grey}").as_bytes());
        }
        self.out.push(b'\n');
        self.used.push(false);
        Ok(())
    }

    fn face(&mut self, rest: &[u8]) -> Result<(), String> {
        self.out.push(b'f');
        let mut corners = 0_u64;
        for corner in rest.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()) {
            let vertex = corner.split(|&b| b == b'/').next().unwrap_or_default();
            let index = self.resolve(vertex)?;
            self.used[index] = true;
            self.out.push(b' ');
            push_decimal(&mut self.out, index + 1);
            corners += 1;
        }
        self.out.push(b'\n');
        self.polygons += u64::from(corners > 3);
        if corners < 3 {
            self.short_faces += 1;
            self.out.clear();
        }
        Ok(())
    }

    /// The vertex, counted from 0, that a face's index means: from 1, or from the end if negative.
    fn resolve(&self, text: &[u8]) -> Result<usize, String> {
        let count = self.used.len();
        let number = std::str::from_utf8(text).ok().and_then(|t| t.parse::<i64>().ok());
        let index = match number {
            None => return Err(self.bad_index(text, "is no vertex number")),
            Some(0) => return Err(self.bad_index(text, "does not exist, vertices count from 1")),
            Some(n) if n > 0 => usize::try_from(n - 1).ok(),
            Some(n) => usize::try_from(n.unsigned_abs()).ok().and_then(|back| count.checked_sub(back)),
        };
        index
            .filter(|&i| i < count)
            .ok_or_else(|| self.bad_index(text, &format!("is out of range, {count} vertices come before it")))
    }

    fn bad_index(&self, text: &[u8], what: &str) -> String {
        let shown = String::from_utf8_lossy(&text[..text.len().min(24)]).escape_debug().to_string();
        format!("line {}: vertex {shown} of a face {what}", self.line)
    }

    /// Passes a line with a name on, with one space before it and in UTF-8.
    fn name(&mut self, keyword: &[u8], name: &[u8]) {
        self.out.extend_from_slice(keyword);
        self.out.push(b' ');
        self.out.extend_from_slice(String::from_utf8_lossy(name).as_bytes());
        self.out.push(b'\n');
    }

    fn use_material(&mut self, name: &[u8]) {
        // tobj refuses an empty name; here it means what an unknown one means.
        let name = if name.is_empty() { b"(none)" } else { name };
        let shown = String::from_utf8_lossy(name).into_owned();
        if !self.library.defines(&shown) && !self.unknown_materials.contains(&shown) {
            self.unknown_materials.push(shown);
        }
        self.name(b"usemtl", name);
    }
}

/// A line's first word and what follows it, trimmed.
pub(super) fn split_keyword(line: &[u8]) -> (&[u8], &[u8]) {
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    (&line[..end], line[end..].trim_ascii())
}

/// A number in tobj's notation, which is Rust's.
pub(super) fn parse_f32(word: &[u8]) -> Option<f32> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

fn push_decimal(out: &mut Vec<u8>, mut number: usize) {
    let mut digits = [0; 20];
    let mut at = digits.len();
    loop {
        at -= 1;
        digits[at] = b'0' + (number % 10) as u8;
        number /= 10;
        if number == 0 {
            break;
        }
    }
    out.extend_from_slice(&digits[at..]);
}

impl Read for Feed<'_> {
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        let mut line = self.fill_buf()?;
        let count = line.read(buf)?;
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for Feed<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.read == self.out.len()
            && let Err(message) = self.refill()
        {
            self.error = Some(message);
            return Err(io::ErrorKind::InvalidData.into());
        }
        Ok(&self.out[self.read..])
    }

    fn consume(&mut self, amount: usize) {
        self.read += amount;
    }
}
