//! A scene file, mapped.

use super::checksum::{BLOCK, first_damaged, of_table};
use super::header::Header;
use super::meta::{ColorMeta, Meta};
use super::section::{Kind, Section, sections};
use crate::column::Column;
use crate::error::{Error, Result};
use crate::mapped::Map;
use bytemuck::AnyBitPattern;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::slice;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// An open scene file. Its arrays are mapped: they are read when they are used.
#[derive(Debug)]
pub struct File {
    path: PathBuf,
    /// What is mapped, for who reads it piece by piece.
    handle: Arc<std::fs::File>,
    map: Arc<Map>,
    sections: Vec<Section>,
    checksums: Column<u32>,
    meta: Meta,
    /// A bit for each kind of section whose checksums were right.
    whole: AtomicU32,
}

impl File {
    /// Opens a scene file, and checks all that it says about itself: that it is one, of this version and byte
    /// order, whole; its tables, and its meta section. Its arrays are checked by who hands them out.
    ///
    /// The file must not be changed while it is open; to replace it, as [`write`](super::write()) does, is no
    /// change. Where it has been cut short, or its disk fails, reading what is mapped of it ends the process by a signal
    /// (SIGBUS): a program that would rather say something installs a handler and asks
    /// [`mapped`](crate::mapped) which file it was, as the command line does. The library installs none. What a
    /// [`Cached`](crate::cache::Cached) scene reads when it is needed is read explicitly, and errors are errors.
    ///
    /// # Errors
    /// The file cannot be read, or it says what it is instead.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let (handle, map) = Map::open(path).map_err(|source| Error::Read { path: path.into(), source })?;
        Self::of_map(path, handle, Arc::new(map)).map_err(|message| Error::malformed(path, message))
    }

    fn of_map(path: &Path, handle: std::fs::File, map: Arc<Map>) -> Result<Self, String> {
        let (header, table) = Header::read(&map)?;
        let (end, length) = (header.checksums_offset, header.length as usize);
        let checksums = Column::<u32>::mapped(Arc::clone(&map), end as usize..length)
            .ok_or("its checksum table lies between two words; build it again")?;
        if of_table(bytemuck::cast_slice(&checksums)) != header.checksums_hash {
            return Err("its checksum table is damaged; build it again".into());
        }
        let sections =
            sections(&table, end).map_err(|what| format!("its section table makes no sense: {what}"))?;
        let meta = meta(&map, &checksums, &sections)?;
        let (path, handle) = (path.into(), Arc::new(handle));
        let file = Self { path, handle, map, sections, checksums, meta, whole: AtomicU32::new(0) };
        file.check_counts().map_err(|what| format!("its sections do not belong together: {what}"))?;
        Ok(file)
    }

    /// Where it was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The open file.
    pub(super) fn handle(&self) -> Arc<std::fs::File> {
        Arc::clone(&self.handle)
    }

    /// Its length in bytes.
    pub fn bytes(&self) -> u64 {
        self.map.len() as u64
    }

    /// What it says about the scene.
    pub fn meta(&self) -> &Meta {
        &self.meta
    }

    /// Its sections, in the order in which they lie in it.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// The section of a kind, if it has one. Which ones it has follows from its [`Meta`].
    pub fn section(&self, kind: Kind) -> Option<&Section> {
        self.sections.iter().find(|section| section.kind == kind)
    }

    /// The checksum of each block of [`BLOCK`] bytes from the file's beginning on, its own table left out: the
    /// lower half of the block's XXH3. The first block's checksum stands in itself; here is 0 for it.
    pub fn checksums(&self) -> &Column<u32> {
        &self.checksums
    }

    /// Checks every block. `progress` is told now and then what part (0 to 1) is behind.
    ///
    /// # Errors
    /// The first block that is damaged.
    pub fn verify(&self, progress: &(dyn Fn(f64) + Sync)) -> Result<()> {
        // The first block was checked when it was opened.
        let all = 1..self.checksums.len();
        self.verify_blocks(slice::from_ref(&all), progress)
    }

    /// Checks the blocks of some sections, unless that was done. Those that are not there are whole.
    pub(super) fn verify_sections(&self, kinds: &[Kind]) -> Result<()> {
        let whole = self.whole.load(Ordering::Relaxed);
        let unknown = kinds.iter().filter(|&&kind| whole >> kind as u32 & 1 == 0);
        let blocks: Vec<_> = unknown.filter_map(|&kind| self.section(kind)).map(Section::blocks).collect();
        self.verify_blocks(&blocks, &|_| ())?;
        // It says nothing about other memory: who reads it late checks once more.
        self.whole.fetch_or(kinds.iter().fold(0, |bits, &kind| bits | 1 << kind as u32), Ordering::Relaxed);
        Ok(())
    }

    /// Checks a section's first block.
    pub(super) fn verify_first_block(&self, kind: Kind) -> Result<()> {
        let blocks = self.section(kind).map_or(0..0, Section::blocks);
        let first = blocks.start..blocks.end.min(blocks.start + 1);
        self.verify_blocks(&[first], &|_| ())
    }

    fn verify_blocks(&self, blocks: &[Range<usize>], progress: &(dyn Fn(f64) + Sync)) -> Result<()> {
        match first_damaged(&self.map, &self.checksums, blocks, progress) {
            None => Ok(()),
            Some(block) => Err(self.damaged(block)),
        }
    }

    /// What to say about a damaged block.
    pub(super) fn damaged(&self, block: usize) -> Error {
        Error::malformed(&self.path, damaged(&self.sections, block))
    }

    /// A section's elements, not checked; none if there is no such section. Panics if an element has another
    /// size than the section says.
    pub(super) fn column<T: AnyBitPattern>(&self, kind: Kind) -> Column<T> {
        let Some(section) = self.section(kind) else { return Column::default() };
        assert_eq!(size_of::<T>(), kind.element(), "{kind}");
        Column::mapped(Arc::clone(&self.map), section.range()).expect("sections lie aligned in the file")
    }

    /// Whether the sections are those that the meta section calls for, with as many elements.
    fn check_counts(&self) -> Result<(), String> {
        let Meta { triangles, vertices, .. } = self.meta;
        let is = |called_for: bool, count| if called_for { count } else { 0 };
        let per_vertex = matches!(self.meta.colors, ColorMeta::PerVertex);
        let per_material = matches!(self.meta.colors, ColorMeta::PerMaterial { .. });
        let attributes = self.meta.attributes;
        let expected = [
            (Kind::Triangles, triangles),
            (Kind::Positions, vertices),
            (Kind::Indices, triangles),
            (Kind::TriangleColors, is(matches!(self.meta.colors, ColorMeta::PerTriangle), triangles)),
            (Kind::VertexColors, is(per_vertex, vertices)),
            (Kind::CornerColors, is(per_vertex, triangles)),
            (Kind::MaterialOfTriangle, is(per_material && !attributes, triangles)),
            (Kind::SurfaceRecords, is(attributes, triangles)),
            (Kind::Emitters, self.meta.emitters()),
            (Kind::Images, self.meta.image_bytes()),
            (Kind::PoolNodes, self.meta.pools.map_or(0, |pools| pools.nodes)),
            (Kind::PoolWords, self.meta.pools.map_or(0, |pools| pools.words)),
        ];
        for (kind, expected) in expected {
            let count = self.section(kind).map_or(0, |section| section.count);
            if count != expected {
                return Err(format!("{count} elements of {kind}, {expected} expected"));
            }
        }
        Ok(())
    }
}

/// Finds, checks and reads the meta section.
fn meta(file: &[u8], checksums: &[u32], sections: &[Section]) -> Result<Meta, String> {
    let Some(section) = sections.iter().find(|section| section.kind == Kind::Meta) else {
        return Err("its section table makes no sense: there is no meta section".into());
    };
    if let Some(block) = first_damaged(file, checksums, &[section.blocks()], &|_| ()) {
        return Err(damaged(sections, block));
    }
    Meta::parse(&file[section.range()]).map_err(|what| format!("its meta section makes no sense: {what}"))
}

/// What to say about a damaged block.
fn damaged(sections: &[Section], block: usize) -> String {
    let place = match sections.iter().find(|section| section.blocks().contains(&block)) {
        Some(section) => format!("its section {} is damaged", section.kind),
        None => "it is damaged between two sections".into(),
    };
    let (first, last) = (block * BLOCK, (block + 1) * BLOCK - 1);
    format!("{place}: the checksum of bytes {first} to {last} is another; build it again")
}
