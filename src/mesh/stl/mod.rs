//! STL, ASCII through `stl_io`, and binary.
//!
//! Which of the two a file is, its size and its text tell: the first word is `solid` in many a binary file as well. A
//! binary file is fixed records behind a count, which is believed only if the file is as long as it says. `stl_io`
//! takes ASCII apart; `text` stands before it, because it knows one spelling alone, stops after the first of several
//! solids, and names no line when something is wrong.
//!
//! Corners at the same place become one vertex, so that neighbours share their edges to the bit: in memory by a table
//! of all vertices, in files by tables of a part of them each (`weld`). Facet normals and the attribute bytes of binary
//! files are ignored: the order of its corners says which side of a facet is the front.

mod text;
mod weld;

use super::check::MAX_TRIANGLES;
use super::lists::{InFiles, no_room};
use super::spooled::Announced;
use super::{Mesh, ReadReport};
use glam::Vec3;
use std::cell::Cell;
use std::collections::HashMap;
use std::io;
use std::path::Path;
use text::Lines;
pub(super) use weld::Weld;

/// Bytes before a binary file's first triangle: 80 of anything, then the count.
const HEADER: usize = 84;

/// Bytes of a binary file's triangle: a normal, three corners, two bytes of attributes.
const TRIANGLE: usize = 50;

/// Bytes of an ASCII file's triangle, at least.
const TEXT_TRIANGLE: usize = 80;

/// Triangles between two reports of progress.
const TRIANGLES_PER_REPORT: usize = 1 << 16;

/// Parses an STL file's bytes.
pub(super) fn parse(
    bytes: &[u8],
    _path: &Path,
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
) -> Result<Mesh, String> {
    let mut soup = Soup::default();
    walk(bytes, report, progress, |corners| soup.add(corners))?;
    Ok(soup.mesh)
}

/// Parses an STL file's bytes, to lists in files, whose corners are yet to be welded.
pub(super) fn parse_to(
    lists: &InFiles,
    bytes: &[u8],
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
) -> Result<Weld, String> {
    let mut weld = Weld::new(lists, Form::of(bytes)?.most(bytes)).map_err(no_room)?;
    walk(bytes, report, progress, |corners| weld.add(corners))?;
    Ok(weld)
}

/// How much is in an STL file, as a binary one's header announces and an ASCII one's lines show; `None` of what is
/// neither. How many of the corners are the same is not known before they are read: each counts as a vertex.
pub(super) fn announced(bytes: &[u8], progress: &dyn Fn(f32)) -> Option<Announced> {
    let triangles = match Form::of(bytes).ok()? {
        Form::Binary { count, .. } => u64::from(count),
        Form::Text => text::facets(bytes, progress),
    };
    Some(Announced { vertices: triangles.saturating_mul(3), triangles, attributes: false })
}

/// How a file is written.
enum Form {
    /// So many records from [`HEADER`] on, which end at a byte of the file.
    Binary {
        count: u32,
        end: usize,
    },
    Text,
}

impl Form {
    /// That of a file.
    ///
    /// # Errors
    /// It has neither.
    fn of(bytes: &[u8]) -> Result<Self, String> {
        let size = bytes.len() as u64;
        let binary = |count: u32, end: u64| Ok(Self::Binary { count, end: end as usize });
        match header(bytes) {
            // What ends exactly where its count says is binary, whatever it begins with.
            Some((count, end)) if end == size => binary(count, end),
            _ if is_text(bytes) => Ok(Self::Text),
            Some((count, end)) if end < size => binary(count, end),
            Some((count, end)) => Err(format!(
                "neither an ASCII STL nor a whole binary one: its header announces {count} triangles, which end at \
                 byte {end}, but the file has {size} bytes; export it again"
            )),
            None => Err(format!(
                "no STL: it does not begin with \"solid\", and its {size} bytes are too few for a binary header"
            )),
        }
    }

    /// How many triangles it can have at most.
    fn most(&self, bytes: &[u8]) -> usize {
        match self {
            Self::Binary { count, .. } => *count as usize,
            Self::Text => bytes.len() / TEXT_TRIANGLE + 1,
        }
    }
}

/// How many triangles a binary file has by its header, and where it ends then; `None` if it has none.
fn header(bytes: &[u8]) -> Option<(u32, u64)> {
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

/// Gives all triangles in their order. Adding zero has made -0 what it equals.
///
/// # Errors
/// It is no STL, and in which line if there are lines; or there are too many triangles.
fn walk(
    bytes: &[u8],
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
    mut give: impl FnMut([Vec3; 3]),
) -> Result<(), String> {
    let give = |corners: [Vec3; 3]| give(corners.map(|corner| corner + Vec3::ZERO));
    match Form::of(bytes)? {
        Form::Binary { count, .. } if count as usize > MAX_TRIANGLES => Err(too_many()),
        Form::Binary { end, .. } => {
            report.trailing_bytes = (bytes.len() - end) as u64;
            binary(&bytes[..end], &|behind| progress(behind as f32 / bytes.len() as f32), give);
            Ok(())
        }
        Form::Text => ascii(bytes, progress, give),
    }
}

fn too_many() -> String {
    format!("more than {MAX_TRIANGLES} triangles, the most that are possible; split the model")
}

/// The triangles of a binary file that ends with the last. `progress` is told how many bytes are behind.
fn binary(bytes: &[u8], progress: &dyn Fn(usize), mut give: impl FnMut([Vec3; 3])) {
    let (records, _) = bytes[HEADER..].as_chunks::<TRIANGLE>();
    for (i, record) in records.iter().enumerate() {
        if i % TRIANGLES_PER_REPORT == 0 {
            progress(HEADER + i * TRIANGLE);
        }
        let (numbers, _) = record[12..48].as_chunks::<4>();
        let [x, y, z] =
            [0, 1, 2].map(|axis| [0, 3, 6].map(|corner| f32::from_le_bytes(numbers[corner + axis])));
        give([0, 1, 2].map(|corner| Vec3::new(x[corner], y[corner], z[corner])));
    }
}

fn ascii(bytes: &[u8], progress: &dyn Fn(f32), mut give: impl FnMut([Vec3; 3])) -> Result<(), String> {
    let line = Cell::new(0);
    let behind = Cell::new(0);
    let mut lines = Lines::of(bytes, &line, &behind);
    let at_line = |error: io::Error| format!("line {}: {error}", line.get());
    for (i, triangle) in stl_io::create_stl_reader(&mut lines).map_err(at_line)?.enumerate() {
        if i % TRIANGLES_PER_REPORT == 0 {
            progress(behind.get() as f32 / bytes.len() as f32);
        }
        let corners = triangle.map_err(at_line)?.vertices;
        if i == MAX_TRIANGLES {
            return Err(too_many());
        }
        give(corners.map(|vertex| Vec3::from_array(vertex.0)));
    }
    Ok(())
}

/// Triangles that find their common vertices.
#[derive(Default)]
struct Soup {
    mesh: Mesh,
    /// By the bits of its place, a vertex's number.
    numbers: HashMap<[u32; 3], u32>,
}

impl Soup {
    fn add(&mut self, corners: [Vec3; 3]) {
        let Self { mesh, numbers } = self;
        // There are not more than 3 MAX_TRIANGLES vertices, which 32 bits count.
        mesh.triangles.push(corners.map(|corner| {
            *numbers.entry(corner.to_array().map(f32::to_bits)).or_insert_with(|| {
                mesh.positions.push(corner);
                mesh.positions.len() as u32 - 1
            })
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a file's bytes become, in memory and in files alike.
    fn read(bytes: impl AsRef<[u8]>) -> Result<(Mesh, ReadReport), String> {
        let bytes = bytes.as_ref();
        let mut report = ReadReport::default();
        let read =
            parse(bytes, Path::new("model.stl"), &mut report, &|_| ()).map(|mesh| (mesh, report.clone()));

        let lists = InFiles::new(std::env::temp_dir());
        let mut report = ReadReport::default();
        let in_files = parse_to(&lists, bytes, &mut report, &|_| ()).map(|weld| {
            let (positions, triangles) = weld.finish(&lists, &|_| ()).expect("room");
            let positions = positions.to_vec().expect("readable");
            let triangles = triangles.to_vec().expect("readable");
            (Mesh { positions, triangles, ..Mesh::default() }, report)
        });
        assert_eq!(in_files, read);
        read
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
    fn triangles_are_counted_before_they_are_read() {
        let count = |bytes: &[u8]| announced(bytes, &|_| ()).map(|found| (found.triangles, found.vertices));
        let (binary, text) = (binary_file("solid", &SQUARE), ascii_file(&SQUARE));
        assert_eq!(count(&binary), Some((2, 6)));
        assert_eq!(count(text.as_bytes()), Some((2, 6)));
        assert_eq!(count(text.to_uppercase().as_bytes()), Some((2, 6)));
        assert_eq!(count(&binary[..binary.len() - 1]), None, "neither of both");
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
            (file.replacen("endloop\n", &"x ".repeat(3000), 1), "line 7", "bytes are more than 4096"),
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
