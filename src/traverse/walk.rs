//! A packet's rays as the walk down the tree needs them: where they cross planes, and how sure
//! that is.
//!
//! **Cells have thick walls.** A triangle test answers for corners moved by a few roundings of
//! their distance from the origin, and its `t` is rounded too: what it promises is that the point
//! `origin + t * direction` of a hit lies within some 16 roundings of that distance of a point of
//! the triangle. That triangle may be listed only in a cell that the ray touches within as much.
//! Every plane is therefore taken to be a slab of half-thickness `margin = 2^-19 * reach`, 32
//! roundings of `reach`, the greatest coordinate distance from the origin to the bounds. It covers
//! the rounding of the plane's own parameter too. So each hit lies inside a cell that lists its
//! triangle, and the order in which cells are looked at decides nothing. Nothing here depends on the
//! scale of the scene.
//!
//! **No division by zero, no NaN.** A direction component smaller than `2^-40` of the greatest
//! is taken to be that: over the whole scene the ray moves by far less than `margin`. Parameters
//! of planes so stay finite (a ray in a plane gets the slab's whole interval, a ray beside it
//! one that lies far beyond the scene or behind the origin).

use super::lanes::RayPacket;
use crate::geometry::Aabb;
use crate::simd::{Lanes, Mask};

/// Half the thickness of a wall, relative to the reach.
pub const MARGIN: f32 = 1.0 / (1 << 19) as f32;

/// The least direction component, relative to the greatest.
pub const FLATTEST: f32 = 1.0 / (1u64 << 40) as f32;

/// On which side of a plane across an axis rays come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heading {
    /// All lanes run upward: the cell below a plane comes first.
    Up,
    /// All lanes run downward: the cell above comes first.
    Down,
    /// Lanes differ.
    Mixed,
}

/// An interval of the parameter for each lane; a lane whose interval is empty is not live.
#[derive(Clone, Copy)]
pub struct Interval<L> {
    /// Where it begins.
    pub tmin: L,
    /// Where it ends.
    pub tmax: L,
}

impl<L> Interval<L> {
    /// The lanes whose interval is not empty.
    #[inline(always)]
    pub fn live<const W: usize>(&self) -> L::Mask
    where
        L: Lanes<W>,
    {
        self.tmin.le(self.tmax)
    }
}

/// `W` rays prepared for crossing axis-aligned planes.
pub struct Walk<const W: usize, L: Lanes<W>> {
    origin: [L; 3],
    /// 1 / direction, finite for every lane that can hit anything.
    inverse: [L; 3],
    /// The walls' half-thickness in units of the parameter.
    margin: [L; 3],
    /// Which lanes run downward.
    down: [L::Mask; 3],
    /// What the lanes have in common.
    pub heading: [Heading; 3],
    /// For mixed headings: whether more lanes run downward than upward.
    pub mostly_down: [bool; 3],
}

impl<const W: usize, L: Lanes<W>> Walk<W, L> {
    /// Prepares the lanes in `active` and finds where they are inside `bounds`. The interval of a
    /// lane that is not active, misses the bounds, is empty, or is no ray at all (a NaN or an
    /// infinity in origin or direction, a zero direction) comes out empty.
    #[inline(always)]
    pub fn new(rays: &RayPacket<W>, active: u32, bounds: &Aabb) -> (Self, Interval<L>) {
        let zero = L::splat(0.0);
        let greatest = L::splat(f32::MAX);
        let origin: [L; 3] = load3(&rays.origin);
        let direction: [L; 3] = load3(&rays.direction);
        let longest = direction[0].abs().max(direction[1].abs()).max(direction[2].abs());
        let flattest = longest * L::splat(FLATTEST);

        let mut reach = zero;
        let mut sound = zero.lt(longest) & L::mask_from_bits(active);
        let mut inverse = [zero; 3];
        for axis in 0..3 {
            // Lift direction components that are next to nothing.
            let steep = flattest.max(direction[axis].abs()).copysign(direction[axis]);
            inverse[axis] = L::splat(1.0) / steep;
            // The walls' thickness follows from how far the scene reaches from the origin.
            let to_low = (L::splat(bounds.min[axis]) - origin[axis]).abs();
            let to_high = (L::splat(bounds.max[axis]) - origin[axis]).abs();
            reach = to_low.max(to_high).max(reach);
            // A lane that is no ray has something in it that is not at most the greatest float.
            sound = sound & origin[axis].abs().le(greatest) & direction[axis].abs().le(greatest);
        }

        // Who runs where.
        let thickness = reach * L::splat(MARGIN);
        let mut margin = [zero; 3];
        let mut down = [sound; 3];
        let mut heading = [Heading::Up; 3];
        let mut mostly_down = [false; 3];
        for axis in 0..3 {
            margin[axis] = thickness * inverse[axis].abs();
            down[axis] = inverse[axis].lt(zero);
            let bits = down[axis].bits() & active;
            heading[axis] = match bits {
                0 => Heading::Up,
                _ if bits == active => Heading::Down,
                _ => Heading::Mixed,
            };
            mostly_down[axis] = 2 * bits.count_ones() > active.count_ones();
        }
        let walk = Self { origin, inverse, margin, down, heading, mostly_down };

        // Clip to the bounds. `max` and `min` keep a NaN that stands on their right.
        let mut tmin = L::load(&rays.tnear);
        let mut tmax = L::splat(f32::MAX).min(L::load(&rays.tfar));
        for axis in 0..3 {
            let low = walk.crossing(axis, bounds.min[axis]);
            let high = walk.crossing(axis, bounds.max[axis]);
            tmin = low.tmin.min(high.tmin).max(tmin);
            tmax = low.tmax.max(high.tmax).min(tmax);
        }
        let tmax = L::select(sound, tmax, L::splat(f32::NEG_INFINITY));
        (walk, Interval { tmin, tmax })
    }

    /// Where the rays are inside the wall of a plane: from `tmin` to `tmax`.
    #[inline(always)]
    pub fn crossing(&self, axis: usize, position: f32) -> Interval<L> {
        let t = (L::splat(position) - self.origin[axis]) * self.inverse[axis];
        Interval { tmin: t - self.margin[axis], tmax: t + self.margin[axis] }
    }

    /// The parts of an interval before and behind a wall, in the order in which a ray comes to
    /// them. Both hold the wall itself.
    #[inline(always)]
    pub fn cut(&self, interval: &Interval<L>, wall: &Interval<L>) -> [Interval<L>; 2] {
        [
            Interval { tmin: interval.tmin, tmax: wall.tmax.min(interval.tmax) },
            Interval { tmin: wall.tmin.max(interval.tmin), tmax: interval.tmax },
        ]
    }

    /// The same two parts sorted by place: below the plane, and above.
    #[inline(always)]
    pub fn by_place(&self, axis: usize, [first, second]: [Interval<L>; 2]) -> [Interval<L>; 2] {
        let down = self.down[axis];
        [
            Interval {
                tmin: L::select(down, second.tmin, first.tmin),
                tmax: L::select(down, second.tmax, first.tmax),
            },
            Interval {
                tmin: L::select(down, first.tmin, second.tmin),
                tmax: L::select(down, first.tmax, second.tmax),
            },
        ]
    }
}

/// Three components of `W` lanes.
#[inline(always)]
pub fn load3<const W: usize, L: Lanes<W>>(components: &[[f32; W]; 3]) -> [L; 3] {
    [L::load(&components[0]), L::load(&components[1]), L::load(&components[2])]
}
