//! Small scenes, each with a difficulty of its own, and rays of every kind.

use glam::Vec3;
use raypack::geometry::Ray;
use raypack::mesh::Mesh;
use raypack::mesh::generate::plant::{self, PlantParams};
use raypack::mesh::generate::shapes;

/// Named scenes, of some hundreds of triangles up to a few thousand.
pub fn all() -> Vec<(&'static str, Mesh)> {
    let plant = PlantParams { triangles: 10_000, seed: 1 };
    vec![
        ("soup", shapes::soup(1500, 1)),
        ("large soup", scaled_apart(shapes::soup(300, 2), 12.0)),
        ("slivers", shapes::slivers(400, 3)),
        ("boxes", shapes::boxes(1500, 4)),
        ("lattice", shapes::lattice(600, 5)),
        ("sphere", shapes::sphere(4)),
        ("far sphere", moved(shapes::sphere(3), Vec3::new(148_376.0, 1234.0, -223_423.0), 100.0)),
        ("grid", shapes::grid(24)),
        ("coincident", shapes::coincident(40)),
        ("plant", plant::generate(plant)),
    ]
}

/// The same mesh, larger and elsewhere.
fn moved(mut mesh: Mesh, to: Vec3, scale: f32) -> Mesh {
    mesh.positions.iter_mut().for_each(|p| *p = *p * scale + to);
    mesh
}

/// The same triangles, each enlarged about its first corner, so that they cut across each other.
fn scaled_apart(mut mesh: Mesh, scale: f32) -> Mesh {
    let positions = mesh.triangles.iter().flat_map(|triangle| {
        let [p, q, r] = triangle.map(|i| mesh.positions[i as usize]);
        [p, p + (q - p) * scale, p + (r - p) * scale]
    });
    mesh.positions = positions.collect();
    mesh.triangles = (0..mesh.positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    mesh
}

/// SplitMix64.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// Uniform in -1..1.
    fn signed(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
}

/// Rays through a mesh: from all around inward, between points inside, along the axes, at
/// corners, along edges' planes, and of bounded length; in an order that mixes the kinds, so that
/// packets hold all of them.
pub fn rays(mesh: &Mesh, count: usize, seed: u64) -> Vec<Ray> {
    let mut numbers = Numbers(seed);
    let bounds = mesh.bounds();
    let (center, half) = (bounds.center(), bounds.extent() * 0.5);
    let reach = half.length();
    (0..count)
        .map(|i| {
            let inside = center + numbers.vector() * half;
            let primitive = (numbers.next() % mesh.triangles.len() as u64) as u32;
            let corners = mesh.corners(primitive);
            match i % 6 {
                0 => {
                    let origin = center + numbers.vector().normalize_or(Vec3::X) * reach * 2.0;
                    Ray::new(origin, inside - origin)
                }
                1 => Ray::new(inside, numbers.vector()),
                2 => {
                    let axis = [Vec3::X, Vec3::Y, Vec3::Z][(numbers.next() % 3) as usize];
                    let toward = if numbers.next().is_multiple_of(2) { axis } else { -axis };
                    Ray::new(inside - toward * reach, toward * 3.0)
                }
                3 => {
                    let aim = corners[(numbers.next() % 3) as usize];
                    Ray::new(inside, aim - inside)
                }
                4 => {
                    let aim = (corners[0] + corners[1] + corners[2]) / 3.0;
                    Ray::segment(inside, aim - inside, 0.25, 1.5)
                }
                _ => {
                    let other = center + numbers.vector() * half;
                    Ray::segment(inside, other - inside, 0.0, 1.0)
                }
            }
        })
        .collect()
}
