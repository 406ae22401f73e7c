//! A picture compared with one that somebody has looked at.
//!
//! The golden picture is `tests/golden/plant.png`. When the look is meant to change, run
//! `RAYPACK_REFRESH_GOLDEN=1 cargo test --test pictures`, look at the new one, and commit it.

use raypack::Vec3;
use raypack::kdtree::BuildParams;
use raypack::mesh::generate::plant::{self, PlantParams};
use raypack::render::{RenderSettings, Renderer, Size, image as pictures};
use raypack::scene::{Camera, Lighting};
use raypack::traverse::Accel;
use std::path::Path;

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

    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/plant.png");
    if std::env::var_os("RAYPACK_REFRESH_GOLDEN").is_some() {
        pictures::write_color(&golden, SIZE, &frame.color).expect("written");
        return;
    }
    let actual = Path::new(env!("CARGO_TARGET_TMPDIR")).join("plant-differs.png");
    pictures::write_color(&actual, SIZE, &frame.color).expect("written");
    let read = |path: &Path| image::open(path).expect("a picture").to_rgb8();
    let (expected, rendered) = (read(&golden), read(&actual));
    assert_eq!(expected.dimensions(), rendered.dimensions());
    let different = expected
        .pixels()
        .zip(rendered.pixels())
        .filter(|(a, b)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > CHANNEL))
        .count();
    assert!(
        different as f64 <= DIFFERENT * SIZE.pixels() as f64,
        "{different} pixels differ from {}; what was rendered is in {}. If that is as it should be: \
         RAYPACK_REFRESH_GOLDEN=1 cargo test --test pictures",
        golden.display(),
        actual.display(),
    );
    std::fs::remove_file(actual).expect("it was written");
}
