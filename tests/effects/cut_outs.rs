//! Surfaces with holes in them.

use crate::scenes::{Builder, Shot, assert_light, mean};
use raypack::Vec3;
use raypack::kdtree::BuildParams;
use raypack::mesh::{Channel, Image, ImageSource, Map, Material, Mesh};
use raypack::scene::Lighting;
use raypack::scene::effects::Effect;
use raypack::traverse::{Accel, Kernel};

/// A picture of 2 x 2 squares, of which two opposite ones are there.
fn chequers() -> Image {
    let picture = image::RgbaImage::from_fn(64, 64, |x, y| {
        let is_there = (x < 32) == (y < 32);
        image::Rgba([255, 255, 255, if is_there { 255 } else { 0 }])
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).expect("into memory");
    Image { name: "chequers.png".into(), source: ImageSource::Bytes(bytes.into_inner().into()) }
}

/// Walls with holes one behind the other before a lamp, and a floor with a roof of the same kind.
fn scene(layers: usize) -> Mesh {
    let mut scene = Builder::with_image(chequers());
    let lamp = scene.material(Material { emission: Vec3::ONE, ..Material::matt("lamp", Vec3::ZERO) });
    let mut leaf = Material { cutoff: Some(0.5), ..Material::matt("leaf", Vec3::ZERO) };
    leaf.maps.opacity = Some(Map::whole(0, Channel::Alpha));
    let leaf = scene.material(leaf);
    scene.square(lamp, Vec3::new(-500.0, -500.0, -50.0), Vec3::X * 1000.0, Vec3::Y * 1000.0);
    for layer in 0..layers {
        let z = -10.0 - layer as f32 * 0.5;
        let aside = 0.5 * (layer % 4) as f32;
        scene.square(leaf, Vec3::new(-20.0 + aside, -20.0, z), Vec3::X * 40.0, Vec3::Y * 40.0);
    }
    scene.mesh()
}

fn ahead() -> Shot {
    let mut shot = Shot { samples: Some(1), size: 64, ..Shot::new(Vec3::ZERO, Vec3::NEG_Z) };
    shot.camera.fov = 90.0;
    shot
}

#[test]
fn what_a_picture_cuts_away_is_not_there() {
    for layers in [1, 20] {
        let (frame, stats) = ahead().of(&scene(layers));
        // The walls fill the picture, and half of each is there; the farther ones look smaller.
        let light = mean(&frame).x;
        assert!(
            if layers == 1 { (0.45..0.55).contains(&light) } else { (0.4..0.499).contains(&light) },
            "{light}"
        );
        let dark = |x: usize, y: usize| frame.color[y * 64 + x] == [0.0; 3];
        // The picture's upper left quarter is there; up in the scene is up in the picture.
        assert!(dark(20, 20) && dark(44, 44) && !dark(20, 44) && !dark(44, 20));
        let holes = stats.costs.iter().find(|(effect, _)| *effect == Effect::CutOuts).expect("it ran").1;
        assert!(holes.rays > 1500, "rays went through holes: {}", holes.rays);
    }
    let whole = Shot { effects: "-cut-outs", ..ahead() };
    assert_eq!(whole.mean(&scene(1)), Vec3::ZERO);
}

#[test]
fn every_kernel_sees_the_same_holes() {
    let mesh = scene(7);
    let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
    let (expected, _) = ahead().with(&accel, &mesh, |settings| settings.tuning.packet = Kernel::Single);
    for kernel in Kernel::ALL {
        let (frame, _) = ahead().with(&accel, &mesh, |settings| settings.tuning.packet = kernel);
        assert_eq!(frame.color, expected.color, "{kernel}");
    }
}

#[test]
fn light_falls_through_holes() {
    // A roof with holes over a floor, the sun straight above; the eye is between the two.
    let mut scene = Builder::with_image(chequers());
    let floor = scene.material(Material::matt("floor", Vec3::ONE));
    let mut leaf = Material { cutoff: Some(0.5), ..Material::matt("leaf", Vec3::ZERO) };
    leaf.maps.opacity = Some(Map::whole(0, Channel::Alpha));
    let leaf = scene.material(leaf);
    scene.square(floor, Vec3::new(-9.0, 0.0, -9.0), Vec3::Z * 18.0, Vec3::X * 18.0);
    scene.square(leaf, Vec3::new(-4.0, 5.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0);
    let mesh = scene.mesh();
    let lighting = Lighting::outdoors(Vec3::Y, Vec3::Y);
    let light_at = |x: f32, z: f32| {
        let mut shot = Shot {
            lighting,
            samples: Some(1),
            ..Shot::new(Vec3::new(x, 1.0, z + 0.01), Vec3::new(x, 0.0, z))
        };
        shot.camera.fov = 0.5;
        shot.mean(&mesh)
    };
    let shaded = lighting.ambient.irradiance(Vec3::Y);
    let raypack::scene::Light::Sun { irradiance, .. } = lighting.key else { panic!("a sun") };
    // Texture coordinates run along z and x: equal signs are the quarters of the picture's other diagonal.
    for (x, z, is_lit) in [(-2.0, -2.0, true), (2.0, 2.0, true), (-2.0, 2.0, false), (2.0, -2.0, false)] {
        let expected = if is_lit { shaded + irradiance } else { shaded };
        assert_light(light_at(x, z), expected, 1e-5);
    }
}
