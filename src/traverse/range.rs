//! Rays whose numbers lie near the ends of the floats' range, brought where the kernels can
//! compute with them.
//!
//! What a walk computes is good for directions whose greatest component is within `2^-30 .. 2^31`
//! and for coordinates of at most `2^40`. Other directions, and all rays into a tree that keeps its
//! mesh scaled, are multiplied by powers of two, which changes exponents only: a lane's hit is the
//! same, to the bit, whether or not it needed that. (Two things are lost: direction components less
//! than `2^-150` of the greatest may count as 0; and an origin from which the mesh is smaller than
//! `2^-100` of the distance may overflow, and miss.)

use super::lanes::{HitPacket, RayPacket};
use crate::geometry::{NO_PRIMITIVE, triangle};
use crate::kdtree::{Scale, Tree, exponent};
use crate::simd::{Lanes, Mask};

/// A direction's greatest component is at least this and less than the other.
pub const LEAST: f32 = 1.0 / (1 << 30) as f32;
pub const LIMIT: f32 = (1u32 << 31) as f32;

/// Whether all lanes in `active` can be traced as they are.
#[inline(always)]
pub fn is_ordinary<const W: usize, L: Lanes<W>>(rays: &RayPacket<W>, active: u32, scale: Scale) -> bool {
    let [x, y, z] = [
        L::load(&rays.direction[0]).abs(),
        L::load(&rays.direction[1]).abs(),
        L::load(&rays.direction[2]).abs(),
    ];
    let longest = x.max(y).max(z);
    let ordinary = L::splat(LEAST).le(longest) & longest.lt(L::splat(LIMIT));
    scale.is_none() && ordinary.bits() & active == active
}

/// Rays that were changed, and what turns their `t` back.
pub struct Adapted<const W: usize> {
    /// The rays to trace.
    pub rays: RayPacket<W>,
    /// What the old `t` is of the new one.
    t_factor: [f64; W],
}

/// Brings rays into the range for a tree with the scale `scale`. A lane that is no ray stays none.
#[cold]
#[inline(never)]
pub fn adapt<const W: usize>(rays: &RayPacket<W>, scale: Scale) -> Adapted<W> {
    let mut adapted = Adapted { rays: rays.clone(), t_factor: [1.0; W] };
    let new = &mut adapted.rays;
    for lane in 0..W {
        let longest = (0..3).map(|axis| rays.direction[axis][lane].abs()).fold(0.0, f32::max);
        let stretch = if longest > 0.0 && longest <= f32::MAX {
            let exponent = exponent(longest);
            f64::powi(2.0, exponent.clamp(-30, 30) - exponent)
        } else {
            1.0
        };
        for axis in 0..3 {
            new.origin[axis][lane] = (f64::from(rays.origin[axis][lane]) * scale.factor()) as f32;
            new.direction[axis][lane] = (f64::from(rays.direction[axis][lane]) * stretch) as f32;
        }
        // origin * scale + (direction * stretch) * (t * scale / stretch)
        let factor = scale.factor() / stretch;
        new.tnear[lane] = (f64::from(rays.tnear[lane]) * factor) as f32;
        // What is beyond the floats' range in the ray's own unit is out of reach.
        new.tfar[lane] = (f64::from(rays.tfar[lane]).min(f64::from(f32::MAX)) * factor) as f32;
        // An interval stays empty when its ends are rounded to the same.
        let holds_something = rays.tnear[lane] <= rays.tfar[lane];
        if !holds_something {
            new.tfar[lane] = f32::NAN;
        }
        adapted.t_factor[lane] = 1.0 / factor;
    }
    adapted
}

impl<const W: usize> Adapted<W> {
    /// Turns hits of `rays` back to what they are in their own unit and for the mesh's own corners.
    #[cold]
    #[inline(never)]
    pub fn undo<T: Tree>(&self, rays: &RayPacket<W>, hits: &mut HitPacket<W>, tree: &T) {
        for lane in (0..W).filter(|&lane| hits.primitive[lane] != NO_PRIMITIVE) {
            // What underflowed on the way is brought back into the interval.
            let t = (f64::from(hits.t[lane]) * self.t_factor[lane]) as f32;
            hits.t[lane] = t.max(rays.tnear[lane]).min(rays.tfar[lane]) + 0.0;
            tree.enter_triangle(hits.primitive[lane]);
            let normal = triangle::normal(&tree.scale().undo(tree.corners(hits.primitive[lane])));
            for axis in 0..3 {
                hits.normal[axis][lane] = normal[axis];
            }
        }
    }
}
