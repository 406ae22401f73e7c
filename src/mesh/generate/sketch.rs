//! Drawing with solids: boxes, tubes and surfaces of revolution that become a part of a model.

use super::part::Part;
use glam::{DVec2, Vec2, Vec3};

/// A part of a model under construction, one material at a time.
///
/// Everything drawn is moved by `origin` and coloured with `paint`. All solids face outwards.
#[derive(Debug, Default)]
pub(super) struct Sketch {
    pub origin: Vec3,
    /// The material of what is drawn next.
    pub paint: u32,
    /// Factor on the number of sides of everything round.
    pub quality: f32,
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    of_triangle: Vec<u32>,
}

impl Sketch {
    /// An empty sketch.
    pub fn new(quality: f32) -> Self {
        Self { quality, ..Default::default() }
    }

    /// How many triangles there are.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Forgets what was drawn, and keeps its memory for what comes next.
    pub fn clear(&mut self) {
        self.positions.clear();
        self.triangles.clear();
        self.of_triangle.clear();
    }

    /// What was drawn.
    pub fn part(&self) -> Part<'_> {
        Part { positions: &self.positions, triangles: &self.triangles, of_triangle: &self.of_triangle }
    }

    /// How many sides something round of this radius gets: more the larger it is.
    pub fn sides(&self, radius: f32) -> usize {
        ((22.0 * self.quality * radius.sqrt()) as usize).clamp(4, 256)
    }

    fn vertex(&mut self, point: Vec3) -> u32 {
        self.positions.push(self.origin + point);
        (self.positions.len() - 1) as u32
    }

    fn triangle(&mut self, a: u32, b: u32, c: u32) {
        self.triangles.push([a, b, c]);
        self.of_triangle.push(self.paint);
    }

    fn quad(&mut self, a: u32, b: u32, c: u32, d: u32) {
        self.triangle(a, b, c);
        self.triangle(a, c, d);
    }

    /// An axis-aligned box between two opposite corners.
    pub fn cuboid(&mut self, min: Vec3, max: Vec3) {
        let (center, half) = ((min + max) * 0.5, (max - min) * 0.5);
        self.block(center, [Vec3::X * half.x, Vec3::Y * half.y, Vec3::Z * half.z]);
    }

    /// A box from `a` to `b`, so wide across and so high along `up`.
    pub fn bar(&mut self, a: Vec3, b: Vec3, width: f32, height: f32, up: Vec3) {
        let along = (b - a) * 0.5;
        let across = up.cross(along).normalize();
        let up = along.cross(across).normalize();
        self.block((a + b) * 0.5, [across * (width * 0.5), up * (height * 0.5), along]);
    }

    /// The box around `center` with these half edges, which are right-handed.
    fn block(&mut self, center: Vec3, [x, y, z]: [Vec3; 3]) {
        let corner = |i: usize| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            center + x * sign(0) + y * sign(1) + z * sign(2)
        };
        let v: [u32; 8] = std::array::from_fn(|i| self.vertex(corner(i)));
        for [a, b, c, d] in
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        {
            self.quad(v[a], v[b], v[c], v[d]);
        }
    }

    /// A ring of vertices around `center`, in the plane of `u` and `v`; one vertex if `radius` is 0.
    fn ring(&mut self, center: Vec3, u: Vec3, v: Vec3, radius: f32, sides: usize) -> Vec<u32> {
        if radius == 0.0 {
            return vec![self.vertex(center)];
        }
        let around = |i: usize| {
            let d = direction(i as f64 / sides as f64) * radius;
            center + u * d.x + v * d.y
        };
        (0..sides).map(|i| self.vertex(around(i))).collect()
    }

    /// The surface between two rings, or a ring and a tip.
    fn band(&mut self, low: &[u32], high: &[u32]) {
        let sides = low.len().max(high.len());
        for i in 0..sides {
            let j = (i + 1) % sides;
            match (low.len(), high.len()) {
                (1, 1) => {}
                (1, _) => self.triangle(low[0], high[j], high[i]),
                (_, 1) => self.triangle(low[i], low[j], high[0]),
                _ => self.quad(low[i], low[j], high[j], high[i]),
            }
        }
    }

    /// Turns a profile of (radius, height) around an axis through `base`. Seen with the axis
    /// upwards, the outside is to the right of someone who walks along the profile.
    pub fn revolve(&mut self, base: Vec3, axis: Vec3, profile: &[Vec2]) {
        let widest = profile.iter().fold(0.0_f32, |r, p| r.max(p.x));
        let sides = self.sides(widest);
        let u = axis.any_orthonormal_vector();
        let v = axis.cross(u);
        let mut last: Option<Vec<u32>> = None;
        for p in profile {
            let ring = self.ring(base + axis * p.y, u, v, p.x, sides);
            if let Some(last) = last {
                self.band(&last, &ring);
            }
            last = Some(ring);
        }
    }

    /// A closed cylinder from `a` to `b`.
    pub fn cylinder(&mut self, a: Vec3, b: Vec3, radius: f32) {
        let length = (b - a).length();
        let profile = [(0.0, 0.0), (radius, 0.0), (radius, length), (0.0, length)];
        self.revolve(a, (b - a) / length, &profile.map(Vec2::from));
    }

    /// A closed tube along a path of at least two different points, whose bends should be gentle.
    pub fn tube(&mut self, path: &[Vec3], radius: f32) {
        let sides = self.sides(radius);
        let tangent =
            |i: usize| (path[(i + 1).min(path.len() - 1)] - path[i.saturating_sub(1)]).normalize_or(Vec3::Y);
        let mut u = tangent(0).any_orthonormal_vector();
        let start = self.vertex(path[0]);
        let mut last = vec![start];
        for (i, &point) in path.iter().enumerate() {
            // Carrying `u` along, instead of choosing it anew, keeps the tube from twisting.
            let t = tangent(i);
            u = (u - t * u.dot(t)).normalize_or(t.any_orthonormal_vector());
            let ring = self.ring(point, u, t.cross(u), radius, sides);
            self.band(&last, &ring);
            last = ring;
        }
        let end = self.vertex(path[path.len() - 1]);
        self.band(&last, &[end]);
    }

    /// A tube bent to a circle around `center` in the horizontal plane, or upright across `axis`.
    pub fn hoop(&mut self, center: Vec3, axis: Vec3, radius: f32, thickness: f32) {
        let u = axis.any_orthonormal_vector();
        let v = axis.cross(u);
        let (sides, steps) = (self.sides(thickness), self.sides(radius).max(8));
        let rings: Vec<Vec<u32>> = (0..steps)
            .map(|i| {
                let d = direction(i as f64 / steps as f64);
                let out = u * d.x + v * d.y;
                self.ring(center + out * radius, axis, out, thickness, sides)
            })
            .collect();
        for i in 0..steps {
            self.band(&rings[i], &rings[(i + 1) % steps]);
        }
    }
}

/// The unit vector at a fraction of a full turn, the same on every machine: libraries' sines differ
/// in their last bits, additions and multiplications do not.
pub(super) fn direction(turn: f64) -> Vec2 {
    let quarters = (turn * 4.0).round();
    let x = (turn * 4.0 - quarters) * std::f64::consts::FRAC_PI_2; // within an eighth of a turn
    let q = x * x;
    let sin =
        x * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0)))));
    let cos = 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0))));
    let d = match (quarters as i64).rem_euclid(4) {
        0 => DVec2::new(cos, sin),
        1 => DVec2::new(-sin, cos),
        2 => DVec2::new(-cos, -sin),
        _ => DVec2::new(sin, -cos),
    };
    d.as_vec2()
}

/// A path whose corners are rounded: each corner becomes an arc that leaves the legs up to
/// `bend` before it.
pub(super) fn rounded(corners: &[Vec3], bend: f32, steps: usize) -> Vec<Vec3> {
    let [first, .., last] = corners else { return corners.to_vec() };
    let mut path = vec![*first];
    for w in corners.windows(3) {
        let (before, after) = (w[0] - w[1], w[2] - w[1]);
        let cut = bend.min(before.length() * 0.5).min(after.length() * 0.5);
        let (a, b) = (w[1] + before.normalize() * cut, w[1] + after.normalize() * cut);
        for i in 0..=steps {
            let t = i as f32 / steps as f32;
            // A quadratic Bézier curve: near enough to an arc.
            path.push(a.lerp(w[1], t).lerp(w[1].lerp(b, t), t));
        }
    }
    path.push(*last);
    // Where legs are no longer than two bends, arcs meet in one point.
    path.dedup_by(|b, a| a.distance_squared(*b) < 1e-10);
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(draw: impl FnOnce(&mut Sketch)) -> f64 {
        let mut sketch = Sketch::new(4.0);
        draw(&mut sketch);
        let part = sketch.part();
        let corner = |i: u32| part.positions[i as usize].as_dvec3();
        let six: f64 = part.triangles.iter().map(|t| t.map(corner)).map(|[a, b, c]| a.dot(b.cross(c))).sum();
        six / 6.0
    }

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 0.02 * b.abs(), "{a} should be about {b}");
    }

    #[test]
    fn solids_face_outwards_and_are_closed() {
        use std::f64::consts::PI;
        close(volume(|s| s.cuboid(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0))), 6.0);
        close(volume(|s| s.bar(Vec3::ZERO, Vec3::new(3.0, 4.0, 0.0), 2.0, 0.5, Vec3::Y)), 5.0);
        close(volume(|s| s.cylinder(Vec3::X, Vec3::X * 3.0, 1.0)), 2.0 * PI);
        close(volume(|s| s.tube(&[Vec3::ZERO, Vec3::Z, Vec3::Z * 5.0], 1.0)), 5.0 * PI);
        close(volume(|s| s.hoop(Vec3::ONE, Vec3::Y, 3.0, 0.5)), 2.0 * PI * PI * 3.0 * 0.25);
    }

    #[test]
    fn directions_agree_with_the_library() {
        for i in -40..80 {
            let turn = f64::from(i) / 37.0;
            let (sin, cos) = (turn * std::f64::consts::TAU).sin_cos();
            assert!((direction(turn) - DVec2::new(cos, sin).as_vec2()).length() < 2e-7, "{turn}");
        }
        assert_eq!(direction(0.25), Vec2::Y);
    }

    #[test]
    fn rounding_keeps_ends_and_cuts_corners() {
        let corner = Vec3::new(4.0, 0.0, 0.0);
        let path = rounded(&[Vec3::ZERO, corner, Vec3::new(4.0, 4.0, 0.0)], 1.0, 4);
        assert_eq!((path[0], *path.last().unwrap()), (Vec3::ZERO, Vec3::new(4.0, 4.0, 0.0)));
        assert!(path.iter().all(|p| p.distance(corner) > 0.3));
        let straight = [Vec3::ZERO, Vec3::X];
        assert_eq!(rounded(&straight, 1.0, 4), straight);
    }
}
