//! One ray through one line: three levels of the tree at once.
//!
//! The ray meets the seven planes, walls included (`walk.rs` says why they are thick), and each exit is
//! left with what remains of the ray's interval after the three walls on the way to it. The exits that
//! something remains of are put on the ray's stack, the farthest first, so that the ray goes on with the
//! nearest.
//!
//! Which exit is the nearest depends on nothing but which way the ray runs along the seven axes:
//! [`ORDERS`] has the order for each set of signs. Lanes are in that order from then on, so that the lanes
//! tell which wall is before an exit and which is behind it: lane 7 is the exit on the near side of all
//! three, lane 0 on the far side.

use crate::kdtree::{Exit, Line, Way};
use crate::simd::{Eight, Mask};

/// A ray as lines see it, `x y z` and a number that means nothing.
#[derive(Clone, Copy)]
#[repr(C, align(16))]
pub struct Crossing {
    pub origin: [f32; 4],
    /// 1 / direction.
    pub inverse: [f32; 4],
    /// The walls' half-thickness in units of the parameter.
    pub margin: [f32; 4],
}

/// The deepest stack of a ray: of the eight exits of each line, or boxes of each node, on a way of
/// [`crate::kdtree::MAX_DEPTH`] levels all but one wait, and the end of the walk does; and room for eight to be written
/// at once. (A line is three levels, a node of boxes can be one.) A ray that goes through two nodes at a time has some
/// more room to do so.
const DEPTH: usize = (crate::kdtree::MAX_DEPTH * 7 + 2 + 8 + IN_PAIRS + 16).next_multiple_of(16);

/// The highest place up to which a ray that comes by itself goes through the node there as well as through the one that is nearer. That
/// leaves seven more at most; and from there on, until it is down here again, no more than seven wait for each level, on top of
/// those.
pub const IN_PAIRS: usize = 16;

/// What waits for a ray: exits, and its intervals in them.
#[derive(Clone)]
#[repr(C, align(64))]
pub struct Waiting {
    pub exits: [i32; DEPTH],
    pub tmin: [f32; DEPTH],
    pub tmax: [f32; DEPTH],
}

impl Waiting {
    /// The highest place from `top` down where something is left of the interval of a ray that ends at `tfar`. At
    /// the bottom there always is.
    #[inline(always)]
    pub fn reached<L: Eight>(&mut self, mut top: usize, tfar: f32) -> usize {
        loop {
            let from = top.saturating_sub(7);
            let lanes = (2 << (top - from)) - 1;
            let begun = L::load(eight(&mut self.tmin, from)).le(L::splat(tfar)).bits() & lanes;
            if begun != 0 {
                return from + begun.ilog2() as usize;
            }
            top = from - 1;
        }
    }

    /// Has a walk through boxes begin: at the root, and behind it is the end. The top.
    #[inline(always)]
    pub fn begin(&mut self) -> usize {
        (self.exits[0], self.tmin[0]) = (END, f32::NEG_INFINITY);
        (self.exits[1], self.tmin[1]) = (Way::ROOT.0, f32::NEG_INFINITY);
        1
    }

    /// A stack with nothing on it.
    pub const fn new() -> Self {
        Self { exits: [END; DEPTH], tmin: [f32::NEG_INFINITY; DEPTH], tmax: [f32::NEG_INFINITY; DEPTH] }
    }
}

/// The exit at the bottom of each stack. It looks like a leaf, whose record no tree has.
pub const END: i32 = -1;

/// Eight numbers from `from` on.
#[inline(always)]
pub fn eight<T>(values: &mut [T], from: usize) -> &mut [T; 8] {
    values[from..].first_chunk_mut().expect("room for eight")
}

/// A line's planes as a ray sees them, by place.
pub struct Planes<L: Eight> {
    /// The line's exits, with the planes' axes.
    pub exits: L::Ids,
    pub origin: L,
    /// 1 / direction.
    pub inverse: L,
    /// The walls' half-thickness in units of the parameter.
    pub margin: L,
}

/// The exits of a line that a ray takes, the farthest first.
pub struct Taken<L: Eight> {
    pub exits: L::Ids,
    /// Its intervals in them.
    pub tmin: L,
    pub tmax: L,
    /// A bit for each lane in which there is anything.
    pub bits: u32,
}

/// Takes the line on top of a stack, puts its exits there, and gives the new top. The ray ends at `tfar`.
#[inline(always)]
pub fn step<L: Eight>(lines: &[Line], ray: &Crossing, waiting: &mut Waiting, top: usize, tfar: f32) -> usize {
    let way = Exit(waiting.exits[top]);
    let line = &lines[way.line()];
    let tmin = L::splat(waiting.tmin[top]);
    let tmax = L::splat(waiting.tmax[top]).min(L::splat(tfar));
    let exits = L::ids_load(&line.exits);
    let seen = Planes {
        exits,
        origin: L::of_fours([&ray.origin; 2]).pick_in_fours(exits),
        inverse: L::of_fours([&ray.inverse; 2]).pick_in_fours(exits),
        margin: L::of_fours([&ray.margin; 2]).pick_in_fours(exits),
    };
    let taken = take::<L>(line, &seen, way.barred(), tmin, tmax);
    L::ids_compact(taken.exits, taken.bits, eight(&mut waiting.exits, top));
    taken.tmin.compact(taken.bits, eight(&mut waiting.tmin, top));
    taken.tmax.compact(taken.bits, eight(&mut waiting.tmax, top));
    top + taken.bits.count_ones() as usize - 1
}

/// The exits that a ray takes of a line in which it is from `tmin` to `tmax`, but for one that is barred.
#[inline(always)]
pub fn take<L: Eight>(line: &Line, seen: &Planes<L>, barred: usize, tmin: L, tmax: L) -> Taken<L> {
    // Where the ray is in the walls, by place.
    let t = (L::load(&line.planes) - seen.origin) * seen.inverse;
    let (enters, leaves) = (t - seen.margin, t + seen.margin);
    let order = &ORDERS[(seen.inverse.lt(L::splat(0.0)).bits() & 0xff) as usize];

    // By order: for a wall behind the exit where it is left, for one before it where it is entered. The
    // roots' and the second nodes' ends are in `upper`, the third ones' in `lower`.
    let upper = leaves.first_pairs(enters);
    let lower = leaves.last_pairs(enters);
    let order = L::ids_widen(order);
    let first = upper.pick_in_fours(L::ids_load(&[2, 2, 2, 2, 0, 0, 0, 0]));
    let second = upper.pick(L::ids_shift::<4>(order));
    let third = lower.pick(L::ids_shift::<8>(order));
    let exits = L::ids_pick(L::ids_and(seen.exits, L::ids_load(&OPEN[barred])), order);

    let [far_first, far_second, far_third] =
        [L::mask_from_bits(0b0000_1111), L::mask_from_bits(0b0011_0011), L::mask_from_bits(0b0101_0101)];
    let tmin = L::select(far_first, first, tmin).max(tmin);
    let tmin = L::select(far_second, second, tmin).max(tmin);
    let tmin = L::select(far_third, third, tmin).max(tmin);
    let tmax = L::select(far_first, tmax, first).min(tmax);
    let tmax = L::select(far_second, tmax, second).min(tmax);
    let tmax = L::select(far_third, tmax, third).min(tmax);

    // An exit that leads nowhere has nothing but an axis in it.
    let leads = L::ids_less(L::ids(3), exits) | L::ids_less(exits, L::ids(0));
    Taken { exits, tmin, tmax, bits: (leads & tmin.le(tmax)).bits() & 0xff }
}

/// For each set of places whose planes a ray crosses downward, and for each lane, what is to be fetched:
/// bits 0 to 2 the exit; 4 to 6 the place in `upper` of the wall of the second level; 8 to 10 that in
/// `lower` of the third.
pub static ORDERS: [[u16; 8]; 256] = {
    let mut orders = [[0; 8]; 256];
    let mut down = 0;
    while down < 256 {
        let mut lane = 0;
        while lane < 8 {
            // Whether the exit is on the far side of the three walls.
            let [far_first, far_second, far_third] = [lane < 4, lane & 2 == 0, lane & 1 == 0];
            let first = far_first as usize ^ down & 1;
            let half = 4 * first;
            let second = far_second as usize ^ down >> (half + 1) & 1;
            let third = far_third as usize ^ down >> (half + 2 + second) & 1;
            let exit = half | (2 * second) | third;
            let second_wall = half + 1 + 2 * far_second as usize;
            let third_wall = half + second + 2 * far_third as usize;
            orders[down][lane] = (exit | second_wall << 4 | third_wall << 8) as u16;
            lane += 1;
        }
        down += 1;
    }
    orders
};

/// Clears the exit that is barred ([`Exit::barred`]).
static OPEN: [[i32; 8]; 16] = {
    let mut rows = [[-1; 8]; 16];
    let mut exit = 0;
    while exit < 8 {
        rows[8 + exit][exit] = 0;
        exit += 1;
    }
    rows
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Chosen, Isa, Simd, Task};

    struct Reached<'a>(&'a mut Waiting, usize, f32);

    impl Task for Reached<'_> {
        type Output = usize;

        #[inline(always)]
        fn run<S: Simd>(self) -> usize {
            self.0.reached::<S::F8>(self.1, self.2)
        }
    }

    #[test]
    fn a_ray_goes_on_with_the_topmost_of_what_begins_before_its_end() {
        let mut state = 0.0f32;
        for isa in Isa::available() {
            let chosen = Chosen::new(isa).expect("it is available");
            for top in 0..60 {
                // What lies above the top is of no account.
                let mut waiting = Waiting::new();
                for (place, tmin) in waiting.tmin.iter_mut().enumerate().skip(1).take(top) {
                    state = (state + 0.618_034).fract();
                    // Mostly nearer toward the top.
                    *tmin = (60 - place) as f32 + 8.0 * state;
                }
                for tfar in [-1.0, 0.0, 2.0, 10.0, 25.0, 40.0, 100.0] {
                    let begun = |place: &usize| waiting.tmin[*place] <= tfar;
                    let wanted = (0..=top).rev().find(begun).expect("the bottom is always reached");
                    assert_eq!(chosen.run(Reached(&mut waiting, top, tfar)), wanted, "{isa}, {top}, {tfar}");
                }
            }
        }
    }
}
