//! Rays made ready for walks on which each is alone, or with whom it meets.

use super::range::{LEAST, LIMIT};
use super::walk::{FLATTEST, MARGIN};
use crate::geometry::Aabb;
use crate::simd::{Lanes, Mask};

/// What a walk needs to know of `W` rays beside their origins, as in `walk.rs`.
pub struct Ready<L> {
    /// 1 / direction.
    pub inverse: [L; 3],
    /// How far the scene reaches from the origins.
    pub reach: L,
    /// Half the thickness of walls, and that in units of the parameter.
    pub thickness: L,
    pub margin: [L; 3],
    /// Where the rays are inside the scene's bounds.
    pub tmin: L,
    pub tmax: L,
    /// What a hit must not lie beyond: `tfar`, which is infinite for nobody.
    pub closest: L,
    /// The lanes whose numbers do not lie near the ends of the floats' range; a NaN anywhere does.
    pub ordinary: u32,
    /// Those of them that meet the bounds.
    pub flies: u32,
}

impl<L> Ready<L> {
    /// Makes rays ready that start at `origin`, run along `direction`, and look for hits from `tnear` to `tfar`.
    #[inline(always)]
    pub fn new<const W: usize>(origin: &[L; 3], direction: &[L; 3], tnear: L, tfar: L, bounds: &Aabb) -> Self
    where
        L: Lanes<W>,
    {
        let zero = L::splat(0.0);
        let longest = direction[0].abs().max(direction[1].abs()).max(direction[2].abs());
        // What is compared with a NaN is not ordinary.
        let mut ordinary = L::splat(LEAST).le(longest) & tnear.le(tfar);
        let mut reach = zero;
        let mut inverse = [zero; 3];
        let flattest = longest * L::splat(FLATTEST);
        for axis in 0..3 {
            let speed = direction[axis].abs();
            ordinary = ordinary & speed.lt(L::splat(LIMIT)) & origin[axis].abs().le(L::splat(f32::MAX));
            inverse[axis] = L::splat(1.0) / flattest.max(speed).copysign(direction[axis]);
            let to_low = (L::splat(bounds.min[axis]) - origin[axis]).abs();
            let to_high = (L::splat(bounds.max[axis]) - origin[axis]).abs();
            reach = to_low.max(to_high).max(reach);
        }
        let thickness = reach * L::splat(MARGIN);
        let closest = L::splat(f32::MAX).min(tfar);
        let (mut tmin, mut tmax) = (tnear, closest);
        let mut margin = [zero; 3];
        for axis in 0..3 {
            margin[axis] = thickness * inverse[axis].abs();
            let low = (L::splat(bounds.min[axis]) - origin[axis]) * inverse[axis];
            let high = (L::splat(bounds.max[axis]) - origin[axis]) * inverse[axis];
            tmin = (low.min(high) - margin[axis]).max(tmin);
            tmax = (low.max(high) + margin[axis]).min(tmax);
        }
        let flies = (ordinary & tmin.le(tmax)).bits();
        let ordinary = ordinary.bits();
        Self { inverse, reach, thickness, margin, tmin, tmax, closest, ordinary, flies }
    }
}
