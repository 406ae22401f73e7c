//! A file on its way: section after section, then the checksum table, and the first block last.

use super::checksum::{BLOCK, of_block, of_blocks};
use super::header::Header;
use super::section::{ALIGNMENT, Kind, Section};
use super::writer::Written;
use crate::stage::Stage;
use std::io::{self, Seek, SeekFrom, Write};

/// Bytes between two reports of progress.
const STEP: usize = 4 << 20;

/// Takes a scene file's sections in the order in which they are to lie in it.
pub(super) struct Out<'a, W> {
    file: W,
    /// Bytes so far; what is written behind the first block is written once.
    at: u64,
    /// Of all blocks that are whole. The first block's place is empty: its checksum stands in itself.
    checksums: Vec<u32>,
    /// The beginning of a block.
    begun: Vec<u8>,
    sections: Vec<Section>,
    /// Told now and then how many bytes are written.
    progress: &'a dyn Fn(u64),
}

impl<'a, W: Write + Seek> Out<'a, W> {
    /// Begins a file.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn new(mut file: W, progress: &'a dyn Fn(u64)) -> io::Result<Self> {
        file.write_all(&[0; BLOCK])?;
        let (checksums, begun, sections) = (vec![0], Vec::with_capacity(BLOCK), Vec::new());
        Ok(Self { file, at: BLOCK as u64, checksums, begun, sections, progress })
    }

    /// Writes a whole section. Each kind may come once.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn section(&mut self, kind: Kind, bytes: &[u8]) -> io::Result<Section> {
        self.begin(kind)?;
        self.put(bytes)?;
        self.end()
    }

    /// Begins a section.
    ///
    /// # Errors
    /// As [`section`](Self::section).
    pub fn begin(&mut self, kind: Kind) -> io::Result<()> {
        debug_assert!(self.begun.is_empty() && self.sections.iter().all(|section| section.kind != kind));
        let offset = self.at.next_multiple_of(ALIGNMENT);
        let blocks = (offset - self.at) as usize / BLOCK;
        for _ in 0..blocks {
            self.file.write_all(&[0; BLOCK])?;
        }
        self.checksums.resize(self.checksums.len() + blocks, of_block(&[0; BLOCK]));
        self.at = offset;
        self.sections.push(Section { kind, offset, bytes: 0, count: 0 });
        Ok(())
    }

    /// Adds to the section that was begun.
    ///
    /// # Errors
    /// As [`section`](Self::section).
    pub fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        for piece in bytes.chunks(STEP) {
            self.file.write_all(piece)?;
            self.sum(piece);
            self.at += piece.len() as u64;
            (self.progress)(self.at);
        }
        Ok(())
    }

    /// Takes bytes into the checksums.
    fn sum(&mut self, mut bytes: &[u8]) {
        if !self.begun.is_empty() {
            let (first, rest) = bytes.split_at(bytes.len().min(BLOCK - self.begun.len()));
            self.begun.extend_from_slice(first);
            bytes = rest;
            if self.begun.len() < BLOCK {
                return;
            }
            self.checksums.push(of_block(&self.begun));
            self.begun.clear();
        }
        let (whole, rest) = bytes.split_at(bytes.len() / BLOCK * BLOCK);
        self.checksums.extend(of_blocks(whole));
        self.begun.extend_from_slice(rest);
    }

    /// Ends the section that was begun, in all its length.
    ///
    /// # Errors
    /// As [`section`](Self::section).
    pub fn end(&mut self) -> io::Result<Section> {
        let section = self.sections.last_mut().expect("one was begun");
        *section = Section::new(section.kind, section.offset, (self.at - section.offset) as usize);
        let section = *section;
        if !self.begun.is_empty() {
            self.file.write_all(&[0; BLOCK][self.begun.len()..])?;
            self.begun.resize(BLOCK, 0);
            self.checksums.push(of_block(&self.begun));
            self.begun.clear();
            self.at = self.at.next_multiple_of(BLOCK as u64);
        }
        Ok(section)
    }

    /// What writes it, with all that was written behind the first block.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn flushed(&mut self) -> io::Result<&W> {
        self.file.flush()?;
        Ok(&self.file)
    }

    /// Goes on where writing ended, wherever the file was read in between.
    ///
    /// # Errors
    /// The file cannot be positioned.
    pub fn resume(&mut self) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(self.at)).map(drop)
    }

    /// Writes what stands before the sections and behind them.
    ///
    /// # Errors
    /// As [`section`](Self::section).
    pub fn finish(mut self) -> io::Result<Written> {
        Stage::Closing.begin();
        let table = self.at;
        debug_assert_eq!(self.checksums.len() as u64 * BLOCK as u64, table);
        self.file.write_all(bytemuck::cast_slice(&self.checksums))?;
        let entries: Vec<_> = self.sections.iter().map(Section::entry).collect();
        let first = Header::new(entries.len(), table, &self.checksums).block(&entries);
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(&first)?;
        self.file.flush()?;
        let bytes = table + size_of_val(&self.checksums[..]) as u64;
        (self.progress)(bytes);
        Ok(Written { bytes, sections: self.sections, missing_images: Vec::new() })
    }
}

/// The length of a file with sections of so many bytes, tables and all.
pub(super) fn length(sections: impl Iterator<Item = usize>) -> u64 {
    let block = BLOCK as u64;
    let end = |at: u64, bytes| at.next_multiple_of(ALIGNMENT) + (bytes as u64).next_multiple_of(block);
    let table = sections.fold(block, end);
    table + table / block * size_of::<u32>() as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;

    #[test]
    fn pieces_make_the_file_that_whole_sections_make() {
        let bytes: Vec<u8> = (0..200_000_u32).map(|i| (i.wrapping_mul(i) >> 5) as u8).collect();
        let write = |pieces: usize| {
            let (mut file, told) = (io::Cursor::new(Vec::new()), RefCell::new(Vec::new()));
            let tell = |written| told.borrow_mut().push(written);
            let mut out = Out::new(&mut file, &tell).expect("room");
            for (kind, bytes) in [(Kind::Meta, &bytes[..]), (Kind::Nodes, &bytes[..80]), (Kind::Lines, &[])] {
                out.begin(kind).expect("room");
                bytes.chunks(pieces).for_each(|piece| out.put(piece).expect("room"));
                let section = out.end().expect("room");
                assert_eq!((section.bytes, section.kind), (bytes.len() as u64, kind));
            }
            let written = out.finish().expect("room");
            assert_eq!(written.bytes, length([200_000, 80, 0].into_iter()));
            assert!(told.borrow().is_sorted() && told.borrow().last() == Some(&written.bytes));
            file.into_inner()
        };
        let whole = write(usize::MAX);
        assert_eq!(whole.len() as u64, length([200_000, 80, 0].into_iter()));
        for pieces in [1, 7, BLOCK - 1, BLOCK, 100_000] {
            assert!(write(pieces) == whole, "{pieces}");
        }
    }
}
