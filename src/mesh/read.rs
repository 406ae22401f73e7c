//! Reading a model file, whatever its format, and saying what was found wrong with it.

use super::check::{self, MAX_TRIANGLES, Unusable};
use super::{Mesh, gltf, obj, ply, stl};
use crate::error::{Error, Result};
use crate::mapped::Map;
use crate::stage::Stage;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;

/// A model as it came out of its file.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The mesh.
    pub mesh: Mesh,
    /// What was kept, dropped and repaired on the way.
    pub report: ReadReport,
}

/// What a reader kept, and what it dropped or repaired.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ReadReport {
    /// Triangles in the mesh.
    pub triangles: u64,
    /// Vertices in the mesh.
    pub vertices: u64,
    /// Dropped: triangles that name one vertex twice.
    pub degenerate_triangles: u64,
    /// Kept: triangles of three different vertices whose positions lie on one line.
    pub zero_area_triangles: u64,
    /// Dropped: vertices that no triangle uses.
    pub unused_vertices: u64,
    /// How many of the unused vertices were NaN or infinite.
    pub unused_non_finite: u64,
    /// Faces of more than three corners, which became fans of triangles.
    pub polygons: u64,
    /// Triangle strips that were unrolled.
    pub strips: u64,
    /// Dropped: faces of fewer than three corners.
    pub short_faces: u64,
    /// Dropped: lines (OBJ `l`).
    pub lines: u64,
    /// Dropped: points (OBJ `p`).
    pub points: u64,
    /// Vertices that got the default colour because only others had one.
    pub uncolored_vertices: u64,
    /// MTL files that could not be read.
    pub missing_material_files: Vec<String>,
    /// Materials that are used but nowhere defined; they got the default colour.
    pub unknown_materials: Vec<String>,
    /// MTL lines that made no sense and were left out.
    pub bad_material_lines: u64,
    /// Texture coordinates that were no finite numbers; they are 0.
    pub bad_texture_coordinates: u64,
    /// Normals without a direction; where they are used, triangles are flat.
    pub bad_normals: u64,
    /// Vertex colours that were left out because materials do more.
    pub unused_vertex_colors: u64,
    /// Pictures that materials name and that are not there.
    pub missing_textures: Vec<String>,
    /// Pictures that materials name outside of the model's folder; they are not opened.
    pub outside_textures: Vec<String>,
    /// Bytes after the last element that the header announces.
    pub trailing_bytes: u64,

    /// What of a glTF file is not shown as it says, a clause each, none twice.
    pub notes: Vec<String>,
}

impl ReadReport {
    /// What was dropped or repaired, in one line; empty if nothing was.
    pub fn summary(&self) -> String {
        let counted = [
            (self.polygons, "polygon", "split into triangles"),
            (self.strips, "triangle strip", "unrolled"),
            (self.degenerate_triangles, "triangle", "with a repeated vertex dropped"),
            (self.zero_area_triangles, "triangle", "without area kept"),
            (self.short_faces, "face", "of fewer than three corners dropped"),
            (self.lines, "line", "ignored"),
            (self.points, "point", "ignored"),
            (self.unused_vertices, "unused vertex", "dropped"),
            (self.unused_non_finite, "unused vertex", "NaN or infinite"),
            (self.uncolored_vertices, "vertex", "without a colour made grey"),
            (self.bad_material_lines, "MTL line", "not understood"),
            (self.bad_texture_coordinates, "texture coordinate", "not finite made 0"),
            (self.bad_normals, "normal", "without a direction ignored"),
            (self.unused_vertex_colors, "vertex colour", "left out for materials that do more"),
            (self.trailing_bytes, "byte", "after the end of the data ignored"),
        ];
        let mut parts: Vec<String> = counted
            .iter()
            .filter(|(count, ..)| *count > 0)
            .map(|(count, noun, what)| format!("{count} {} {what}", plural(noun, *count)))
            .collect();
        let named = [
            ("material file", "not found", &self.missing_material_files),
            ("material", "not defined", &self.unknown_materials),
            ("texture", "not found", &self.missing_textures),
            ("texture", "outside of the model's folder left out", &self.outside_textures),
        ];
        for (noun, what, names) in named.iter().filter(|(.., names)| !names.is_empty()) {
            let mut part = format!("{} {what}: ", plural(noun, names.len() as u64));
            // A name may be anything: what would end the line, or steer a terminal, is not shown.
            let shown = names.iter().take(3).map(|name| name.replace(char::is_control, "?"));
            part.push_str(&shown.collect::<Vec<_>>().join(", "));
            if names.len() > 3 {
                let _ = write!(part, " and {} more", names.len() - 3);
            }
            parts.push(part);
        }

        parts.extend(self.notes.iter().cloned());
        parts.join("; ")
    }

    /// Adds to [`notes`](Self::notes) what is not there yet. What a file's own words bring in stays on one line.
    pub(super) fn note(&mut self, note: String) {
        let shown = |c: char| if c.is_control() { c.escape_default().collect() } else { String::from(c) };
        let note: String = note.chars().map(shown).collect();
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }
}

/// `noun` as `count` demands it.
fn plural(noun: &str, count: u64) -> String {
    match noun.strip_suffix("ex") {
        _ if count == 1 => noun.into(),
        Some(stem) => format!("{stem}ices"),
        None => format!("{noun}s"),
    }
}

/// Reads a model. The file's ending decides how: `.obj` (with its MTL files), `.ply`, `.stl`, `.gltf` or `.glb`
/// (with the buffers that they name).
///
/// # Errors
///
/// The file cannot be read, is of another kind, is malformed or truncated, names vertices that
/// do not exist, has no triangles or too many, or has triangles with NaN or infinite corners.
/// Each message is one line that names the file and, where it can be known, the place.
pub fn read(path: impl AsRef<Path>) -> Result<Loaded> {
    read_with_progress(path, &|_| {})
}

/// The same; `progress` is told now and then what part of the file (0 to 1) is behind.
pub fn read_with_progress(path: impl AsRef<Path>, progress: &dyn Fn(f32)) -> Result<Loaded> {
    let path = path.as_ref();
    let parser = parser(path)?;
    let bytes = map(path).map_err(|source| Error::Read { path: path.into(), source })?;
    parse_with(parser, &bytes, path, progress)
}

/// The same from a file's bytes. `path` says by its ending how they are to be read, is what errors name,
/// and gives the folder in which an OBJ's MTL files are looked up; there need be no such file.
///
/// # Errors
///
/// As [`read`].
pub fn parse(bytes: &[u8], path: impl AsRef<Path>) -> Result<Loaded> {
    let path = path.as_ref();
    parse_with(parser(path)?, bytes, path, &|_| {})
}

/// What makes a mesh, not checked yet, of a file's bytes.
type Parser = fn(&[u8], &Path, &mut ReadReport, &dyn Fn(f32)) -> Result<Mesh, String>;

/// The kinds of model files.
#[derive(Clone, Copy)]
pub(super) enum Format {
    Obj,
    Ply,
    Stl,
    Gltf,
}

impl Format {
    /// The one that a path's ending says.
    ///
    /// # Errors
    /// It says none of them.
    pub fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("obj") => Ok(Self::Obj),
            Some("ply") => Ok(Self::Ply),
            Some("stl") => Ok(Self::Stl),
            Some("gltf" | "glb") => Ok(Self::Gltf),
            _ => {
                let expected = "a model is a .obj, .ply, .stl, .gltf or .glb file";
                Err(Error::UnknownFormat { path: path.into(), expected })
            }
        }
    }
}

/// The parser that a path's ending asks for.
fn parser(path: &Path) -> Result<Parser> {
    Ok(match Format::of(path)? {
        Format::Obj => obj::parse,
        Format::Ply => ply::parse,
        Format::Stl => stl::parse,
        Format::Gltf => gltf::parse,
    })
}

fn parse_with(parser: Parser, bytes: &[u8], path: &Path, progress: &dyn Fn(f32)) -> Result<Loaded> {
    let malformed = |message: String| Error::malformed(path, message);
    let mut report = ReadReport::default();
    let raw = parser(bytes, path, &mut report, progress).map_err(malformed)?;
    let (vertices, faces) = (raw.positions.len(), raw.triangles.len());
    Stage::Checking.begin();
    let mesh =
        check::check(raw, &mut report).map_err(|unusable| malformed(unusable.message(vertices, faces)))?;
    progress(1.0);
    Ok(Loaded { mesh, report })
}

impl Unusable {
    /// What is wrong with a file of so many vertices and triangles.
    pub(super) fn message(&self, vertices: usize, faces: usize) -> String {
        match self {
            Self::NoTriangles if faces == 0 => {
                format!("no triangles ({vertices} vertices); a model needs faces, not points or lines alone")
            }
            Self::NoTriangles => {
                format!("no triangles: all {faces} name a vertex twice")
            }
            Self::TooManyTriangles(n) => {
                format!("{n} triangles, at most {MAX_TRIANGLES} are possible; split the model")
            }
            Self::NonFinite(bad) => format!(
                "{} {} that triangles use {} NaN or infinite, the first is vertex {} (counted from 0); repair the model",
                bad.count,
                plural("vertex", bad.count),
                if bad.count == 1 { "is" } else { "are" },
                bad.first,
            ),
        }
    }
}

/// The file's bytes, mapped. Nothing of them is kept: whoever maps a model drops the map when it is read.
pub(super) fn map(path: &Path) -> std::io::Result<Map> {
    Map::open(path).map(|(_, map)| map)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_to_say_about_a_sound_file() {
        let report = ReadReport { triangles: 7, vertices: 9, ..Default::default() };
        assert_eq!(report.summary(), "");
    }

    #[test]
    fn the_summary_is_one_line_with_counts_and_names() {
        let report = ReadReport {
            polygons: 1,
            unused_vertices: 2,
            unknown_materials: ["a", "b", "c", "d", "e"].map(String::from).to_vec(),
            ..Default::default()
        };
        assert_eq!(
            report.summary(),
            "1 polygon split into triangles; 2 unused vertices dropped; \
             materials not defined: a, b, c and 2 more"
        );
    }
}
