//! Pictures into a scene file and out of it: the bytes of their files, as they are.

use super::checksum::{BLOCK, of_block};
use super::meta::ImageMeta;
use super::out::Out;
use super::reader::File;
use super::section::Kind;
use crate::error::Result;
use crate::files::read_at;
use crate::mesh::{Image, ImageSource, MAX_IMAGE_BYTES, Packed};
use crate::stage::Stage;
use std::fs;
use std::io::{self, Seek, Write};
use std::ops::Range;
use std::sync::Arc;

/// Reads pictures, one at a time, and writes them as the section `images`. One that cannot be read is missing from
/// now on.
///
/// # Errors
/// The file cannot be written.
pub(super) fn write<W: Write + Seek>(out: &mut Out<'_, W>, images: &[Image]) -> io::Result<Vec<ImageMeta>> {
    Stage::Pictures.begin();
    let mut entries = Vec::with_capacity(images.len());
    let mut end = 0;
    for Image { name, source } in images {
        let name = name.clone();
        entries.push(match source.read() {
            Ok(file) if file.len() as u64 <= MAX_IMAGE_BYTES => {
                if end == 0 && !file.is_empty() {
                    out.begin(Kind::Images)?;
                }
                out.put(&file)?;
                let (offset, bytes) = (end, file.len() as u64);
                end += bytes;
                ImageMeta::Stored { name, offset, bytes }
            }
            Ok(_) => {
                ImageMeta::Missing { name, reason: "has more than 1 GiB, too much for a picture".into() }
            }
            Err(reason) => ImageMeta::Missing { name, reason },
        });
    }
    if end > 0 {
        out.end()?;
    }
    Ok(entries)
}

/// About how many bytes pictures will take in a file.
pub(super) fn about(images: &[Image]) -> usize {
    let length = |image: &Image| match &image.source {
        ImageSource::File(path) => fs::metadata(path).map_or(0, |about| about.len().min(MAX_IMAGE_BYTES)),
        ImageSource::Bytes(bytes) => bytes.len() as u64,
        ImageSource::Packed(packed) => packed.bytes(),
        ImageSource::Missing(_) => 0,
    };
    images.iter().map(length).sum::<u64>() as usize
}

/// A picture in an open scene file.
#[derive(Debug)]
struct Place {
    file: Arc<fs::File>,
    /// Where its bytes lie in the file.
    bytes: Range<u64>,
    /// The checksums of the blocks that they lie in.
    checksums: Box<[u32]>,
}

impl Place {
    fn blocks(bytes: &Range<u64>) -> Range<usize> {
        bytes.start as usize / BLOCK..(bytes.end as usize).div_ceil(BLOCK)
    }
}

impl Packed for Place {
    fn bytes(&self) -> u64 {
        self.bytes.end - self.bytes.start
    }

    /// By explicit reads: what a scene that is not all in memory takes is counted, and an error is an error.
    fn read(&self) -> io::Result<Vec<u8>> {
        let blocks = Self::blocks(&self.bytes);
        let first = blocks.start * BLOCK;
        let mut read = vec![0; blocks.len() * BLOCK];
        read_at(&self.file, &mut read, first as u64)?;
        for (number, (block, &checksum)) in read.chunks_exact(BLOCK).zip(&self.checksums).enumerate() {
            if of_block(block) != checksum {
                let at = first + number * BLOCK;
                let message = format!("the scene file is damaged at byte {at}; build it again");
                return Err(io::Error::new(io::ErrorKind::InvalidData, message));
            }
        }
        read.truncate(self.bytes.end as usize - first);
        read.drain(..self.bytes.start as usize - first);
        Ok(read)
    }
}

impl File {
    /// The pictures that materials name. They stay in the file until they are [read](ImageSource::read), which
    /// looks at their checksums.
    pub fn images(&self) -> Vec<Image> {
        let section = self.section(Kind::Images).map_or(0, |section| section.offset);
        let image = |image: &ImageMeta| {
            let source = match image {
                ImageMeta::Missing { reason, .. } => ImageSource::Missing(reason.clone()),
                ImageMeta::Stored { offset, bytes, .. } => {
                    let bytes = section + offset..section + offset + bytes;
                    let checksums = self.checksums()[Place::blocks(&bytes)].into();
                    ImageSource::Packed(Arc::new(Place { file: self.handle(), bytes, checksums }))
                }
            };
            Image { name: image.name().into(), source }
        };
        self.meta().images.iter().map(image).collect()
    }

    /// Copies of the pictures.
    ///
    /// # Errors
    /// The section is damaged.
    pub(super) fn copied_images(&self) -> Result<Vec<Image>> {
        self.verify_sections(&[Kind::Images])?;
        let all = self.column::<u8>(Kind::Images);
        let image = |image: &ImageMeta| {
            let source = match image {
                ImageMeta::Missing { reason, .. } => ImageSource::Missing(reason.clone()),
                ImageMeta::Stored { offset, bytes, .. } => {
                    ImageSource::Bytes(all[*offset as usize..][..*bytes as usize].into())
                }
            };
            Image { name: image.name().into(), source }
        };
        Ok(self.meta().images.iter().map(image).collect())
    }

    /// Bytes of memory that [`images`](Self::images) takes up.
    pub(super) fn images_bytes(&self) -> usize {
        let image = |image: &ImageMeta| {
            let more = match image {
                ImageMeta::Missing { reason, .. } => reason.len(),
                ImageMeta::Stored { bytes, .. } => {
                    size_of::<Place>() + (*bytes as usize / BLOCK + 2) * size_of::<u32>()
                }
            };
            size_of::<Image>() + image.name().len() + more
        };
        self.meta().images.iter().map(image).sum()
    }
}
