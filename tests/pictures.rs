//! Pictures compared with ones that somebody has looked at.
//!
//! The golden pictures are in `tests/golden`. When the look is meant to change, run
//! `RAYPACK_REFRESH_GOLDEN=1 cargo test --test pictures`, look at the new ones, and commit them.

#[path = "common/cornell.rs"]
mod cornell_box;

use image::RgbImage;
use raypack::Vec3;
use raypack::kdtree::BuildParams;
use raypack::mesh::Mesh;
use raypack::mesh::generate::plant::{self, PlantParams};
use raypack::render::{Frame, Limits, RenderSettings, Renderer, Size, Staged, Wishes, image as pictures};
use raypack::scene::effects::Request;
use raypack::scene::{Camera, Lighting};
use raypack::study::accuracy::tradeoff::Judge;
use raypack::traverse::Accel;
use std::path::{Path, PathBuf};

const SIZE: Size = Size { width: 240, height: 135 };

/// How far a channel may be off before its pixel counts as different.
const CHANNEL: u8 = 6;

/// The part of the pixels that may be different: edges that another libm puts an ulp elsewhere.
const DIFFERENT: f64 = 0.002;

#[test]
fn the_plant_looks_as_it_should() {
    let mesh = plant::generate(PlantParams { triangles: 30_000, seed: 1 });
    let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
    let view = plant::demo_view();
    let camera = Camera { fov: view.fov_degrees, ..Camera::new(view.eye * 0.42, Vec3::new(0.0, 6.0, 0.0)) };
    let lighting = Lighting::outdoors(Vec3::Y, view.sun);
    let settings = RenderSettings { samples: 4, ..RenderSettings::new(SIZE) };
    let (frame, _) = Renderer::new(&accel, &mesh, settings).expect("settings").frame(&camera, &lighting);

    let Some([expected, rendered]) = beside_golden("plant", &frame) else { return };
    let different = expected
        .pixels()
        .zip(rendered.pixels())
        .filter(|(a, b)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > CHANNEL))
        .count();
    assert!(
        different as f64 <= DIFFERENT * SIZE.pixels() as f64,
        "{different} pixels differ: {}",
        advice("plant")
    );
}

/// The least likeness: SSIMULACRA 2 calls 90 and more indistinguishable at a normal distance.
const LIKENESS: f64 = 90.0;

#[test]
fn the_gallery_looks_as_it_should() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/gallery");
    let mesh = raypack::mesh::read(folder.join("gallery.obj")).expect("the repository's own").mesh;
    let camera: Camera = "eye=0,1.9,6.6;at=0,1.5,0;fov=48".parse().expect("a camera");
    assert_alike("gallery", &with_effects(&mesh, &camera, SIZE, 32));
}

#[test]
fn the_cornell_box_looks_as_it_should() {
    let mut model = cornell_box::painted(15.0);
    model.material(cornell_box::MIRROR).ball(Vec3::new(3.9, 1.2, 3.9), 1.2, 24, true);
    model.material(cornell_box::GLASS).ball(Vec3::new(1.3, 1.0, 2.6), 1.0, 24, true);
    let water = [Vec3::new(2.7, -0.1, 0.4), Vec3::new(4.9, 0.7, 1.9)];
    model.material(cornell_box::TINTED_WATER).block(water[0], water[1]);
    let size = Size { width: 96, height: 96 };
    assert_alike("cornell", &with_effects(&model.mesh(), &cornell_box::camera(), size, 32));
}

/// A picture with all effects that a scene with a lamp calls for.
fn with_effects(mesh: &Mesh, camera: &Camera, size: Size, samples: u32) -> Frame {
    let accel = Accel::build(mesh, &BuildParams::default()).expect("builds");
    // Not used: the scene has a lamp.
    let lighting = Lighting::outdoors(Vec3::Y, Vec3::Y);
    let wishes = Wishes {
        request: Request::default(),
        lighting,
        environment: None,
        samples: Some(samples),
        limits: Limits { bounces: 6, ..Limits::default() },
        error: None,
    };
    let staged = Staged::new(&accel, mesh, camera, wishes);
    assert_eq!(staged.problems, []);
    let settings = RenderSettings { samples: staged.samples, ..RenderSettings::new(size) };
    let renderer = Renderer::new(&accel, mesh, settings).expect("settings");
    let appearance = staged.appearance.as_ref().expect("it calls for effects");
    renderer.with_appearance(appearance).expect("limits").frame(camera, &lighting).0
}

/// Asserts that an eye could hardly tell a frame from the golden picture.
fn assert_alike(name: &str, frame: &Frame) {
    let Some([expected, rendered]) = beside_golden(name, frame) else { return };
    let likeness = Judge::new(frame_of(&expected)).error(&frame_of(&rendered)).ssimulacra2;
    assert!(likeness >= LIKENESS, "the likeness is {likeness:.1}: {}", advice(name));
}

/// A picture as a frame.
fn frame_of(picture: &RgbImage) -> Frame {
    let (width, height) = picture.dimensions();
    let color = picture.pixels().map(|pixel| pixel.0.map(raypack::mesh::srgb_to_linear)).collect();
    Frame { size: Size { width, height }, color, depth: None, normal: None }
}

/// The golden picture and a frame, as a display shows both. `None` if the golden one was made anew.
fn beside_golden(name: &str, frame: &Frame) -> Option<[RgbImage; 2]> {
    let golden = golden(name);
    if std::env::var_os("RAYPACK_REFRESH_GOLDEN").is_some() {
        pictures::write_color(&golden, frame.size, &frame.color).expect("written");
        return None;
    }
    let actual = actual(name);
    pictures::write_color(&actual, frame.size, &frame.color).expect("written");
    let read = |path: &Path| image::open(path).expect("a picture").to_rgb8();
    let both = [read(&golden), read(&actual)];
    assert_eq!(both[0].dimensions(), both[1].dimensions());
    Some(both)
}

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/golden/{name}.png"))
}

fn actual(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-actual.png"))
}

fn advice(name: &str) -> String {
    format!(
        "compare {} with what was rendered, {}. If that is as it should be: \
         RAYPACK_REFRESH_GOLDEN=1 cargo test --test pictures",
        golden(name).display(),
        actual(name).display()
    )
}
