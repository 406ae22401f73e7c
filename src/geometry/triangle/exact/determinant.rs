//! Two determinants of floats, with values good to some 30 bits and signs that are always right.
//!
//! Each is computed in double precision with a bound of its error (in the manner of Shewchuk,
//! "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates", 1997).
//! Where the error could reach the thirtieth bit, it is computed without any, in one of two ways. Floats of about one
//! magnitude are multiples of one unit by numbers of not many bits, and so integers do. Otherwise the
//! determinant is multiplied out: as long as all numbers are floats, a product of two of them is exact in double
//! precision, and the sum of the products with a third is computed exactly, as an expansion, which takes some
//! ten times as long.
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
    let whole = || {
        let (along, places) = (Units::of(&[d]), Units::of(&[p, q, o]));
        let [d, p, q, o] = [along.whole(d)?, places.whole(p)?, places.whole(q)?, places.whole(o)?];
        Some(whole_triple(d, less(p, o), less(q, o)) * (along.unit * places.unit * places.unit))
    };
    whole().map_or_else(|| expanded_volume(d, p, q, o), Certain)
}

#[cold]
#[inline(never)]
fn exact_along_normal(p0: DVec3, p1: DVec3, p2: DVec3, o: DVec3) -> Certain {
    let whole = || {
        let places = Units::of(&[p0, p1, p2, o]);
        let [p0, p1, p2, o] = [places.whole(p0)?, places.whole(p1)?, places.whole(p2)?, places.whole(o)?];
        let volume = whole_triple(less(p0, o), less(p1, p0), less(p2, p0));
        Some(volume * (places.unit * places.unit * places.unit))
    };
    whole().map_or_else(|| expanded_along_normal(p0, p1, p2, o), Certain)
}

/// Floats as multiples of a power of two by whole numbers of less than `2^BITS`.
struct Units {
    unit: f64,
    per_unit: f64,
}

/// Differences of such numbers and products of two differences have places in 64 and 128 bits.
const BITS: u64 = 60;

impl Units {
    /// The least unit that the greatest coordinate does with.
    #[inline]
    fn of(vectors: &[DVec3]) -> Self {
        let least = f64::from(f32::from_bits(1));
        let greatest = vectors.iter().fold(least, |greatest, v| greatest.max(v.abs().max_element()));
        // A number of 2^e and more, and less than twice that, where e has a bias of 1023.
        let exponent = greatest.to_bits() >> 52;
        let power = |exponent: u64| f64::from_bits(exponent << 52);
        Self { unit: power(exponent + 1 - BITS), per_unit: power(2 * 1023 + BITS - 1 - exponent) }
    }

    /// A vector in units, if it is a multiple of them.
    #[inline]
    fn whole(&self, v: DVec3) -> Option<[i64; 3]> {
        let scaled = v * self.per_unit;
        let whole = scaled.as_i64vec3();
        (whole.as_dvec3() == scaled).then_some(whole.to_array())
    }
}

#[inline]
fn less(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a . (b x c)` of numbers of up to 61 bits, computed in 192 bits and then rounded.
#[inline]
fn whole_triple(a: [i64; 3], b: [i64; 3], c: [i64; 3]) -> f64 {
    let product = |x: i64, y: i64| i128::from(x) * i128::from(y);
    // `2^64 high + low`.
    let (mut high, mut low) = (0, 0);
    for axis in 0..3 {
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let area = product(b[j], c[k]) - product(b[k], c[j]);
        high += product(a[axis], (area >> 64) as i64);
        low += i128::from(a[axis]) * i128::from(area as u64);
    }
    // What is carried, and no halves of different signs: they would cancel.
    high += low >> 64;
    let mut low = low as u64;
    let is_negative = high < 0;
    if is_negative {
        high = !high + i128::from(low == 0);
        low = low.wrapping_neg();
    }
    const HALF: f64 = (1u128 << 64) as f64;
    let magnitude = high as f64 * HALF + low as f64;
    if is_negative { -magnitude } else { magnitude }
}

#[cold]
#[inline(never)]
fn expanded_volume(d: DVec3, p: DVec3, q: DVec3, o: DVec3) -> Certain {
    let mut sum = Expansion::new();
    sum.add_triple(d, p, q);
    sum.add_triple(d, o, p);
    sum.add_triple(d, q, o);
    sum.finish()
}

#[cold]
#[inline(never)]
fn expanded_along_normal(p0: DVec3, p1: DVec3, p2: DVec3, o: DVec3) -> Certain {
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
            let expanded =
                [expanded_volume(a, b, c, o), expanded_along_normal(a, b, c, o)].map(Certain::value);
            let quick = [triple(a, b - o, c - b).0, triple(a - o, b - a, c - a).0];
            for ((exact, expanded), quick) in exact.into_iter().zip(expanded).zip(quick) {
                assert!((exact - quick).abs() < 1e-12, "{exact} {quick}");
                // Sums of components are rounded once or twice.
                assert!((exact - expanded).abs() <= 1e-15 * expanded.abs(), "{exact} {expanded}");
            }
        }
    }

    #[test]
    fn integers_answer_as_expansions_do_or_not_at_all() {
        let mut number = uniform(-1.0, 1.0);
        let mut answered = [0, 0];
        for round in 0..40_000 {
            // From coordinates that share few bits to such that share all; points near one plane, and in it.
            let spread = (round % 8) * 9;
            let mut coordinate = |flat: bool| {
                let scale = 2f32.powi((number() * spread as f32) as i32);
                if flat { 0.3 } else { number() * scale }
            };
            let mut p = || point(coordinate(false), coordinate(round % 3 == 0), coordinate(false));
            let (d, a, b, c, o) = (p(), p(), p(), p(), p());
            for (exact, expanded) in [
                (exact_volume(d, a, b, o), expanded_volume(d, a, b, o)),
                (exact_along_normal(a, b, c, o), expanded_along_normal(a, b, c, o)),
                // A ray along an edge, and a triangle without area.
                (exact_volume(b - a, a, b, a), expanded_volume(b - a, a, b, a)),
                (exact_along_normal(a, b, b, o), expanded_along_normal(a, b, b, o)),
            ] {
                assert_eq!(exact.sign(), expanded.sign());
                let (exact, expanded) = (exact.value(), expanded.value());
                assert!((exact - expanded).abs() <= 1e-15 * expanded.abs(), "{exact} {expanded}");
            }
            answered[usize::from(Units::of(&[a, b, o]).whole(a).is_some())] += 1;
        }
        assert!(answered.iter().all(|&count| count > 1000), "{answered:?}");
        // The least that there are, and the greatest.
        let unit = |axis: usize, length: i64| std::array::from_fn(|i| if i == axis { length } else { 0 });
        assert_eq!([1, -1].map(|z| whole_triple(unit(0, 1), unit(1, 1), unit(2, z))), [1.0, -1.0]);
        let high = f64::from((1u32 << 24) - 1) * 2f64.powi(36);
        let corners = [(1.0, -1.0, 1.0), (1.0, 1.0, -1.0), (-1.0, 1.0, 1.0), (-1.0, -1.0, -1.0)];
        let [a, b, c, o] = corners.map(|(x, y, z)| DVec3::new(x, y, z) * high);
        assert!(Units::of(&[a]).whole(a).is_some_and(|a| a[0] < 1 << BITS && a[0] >= 1 << (BITS - 1)));
        let exact = [exact_volume(a - o, b, c, o), exact_along_normal(a, b, c, o)].map(Certain::value);
        assert_eq!(exact, [16.0 * high.powi(3); 2]);
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
