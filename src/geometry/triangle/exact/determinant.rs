//! Two determinants of floats, with values good to some 30 bits and signs that are always right.
//!
//! Each is computed in double precision with a bound of its error (in the manner of Shewchuk,
//! "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates", 1997).
//! Where the error could reach the thirtieth bit, the determinant is multiplied out: as long as all
//! numbers are floats, a product of two of them is exact in double precision, and the sum of the
//! products with a third is computed exactly, as an expansion.
//!
//! **Range.** Products of three floats lie between 2^-447 and 2^384: nothing here can overflow or
//! underflow.

use geometry_predicates::predicates::{fast_expansion_sum_zeroelim, two_product};
use glam::DVec3;
use glam::swizzles::Vec3Swizzles;

/// Relative error that a value may have.
const GOOD: f64 = 1.0 / (1u64 << 30) as f64;

/// Error of a determinant computed in double precision, relative to the sum of the magnitudes of
/// its products. Eight roundings of 2^-53 are made on the way to each product.
const ROUNDING: f64 = 1.0 / (1u64 << 49) as f64;

/// A number whose sign is right, and its value to some 30 bits.
#[derive(Clone, Copy, Debug)]
pub struct Certain(f64);

impl Certain {
    /// -1, 0 or 1.
    #[inline]
    pub fn sign(self) -> i32 {
        i32::from(self.0 > 0.0) - i32::from(self.0 < 0.0)
    }

    /// The value.
    #[inline]
    pub fn value(self) -> f64 {
        self.0
    }
}

/// `d . ((p - o) x (q - o))`: the volume (six times the tetrahedron's) that a ray's direction and
/// an edge span.
#[inline]
pub fn volume(d: DVec3, p: DVec3, q: DVec3, o: DVec3) -> Certain {
    // (p - o) x (q - o) = (p - o) x (q - p): with a short edge, less cancels.
    let (value, size) = triple(d, p - o, q - p);
    if value.abs() * GOOD > size * ROUNDING {
        return Certain(value);
    }
    exact_volume(d, p, q, o)
}

/// `(p0 - o) . ((p1 - p0) x (p2 - p0))`: how far the origin is from a triangle's plane, in lengths
/// of its normal.
#[inline]
pub fn along_normal(p0: DVec3, p1: DVec3, p2: DVec3, o: DVec3) -> Certain {
    let (value, size) = triple(p0 - o, p1 - p0, p2 - p0);
    if value.abs() * GOOD > size * ROUNDING {
        return Certain(value);
    }
    exact_along_normal(p0, p1, p2, o)
}

/// `a . (b x c)`, and the same with all signs made positive.
#[inline]
fn triple(a: DVec3, b: DVec3, c: DVec3) -> (f64, f64) {
    let (left, right) = (b.yzx() * c.zxy(), b.zxy() * c.yzx());
    (a.dot(left - right), a.abs().dot(left.abs() + right.abs()))
}

#[cold]
#[inline(never)]
fn exact_volume(d: DVec3, p: DVec3, q: DVec3, o: DVec3) -> Certain {
    let mut sum = Expansion::new();
    sum.add_triple(d, p, q);
    sum.add_triple(d, o, p);
    sum.add_triple(d, q, o);
    sum.finish()
}

#[cold]
#[inline(never)]
fn exact_along_normal(p0: DVec3, p1: DVec3, p2: DVec3, o: DVec3) -> Certain {
    let mut sum = Expansion::new();
    sum.add_triple(p0, p1, p2);
    sum.add_triple(-o, p1, p2);
    sum.add_triple(-o, p0, p1);
    sum.add_triple(-o, p2, p0);
    sum.finish()
}

/// Four determinants of six products of two components each.
const MOST: usize = 4 * 6 * 2;

/// A sum without rounding: numbers of growing magnitude that do not overlap.
struct Expansion {
    components: [f64; MOST],
    len: usize,
}

impl Expansion {
    fn new() -> Self {
        Self { components: [0.0; MOST], len: 1 }
    }

    /// Adds `a . (b x c)`.
    fn add_triple(&mut self, a: DVec3, b: DVec3, c: DVec3) {
        for axis in 0..3 {
            let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
            self.add_product(a[axis], b[j] * c[k]);
            self.add_product(-a[axis], b[k] * c[j]);
        }
    }

    /// Adds `x * y`.
    fn add_product(&mut self, x: f64, y: f64) {
        // The rounding error first, then the rounded product: an expansion itself.
        let product = two_product(x, y);
        let mut sum = [0.0; MOST];
        self.len = fast_expansion_sum_zeroelim(&self.components[..self.len], &product, &mut sum);
        self.components = sum;
    }

    /// Its value: the components overlap nowhere, so the greatest has the sign.
    fn finish(self) -> Certain {
        let components = &self.components[..self.len];
        debug_assert!(components.windows(2).all(|pair| pair[0].abs() < pair[1].abs()));
        Certain(components.iter().sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weyl::uniform;

    fn point(x: f32, y: f32, z: f32) -> DVec3 {
        DVec3::new(x.into(), y.into(), z.into())
    }

    #[test]
    fn a_volume_of_nothing_is_nothing() {
        // Four points of a plane through no simple place, with coordinates that need every bit.
        let along = |a: f32, b: f32| point(a * 0.1, b * 0.3, a * 0.1 + b * 0.3);
        let (d, p, q) = (along(1.0, 1.0), along(3.0, -1.0), along(-2.0, 7.0));
        // In floats the third coordinate is not always the sum: see what integers say.
        let integer = |v: DVec3| [v.x, v.y, v.z].map(|c| (c * f64::from(1 << 30)) as i128);
        for o in [along(0.5, 0.25), along(0.0, 0.0), along(-4.0, 2.0)] {
            let [d3, p3, q3, o3] = [d, p, q, o].map(integer);
            let sub = |a: [i128; 3], b: [i128; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
            let (a, b) = (sub(p3, o3), sub(q3, o3));
            let expected = d3[0] * (a[1] * b[2] - a[2] * b[1])
                + d3[1] * (a[2] * b[0] - a[0] * b[2])
                + d3[2] * (a[0] * b[1] - a[1] * b[0]);
            assert_eq!(i128::from(volume(d, p, q, o).sign()), expected.signum());
        }
    }

    #[test]
    fn nothing_is_left_of_a_ray_in_the_plane() {
        // The products are multiplied out about the coordinates' origin, so they have to cancel.
        let mut number = uniform(-4.0, 4.0);
        for _ in 0..20_000 {
            let y = number();
            let mut p = |y| point(number(), y, number());
            let (d, o, a, b, c) = (p(0.0), p(y), p(y), p(y), p(y));
            for (p, q) in [(a, b), (b, c), (c, a)] {
                assert_eq!(volume(d, p, q, o).value(), 0.0);
            }
            assert_eq!(along_normal(a, b, c, o).value(), 0.0);
        }
    }

    #[test]
    fn the_exact_forms_agree_with_the_quick_ones() {
        let mut number = uniform(-4.0, 4.0);
        for _ in 0..1000 {
            let mut p = || point(number(), number(), number());
            let (a, b, c, o) = (p(), p(), p(), p());
            let exact = [exact_volume(a, b, c, o), exact_along_normal(a, b, c, o)].map(Certain::value);
            let quick = [triple(a, b - o, c - b).0, triple(a - o, b - a, c - a).0];
            for (exact, quick) in exact.into_iter().zip(quick) {
                assert!((exact - quick).abs() < 1e-12, "{exact} {quick}");
            }
        }
    }

    #[test]
    fn the_ends_of_the_range_neither_overflow_nor_vanish() {
        for size in [f32::MAX, f32::from_bits(1)] {
            let (x, y, z) = (point(size, 0.0, 0.0), point(0.0, size, 0.0), point(0.0, 0.0, size));
            let expected = f64::from(size).powi(3);
            assert_eq!(exact_volume(x, y, z, DVec3::ZERO).value(), expected);
            assert_eq!(volume(x, y, z, -x).sign(), 1);
            assert_eq!(volume(x, z, y, -x).sign(), -1);
        }
    }
}
