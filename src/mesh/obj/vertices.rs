//! The vertices of an OBJ file.

use super::lines::{parse_f32, words};
use crate::mesh::lists::{List, Lists};
use crate::mesh::{color, material};
use glam::Vec3;
use std::io;

/// What `v` lines have given.
pub(super) struct Vertices<L: Lists> {
    pub positions: L::Of<Vec3>,
    /// sRGB-encoded, of each vertex up to the last that has any; empty if none has.
    pub colors: L::Of<[f32; 3]>,
    /// How many vertices have a colour of their own.
    pub colored: u64,
    /// Those that are NaN or infinite, in the order of their indices.
    non_finite: Vec<NonFinite>,
}

struct NonFinite {
    vertex: u32,
    line: u64,
    is_used: bool,
}

/// The most words of a line that are looked at: more are too many.
const WORDS: usize = 8;

impl<L: Lists> Vertices<L> {
    /// None yet.
    pub fn new(lists: &L) -> io::Result<Self> {
        Ok(Self { positions: lists.list()?, colors: lists.list()?, colored: 0, non_finite: Vec::new() })
    }

    /// A `v` line, trimmed: a place, and a weight to divide it by, or a colour.
    pub fn vertex(&mut self, rest: &[u8], line: u64) -> Result<(), String> {
        let mut list = [&b""[..]; WORDS];
        let mut count = 0;
        for word in words(rest).take(WORDS) {
            list[count] = word;
            count += 1;
        }
        let place = [list[0], list[1], list[2]].map(parse_f32);
        let [Some(x), Some(y), Some(z)] = place else {
            return Err("a vertex's position is not three numbers".into());
        };
        let mut position = Vec3::new(x, y, z);
        let vertex = self.positions.len();
        if vertex >= u32::MAX as usize {
            return Err(format!("more than {} vertices are not possible; split the model", u32::MAX));
        }
        if !position.is_finite() {
            self.non_finite.push(NonFinite { vertex: vertex as u32, line, is_used: false });
        }
        match count {
            3 => {}
            4 => match parse_f32(list[3]) {
                None => return Err("a vertex's weight is no number".into()),
                Some(0.0) => return Err("a vertex's weight is zero".into()),
                Some(weight) => position /= weight,
            },
            // A seventh number is an alpha channel.
            6 | 7 => {
                let channel = |at: usize| parse_f32(list[at]);
                let alpha = if count == 7 { channel(6) } else { Some(1.0) };
                let (Some(r), Some(g), Some(b), Some(_)) = (channel(3), channel(4), channel(5), alpha) else {
                    return Err("a vertex's colour is not three numbers".into());
                };
                self.colored += 1;
                self.colors.fill(grey(), vertex);
                self.colors.push([r, g, b]);
            }
            _ => return Err("a vertex's colour has too many numbers, or too few".into()),
        }
        self.positions.push(position);
        Ok(())
    }

    /// Says that a face uses a vertex.
    #[inline]
    pub fn is_used(&mut self, vertex: u32) {
        if !self.non_finite.is_empty()
            && let Ok(place) = self.non_finite.binary_search_by_key(&vertex, |bad| bad.vertex)
        {
            self.non_finite[place].is_used = true;
        }
    }

    /// Ends the lists. An error if a face uses a vertex that is NaN or infinite.
    pub fn end(&mut self) -> Result<(), String> {
        let mut bad = self.non_finite.iter().filter(|bad| bad.is_used);
        if let Some(NonFinite { line, .. }) = bad.next() {
            return Err(format!(
                "NaN or infinite vertices that faces use: {}, the first in line {line}; repair the model",
                1 + bad.count()
            ));
        }
        if self.colored > 0 {
            self.colors.fill(grey(), self.positions.len());
        }
        Ok(())
    }
}

/// What a vertex without a colour has where others have one.
fn grey() -> [f32; 3] {
    [f32::from(color::linear_to_srgb(material::DEFAULT_DIFFUSE.x)) / 255.0; 3]
}
