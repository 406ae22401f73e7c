//! Texture coordinates and normals of an OBJ file, and of its faces' corners.

use super::feed::parse_f32;
use crate::mesh::{Attributes, Normal, ReadReport};
use glam::Vec3;

/// What `vt` and `vn` lines have given, and what faces have made of it.
///
/// tobj never sees any of it: it would take a vertex for several wherever two triangles differ in these, and panic
/// at indices out of range. That its triangles are these, in this order, is sure: it makes the same fan of each
/// face, one face after the other, and leaves none out that has three corners or more.
#[derive(Default)]
pub(super) struct Corners {
    coordinates: Vec<[f32; 2]>,
    normals: Vec<Normal>,
    /// Of each triangle up to the last that has any; empty if none has.
    attributes: Vec<Attributes>,
    /// How many triangles there have been.
    triangles: usize,
    /// The corners of the face that is read, and whether one of them has anything.
    face: Vec<([f32; 2], Normal)>,
    named: bool,
    bad_coordinates: u64,
    bad_normals: u64,
}

impl Corners {
    /// A `vt` line, trimmed: one to three numbers, of which the third does not count. What is no finite number is 0.
    pub fn coordinates(&mut self, rest: &[u8]) {
        let [u, v] = numbers(rest);
        // Of a picture that is a line, the second is left out.
        let is_line = !rest.iter().any(u8::is_ascii_whitespace);
        self.bad_coordinates += u64::from(u.is_none() || (v.is_none() && !is_line));
        self.coordinates.push([u.unwrap_or(0.0), v.unwrap_or(0.0)]);
    }

    /// A `vn` line: three numbers. What has no direction is no normal.
    pub fn normal(&mut self, rest: &[u8]) {
        let normal = numbers(rest).map(|x| x.unwrap_or(f32::NAN));
        let normal = Normal::encode(Vec3::from_array(normal));
        self.bad_normals += u64::from(normal == Normal::NONE);
        self.normals.push(normal);
    }

    /// Begins a face.
    pub fn begin(&mut self) {
        self.face.clear();
        self.named = false;
    }

    /// Adds a corner to the face: what follows its vertex, `/vt/vn`, each of which may be missing.
    pub fn corner(&mut self, rest: Option<&[u8]>) -> Result<(), String> {
        let Some(rest) = rest else {
            self.face.push(([0.0; 2], Normal::NONE));
            return Ok(());
        };
        let mut parts = rest.split(|&b| b == b'/');
        let coordinates = match parts.next() {
            Some(text) if !text.is_empty() => {
                self.coordinates[resolve(text, self.coordinates.len(), &COORDINATES)?]
            }
            _ => [0.0; 2],
        };
        let normal = match parts.next() {
            Some(text) if !text.is_empty() => self.normals[resolve(text, self.normals.len(), &NORMALS)?],
            _ => Normal::NONE,
        };
        if parts.next().is_some() {
            return Err(format!("corner {} of a face has more than three numbers", shown(rest)));
        }
        self.named |= rest.iter().any(|&b| b != b'/');
        self.face.push((coordinates, normal));
        Ok(())
    }

    /// Ends the face: its triangles are a fan around the first corner.
    pub fn end(&mut self) {
        let Some(([first, second], rest)) = self.face.split_first_chunk() else { return };
        if self.named && !rest.is_empty() {
            self.attributes.resize(self.triangles, Attributes::NONE);
            let mut last = second;
            for next in rest {
                let corners = [first, last, next];
                self.attributes.push(Attributes { uv: corners.map(|c| c.0), normals: corners.map(|c| c.1) });
                last = next;
            }
        }
        self.triangles += rest.len();
    }

    /// How many triangles have ended.
    pub fn triangles(&self) -> usize {
        self.triangles
    }

    /// One record a triangle, or none at all; adds to the report what was bad.
    pub fn finish(mut self, report: &mut ReadReport) -> Vec<Attributes> {
        report.bad_texture_coordinates += self.bad_coordinates;
        report.bad_normals += self.bad_normals;
        if !self.attributes.is_empty() {
            self.attributes.resize(self.triangles, Attributes::NONE);
            self.attributes.shrink_to_fit();
        }
        self.attributes
    }
}

/// The first numbers of a line, where they are finite.
fn numbers<const N: usize>(rest: &[u8]) -> [Option<f32>; N] {
    let mut words = rest.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
    std::array::from_fn(|_| words.next().and_then(parse_f32).filter(|x| x.is_finite()))
}

/// What a face's index counts.
pub(super) struct Counted {
    one: &'static str,
    many: &'static str,
}

/// `v`.
pub(super) const VERTICES: Counted = Counted { one: "vertex", many: "vertices" };
const COORDINATES: Counted = Counted { one: "texture coordinate", many: "texture coordinates" };
const NORMALS: Counted = Counted { one: "normal", many: "normals" };

/// What a face's index means, counted from 0, of `count` that come before it: it counts from 1, or from the end if it
/// is negative.
pub(super) fn resolve(text: &[u8], count: usize, counted: &Counted) -> Result<usize, String> {
    let Counted { one, many } = counted;
    let bad = |what: &str| format!("{one} {} of a face {what}", shown(text));
    let index = match std::str::from_utf8(text).ok().and_then(|t| t.parse::<i64>().ok()) {
        None => return Err(bad(&format!("is no {one} number"))),
        Some(0) => return Err(bad(&format!("does not exist, {many} count from 1"))),
        Some(n) if n > 0 => usize::try_from(n - 1).ok(),
        Some(n) => usize::try_from(n.unsigned_abs()).ok().and_then(|back| count.checked_sub(back)),
    };
    index
        .filter(|&i| i < count)
        .ok_or_else(|| bad(&format!("is out of range, {count} {many} come before it")))
}

/// A word as a message can show it.
fn shown(text: &[u8]) -> String {
    String::from_utf8_lossy(&text[..text.len().min(24)]).escape_debug().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_are_none_are_zeros_and_no_normals() {
        let mut corners = Corners::default();
        for line in ["0.25 0.5 7", "0.75", "nan 1", "1 inf", "", "1 x"] {
            corners.coordinates(line.as_bytes());
        }
        assert_eq!(
            corners.coordinates,
            [[0.25, 0.5], [0.75, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, 0.0], [1.0, 0.0]]
        );
        for line in ["0 0 2", "0 0 0", "nan 0 1", "1 0", "inf 0 0", "a b c"] {
            corners.normal(line.as_bytes());
        }
        assert_eq!(corners.normals[0].decode(), Vec3::Z);
        assert!(corners.normals[1..].iter().all(|&normal| normal == Normal::NONE));
        let mut report = ReadReport::default();
        assert!(corners.finish(&mut report).is_empty());
        assert_eq!((report.bad_texture_coordinates, report.bad_normals), (4, 5));
    }

    #[test]
    fn faces_without_leave_their_places() {
        let mut corners = Corners::default();
        corners.coordinates(b"1 2");
        for face in [[None; 4], [Some(&b"1"[..]), None, Some(b"/"), None]] {
            corners.begin();
            face.iter().for_each(|corner| corners.corner(*corner).expect("in range"));
            corners.end();
        }
        corners.begin();
        (0..3).for_each(|_| corners.corner(None).expect("nothing"));
        corners.end();
        assert_eq!(corners.triangles(), 5);
        let attributes = corners.finish(&mut ReadReport::default());
        assert_eq!(attributes.len(), 5);
        assert_eq!([0, 1, 4].map(|i| attributes[i]), [Attributes::NONE; 3]);
        assert_eq!([2, 3].map(|i| attributes[i].uv), [[[1.0, 2.0], [0.0; 2], [0.0; 2]]; 2]);
    }
}
