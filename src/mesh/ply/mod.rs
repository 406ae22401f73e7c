//! Stanford PLY: ASCII and both binary byte orders, read and written.
//!
//! The reader is our own. `ply-rs-bw` 4.0.1, the best-kept crate, was tried first. It is as fast
//! (the power plant's 3.9 M faces: 0.6 s for either, from a mapped file), but it refuses what real
//! files have: ASCII numbers such as `1.`, `.5` and `nan`, a Latin-1 letter in a comment, lines that
//! end in CR; and it cannot say which item of an element is wrong. It is the judge in the tests.
//!
//! What is understood: elements `vertex`, `face` and `tristrips`, in any order; `x y z` of any
//! numeric type; index lists named `vertex_indices` or `vertex_index` of any integer type; colours
//! `red green blue` or `diffuse_red …` on vertices, faces or strips. A colour per face goes before
//! one per vertex. Texture coordinates `u v`, `s t` or `texture_u texture_v` and normals `nx ny nz` of vertices come
//! along. Everything else is skipped. Faces of more than three corners become fans around their first corner (right
//! for convex ones); every second triangle of a strip is turned round.

mod body;
mod elements;
mod header;
mod looks;
mod parts;
mod write;

pub use parts::PartWriter;
pub(super) use write::shades;
pub use write::write;

use super::color;
use super::lists::{InMemory, Lists, no_room};
use super::spooled::Announced;
use super::{Colors, Mesh, ReadReport};
use body::{Ascii, Binary, Source};
pub(super) use elements::Shades;
use elements::{Faces, Vertices};
use glam::Vec3;
use header::{Element, Encoding, Header};
use looks::Looks;
use std::path::Path;

/// How many items pass between two reports of progress.
const ITEMS_PER_REPORT: u64 = 1 << 17;

/// Parses a PLY file's bytes.
pub(super) fn parse(
    bytes: &[u8],
    _path: &Path,
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
) -> Result<Mesh, String> {
    let raw = parse_to(&InMemory, bytes, report, progress)?;
    let colors = match (raw.of_faces.finish(), raw.of_vertices.finish()) {
        (Some(of_faces), _) => Colors::PerTriangle(of_faces),
        (None, Some(of_vertices)) => Colors::PerVertex(of_vertices),
        (None, None) => Colors::default(),
    };
    let attributes = raw.looks.of_triangles(&raw.triangles, report);
    Ok(Mesh { positions: raw.positions, triangles: raw.triangles, colors, attributes, ..Mesh::default() })
}

/// What a PLY file holds, as it stands there.
pub(super) struct Raw<L: Lists> {
    pub positions: L::Of<Vec3>,
    pub triangles: L::Of<[u32; 3]>,
    pub of_faces: Shades<L>,
    pub of_vertices: Shades<L>,
    pub looks: Looks<L>,
}

/// What a PLY file's header announces; `None` if it is no PLY file. How long strips are, no header says: they count as
/// if they were all that is in the file's `size` bytes beside what is known.
pub(super) fn announced(bytes: &[u8], size: u64) -> Option<Announced> {
    let header = Header::parse(bytes).ok()?;
    let named = |name: &'static str| header.elements.iter().filter(move |element| element.name == name);
    let count = |name| named(name).map(|element| element.count).sum::<u64>();
    let mut properties = named("vertex").flat_map(|element| &element.properties);
    let attributes = properties.any(elements::is_attribute);
    let body = size.saturating_sub(header.size as u64);
    let in_strips = match header.encoding {
        Encoding::Ascii => most_in_strips(&Ascii::new(&[], 0), &header, body),
        Encoding::LittleEndian | Encoding::BigEndian => {
            most_in_strips(&Binary::<false>::new(&[]), &header, body)
        }
    };
    let triangles = count("face").saturating_add(in_strips);
    Some(Announced { vertices: count("vertex"), triangles, attributes })
}

/// How many triangles strips can have in a body of so many bytes that are written as in `source`.
fn most_in_strips<S: Source>(source: &S, header: &Header, body: u64) -> u64 {
    let mut strips =
        header.elements.iter().filter(|element| element.name == "tristrips" && element.count > 0);
    let Some(index) = strips.find_map(elements::index_type) else { return 0 };
    let left = header.elements.iter().fold(body, |left, element| {
        let least: u64 = element.properties.iter().map(|p| source.least_size(p)).sum();
        left.saturating_sub(element.count.saturating_mul(least))
    });
    left / source.least_number(index)
}

/// Parses a PLY file's bytes, to lists of a kind.
pub(super) fn parse_to<L: Lists>(
    lists: &L,
    bytes: &[u8],
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
) -> Result<Raw<L>, String> {
    let header = Header::parse(bytes)?;
    let body = &bytes[header.size..];
    match header.encoding {
        Encoding::Ascii => read_body(lists, Ascii::new(body, header.lines), &header, report, progress),
        Encoding::LittleEndian => read_body(lists, Binary::<false>::new(body), &header, report, progress),
        Encoding::BigEndian => read_body(lists, Binary::<true>::new(body), &header, report, progress),
    }
}

fn read_body<L: Lists, S: Source>(
    lists: &L,
    mut source: S,
    header: &Header,
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
) -> Result<Raw<L>, String> {
    let size = source.remaining().max(1) as f32;
    let vertex_count = header.vertex_count()?;
    let mut vertices = Vertices {
        positions: lists.list::<Vec3>().map_err(no_room)?,
        shades: Shades::<L>::None,
        looks: Looks::new(lists).map_err(no_room)?,
    };
    let mut faces = Faces::<L>::new(vertex_count, lists.list().map_err(no_room)?);
    for element in &header.elements {
        check_room(element, &source)?;
        let mut row = |index: u64, source: &S| {
            if index.is_multiple_of(ITEMS_PER_REPORT) {
                progress(1.0 - source.remaining() as f32 / size);
            }
        };
        let result = match element.name.as_str() {
            "vertex" => vertices.read(lists, element, &mut source, &mut row),
            "face" => faces.read(lists, element, &mut source, false, &mut row),
            "tristrips" => faces.read(lists, element, &mut source, true, &mut row),
            _ => elements::skip(element, &mut source, &mut row),
        };
        result.map_err(|(index, message)| {
            format!("{} {index} of {}{}: {message}", element.name, element.count, source.place())
        })?;
    }
    report.trailing_bytes = source.trailing();
    report.polygons = faces.polygons;
    report.short_faces = faces.short;
    report.strips = faces.strips;
    Ok(Raw {
        positions: vertices.positions,
        triangles: faces.triangles,
        of_faces: faces.shades,
        of_vertices: vertices.shades,
        looks: vertices.looks,
    })
}

/// Refuses an element that cannot fit into what is left of the file, before anything is allocated
/// for it.
fn check_room<S: Source>(element: &Element, source: &S) -> Result<(), String> {
    let least: u64 = element.properties.iter().map(|p| source.least_size(p)).sum();
    let needed = element.count.saturating_mul(least);
    // The last number of an ASCII file needs no line end after it.
    if needed > source.remaining() as u64 + 1 {
        return Err(format!(
            "truncated: the header announces {} of element {}, at least {needed} bytes, but {} are left",
            element.count,
            element.name,
            source.remaining()
        ));
    }
    Ok(())
}

impl Shades<InMemory> {
    /// The colours as bytes; nothing if no element had any.
    fn finish(self) -> Option<Vec<[u8; 3]>> {
        match self {
            Self::None => None,
            Self::Bytes(colors) => Some(colors),
            Self::Floats(colors) => Some(color::quantize(&colors)),
        }
    }
}
