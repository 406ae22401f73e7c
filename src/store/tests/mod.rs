//! Scene files: written and read back to the bit, and broken on purpose.

mod damage;
mod large;
mod pools;
mod round_trip;
mod surfaces;

use super::{File, Written};
use crate::error::Result;
use crate::kdtree::{BuildParams, KdTree};
use crate::mesh::generate::shapes;
use crate::mesh::{Colors, Material, Mesh};
use glam::Vec3;
use std::path::PathBuf;
use tempfile::TempDir;

/// A mesh of some hundred triangles, with colours of each kind.
fn meshes() -> Vec<Mesh> {
    let mesh = shapes::soup(300, 1);
    let srgb = |i: usize| [i as u8, (i * 7) as u8, (i / 3) as u8];
    let material = |name: &str, diffuse| Material::matt(name, diffuse);
    let colors = [
        Colors::Uniform(Vec3::new(0.1, 0.7, 1.0 / 3.0)),
        Colors::PerTriangle((0..mesh.triangles.len()).map(srgb).collect()),
        Colors::PerVertex((0..mesh.positions.len()).map(srgb).collect()),
        Colors::PerMaterial {
            materials: vec![material("red \"brick\"\n", Vec3::X), material("", Vec3::new(0.3, 1e-7, 0.9))],
            of_triangle: (0..mesh.triangles.len() as u32).map(|i| i % 2).collect(),
        },
    ];
    colors.into_iter().map(|colors| Mesh { colors, ..mesh.clone() }).collect()
}

fn build(mesh: &Mesh) -> KdTree {
    KdTree::build(mesh, &BuildParams::default(), None).expect("builds")
}

/// A scene file in a folder of its own.
struct Place {
    folder: TempDir,
    path: PathBuf,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("scene.rpk");
        Self { folder, path }
    }

    /// With a scene in it.
    fn with(mesh: &Mesh) -> Self {
        let place = Self::new();
        place.write(mesh, &build(mesh)).expect("written");
        place
    }

    fn write(&self, mesh: &Mesh, tree: &KdTree) -> Result<Written> {
        super::write(&self.path, mesh, tree, "a soup", &|_| ())
    }

    fn open(&self) -> Result<File> {
        File::open(&self.path)
    }

    fn bytes(&self) -> Vec<u8> {
        std::fs::read(&self.path).expect("there")
    }

    fn set(&self, bytes: &[u8]) {
        std::fs::write(&self.path, bytes).expect("written");
    }

    fn files(&self) -> usize {
        std::fs::read_dir(self.folder.path()).expect("a folder").count()
    }
}
