//! Finding the library and loading it once.

use super::abi::{Api, SYSTEM_NAMES};
use crate::error::{Error, Result};
use libloading::Library;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Names the library's file or its folder.
const VARIABLE: &str = "RAYPACK_EMBREE";
/// Where `scripts/get-embree` puts it, below the repository's root.
const FOLDER: &str = ".embree";

/// A loaded library.
pub struct Loaded {
    /// Its functions.
    pub api: Api,
    /// The file, or the name that the system's loader resolved.
    pub path: PathBuf,
}

/// The library, loaded on the first call.
///
/// Looked for in `RAYPACK_EMBREE` (a file or a folder; nothing else is tried when it is set), in
/// `.embree` in the current folder and in every folder above the executable, then by the system's loader.
/// It is never unloaded: the threads of its task scheduler may outlive every device.
///
/// # Errors
/// [`Error::Missing`] when it is nowhere; [`Error::Option`] when `RAYPACK_EMBREE` names no such library.
pub fn load() -> Result<&'static Loaded> {
    static LOADED: OnceLock<Loaded> = OnceLock::new();
    if let Some(loaded) = LOADED.get() {
        return Ok(loaded);
    }
    let loaded = find()?;
    Ok(LOADED.get_or_init(|| loaded))
}

fn find() -> Result<Loaded> {
    if let Some(value) = std::env::var_os(VARIABLE) {
        let given = PathBuf::from(value);
        let file = if given.is_dir() { in_folder(&given) } else { given.is_file().then_some(given.clone()) };
        let file = file.ok_or_else(|| {
            Error::option(VARIABLE, format!("no libembree4 at {}; name its file or folder", given.display()))
        })?;
        return open(&file)
            .map_err(|e| Error::option(VARIABLE, format!("cannot load {}: {e}", file.display())));
    }
    let files = folders().into_iter().filter_map(|folder| in_folder(&folder));
    let mut broken = None;
    for candidate in files.chain(SYSTEM_NAMES.iter().map(PathBuf::from)) {
        match open(&candidate) {
            Ok(loaded) => return Ok(loaded),
            // A file that is there and does not load is worth telling; a name that resolves to nothing is not.
            Err(e) if candidate.is_file() => broken = Some((candidate, e)),
            Err(_) => {}
        }
    }
    Err(match broken {
        Some((file, e)) => Error::Missing {
            what: "a usable Embree 4".into(),
            remedy: format!("{} does not load ({e}); run scripts/get-embree", file.display()),
        },
        None => Error::Missing {
            what: "Embree".into(),
            remedy: format!("run scripts/get-embree, or set {VARIABLE} to a libembree4"),
        },
    })
}

/// Folders that `scripts/get-embree` may have filled.
fn folders() -> Vec<PathBuf> {
    let mut folders = vec![PathBuf::from(FOLDER)];
    if let Ok(executable) = std::env::current_exe() {
        folders.extend(executable.ancestors().skip(1).map(|above| above.join(FOLDER)));
    }
    folders
}

/// The library's file in a folder, as an absolute path so that the loader searches nowhere else.
fn in_folder(folder: &Path) -> Option<PathBuf> {
    let is_library = |name: &OsStr| {
        let name = name.to_string_lossy();
        let stem = name.strip_prefix("lib").unwrap_or(&name);
        stem.starts_with("embree4") && [".so", ".dylib", ".dll"].iter().any(|ending| name.contains(ending))
    };
    let entries = std::fs::read_dir(folder).ok()?;
    let mut files: Vec<PathBuf> =
        entries.filter_map(|e| e.ok().filter(|e| is_library(&e.file_name())).map(|e| e.path())).collect();
    files.sort();
    files.first()?.canonicalize().ok()
}

fn open(path: &Path) -> Result<Loaded, libloading::Error> {
    // SAFETY: loading runs the library's initialisers. The file was named by the user, fetched by
    // scripts/get-embree or is the system's; Embree's initialisers have no preconditions.
    let library = unsafe { Library::new(path) }?;
    // SAFETY: a library that has all of Embree's functions by name is taken to be one; the major version
    // is checked before anything but rtcNewDevice is used. It is leaked below and so stays loaded.
    let api = unsafe { Api::resolve(&library) }?;
    std::mem::forget(library);
    Ok(Loaded { api, path: path.to_path_buf() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_yields_the_library_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(in_folder(folder.path()), None);
        std::fs::write(folder.path().join("libtbb.so.12"), "").unwrap();
        std::fs::write(folder.path().join("embree4.txt"), "").unwrap();
        assert_eq!(in_folder(folder.path()), None);
        let library = folder.path().join("libembree4.so.4");
        std::fs::write(&library, "").unwrap();
        assert_eq!(in_folder(folder.path()), library.canonicalize().ok());
        assert_eq!(in_folder(&folder.path().join("nowhere")), None);
    }

    #[test]
    fn a_file_that_is_no_library_is_an_error() {
        let file = tempfile::NamedTempFile::new().unwrap();
        assert!(open(file.path()).is_err());
    }
}
