//! A lot of rays: where each starts, how it runs, and what it has found.

use crate::geometry::Aabb;
use crate::geometry::triangle::pooled::{Listed, Pooled, shears};
use crate::kdtree::Line;
use crate::simd::{Dense, Eight, Lanes, Mask};
use crate::traverse::closest::{Closest, NONE};
use crate::traverse::columns::rows;
use crate::traverse::kernel::Kernel;
use crate::traverse::pool::step::Slabs;
use crate::traverse::ready::Ready;
use crate::traverse::source::Source;
use crate::traverse::stream::step::Planes;
use crate::traverse::walk::MARGIN;
use std::ops::Range;

/// Rays in a lot.
pub const LOT: usize = Kernel::Filter.width();

/// A ray's id is its number in the lot, and of a sheared ray the greatest axis of its direction as well, so many times over.
const AXIS: i32 = LOT as i32;

/// A ray on its way, in half a cache line.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
struct Traveller {
    /// Its origin, and what a hit must not lie beyond: the closest `t`, or `tfar`. Of a ray that is done less than
    /// anything.
    start: [f32; 4],
    /// 1 / direction, and the bits of the closest triangle's id, or of [`NONE`].
    inverse: [f32; 4],
}

/// Rays of a list as planes see them.
pub struct Crossing<L> {
    pub origin: [L; 3],
    pub inverse: [L; 3],
    /// The walls' half-thickness in units of the parameter.
    pub margin: [L; 3],
    /// Where each ray ends.
    pub closest: L,
}

/// The rays.
pub struct Lot {
    travellers: [Traveller; LOT],
    /// Their directions, or [shears], and `tnear`.
    ways: [[f32; 4]; LOT],
    /// Where each ray is inside the scene's bounds.
    pub tmin: [f32; LOT],
    pub tmax: [f32; LOT],
    /// The ids of the rays that run into each octant, and how many these are. Bit 0 of an octant's number says that they run down
    /// along x.
    octants: [[i32; LOT]; 8],
    counts: [usize; 8],
    /// For each eight rays, those whose numbers lie near the ends of the floats' range, or that are none.
    odd: [u8; LOT / 8],
    /// Half the thickness of walls: that of the ray to which the scene reaches farthest.
    thickness: f32,
}

impl Lot {
    /// A lot that nothing is known of.
    pub const fn new() -> Self {
        Self {
            travellers: [Traveller { start: [0.0; 4], inverse: [0.0; 4] }; LOT],
            ways: [[0.0; 4]; LOT],
            tmin: [0.0; LOT],
            tmax: [0.0; LOT],
            octants: [[0; LOT]; 8],
            counts: [0; 8],
            odd: [0; LOT / 8],
            thickness: 0.0,
        }
    }

    /// Takes all rays of up to [`LOT`] places, those of some eights, to be odd.
    pub fn leave(&mut self, rays: Source<'_>, eights: Range<usize>) {
        let places = 8 * eights.len();
        for (of_lot, eight) in eights.enumerate() {
            self.odd[of_lot] = rays.present(eight) as u8;
        }
        for traveller in &mut self.travellers[..places] {
            traveller.inverse[3] = f32::from_bits(NONE as u32);
        }
    }

    /// Makes the rays of up to [`LOT`] places ready, those of some eights. With `SHEARS`, shears are kept of them in place of
    /// directions.
    #[inline(always)]
    pub fn prepare<L: Eight, const SHEARS: bool>(
        &mut self,
        rays: Source<'_>,
        eights: Range<usize>,
        bounds: &Aabb,
    ) {
        self.counts = [0; 8];
        let mut greatest_reach = L::splat(0.0);
        for (of_lot, eight) in eights.enumerate() {
            let reach = self.prepare_eight::<L, SHEARS>(rays, eight, of_lot % (LOT / 8), bounds);
            greatest_reach = reach.max(greatest_reach);
        }
        self.thickness = greatest_reach.greatest() * MARGIN;
    }

    /// Eight of them, to be the lot's number `of_lot`; how far the scene reaches from each of those that meet it.
    #[inline(always)]
    fn prepare_eight<L: Eight, const SHEARS: bool>(
        &mut self,
        rays: Source<'_>,
        eight: usize,
        of_lot: usize,
        bounds: &Aabb,
    ) -> L {
        let ([[x, y, z, tnear], [dx, dy, dz, tfar]], present) = rays.eight::<L>(eight);
        let (origin, direction) = ([x, y, z], [dx, dy, dz]);
        let Ready { inverse, reach, tmin, tmax, closest, ordinary, flies, .. } =
            Ready::new(&origin, &direction, tnear, tfar, bounds);
        self.odd[of_lot] = (!ordinary & present) as u8;
        let place = 8 * of_lot;
        let room = "eights fill the lot";
        *self.tmin[place..].first_chunk_mut().expect(room) = tmin.store();
        *self.tmax[place..].first_chunk_mut().expect(room) = tmax.store();

        // (Where there is no ray, nobody looks for anything.)
        let nothing = L::splat(f32::from_bits(NONE as u32));
        let starts = rows([x, y, z, closest]);
        let inverses = rows([inverse[0], inverse[1], inverse[2], nothing]);
        for (lane, traveller) in self.travellers[place..].iter_mut().take(8).enumerate() {
            *traveller = Traveller { start: starts[lane], inverse: inverses[lane] };
        }
        let ([wx, wy, wz], [is_x, is_y]) =
            if SHEARS { shears(&origin, &direction) } else { (direction, [0xff, 0]) };
        *self.ways[place..].first_chunk_mut().expect(room) = rows([wx, wy, wz, tnear]);

        let zero = L::splat(0.0);
        let down = [inverse[0].lt(zero).bits(), inverse[1].lt(zero).bits(), inverse[2].lt(zero).bits()];
        let mut left = flies & present;
        while left != 0 {
            let lane = left.trailing_zeros() as usize & 7;
            left &= left - 1;
            let octant =
                (down[0] >> lane & 1 | (down[1] >> lane & 1) << 1 | (down[2] >> lane & 1) << 2) as usize;
            let axis = match (is_x >> lane & 1, is_y >> lane & 1) {
                (1, _) => 0,
                (_, 1) => AXIS,
                _ => 2 * AXIS,
            };
            let count = &mut self.counts[octant];
            self.octants[octant][*count % LOT] = (place + lane) as i32 + axis;
            *count += 1;
        }
        L::select(L::mask_from_bits(flies & present), reach, zero)
    }

    /// A ray's number in the lot.
    #[inline(always)]
    pub fn place(id: i32) -> usize {
        id as usize % LOT
    }

    /// The ids of the rays that run into an octant.
    #[inline(always)]
    pub fn octant(&self, octant: usize) -> &[i32] {
        &self.octants[octant][..self.counts[octant]]
    }

    /// Rays as planes see them.
    #[inline(always)]
    pub fn crossing<const W: usize, L: Dense<W>>(&self, ids: &[i32; W]) -> Crossing<L> {
        let nowhere = &[0.0; 4];
        let (mut starts, mut inverses) = ([nowhere; W], [nowhere; W]);
        for lane in 0..W {
            let traveller = &self.travellers[ids[lane] as usize % LOT];
            (starts[lane], inverses[lane]) = (&traveller.start, &traveller.inverse);
        }
        let [x, y, z, closest] = L::columns(&starts);
        let [inverse_x, inverse_y, inverse_z, _] = L::columns(&inverses);
        let thickness = L::splat(self.thickness);
        let margin = [thickness * inverse_x.abs(), thickness * inverse_y.abs(), thickness * inverse_z.abs()];
        Crossing { origin: [x, y, z], inverse: [inverse_x, inverse_y, inverse_z], margin, closest }
    }

    /// A ray as a line's planes see it, and where it ends.
    #[inline(always)]
    pub fn planes<L: Eight>(&self, id: i32, line: &Line) -> (Planes<L>, f32) {
        let traveller = &self.travellers[id as usize % LOT];
        let exits = L::ids_load(&line.exits);
        let origin = L::of_fours([&traveller.start; 2]).pick_in_fours(exits);
        let inverse = L::of_fours([&traveller.inverse; 2]).pick_in_fours(exits);
        let margin = L::splat(self.thickness) * inverse.abs();
        (Planes { exits, origin, inverse, margin }, traveller.start[3])
    }

    /// A ray as boxes see it, and where it ends.
    #[inline(always)]
    pub fn slabs(&self, id: i32) -> (Slabs, f32) {
        let Traveller { start: [x, y, z, closest], inverse: [by_x, by_y, by_z, _] } =
            self.travellers[id as usize % LOT];
        let inverse = [by_x, by_y, by_z];
        let margin = inverse.map(|inverse| self.thickness * inverse.abs());
        (Slabs::new(&[x, y, z], &inverse, &margin), closest)
    }

    /// How far the scene reaches from any of the rays.
    #[inline(always)]
    fn reach(&self) -> f32 {
        self.thickness / MARGIN
    }

    /// A sheared ray as pools see it, and between which ends it looks for hits.
    #[inline(always)]
    pub fn pooled(&self, id: i32) -> (Pooled, [f32; 2]) {
        let place = id as usize % LOT;
        let Traveller { start: [x, y, z, closest], .. } = self.travellers[place];
        let [sx, sy, scale, tnear] = self.ways[place];
        let axis = (id / AXIS) as usize;
        (Pooled::of_shear(&[x, y, z], [sx, sy, scale], axis, self.reach()), [tnear, closest])
    }

    /// Sheared rays likewise.
    #[inline(always)]
    pub fn listed<const W: usize, L: Dense<W>>(&self, ids: &[i32; W]) -> (Listed<W, L>, [L; 2]) {
        let nowhere = &[0.0; 4];
        let (mut starts, mut ways) = ([nowhere; W], [nowhere; W]);
        for lane in 0..W {
            let place = ids[lane] as usize % LOT;
            (starts[lane], ways[lane]) = (&self.travellers[place].start, &self.ways[place]);
        }
        let [x, y, z, closest] = L::columns(&starts);
        let [sx, sy, scale, tnear] = L::columns(&ways);
        let ids = L::ids_of(ids);
        let axes = [L::ids_less(ids, L::ids(AXIS)), L::ids_less(ids, L::ids(2 * AXIS))];
        (Listed::new(&[x, y, z], [sx, sy, scale], axes, self.reach()), [tnear, closest])
    }

    /// What a ray has found: what a hit must not lie beyond, and a triangle's id, or [`NONE`].
    #[inline(always)]
    pub fn found_by(&self, id: i32) -> (f32, i32) {
        let traveller = &self.travellers[id as usize % LOT];
        (traveller.start[3], traveller.inverse[3].to_bits() as i32)
    }

    /// Keeps what a ray has found.
    #[inline(always)]
    pub fn keep_one(&mut self, id: i32, t: f32, primitive: i32) {
        let traveller = &mut self.travellers[id as usize % LOT];
        traveller.start[3] = t;
        traveller.inverse[3] = f32::from_bits(primitive as u32);
    }

    /// What rays have found, and where they start.
    #[inline(always)]
    pub fn found<const W: usize, L: Dense<W>>(&self, ids: &[i32; W]) -> (Closest<W, L>, [L; 3]) {
        let nowhere = &[0.0; 4];
        let mut starts = [nowhere; W];
        let mut primitives = [0; W];
        for lane in 0..W {
            let traveller = &self.travellers[ids[lane] as usize % LOT];
            starts[lane] = &traveller.start;
            primitives[lane] = traveller.inverse[3].to_bits() as i32;
        }
        let [x, y, z, closest] = L::columns(&starts);
        (Closest::of_found(closest, L::ids_of(&primitives)), [x, y, z])
    }

    /// Rays' directions, or their shears, and `tnear`.
    #[inline(always)]
    pub fn ways<const W: usize, L: Dense<W>>(&self, ids: &[i32; W]) -> [L; 4] {
        let mut ways = [&[0.0; 4]; W];
        for lane in 0..W {
            ways[lane] = &self.ways[ids[lane] as usize % LOT];
        }
        L::columns(&ways)
    }

    /// What the rays from number `8 * eight` on have found.
    #[inline(always)]
    pub fn closest<L: Eight>(&self, eight: usize) -> Closest<8, L> {
        let first = 8 * eight as i32;
        let ids = [first, first + 1, first + 2, first + 3, first + 4, first + 5, first + 6, first + 7];
        self.found::<8, L>(&ids).0
    }

    /// Keeps what those of some rays have found whose bits are set.
    #[inline(always)]
    pub fn keep<const W: usize, L: Lanes<W>>(&mut self, ids: &[i32; W], bits: u32, found: &Closest<W, L>) {
        let (t, primitives) = (found.t.store(), found.primitives());
        self.keep_each(
            ids,
            bits,
            #[inline(always)]
            |lane| (t[lane], primitives[lane]),
        );
    }

    /// The same of what `found` gives for their lanes.
    #[inline(always)]
    pub fn keep_each<const W: usize>(
        &mut self,
        ids: &[i32; W],
        mut bits: u32,
        found: impl Fn(usize) -> (f32, i32),
    ) {
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize % W;
            bits &= bits - 1;
            let (t, primitive) = found(lane);
            self.keep_one(ids[lane], t, primitive);
        }
    }

    /// Of the rays from number `8 * eight` on, those that are left to the packet kernel.
    pub fn odd(&self, eight: usize) -> u32 {
        u32::from(self.odd[eight])
    }
}
