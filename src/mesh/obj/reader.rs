//! The lines of an OBJ file, one after the other, to vertices, triangles and what these have.

use super::Raw;
use super::corners::{Corners, VERTICES, resolve};
use super::library::Library;
use super::lines::{Lines, split_keyword, words};
use super::vertices::Vertices;
use crate::mesh::lists::{List, Lists, no_room};
use crate::mesh::{Material, ReadReport};
use glam::Vec3;

/// The material of triangles that none is known of.
pub(super) const UNKNOWN: u32 = u32::MAX;

/// A file that is read.
pub(super) struct Reader<'a, L: Lists> {
    library: Library<'a>,
    vertices: Vertices<L>,
    corners: Corners<L>,
    triangles: L::Of<[u32; 3]>,
    /// Of each triangle up to the last `usemtl`, its material or [`UNKNOWN`].
    of_triangle: L::Of<u32>,
    /// The material of the triangles that come.
    current: u32,
    /// Whether a `usemtl` names each of the materials.
    is_named: Vec<bool>,
    /// Whether any triangle's material is unknown.
    any_unknown: bool,
    /// The corners of the face that is read.
    face: Vec<u32>,
    unknown_materials: Vec<String>,
    polygons: u64,
    short_faces: u64,
    lines: u64,
    points: u64,
}

impl<'a, L: Lists> Reader<'a, L> {
    /// One that has read nothing.
    ///
    /// # Errors
    /// There is no room for lists.
    pub fn new(lists: &L, library: Library<'a>) -> Result<Self, String> {
        Ok(Self {
            library,
            vertices: Vertices::new(lists).map_err(no_room)?,
            corners: Corners::new(lists).map_err(no_room)?,
            triangles: lists.list().map_err(no_room)?,
            of_triangle: lists.list().map_err(no_room)?,
            current: UNKNOWN,
            is_named: Vec::new(),
            any_unknown: false,
            face: Vec::new(),
            unknown_materials: Vec::new(),
            polygons: 0,
            short_faces: 0,
            lines: 0,
            points: 0,
        })
    }

    /// Reads all lines.
    ///
    /// # Errors
    /// What is wrong with the file, with the line.
    pub fn read(&mut self, mut lines: Lines<'_>) -> Result<(), String> {
        while let Some(line) = lines.take() {
            let number = lines.number();
            self.line(&line, number).map_err(|message| format!("line {number}: {message}"))?;
        }
        self.vertices.end()
    }

    fn line(&mut self, line: &[u8], number: u64) -> Result<(), String> {
        let (keyword, rest) = split_keyword(line.trim_ascii());
        match keyword {
            b"v" => self.vertices.vertex(rest, number)?,
            b"f" => self.face(rest)?,
            b"l" => self.lines += 1,
            b"p" => self.points += 1,
            b"vt" => self.corners.coordinates(rest),
            b"vn" => self.corners.normal(rest),
            b"mtllib" => self.library.load(&String::from_utf8_lossy(rest)),
            b"usemtl" => self.use_material(rest),
            // Comments, groups, smoothing groups, free-form curves.
            _ => {}
        }
        Ok(())
    }

    fn face(&mut self, rest: &[u8]) -> Result<(), String> {
        let count = self.vertices.positions.len();
        self.face.clear();
        self.corners.begin();
        for corner in words(rest) {
            let (vertex, others) = match corner.iter().position(|&b| b == b'/') {
                Some(at) => (&corner[..at], Some(&corner[at + 1..])),
                None => (corner, None),
            };
            let vertex = resolve(vertex, count, &VERTICES)?;
            self.corners.corner(others)?;
            self.vertices.is_used(vertex);
            self.face.push(vertex);
        }
        self.corners.end(self.triangles.len());
        let [first, second, rest @ ..] = &self.face[..] else {
            self.short_faces += 1;
            return Ok(());
        };
        let mut last = second;
        for next in rest {
            self.triangles.push([*first, *last, *next]);
            last = next;
        }
        self.polygons += u64::from(rest.len() > 1);
        self.short_faces += u64::from(rest.is_empty());
        Ok(())
    }

    fn use_material(&mut self, name: &[u8]) {
        self.end_run();
        // An empty name means what an unknown one means.
        let name = if name.is_empty() { "(none)".into() } else { String::from_utf8_lossy(name) };
        match self.library.place(&name) {
            Some(place) => {
                let named = place as usize + 1;
                self.is_named.resize(self.is_named.len().max(named), false);
                self.is_named[place as usize] = true;
                self.current = place;
            }
            None => {
                if !self.unknown_materials.iter().any(|unknown| *unknown == name) {
                    self.unknown_materials.push(name.into_owned());
                }
                self.current = UNKNOWN;
            }
        }
    }

    /// Gives the triangles that have come their material.
    fn end_run(&mut self) {
        let triangles = self.triangles.len();
        self.any_unknown |= self.current == UNKNOWN && self.of_triangle.len() < triangles;
        self.of_triangle.fill(self.current, triangles);
    }

    /// What was read; adds to the report what was dropped or repaired.
    pub fn finish(mut self, report: &mut ReadReport) -> Raw<L> {
        report.polygons += self.polygons;
        report.short_faces += self.short_faces;
        report.lines += self.lines;
        report.points += self.points;
        report.unknown_materials.extend(std::mem::take(&mut self.unknown_materials));
        let colored = self.vertices.colored;
        if colored > 0 {
            report.uncolored_vertices += self.vertices.positions.len() as u64 - colored;
        }
        let named = self.is_named.iter().any(|&named| named);
        if named {
            self.end_run();
        }
        let Self { library, vertices, corners, triangles, of_triangle, is_named, any_unknown, .. } = self;
        let (materials, images) = library.finish(report);
        let outdoes =
            is_named.iter().zip(&materials).any(|(&named, material)| named && outdoes_colors(material));
        let by_material = named && (colored == 0 || outdoes);
        report.unused_vertex_colors += if by_material { colored } else { 0 };
        Raw {
            positions: vertices.positions,
            triangles,
            of_vertices: (colored > 0 && !by_material).then_some(vertices.colors),
            of_materials: by_material.then_some((materials, of_triangle)),
            any_unknown,
            images,
            corners,
        }
    }
}

/// Whether what a material says beside its colour counts for more than vertices' colours.
fn outdoes_colors(material: &Material) -> bool {
    let Material { unlit, reflects, transmission, opacity, emission, maps, .. } = material;
    *unlit
        || *reflects
        || *opacity < 1.0
        || [transmission, emission].iter().any(|light| **light != Vec3::ZERO)
        || maps.all().next().is_some()
}
