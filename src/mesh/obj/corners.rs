//! Texture coordinates and normals of an OBJ file, and of its faces' corners.

use super::lines::{parse_f32, words};
use crate::mesh::lists::{InFiles, InMemory, List, Lists};
use crate::mesh::{Attributes, Normal, ReadReport};
use crate::spool::{Spool, Spooled};
use bytemuck::Pod;
use glam::Vec3;
use std::io;

/// What `vt` and `vn` lines have given, and what faces have made of it.
pub(in crate::mesh) struct Corners<L: Lists> {
    coordinates: L::Of<[f32; 2]>,
    normals: L::Of<Normal>,
    /// Of each triangle up to the last that names any; empty if none does.
    named: L::Of<Named>,
    /// The corners of the face that is read, and whether one of them names anything.
    face: Vec<[u32; 2]>,
    names_any: bool,
    bad_coordinates: u64,
    bad_normals: u64,
}

/// The places of texture coordinates that a triangle's corners name, and those of normals, or [`NOTHING`].
type Named = [[u32; 3]; 2];

/// What a corner has that names nothing.
const NOTHING: u32 = u32::MAX;

impl<L: Lists> Corners<L> {
    /// None yet.
    pub(super) fn new(lists: &L) -> io::Result<Self> {
        Ok(Self {
            coordinates: lists.list()?,
            normals: lists.list()?,
            named: lists.list()?,
            face: Vec::new(),
            names_any: false,
            bad_coordinates: 0,
            bad_normals: 0,
        })
    }

    /// A `vt` line, trimmed: one to three numbers, of which the third does not count. What is no finite number is 0.
    pub(super) fn coordinates(&mut self, rest: &[u8]) {
        let [u, v] = numbers(rest);
        // Of a picture that is a line, the second is left out.
        let is_line = !rest.iter().any(u8::is_ascii_whitespace);
        self.bad_coordinates += u64::from(u.is_none() || (v.is_none() && !is_line));
        self.coordinates.push([u.unwrap_or(0.0), v.unwrap_or(0.0)]);
    }

    /// A `vn` line: three numbers. What has no direction is no normal.
    pub(super) fn normal(&mut self, rest: &[u8]) {
        let normal = numbers(rest).map(|x| x.unwrap_or(f32::NAN));
        let normal = Normal::encode(Vec3::from_array(normal));
        self.bad_normals += u64::from(normal == Normal::NONE);
        self.normals.push(normal);
    }

    /// Begins a face.
    pub(super) fn begin(&mut self) {
        self.face.clear();
        self.names_any = false;
    }

    /// Adds a corner to the face: what follows its vertex, `/vt/vn`, each of which may be missing.
    pub(super) fn corner(&mut self, rest: Option<&[u8]>) -> Result<(), String> {
        let Some(rest) = rest else {
            self.face.push([NOTHING; 2]);
            return Ok(());
        };
        let mut parts = rest.split(|&b| b == b'/');
        let mut place = |count, counted| match parts.next() {
            Some(text) if !text.is_empty() => resolve(text, count, counted),
            _ => Ok(NOTHING),
        };
        let coordinates = place(self.coordinates.len(), &COORDINATES)?;
        let normal = place(self.normals.len(), &NORMALS)?;
        if parts.next().is_some() {
            return Err(format!("corner {} of a face has more than three numbers", shown(rest)));
        }
        self.names_any |= rest.iter().any(|&b| b != b'/');
        self.face.push([coordinates, normal]);
        Ok(())
    }

    /// Ends the face, before which there have been so many triangles: its own are a fan around the first corner.
    pub(super) fn end(&mut self, triangles: usize) {
        let Some(([first, second], rest)) = self.face.split_first_chunk() else { return };
        if !self.names_any || rest.is_empty() {
            return;
        }
        self.named.fill([[NOTHING; 3]; 2], triangles);
        let mut last = second;
        for next in rest {
            self.named.push([0, 1].map(|which| [first, last, next].map(|corner| corner[which])));
            last = next;
        }
    }

    /// Adds to the report what was bad.
    pub(super) fn count_bad(&self, report: &mut ReadReport) {
        report.bad_texture_coordinates += self.bad_coordinates;
        report.bad_normals += self.bad_normals;
    }
}

impl Corners<InMemory> {
    /// One record for each of so many triangles, or none at all.
    pub(super) fn attributes(mut self, triangles: usize) -> Vec<Attributes> {
        if self.named.is_empty() {
            return Vec::new();
        }
        self.named.fill([[NOTHING; 3]; 2], triangles);
        let coordinates = |place: u32| self.coordinates.get(place as usize).copied().unwrap_or_default();
        let normal = |place: u32| self.normals.get(place as usize).copied().unwrap_or(Normal::NONE);
        let of = |[uv, normals]: &Named| Attributes { uv: uv.map(coordinates), normals: normals.map(normal) };
        self.named.iter().map(of).collect()
    }
}

impl Corners<InFiles> {
    /// The same, in a file; `None` in place of no records.
    ///
    /// # Errors
    /// Something cannot be written, or read.
    pub(in crate::mesh) fn attributes(
        mut self,
        triangles: usize,
        lists: &InFiles,
    ) -> io::Result<Option<Spooled<Attributes>>> {
        if self.named.is_empty() {
            return Ok(None);
        }
        self.named.fill([[NOTHING; 3]; 2], triangles);
        let (coordinates, normals) = (self.coordinates.finish()?, self.normals.finish()?);
        let mut attributes: Spool<Attributes> = lists.list()?;
        self.named.finish()?.each(|_, named| {
            let places = |which: usize| named.iter().map(|named| named[which]).collect::<Vec<_>>();
            let uv = looked_up(&coordinates, &places(0), [0.0; 2])?;
            let normals = looked_up(&normals, &places(1), Normal::NONE)?;
            for (uv, normals) in uv.into_iter().zip(normals) {
                attributes.push(Attributes { uv, normals });
            }
            Ok::<(), io::Error>(())
        })?;
        attributes.finish().map(Some)
    }
}

/// The values at some places of a list; `nothing` where there is none.
fn looked_up<T: Pod>(list: &Spooled<T>, places: &[[u32; 3]], nothing: T) -> io::Result<Vec<[T; 3]>> {
    // A place that is read anyway stands for those that are not there.
    let Some(&some) = places.as_flattened().iter().find(|&&place| place != NOTHING) else {
        return Ok(vec![[nothing; 3]; places.len()]);
    };
    let or = |place: u32| if place == NOTHING { some } else { place };
    let known: Vec<_> = places.iter().map(|places| places.map(or)).collect();
    let mut values = list.of_corners(&known)?;
    for (value, &place) in values.as_flattened_mut().iter_mut().zip(places.as_flattened()) {
        if place == NOTHING {
            *value = nothing;
        }
    }
    Ok(values)
}

/// The first numbers of a line, where they are finite.
fn numbers<const N: usize>(rest: &[u8]) -> [Option<f32>; N] {
    let mut words = words(rest);
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
pub(super) fn resolve(text: &[u8], count: usize, counted: &Counted) -> Result<u32, String> {
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
        .and_then(|i| u32::try_from(i).ok())
        .ok_or_else(|| bad(&format!("is out of range, {count} {many} come before it")))
}

/// A word as a message can show it.
fn shown(text: &[u8]) -> String {
    String::from_utf8_lossy(&text[..text.len().min(24)]).escape_debug().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners() -> Corners<InMemory> {
        Corners::new(&InMemory).expect("memory")
    }

    #[test]
    fn numbers_that_are_none_are_zeros_and_no_normals() {
        let mut corners = corners();
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
        corners.count_bad(&mut report);
        assert!(corners.attributes(7).is_empty());
        assert_eq!((report.bad_texture_coordinates, report.bad_normals), (4, 5));
    }

    #[test]
    fn faces_without_leave_their_places() {
        let mut corners = corners();
        corners.coordinates(b"1 2");
        for (face, before) in [([None; 4], 0), ([Some(&b"1"[..]), None, Some(b"/"), None], 2)] {
            corners.begin();
            face.iter().for_each(|corner| corners.corner(*corner).expect("in range"));
            corners.end(before);
        }
        let attributes = corners.attributes(5);
        assert_eq!(attributes.len(), 5);
        assert_eq!([0, 1, 4].map(|i| attributes[i]), [Attributes::NONE; 3]);
        assert_eq!([2, 3].map(|i| attributes[i].uv), [[[1.0, 2.0], [0.0; 2], [0.0; 2]]; 2]);
    }
}
