//! A ray that comes by itself, made ready with its coordinates side by side.
//!
//! What [`Ready`](crate::traverse::ready::Ready) and [`Slabs`](super::step::Slabs) make of rays that come together, a number
//! of each in a register, is made here of one in a register of its own, which has the coordinates in both halves:
//!
//! ```text
//! lane      0   1   2    3       4   5   6    7
//! origin    x   y   z  tnear     x   y   z  tnear
//! direction x   y   z   tfar     x   y   z   tfar
//! ```
//!
//! So a coordinate comes to all lanes by one shuffle inside the halves, and three of them are compared by three shuffles.

use super::step::{Octant, Spread, thick};
use crate::geometry::Ray;
use crate::geometry::triangle::pooled::Pooled;
use crate::simd::{Eight, Mask};
use crate::traverse::range::{LEAST, LIMIT};
use crate::traverse::walk::{FLATTEST, MARGIN};

/// A ray as boxes and pools see it.
pub struct Prepared<L> {
    pub slabs: Spread<L>,
    pub pooled: Pooled,
    /// Where it ends: infinity is nowhere.
    pub tfar: f32,
}

/// The coordinates' lanes in a half.
const XYZ: u32 = 0b111;
/// The lane of the ends.
const ENDS: u32 = 0b1000;

impl<L: Eight> Prepared<L> {
    /// Makes a ray ready that looks for hits in a scene between two corners. `None` if its numbers lie near the ends of the
    /// floats' range, if one is a NaN, or if its interval is empty.
    #[inline(always)]
    pub fn new(ray: &Ray, [low, high]: &[[f32; 4]; 2]) -> Option<Self> {
        let [from, along]: &[[f32; 4]; 2] = bytemuck::cast_ref(ray);
        let (origin, direction) = (L::of_fours([from, from]), L::of_fours([along, along]));
        let speed = direction.abs();
        let longest = greatest(speed);
        // What is compared with a NaN is not ordinary.
        let ordinary =
            speed.lt(L::splat(LIMIT)) & origin.abs().le(L::splat(f32::MAX)) & L::splat(LEAST).le(longest);
        if ordinary.bits() & XYZ != XYZ || origin.le(direction).bits() & ENDS == 0 {
            return None;
        }
        let inverse = L::splat(1.0) / (longest * L::splat(FLATTEST)).max(speed).copysign(direction);
        let to_low = (L::of_fours([low, low]) - origin).abs();
        let to_high = (L::of_fours([high, high]) - origin).abs();
        let reach = greatest(to_low.max(to_high));
        let margin = reach * L::splat(MARGIN) * inverse.abs();
        let [near, far] = thick(origin, inverse, margin);
        let octant = Octant::new(inverse.lt(L::splat(0.0)).bits() & XYZ);
        // Of several, the first axis: as for all other rays.
        let axis = speed.eq(longest).bits().trailing_zeros() as usize;
        Some(Self {
            slabs: Spread::of_numbers(each(inverse), each(near), each(far), octant),
            pooled: Pooled::of_one::<L>(from, along, axis),
            tfar: f32::MAX.min(ray.tfar),
        })
    }
}

/// Each coordinate in all lanes.
#[inline(always)]
fn each<L: Eight>(point: L) -> [L; 3] {
    [point.splat_in_fours::<0>(), point.splat_in_fours::<1>(), point.splat_in_fours::<2>()]
}

/// The greatest of three coordinates, in all lanes.
#[inline(always)]
fn greatest<L: Eight>(point: L) -> L {
    let [x, y, z] = each(point);
    x.max(y).max(z)
}

#[cfg(test)]
mod tests {
    use super::super::start::Starts;
    use super::super::step::Slabs;
    use super::*;
    use crate::geometry::Aabb;
    use crate::simd::{Chosen, Isa, Simd, Task};
    use crate::weyl::uniform;
    use glam::Vec3;

    /// A ray as it is made ready by itself and among others: how boxes see it, and where it ends.
    struct Both<'a>(&'a Ray, &'a Aabb);

    impl Task for Both<'_> {
        type Output = [Option<(Slabs, f32)>; 2];

        #[inline(always)]
        fn run<S: Simd>(self) -> Self::Output {
            let Self(ray, bounds) = self;
            let corners = [bounds.min, bounds.max].map(|corner| [corner.x, corner.y, corner.z, 0.0]);
            let alone = Prepared::<S::F8>::new(ray, &corners);
            let alone = alone.map(
                #[inline(always)]
                |prepared| (prepared.slabs.numbers(), prepared.tfar),
            );
            let starts = Starts::new::<S::F8>(&[*ray], bounds);
            let among = if starts.odd == 0 { Some((starts.slabs(0), starts.tfar(0))) } else { None };
            [alone, among]
        }
    }

    #[test]
    fn a_ray_by_itself_is_what_it_is_among_others() {
        let mut number = uniform(-1.0, 1.0);
        let mut vector = || Vec3::new(number(), number(), number());
        let bounds = Aabb { min: Vec3::new(-3.0, 2.0, 0.5), max: Vec3::new(7.0, 2.5, 900.0) };
        let odd = [f32::NAN, f32::INFINITY, f32::MAX, f32::NEG_INFINITY, 1e-20, 0.0, -0.0];
        let (mut ordinary, mut refused) = (0, 0);
        for isa in Isa::available() {
            let chosen = Chosen::new(isa).expect("it is available");
            for round in 0..4000 {
                let (mut origin, mut direction) = (vector() * 50.0, vector());
                match round % 8 {
                    // As fast along two axes, or along all.
                    0 => direction.y = -direction.x,
                    1 => direction = Vec3::splat(direction.x),
                    2 => direction[round / 8 % 3] = odd[round / 24 % odd.len()],
                    3 => origin[round / 8 % 3] = odd[round / 24 % odd.len()],
                    4 => direction *= [1e-12, 1e12, 0.0][round / 8 % 3],
                    _ => {}
                }
                let mut ray = Ray::segment(origin, direction, 0.0, 20.0 * vector().x.abs());
                match round / 8 % 9 {
                    0 => ray.tfar = f32::INFINITY,
                    1 => (ray.tnear, ray.tfar) = (2.0, 1.0),
                    2 => ray.tnear = f32::NAN,
                    3 => ray.tfar = f32::NAN,
                    _ => {}
                }
                let [alone, among] = chosen.run(Both(&ray, &bounds));
                // (Numbers are written so that each has its own form.)
                assert_eq!(format!("{alone:?}"), format!("{among:?}"), "{isa}, {ray:?}");
                if alone.is_some() { ordinary += 1 } else { refused += 1 }
            }
        }
        assert!(ordinary > 1000 && refused > 1000, "{ordinary} {refused}");
    }
}
