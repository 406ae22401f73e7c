//! What effects are said to cost.

use crate::invariance;
use crate::scenes::{Builder, Shot, assert_light, counts};
use raypack::Vec3;
use raypack::kdtree::BuildParams;
use raypack::mesh::{Channel, Image, ImageSource, Map, Material, Mesh, Normal};
use raypack::scene::effects::Effect;
use raypack::traverse::Accel;

/// Rays from the camera of [`ahead`].
const SAMPLES: u64 = 3 * 16 * 16;

/// A wall that fills the view, 10 ahead of the origin.
fn wall(material: Material) -> Mesh {
    let mut scene = Builder::with_image(grey());
    let wall = scene.material(material);
    scene.square(wall, Vec3::new(-50.0, -50.0, -10.0), Vec3::X * 100.0, Vec3::Y * 100.0);
    scene.mesh()
}

fn grey() -> Image {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let picture = image::GrayImage::from_pixel(4, 4, image::Luma([128]));
    picture.write_to(&mut bytes, image::ImageFormat::Png).expect("into memory");
    Image { name: "grey.png".into(), source: ImageSource::Bytes(bytes.into_inner().into()) }
}

fn ahead(effects: &'static str) -> Shot {
    Shot { effects, samples: Some(3), ..Shot::new(Vec3::ZERO, Vec3::NEG_Z) }
}

/// Asserts what an effect of a scene is used for where the scene calls for it, and that it is nothing where it is off.
#[track_caller]
fn assert_uses(mesh: &Mesh, shots: [&Shot; 2], effect: Effect, expected: u64) {
    let [on, off] = shots.map(|shot| shot.of(mesh).1.costs);
    let cost = on.iter().find(|(ran, _)| *ran == effect).expect("it ran").1;
    assert_eq!((cost.uses, cost.rays), (expected, 0), "{effect}");
    for amount in [cost.seconds, cost.share] {
        assert!(amount.is_finite() && amount >= 0.0, "{effect}: {cost:?}");
    }
    assert!(off.iter().all(|(ran, _)| ran != effect), "{effect} is off");
}

#[test]
fn pictures_are_looked_up_once_for_each_map_and_hit() {
    let mut painted = Material::matt("painted", Vec3::ONE);
    painted.maps.diffuse = Some(Map::whole(0, Channel::Color));
    assert_uses(&wall(painted.clone()), [&ahead("auto"), &ahead("-textures")], Effect::Textures, SAMPLES);
    painted.maps.emission = Some(Map::whole(0, Channel::Color));
    painted.maps.bump = Some(Map::whole(0, Channel::Grey));
    let mesh = wall(painted);
    assert_uses(&mesh, [&ahead("auto"), &ahead("-textures")], Effect::Textures, 2 * SAMPLES);
    assert_uses(&mesh, [&ahead("auto"), &ahead("-bump")], Effect::Bump, SAMPLES);
}

#[test]
fn normals_are_blended_once_for_each_hit_that_has_some() {
    let mut mesh = wall(Material::default());
    // One of the wall's two triangles: of 16 x 16 pixels, those on one side of the diagonal.
    mesh.attributes[0].normals = [Normal::encode(Vec3::Z); 3];
    let shot = |effects| Shot { samples: Some(1), ..ahead(effects) };
    let (_, stats) = shot("auto").of(&mesh);
    let normals =
        stats.costs.iter().find(|(effect, _)| *effect == Effect::SmoothNormals).expect("it ran").1.uses;
    assert!((120..=136).contains(&normals), "{normals}");
    mesh.attributes[1].normals = mesh.attributes[0].normals;
    assert_uses(&mesh, [&shot("auto"), &shot("-smooth-normals")], Effect::SmoothNormals, 256);
}

#[test]
fn light_is_seen_once_by_each_ray_that_meets_it() {
    let lamp = Material { emission: Vec3::ONE, ..Material::matt("lamp", Vec3::ZERO) };
    assert_uses(&wall(lamp), [&ahead("auto"), &ahead("-emission")], Effect::Emission, SAMPLES);
}

#[test]
fn highlights_are_computed_for_each_hit_and_light() {
    let varnish = Material { specular: Vec3::ONE, roughness: 0.3, ..Material::default() };
    let towards = |effects| {
        let lighting = raypack::scene::Lighting::outdoors(Vec3::Y, Vec3::Z);
        Shot { lighting, ..ahead(effects) }
    };
    let mesh = wall(varnish.clone());
    assert_uses(&mesh, [&towards("auto"), &towards("-highlights")], Effect::Highlights, SAMPLES);
    // With other gloss in the scene, that of what has highlights only can still be turned off.
    let mut scene = Builder::default();
    let varnish = scene.material(varnish);
    let metal = scene.material(Material {
        specular: Vec3::ONE,
        reflects: true,
        roughness: 0.3,
        ..Material::default()
    });
    scene.square(varnish, Vec3::new(-50.0, -50.0, -10.0), Vec3::X * 100.0, Vec3::Y * 100.0);
    scene.square(metal, Vec3::new(-1.0, -1.0, -9.0), Vec3::X, Vec3::Y);
    let (frame, _) = towards("-highlights,-shadows").of(&scene.mesh());
    let (matt, _) = towards("none").of(&wall(Material::default()));
    assert_light(frame.color[0].into(), matt.color[0].into(), 1e-5);
}

fn glass() -> Material {
    Material {
        transmission: Vec3::ONE,
        ior: 1.5,
        fresnel: true,
        reflects: true,
        specular: Vec3::ONE,
        roughness: 0.0,
        absorption: Vec3::splat(0.1),
        ..Material::matt("glass", Vec3::ZERO)
    }
}

#[test]
fn glass_is_looked_into_once_and_out_of_once() {
    let mut scene = Builder::default();
    let glass = scene.material(glass());
    scene.cube(glass, Vec3::new(-50.0, -50.0, -10.0), Vec3::new(50.0, 50.0, -8.0));
    let mesh = scene.mesh();
    // Nothing is thrown back without reflection, and no ray leaves by the sides.
    let without = ["-reflection", "-reflection,-fresnel", "-reflection,-absorption"].map(ahead);
    assert_uses(&mesh, [&without[0], &without[1]], Effect::Fresnel, 2 * SAMPLES);
    assert_uses(&mesh, [&without[0], &without[2]], Effect::Absorption, SAMPLES);
}

#[test]
fn a_lens_is_met_by_each_ray_from_the_camera() {
    let mut shots = [ahead("auto"), ahead("-depth-of-field")];
    shots.iter_mut().for_each(|shot| shot.camera.aperture = 0.1);
    assert_uses(&wall(Material::default()), [&shots[0], &shots[1]], Effect::DepthOfField, SAMPLES);
}

#[test]
fn antialiasing_takes_the_samples_after_the_first() {
    let mut scene = Builder::default();
    let lamp = scene.material(Material { emission: Vec3::ONE, ..Material::default() });
    let floor = scene.material(Material::default());
    scene.square(lamp, Vec3::new(-1.0, 3.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0);
    scene.square(floor, Vec3::new(-9.0, 0.0, -9.0), Vec3::Z * 18.0, Vec3::X * 18.0);
    let mesh = scene.mesh();
    let shot = |effects| Shot { effects, ..Shot::new(Vec3::new(0.0, 2.0, 8.0), Vec3::Y) };
    let (_, stats) = shot("auto").of(&mesh);
    assert!((16.0..64.0).contains(&stats.samples), "some pixels are content early: {}", stats.samples);
    let more = ((stats.samples - 1.0) * 256.0).round() as u64;
    assert_uses(&mesh, [&shot("auto"), &shot("-antialiasing")], Effect::Antialiasing, more);
    let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
    let heat = shot("auto").heat(&accel, &mesh, Effect::Antialiasing);
    assert_eq!(heat.iter().sum::<f32>(), more as f32);
    let [least, most] = [f32::min, f32::max].map(|of| heat.iter().copied().reduce(of).expect("pixels"));
    assert!(least >= 15.0 && most <= 63.0 && least < most, "{least} {most}");
}

#[test]
fn pixels_add_up_to_the_frame() {
    let mesh = invariance::room();
    let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
    let shot = Shot { size: 24, ..invariance::shot() };
    let (_, stats) = shot.with(&accel, &mesh, |_| {});
    let counts = counts(&stats);
    assert!(counts.len() >= 10, "{counts:?}");
    for (effect, count) in counts {
        let heat = shot.heat(&accel, &mesh, effect);
        let sum: f64 = heat.iter().map(|&uses| f64::from(uses)).sum();
        assert_eq!((3.0 * sum).round(), count as f64, "{effect}");
    }
    assert!(shot.heat(&accel, &mesh, Effect::DepthOfField).iter().all(|&uses| uses == 0.0), "it is off");
}
