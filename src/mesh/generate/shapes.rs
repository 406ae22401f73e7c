//! Shapes for tests and benches, each hard for a tree in a way of its own.

use super::rng::Rng;
use crate::mesh::{Colors, Mesh};
use glam::{IVec3, Vec3};
use std::collections::HashMap;

/// `n` small triangles anywhere in the unit cube: nothing to hold on to.
pub fn soup(n: usize, seed: u64) -> Mesh {
    let mut rng = Rng::new(seed, 1);
    let size = 1.0 / cube_root(n) as f32;
    scattered(n, || {
        let center = point(&mut rng);
        std::array::from_fn(|_| center + (point(&mut rng) - 0.5) * size)
    })
}

/// `n` needles across the unit cube, up to a hundred thousand times longer than wide: their boxes
/// are nearly empty.
pub fn slivers(n: usize, seed: u64) -> Mesh {
    let mut rng = Rng::new(seed, 2);
    scattered(n, || {
        let (a, b) = (point(&mut rng), point(&mut rng));
        let width = rng.pick(&[1e-1, 1e-2, 1e-3, 1e-4, 1e-5]);
        [a, b, b + (point(&mut rng) - 0.5) * width]
    })
}

/// About `n` axis-aligned triangles: a city of towers on a square lattice, of whole heights, so
/// that walls share planes and split candidates coincide.
pub fn boxes(n: usize, seed: u64) -> Mesh {
    let mut rng = Rng::new(seed, 3);
    let mut lattice = Lattice::default();
    let side = (n as f32 / 10.0).sqrt().ceil().max(1.0) as i32;
    for x in 0..side {
        for z in 0..side {
            let height = 1 + rng.below(6) as i32;
            let (a, b) = (IVec3::new(2 * x, 0, 2 * z), IVec3::new(2 * x + 1, height, 2 * z + 1));
            let at = |i: i32, j: i32, k: i32| {
                IVec3::new([a.x, b.x][i as usize], [a.y, b.y][j as usize], [a.z, b.z][k as usize])
            };
            lattice.quad([at(0, 1, 0), at(0, 1, 1), at(1, 1, 1), at(1, 1, 0)]);
            lattice.quad([at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0)]);
            lattice.quad([at(1, 0, 0), at(1, 1, 0), at(1, 1, 1), at(1, 0, 1)]);
            lattice.quad([at(0, 0, 0), at(0, 1, 0), at(1, 1, 0), at(1, 0, 0)]);
            lattice.quad([at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)]);
        }
    }
    lattice.finish()
}

/// The unit sphere, from an octahedron split `subdivisions` times: 8 x 4^subdivisions triangles,
/// watertight.
pub fn sphere(subdivisions: u32) -> Mesh {
    let mut positions = vec![Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let mut triangles =
        vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5_u32]];
    for _ in 0..subdivisions {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                (positions.len() - 1) as u32
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    Mesh { positions, triangles, colors: Colors::default(), ..Mesh::default() }
}

/// A gently rolling height field over the unit square, of 2 n² triangles.
pub fn grid(n: usize) -> Mesh {
    let height = |x: f32, z: f32| 0.4 * (x * (1.0 - x)) * (z * (1.0 - z)) + 0.05 * (x - z) * (x - z);
    let mut positions = Vec::with_capacity((n + 1) * (n + 1));
    for k in 0..=n {
        for i in 0..=n {
            let (x, z) = (i as f32 / n as f32, k as f32 / n as f32);
            positions.push(Vec3::new(x, height(x, z), z));
        }
    }
    let mut triangles = Vec::with_capacity(2 * n * n);
    for k in 0..n {
        for i in 0..n {
            let a = (k * (n + 1) + i) as u32;
            let (b, c, d) = (a + 1, a + n as u32 + 1, a + n as u32 + 2);
            triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    Mesh { positions, triangles, colors: Colors::default(), ..Mesh::default() }
}

/// `n` times the same triangle: no plane separates them, every hit is a tie.
pub fn coincident(n: usize) -> Mesh {
    Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]; n],
        colors: Colors::default(),
        ..Mesh::default()
    }
}

/// `n` unit squares on the planes of the integer lattice, two triangles each, in a cube that is
/// about half full of them: rays that follow the lattice run along planes, edges and corners.
pub fn lattice(n: usize, seed: u64) -> Mesh {
    let mut rng = Rng::new(seed, 4);
    let side = cube_root(n * 2 / 3);
    let mut lattice = Lattice::default();
    for _ in 0..n {
        let a = IVec3::from_array(std::array::from_fn(|_| rng.below(side) as i32));
        let axes = [IVec3::X, IVec3::Y, IVec3::Z];
        let axis = rng.below(3);
        let (u, v) = (axes[(axis + 1) % 3], axes[(axis + 2) % 3]);
        lattice.quad([a, a + u, a + u + v, a + v]);
    }
    lattice.finish()
}

/// The least whole number, from 1, whose cube is at least `n`.
fn cube_root(n: usize) -> usize {
    (1..).find(|k: &usize| k.pow(3) >= n).unwrap_or(1)
}

fn point(rng: &mut Rng) -> Vec3 {
    Vec3::new(rng.unit(), rng.unit(), rng.unit())
}

/// A mesh of `n` triangles that share no vertices.
fn scattered(n: usize, triangle: impl FnMut() -> [Vec3; 3]) -> Mesh {
    let positions: Vec<Vec3> = std::iter::repeat_with(triangle).take(n).flatten().collect();
    let triangles = (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh { positions, triangles, colors: Colors::default(), ..Mesh::default() }
}

/// Squares between points of the integer lattice, with shared vertices.
#[derive(Default)]
struct Lattice {
    index: HashMap<IVec3, u32>,
    mesh: Mesh,
}

impl Lattice {
    /// Adds a square, counter-clockwise.
    fn quad(&mut self, corners: [IVec3; 4]) {
        let [a, b, c, d] = corners.map(|p| {
            *self.index.entry(p).or_insert_with(|| {
                self.mesh.positions.push(p.as_vec3());
                (self.mesh.positions.len() - 1) as u32
            })
        });
        self.mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }

    fn finish(self) -> Mesh {
        self.mesh
    }
}
