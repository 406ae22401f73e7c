//! The MTL files of an OBJ, and the pictures that they name.

use super::{Folder, SQUARE, read, same_in_files};
use raypack::Vec3;
use raypack::mesh::{self, Channel, Colors, ImageSource, Loaded, Material};
use std::path::PathBuf;

/// What an OBJ of two triangles, `a` and `b`, makes of `a.mtl`.
fn with_materials(folder: &Folder, text: impl AsRef<[u8]>) -> Loaded {
    folder.put("a.mtl", text);
    let file = format!("mtllib a.mtl\n{SQUARE}usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n");
    read_both(folder.put("a.obj", file))
}

/// Reads a file, to memory and to files.
fn read_both(path: PathBuf) -> Loaded {
    let loaded = mesh::read(&path).unwrap_or_else(|e| panic!("{e}"));
    same_in_files(&path, &loaded);
    loaded
}

fn materials(loaded: &Loaded) -> &[Material] {
    let Colors::PerMaterial { materials, .. } = &loaded.mesh.colors else { panic!("no materials") };
    materials
}

#[test]
fn materials_color_what_follows_them() {
    let folder = Folder::new();
    let materials = "newmtl red one\r\nKd 1 0 0\r\nnewmtl grey\nKd 0.5\nillum 2\n";
    folder.put("two words.mtl", materials);
    let faces = "f 1 2 3\nusemtl\tred one\nf 1 3 4\no x\nf 1 2 4\nusemtl grey\nf 2 3 4\n";
    let path = folder.put("a.obj", format!("mtllib two words.mtl\n{SQUARE}{faces}"));
    let loaded = read_both(path);
    let colors: Vec<Vec3> = (0..4).map(|i| loaded.mesh.color(i, 0.2, 0.3)).collect();
    assert_eq!(colors, [Vec3::splat(0.7), Vec3::X, Vec3::X, Vec3::splat(0.5)]);
    let Colors::PerMaterial { materials, .. } = &loaded.mesh.colors else { panic!() };
    assert_eq!(materials[0].name, "red one");
    assert_eq!(loaded.report.summary(), "");
}

#[test]
fn material_files_are_found_behind_backslashes_and_in_lists() {
    let folder = Folder::new();
    folder.put("sub/a.mtl", "newmtl a\nKd 1 0 0\n");
    folder.put("b.mtl", "newmtl b\nKd 0 1 0");
    let libraries = "mtllib sub\\a.mtl\nmtllib none.mtl b.mtl\n";
    let faces = "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n";
    let loaded = read_both(folder.put("a.obj", format!("{libraries}{SQUARE}{faces}")));
    assert_eq!((loaded.mesh.color(0, 0.0, 0.0), loaded.mesh.color(1, 0.0, 0.0)), (Vec3::X, Vec3::Y));
    assert_eq!(loaded.report.missing_material_files, ["none.mtl"]);
}

#[test]
fn missing_and_broken_materials_are_said_and_not_fatal() {
    let folder = Folder::new();
    folder.put("bad.mtl", b"newmtl \xe4\nKd 0.1 zwei 0.3\nKd\nnewmtl\nmap_Kd\n");
    let faces = "usemtl wood\nf 1 2 3\nusemtl wood\nf 1 3 4\n";
    let file = format!("mtllib gone.mtl\nmtllib bad.mtl\n{SQUARE}{faces}");
    let loaded = read_both(folder.put("a.obj", file));
    assert_eq!(
        loaded.report.summary(),
        "4 MTL lines not understood; material file not found: gone.mtl; material not defined: wood"
    );
    assert_eq!(loaded.mesh.color(0, 0.0, 0.0), Vec3::splat(0.7));
}

#[test]
#[cfg(unix)]
fn a_material_file_without_an_end_is_missing() {
    let loaded = read("a.obj", format!("mtllib /dev/zero\n{SQUARE}f 1 2 3\n"));
    assert_eq!(loaded.report.missing_material_files, ["/dev/zero"]);
}

#[test]
fn materials_say_where_they_stand() {
    let loaded = with_materials(
        &Folder::new(),
        "\u{feff}# two\r\n\r\nnewmtl a\r\nKd 1\r\n\r\nNewMtl b\r\nillum 3\r\nKs 0.5\r\n",
    );
    let [a, b] = materials(&loaded) else { panic!("two") };
    assert_eq!((&*a.name, &*a.place, &*b.name, &*b.place), ("a", "a.mtl:3", "b", "a.mtl:6"));
    assert!(b.reflects && !a.reflects);
    assert_eq!(loaded.report.summary(), "");
}

#[test]
fn a_name_means_what_the_file_named_last_says() {
    let folder = Folder::new();
    folder.put("one.mtl", "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0\n");
    folder.put("two.mtl", "newmtl a\nKd 0 1 0\n");
    let faces = "mtllib one.mtl\nusemtl a\nf 1 2 3\nmtllib two.mtl\nusemtl a\nf 1 2 3\nmtllib one.mtl\nusemtl a\nf 1 2 3\n";
    let loaded = read_both(folder.put("a.obj", format!("{SQUARE}{faces}")));
    let colors: Vec<Vec3> = (0..3).map(|i| loaded.mesh.color(i, 0.2, 0.3)).collect();
    assert_eq!(colors, [Vec3::X, Vec3::Y, Vec3::X]);
    assert_eq!(materials(&loaded).len(), 3, "each file is read once");
}

#[test]
fn pictures_are_found_once_and_not_opened() {
    let folder = Folder::new();
    let wood = folder.put("Textures/Old Wood.png", "no picture at all");
    let leaf = folder.put("sub/leaf.png", "");
    folder.put("sub/b.mtl", "newmtl b\nmap_Kd leaf.png\nmap_d leaf.png\nmap_Ks ../textures/old wood.png\n");
    folder.put("a.mtl", "newmtl a\nmap_Kd -s 2 2 1 textures\\Old Wood.png\nmap_Ke \"C:\\x\\old wood.png\"\n");
    let file = format!("mtllib a.mtl\nmtllib sub\\b.mtl\n{SQUARE}usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n");
    let loaded = read_both(folder.put("a.obj", file));
    let files = [wood, leaf].map(|path| ImageSource::File(path.canonicalize().unwrap()));
    assert_eq!(loaded.mesh.images.iter().map(|image| image.source.clone()).collect::<Vec<_>>(), files);
    assert_eq!(loaded.mesh.images[0].name, "textures\\Old Wood.png", "as it is written");
    let [a, b] = materials(&loaded) else { panic!("two") };
    let images = |material: &Material| material.maps.all().map(|map| map.image).collect::<Vec<_>>();
    assert_eq!((images(a), images(b)), (vec![0, 0, 0], vec![1, 0, 1]));
    assert_eq!(a.maps.diffuse.as_ref().map(|map| map.scale), Some([2.0, 2.0]));
    assert_eq!(b.maps.opacity.as_ref().map(|map| map.channel), Some(Channel::Alpha));
    assert_eq!(loaded.report.summary(), "");
}

#[test]
fn pictures_that_are_not_there_are_said_once() {
    let folder = Folder::new();
    let text = "newmtl a\nmap_Kd gone.png\nmap_Ke gone.png\nmap_Ks ../elsewhere.png\nmap_Bump ../elsewhere.png\n\
                newmtl b\nmap_Kd gone.png\nmap_Kd\nmap_d evil\u{1b}[2J.png\n";
    let loaded = with_materials(&folder, text);
    assert_eq!(
        loaded.report.summary(),
        "1 MTL line not understood; textures not found: gone.png, evil?[2J.png; \
         texture outside of the model's folder left out: ../elsewhere.png"
    );
    let reason = |name: &str| {
        let image = loaded.mesh.images.iter().find(|image| image.name == name).expect("in the list");
        let ImageSource::Missing(why) = &image.source else { panic!("{image:?}") };
        why.clone()
    };
    assert_eq!(reason("gone.png"), "not found");
    assert_eq!(reason("../elsewhere.png"), "lies outside of the model's folder");
    assert!(materials(&loaded)[0].maps.diffuse.is_some(), "one plain colour takes its place");
}
