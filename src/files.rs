//! Files that are whole or not there at all.

use crate::error::{Error, Result};
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::Path;
use tempfile::NamedTempFile;

/// Writes a file through `fill`: into a temporary file beside the target, which takes the
/// target's name when it is complete and on the disk. What `path` held before stays until then; on
/// failure nothing is left behind.
///
/// # Errors
/// [`Error::Write`].
pub fn write_whole(path: &Path, fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<()> {
    let write = || {
        let temporary = beside(path)?;
        // The file itself: tempfile would put its own path into every error.
        let mut out = BufWriter::with_capacity(1 << 18, temporary.as_file().try_clone()?);
        fill(&mut out)?;
        // Some file systems find no room only now; and a name must not outlive a power cut that its
        // bytes did not.
        out.into_inner()?.sync_data()?;
        temporary.persist(path)?;
        Ok(())
    };
    write().map_err(|source| Error::Write { path: path.into(), source })
}

/// Finds out, before any long work, whether [`write_whole`] can create `path`. Leaves no trace.
///
/// # Errors
/// [`Error::Write`] with the reason: the folder is missing or not writable, the target a folder.
pub fn check_writable(path: &Path) -> Result<()> {
    let check = || {
        if path.file_name().is_none() {
            return Err(io::Error::new(ErrorKind::InvalidInput, "this names no file"));
        }
        match fs::metadata(path) {
            Ok(target) if target.is_dir() => return Err(io::Error::from(ErrorKind::IsADirectory)),
            _ => {}
        }
        beside(path)?.close()
    };
    check().map_err(|source| Error::Write { path: path.into(), source })
}

/// A temporary file in the folder of `path`, which vanishes when dropped.
fn beside(path: &Path) -> io::Result<NamedTempFile> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".raypack-").suffix(".part");
    #[cfg(unix)]
    {
        // As any new file, within the user's mask: tempfile's default keeps others from reading.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    // tempfile puts its own path into the message; which file was asked for is in ours.
    builder.tempfile_in(folder).map_err(|error| match error.kind() {
        ErrorKind::NotFound => io::Error::new(
            ErrorKind::NotFound,
            format!("there is no folder {}; make it first", folder.display()),
        ),
        kind => kind.into(),
    })
}

/// The same as [`write_whole`] for text.
///
/// # Errors
/// [`Error::Write`].
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    write_whole(path, |out| out.write_all(text.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder");
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        write_text(&path, "old").expect("written");
        let failed = write_whole(&path, |out| {
            out.write_all(&[b'x'; 1 << 20])?;
            Err(io::Error::other("the disk is full"))
        });
        let message = failed.expect_err("it failed").to_string();
        assert_eq!(message, format!("cannot write {}: the disk is full", path.display()));
        assert_eq!(fs::read_to_string(&path).expect("readable"), "old");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn checking_leaves_no_trace() {
        let folder = tempfile::tempdir().expect("a folder");
        check_writable(&folder.path().join("a.png")).expect("writable");
        assert!(names(folder.path()).is_empty());
        check_writable(folder.path()).expect_err("it is a folder");
        let error = check_writable(&folder.path().join("no/a.png")).expect_err("there is no such folder");
        assert!(error.to_string().contains("there is no folder"), "{error}");
    }
}
