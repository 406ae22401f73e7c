//! Writing binary PLY part by part, for models that memory does not hold.

use super::write::{FACE, VERTEX, face, header, shades, vertex};
use crate::mesh::Material;
use crate::mesh::generate::{Part, Size};
use std::io::{self, Seek, SeekFrom, Write};

/// The most vertices that the file's type of index, `int`, can number.
const MAX_VERTICES: u64 = 1 << 31;

/// A PLY file that grows at two places at once: where the next vertex goes and where the next face goes.
///
/// The size of the whole is known from the start, so both places are: vertices begin after the header,
/// faces after the last vertex. The file has holes until the last part is written.
pub struct PartWriter<'a, W> {
    out: &'a mut W,
    /// Where the first vertex and the first face are, in bytes from the beginning of the file.
    vertices_at: u64,
    faces_at: u64,
    /// What the header announces, and how much of it is written.
    announced: Size,
    written: Size,
    shades: Vec<[u8; 3]>,
}

impl<'a, W: Write + Seek> PartWriter<'a, W> {
    /// Begins a file of a model of exactly this size, at the beginning of `out`.
    ///
    /// # Errors
    ///
    /// More vertices than PLY's `int` can number, or what `out` has to say.
    pub fn begin(out: &'a mut W, size: Size, materials: &[Material]) -> io::Result<Self> {
        if size.vertices > MAX_VERTICES {
            let message =
                format!("{} vertices, at most {MAX_VERTICES} can be numbered; ask for fewer", size.vertices);
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        let header = header(size.vertices, size.triangles, false);
        out.write_all(header.as_bytes())?;
        let vertices_at = header.len() as u64;
        let faces_at = vertices_at + size.vertices * VERTEX;
        let shades = shades(materials);
        Ok(Self { out, vertices_at, faces_at, announced: size, written: Size::default(), shades })
    }

    /// Writes the next part.
    ///
    /// # Errors
    ///
    /// What the file has to say.
    ///
    /// # Panics
    ///
    /// If the model becomes larger than announced, or the part uses a material that there is not.
    pub fn part(&mut self, part: Part<'_>) -> io::Result<()> {
        let before = self.written;
        self.written += part.size();
        let fits = self.written.vertices <= self.announced.vertices
            && self.written.triangles <= self.announced.triangles;
        assert!(fits, "{:?} announced, {:?} written", self.announced, self.written);
        self.out.seek(SeekFrom::Start(self.vertices_at + before.vertices * VERTEX))?;
        part.positions.iter().try_for_each(|&p| vertex(self.out, p))?;
        self.out.seek(SeekFrom::Start(self.faces_at + before.triangles * FACE))?;
        // It fits: there are not more vertices than 2^31.
        let base = before.vertices as u32;
        for (triangle, material) in part.triangles.iter().zip(part.of_triangle) {
            face(self.out, triangle.map(|i| base + i), Some(self.shades[*material as usize]))?;
        }
        Ok(())
    }

    /// How much is written.
    pub fn written(&self) -> Size {
        self.written
    }

    /// Ends the file.
    ///
    /// # Errors
    ///
    /// What was written is less than was announced: the file would have holes.
    pub fn finish(self) -> io::Result<()> {
        if self.written != self.announced {
            let message = format!("{:?} announced, {:?} written", self.announced, self.written);
            return Err(io::Error::other(message));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{self, Colors, Mesh};
    use glam::Vec3;
    use std::io::Cursor;

    const POSITIONS: [Vec3; 4] = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];

    fn materials() -> Vec<Material> {
        [Vec3::X, Vec3::Y].map(|diffuse| Material::matt("paint", diffuse)).into()
    }

    fn parts() -> [Part<'static>; 2] {
        [
            Part { positions: &POSITIONS[..3], triangles: &[[0, 1, 2]], of_triangle: &[1] },
            Part { positions: &POSITIONS, triangles: &[[3, 1, 2], [0, 2, 3]], of_triangle: &[0, 1] },
        ]
    }

    #[test]
    fn parts_come_back_as_one_mesh() {
        let mut file = Cursor::new(Vec::new());
        let size = Size { triangles: 3, vertices: 7 };
        let mut writer = PartWriter::begin(&mut file, size, &materials()).expect("begun");
        for part in parts() {
            writer.part(part).expect("written");
        }
        writer.finish().expect("complete");
        let loaded = mesh::parse(&file.into_inner(), "parts.ply").expect("well-formed");
        // The reader drops vertices that no triangle uses: here none.
        let expected = Mesh {
            positions: [&POSITIONS[..3], &POSITIONS].concat(),
            triangles: vec![[0, 1, 2], [6, 4, 5], [3, 5, 6]],
            colors: Colors::PerTriangle(vec![[0, 255, 0], [255, 0, 0], [0, 255, 0]]),
            ..Mesh::default()
        };
        assert_eq!(loaded.mesh, expected);
        assert_eq!(loaded.report.trailing_bytes, 0);
    }

    #[test]
    fn a_file_with_holes_is_an_error() {
        let mut file = Cursor::new(Vec::new());
        let size = Size { triangles: 3, vertices: 7 };
        let mut writer = PartWriter::begin(&mut file, size, &materials()).expect("begun");
        writer.part(parts()[0]).expect("written");
        writer.finish().expect_err("a part is missing");
    }

    #[test]
    fn what_cannot_be_numbered_is_refused() {
        let size = Size { triangles: 3, vertices: MAX_VERTICES + 1 };
        let Err(error) = PartWriter::begin(&mut Cursor::new(Vec::new()), size, &[]) else { panic!() };
        assert!(error.to_string().contains("ask for fewer"), "{error}");
    }
}
