//! Buffers, and views of them that are known to lie within.

use super::uri::{self, Target};
use super::view::View;
use crate::mapped::Map;
use crate::mesh::read;
use crate::mesh::spooled::{in_small_pages, let_go};
use gltf::Document;
use memmap2::Mmap;
use std::cell::Cell;
use std::path::Path;

/// Looks elsewhere, each of which brings 64 KiB of a file into memory or two times that, until all are let go of.
const LOOKS: usize = 128;

/// The bytes of a document's buffers.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    of: Vec<Bytes<'a>>,
    /// Lets go of what is in memory of the model's own file, if what is not needed any more has to go.
    let_go: Option<&'a dyn Fn()>,
    /// Looks elsewhere since then.
    looks: Cell<usize>,
}

/// Bytes, wherever they are.
enum Bytes<'a> {
    /// In the model's file.
    Carried(&'a [u8]),
    /// In a file of their own.
    Mapped(Map),
    /// In a URI, decoded.
    Decoded(Vec<u8>),
}

impl<'a> Buffers<'a> {
    /// Opens the buffers of a model in `folder`; `carried` is what its GLB file has. With `own`, which lets go of what
    /// is in memory of the model's file, not much of any file stays there.
    ///
    /// # Errors
    /// One cannot be had, or is shorter than the document says.
    pub fn open(
        document: &'a Document,
        carried: Option<&'a [u8]>,
        folder: &Path,
        own: Option<&'a dyn Fn()>,
    ) -> Result<Self, String> {
        let open = |(number, buffer): (usize, &gltf::json::Buffer)| {
            let bytes = match &buffer.uri {
                None if number == 0 && carried.is_some() => Bytes::Carried(carried.unwrap_or_default()),
                None => {
                    return Err(format!(
                        "buffer {number} has no data: neither a URI nor a GLB file's own buffer"
                    ));
                }
                Some(uri) => {
                    let failed = |why: &str| format!("buffer {number}: {} {why}", uri::shown(uri));
                    match uri::follow(uri, folder).map_err(failed)? {
                        Target::Bytes(bytes) => Bytes::Decoded(bytes),
                        Target::File(path) => Bytes::Mapped(
                            read::map(&path).map_err(|e| failed(&format!("cannot be read: {e}")))?,
                        ),
                    }
                }
            };
            let (has, says) = (bytes.as_slice().len() as u64, buffer.byte_length.0);
            if has < says {
                return Err(format!(
                    "buffer {number} should have {says} bytes and has {has}: it is cut short"
                ));
            }
            Ok(bytes)
        };
        let of: Vec<_> = document.as_json().buffers.iter().enumerate().map(open).collect::<Result<_, _>>()?;
        if own.is_some() {
            of.iter().filter_map(Bytes::mapped).for_each(in_small_pages);
        }
        Ok(Self { document, of, let_go: own, looks: Cell::new(0) })
    }

    /// The bytes of a view.
    ///
    /// # Errors
    /// They are not all in its buffer.
    pub fn view(&'a self, number: usize) -> Result<View<'a>, String> {
        let view = &self.document.as_json().buffer_views[number];
        let says = &self.document.as_json().buffers[view.buffer.value()];
        let buffer = &self.of[view.buffer.value()].as_slice()[..says.byte_length.0 as usize];
        let start = view.byte_offset.unwrap_or_default().0;
        let within = || {
            let end = start.checked_add(view.byte_length.0)?;
            buffer.get(usize::try_from(start).ok()?..usize::try_from(end).ok()?)
        };
        within().map(|bytes| View::new(bytes, self)).ok_or_else(|| {
            format!("buffer view {number} does not lie within the {} bytes of its buffer", buffer.len())
        })
    }

    /// Says that a view is looked at elsewhere than before.
    #[inline]
    pub fn looked_elsewhere(&self) {
        if self.let_go.is_some() {
            self.looks.set(self.looks.get() + 1);
            if self.looks.get() == LOOKS {
                self.let_go();
            }
        }
    }

    /// Lets go of all that is in memory of files, if that is called for.
    #[cold]
    pub fn let_go(&self) {
        let Some(own) = self.let_go else { return };
        self.looks.set(0);
        own();
        self.of.iter().filter_map(Bytes::mapped).for_each(|map| let_go(map, 0..map.len()));
    }

    /// How many bytes there are in all.
    pub fn size(&self) -> u64 {
        self.of.iter().map(|bytes| bytes.as_slice().len() as u64).sum()
    }
}

impl Bytes<'_> {
    /// The map of a file of their own.
    fn mapped(&self) -> Option<&Mmap> {
        match self {
            Self::Mapped(map) => Some(map),
            Self::Carried(_) | Self::Decoded(_) => None,
        }
    }

    fn as_slice(&self) -> &[u8] {
        match self {
            Self::Carried(bytes) => bytes,
            Self::Mapped(bytes) => bytes,
            Self::Decoded(bytes) => bytes,
        }
    }
}
