//! A tile's rays as one object: a beam of sixteen packets that part from one point.
//!
//! **Frame.** The axis along which the beam's first ray runs fastest becomes z (renamed cyclically, and
//! turned so that rays run up along it); all rays must run fastest along it. A ray is `(a z, b z, z)`
//! there, with the *slopes* `a` and `b`, of less than 1;
//! `z` is the *depth*, `t` times the speed along that axis. Depth takes the place of `t` in the walk: it
//! means the same for all rays of the beam, whatever their directions' lengths.
//!
//! **Lanes.** One vector holds a number for each of the sixteen packets:
//!
//! ```text
//!                 tile of 16 x 16 rays           a packet: 4 x 4 rays, one lane
//!                 +----+----+----+----+
//!                 |  0 |  1 |  4 |  5 |          low[0] [4]   least slope a of packet 4's rays
//!                 +----+----+----+----+          high[1][4]   greatest slope b
//!                 |  2 |  3 |  6 |  7 |          tmin   [4]   from this depth on, and
//!                 +----+----+----+----+          tmax   [4]   up to this one, some ray of packet 4
//!                 |  8 |  9 | 12 | 13 |                       may be in the cell
//!                 +----+----+----+----+
//!                 | 10 | 11 | 14 | 15 |          (any sixteen packets do; those that are compact,
//!                 +----+----+----+----+           as the squares of a picture are, do best)
//! ```
//!
//! **Crossing a plane.** All rays part from the apex, so the cell that the apex is in comes first for
//! all of them, whichever way they run: there is no order to decide. A ray comes to a plane `s` away at
//! the depth `s / slope`; a lane's rays do between `s` times the least and `s` times the greatest *rate*
//! `1 / slope` of those that run toward it (never, if none does: the rate is infinite; and the greatest
//! is infinite too if some do not). Rates are rounded outward.
//!
//! Walls are as thick as in the packet's walk, for the same reason (see `walk`): the near cell is left
//! behind the wall, the far one entered before it, and an apex inside the wall is in both.

use crate::geometry::Aabb;
use crate::simd::{Lanes, Mask};
use crate::traverse::lanes::RayPacket;
use crate::traverse::range::{LEAST, LIMIT};
use crate::traverse::walk::{Interval, MARGIN};

/// Packets in a beam.
pub const PACKETS: usize = 16;

/// What rates and depths are widened by, outward: more than the few roundings that are in them.
const WIDEN: f32 = 1.0 + 1.0 / (1 << 20) as f32;
const NARROW: f32 = 1.0 - 1.0 / (1 << 20) as f32;

/// `1 / slope` of a lane's rays that run one way along an axis: the least, and the greatest.
#[derive(Clone, Copy)]
struct Rate<L> {
    least: L,
    greatest: L,
}

/// The rays of up to sixteen packets that share their origin.
pub struct Beam<L> {
    /// Where all rays part from.
    pub apex: [f32; 3],
    /// Which coordinates are x, y and z in the frame.
    pub axes: [usize; 3],
    /// 1 or -1: what turns the z coordinate so that rays run up.
    pub sign: f32,
    /// Half the thickness of walls.
    thickness: f32,
    /// Rates up and down along each of the scene's axes.
    rates: [[Rate<L>; 2]; 3],
    /// Least and greatest slopes `a` and `b` of each packet.
    pub low: [L; 2],
    pub high: [L; 2],
}

/// Where the lanes come to a plane.
pub struct Crossing<L> {
    /// Which child the apex is in: 0 below the plane, 1 above.
    pub near: usize,
    /// No ray is in the near child beyond this depth.
    pub leave: L,
    /// No ray is in the far child before this depth.
    pub enter: L,
}

impl<L: Lanes<16>> Beam<L> {
    /// Makes a beam of packets of which the lanes in `active` count, and finds the depths at which they
    /// are inside of `bounds`. `None` if they are none: if origins differ, directions point too far
    /// apart, or a ray is not an ordinary one or reaches behind its origin.
    #[inline(always)]
    pub fn new(
        rays: &[RayPacket<16>],
        active: &[u32; PACKETS],
        bounds: &Aabb,
    ) -> Option<(Self, Interval<L>)> {
        let zero = L::splat(0.0);
        let first = active.iter().position(|&lanes| lanes != 0)?;
        let lane = active[first].trailing_zeros() as usize;
        let apex = [0, 1, 2].map(|axis| rays[first].origin[axis][lane]);
        let direction = [0, 1, 2].map(|axis| rays[first].direction[axis][lane]);

        // Choose the frame.
        let speed = direction.map(f32::abs);
        let axis = if speed[1] <= speed[0] && speed[2] <= speed[0] {
            0
        } else if speed[2] <= speed[1] {
            1
        } else {
            2
        };
        let axes = [(axis + 1) % 3, (axis + 2) % 3, axis];
        let sign = if direction[axis] < 0.0 { -1.0 } else { 1.0 };

        // Find each packet's slopes and depths, and whether it belongs to the beam at all.
        let (mut low, mut high) = ([[0.0; 16]; 2], [[0.0; 16]; 2]);
        let (mut nearest, mut farthest) = ([0.0; 16], [f32::NEG_INFINITY; 16]);
        let infinite = L::splat(f32::INFINITY);
        for (packet, rays) in rays.iter().enumerate() {
            let lanes = active[packet];
            if lanes == 0 {
                continue;
            }
            let counts = L::mask_from_bits(lanes);
            let forward = L::load(&rays.direction[axis]) * L::splat(sign);
            let tnear = L::load(&rays.tnear);
            let tfar = L::load(&rays.tfar);
            // A NaN anywhere fails these. The speed forward is the direction's greatest component.
            let ordinary = L::splat(LEAST).le(forward) & forward.lt(L::splat(LIMIT));
            let mut belongs = ordinary & zero.le(tnear) & tfar.le(infinite);
            for (axis, &coordinate) in apex.iter().enumerate() {
                belongs = belongs & L::load(&rays.origin[axis]).eq(L::splat(coordinate));
            }
            for side in 0..2 {
                let slope = L::load(&rays.direction[axes[side]]) / forward;
                belongs = belongs & slope.abs().lt(L::splat(1.0));
                low[side][packet] = L::select(counts, slope, infinite).least();
                high[side][packet] = L::select(counts, slope, zero - infinite).greatest();
            }
            if belongs.bits() & lanes != lanes {
                return None;
            }
            nearest[packet] = L::select(counts, tnear * forward, infinite).least();
            farthest[packet] = L::select(counts, tfar * forward, zero - infinite).greatest();
        }

        let (low, high) = ([L::load(&low[0]), L::load(&low[1])], [L::load(&high[0]), L::load(&high[1])]);
        let mut beam = Self {
            apex,
            axes,
            sign,
            thickness: 0.0,
            rates: [[Rate { least: zero, greatest: zero }; 2]; 3],
            low,
            high,
        };
        beam.thickness = MARGIN * beam.reach(bounds);
        beam.rates[axes[0]] = rates(low[0], high[0]);
        beam.rates[axes[1]] = rates(low[1], high[1]);
        let toward = Rate { least: L::splat(NARROW), greatest: L::splat(WIDEN) };
        let away = Rate { least: infinite, greatest: infinite };
        beam.rates[axis] = if sign > 0.0 { [toward, away] } else { [away, toward] };

        let interval = Interval {
            tmin: L::load(&nearest) * L::splat(NARROW),
            tmax: L::load(&farthest) * L::splat(WIDEN),
        };
        let interval = beam.clip(interval, bounds);
        Some((beam, interval))
    }

    /// The greatest coordinate distance from the apex to the bounds.
    fn reach(&self, bounds: &Aabb) -> f32 {
        (0..3).fold(0.0, |reach: f32, axis| {
            let apex = self.apex[axis];
            reach.max((bounds.min[axis] - apex).abs()).max((bounds.max[axis] - apex).abs())
        })
    }

    /// What is left of depths inside of the bounds, walls included.
    #[inline(always)]
    fn clip(&self, interval: Interval<L>, bounds: &Aabb) -> Interval<L> {
        let Interval { mut tmin, mut tmax } = interval;
        tmax = L::splat(f32::MAX).min(tmax);
        for axis in 0..3 {
            let [up, down] = &self.rates[axis];
            let below = bounds.min[axis] - self.apex[axis];
            let above = bounds.max[axis] - self.apex[axis];
            if below > self.thickness {
                tmin = tmin.max(L::splat(below - self.thickness) * up.least);
            }
            if -above > self.thickness {
                tmin = tmin.max(L::splat(-above - self.thickness) * down.least);
            }
            // A lane all of whose rays run one way leaves there.
            if above + self.thickness > 0.0 {
                tmax = tmax.min(L::splat(above + self.thickness) * up.greatest);
            }
            if self.thickness - below > 0.0 {
                tmax = tmax.min(L::splat(self.thickness - below) * down.greatest);
            }
        }
        Interval { tmin, tmax }
    }

    /// Where the lanes come to a plane.
    #[inline(always)]
    pub fn crossing(&self, axis: usize, position: f32) -> Crossing<L> {
        let way = position - self.apex[axis];
        let near = usize::from(way < 0.0);
        let way = way.abs();
        if way <= self.thickness {
            // The apex is in the wall: every ray may be in either child, at any depth.
            return Crossing { near, leave: L::splat(f32::MAX), enter: L::splat(0.0) };
        }
        let rate = &self.rates[axis][near];
        Crossing {
            near,
            leave: L::splat(way + self.thickness) * rate.greatest,
            enter: L::splat(way - self.thickness) * rate.least,
        }
    }
}

/// The rates up and down of lanes with slopes from `low` to `high`.
#[inline(always)]
fn rates<L: Lanes<16>>(low: L, high: L) -> [Rate<L>; 2] {
    let (zero, infinite) = (L::splat(0.0), L::splat(f32::INFINITY));
    let (at_low, at_high) = (L::splat(1.0) / low, L::splat(1.0) / high);
    let (all_up, some_up) = (zero.lt(low), zero.lt(high));
    let (all_down, some_down) = (high.lt(zero), low.lt(zero));
    let (narrow, widen) = (L::splat(NARROW), L::splat(WIDEN));
    [
        Rate {
            least: L::select(some_up, at_high * narrow, infinite),
            greatest: L::select(all_up, at_low * widen, infinite),
        },
        Rate {
            least: L::select(some_down, (zero - at_low) * narrow, infinite),
            greatest: L::select(all_down, (zero - at_high) * widen, infinite),
        },
    ]
}
