//! What double precision is sure of: enough to answer for nearly every ray and triangle.
//!
//! Error bounds are Shewchuk's ("Adaptive Precision Floating-Point Arithmetic and Fast Robust
//! Geometric Predicates", 1997): an expression is computed a second time with every difference
//! turned into a sum of magnitudes, and no rounding can have moved the first by more than a
//! multiple of the second. Nothing overflows or underflows on the way: floats are whole multiples
//! of 2^-149 below 2^128, and no product here has more than four of them.

use crate::geometry::{Aabb, Ray};
use glam::Vec3;

/// A bound of what rounding makes of a triple product of differences of floats, relative to the
/// sum of its terms' magnitudes.
///
/// A term goes through at most 8 roundings of 2^-53 (three differences, two products, a
/// difference and two sums), and so does the sum of magnitudes; the rest is margin.
const TRIPLE: f64 = 1.0 / (1u64 << 49) as f64;

/// A bound of the relative error of a few roundings in a row: up to 7 of 2^-53.
const FEW: f64 = 1.0 / (1u64 << 50) as f64;

/// Where reals begin that no float can name: halfway between the greatest float and 2^128, which
/// rounds to infinity.
const UNNAMED: f64 = f32::MAX as f64 + (1u128 << 103) as f64;

/// A ray whose answer is not a miss from the start.
pub(super) struct Probe {
    origin: [f64; 3],
    direction: [f64; 3],
    inverse: [f64; 3],
    /// Least `t` that counts.
    pub tnear: f64,
    /// Greatest `t` that counts, and that a float can name.
    pub tfar: f64,
}

/// What double precision says of a ray and a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// They do not meet.
    Miss,
    /// They meet, at a `t` between these.
    Hit(f64, f64),
    /// It cannot say.
    Unsure,
}

/// A number and how far the real one may lie from it.
#[derive(Clone, Copy)]
struct Bounded {
    value: f64,
    error: f64,
}

impl Bounded {
    /// 1, -1, or 0 for exactly zero; `None` if unknown.
    fn sign(self) -> Option<i32> {
        if self.value.abs() > self.error {
            Some(if self.value > 0.0 { 1 } else { -1 })
        } else {
            // With no magnitudes at all, every term is exactly zero.
            (self.error == 0.0).then_some(0)
        }
    }
}

impl Probe {
    /// `None` for a ray that hits nothing, whatever the scene: one with a NaN, an infinite origin or
    /// direction, a zero direction or an empty interval.
    pub fn new(ray: &Ray) -> Option<Self> {
        let sound = ray.origin.is_finite()
            && ray.direction.is_finite()
            && ray.direction != Vec3::ZERO
            && ray.tnear <= ray.tfar
            && ray.tnear < f32::INFINITY
            && ray.tfar > f32::NEG_INFINITY;
        sound.then(|| {
            let direction = double(ray.direction);
            Self {
                origin: double(ray.origin),
                direction,
                inverse: direction.map(f64::recip),
                tnear: f64::from(ray.tnear),
                tfar: f64::from(ray.tfar).min(UNNAMED.next_down()),
            }
        })
    }

    /// Where the ray enters a box, or less; `None` if it passes it for certain, or enters it beyond
    /// `reach` for certain.
    pub fn enters(&self, bounds: &Aabb, reach: f64) -> Option<f64> {
        let (mut enter, mut leave) = (self.tnear, self.tfar.min(reach));
        for axis in 0..3 {
            let (low, high) = (f64::from(bounds.min[axis]), f64::from(bounds.max[axis]));
            let origin = self.origin[axis];
            if self.direction[axis] == 0.0 {
                if origin < low || origin > high {
                    return None;
                }
                continue;
            }
            let t0 = (low - origin) * self.inverse[axis];
            let t1 = (high - origin) * self.inverse[axis];
            let (first, last) = if t0 <= t1 { (t0, t1) } else { (t1, t0) };
            enter = enter.max(first - first.abs() * FEW);
            leave = leave.min(last + last.abs() * FEW);
        }
        (enter <= leave).then_some(enter)
    }

    /// The triangle test. Corners must be finite.
    pub fn meets(&self, corners: &[Vec3; 3]) -> Verdict {
        let corners = corners.map(double);
        let [a, b, c] = corners.map(|corner| minus(corner, self.origin));

        // Inside, if the weights are all of one sign, zeros allowed.
        let signs = [(b, c), (c, a), (a, b)].map(|(p, q)| triple(self.direction, p, q).sign());
        if signs.contains(&Some(1)) && signs.contains(&Some(-1)) {
            return Verdict::Miss;
        }
        let [Some(x), Some(y), Some(z)] = signs else { return Verdict::Unsure };
        if (x, y, z) == (0, 0, 0) {
            return Verdict::Miss; // Edge-on: the weights' sum is zero.
        }

        // Where it meets the plane.
        let (e1, e2) = (minus(corners[1], corners[0]), minus(corners[2], corners[0]));
        let (above, below) = (triple(a, e1, e2), triple(self.direction, e1, e2));
        let least = below.value.abs() - below.error;
        if least <= 0.0 {
            return Verdict::Unsure;
        }
        let t = above.value / below.value;
        let error = (above.error + t.abs() * below.error) / least;
        // The roundings of the quotient, of this bound and of the sums below.
        let error = error * (1.0 + 2.0 * FEW) + t.abs() * FEW;
        let (low, high) = (t - error, t + error);
        if low > self.tfar || high < self.tnear {
            Verdict::Miss
        } else if low >= self.tnear && high <= self.tfar {
            Verdict::Hit(low, high)
        } else {
            Verdict::Unsure
        }
    }
}

/// `p . (q x r)`, each component of which may have gone through one rounding.
fn triple(p: [f64; 3], q: [f64; 3], r: [f64; 3]) -> Bounded {
    let (mut value, mut magnitude) = (0.0, 0.0);
    for [i, j, k] in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
        let (one, other) = (q[j] * r[k], q[k] * r[j]);
        value += p[i] * (one - other);
        magnitude += p[i].abs() * (one.abs() + other.abs());
    }
    Bounded { value, error: magnitude * TRIPLE }
}

fn double(v: Vec3) -> [f64; 3] {
    v.to_array().map(f64::from)
}

fn minus(p: [f64; 3], q: [f64; 3]) -> [f64; 3] {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}
