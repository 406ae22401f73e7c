//! Scene files: written and read back to the bit, and broken on purpose.

mod damage;
mod large;
mod round_trip;

use super::{File, Written};
use crate::error::Result;
use crate::kdtree::{BuildParams, KdTree};
use crate::mesh::generate::shapes;
use crate::mesh::{Attributes, Channel, Colors, Image, ImageSource, Map, Maps, Material, Mesh, Normal};
use glam::Vec3;
use std::path::{Path, PathBuf};
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

/// The same with all else that a mesh can have: textured materials that give off light, and what is not matt.
fn rich_meshes(folder: &Path) -> Vec<Mesh> {
    meshes().into_iter().map(|mesh| enriched(mesh, folder)).collect()
}

/// A mesh with attributes, and with pictures of each kind; if it has materials, with ones that do everything.
fn enriched(mut mesh: Mesh, folder: &Path) -> Mesh {
    let count = mesh.triangles.len();
    let number = |i: usize, k: usize| ((i * k) % 997) as f32 / 31.0 - 7.0;
    let normal = |i, k| Normal::encode(Vec3::new(number(i, k), number(i, k + 1), number(i, k + 2)));
    mesh.attributes = (0..count)
        .map(|i| match i % 7 {
            0 => Attributes::NONE,
            _ => Attributes {
                uv: [1, 2, 3].map(|k| [number(i, k), number(i, 5 * k)]),
                normals: [7, 11, 13].map(|k| normal(i, k)),
            },
        })
        .collect();
    let file = folder.join("wood.png");
    std::fs::write(&file, (0..10_000u32).map(|i| (i * i >> 3) as u8).collect::<Vec<_>>()).expect("written");
    let image = |name: &str, source| Image { name: name.into(), source };
    mesh.images = vec![
        image("wood.png", ImageSource::File(file)),
        image("scene.glb, image 0", ImageSource::Bytes(vec![7; 5000].into())),
        image("empty.png", ImageSource::Bytes(Vec::new().into())),
        image("lost.png", ImageSource::Missing("is not there".into())),
        image("last \"one\".jpg", ImageSource::Bytes(vec![1, 2, 3].into())),
    ];
    if let Colors::PerMaterial { materials, of_triangle } = &mut mesh.colors {
        materials.extend([lamp(), glass(), Material::matt("unused", Vec3::ONE)]);
        of_triangle.iter_mut().enumerate().for_each(|(i, material)| *material = (i % 11 % 4) as u32);
    }
    mesh
}

fn lamp() -> Material {
    let map =
        |image, channel| Some(Map { scale: [2.0, 0.1], offset: [-0.3, 1e-7], ..Map::whole(image, channel) });
    Material {
        place: "lamp.mtl:3".into(),
        emission: Vec3::new(12.5, 1.0 / 3.0, 1e-9),
        unlit: true,
        cutoff: Some(0.5),
        maps: Maps { emission: map(0, Channel::Color), opacity: map(4, Channel::Alpha), ..Maps::default() },
        ..Material::matt("lamp", Vec3::ZERO)
    }
}

fn glass() -> Material {
    let map = |image, channel| Some(Map { clamp: true, strength: 0.7, ..Map::whole(image, channel) });
    Material {
        specular: Vec3::splat(0.04),
        roughness: 0.125,
        reflects: true,
        fresnel: true,
        transmission: Vec3::new(0.9, 1.0, 0.95),
        ior: 1.52,
        absorption: Vec3::new(0.1, 0.0, 3e5),
        opacity: 0.75,
        maps: Maps {
            diffuse: map(1, Channel::Color),
            specular: map(3, Channel::Data),
            roughness: map(0, Channel::Green),
            normal: map(1, Channel::Data),
            bump: map(2, Channel::Grey),
            ..Maps::default()
        },
        ..Material::matt("glass", Vec3::splat(0.01))
    }
}

/// What is read of a mesh that was written: pictures are where the scene file is.
fn as_read(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    for image in &mut mesh.images {
        image.source = match image.source.read() {
            Ok(bytes) => ImageSource::Bytes(bytes.into_owned().into()),
            Err(why) => ImageSource::Missing(why),
        };
    }
    mesh
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
