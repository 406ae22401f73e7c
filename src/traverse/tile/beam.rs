//! A tile's rays as one object: a beam of sixteen packets, or four times sixteen.
//!
//! The rays of a beam have a point in common, the *apex*: they part from it (camera rays), or run toward
//! it (shadow rays to a point light); or they are parallel (shadow rays to the sun) and the apex is any
//! point. Toward the apex they are looked at from its end, so that they too part from it.
//!
//! **Frame.** The axis along which the beam's first ray runs fastest becomes z (renamed cyclically, and
//! turned so that rays leave the apex up along it); all rays must run fastest along it (parallel ones: none faster). `z` is the
//! *depth*, and takes the place of `t` in the walk: it means the same for all rays of the beam, whatever
//! their origins and their directions' lengths. Two numbers tell a ray from the others, its *place* in
//! the window that the beam looks through:
//!
//! ```text
//! from an apex      (a z, b z, z)          place (a, b): the slopes, of less than 1
//! PARALLEL          (x + a z, y + b z, z)  place (x, y): where it crosses z = 0; slopes are the beam's
//! ```
//!
//! **Lanes.** One vector holds a number for each of the sixteen packets:
//!
//! ```text
//!                 tile of 16 x 16 rays           a packet: 4 x 4 rays, one lane
//!                 +----+----+----+----+
//!                 |  0 |  1 |  4 |  5 |          low[0] [4]   least place along x of packet 4's rays
//!                 +----+----+----+----+          high[1][4]   greatest place along y
//!                 |  2 |  3 |  6 |  7 |          tmin   [4]   from this depth on, and
//!                 +----+----+----+----+          tmax   [4]   up to this one, some ray of packet 4
//!                 |  8 |  9 | 12 | 13 |                       may be in the cell
//!                 +----+----+----+----+
//!                 | 10 | 11 | 14 | 15 |          (any sixteen packets do; those that are compact,
//!                 +----+----+----+----+           as the squares of a picture are, do best)
//! ```
//!
//! In a wide beam, a lane holds what four packets have between them: of its four squares, each as above, the first has
//! lanes 0 to 3, the second 4 to 7.
//!
//! **Crossing a plane.** Of the two cells beside a plane, all rays of a beam come to the same one first:
//! to that which holds the apex, or, if they are parallel, to that from which they run. From an apex, a
//! ray comes to a plane `s` away at the depth `s / slope`; a lane's rays do between `s` times the least
//! and `s` times the greatest *rate* `1 / slope` of those that run toward it (never, if none does: the
//! rate is infinite; and the greatest is infinite too if some do not). Rates are rounded outward.
//!
//! Walls are as thick as in the packet's walk, for the same reason (see `walk`): the near cell is left
//! behind the wall, the far one entered before it, and an apex inside the wall is in both.

use crate::geometry::Aabb;
use crate::simd::Sixteen;
use crate::traverse::walk::{Interval, MARGIN};

/// Packets in a square: a beam holds one square, or four.
pub const PACKETS: usize = 16;

/// Squares in a wide beam.
pub const WIDE: usize = 4;

/// What rates and depths are widened by, outward: more than the few roundings that are in them.
pub const WIDEN: f32 = 1.0 + 1.0 / (1 << 20) as f32;
pub const NARROW: f32 = 1.0 - 1.0 / (1 << 20) as f32;

/// The least slope of parallel rays that is not lifted: over the whole scene, less than walls are thick.
const FLATTEST: f32 = 1.0 / (1u64 << 40) as f32;

/// Where a beam is, and how its frame lies.
#[derive(Clone, Copy)]
pub struct Frame {
    /// The apex.
    pub apex: [f32; 3],
    /// Which coordinates are x, y and z in the frame.
    pub axes: [usize; 3],
    /// 1 or -1: what turns the z coordinate so that rays run up.
    pub sign: f32,
    /// The slopes of parallel rays.
    pub slopes: [f32; 2],
}

impl Frame {
    /// The frame for rays that leave `apex` about as `direction` does.
    #[inline(always)]
    pub fn new(apex: [f32; 3], direction: [f32; 3]) -> Self {
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
        let along = direction[axis] * sign;
        Self { apex, axes, sign, slopes: [direction[axes[0]] / along, direction[axes[1]] / along] }
    }
}

/// What a lane's rays have between them: places in a rectangle, depths in an interval.
#[derive(Clone, Copy)]
pub struct Extent<L> {
    pub low: [L; 2],
    pub high: [L; 2],
    pub depths: Interval<L>,
}

impl<L: Sixteen> Extent<L> {
    /// That of no rays.
    #[inline(always)]
    pub fn none() -> Self {
        let (low, high) = (L::splat(f32::INFINITY), L::splat(f32::NEG_INFINITY));
        Self { low: [low; 2], high: [high; 2], depths: Interval { tmin: low, tmax: high } }
    }

    /// What the lanes of a beam of such squares have between them: a lane is as many packets as there are squares.
    #[inline(always)]
    pub fn of_lanes<const K: usize>(squares: &[Self; K]) -> Self {
        let [a, b, c, d] = match squares.as_chunks::<4>().0 {
            [four] => four,
            _ => return squares[0],
        };
        Self {
            low: [
                L::least_of_fours(&[a.low[0], b.low[0], c.low[0], d.low[0]]),
                L::least_of_fours(&[a.low[1], b.low[1], c.low[1], d.low[1]]),
            ],
            high: [
                L::greatest_of_fours(&[a.high[0], b.high[0], c.high[0], d.high[0]]),
                L::greatest_of_fours(&[a.high[1], b.high[1], c.high[1], d.high[1]]),
            ],
            depths: Interval {
                tmin: L::least_of_fours(&[a.depths.tmin, b.depths.tmin, c.depths.tmin, d.depths.tmin]),
                tmax: L::greatest_of_fours(&[a.depths.tmax, b.depths.tmax, c.depths.tmax, d.depths.tmax]),
            },
        }
    }
}

/// How far a beam's rays are from what they would be in exact arithmetic, and from one another.
#[derive(Clone, Copy, Default)]
pub struct Spread {
    /// The greatest coordinate distance from the apex to a ray's origin.
    pub range: f32,
    /// How far from the apex rays may pass that should run through it.
    pub stray: f32,
}

/// `1 / slope` of a lane's rays that run one way along an axis: the least, and the greatest.
#[derive(Clone, Copy)]
struct Rate<L> {
    least: L,
    greatest: L,
}

/// The rays of up to sixteen packets.
pub struct Beam<L, const PARALLEL: bool> {
    pub frame: Frame,
    pub spread: Spread,
    /// Least and greatest places of each packet.
    pub low: [L; 2],
    pub high: [L; 2],
    /// Half the thickness of walls.
    thickness: f32,
    /// Rates up and down along each of the scene's axes, of rays from an apex.
    rates: [[Rate<L>; 2]; 3],
}

/// Where the lanes come to a plane.
pub struct Crossing<L> {
    /// Which child comes first: 0 below the plane, 1 above.
    pub near: usize,
    /// No ray is in the near child beyond this depth.
    pub leave: L,
    /// No ray is in the far child before this depth.
    pub enter: L,
}

impl<L: Sixteen, const PARALLEL: bool> Beam<L, PARALLEL> {
    /// A beam in a scene, and the depths at which its packets are inside of the scene's bounds.
    #[inline(always)]
    pub fn new(frame: Frame, extent: &Extent<L>, spread: Spread, bounds: &Aabb) -> (Self, Interval<L>) {
        let (zero, infinite) = (L::splat(0.0), L::splat(f32::INFINITY));
        let Extent { low, high, depths } = *extent;
        let reach = (0..3).fold(0.0, |reach: f32, axis| {
            let apex = frame.apex[axis];
            reach.max((bounds.min[axis] - apex).abs()).max((bounds.max[axis] - apex).abs())
        });
        let thickness = MARGIN * (reach + spread.range) + spread.stray;
        let mut rates = [[Rate { least: zero, greatest: zero }; 2]; 3];
        if !PARALLEL {
            rates[frame.axes[0]] = rates_of(low[0], high[0]);
            rates[frame.axes[1]] = rates_of(low[1], high[1]);
            let toward = Rate { least: L::splat(NARROW), greatest: L::splat(WIDEN) };
            let away = Rate { least: infinite, greatest: infinite };
            rates[frame.axes[2]] = if frame.sign > 0.0 { [toward, away] } else { [away, toward] };
        }
        let beam = Self { frame, spread, low, high, thickness, rates };
        let interval = beam.clip(depths, bounds);
        (beam, interval)
    }

    /// What is left of depths inside of the bounds, walls included.
    #[inline(always)]
    fn clip(&self, interval: Interval<L>, bounds: &Aabb) -> Interval<L> {
        let Interval { mut tmin, mut tmax } = interval;
        tmax = L::splat(f32::MAX).min(tmax);
        for axis in 0..3 {
            // The bounds are above the one plane, and below the other.
            for (plane, inside) in [(bounds.min[axis], 1), (bounds.max[axis], 0)] {
                let crossing = self.crossing(axis, plane);
                if crossing.near == inside {
                    tmax = crossing.leave.min(tmax);
                } else {
                    tmin = crossing.enter.max(tmin);
                }
            }
        }
        Interval { tmin, tmax }
    }

    /// Where the lanes come to a plane.
    #[inline(always)]
    pub fn crossing(&self, axis: usize, position: f32) -> Crossing<L> {
        if PARALLEL { self.crossing_along(axis, position) } else { self.crossing_from(axis, position) }
    }

    /// Rays from the apex.
    #[inline(always)]
    fn crossing_from(&self, axis: usize, position: f32) -> Crossing<L> {
        let way = position - self.frame.apex[axis];
        let near = usize::from(way < 0.0);
        let way = way.abs();
        if way <= self.thickness {
            // The apex is in the wall: every ray may be in either child, at any depth.
            return Crossing { near, leave: L::splat(f32::MAX), enter: L::splat(f32::NEG_INFINITY) };
        }
        let rate = &self.rates[axis][near];
        Crossing {
            near,
            leave: L::splat(way + self.thickness) * rate.greatest,
            enter: L::splat(way - self.thickness) * rate.least,
        }
    }

    /// Parallel rays.
    #[inline(always)]
    fn crossing_along(&self, axis: usize, position: f32) -> Crossing<L> {
        let Frame { apex, axes, sign, slopes } = &self.frame;
        let way = position - apex[axis];
        if axis == axes[2] {
            let way = way * sign;
            let near = usize::from(*sign < 0.0);
            return Crossing {
                near,
                leave: L::splat(way + self.thickness),
                enter: L::splat(way - self.thickness),
            };
        }
        // Turned so that rays run up, if they run at all.
        let side = usize::from(axis == axes[1]);
        let rate = L::splat(1.0 / slopes[side].abs().max(FLATTEST));
        let (above, below) = (L::splat(way + self.thickness), L::splat(way - self.thickness));
        if slopes[side] < 0.0 {
            Crossing {
                near: 1,
                leave: (self.high[side] - below) * rate,
                enter: (self.low[side] - above) * rate,
            }
        } else {
            Crossing {
                near: 0,
                leave: (above - self.low[side]) * rate,
                enter: (below - self.high[side]) * rate,
            }
        }
    }
}

/// The rates up and down of lanes with slopes from `low` to `high`.
#[inline(always)]
fn rates_of<L: Sixteen>(low: L, high: L) -> [Rate<L>; 2] {
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
