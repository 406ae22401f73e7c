//! The MTL files that an OBJ file names: found, read once, and made materials of.

use super::images::Images;
use super::material::material;
use super::mtl::{self, Definition};
use crate::mesh::{Image, Material, ReadReport};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The materials that an OBJ file has named so far.
pub(super) struct Library<'a> {
    folder: &'a Path,
    /// The files that were read.
    files: Vec<File>,
    /// Of all files, one after the other, and how many there are.
    count: usize,
    /// Places of materials by name: of the file that was named last.
    places: HashMap<String, u32>,
    missing: Vec<String>,
    bad_lines: u64,
}

/// A MTL file.
struct File {
    path: PathBuf,
    /// The place of its first material among all.
    first: usize,
    definitions: Vec<Definition>,
}

impl<'a> Library<'a> {
    /// An empty library; names of MTL files are relative to `folder`.
    pub fn beside(folder: &'a Path) -> Self {
        Self {
            folder,
            files: Vec::new(),
            count: 0,
            places: HashMap::new(),
            missing: Vec::new(),
            bad_lines: 0,
        }
    }

    /// The place of a material that a file read so far defines.
    pub fn place(&self, material: &str) -> Option<u32> {
        self.places.get(material).copied()
    }

    /// Reads what one `mtllib` line names: a file whose name may have spaces in it, or several
    /// files with spaces between them. What cannot be read is noted and defines nothing.
    pub fn load(&mut self, names: &str) {
        if self.open(names) {
            return;
        }
        for name in names.split_whitespace() {
            if !self.open(name) && !self.missing.iter().any(|missing| missing == name) {
                self.missing.push(name.to_owned());
            }
        }
    }

    /// Whether a name is that of a file.
    fn open(&mut self, name: &str) -> bool {
        let name = name.trim_matches('"');
        let slashed = name.replace('\\', "/");
        // Of a path on another computer, the file's name alone.
        let bare = slashed.rsplit('/').next().filter(|_| slashed.starts_with('/') || slashed.contains(':'));
        [Some(name), Some(&*slashed), bare]
            .into_iter()
            .flatten()
            .any(|name| self.read(self.folder.join(name)))
    }

    fn read(&mut self, path: PathBuf) -> bool {
        let place = match self.files.iter().position(|file| file.path == path) {
            Some(place) => place,
            None => {
                let Ok(bytes) = read_regular(&path) else { return false };
                let (definitions, bad_lines) = mtl::parse(&bytes);
                self.bad_lines += bad_lines;
                let first = self.count;
                self.count += definitions.len();
                self.files.push(File { path, first, definitions });
                self.files.len() - 1
            }
        };
        let File { first, definitions, .. } = &self.files[place];
        let named =
            (*first as u32..).zip(definitions).map(|(place, definition)| (definition.name.clone(), place));
        self.places.extend(named);
        true
    }

    /// All materials and the pictures that they name; says what was missing or not understood.
    pub fn finish(self, report: &mut ReadReport) -> (Vec<Material>, Vec<Image>) {
        let mut images = Images::new(self.folder);
        let mut materials = Vec::with_capacity(self.count);
        for File { path, definitions, .. } in &self.files {
            let folder = path.parent().unwrap_or(Path::new(""));
            let file = path.file_name().unwrap_or_default().to_string_lossy();
            for definition in definitions {
                let place = format!("{file}:{}", definition.line);
                materials.push(material(definition, place, &mut |name| images.place(folder, name)));
            }
        }
        report.missing_material_files.extend(self.missing);
        report.bad_material_lines += self.bad_lines;
        (materials, images.finish(report))
    }
}

/// A file's bytes. What is no regular file may have no end: a device, a pipe that nobody writes to.
fn read_regular(path: &Path) -> std::io::Result<Vec<u8>> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(std::io::Error::other("not a regular file"));
    }
    std::fs::read(path)
}
