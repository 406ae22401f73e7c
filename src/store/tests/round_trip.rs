//! What is written comes back.

use super::super::{BLOCK, Kind, VERSION};
use super::surfaces::*;
use super::*;
use crate::cache::{CacheOptions, Cached};
use crate::kdtree::Tree;
use crate::mesh::{Attributes, Channel, Map};
use crate::scene::{CachedSurface, Look, Surface};
use std::sync::{Arc, Mutex};

#[test]
fn tree_and_mesh_come_back_to_the_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    for mesh in meshes().into_iter().chain(rich_meshes(folder.path())) {
        let tree = build(&mesh);
        let place = Place::new();
        let written = place.write(&mesh, &tree).expect("written");
        let file = place.open().expect("opens");
        file.verify(&|_| ()).expect("is whole");
        assert_eq!(file.mesh().expect("a mesh"), as_read(&mesh));
        let again = file.tree().expect("a tree");
        let (ours, theirs) = (tree.arrays(), again.arrays());
        assert_eq!(
            (ours.nodes, ours.references, ours.lines),
            (theirs.nodes, theirs.references, theirs.lines)
        );
        assert_eq!((ours.upper, ours.beneath, ours.pages), (theirs.upper, theirs.beneath, theirs.pages));
        assert_eq!(ours.triangles, theirs.triangles);
        assert_eq!((again.bounds(), again.scale(), again.root()), (tree.bounds(), tree.scale(), tree.root()));
        assert_eq!((again.params(), again.build_peak()), (tree.params(), tree.build_peak()));
        assert_eq!(again.stats(), tree.stats());
        again.validate().expect("is whole");
        assert_eq!(written.bytes, file.bytes());
        assert_eq!(written.sections, file.sections());
        assert!(written.missing_images.is_empty(), "{:?}", written.missing_images);
    }
}

#[test]
fn a_tree_outlives_its_file() {
    let mesh = &meshes()[0];
    let place = Place::with(mesh);
    let tree = place.open().expect("opens").tree().expect("a tree");
    drop(place);
    assert_eq!(tree.arrays().lines, build(mesh).arrays().lines);
}

#[test]
fn surfaces_come_back_to_the_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    for mesh in meshes().into_iter().chain(rich_meshes(folder.path())) {
        let place = Place::with(&mesh);
        let file = place.open().expect("opens");
        same_surfaces(&mesh, &file.stored().expect("surfaces"));
        let cached = Cached::open(&file, &CacheOptions::default(), 4 << 20, 0, 2).expect("enough");
        let cached = Arc::new(cached);
        let surface = CachedSurface::new(Arc::clone(&cached), &file).expect("surfaces");
        // It is read, and the old file, when another has taken the name.
        place.write(&meshes()[0], &build(&mesh)).expect("written");
        cached.or_error(|| same_surfaces(&mesh, &surface)).expect("can be read");
    }
}

/// Whether both say the same of everything.
fn same_surfaces(mesh: &Mesh, surface: &impl Surface) {
    assert_eq!(Surface::materials(mesh), surface.materials());
    assert_eq!((Surface::uses(mesh), Surface::emitters(mesh)), (surface.uses(), surface.emitters()));
    assert_eq!(Surface::has_attributes(mesh), surface.has_attributes());
    assert_eq!(mesh.images.len(), surface.images().len());
    for (ours, theirs) in mesh.images.iter().zip(surface.images()) {
        assert_eq!((&ours.name, ours.source.read()), (&theirs.name, theirs.source.read()));
    }
    let (ours, theirs) = (Surface::reader(mesh), surface.reader());
    for primitive in 0..mesh.triangles.len() as u32 {
        assert_eq!(surface.corners(primitive), mesh.corners(primitive));
        assert_eq!(surface.material(primitive), mesh.material(primitive));
        assert_eq!(theirs.face(primitive), ours.face(primitive));
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.3, 0.45)] {
            assert_eq!(surface.color(primitive, u, v), mesh.color(primitive, u, v));
            assert_eq!(theirs.detail(primitive, u, v), ours.detail(primitive, u, v));
        }
    }
}

#[test]
fn scaled_coordinates_come_back_to_the_bit() {
    let mut mesh = shapes::soup(50, 4);
    // Of coordinates this large, the tree keeps a smaller copy, in which the least bits of tiny ones are lost.
    for (i, position) in mesh.positions.iter_mut().enumerate() {
        *position *= if i % 2 == 0 { 1e37 } else { 1e-30 };
    }
    let tree = build(&mesh);
    assert!(!tree.scale().is_none());
    let lossy = |id: u32| {
        let corners = tree.triangle(id).corners;
        tree.scale().undo(&corners).map(Vec3::from) != mesh.corners(id)
    };
    assert!((0..50).any(lossy), "the test tests nothing");
    let place = Place::with(&mesh);
    let file = place.open().expect("opens");
    let stored = file.stored().expect("surfaces");
    for primitive in 0..50 {
        assert_eq!(stored.corners(primitive), mesh.corners(primitive));
    }
    let again = file.tree().expect("a tree");
    assert_eq!((again.scale(), again.mesh_bounds()), (tree.scale(), tree.mesh_bounds()));
}

#[test]
fn the_meta_section_says_what_there_is() {
    let mesh = &meshes()[3];
    let place = Place::with(mesh);
    let file = place.open().expect("opens");
    let (meta, tree) = (file.meta(), build(mesh));
    assert_eq!((&*meta.source, meta.triangles, meta.vertices), ("a soup", 300, 900));
    assert!(meta.engine.starts_with("raypack "));
    let upper = tree.arrays().upper.iter().filter(|node| node.is_leaf());
    let largest = upper.map(|page| tree.page(*page).len()).max();
    assert_eq!(Some(meta.largest_page), largest);
    assert_eq!(meta.largest_leaf, tree.stats().largest_leaf);
}

#[test]
fn the_file_is_laid_out_as_documented() {
    let mesh = &meshes()[2];
    let place = Place::with(mesh);
    let (bytes, file) = (place.bytes(), place.open().expect("opens"));
    let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"));
    let u64_at = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight"));
    assert_eq!(&bytes[..8], b"\x89RPK\r\n\x1a\n");
    assert_eq!((u32_at(8), u32_at(12)), (0x0102_0304, VERSION));
    assert_eq!(u64_at(16), bytes.len() as u64);
    assert_eq!((u64_at(24), u32_at(32), u32_at(36)), (128, file.sections().len() as u32, 32));
    let (table, blocks) = (u64_at(40) as usize, u64_at(48) as usize);
    assert_eq!((table, table + blocks * 4), (blocks * BLOCK, bytes.len()));
    assert_eq!(u64_at(56), xxhash_rust::xxh3::xxh3_64(&bytes[table..]));
    assert_eq!(u32_at(64), BLOCK as u32);
    let mut first = bytes[..BLOCK].to_vec();
    first[120..128].fill(0);
    assert_eq!(u64_at(120), xxhash_rust::xxh3::xxh3_64(&first));

    assert_eq!(u32_at(table), 0);
    for block in 1..blocks {
        let sum = xxhash_rust::xxh3::xxh3_64(&bytes[block * BLOCK..][..BLOCK]) as u32;
        assert_eq!((u32_at(table + 4 * block), file.checksums()[block]), (sum, sum));
    }
    for (number, section) in file.sections().iter().enumerate() {
        let entry = 128 + 32 * number;
        assert_eq!((u32_at(entry), u32_at(entry + 4)), (section.kind as u32, section.kind.element() as u32));
        assert_eq!((u64_at(entry + 8), u64_at(entry + 16)), (section.offset, section.bytes));
        assert_eq!(u64_at(entry + 24), section.count);
        assert!(section.offset.is_multiple_of(65_536));
    }
    let corner_colors = file.section(Kind::CornerColors).expect("there");
    assert_eq!((corner_colors.count, corner_colors.bytes), (300, 2700));
    assert!(file.section(Kind::TriangleColors).is_none());
}

#[test]
fn the_document_names_every_section_and_member() {
    let document = include_str!("../format.md");
    for kind in Kind::ALL {
        let row = format!("| {} | `{}` | {} |", *kind as u32, kind.name(), kind.element());
        assert!(document.contains(&row), "format.md lacks \"{row}\"");
    }
    assert!(document.contains(&format!("version {VERSION}")));
    let place = Place::with(&meshes()[0]);
    let meta = serde_json::to_value(place.open().expect("opens").meta()).expect("plain data");
    let material = serde_json::to_value(lamp()).expect("plain data");
    let map = Map::whole(0, Channel::Color);
    for (members, quote) in [
        (meta, '`'),
        (material["maps"].clone(), '`'),
        (material, '`'),
        (serde_json::to_value(map).expect("plain data"), '"'),
    ] {
        for member in members.as_object().expect("an object").keys() {
            let name = format!("{quote}{member}{quote}");
            assert!(document.contains(&name), "format.md lacks the member {member}");
        }
    }
}

#[test]
fn a_scene_replaces_another_while_it_is_open() {
    let [first, .., last] = &meshes()[..] else { panic!("there are several") };
    let place = Place::with(first);
    let file = place.open().expect("opens");
    place.write(last, &build(last)).expect("written");
    file.verify(&|_| ()).expect("the old one is still whole");
    assert_eq!(file.mesh().expect("a mesh"), *first);
    assert_eq!(place.open().expect("opens").mesh().expect("a mesh"), *last);
    assert_eq!(place.files(), 1);
}

#[test]
fn progress_runs_to_the_end() {
    let mesh = &meshes()[0];
    let place = Place::new();
    let told = Mutex::new(vec![0.0]);
    let tell = |part| told.lock().expect("sound").push(part);
    super::super::write(&place.path, mesh, &build(mesh), "", &tell).expect("written");
    place.open().expect("opens").verify(&tell).expect("is whole");
    let told = told.into_inner().expect("sound");
    assert!(told.iter().all(|part| (0.0..=1.0).contains(part)));
    assert_eq!(told.iter().filter(|&&part| part == 1.0).count(), 2);
}

#[test]
fn a_mesh_with_anothers_tree_or_colors_is_refused() {
    let place = Place::new();
    let mesh = &meshes()[1];
    let refused = |mesh: &Mesh, tree: &KdTree| {
        let message = place.write(mesh, tree).expect_err("refused").to_string();
        assert!(message.starts_with("unusable mesh: "), "{message}");
        assert_eq!(place.files(), 0);
    };
    refused(mesh, &build(&shapes::soup(300, 2)));
    refused(mesh, &build(&shapes::soup(299, 1)));
    let tree = build(mesh);
    let with = |colors| Mesh { colors, ..mesh.clone() };
    refused(&with(Colors::PerTriangle(vec![[0; 3]; 299])), &tree);
    refused(&with(Colors::Uniform(Vec3::NAN)), &tree);
    refused(&with(Colors::PerMaterial { materials: vec![], of_triangle: vec![0; 300] }), &tree);
    refused(&Mesh { attributes: vec![Attributes::NONE; 299], ..mesh.clone() }, &tree);
    let mut infinite = vec![Attributes::NONE; 300];
    infinite[77].uv[2][1] = f32::INFINITY;
    refused(&Mesh { attributes: infinite, ..mesh.clone() }, &tree);
    refused(&with(Colors::PerMaterial { materials: vec![glass()], of_triangle: vec![0; 300] }), &tree);
}
