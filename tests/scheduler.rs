//! The picture is the same, bit for bit, for every number of threads, tile size, packet width and
//! instruction set.

use raypack::Vec3;
use raypack::kdtree::BuildParams;
use raypack::mesh::generate::plant::{self, PlantParams};
use raypack::mesh::{Colors, Mesh};
use raypack::render::{Aovs, Frame, RenderSettings, Renderer, Size, Tuning};
use raypack::scene::{Camera, Light, Lighting};
use raypack::simd::Isa;
use raypack::traverse::{Accel, Kernel};

/// Every bit of a frame.
fn bits(frame: &Frame) -> Vec<u32> {
    let normals = frame.normal.iter().flatten();
    let colors = frame.color.iter().chain(normals).flatten();
    colors.chain(frame.depth.iter().flatten()).map(|value| value.to_bits()).collect()
}

fn settings(size: Size, samples: u32, tuning: Tuning) -> RenderSettings {
    let aovs = Aovs { depth: true, normal: true };
    RenderSettings { samples, aovs, tuning, ..RenderSettings::new(size) }
}

/// Renders with all sorts of tunings and compares each picture with the plainest one's. At least
/// a quarter of the picture must show the scene, some of it in the light.
fn compare(mesh: &Mesh, camera: &Camera, size: Size, samples: u32) {
    let mut accel = Accel::build(mesh, &BuildParams::default()).expect("builds").with_isa(Isa::Portable);
    let lighting = Lighting::for_view(camera, &accel);
    let render = |accel: &Accel, packet, tile, threads| {
        let tuning = Tuning { packet, tile, threads, pin: false };
        let renderer = Renderer::new(accel, mesh, settings(size, samples, tuning)).expect("good settings");
        renderer.frame(camera, &lighting)
    };
    let (expected, plain) = render(&accel, Kernel::Single, 1024, 1);
    let hits = expected.depth.iter().flatten().filter(|depth| depth.is_finite()).count();
    assert!(4 * hits > expected.color.len(), "the scene should be in the picture");
    assert!(plain.shadow.rays > 0, "and in the light");

    for isa in Isa::available() {
        accel.set_isa(isa);
        for packet in Kernel::ALL {
            for (tile, threads) in [(32, 1), (7, 3), (1, 2), (16, 8), (1024, 4)] {
                let (frame, stats) = render(&accel, packet, tile, threads);
                let what = format!("{isa}, {packet}, tiles of {tile}, {threads} threads");
                assert!(bits(&frame) == bits(&expected), "{what}");
                assert_eq!(
                    (stats.camera.rays, stats.shadow.rays, stats.threads),
                    (plain.camera.rays, plain.shadow.rays, threads),
                    "{what}"
                );
            }
        }
    }
}

#[test]
fn the_plant_looks_the_same_however_it_is_rendered() {
    let mesh = plant::generate(PlantParams { triangles: 20_000, seed: 5 });
    let view = plant::demo_view();
    let camera = Camera { fov: view.fov_degrees, ..Camera::new(view.eye * 0.6, view.at) };
    // Neither side is a multiple of any block or tile.
    compare(&mesh, &camera, Size { width: 109, height: 61 }, 1);
    compare(&mesh, &camera, Size { width: 37, height: 23 }, 3);
}

#[test]
fn so_does_the_inside_of_a_room_with_vertex_colors() {
    let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
    let mut positions: Vec<Vec3> = (0..8).map(|i| corner(i) * 4.0 - 2.0).collect();
    positions.extend((0..8).map(|i| corner(i) * 0.9 - Vec3::new(0.2, 1.9, 1.3)));
    let faces: [[u32; 4]; 6] =
        [[0, 1, 3, 2], [4, 5, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6]];
    let triangles = [0, 8]
        .iter()
        .flat_map(|&first| faces.map(|face| face.map(|i| i + first)))
        .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    let colors = (0..16u8).map(|i| [i * 16, 255 - i * 9, 77 + i * 3]).collect();
    let mesh = Mesh { positions, triangles, colors: Colors::PerVertex(colors), ..Mesh::default() };
    let camera = Camera { fov: 70.0, ..Camera::new(Vec3::new(0.9, 0.8, 1.7), Vec3::new(0.0, -1.0, -1.0)) };
    let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
    assert!(matches!(Lighting::for_view(&camera, &accel).key, Light::Point { .. }));
    compare(&mesh, &camera, Size { width: 45, height: 67 }, 2);
}

#[test]
fn one_pixel_is_a_picture_too() {
    let mesh = plant::generate(PlantParams { triangles: 10_000, seed: 1 });
    let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
    let camera = Camera::framing(&accel.bounds(), 1.0);
    compare(&mesh, &camera, Size { width: 1, height: 1 }, 1);
}
