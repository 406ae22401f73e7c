//! A ray in flight.

use super::step::{Crossing, END, Waiting};
use crate::geometry::triangle::Test;
use crate::geometry::{Aabb, Ray};
use crate::simd::{Lanes, Mask};
use crate::traverse::range::{LEAST, LIMIT};
use crate::traverse::walk::{FLATTEST, MARGIN};

/// The id of no triangle yet: greater than any, so that equal `t` lets the first hit in.
pub const NONE: u32 = i32::MAX as u32;

/// What is known of a ray on its way, its stack left aside.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Flight<A> {
    pub crossing: Crossing,
    /// The top of its stack.
    pub top: u32,
    /// Which ray it is.
    pub ray: u32,
    pub tnear: f32,
    /// What a hit must not lie beyond: the closest `t`, or `tfar`.
    pub tfar: f32,
    /// The closest triangle.
    pub primitive: u32,
    /// Its weights, as the test gives them.
    pub weights: [f32; 2],
    /// Prepared for triangles.
    pub test: A,
}

/// How a ray begins.
pub enum Start<A> {
    /// In the bounds.
    Flies(Flight<A>),
    /// It meets the bounds nowhere.
    Misses,
    /// Its numbers lie near the ends of the floats' range, or it is no ray.
    Odd,
}

impl<A: Test<1, f32>> Flight<A> {
    /// Prepares a ray and puts the whole tree on its stack.
    #[inline(always)]
    pub fn start<L: Lanes<4>>(ray: &Ray, number: u32, bounds: &Aabb, waiting: &mut Waiting) -> Start<A> {
        let origin = [ray.origin.x, ray.origin.y, ray.origin.z, 0.0];
        let direction = [ray.direction.x, ray.direction.y, ray.direction.z, 0.0];
        let (o, d) = (L::load(&origin), L::load(&direction));
        let speed = d.abs();
        let longest = ray.direction.x.abs().max(ray.direction.y.abs()).max(ray.direction.z.abs());
        // False where anything is NaN.
        let ordinary = speed.lt(L::splat(LIMIT)) & o.abs().le(L::splat(f32::MAX));
        if !(ordinary.bits() & 0xf == 0xf && longest >= LEAST && ray.tnear <= ray.tfar) {
            return Start::Odd;
        }

        // As in `walk.rs`.
        let steep = L::splat(longest * FLATTEST).max(speed).copysign(d);
        let inverse = L::splat(1.0) / steep;
        let low = L::load(&[bounds.min.x, bounds.min.y, bounds.min.z, 0.0]) - o;
        let high = L::load(&[bounds.max.x, bounds.max.y, bounds.max.z, 0.0]) - o;
        let [x, y, z, _] = low.abs().max(high.abs()).store();
        let margin = L::splat(x.max(y).max(z) * MARGIN) * inverse.abs();
        let (low, high) = (low * inverse, high * inverse);
        let [enters_x, enters_y, enters_z, _] = (low.min(high) - margin).store();
        let [leaves_x, leaves_y, leaves_z, _] = (low.max(high) + margin).store();
        let tfar = ray.tfar.min(f32::MAX);
        let tmin = ray.tnear.max(enters_x).max(enters_y).max(enters_z);
        let tmax = tfar.min(leaves_x).min(leaves_y).min(leaves_z);
        if tmin > tmax {
            return Start::Misses;
        }
        (waiting.exits[0], waiting.tmin[0], waiting.tmax[0]) = (END, f32::NEG_INFINITY, f32::NEG_INFINITY);
        (waiting.exits[1], waiting.tmin[1], waiting.tmax[1]) = (0, tmin, tmax);
        Start::Flies(Self {
            crossing: Crossing { origin, inverse: inverse.store(), margin: margin.store() },
            top: 1,
            ray: number,
            tnear: ray.tnear,
            tfar,
            primitive: NONE,
            weights: [0.0; 2],
            test: A::new(&ray.origin.to_array(), &ray.direction.to_array(), 1),
        })
    }
}
