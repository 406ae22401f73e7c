//! Scenes that are built from files are those that are built in memory.

use super::super::large::{self, Progress};
use super::super::{Kind, Meta};
use super::surfaces::*;
use super::*;
use crate::kdtree::Tree;
use crate::mesh::Maps;
use crate::mesh::spooled::SpooledMesh;
use std::collections::BTreeMap;

/// A file's sections but for `meta`.
fn sections(file: &File, bytes: &[u8]) -> BTreeMap<String, Vec<u8>> {
    let arrays = file.sections().iter().filter(|section| section.kind != Kind::Meta);
    arrays.map(|section| (section.kind.to_string(), bytes[section.range()].to_vec())).collect()
}

/// Builds a scene file of a mesh in files, within as little memory as does.
fn build_large(place: &Place, mesh: &Mesh) -> Result<large::Built> {
    let params = BuildParams::default();
    let spooled = SpooledMesh::of_mesh(mesh, place.folder.path()).expect("room");
    let memory = large::least_bytes(&params, mesh.triangles.len());
    let progress = Progress::default();
    let built = large::build(&place.path, &spooled, &params, memory, "a soup", &progress)?;
    assert!((0.9..1.1).contains(&progress.fraction()), "{}", progress.fraction());
    Ok(built)
}

#[test]
fn sections_are_the_same_to_the_byte() {
    let scaled = |by: f32| {
        let mut mesh = meshes().remove(1);
        mesh.positions.iter_mut().for_each(|position| *position *= by);
        mesh
    };
    let large = shapes::soup(150_000, 3);
    // Materials with lamps among them, with pictures, texture coordinates and normals, and without.
    let folder = tempfile::tempdir().expect("a folder");
    let rich = enriched(meshes().remove(3), folder.path());
    let mut lit = Mesh { attributes: Vec::new(), images: Vec::new(), ..rich.clone() };
    if let Colors::PerMaterial { materials, .. } = &mut lit.colors {
        materials.iter_mut().for_each(|material| material.maps = Maps::default());
    }
    assert!(!lit.colors.emitters().is_empty());
    for mesh in meshes().into_iter().chain([scaled(1e37), scaled(1e-33), large, lit, rich]) {
        let tree = build(&mesh);
        let (whole, parts) = (Place::new(), Place::new());
        whole.write(&mesh, &tree).expect("written");
        let built = build_large(&parts, &mesh).expect("builds");
        assert_eq!(built.parts > 1, mesh.triangles.len() > 100_000);
        assert_eq!((parts.files(), built.stats), (1, tree.stats()));

        let [one, other] = [&whole, &parts].map(|place| place.open().expect("opens"));
        other.verify(&|_| ()).expect("is whole");
        assert_eq!(built.written.bytes, other.bytes());
        let (one_sections, other_sections) =
            (sections(&one, &whole.bytes()), sections(&other, &parts.bytes()));
        assert_eq!(one_sections.keys().collect::<Vec<_>>(), other_sections.keys().collect::<Vec<_>>());
        for (kind, bytes) in &one_sections {
            assert!(*bytes == other_sections[kind], "{kind}");
        }
        // How much the builder held is another matter.
        let meta = Meta { build_peak: one.meta().build_peak, ..other.meta().clone() };
        assert_eq!(meta, *one.meta());
        assert_eq!(other.tree().expect("a tree").bounds(), tree.bounds());
    }
}

#[test]
fn a_failure_leaves_the_old_file_and_nothing_else() {
    let place = Place::with(&meshes()[0]);
    let before = place.bytes();
    let params = BuildParams::default();
    let spooled = SpooledMesh::of_mesh(&meshes()[1], place.folder.path()).expect("room");
    let failed = large::build(&place.path, &spooled, &params, 1 << 20, "a soup", &Progress::default());
    let message = failed.expect_err("it is too little").to_string();
    assert!(message.contains("bytes at least, not 0"), "{message}");
    assert_eq!((place.files(), place.bytes() == before), (1, true));
}
