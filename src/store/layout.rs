//! Where a writer puts everything.

use super::checksum::{BLOCK, of_block, of_blocks};
use super::header::Header;
use super::section::{ALIGNMENT, Kind, Section};

/// A file that is known to the byte, before any of it is written.
pub(super) struct Layout<'a> {
    /// The first block: header and section table.
    pub first: [u8; BLOCK],
    /// The sections and their bytes, in the order in which they lie in the file.
    pub sections: Vec<(Section, &'a [u8])>,
    /// Where the checksum table begins. It is the end of the file.
    pub table: u64,
    /// The checksum table.
    pub checksums: Vec<u32>,
}

impl<'a> Layout<'a> {
    /// Lays arrays out one after the other.
    pub fn new(arrays: &[(Kind, &'a [u8])]) -> Self {
        // The first block's place in the table is empty: its checksum stands in itself.
        let mut checksums = vec![0];
        let mut sections = Vec::with_capacity(arrays.len());
        for &(kind, bytes) in arrays {
            pad(&mut checksums);
            let offset = (checksums.len() * BLOCK) as u64;
            checksums.extend(of_blocks(bytes));
            sections.push((Section::new(kind, offset, bytes.len()), bytes));
        }
        let table = (checksums.len() * BLOCK) as u64;
        let entries: Vec<_> = sections.iter().map(|(section, _)| section.entry()).collect();
        let first = Header::new(entries.len(), table, &checksums).block(&entries);
        Self { first, sections, table, checksums }
    }

    /// The whole file's length.
    pub fn bytes(&self) -> u64 {
        self.table + size_of_val(&self.checksums[..]) as u64
    }
}

/// Adds blocks of zeros up to where a section may begin.
fn pad(checksums: &mut Vec<u32>) {
    let blocks = checksums.len().next_multiple_of(ALIGNMENT as usize / BLOCK);
    checksums.resize(blocks, of_block(&[0; BLOCK]));
}
