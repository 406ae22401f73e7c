//! Blocks from a scene file.

use super::at_once;
use super::layout::Array;
use super::plan::CacheOptions;
use super::source::Source;
use super::{Cached, Resident};
use crate::error::{Error, Result};
use crate::files::read_at;
use crate::store::{self, Kind, block_checksum};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// A scene file's sections, read piece by piece.
///
/// The file is read, not mapped: what is read is counted, and an error is an error, not a signal. It stays open,
/// so that one which takes its name meanwhile does no harm.
#[derive(Debug)]
pub struct FileSource {
    path: PathBuf,
    file: fs::File,
    /// Where each array begins in the file; nowhere, if it has none of that.
    offsets: [Option<u64>; Array::ALL.len()],
    checksums: Vec<u32>,
    /// Whether reads go past the system's memory of the file.
    direct: bool,
}

/// The section that an array is.
fn section(file: &store::File, array: Array) -> Option<&store::Section> {
    let kinds: &[Kind] = match array {
        Array::Nodes => &[Kind::Nodes],
        Array::References => &[Kind::References],
        Array::Pages => &[Kind::Pages],
        Array::Triangles => &[Kind::Triangles],
        Array::Colors => &[Kind::TriangleColors, Kind::CornerColors, Kind::MaterialOfTriangle],
        Array::Surfaces => &[Kind::SurfaceRecords],
    };
    kinds.iter().find_map(|&kind| file.section(kind))
}

impl FileSource {
    /// Opens the file that `scene` was opened from once more, to be read.
    fn new(scene: &store::File, direct: bool) -> Result<Self> {
        let path = scene.path().to_path_buf();
        let file = open(&path, direct).map_err(|source| Error::Read { path: path.clone(), source })?;
        let checksums = scene.checksums().to_vec();
        let offsets = Array::ALL.map(|array| section(scene, array).map(|section| section.offset));
        Ok(Self { path, file, offsets, checksums, direct })
    }

    /// Memory that it takes.
    fn bytes(scene: &store::File) -> usize {
        size_of_val(&scene.checksums()[..])
    }
}

impl Source for FileSource {
    fn read(&self, array: Array, byte: usize, into: &mut [u8]) -> Result<()> {
        let offset = self.offset(array, byte);
        read_at(&self.file, into, offset).map_err(|source| {
            let source = if source.kind() == io::ErrorKind::UnexpectedEof {
                io::Error::new(source.kind(), "it has become shorter since it was opened; build it again")
            } else {
                source
            };
            Error::Read { path: self.path.clone(), source }
        })?;
        self.check(array, offset, into)
    }

    fn read_at_once(&self, array: Array, byte: usize, into: &mut [u8]) -> Result<bool> {
        let offset = self.offset(array, byte);
        // Whatever goes wrong here goes wrong once more where it is told.
        Ok(!self.direct && at_once::read_at(&self.file, into, offset) && {
            self.check(array, offset, into)?;
            true
        })
    }
}

impl FileSource {
    fn offset(&self, array: Array, byte: usize) -> u64 {
        self.offsets[array as usize].expect("blocks are those of sections") + byte as u64
    }

    /// Checks what was read at an offset of the file.
    fn check(&self, array: Array, offset: u64, into: &[u8]) -> Result<()> {
        let first = offset as usize / store::BLOCK;
        let pieces = into.chunks(store::BLOCK).zip(&self.checksums[first..]);
        for (number, (piece, &checksum)) in (first..).zip(pieces) {
            if block_checksum(piece) != checksum {
                let message = format!(
                    "its {} are damaged at byte {}, or the file has changed since it was opened; build it again",
                    array.name(),
                    number * store::BLOCK
                );
                return Err(Error::malformed(&self.path, message));
            }
        }
        Ok(())
    }
}

/// Opens a file, with `direct` so that what is read is not kept in the system's memory and comes from the disk
/// each time.
fn open(path: &Path, direct: bool) -> io::Result<fs::File> {
    let mut options = fs::OpenOptions::new();
    options.read(true);
    #[cfg(target_os = "linux")]
    if direct {
        use std::os::unix::fs::OpenOptionsExt;
        // Pieces and sections are aligned as that demands.
        options.custom_flags(libc::O_DIRECT);
    }
    #[cfg(not(target_os = "linux"))]
    if direct {
        return Err(io::Error::new(
            io::ErrorKind::Unsupported,
            "it can be read past the system's memory on Linux only",
        ));
    }
    options.open(path)
}

impl Cached {
    /// Bytes of what comes in blocks from a file: what has a share of the memory.
    pub fn data_bytes_of(file: &store::File) -> usize {
        Array::ALL
            .iter()
            .filter_map(|&array| section(file, array))
            .map(|section| section.bytes as usize)
            .sum()
    }

    /// The scene in a file, of which as much is in memory as `memory` bytes hold, everything counted that
    /// the scene takes, its materials and the list of what gives off light included, and `beside` for what else is
    /// to be held in them. For `threads` at work.
    ///
    /// # Errors
    /// The file's upper tree is damaged, or as [`Cached::new`].
    pub fn open(
        file: &store::File,
        options: &CacheOptions,
        memory: usize,
        beside: usize,
        threads: usize,
    ) -> Result<Self> {
        let meta = file.meta();
        let (upper, beneath, root) = file.upper_tree()?;
        let resident = Resident {
            scale: meta.scale(),
            bounds: meta.tree_bounds(),
            root,
            // Copies, not the mapped file: they are counted, and the file can go.
            upper: upper.to_vec(),
            beneath: beneath.to_vec(),
            bytes: Array::ALL.map(|array| section(file, array).map_or(0, |section| section.bytes as usize)),
            spread: meta.spread,
        };
        let beside = beside + FileSource::bytes(file) + file.surface_bytes();
        let source = Box::new(FileSource::new(file, options.direct)?);
        Self::new(resident, source, options, memory, beside, threads)
    }
}
