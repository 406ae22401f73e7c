//! Materials, attributes and pictures: in the file when they are called for, and looked at before they are used.

use super::super::Kind;
use super::damage::{liar, reseal};
use super::*;
use crate::cache::{CacheOptions, Cached};
use crate::mesh::{Attributes, Channel, Image, ImageSource, Map, Maps, Normal};
use crate::scene::CachedSurface;
use std::path::Path;
use std::sync::Arc;

/// [`meshes`] with all else that a mesh can have.
pub(super) fn rich_meshes(folder: &Path) -> Vec<Mesh> {
    meshes().into_iter().map(|mesh| enriched(mesh, folder)).collect()
}

/// A mesh with attributes, and with pictures of each kind; if it has materials, with ones that do everything.
pub(super) fn enriched(mut mesh: Mesh, folder: &Path) -> Mesh {
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
    std::fs::write(&file, (0..10_000u32).map(|i| ((i * i) >> 3) as u8).collect::<Vec<_>>()).expect("written");
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

/// Unlit, with holes, and giving off light.
pub(super) fn lamp() -> Material {
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

/// Of all that a surface can do, all but that.
pub(super) fn glass() -> Material {
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
pub(super) fn as_read(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    for image in &mut mesh.images {
        image.source = match image.source.read() {
            Ok(bytes) => ImageSource::Bytes(bytes.into_owned().into()),
            Err(why) => ImageSource::Missing(why),
        };
    }
    mesh
}

#[test]
fn a_scene_has_the_sections_that_it_calls_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let has = |mesh: &Mesh, kind| Place::with(mesh).open().expect("opens").section(kind).map(|s| s.count);
    for (plain, rich) in meshes().iter().zip(rich_meshes(folder.path())) {
        let materials = !plain.colors.materials().is_empty();
        assert_eq!(has(plain, Kind::MaterialOfTriangle), materials.then_some(300));
        assert_eq!(has(&rich, Kind::MaterialOfTriangle), None);
        assert_eq!((has(plain, Kind::SurfaceRecords), has(&rich, Kind::SurfaceRecords)), (None, Some(300)));
        let lamps = (0..300).filter(|i| i % 11 % 4 == 2).count() as u64;
        assert_eq!(
            (has(plain, Kind::Emitters), has(&rich, Kind::Emitters)),
            (None, materials.then_some(lamps))
        );
        assert_eq!((has(plain, Kind::Images), has(&rich, Kind::Images)), (None, Some(15_003)));
    }
    // Lights without attributes.
    let bare = Mesh { attributes: Vec::new(), ..rich_meshes(folder.path()).remove(3) };
    assert_eq!(has(&bare, Kind::SurfaceRecords), None);
    assert!(has(&bare, Kind::Emitters).is_some() && has(&bare, Kind::MaterialOfTriangle).is_some());
}

#[test]
fn a_picture_that_cannot_be_read_is_missing_and_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = rich_meshes(folder.path()).remove(3);
    let tree = build(&mesh);
    let place = Place::new();
    std::fs::remove_file(folder.path().join("wood.png")).expect("it was there");
    let written = place.write(&mesh, &tree).expect("written all the same");
    let [said] = &written.missing_images[..] else { panic!("{:?}", written.missing_images) };
    assert!(said.starts_with("wood.png cannot be read: ") && !said.contains('\n'), "{said}");
    let file = place.open().expect("opens");
    assert!(
        matches!(&file.images()[0].source, ImageSource::Missing(why) if why.starts_with("cannot be read"))
    );
    assert_eq!(file.mesh().expect("a mesh"), as_read(&mesh));
    // It was missing before when the scene is written once more.
    let mesh = file.mesh().expect("a mesh");
    assert!(place.write(&mesh, &tree).expect("written").missing_images.is_empty());
}

#[test]
fn pictures_that_have_no_place_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = Place::with(&rich_meshes(folder.path())[3]);
    let lie = liar(&place);
    let senseless = "its meta section makes no sense: ";
    lie(
        "\"offset\":10000",
        "\"offset\":9999",
        &format!("{senseless}picture scene.glb, image 0 has no place"),
    );
    lie("\"bytes\":5000", "\"bytes\":4999", "picture empty.png has no place of its own");
    lie("\"bytes\":10000", "\"bytes\":18446744073709551615", "picture wood.png has no place of its own");
    lie("\"bytes\":3", "\"bytes\":4", "15003 elements of images, 15004 expected");
    lie("\"image\":4", "\"image\":5", "material lamp names a picture that is not there");
    lie("\"emission\":[12.5,", "\"emission\":[-1,", "its colours are none");
    lie("\"uses\":[", "\"uses\":[18446744073709551615,", "its uses of materials are not");
    // The lamp's triangles give off none of it any more.
    lie("\"emission\":[12.5,0.33333334,1e-9]", "\"emission\":[0,0,0]", "elements of emitters, 0 expected");
}

#[test]
fn what_checksums_cannot_know_of_surfaces_is_looked_at() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = &rich_meshes(folder.path())[3];
    let place = Place::with(mesh);
    let (bytes, sections) = (place.bytes(), place.open().expect("opens").sections().to_vec());
    // A word of a section, with checksums made right for it.
    let forged = |kind: Kind, word: usize, value: u32| {
        let mut bytes = bytes.clone();
        let at =
            sections.iter().find(|section| section.kind == kind).expect("there").range().start + 4 * word;
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        reseal(&mut bytes);
        place.set(&bytes);
        place.open().expect("opens")
    };
    let both = |file: File, expected: &str| {
        for result in [file.mesh().map(drop), file.stored().map(drop)] {
            let message = result.expect_err("it makes no sense").to_string();
            assert!(message.contains(expected), "{message}");
        }
    };
    both(forged(Kind::SurfaceRecords, 10, 5), "a material that is not there");
    both(forged(Kind::SurfaceRecords, 10, 0), "other numbers of triangles than it says");
    both(
        forged(Kind::SurfaceRecords, 16, f32::NAN.to_bits()),
        "a texture coordinate of its mesh is not finite",
    );
    // Lamps are 2, 6, 10, 13, ...
    let emitters = |word, value, expected: &str| {
        let file = forged(Kind::Emitters, word, value);
        let open = || Cached::open(&file, &CacheOptions::default(), 4 << 20, 0, 1).expect("enough");
        let cached = CachedSurface::new(Arc::new(open()), &file).map(drop);
        let stored = file.stored().map(drop).expect_err("it makes no sense").to_string();
        assert!(stored.contains(expected), "{stored}");
        cached
    };
    let none = "its emitters are no list of its triangles";
    let last = mesh.colors.emitters().len() - 1;
    for (word, value) in [(1, 2), (1, 1), (0, 1 << 31), (last, 300), (last, u32::MAX)] {
        let error = emitters(word, value, none).expect_err("it makes no sense").to_string();
        assert!(error.contains(none), "{error}");
    }
    emitters(0, 1, "an emitter's material gives off no light").expect("nobody has looked at the triangles");
}

#[test]
fn a_damaged_picture_is_an_error_when_it_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = &rich_meshes(folder.path())[1];
    let place = Place::with(mesh);
    let mut bytes = place.bytes();
    let section = *place.open().expect("opens").section(Kind::Images).expect("there");
    // In the first block of the first picture.
    bytes[section.range().start + 17] ^= 4;
    place.set(&bytes);
    let file = place.open().expect("opens");
    let stored = file.stored().expect("pictures are not looked at yet");
    let read: Vec<_> = stored.images().iter().map(|image| image.source.read()).collect();
    let expected =
        format!("cannot be read: the scene file is damaged at byte {}; build it again", section.offset);
    assert_eq!(read[0].as_ref().expect_err("it is damaged"), &expected);
    assert_eq!(read[1].as_deref(), Ok(&[7; 5000][..]));
    assert!(
        file.mesh().expect_err("it has all pictures").to_string().contains("its section images is damaged")
    );
    // Cut while it is open.
    let handle = std::fs::OpenOptions::new().write(true).open(&place.path).expect("there");
    handle.set_len(section.offset).expect("cut");
    assert!(stored.images()[1].source.read().expect_err("it is cut").starts_with("cannot be read: "));
}
