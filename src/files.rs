//! Files that are whole or not there at all.

use crate::error::{Error, Result};
use crate::stage::Stage;
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::mem;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::NamedTempFile;

/// The temporary files that are being written.
static DRAFTS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Writes a file through `fill`: into a temporary file beside the target, which takes the
/// target's name when it is complete and on the disk; then the name goes there, too. What `path` held before stays until
/// it is renamed; on failure before that nothing is left behind.
///
/// # Errors
/// [`Error::Write`].
pub fn write_whole(path: &Path, fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<()> {
    let cannot = |source| Error::Write { path: path.into(), source };
    write_or(path, |out| fill(out).map_err(cannot))
}

/// The same where `fill` fails of its own: with an error that is passed on, and nothing is written.
///
/// # Errors
/// [`Error::Write`], or what `fill` fails with.
pub fn write_or<T>(path: &Path, fill: impl FnOnce(&mut BufWriter<File>) -> Result<T>) -> Result<T> {
    let cannot = |source| Error::Write { path: path.into(), source };
    let folder = Folder::open(folder_of(path)).map_err(cannot)?;
    let (temporary, _listed) = beside(path).map_err(cannot)?;
    // The file itself: tempfile would put its own path into every error.
    let file = temporary.as_file().try_clone().map_err(cannot)?;
    let mut out = BufWriter::with_capacity(1 << 18, file);
    let result = fill(&mut out)?;
    // Some file systems find no room only now; and a name must not outlive a power cut that its
    // bytes did not.
    let file = out.into_inner().map_err(|error| cannot(error.into_error()))?;
    Stage::Syncing.begin();
    file.sync_data().map_err(cannot)?;
    Stage::Renaming.begin();
    temporary.persist(path).map_err(|error| cannot(error.error))?;
    Stage::Named.begin();
    folder.sync().map_err(cannot)?;
    Ok(result)
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
        let (temporary, _listed) = beside(path)?;
        Folder::open(folder_of(path))?;
        temporary.close()
    };
    check().map_err(|source| Error::Write { path: path.into(), source })
}

/// Removes the temporary files that are being written, for a process that ends at once, before they are complete. Who wants
/// to begin another one, or is done with one, waits for that end.
pub fn abandon() {
    let mut drafts = drafts();
    // One that has its target's name by now is not found, and is complete.
    drafts.drain(..).for_each(|draft| drop(fs::remove_file(draft)));
    mem::forget(drafts);
}

fn drafts() -> MutexGuard<'static, Vec<PathBuf>> {
    DRAFTS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A temporary file's place in the list.
struct Listed(PathBuf);

impl Listed {
    /// Makes a temporary file that is in the list as long as there is one.
    fn make(make: impl FnOnce() -> io::Result<NamedTempFile>) -> io::Result<(NamedTempFile, Self)> {
        let mut drafts = drafts();
        let draft = make()?;
        let path = draft.path().to_path_buf();
        drafts.push(path.clone());
        Ok((draft, Self(path)))
    }
}

impl Drop for Listed {
    fn drop(&mut self) {
        drafts().retain(|draft| *draft != self.0);
    }
}

/// The folder that a file is in, or is to be in.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A folder in which names change.
struct Folder {
    #[cfg(unix)]
    open: File,
}

impl Folder {
    /// Opens it.
    ///
    /// # Errors
    /// It is not there, or may not be read.
    fn open(path: &Path) -> io::Result<Self> {
        #[cfg(unix)]
        let folder = File::open(path).map(|open| Self { open }).map_err(|error| no_folder(path, &error));
        #[cfg(not(unix))]
        let folder = fs::metadata(path).map(|_| Self {}).map_err(|error| no_folder(path, &error));
        folder
    }

    /// Has its names on the disk, so that a file that was renamed has its new name after a power cut. On Unix; other
    /// systems see to that themselves, or cannot.
    fn sync(&self) -> io::Result<()> {
        #[cfg(unix)]
        match self.open.sync_all() {
            // Some file systems, of other machines for instance, know no such thing for folders.
            Err(error) if matches!(error.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported) => {}
            synced => return synced,
        }
        Ok(())
    }
}

/// An error about a folder that a file is to be in. Paths in messages are those that were asked for.
fn no_folder(folder: &Path, error: &io::Error) -> io::Error {
    match error.kind() {
        ErrorKind::NotFound => io::Error::new(
            ErrorKind::NotFound,
            format!("there is no folder {}; make it first", folder.display()),
        ),
        kind => kind.into(),
    }
}

/// A temporary file in the folder of `path`, which vanishes when dropped, or with all that are [abandoned](abandon).
fn beside(path: &Path) -> io::Result<(NamedTempFile, Listed)> {
    let folder = folder_of(path);
    let mut builder = tempfile::Builder::new();
    builder.prefix(".raypack-").suffix(".part");
    #[cfg(unix)]
    {
        // As any new file, within the user's mask: tempfile's default keeps others from reading.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    // tempfile puts its own path into the message; which file was asked for is in ours.
    Listed::make(|| builder.tempfile_in(folder)).map_err(|error| no_folder(folder, &error))
}

/// Fills `into` with a file's bytes from an offset on. The file's own position means nothing, and on Windows
/// moves.
///
/// # Errors
/// The file cannot be read, or ends before.
#[cfg(unix)]
pub fn read_at(file: &File, into: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, into, offset)
}

/// Fills `into` with a file's bytes from an offset on. The file's own position means nothing, and moves.
///
/// # Errors
/// The file cannot be read, or ends before.
#[cfg(windows)]
pub fn read_at(file: &File, mut into: &mut [u8], mut offset: u64) -> io::Result<()> {
    use std::os::windows::fs::FileExt;
    while !into.is_empty() {
        match file.seek_read(into, offset)? {
            0 => return Err(ErrorKind::UnexpectedEof.into()),
            read => (into, offset) = (&mut into[read..], offset + read as u64),
        }
    }
    Ok(())
}

/// Writes bytes to a file from an offset on; otherwise as [`read_at`].
///
/// # Errors
/// The file cannot be written.
#[cfg(unix)]
pub fn write_at(file: &File, bytes: &[u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::write_all_at(file, bytes, offset)
}

/// Writes bytes to a file from an offset on; otherwise as [`read_at`].
///
/// # Errors
/// The file cannot be written.
#[cfg(windows)]
pub fn write_at(file: &File, mut bytes: &[u8], mut offset: u64) -> io::Result<()> {
    use std::os::windows::fs::FileExt;
    while !bytes.is_empty() {
        match file.seek_write(bytes, offset)? {
            0 => return Err(ErrorKind::WriteZero.into()),
            written => (bytes, offset) = (&bytes[written..], offset + written as u64),
        }
    }
    Ok(())
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

    #[test]
    fn folders_are_synced() {
        let folder = tempfile::tempdir().expect("a folder");
        Folder::open(folder.path()).and_then(|folder| folder.sync()).expect("synced");
        let error = Folder::open(&folder.path().join("no")).map(drop).expect_err("there is no such folder");
        assert!(error.to_string().contains("there is no folder"), "{error}");
        // A folder that cannot be synced because it is none: its error is handed on.
        #[cfg(target_os = "linux")]
        {
            let error = Folder::open(Path::new("/dev/null/no")).map(drop).expect_err("it is no folder");
            assert_eq!(error.kind(), ErrorKind::NotADirectory);
        }
    }
}
