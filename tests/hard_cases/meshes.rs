//! Meshes for the cases, most of them closed.

use crate::numbers::Numbers;
use raypack::Vec3;
use raypack::mesh::generate::shapes;
use raypack::mesh::{Colors, Mesh};

/// A closed surface, and points deep inside of it.
#[derive(Clone)]
pub struct Closed {
    pub name: String,
    pub mesh: Mesh,
    /// Points inside, each at least `clearance` away from the surface.
    pub core: Vec<Vec3>,
    pub clearance: f32,
}

impl Closed {
    /// The same surface, scaled and then moved. Vertices are rounded, which leaves it closed.
    pub fn placed(&self, name: &str, scale: f32, offset: Vec3) -> Self {
        let place = |points: &[Vec3]| points.iter().map(|p| *p * scale + offset).collect();
        Self {
            name: format!("{name} {}", self.name),
            mesh: Mesh { positions: place(&self.mesh.positions), ..self.mesh.clone() },
            core: place(&self.core),
            clearance: self.clearance * scale,
        }
    }

    /// A point inside.
    pub fn inside(&self, numbers: &mut Numbers) -> Vec3 {
        numbers.pick(&self.core) + numbers.vector() * (self.clearance * 0.4)
    }
}

/// A mesh of triangles that share no vertices.
pub fn of_triangles(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Mesh {
    let positions: Vec<Vec3> = triangles.into_iter().flatten().collect();
    let triangles = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh { positions, triangles, colors: Colors::default(), ..Mesh::default() }
}

/// Several meshes in one, ids in their order.
pub fn joined<'a>(meshes: impl IntoIterator<Item = &'a Mesh>) -> Mesh {
    let mut all = Mesh::default();
    for mesh in meshes {
        let first = all.positions.len() as u32;
        all.positions.extend(&mesh.positions);
        all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + first)));
    }
    all
}

/// The same mesh with every position changed.
pub fn mapped(mesh: &Mesh, change: impl Fn(Vec3) -> Vec3) -> Mesh {
    Mesh { positions: mesh.positions.iter().map(|&p| change(p)).collect(), ..mesh.clone() }
}

/// The unit sphere.
pub fn sphere(subdivisions: u32) -> Closed {
    Closed {
        name: "sphere".into(),
        mesh: shapes::sphere(subdivisions),
        core: vec![Vec3::ZERO],
        clearance: 0.7,
    }
}

/// The unit sphere in meridians and parallels: needles at its poles.
pub fn globe(parallels: usize, meridians: usize) -> Closed {
    use std::f32::consts::{PI, TAU};
    let point = |row: usize, column: usize| {
        // The poles and the first meridian must be the same bits wherever they are computed.
        let theta = if row == parallels { 0.0 } else { PI * row as f32 / parallels as f32 };
        let phi = TAU * (column % meridians) as f32 / meridians as f32;
        let y = if row == parallels { -1.0 } else { theta.cos() };
        Vec3::new(theta.sin() * phi.cos(), y, theta.sin() * phi.sin())
    };
    let mesh = patches(parallels, meridians, point);
    Closed { name: "globe".into(), mesh, core: vec![Vec3::ZERO], clearance: 0.7 }
}

/// The cube of half-width 1, its sides in `n` x `n` squares.
pub fn cube(n: usize) -> Closed {
    let mut sides = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            sides.push(patches(n, n, |i, j| {
                let mut p = [0.0; 3];
                p[axis] = side;
                p[(axis + 1) % 3] = 2.0 * i as f32 / n as f32 - 1.0;
                p[(axis + 2) % 3] = 2.0 * j as f32 / n as f32 - 1.0;
                Vec3::from_array(p)
            }));
        }
    }
    Closed { name: "cube".into(), mesh: joined(&sides), core: vec![Vec3::ZERO], clearance: 0.9 }
}

/// A ring of radius 1 whose cross-section, a rectangle with `2 n` points to a long side, makes
/// `half_turns` half turns on its way: for 1, a thick Möbius strip. No patch of it is flat.
pub fn twisted_ring(rings: usize, n: usize, half_turns: usize) -> Closed {
    use std::f32::consts::{PI, TAU};
    let (wide, thick) = (0.4, 0.15);
    // Half of the section's outline; the other half is its mirror image, point for point.
    let half = |i: usize| (wide * (1.0 - 2.0 * i as f32 / n as f32), thick * (1.0 - 0.1 * (i % 2) as f32));
    let outline = |i: usize| match (i / n) % 2 {
        0 => half(i % n),
        _ => (-half(i % n).0, -half(i % n).1),
    };
    let around = |ring: usize| TAU * ring as f32 / rings as f32;
    let point = |ring: usize, i: usize| {
        // The last ring is the first, with the outline turned.
        let (ring, i) = if ring == rings { (0, i + n * half_turns) } else { (ring, i) };
        let (x, y) = outline(i);
        let (sin, cos) = (PI * half_turns as f32 * ring as f32 / rings as f32).sin_cos();
        let (across, up) = (x * cos - y * sin, x * sin + y * cos);
        let radius = 1.0 + across;
        Vec3::new(radius * around(ring).cos(), up, radius * around(ring).sin())
    };
    Closed {
        name: "twisted ring".into(),
        mesh: patches(rings, 2 * n, point),
        core: (0..rings).map(|ring| Vec3::new(around(ring).cos(), 0.0, around(ring).sin())).collect(),
        clearance: 0.08,
    }
}

/// The square of half-width 1 in the plane y = 0, in `n` x `n` squares.
pub fn floor(n: usize) -> Mesh {
    patches(n, n, |i, j| Vec3::new(2.0 * i as f32 / n as f32 - 1.0, 0.0, 2.0 * j as f32 / n as f32 - 1.0))
}

/// `rows` x `columns` patches of two triangles, from the points of `(rows + 1)` x `(columns + 1)`.
pub fn patches(rows: usize, columns: usize, point: impl Fn(usize, usize) -> Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..=rows {
        mesh.positions.extend((0..=columns).map(|column| point(row, column)));
    }
    let at = |row: usize, column: usize| (row * (columns + 1) + column) as u32;
    for row in 0..rows {
        for column in 0..columns {
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    mesh
}
