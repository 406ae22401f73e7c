//! The section table: which arrays a file holds, and where.

use super::checksum::BLOCK;
use bytemuck::{Pod, Zeroable};
use serde::Serialize;
use std::fmt;
use std::ops::Range;

/// What sections begin at multiples of: the largest page that common machines map.
pub(super) const ALIGNMENT: u64 = 65_536;

/// Bytes of a section's entry.
pub(super) const ENTRY: usize = size_of::<Entry>();

/// A section's entry in the table, little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Entry {
    /// The [`Kind`]'s number.
    pub kind: u32,
    /// Bytes of an element.
    pub element: u32,
    /// Where it begins in the file.
    pub offset: u64,
    /// Its length, padding left out.
    pub bytes: u64,
    /// Its elements.
    pub count: u64,
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident = $number:literal, $name:literal, $element:literal;)*) => {
        /// What a section holds.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
        #[serde(rename_all = "kebab-case")]
        #[non_exhaustive]
        pub enum Kind {
            $($(#[$doc])* $kind = $number,)*
        }

        impl Kind {
            /// All of them, in the order of their numbers.
            pub const ALL: &[Self] = &[$(Self::$kind,)*];

            /// Its name, as reports and `format.md` give it.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$kind => $name,)* }
            }

            /// Bytes of an element.
            pub const fn element(self) -> usize {
                match self { $(Self::$kind => $element,)* }
            }
        }
    };
}

kinds! {
    /// [`Meta`](super::Meta) as JSON.
    Meta = 1, "meta", 1;
    /// The tree's nodes: see [`Arrays::nodes`](crate::kdtree::Arrays::nodes).
    Nodes = 2, "nodes", 8;
    /// The leaves' records.
    References = 3, "references", 4;
    /// The nodes above the pages.
    Upper = 4, "upper", 8;
    /// The places of the upper nodes among the nodes.
    Beneath = 5, "beneath", 4;
    /// The pages' primitive ids.
    Pages = 6, "pages", 4;
    /// The tree in cache lines.
    Lines = 7, "lines", 64;
    /// Corners and planes by primitive id, in the tree's coordinates.
    Triangles = 8, "triangles", 48;
    /// The mesh's vertices, three `f32` each.
    Positions = 9, "positions", 12;
    /// Three vertices for each triangle, `u32` each.
    Indices = 10, "indices", 12;
    /// An sRGB colour for each triangle, three bytes each.
    TriangleColors = 11, "triangle-colors", 3;
    /// An sRGB colour for each vertex, likewise.
    VertexColors = 12, "vertex-colors", 3;
    /// The same for each corner of each triangle, which shading reads: nine bytes a triangle.
    CornerColors = 13, "corner-colors", 9;
    /// The index of each triangle's material, `u32`.
    MaterialOfTriangle = 14, "material-of-triangle", 4;
    /// The same with texture coordinates and normals, in scenes that have such.
    SurfaceRecords = 15, "surface-records", 40;
    /// The triangles whose material gives off light, `u32` each, ascending.
    Emitters = 16, "emitters", 4;
    /// The bytes of pictures' files, one behind the other.
    Images = 17, "images", 1;
    /// Nodes of eight boxes: see [`Pools::nodes`](crate::kdtree::Pools::nodes).
    PoolNodes = 18, "pool-nodes", 256;
    /// The words of pools: see [`Pools::words`](crate::kdtree::Pools::words).
    PoolWords = 19, "pool-words", 4;
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A section: an array in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Section {
    /// What it holds.
    pub kind: Kind,
    /// Where it begins in the file: at a multiple of 65,536.
    pub offset: u64,
    /// Its length. Zeros fill the rest of its last block, and of the way to the next section.
    pub bytes: u64,
    /// Its elements.
    pub count: u64,
}

impl Section {
    /// A section of so many bytes.
    pub(super) fn new(kind: Kind, offset: u64, bytes: usize) -> Self {
        debug_assert!(bytes.is_multiple_of(kind.element()));
        Self { kind, offset, bytes: bytes as u64, count: (bytes / kind.element()) as u64 }
    }

    /// Where in the file it lies.
    pub fn range(&self) -> Range<usize> {
        self.offset as usize..(self.offset + self.bytes) as usize
    }

    /// The blocks that it lies in: no other section's.
    pub fn blocks(&self) -> Range<usize> {
        let Range { start, end } = self.range();
        start / BLOCK..end.div_ceil(BLOCK)
    }

    pub(super) fn entry(&self) -> Entry {
        Entry {
            kind: self.kind as u32,
            element: self.kind.element() as u32,
            offset: self.offset,
            bytes: self.bytes,
            count: self.count,
        }
    }

    /// What an entry says, if that makes sense in a file whose sections lie in the range `free` at most.
    fn of_entry(entry: &Entry, free: &Range<u64>) -> Result<Self, String> {
        let Some(&kind) = Kind::ALL.iter().find(|&&kind| kind as u32 == entry.kind) else {
            return Err(format!("there is no kind {}", entry.kind));
        };
        if entry.element as usize != kind.element() {
            return Err(format!("{kind} has elements of {} bytes, not {}", kind.element(), entry.element));
        }
        if entry.count.checked_mul(kind.element() as u64) != Some(entry.bytes) {
            return Err(format!("{kind} cannot have {} elements in {} bytes", entry.count, entry.bytes));
        }
        if !entry.offset.is_multiple_of(ALIGNMENT) {
            return Err(format!("{kind} begins at byte {}, between two pages", entry.offset));
        }
        if entry.offset < free.start {
            return Err(format!("{kind} begins at byte {}, inside of what is before it", entry.offset));
        }
        if entry.offset.checked_add(entry.bytes).is_none_or(|end| end > free.end) {
            return Err(format!("{kind} goes beyond the last section's end"));
        }
        Ok(Self { kind, offset: entry.offset, bytes: entry.bytes, count: entry.count })
    }
}

/// The sections that a table names, in a file whose sections end at `end`.
///
/// # Errors
/// What in the table makes no sense: sections of no known kind, of a wrong size, outside of the file, in one
/// another, or twice there.
pub(super) fn sections(table: &[Entry], end: u64) -> Result<Vec<Section>, String> {
    let mut sections: Vec<Section> = Vec::with_capacity(table.len());
    let mut free = BLOCK as u64..end;
    for entry in table {
        let section = Section::of_entry(entry, &free)?;
        if sections.iter().any(|other| other.kind == section.kind) {
            return Err(format!("{} is there twice", section.kind));
        }
        free.start = section.offset + section.bytes;
        sections.push(section);
    }
    Ok(sections)
}
