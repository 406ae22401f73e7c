//! STL, ASCII through `stl_io`, and binary.
//!
//! Which of the two a file is, its size and its text tell: the first word is `solid` in many a binary file as well. A
//! binary file is fixed records behind a count, which is believed only if the file is as long as it says. `stl_io`
//! takes ASCII apart; `Lines` stands before it, because it knows one spelling alone, stops after the first of several
//! solids, and names no line when something is wrong.
//!
//! Corners at the same place become one vertex, so that neighbours share their edges to the bit. Facet normals and
//! the attribute bytes of binary files are ignored: the order of its corners says which side of a facet is the front.

use super::check::MAX_TRIANGLES;
use super::{Mesh, ReadReport};
use glam::Vec3;
use std::cell::Cell;
use std::collections::HashMap;
use std::io::{self, BufRead, Read, Seek, SeekFrom};
use std::path::Path;

/// Bytes before a binary file's first triangle: 80 of anything, then the count.
const HEADER: usize = 84;

/// Bytes of a binary file's triangle: a normal, three corners, two bytes of attributes.
const TRIANGLE: usize = 50;

/// Triangles between two reports of progress.
const TRIANGLES_PER_REPORT: usize = 1 << 16;

/// Parses an STL file's bytes.
pub(super) fn parse(
    bytes: &[u8],
    _path: &Path,
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
) -> Result<Mesh, String> {
    let size = bytes.len() as u64;
    match announced(bytes) {
        // What ends exactly where its count says is binary, whatever it begins with.
        Some((_, end)) if end == size => binary(&bytes[HEADER..], progress),
        _ if is_text(bytes) => ascii(bytes, progress),
        Some((_, end)) if end < size => {
            report.trailing_bytes = size - end;
            binary(&bytes[HEADER..end as usize], progress)
        }
        Some((count, end)) => Err(format!(
            "neither an ASCII STL nor a whole binary one: its header announces {count} triangles, which end at byte \
             {end}, but the file has {size} bytes; export it again"
        )),
        None => Err(format!(
            "no STL: it does not begin with \"solid\", and its {size} bytes are too few for a binary header"
        )),
    }
}

/// How many triangles a binary file has by its header, and where it ends then; `None` if it has none.
fn announced(bytes: &[u8]) -> Option<(u32, u64)> {
    let count = u32::from_le_bytes(*bytes.get(80..HEADER)?.first_chunk()?);
    Some((count, HEADER as u64 + u64::from(count) * TRIANGLE as u64))
}

/// Whether it begins with `solid` and goes on as text does.
fn is_text(bytes: &[u8]) -> bool {
    let start = &bytes[..bytes.len().min(1024)];
    start.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
        && !start.contains(&0)
        && (bytes.len() < HEADER || [&b"facet"[..], b"endsolid"].iter().any(|word| contains(start, word)))
}

/// Whether a word is in a text, in whatever case.
fn contains(text: &[u8], word: &[u8]) -> bool {
    text.windows(word.len()).any(|piece| piece.eq_ignore_ascii_case(word))
}

fn binary(records: &[u8], progress: &dyn Fn(f32)) -> Result<Mesh, String> {
    let mut soup = Soup::default();
    let (records, _) = records.as_chunks::<TRIANGLE>();
    for (i, record) in records.iter().enumerate() {
        if i % TRIANGLES_PER_REPORT == 0 {
            progress(i as f32 / records.len() as f32);
        }
        let (numbers, _) = record[12..48].as_chunks::<4>();
        let [x, y, z] =
            [0, 1, 2].map(|axis| [0, 3, 6].map(|corner| f32::from_le_bytes(numbers[corner + axis])));
        soup.add([0, 1, 2].map(|corner| Vec3::new(x[corner], y[corner], z[corner])))?;
    }
    Ok(soup.mesh)
}

fn ascii(bytes: &[u8], progress: &dyn Fn(f32)) -> Result<Mesh, String> {
    let line = Cell::new(0);
    let behind = Cell::new(0);
    let mut lines = Lines::of(bytes, &line, &behind);
    let at_line = |error: io::Error| format!("line {}: {error}", line.get());
    let mut soup = Soup::default();
    for (i, triangle) in stl_io::create_stl_reader(&mut lines).map_err(at_line)?.enumerate() {
        if i % TRIANGLES_PER_REPORT == 0 {
            progress(behind.get() as f32 / bytes.len() as f32);
        }
        soup.add(triangle.map_err(at_line)?.vertices.map(|vertex| Vec3::from_array(vertex.0)))?;
    }
    Ok(soup.mesh)
}

/// Triangles that find their common vertices.
#[derive(Default)]
struct Soup {
    mesh: Mesh,
    /// By the bits of its place, a vertex's number.
    numbers: HashMap<[u32; 3], u32>,
}

impl Soup {
    fn add(&mut self, corners: [Vec3; 3]) -> Result<(), String> {
        let Self { mesh, numbers } = self;
        if mesh.triangles.len() == MAX_TRIANGLES {
            return Err(format!(
                "more than {MAX_TRIANGLES} triangles, the most that are possible; split the model"
            ));
        }
        // Adding zero makes -0 what it equals. There are fewer than 3 MAX_TRIANGLES vertices, which 32 bits count.
        mesh.triangles.push(corners.map(|corner| corner + Vec3::ZERO).map(|corner| {
            *numbers.entry(corner.to_array().map(f32::to_bits)).or_insert_with(|| {
                mesh.positions.push(corner);
                mesh.positions.len() as u32 - 1
            })
        }));
        Ok(())
    }
}

/// An ASCII file, line by line, as `stl_io` likes it: in small letters, as UTF-8, and all solids as one.
struct Lines<'a> {
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
    fn of(bytes: &'a [u8], line: &'a Cell<u64>, behind: &'a Cell<usize>) -> Self {
        line.set(0);
        behind.set(0);
        Self { bytes, rest: bytes, line, behind, out: Vec::new(), read: 0, opened: false, closed: false }
    }

    /// Fills `out` with the next line; leaves it empty at the end.
    fn refill(&mut self) {
        self.out.clear();
        self.read = 0;
        if !self.opened {
            self.opened = true;
            self.out.extend_from_slice(b"solid \n");
        }
        while self.out.is_empty() && !self.rest.is_empty() {
            let start = self.rest;
            // On a slice this never fails.
            let length = self.rest.skip_until(b'\n').unwrap_or(start.len());
            self.line.set(self.line.get() + 1);
            self.behind.set(self.behind.get() + length);
            let line = start[..length].trim_ascii();
            let word = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
            if !(word.is_empty()
                || word.eq_ignore_ascii_case(b"solid")
                || word.eq_ignore_ascii_case(b"endsolid"))
            {
                self.out.extend_from_slice(String::from_utf8_lossy(line).to_ascii_lowercase().as_bytes());
                self.out.push(b'\n');
            }
        }
        if self.out.is_empty() && !self.closed {
            self.closed = true;
            self.out.extend_from_slice(b"endsolid\n");
        }
    }
}

impl Read for Lines<'_> {
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        if self.read == self.out.len() {
            self.refill();
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

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: impl AsRef<[u8]>) -> Result<(Mesh, ReadReport), String> {
        let mut report = ReadReport::default();
        parse(bytes.as_ref(), Path::new("model.stl"), &mut report, &|_| ()).map(|mesh| (mesh, report))
    }

    /// Two triangles of a square.
    const SQUARE: [[[f32; 3]; 3]; 2] = [
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, -0.0]],
        [[0.0, -0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
    ];

    fn binary_file(header: &str, triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
        let mut bytes = header.as_bytes().to_vec();
        bytes.resize(80, b' ');
        bytes.extend((triangles.len() as u32).to_le_bytes());
        for triangle in triangles {
            bytes.extend([0.0_f32; 3].iter().chain(triangle.as_flattened()).flat_map(|x| x.to_le_bytes()));
            bytes.extend([7, 0]);
        }
        bytes
    }

    fn ascii_file(triangles: &[[[f32; 3]; 3]]) -> String {
        let facets = triangles.iter().map(|corners| {
            let lines = corners.map(|[x, y, z]| format!("   vertex {x} {y} {z:e}\n")).concat();
            format!("facet normal 0 0 1\n  outer loop\n{lines}  endloop\nendfacet\n")
        });
        format!("solid a square\n{}endsolid a square\n", facets.collect::<String>())
    }

    #[track_caller]
    fn assert_square(read: Result<(Mesh, ReadReport), String>) {
        let (mesh, report) = read.expect("it can be read");
        assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
        assert!(mesh.positions.iter().all(|place| place.is_negative_bitmask() == 0), "no -0");
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(report, ReadReport::default());
    }

    #[test]
    fn both_forms_share_vertices() {
        assert_square(read(binary_file("made by a test", &SQUARE)));
        assert_square(read(ascii_file(&SQUARE)));
    }

    #[test]
    fn binary_files_may_begin_with_solid() {
        assert_square(read(binary_file("solid", &SQUARE)));
        assert_square(read(binary_file("solid facet normal\nendsolid\n", &SQUARE)));
    }

    #[test]
    fn text_in_any_case_and_any_language() {
        assert_square(read(ascii_file(&SQUARE).to_uppercase()));
        assert_square(read(ascii_file(&SQUARE).replace('\n', "\r\n\r\n").replacen(
            "solid a square",
            "\tsolid",
            1,
        )));
        let latin = [b"solid Geh\xe4use \xff\n", &ascii_file(&SQUARE).as_bytes()[15..]].concat();
        assert_square(read(latin));
    }

    #[test]
    fn all_solids_are_read() {
        assert_square(read(SQUARE.map(|triangle| ascii_file(&[triangle])).concat()));
        // The last may lack its end.
        let file = ascii_file(&SQUARE);
        assert_square(read(&file[..file.rfind("endsolid").expect("an end")]));
    }

    #[test]
    fn what_follows_the_last_triangle_is_counted() {
        let (mesh, report) =
            read([&binary_file("", &SQUARE)[..], b"12345"].concat()).expect("it can be read");
        assert_eq!((mesh.triangles.len(), report.trailing_bytes), (2, 5));
    }

    #[test]
    fn errors_say_where_and_what() {
        let file = ascii_file(&SQUARE);
        for (broken, place, what) in [
            (file.replacen("vertex 1", "vertex one", 1), "line 5", "invalid float"),
            (file.replacen("vertex 1", "vertex nan", 1), "line 5", "finite"),
            (file.replacen("  endloop\n", "   vertex 0 0 0\n", 1), "line 7", "endloop"),
            (file.replacen("facet normal", "facette", 1), "line 2", "facet"),
            (file[..file.len() / 2].to_owned(), "line ", ""),
        ] {
            let error = read(broken).expect_err("this is no STL");
            assert!(error.contains(place) && error.contains(what), "{error}");
        }
        let whole = binary_file("", &SQUARE);
        assert!(read(&whole[..whole.len() - 1]).expect_err("cut").contains("announces 2 triangles"));
        let mut lies = whole.clone();
        lies[80..84].fill(0xff);
        assert!(read(lies).expect_err("a lie").contains("announces 4294967295 triangles"));
        for short in [&b""[..], b"sol", b"PLY", &[0; 83]] {
            assert!(read(short).expect_err("too short").contains("no STL"));
        }
    }
}
