//! The MTL files that an OBJ file names: found, cleaned, and parsed by tobj.

use super::feed::{parse_f32, split_keyword};
use crate::mesh::ReadReport;
use crate::mesh::material::{self, Material};
use glam::Vec3;
use std::cell::{Cell, RefCell};
use std::collections::HashSet;
use std::path::Path;

/// What is known of materials while an OBJ file is read.
pub(super) struct Library<'a> {
    folder: &'a Path,
    defined: RefCell<HashSet<String>>,
    missing: RefCell<Vec<String>>,
    bad_lines: Cell<u64>,
}

impl<'a> Library<'a> {
    /// An empty library; names of MTL files are relative to `folder`.
    pub fn beside(folder: &'a Path) -> Self {
        Self { folder, defined: RefCell::default(), missing: RefCell::default(), bad_lines: Cell::new(0) }
    }

    /// Whether a file read so far defines the material.
    pub fn defines(&self, material: &str) -> bool {
        self.defined.borrow().contains(material)
    }

    /// Adds what was missing or not understood.
    pub fn report(self, report: &mut ReadReport) {
        report.missing_material_files.extend(self.missing.into_inner());
        report.bad_material_lines += self.bad_lines.get();
    }

    /// Reads what one `mtllib` line names: a file whose name may have spaces in it, or several
    /// files with spaces between them. What cannot be read is noted and defines nothing.
    pub fn load(&self, names: &Path) -> tobj::MTLLoadResult {
        let names = names.to_string_lossy();
        let mut clean = Vec::new();
        if let Ok(bytes) = self.open(&names) {
            self.clean(&bytes, &mut clean);
        } else {
            for name in names.split_whitespace() {
                match self.open(name) {
                    Ok(bytes) => self.clean(&bytes, &mut clean),
                    Err(_) => self.missing.borrow_mut().push(name.to_owned()),
                }
            }
        }
        tobj::load_mtl_buf(&mut clean.as_slice())
    }

    fn open(&self, name: &str) -> std::io::Result<Vec<u8>> {
        let name = name.trim_matches('"');
        read_regular(&self.folder.join(name))
            .or_else(|_| read_regular(&self.folder.join(name.replace('\\', "/"))))
    }

    /// Keeps names and diffuse colours, in forms on which tobj cannot stumble.
    fn clean(&self, bytes: &[u8], clean: &mut Vec<u8>) {
        for line in bytes.split(|&b| b == b'\n' || b == b'\r') {
            let (keyword, rest) = split_keyword(line.trim_ascii());
            match keyword {
                b"newmtl" if !rest.is_empty() => {
                    let name = String::from_utf8_lossy(rest).into_owned();
                    clean.extend_from_slice(format!("newmtl {name}\n").as_bytes());
                    self.defined.borrow_mut().insert(name);
                }
                b"Kd" => match diffuse(rest) {
                    Some([r, g, b]) => clean.extend_from_slice(format!("Kd {r} {g} {b}\n").as_bytes()),
                    None => self.bad_lines.set(self.bad_lines.get() + 1),
                },
                b"newmtl" => self.bad_lines.set(self.bad_lines.get() + 1),
                _ => {}
            }
        }
    }
}

/// A file's bytes. What is no regular file may have no end: a device, a pipe that nobody writes to.
fn read_regular(path: &Path) -> std::io::Result<Vec<u8>> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(std::io::Error::other("not a regular file"));
    }
    std::fs::read(path)
}

/// `Kd r g b`, or `Kd r` for a grey. Spectral curves and CIE XYZ are not understood.
fn diffuse(rest: &[u8]) -> Option<[f32; 3]> {
    let numbers: Option<Vec<f32>> = rest
        .split(u8::is_ascii_whitespace)
        .filter(|w| !w.is_empty())
        .map(|w| parse_f32(w).filter(|x| x.is_finite()))
        .collect();
    match *numbers?.as_slice() {
        [grey] => Some([grey; 3]),
        [r, g, b, ..] => Some([r, g, b]),
        _ => None,
    }
}

/// tobj's material as ours, clamped to what a surface can reflect.
pub(super) fn material(material: tobj::Material) -> Material {
    let diffuse = material.diffuse.map_or(material::DEFAULT_DIFFUSE, Vec3::from_array);
    Material::matt(material.name, diffuse.clamp(Vec3::ZERO, Vec3::ONE))
}
