//! Cornell boxes as the OBJ and MTL text that users' files have.
//!
//! The room is the one that Cornell University's Program of Computer Graphics measured ("The Cornell Box: Physical
//! Measurements", 1998: 55 units each way, a white floor, ceiling and back, red to the left, green to the right, a lamp in the
//! ceiling), straightened: its walls are at right angles, the lamp is in the middle. One unit is 100 mm.

#![allow(dead_code)] // Each suite uses a part of it.

use raypack::Vec3;
use raypack::mesh::Mesh;
use raypack::scene::Camera;
use std::f32::consts::PI;
use std::fmt::Write as _;
use std::fs;

/// The corner of the room that is opposite to the origin. The front is at `z = 0`, the left at the greatest `x`.
pub const ROOM: Vec3 = Vec3::new(5.56, 5.488, 5.592);

/// The lamp's least and greatest corner.
pub const LAMP: [Vec3; 2] = [Vec3::new(2.13, 5.488, 2.27), Vec3::new(3.43, 5.488, 3.32)];

pub const WHITE: Vec3 = Vec3::splat(0.75);
pub const RED: Vec3 = Vec3::new(0.6, 0.06, 0.05);
pub const GREEN: Vec3 = Vec3::new(0.12, 0.45, 0.1);

/// Materials for what stands in the room.
pub const MIRROR: &str = "illum 3\nKd 0 0 0\nKs 0.9 0.9 0.9\nNs 1000";
pub const PERFECT_MIRROR: &str = "illum 3\nKd 0 0 0\nKs 1 1 1\nNs 1000";
pub const GLASS: &str = "illum 7\nKd 0 0 0\nKs 1 1 1\nNi 1.5\nTf 1 1 1";
pub const WATER: &str = "illum 7\nKd 0 0 0\nKs 1 1 1\nNi 1.33\nTf 1 1 1";
pub const TINTED_WATER: &str = "illum 7\nKd 0 0 0\nKs 1 1 1\nNi 1.33\nTf 0.7 0.9 0.95";
pub const BLACK: &str = "illum 1\nKd 0 0 0";
pub const LIGHT: &str = "illum 1\nKd 0 0 0\nKe 1 1 1";

/// A model that is being written.
#[derive(Default)]
pub struct Model {
    obj: String,
    mtl: String,
    materials: usize,
    corners: usize,
    normals: usize,
}

/// A matt material, and what it gives off.
pub fn matt(color: Vec3, light: Vec3) -> String {
    let words = |v: Vec3| format!("{} {} {}", v.x, v.y, v.z);
    format!("illum 1\nKd {}\nKe {}", words(color), words(light))
}

/// The camera that the published pictures were taken with.
pub fn camera() -> Camera {
    let eye = Vec3::new(2.78, 2.73, -8.0);
    // A film of 25 mm behind a lens of 35 mm.
    let fov = 2.0 * (25.0f32 / 2.0 / 35.0).atan().to_degrees();
    Camera { fov, ..Camera::new(eye, Vec3::new(2.78, 2.73, 0.0)) }
}

impl Model {
    /// What follows has this material.
    pub fn material(&mut self, lines: &str) -> &mut Self {
        self.materials += 1;
        writeln!(self.mtl, "newmtl m{}\n{lines}", self.materials).expect("into a string");
        writeln!(self.obj, "usemtl m{}", self.materials).expect("into a string");
        self
    }

    /// A flat polygon.
    pub fn face(&mut self, corners: &[Vec3]) -> &mut Self {
        corners.iter().for_each(|v| writeln!(self.obj, "v {} {} {}", v.x, v.y, v.z).expect("into a string"));
        self.obj.push('f');
        (1..=corners.len()).for_each(|i| write!(self.obj, " {}", self.corners + i).expect("into a string"));
        self.obj.push('\n');
        self.corners += corners.len();
        self
    }

    /// A rectangle whose front is where `u x v` points.
    pub fn square(&mut self, at: Vec3, u: Vec3, v: Vec3) -> &mut Self {
        self.face(&[at, at + u, at + u + v, at + v])
    }

    /// A block with its fronts outside.
    pub fn block(&mut self, low: Vec3, high: Vec3) -> &mut Self {
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * (high - low));
        self.square(low, y, x).square(low, z, y).square(low, x, z);
        self.square(high, -x, -y).square(high, -y, -z).square(high, -z, -x)
    }

    /// A ball of so many rings of triangles, with the ball's own normals if it is `smooth`.
    pub fn ball(&mut self, center: Vec3, radius: f32, rings: usize, smooth: bool) -> &mut Self {
        let columns = 2 * rings;
        let (corner, normal) = (self.corners, self.normals);
        for ring in 0..=rings {
            let (sin, cos) = (PI * ring as f32 / rings as f32).sin_cos();
            for column in 0..columns {
                let (z, x) = (2.0 * PI * column as f32 / columns as f32).sin_cos();
                let n = Vec3::new(sin * x, cos, sin * z);
                let p = center + radius * n;
                writeln!(self.obj, "v {} {} {}\nvn {} {} {}", p.x, p.y, p.z, n.x, n.y, n.z)
                    .expect("into a string");
            }
        }
        let mut triangle = |places: [(usize, usize); 3]| {
            self.obj.push('f');
            for (ring, column) in places {
                let place = ring * columns + column % columns + 1;
                let words = if smooth {
                    format!(" {}//{}", corner + place, normal + place)
                } else {
                    format!(" {}", corner + place)
                };
                self.obj.push_str(&words);
            }
            self.obj.push('\n');
        };
        for ring in 0..rings {
            for column in 0..columns {
                let [a, b] = [(ring, column), (ring, column + 1)];
                let [c, d] = [(ring + 1, column), (ring + 1, column + 1)];
                if ring > 0 {
                    triangle([a, b, c]);
                }
                if ring + 1 < rings {
                    triangle([b, d, c]);
                }
            }
        }
        let count = (rings + 1) * columns;
        (self.corners, self.normals) = (corner + count, normal + count);
        self
    }

    /// The room, open at the front: the materials of what is white, of the left and right walls, and of the lamp.
    pub fn room(&mut self, [white, left, right, lamp]: [&str; 4]) -> &mut Self {
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * ROOM);
        self.material(white).square(Vec3::ZERO, z, x).square(z, y, x);
        // The ceiling goes round the lamp.
        let [low, high] = LAMP;
        let mut ceiling = |from: Vec3, to: Vec3| {
            self.square(from, Vec3::X * (to.x - from.x), Vec3::Z * (to.z - from.z));
        };
        ceiling(y, Vec3::new(ROOM.x, ROOM.y, low.z));
        ceiling(Vec3::new(0.0, ROOM.y, high.z), ROOM);
        ceiling(Vec3::new(0.0, ROOM.y, low.z), Vec3::new(low.x, ROOM.y, high.z));
        ceiling(Vec3::new(high.x, ROOM.y, low.z), Vec3::new(ROOM.x, ROOM.y, high.z));
        self.material(left).square(x, z, y);
        self.material(right).square(Vec3::ZERO, y, z);
        self.material(lamp).square(low, Vec3::X * (high.x - low.x), Vec3::Z * (high.z - low.z))
    }

    /// A wall at the front.
    pub fn front(&mut self, material: &str) -> &mut Self {
        self.material(material).square(Vec3::ZERO, Vec3::X * ROOM, Vec3::Y * ROOM)
    }

    /// What a reader makes of the text.
    pub fn mesh(&self) -> Mesh {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("box.obj");
        fs::write(&path, format!("mtllib box.mtl\n{}", self.obj)).expect("written");
        fs::write(path.with_extension("mtl"), &self.mtl).expect("written");
        let mesh = raypack::mesh::read(&path).expect("sound text").mesh;
        assert!(!mesh.triangles.is_empty());
        mesh
    }
}

/// The room as it was painted, with a lamp of that radiance.
pub fn painted(lamp: f32) -> Model {
    let [white, left, right] = [WHITE, RED, GREEN].map(|color| matt(color, Vec3::ZERO));
    let lamp = matt(Vec3::splat(0.78), Vec3::splat(lamp));
    let mut model = Model::default();
    model.room([&white, &left, &right, &lamp]);
    model
}
