//! Buffers, and views of them that are known to lie within.

use super::uri::{self, Target};
use crate::mesh::read;
use gltf::Document;
use memmap2::Mmap;
use std::path::Path;

/// The bytes of a document's buffers.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    of: Vec<Bytes<'a>>,
}

/// Bytes, wherever they are.
enum Bytes<'a> {
    /// In the model's file.
    Carried(&'a [u8]),
    /// In a file of their own.
    Mapped(Mmap),
    /// In a URI, decoded.
    Decoded(Vec<u8>),
}

impl<'a> Buffers<'a> {
    /// Opens the buffers of a model in `folder`; `carried` is what its GLB file has.
    ///
    /// # Errors
    /// One cannot be had, or is shorter than the document says.
    pub fn open(document: &'a Document, carried: Option<&'a [u8]>, folder: &Path) -> Result<Self, String> {
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
        let of = document.as_json().buffers.iter().enumerate().map(open).collect::<Result<_, _>>()?;
        Ok(Self { document, of })
    }

    /// The bytes of a view.
    ///
    /// # Errors
    /// They are not all in its buffer.
    pub fn view(&self, number: usize) -> Result<&[u8], String> {
        let view = &self.document.as_json().buffer_views[number];
        let says = &self.document.as_json().buffers[view.buffer.value()];
        let buffer = &self.of[view.buffer.value()].as_slice()[..says.byte_length.0 as usize];
        let start = view.byte_offset.unwrap_or_default().0;
        let within = || {
            let end = start.checked_add(view.byte_length.0)?;
            buffer.get(usize::try_from(start).ok()?..usize::try_from(end).ok()?)
        };
        within().ok_or_else(|| {
            format!("buffer view {number} does not lie within the {} bytes of its buffer", buffer.len())
        })
    }

    /// How many bytes there are in all.
    pub fn size(&self) -> u64 {
        self.of.iter().map(|bytes| bytes.as_slice().len() as u64).sum()
    }
}

impl Bytes<'_> {
    fn as_slice(&self) -> &[u8] {
        match self {
            Self::Carried(bytes) => bytes,
            Self::Mapped(bytes) => bytes,
            Self::Decoded(bytes) => bytes,
        }
    }
}
