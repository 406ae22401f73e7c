//! The lines of an OBJ file, checked and cleaned, one at a time, as tobj reads them.

use super::corners::{Corners, VERTICES, resolve};
use super::library::Library;
use crate::mesh::{Attributes, Image, Material, ReadReport};
use crate::mesh::{color, material};
use std::borrow::Cow;
use std::io::{self, BufRead, Read};

/// A [`BufRead`] that hands out one cleaned line at a time, so that `line` is where tobj is.
///
/// Only vertices, faces and the ends of groups pass. Of a face's corners only the vertex passes, counted from
/// the file's start and known to exist. What else triangles have is kept here, in their order.
pub(super) struct Feed<'a> {
    rest: &'a [u8],
    size: usize,
    library: Library<'a>,
    all_colored: bool,
    progress: &'a dyn Fn(f32),
    corners: Corners,
    /// Where materials change: the first triangle, and its material, if that is known.
    runs: Vec<(usize, Option<u32>)>,
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

/// What an OBJ file says of its triangles beside their vertices.
pub(super) struct Extras {
    /// How many vertices have a colour of their own.
    pub colored_vertices: u64,
    /// The materials of all MTL files.
    pub materials: Vec<Material>,
    /// The pictures that they name.
    pub images: Vec<Image>,
    /// The first triangle of each part of one material, and that, if it is known.
    pub runs: Vec<(usize, Option<u32>)>,
    /// How many triangles the faces make.
    pub triangles: usize,
    /// One record a triangle, or none.
    pub attributes: Vec<Attributes>,
}

/// How many lines pass between two reports of progress.
const LINES_PER_REPORT: u64 = 1 << 16;

impl<'a> Feed<'a> {
    /// A feed of `bytes`. With `all_colored`, vertices without a colour get the default one.
    pub fn new(bytes: &'a [u8], library: Library<'a>, all_colored: bool, progress: &'a dyn Fn(f32)) -> Self {
        Self {
            rest: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes),
            size: bytes.len(),
            library,
            all_colored,
            progress,
            corners: Corners::default(),
            runs: Vec::new(),
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

    /// What triangles have beside their vertices; adds what was dropped or repaired to the report.
    pub fn finish(self, report: &mut ReadReport) -> Extras {
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
        let (materials, images) = self.library.finish(report);
        Extras {
            colored_vertices: self.colored_vertices,
            materials,
            images,
            runs: self.runs,
            triangles: self.corners.triangles(),
            attributes: self.corners.finish(report),
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
                b"vt" => self.corners.coordinates(rest),
                b"vn" => self.corners.normal(rest),
                b"o" | b"g" => self.end_group(),
                b"mtllib" => self.library.load(&String::from_utf8_lossy(rest)),
                b"usemtl" => self.use_material(rest),
                // Comments, smoothing groups, free-form curves.
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
        self.corners.begin();
        let mut count = 0_u64;
        for corner in rest.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()) {
            let (vertex, others) = match corner.iter().position(|&b| b == b'/') {
                Some(at) => (&corner[..at], Some(&corner[at + 1..])),
                None => (corner, None),
            };
            let in_line = |message| format!("line {}: {message}", self.line);
            let index = resolve(vertex, self.used.len(), &VERTICES).map_err(in_line)?;
            self.corners.corner(others).map_err(in_line)?;
            self.used[index] = true;
            self.out.push(b' ');
            push_decimal(&mut self.out, index + 1);
            count += 1;
        }
        self.corners.end();
        self.out.push(b'\n');
        self.polygons += u64::from(count > 3);
        if count < 3 {
            self.short_faces += 1;
            self.out.clear();
        }
        Ok(())
    }

    /// Has tobj begin another model, which keeps what it has in work small.
    fn end_group(&mut self) {
        self.out.extend_from_slice(b"g\n");
    }

    fn use_material(&mut self, name: &[u8]) {
        // An empty name means what an unknown one means.
        let name = if name.is_empty() { "(none)".into() } else { String::from_utf8_lossy(name) };
        let place = self.library.place(&name);
        if place.is_none() && !self.unknown_materials.iter().any(|unknown| *unknown == name) {
            self.unknown_materials.push(name.into_owned());
        }
        self.runs.push((self.corners.triangles(), place));
        self.end_group();
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
