//! One ray against one triangle in whole numbers.
//!
//! Every finite `f32` is a whole multiple of 2^-149, so in that unit a ray and a triangle are made
//! of integers, and sums and products of integers are exact. What has to be divided (`t` and the
//! weights) stays a fraction until somebody asks for it rounded, and then it is rounded once.

use crate::geometry::Ray;
use dashu_int::IBig;
use dashu_ratio::Relaxed;
use glam::Vec3;
use std::cmp::Ordering;

/// Where exactly a ray meets a triangle.
///
/// Ordered by `t` alone: two triangles met at the same real `t` compare equal.
#[derive(Clone, Debug)]
pub struct Meeting {
    t: Relaxed,
    u: Relaxed,
    v: Relaxed,
}

impl Meeting {
    /// The ray's parameter, rounded to the nearest float, ties to even.
    pub fn t(&self) -> f32 {
        // Fractions have no negative zero, but their rounding has.
        self.t.to_f32().value() + 0.0
    }

    /// The ray's parameter, rounded to the nearest double.
    pub fn t_f64(&self) -> f64 {
        self.t.to_f64().value() + 0.0
    }

    /// Barycentric weight of the second corner, rounded to the nearest double.
    pub fn u(&self) -> f64 {
        self.u.to_f64().value()
    }

    /// Barycentric weight of the third corner, rounded to the nearest double.
    pub fn v(&self) -> f64 {
        self.v.to_f64().value()
    }
}

impl Ord for Meeting {
    fn cmp(&self, other: &Self) -> Ordering {
        self.t.cmp(&other.t)
    }
}

impl PartialOrd for Meeting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Meeting {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Meeting {}

/// Where the ray meets the closed triangle within its closed interval. Ray and corners must be
/// finite, and one end of the interval
/// below and the other above infinity; see [`super`] for what counts as a hit.
pub(super) fn meet(ray: &Ray, corners: &[Vec3; 3]) -> Option<Meeting> {
    let origin = whole(ray.origin);
    let direction = whole(ray.direction);
    let [a, b, c] = corners.map(|corner| minus(&whole(corner), &origin));

    // The signed volumes that the ray's line spans with each edge, seen from its origin: each is
    // the weight of the corner that its edge does not touch, and their sum is `direction . normal`.
    let weights =
        [dot(&direction, &cross(&b, &c)), dot(&direction, &cross(&c, &a)), dot(&direction, &cross(&a, &b))];
    let zero = IBig::ZERO;
    if weights.iter().any(|w| *w < zero) && weights.iter().any(|w| *w > zero) {
        return None;
    }
    let [of_a, of_b, of_c] = weights;
    let sum = &of_a + &of_b + &of_c;
    if sum == zero {
        return None; // Edge-on, or without area.
    }

    let normal = cross(&minus(&b, &a), &minus(&c, &a));
    let fraction = |numerator: IBig| Relaxed::from_parts_signed(numerator, sum.clone());
    let t = fraction(dot(&normal, &a));
    let after_start = ray.tnear == f32::NEG_INFINITY || t >= rational(ray.tnear);
    let before_end =
        if ray.tfar == f32::INFINITY { t.to_f32().value() < f32::INFINITY } else { t <= rational(ray.tfar) };
    (after_start && before_end).then(|| Meeting { t, u: fraction(of_b), v: fraction(of_c) })
}

/// A finite point or vector in units of 2^-149.
fn whole(v: Vec3) -> [IBig; 3] {
    // Scaling by a power of two is exact in a double, whose exponents reach far beyond a float's.
    let unit = 149f64.exp2();
    v.to_array().map(|x| IBig::try_from(f64::from(x) * unit).expect("a finite float is whole in this unit"))
}

fn rational(x: f32) -> Relaxed {
    Relaxed::try_from(x).expect("a finite float is a fraction")
}

fn minus([ax, ay, az]: &[IBig; 3], [bx, by, bz]: &[IBig; 3]) -> [IBig; 3] {
    [ax - bx, ay - by, az - bz]
}

fn cross([ax, ay, az]: &[IBig; 3], [bx, by, bz]: &[IBig; 3]) -> [IBig; 3] {
    [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
}

fn dot([ax, ay, az]: &[IBig; 3], [bx, by, bz]: &[IBig; 3]) -> IBig {
    ax * bx + ay * by + az * bz
}
