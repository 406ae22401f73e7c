//! The first block: what the file is, and where its tables are.

use super::checksum::{BLOCK, of_table};
use super::section::{ENTRY, Entry};
use bytemuck::{Pod, Zeroable};

/// The format's version. A reader takes its own and no other.
pub const VERSION: u32 = 3;

/// What every scene file begins with. A transfer that takes it for text does not leave it as it is: the first
/// byte is above 127, and both kinds of line end and the old end-of-file mark follow.
pub(super) const MAGIC: [u8; 8] = *b"\x89RPK\r\n\x1a\n";

/// Reads as this on a machine of the file's byte order, little-endian.
const ENDIANNESS: u32 = 0x0102_0304;

/// Where the section table begins: behind the header, in the same block.
pub(super) const TABLE: usize = size_of::<Header>();

/// The most sections that the first block has room for.
pub(super) const MAX_SECTIONS: usize = (BLOCK - TABLE) / ENTRY;

/// The file's first 128 bytes, little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Header {
    magic: [u8; 8],
    endianness: u32,
    version: u32,
    /// Bytes of the whole file.
    pub length: u64,
    table_offset: u64,
    /// Sections in the section table.
    pub table_count: u32,
    table_entry: u32,
    /// Where the checksum table begins: behind the last section, at a block.
    pub checksums_offset: u64,
    /// Blocks in front of the checksum table; each has an entry of four bytes in it.
    pub checksums_count: u64,
    /// XXH3 of the checksum table.
    pub checksums_hash: u64,
    block: u32,
    reserved: [u32; 13],
    /// XXH3 of the first block, these eight bytes taken for zeros.
    hash: u64,
}

impl Header {
    /// The header of a file whose checksum table lies at `checksums_offset`.
    pub fn new(sections: usize, checksums_offset: u64, checksums: &[u32]) -> Self {
        debug_assert!(sections <= MAX_SECTIONS);
        let table: &[u8] = bytemuck::cast_slice(checksums);
        Self {
            magic: MAGIC,
            endianness: ENDIANNESS,
            version: VERSION,
            length: checksums_offset + table.len() as u64,
            table_offset: TABLE as u64,
            table_count: sections as u32,
            table_entry: ENTRY as u32,
            checksums_offset,
            checksums_count: checksums.len() as u64,
            checksums_hash: of_table(table),
            block: BLOCK as u32,
            reserved: [0; 13],
            hash: 0,
        }
    }

    /// The first block: this header, sealed, and the section table.
    pub fn block(mut self, sections: &[Entry]) -> [u8; BLOCK] {
        let mut block = [0; BLOCK];
        let table: &[u8] = bytemuck::cast_slice(sections);
        block[TABLE..TABLE + table.len()].copy_from_slice(table);
        self.hash = 0;
        block[..TABLE].copy_from_slice(bytemuck::bytes_of(&self));
        self.hash = of_table(&block);
        block[..TABLE].copy_from_slice(bytemuck::bytes_of(&self));
        block
    }

    /// The header of a file, whose every byte is given, and its section table. Both are as they were written;
    /// what the section table says is still to be looked at.
    ///
    /// # Errors
    /// What the file is instead of a scene file of this version, in words that follow its name.
    pub fn read(file: &[u8]) -> Result<(Self, Vec<Entry>), String> {
        is_scene(file)?;
        let mut block = *file.first_chunk::<BLOCK>().ok_or_else(|| {
            format!("it is cut short: {} bytes, where its first block alone has {BLOCK}", file.len())
        })?;
        let header: Self = bytemuck::pod_read_unaligned(&block[..TABLE]);
        if header.endianness == ENDIANNESS.swap_bytes() {
            return Err("it was written in the other byte order (big-endian); build it again here".into());
        }
        let version = header.version;
        if header.endianness == ENDIANNESS && version > VERSION {
            return Err(format!(
                "it has version {version} of the format, and this raypack reads version {VERSION}: use a newer \
                 raypack, or build it again with this one"
            ));
        }
        if header.endianness == ENDIANNESS && (1..VERSION).contains(&version) {
            return Err(format!(
                "it has version {version} of the format, of an older raypack, and this one reads version \
                 {VERSION}: build it again"
            ));
        }
        block[TABLE - size_of::<u64>()..TABLE].fill(0);
        if of_table(&block) != header.hash {
            return Err("its first block is damaged: the checksum is another; build it again".into());
        }
        header.check(file.len() as u64)?;
        let table = &block[TABLE..][..header.table_count as usize * ENTRY];
        Ok((header, bytemuck::pod_collect_to_vec(table)))
    }

    /// Whether a header that is as it was written fits a file of so many bytes.
    fn check(&self, length: u64) -> Result<(), String> {
        if length < self.length {
            return Err(format!(
                "it is cut short: {length} of {} bytes are there; copy it or build it again",
                self.length
            ));
        }
        if length > self.length {
            let more = length - self.length;
            return Err(format!("{more} bytes follow its end; copy it or build it again"));
        }
        let as_written = Self {
            endianness: ENDIANNESS,
            version: VERSION,
            table_offset: TABLE as u64,
            table_entry: ENTRY as u32,
            block: BLOCK as u32,
            reserved: [0; 13],
            ..*self
        };
        let blocks = self.checksums_offset / BLOCK as u64;
        let end =
            self.checksums_count.checked_mul(4).and_then(|bytes| bytes.checked_add(self.checksums_offset));
        if *self != as_written
            || self.table_count as usize > MAX_SECTIONS
            || !self.checksums_offset.is_multiple_of(BLOCK as u64)
            || blocks == 0
            || self.checksums_count != blocks
            || end != Some(length)
        {
            return Err("its header makes no sense; build it again".into());
        }
        Ok(())
    }
}

/// Whether bytes begin as a scene file does.
fn is_scene(file: &[u8]) -> Result<(), String> {
    let start = &file[..file.len().min(MAGIC.len())];
    if start.is_empty() {
        return Err("it is empty; build it again".into());
    }
    if start == &MAGIC[..start.len()] {
        return Ok(());
    }
    let name = |at: usize| file.get(at..at + 3) == Some(b"RPK".as_slice());
    if name(1) || name(2) || name(0) {
        return Err("its first bytes are damaged, as by a transfer as text; copy it again, as binary".into());
    }
    Err("it is no raypack scene file; build one with raypack build".into())
}
