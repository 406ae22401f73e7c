//! Pictures do not depend on how the machine makes them.

use crate::scenes::{Builder, Shot, counts};
use raypack::Vec3;
use raypack::kdtree::BuildParams;
use raypack::mesh::{Channel, Image, ImageSource, Map, Material, Mesh};
use raypack::simd::Isa;
use raypack::store;
use raypack::traverse::{Accel, Kernel};

/// A room with a lamp, a mirror, glass, a glossy floor, a picture on a wall, a veil and leaves.
pub fn room() -> Mesh {
    let picture = image::RgbaImage::from_fn(32, 16, |x, y| {
        image::Rgba([8 * x as u8, 16 * y as u8, 99, if (x / 4 + y / 4) % 2 == 0 { 255 } else { 0 }])
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).expect("into memory");
    let image = Image { name: "picture.png".into(), source: ImageSource::Bytes(bytes.into_inner().into()) };
    let mut scene = Builder::with_image(image);
    let white = scene.material(Material::matt("white", Vec3::splat(0.8)));
    let lamp = scene.material(Material { emission: Vec3::splat(12.0), ..Material::matt("lamp", Vec3::ZERO) });
    let specular = Vec3::new(0.9, 0.8, 0.7);
    let mirror =
        Material { specular, reflects: true, roughness: 0.0, ..Material::matt("mirror", Vec3::ZERO) };
    let gloss = scene.material(Material { roughness: 0.2, fresnel: true, ..mirror.clone() });
    let mirror = scene.material(mirror);
    let glass = scene.material(Material {
        transmission: Vec3::new(0.9, 1.0, 0.9),
        ior: 1.5,
        fresnel: true,
        reflects: true,
        roughness: 0.0,
        absorption: Vec3::new(0.4, 0.0, 0.4),
        ..Material::matt("glass", Vec3::ZERO)
    });
    let mut painted = Material::matt("painted", Vec3::ONE);
    painted.maps.diffuse = Some(Map::whole(0, Channel::Color));
    painted.maps.bump = Some(Map { strength: 0.02, ..Map::whole(0, Channel::Red) });
    let mut leaf = Material { cutoff: Some(0.5), ..Material::matt("leaf", Vec3::Y * 0.5) };
    leaf.maps.opacity = Some(Map::whole(0, Channel::Alpha));
    let painted = scene.material(painted);
    let leaf = scene.material(leaf);
    let veil = scene.material(Material { opacity: 0.4, ..Material::matt("veil", Vec3::X) });

    let far = Vec3::new(-2.0, 0.0, -2.0);
    scene.square(gloss, far, Vec3::Z * 4.0, Vec3::X * 4.0);
    scene.square(white, far + Vec3::Y * 4.0, Vec3::X * 4.0, Vec3::Z * 4.0);
    scene.square(painted, far, Vec3::X * 4.0, Vec3::Y * 4.0);
    scene.square(mirror, far, Vec3::Y * 4.0, Vec3::Z * 4.0);
    scene.square(white, far + Vec3::X * 4.0, Vec3::Z * 4.0, Vec3::Y * 4.0);
    scene.square(lamp, Vec3::new(-0.7, 3.9, -0.7), Vec3::X * 1.4, Vec3::Z * 1.4);
    scene.cube(glass, Vec3::new(0.3, 0.0, -0.5), Vec3::new(1.1, 1.3, 0.4));
    scene.square(leaf, Vec3::new(-1.5, 0.4, -0.4), Vec3::X * 1.2, Vec3::new(0.0, 1.8, 0.4));
    scene.square(veil, Vec3::new(-0.2, 1.5, 0.0), Vec3::X * 1.5, Vec3::Y * 1.5);
    scene.mesh()
}

pub fn shot() -> Shot {
    Shot {
        size: 40,
        samples: Some(3),
        bounces: 6,
        ..Shot::new(Vec3::new(0.0, 2.0, 6.0), Vec3::new(0.0, 1.8, 0.0))
    }
}

#[test]
fn the_picture_is_the_same_for_all_threads_tiles_kernels_and_instruction_sets() {
    let mesh = room();
    let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds").with_isa(Isa::Portable);
    let (expected, stats) = shot().with(&accel, &mesh, |settings| settings.tuning.threads = 1);
    let light: f32 = expected.color.iter().flatten().sum();
    assert!(light.is_finite() && light > 500.0, "{light}");
    for (effect, cost) in stats.costs.iter() {
        use raypack::scene::effects::Effect::*;
        let casts =
            matches!(effect, SoftShadows | Reflection | Glossy | Refraction | Transparency | Interreflection);
        assert!(!casts || cost.rays > 0, "{effect} ran and cast nothing");
        assert!(cost.count() > 0, "{effect} ran and did nothing");
    }
    for isa in Isa::available() {
        let accel = accel.clone().with_isa(isa);
        for (kernel, tile, threads) in
            [(Kernel::Tile, 32, 2), (Kernel::Tile, 5, 3), (Kernel::Stream, 16, 2), (Kernel::Packet16, 64, 1)]
        {
            let (frame, again) = shot().with(&accel, &mesh, |settings| {
                (settings.tuning.packet, settings.tuning.tile, settings.tuning.threads) =
                    (kernel, tile, threads);
            });
            let machine = format!("{kernel} on {isa}, tiles of {tile}, {threads} threads");
            assert!(frame.color == expected.color, "{machine}");
            assert_eq!(counts(&again), counts(&stats), "{machine}");
        }
    }
}

#[test]
fn the_picture_of_a_scene_file_is_the_models() {
    let mesh = room();
    let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
    let (expected, _) = shot().with(&accel, &mesh, |_| {});
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("room.rpk");
    store::write(&path, &mesh, accel.tree(), "room", &|_| {}).expect("is written");
    let file = store::File::open(&path).expect("is open");
    let stored = file.stored().expect("has surfaces");
    let accel = Accel::of_tree(file.tree().expect("has a tree"));
    let (frame, _) = shot().with(&accel, &stored, |_| {});
    assert!(frame.color == expected.color);
}

#[test]
fn a_pixels_samples_do_not_depend_on_its_neighbours() {
    // With an error to reach, pixels stop at different numbers of samples, whatever tile they are in.
    let mesh = room();
    let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
    let shot = Shot { samples: None, size: 24, ..shot() };
    let (expected, stats) = shot.with(&accel, &mesh, |settings| settings.tuning.tile = 16);
    assert!(stats.samples < 60.0, "some pixels were content early: {}", stats.samples);
    let (frame, again) = shot.with(&accel, &mesh, |settings| settings.tuning.tile = 3);
    assert!(frame.color == expected.color);
    assert_eq!(stats.samples, again.samples);
}
