//! Pictures that materials name, and where their bytes are.

use crate::spool::Spooled;
use std::borrow::Cow;
use std::fmt;
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A picture that materials name. It is opened when something that is drawn calls for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// What messages call it.
    pub name: String,
    /// Where it is.
    pub source: ImageSource,
}

impl Image {
    /// Bytes of memory that it takes up while it is not opened.
    pub(super) fn bytes(&self) -> usize {
        let source = match &self.source {
            ImageSource::File(path) => path.as_os_str().len(),
            ImageSource::Bytes(bytes) => bytes.len(),
            ImageSource::Packed(_) => 0,
            ImageSource::Missing(why) => why.len(),
        };
        self.name.len() + source + size_of::<Self>()
    }
}

/// Where a picture is.
#[derive(Clone, Debug)]
pub enum ImageSource {
    /// In a file of its own.
    File(PathBuf),
    /// In a model's file: the bytes of a picture file.
    Bytes(Arc<[u8]>),
    /// The same in a file that is open, where they stay until they are read.
    Packed(Arc<dyn Packed>),
    /// Nowhere: this is what is wrong. One plain colour takes its place.
    Missing(String),
}

/// A picture file inside of another file.
pub trait Packed: fmt::Debug + Send + Sync {
    /// How many bytes it has.
    fn bytes(&self) -> u64;
    /// Reads all of them.
    ///
    /// # Errors
    /// They cannot be read, or are damaged.
    fn read(&self) -> io::Result<Vec<u8>>;
}

impl Packed for Spooled<u8> {
    fn bytes(&self) -> u64 {
        self.len() as u64
    }

    fn read(&self) -> io::Result<Vec<u8>> {
        self.to_vec()
    }
}

/// The most bytes that a picture's file may have.
pub const MAX_IMAGE_BYTES: u64 = 1 << 30;

impl ImageSource {
    /// The bytes of the picture file, wherever it is.
    ///
    /// # Errors
    /// What is wrong with it, in one line that follows the picture's name.
    pub fn read(&self) -> Result<Cow<'_, [u8]>, String> {
        let cannot = |error: io::Error| format!("cannot be read: {error}");
        match self {
            Self::File(path) => read_file(path).map(Cow::Owned).map_err(cannot),
            Self::Bytes(bytes) => Ok(Cow::Borrowed(bytes)),
            Self::Packed(packed) => packed.read().map(Cow::Owned).map_err(cannot),
            Self::Missing(why) => Err(why.clone()),
        }
    }
}

/// Reads a picture's file, unless it is one without an end.
fn read_file(path: &Path) -> io::Result<Vec<u8>> {
    let other = |message: &str| Err(io::Error::other(message));
    // Before it is opened: a pipe would be waited for.
    let about = fs::metadata(path)?;
    if !about.is_file() {
        return other("it is no file");
    }
    let mut bytes = Vec::new();
    // It may grow meanwhile.
    let has_more = about.len() > MAX_IMAGE_BYTES || {
        fs::File::open(path)?.take(MAX_IMAGE_BYTES + 1).read_to_end(&mut bytes)?;
        bytes.len() as u64 > MAX_IMAGE_BYTES
    };
    if has_more { other("it has more than 1 GiB, too much for a picture") } else { Ok(bytes) }
}

impl PartialEq for ImageSource {
    /// Pictures in open files are the same if they are the same place in the same open file.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::File(one), Self::File(other)) => one == other,
            (Self::Bytes(one), Self::Bytes(other)) => one == other,
            (Self::Packed(one), Self::Packed(other)) => Arc::ptr_eq(one, other),
            (Self::Missing(one), Self::Missing(other)) => one == other,
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_read_wherever_they_are() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        fs::write(&path, "a picture").expect("written");
        let read = |source: &ImageSource| source.read().map(Cow::into_owned);
        assert_eq!(read(&ImageSource::File(path.clone())), Ok(b"a picture".to_vec()));
        assert_eq!(read(&ImageSource::Bytes((*b"bytes").into())), Ok(b"bytes".to_vec()));
        assert_eq!(read(&ImageSource::Missing("is lost".into())), Err("is lost".into()));
        let refused = |path: &Path| read(&ImageSource::File(path.into())).expect_err("no picture");
        assert_eq!(refused(folder.path()), "cannot be read: it is no file");
        assert!(refused(&path.join("b.png")).starts_with("cannot be read: "));
        fs::File::create(&path).expect("made").set_len(MAX_IMAGE_BYTES + 1).expect("sparse");
        assert!(refused(&path).contains("too much for a picture"));
    }
}
