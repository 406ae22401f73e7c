//! From numbers to vertices, triangles and colours.

use super::body::Source;
use super::header::{Element, Kind, Property, Scalar};
use super::looks::Looks;
use crate::mesh::color;
use crate::mesh::lists::{List, Lists, no_room};
use crate::mesh::material::DEFAULT_DIFFUSE;
use glam::Vec3;
use std::collections::TryReserveError;

/// Which item of an element is wrong (counted from 0), and what is wrong with it.
pub(super) type ItemError = (u64, String);

/// Colours as they are collected; all sRGB-encoded.
pub(in crate::mesh) enum Shades<L: Lists> {
    None,
    Bytes(L::Of<[u8; 3]>),
    Floats(L::Of<[f32; 3]>),
}

impl<L: Lists> Shades<L> {
    /// Makes the colours of a new element's items, whose type is `kind`, follow `done` items.
    fn begin(&mut self, lists: &L, kind: Scalar, done: usize) -> Result<(), ItemError> {
        let grey = color::encode(DEFAULT_DIFFUSE);
        if matches!(self, Self::None) {
            *self = match kind.is_float() {
                true => Self::Floats(lists.list().map_err(no_list)?),
                false => Self::Bytes(lists.list().map_err(no_list)?),
            };
        }
        match self {
            Self::None => {}
            Self::Bytes(colors) => colors.fill(grey, done),
            Self::Floats(colors) => colors.fill(grey.map(|c| f32::from(c) / 255.0), done),
        }
        Ok(())
    }

    /// Gives the next `count` items the colour that an element states.
    fn push(&mut self, kind: Scalar, color: [f64; 3], count: usize) {
        // Sixteen-bit colours run to 65535; integers of all other types are bytes in disguise.
        let byte = |c: f64| match kind {
            Scalar::U16 => (c / 257.0 + 0.5) as u8,
            Scalar::F32 | Scalar::F64 => (c * 255.0 + 0.5) as u8,
            _ => c as u8,
        };
        match self {
            Self::None => {}
            Self::Bytes(colors) => colors.push_times(color.map(byte), count),
            Self::Floats(colors) if kind.is_float() => colors.push_times(color.map(|c| c as f32), count),
            Self::Floats(colors) => colors.push_times(color.map(|c| f32::from(byte(c)) / 255.0), count),
        }
    }
}

/// Where a property's value goes.
#[derive(Clone, Copy, PartialEq)]
enum Slot {
    Skip,
    Position(usize),
    Color(usize),
    Coordinate(usize),
    Normal(usize),
    Indices,
}

/// What an element's properties mean, in their order.
struct Layout {
    slots: Vec<(Slot, Kind)>,
    /// The type of the colours, if all three are there.
    color: Option<Scalar>,
}

impl Layout {
    fn new(element: &Element) -> Self {
        let mut slots: Vec<(Slot, Kind)> =
            element.properties.iter().map(|p| (slot(&p.name, p.kind), p.kind)).collect();
        // Of two properties that mean the same (`red` and `diffuse_red`), the first counts.
        for i in 1..slots.len() {
            if slots[..i].iter().any(|(s, _)| *s == slots[i].0) {
                slots[i].0 = Slot::Skip;
            }
        }
        let mut layout = Self { slots, color: None };
        if (0..3).all(|c| layout.has(Slot::Color(c))) {
            layout.color = layout.slots.iter().find_map(|s| match *s {
                (Slot::Color(0), Kind::Scalar(kind)) => Some(kind),
                _ => None,
            });
        }
        layout
    }

    fn has(&self, slot: Slot) -> bool {
        self.slots.iter().any(|(s, _)| *s == slot)
    }
}

fn slot(name: &str, kind: Kind) -> Slot {
    if let Kind::List { item, .. } = kind {
        let is_index = matches!(name, "vertex_indices" | "vertex_index") && !item.is_float();
        return if is_index { Slot::Indices } else { Slot::Skip };
    }
    match name.strip_prefix("diffuse_").unwrap_or(name) {
        "x" => Slot::Position(0),
        "y" => Slot::Position(1),
        "z" => Slot::Position(2),
        "red" => Slot::Color(0),
        "green" => Slot::Color(1),
        "blue" => Slot::Color(2),
        "u" | "s" | "texture_u" => Slot::Coordinate(0),
        "v" | "t" | "texture_v" => Slot::Coordinate(1),
        "nx" => Slot::Normal(0),
        "ny" => Slot::Normal(1),
        "nz" => Slot::Normal(2),
        _ => Slot::Skip,
    }
}

/// Whether a property of vertices is part of a texture coordinate or a normal.
pub(super) fn is_attribute(property: &Property) -> bool {
    matches!(slot(&property.name, property.kind), Slot::Coordinate(_) | Slot::Normal(_))
}

/// The type of the numbers by which an element's items name vertices, if they do.
pub(super) fn index_type(element: &Element) -> Option<Scalar> {
    element.properties.iter().find_map(|property| {
        match (slot(&property.name, property.kind), property.kind) {
            (Slot::Indices, Kind::List { item, .. }) => Some(item),
            _ => None,
        }
    })
}

/// One item's values.
#[derive(Default)]
struct Item {
    position: [f64; 3],
    color: [f64; 3],
    coordinates: [f64; 2],
    normal: [f64; 3],
    indices: Vec<f64>,
}

impl Item {
    #[inline]
    fn read(&mut self, layout: &Layout, source: &mut impl Source) -> Result<(), String> {
        for &(slot, kind) in &layout.slots {
            match (slot, kind) {
                (Slot::Position(axis), Kind::Scalar(kind)) => self.position[axis] = source.number(kind)?,
                (Slot::Color(channel), Kind::Scalar(kind)) => self.color[channel] = source.number(kind)?,
                (Slot::Coordinate(axis), Kind::Scalar(kind)) => {
                    self.coordinates[axis] = source.number(kind)?
                }
                (Slot::Normal(axis), Kind::Scalar(kind)) => self.normal[axis] = source.number(kind)?,
                (Slot::Indices, Kind::List { count, item }) => {
                    let length = source.length(count, item)?;
                    self.indices.clear();
                    for _ in 0..length {
                        self.indices.push(source.number(item)?);
                    }
                }
                (_, Kind::Scalar(kind)) => source.skip(kind, 1)?,
                (_, Kind::List { count, item }) => {
                    let length = source.length(count, item)?;
                    source.skip(item, length)?;
                }
            }
        }
        Ok(())
    }
}

/// Passes over an element that means nothing here.
pub(super) fn skip<S: Source>(
    element: &Element,
    source: &mut S,
    row: &mut dyn FnMut(u64, &S),
) -> Result<(), ItemError> {
    if element.properties.is_empty() {
        return Ok(());
    }
    let mut layout = Layout::new(element);
    layout.slots.iter_mut().for_each(|s| s.0 = Slot::Skip);
    let mut item = Item::default();
    for index in 0..element.count {
        row(index, source);
        item.read(&layout, source).map_err(|e| (index, e))?;
    }
    Ok(())
}

/// No list could be begun.
fn no_list(error: std::io::Error) -> ItemError {
    (0, no_room(error))
}

/// There is no memory for a list.
fn too_many(_: TryReserveError) -> ItemError {
    (0, "not enough memory for so many".into())
}

/// Element `vertex`.
pub(super) struct Vertices<L: Lists> {
    pub positions: L::Of<Vec3>,
    pub shades: Shades<L>,
    pub looks: Looks<L>,
}

impl<L: Lists> Vertices<L> {
    pub fn read<S: Source>(
        &mut self,
        lists: &L,
        element: &Element,
        source: &mut S,
        row: &mut dyn FnMut(u64, &S),
    ) -> Result<(), ItemError> {
        let layout = Layout::new(element);
        if !(0..3).all(|axis| layout.has(Slot::Position(axis))) {
            return Err((0, "it has no properties x, y and z".into()));
        }
        // The caller made sure that the file is large enough for so many.
        self.positions.expect(element.count as usize).map_err(too_many)?;
        if let Some(kind) = layout.color {
            self.shades.begin(lists, kind, 0)?;
        }
        let has_all = |slots: &[Slot]| slots.iter().all(|&slot| layout.has(slot));
        let with_coordinates = has_all(&[Slot::Coordinate(0), Slot::Coordinate(1)]);
        let with_normals = has_all(&[Slot::Normal(0), Slot::Normal(1), Slot::Normal(2)]);
        let mut item = Item::default();
        for index in 0..element.count {
            row(index, source);
            item.read(&layout, source).map_err(|e| (index, e))?;
            self.positions.push(Vec3::from_array(item.position.map(|x| x as f32)));
            if let Some(kind) = layout.color {
                self.shades.push(kind, item.color, 1);
            }
            if with_coordinates {
                self.looks.push_coordinates(item.coordinates);
            }
            if with_normals {
                self.looks.push_normal(item.normal);
            }
        }
        Ok(())
    }
}

/// Elements `face` and `tristrips`.
pub(super) struct Faces<L: Lists> {
    vertex_count: u32,
    pub triangles: L::Of<[u32; 3]>,
    pub shades: Shades<L>,
    pub polygons: u64,
    pub short: u64,
    pub strips: u64,
}

impl<L: Lists> Faces<L> {
    /// No faces yet, of a file of so many vertices.
    pub fn new(vertex_count: u32, triangles: L::Of<[u32; 3]>) -> Self {
        Self { vertex_count, triangles, shades: Shades::None, polygons: 0, short: 0, strips: 0 }
    }

    /// Reads polygons, or `strips`.
    pub fn read<S: Source>(
        &mut self,
        lists: &L,
        element: &Element,
        source: &mut S,
        strips: bool,
        row: &mut dyn FnMut(u64, &S),
    ) -> Result<(), ItemError> {
        let layout = Layout::new(element);
        if element.count > 0 && !layout.has(Slot::Indices) {
            return Err((0, "it has no list of integers named vertex_indices".into()));
        }
        if !strips {
            // The caller made sure that the file is large enough for so many.
            self.triangles.expect(element.count as usize).map_err(too_many)?;
        }
        if let Some(kind) = layout.color {
            self.shades.begin(lists, kind, self.triangles.len())?;
        }
        let mut item = Item::default();
        for index in 0..element.count {
            row(index, source);
            item.read(&layout, source).map_err(|e| (index, e))?;
            let before = self.triangles.len();
            if strips { self.strip(&item.indices) } else { self.polygon(&item.indices) }
                .map_err(|e| (index, e))?;
            if let Some(kind) = layout.color {
                self.shades.push(kind, item.color, self.triangles.len() - before);
            }
        }
        // Faces and strips side by side, of which only one has colours.
        if layout.color.is_none() && !matches!(self.shades, Shades::None) {
            self.shades.begin(lists, Scalar::U8, self.triangles.len())?;
        }
        Ok(())
    }

    #[inline]
    fn vertex(&self, index: f64) -> Result<u32, String> {
        if index >= 0.0 && index < f64::from(self.vertex_count) && index.fract() == 0.0 {
            Ok(index as u32)
        } else {
            Err(format!("vertex index {index} is out of range, there are {} vertices", self.vertex_count))
        }
    }

    #[inline]
    fn polygon(&mut self, indices: &[f64]) -> Result<(), String> {
        let [first, second, rest @ ..] = indices else {
            self.short += 1;
            return Ok(());
        };
        let (first, mut last) = (self.vertex(*first)?, self.vertex(*second)?);
        for &index in rest {
            let next = self.vertex(index)?;
            self.triangles.push([first, last, next]);
            last = next;
        }
        self.polygons += u64::from(rest.len() > 1);
        self.short += u64::from(rest.is_empty());
        Ok(())
    }

    /// Unrolls a list of strips with -1 between them (in an unsigned type, its bits). Every second triangle of a strip runs the
    /// other way round, so its first two corners change places.
    fn strip(&mut self, indices: &[f64]) -> Result<(), String> {
        let restart = |&i: &f64| i == -1.0 || i == f64::from(u32::MAX);
        for strip in indices.split(restart).filter(|s| !s.is_empty()) {
            self.strips += 1;
            for (k, corners) in strip.windows(3).enumerate() {
                let [a, b, c] =
                    [self.vertex(corners[0])?, self.vertex(corners[1])?, self.vertex(corners[2])?];
                self.triangles.push(if k % 2 == 0 { [a, b, c] } else { [b, a, c] });
            }
        }
        Ok(())
    }
}
