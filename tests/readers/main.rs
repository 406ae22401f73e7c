//! OBJ and PLY as scanners and CAD programs write them, and as they break; that the others are found by their ending.

mod endings;
mod materials;
mod obj;
mod ply;

use raypack::mesh::{self, Loaded, ReadReport, spooled};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A folder with files in it.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn put(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, content).unwrap();
        path
    }
}

/// Reads a file, to memory and to files, and sees to it that they hold the same.
#[track_caller]
fn read(name: &str, content: impl AsRef<[u8]>) -> Loaded {
    let folder = Folder::new();
    let path = folder.put(name, content);
    let loaded = mesh::read(&path).unwrap_or_else(|e| panic!("{e}"));
    same_in_files(&path, &loaded);
    let announced = spooled::announced(&path).expect("it can be read");
    assert!(announced.vertices >= loaded.report.vertices, "{announced:?}");
    // A polygon counts as one.
    assert!(announced.triangles >= loaded.report.triangles || loaded.report.polygons > 0, "{announced:?}");
    assert!(announced.attributes || loaded.mesh.attributes.is_empty(), "{announced:?}");
    loaded
}

/// Reads a file to files, and sees to it that they hold the same.
#[track_caller]
fn same_in_files(path: &Path, loaded: &Loaded) {
    let folder = path.parent().expect("it lies in a folder");
    let (spooled, report) = spooled::read(path, folder, &|_| ()).expect("it can be read");
    // Triangles without area are counted when a tree is built.
    let zero_area_triangles = loaded.report.zero_area_triangles;
    assert_eq!(ReadReport { zero_area_triangles, ..report }, loaded.report);
    assert_eq!(spooled.bounds, loaded.mesh.bounds());
    assert_eq!(spooled.to_mesh().expect("readable"), loaded.mesh);
}

/// The error's message, the same for who reads to files, which is one line and names the file.
#[track_caller]
fn refusal(name: &str, content: impl AsRef<[u8]>) -> String {
    let folder = Folder::new();
    let path = folder.put(name, content);
    let message = mesh::read(&path).expect_err("this should not load").to_string();
    let spooled = spooled::read(&path, folder.0.path(), &|_| ()).expect_err("nor should this");
    assert_eq!(spooled.to_string(), message);
    assert_eq!(message.lines().count(), 1, "more than one line: {message}");
    assert!(!message.contains(char::is_control), "control characters: {message:?}");
    assert!(message.contains(path.to_str().unwrap()), "does not name the file: {message}");
    message
}

#[track_caller]
fn assert_says(message: &str, words: &[&str]) {
    for word in words {
        assert!(message.contains(word), "\"{message}\" does not say \"{word}\"");
    }
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// A square of one quad.
const SQUARE_PLY: &str = "ply\nformat ascii 1.0\ncomment a square\nobj_info none\nelement vertex 4\n\
    property float x\nproperty float y\nproperty float z\nelement face 1\n\
    property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

mod dispatch {
    use super::*;

    #[test]
    fn the_ending_decides_whatever_its_case() {
        assert_eq!(read("a.OBJ", format!("{SQUARE}f 1 2 3\n")).report.triangles, 1);
        assert_eq!(read("a.Ply", SQUARE_PLY).report.triangles, 2);
    }

    #[test]
    fn other_endings_are_refused_with_what_is_accepted() {
        assert_says(
            &refusal("a.fbx", "solid"),
            &["unknown kind of file", ".fbx", ".obj", ".ply", ".stl", ".gltf", ".glb"],
        );
        assert_says(&refusal("model", ""), &["unknown kind of file", ".obj", ".ply"]);
    }

    #[test]
    fn what_is_not_there_cannot_be_read() {
        let folder = Folder::new();
        let missing = mesh::read(folder.0.path().join("no.obj")).unwrap_err().to_string();
        assert_says(&missing, &["cannot read", "no.obj"]);
        fs::create_dir(folder.0.path().join("dir.ply")).unwrap();
        let directory = mesh::read(folder.0.path().join("dir.ply")).unwrap_err().to_string();
        assert_says(&directory, &["cannot read", "dir.ply"]);
    }

    #[test]
    fn progress_never_goes_back_and_ends_at_one() {
        let folder = Folder::new();
        let path = folder.put("a.obj", format!("{}f 1 2 3\n", SQUARE.repeat(100_000)));
        let seen = std::cell::RefCell::new(vec![0.0]);
        mesh::read_with_progress(path, &|part| seen.borrow_mut().push(part)).unwrap();
        let seen = seen.into_inner();
        assert!(seen.len() > 4 && seen.is_sorted(), "{seen:?}");
        assert_eq!(seen.last(), Some(&1.0));
    }
}
