//! A lot of rays: where each starts, how it runs, and what it has found.

use crate::geometry::Aabb;
use crate::geometry::triangle::pooled::{Listed, Pooled, shears};
use crate::kdtree::Line;
use crate::simd::{Dense, Eight, Lanes, Mask, Sixteen, TAGS};
use crate::traverse::closest::{Closest, NONE};
use crate::traverse::kernel::Kernel;
use crate::traverse::pool::step::Slabs;
use crate::traverse::ready::Ready;
use crate::traverse::source::Source;
use crate::traverse::stream::step::Planes;
use crate::traverse::walk::MARGIN;
use std::ops::Range;

/// Rays in a lot.
pub const LOT: usize = Kernel::Filter.width();

/// A ray's id is its number in the lot, and of a sheared ray the greatest axis of its direction as well, so many times over. Whoever
/// is given an id may be given one that a float is tagged with.
const AXIS: i32 = LOT as i32;

const _: () = assert!(3 * AXIS <= TAGS + 1);

/// Where a ray ends that is done: before anything.
pub const DONE: f32 = f32::NEG_INFINITY;

/// A ray on its way, in half a cache line.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
struct Traveller {
    /// Its origin, and what a hit must not lie beyond: the closest `t`, or `tfar`. Of a ray that is done less than
    /// anything.
    start: [f32; 4],
    /// 1 / direction, and the bits of the closest triangle's id, or of [`NONE`]. Of a sheared ray that asks for any hit where it is
    /// inside the scene's bounds from.
    inverse: [f32; 4],
}

impl Traveller {
    /// One that has found nothing.
    const NONE: Self = Self { start: [0.0; 4], inverse: [0.0, 0.0, 0.0, f32::from_bits(NONE as u32)] };
}

/// Rays of a list as planes see them.
pub struct Crossing<L> {
    pub origin: [L; 3],
    pub inverse: [L; 3],
    /// The walls' half-thickness in units of the parameter.
    pub margin: [L; 3],
    /// Where each ray ends.
    pub closest: L,
    /// Where each begins, if that is kept with it.
    pub begin: L,
}

/// Where each number stands of four rows of four side by side.
static COLUMNS: [[i32; 4]; 4] = [[0, 4, 8, 12], [1, 5, 9, 13], [2, 6, 10, 14], [3, 7, 11, 15]];

/// The rays that run into an octant, one after the other, and room for a register.
#[derive(Clone)]
pub struct Octant {
    ids: [i32; LOT + 16],
    tmax: [f32; LOT + 16],
    count: usize,
}

impl Octant {
    const NONE: Self = Self { ids: [0; LOT + 16], tmax: [0.0; LOT + 16], count: 0 };

    /// Puts those rays there whose bits are set, and where they end, if that is kept.
    #[inline(always)]
    fn put<L: Sixteen>(&mut self, bits: u32, tagged: L::Ids, tmax: Option<L>) {
        let (at, room) = (self.count % (LOT + 1), "a register behind the last");
        L::ids_compact(tagged, bits, self.ids[at..].first_chunk_mut().expect(room));
        if let Some(tmax) = tmax {
            tmax.compact(bits, self.tmax[at..].first_chunk_mut().expect(room));
        }
        self.count = at + bits.count_ones() as usize;
    }

    /// Their ids, each tagged to where the ray begins inside of the scene's bounds.
    #[inline(always)]
    pub fn ids(&self) -> &[i32] {
        &self.ids[..self.count]
    }

    /// Where they end inside of the scene's bounds, if that is kept.
    #[inline(always)]
    pub fn tmax(&self) -> &[f32] {
        &self.tmax[..self.count]
    }
}

/// The rays. (In this order, so that no row crosses lines of the cache.)
#[repr(C, align(64))]
pub struct Lot {
    travellers: [Traveller; LOT],
    /// Their directions, or [shears], and `tnear`.
    ways: [[f32; 4]; LOT],
    /// The ids of the rays that run into each octant, with where they are inside the scene's bounds, and how many these are. Bit 0
    /// of an octant's number says that they run down along x.
    octants: Box<[Octant; 8]>,
    /// For each sixteen rays, those whose numbers lie near the ends of the floats' range, or that are none.
    odd: [u16; LOT / 16],
    /// Half the thickness of walls: that of the ray to which the scene reaches farthest.
    thickness: f32,
}

impl Lot {
    /// A lot that nothing is known of.
    pub fn new() -> Self {
        Self {
            travellers: [Traveller::NONE; LOT],
            ways: [[0.0; 4]; LOT],
            octants: Box::new([const { Octant::NONE }; 8]),
            odd: [0; LOT / 16],
            thickness: 0.0,
        }
    }

    /// Takes all rays of up to [`LOT`] places, those of some sixteens, to be odd.
    pub fn leave(&mut self, rays: Source<'_>, sixteens: Range<usize>) {
        let places = 16 * sixteens.len();
        for (of_lot, sixteen) in sixteens.enumerate() {
            self.odd[of_lot] = rays.present(sixteen) as u16;
        }
        self.travellers[..places].fill(Traveller::NONE);
    }

    /// Makes the rays of up to [`LOT`] places ready, those of some sixteens. With `SHEARS`, shears are kept of them in place of
    /// directions, and not where they end inside of the scene's bounds. With `BEGIN`, it is kept with each where it begins; without,
    /// the id of what it has found.
    #[inline(always)]
    pub fn prepare<L: Sixteen, const SHEARS: bool, const BEGIN: bool>(
        &mut self,
        rays: Source<'_>,
        sixteens: Range<usize>,
        bounds: &Aabb,
    ) {
        self.octants.iter_mut().for_each(|octant| octant.count = 0);
        let mut greatest_reach = L::splat(0.0);
        for (of_lot, sixteen) in sixteens.enumerate() {
            let of_lot = of_lot % (LOT / 16);
            let reach = self.prepare_sixteen::<L, SHEARS, BEGIN>(rays, sixteen, of_lot, bounds);
            greatest_reach = reach.max(greatest_reach);
        }
        self.thickness = greatest_reach.greatest() * MARGIN;
    }

    /// Sixteen of them, to be the lot's number `of_lot`; how far the scene reaches from each of those that meet it.
    #[inline(always)]
    fn prepare_sixteen<L: Sixteen, const SHEARS: bool, const BEGIN: bool>(
        &mut self,
        rays: Source<'_>,
        sixteen: usize,
        of_lot: usize,
        bounds: &Aabb,
    ) -> L {
        let ([[x, y, z, tnear], [dx, dy, dz, tfar]], present) = rays.sixteen::<L>(sixteen);
        let (origin, direction) = ([x, y, z], [dx, dy, dz]);
        let Ready { inverse, reach, tmin, tmax, closest, ordinary, flies, .. } =
            Ready::new(&origin, &direction, tnear, tfar, bounds);
        // Beginnings that are tagged are not negative.
        let ordinary = ordinary & L::splat(0.0).le(tnear).bits();
        self.odd[of_lot] = (!ordinary & present) as u16;
        let flies = flies & ordinary & present;
        let fly = L::mask_from_bits(flies);

        // Who does not fly has found nothing, wherever it ends.
        let closest = L::select(fly, closest, L::splat(f32::MAX));
        let nothing = L::splat(f32::from_bits(NONE as u32));
        let starts = L::fours(&[x, y, z, closest]);
        let last = if BEGIN { tmin } else { nothing };
        let inverses = L::fours(&[inverse[0], inverse[1], inverse[2], last]);
        let everybody = L::mask_from_bits(0xffff);
        let (way, [is_x, is_y]) =
            if SHEARS { shears(&origin, &direction) } else { (direction, [everybody; 2]) };
        let place = 16 * of_lot;
        for (lane, traveller) in self.travellers[place..].iter_mut().take(16).enumerate() {
            *traveller = Traveller { start: starts[lane], inverse: inverses[lane] };
        }
        let room = "sixteens fill the lot";
        *self.ways[place..].first_chunk_mut().expect(room) = L::fours(&[way[0], way[1], way[2], tnear]);

        // Each to its octant.
        let mut ids = [[0; 16]; 3];
        for (axis, ids) in ids.iter_mut().enumerate() {
            for (lane, id) in ids.iter_mut().enumerate() {
                *id = (place + lane) as i32 + axis as i32 * AXIS;
            }
        }
        let [if_x, if_y, if_z] = [L::ids_load(&ids[0]), L::ids_load(&ids[1]), L::ids_load(&ids[2])];
        let ids = L::ids_select(is_x, if_x, L::ids_select(is_y, if_y, if_z));
        let (tagged, tmax) = (tmin.tag(ids), (!SHEARS).then_some(tmax));
        let zero = L::splat(0.0);
        let down = [inverse[0].lt(zero).bits(), inverse[1].lt(zero).bits(), inverse[2].lt(zero).bits()];
        for (number, octant) in self.octants.iter_mut().enumerate() {
            let mut bits = flies;
            for (axis, down) in down.iter().enumerate() {
                bits &= if number >> axis & 1 == 1 { *down } else { !down };
            }
            octant.put::<L>(bits, tagged, tmax);
        }
        L::select(fly, reach, zero)
    }

    /// A ray's number in the lot.
    #[inline(always)]
    pub fn place(id: i32) -> usize {
        id as usize % LOT
    }

    /// The rays that run into an octant.
    #[inline(always)]
    pub fn octant(&self, octant: usize) -> &Octant {
        &self.octants[octant]
    }

    /// Rays as planes see them.
    #[inline(always)]
    pub fn crossing<const W: usize, L: Dense<W>>(&self, ids: &[i32; W]) -> Crossing<L> {
        let nowhere = &[0.0; 4];
        let (mut starts, mut inverses) = ([nowhere; W], [nowhere; W]);
        for lane in 0..W {
            let traveller = &self.travellers[Self::place(ids[lane])];
            (starts[lane], inverses[lane]) = (&traveller.start, &traveller.inverse);
        }
        self.crossing_of(L::columns(&starts), L::columns(&inverses))
    }

    /// Four rays as boxes see them, in lanes `4 * i`, `4 * i + 1`, and so on, for each `i`.
    #[inline(always)]
    pub fn crossing_of_four<L: Sixteen>(&self, ids: &[i32; 4]) -> Crossing<L> {
        let travellers = ids.map(|id| &self.travellers[Self::place(id)]);
        let starts = L::side_by_side(travellers.map(|traveller| &traveller.start));
        let inverses = L::side_by_side(travellers.map(|traveller| &traveller.inverse));
        let [first, second, third, fourth] = [
            L::ids_of_four(&COLUMNS[0]),
            L::ids_of_four(&COLUMNS[1]),
            L::ids_of_four(&COLUMNS[2]),
            L::ids_of_four(&COLUMNS[3]),
        ];
        self.crossing_of(
            [starts.pick(first), starts.pick(second), starts.pick(third), starts.pick(fourth)],
            [inverses.pick(first), inverses.pick(second), inverses.pick(third), inverses.pick(fourth)],
        )
    }

    /// Rays whose numbers stand in columns.
    #[inline(always)]
    fn crossing_of<const W: usize, L: Lanes<W>>(
        &self,
        [x, y, z, closest]: [L; 4],
        [inverse_x, inverse_y, inverse_z, begin]: [L; 4],
    ) -> Crossing<L> {
        let thickness = L::splat(self.thickness);
        let margin = [thickness * inverse_x.abs(), thickness * inverse_y.abs(), thickness * inverse_z.abs()];
        Crossing { origin: [x, y, z], inverse: [inverse_x, inverse_y, inverse_z], margin, closest, begin }
    }

    /// A ray as a line's planes see it, and where it ends.
    #[inline(always)]
    pub fn planes<L: Eight>(&self, id: i32, line: &Line) -> (Planes<L>, f32) {
        let traveller = &self.travellers[Self::place(id)];
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
            self.travellers[Self::place(id)];
        let inverse = [by_x, by_y, by_z];
        let margin = inverse.map(|inverse| self.thickness * inverse.abs());
        (Slabs::new(&[x, y, z], &inverse, &margin), closest)
    }

    /// Where a ray begins, if that is kept with it.
    #[inline(always)]
    pub fn begin(&self, id: i32) -> f32 {
        self.travellers[Self::place(id)].inverse[3]
    }

    /// A sheared ray as pools see it, and between which ends it looks for hits.
    #[inline(always)]
    pub fn pooled(&self, id: i32) -> (Pooled, [f32; 2]) {
        let place = Self::place(id);
        let Traveller { start: [x, y, z, closest], .. } = self.travellers[place];
        let [sx, sy, scale, tnear] = self.ways[place];
        let axis = ((id & TAGS) / AXIS) as usize;
        (Pooled::of_shear(&[x, y, z], [sx, sy, scale], axis), [tnear, closest])
    }

    /// Sheared rays likewise.
    #[inline(always)]
    pub fn listed<const W: usize, L: Dense<W>>(&self, ids: &[i32; W]) -> (Listed<W, L>, [L; 2]) {
        let nowhere = &[0.0; 4];
        let mut starts = [nowhere; W];
        for lane in 0..W {
            starts[lane] = &self.travellers[Self::place(ids[lane])].start;
        }
        let [x, y, z, closest] = L::columns(&starts);
        let [sx, sy, scale, tnear] = self.ways::<W, L>(ids);
        let ids = L::tags(L::ids_of(ids));
        let axes = [L::ids_less(ids, L::ids(AXIS)), L::ids_less(ids, L::ids(2 * AXIS))];
        (Listed::new(&[x, y, z], [sx, sy, scale], axes), [tnear, closest])
    }

    /// What a ray has found: what a hit must not lie beyond, and a triangle's id, or [`NONE`].
    #[inline(always)]
    pub fn found_by(&self, id: i32) -> (f32, i32) {
        let traveller = &self.travellers[Self::place(id)];
        (traveller.start[3], traveller.inverse[3].to_bits() as i32)
    }

    /// A ray that asks for any hit is done.
    #[inline(always)]
    pub fn end(&mut self, id: i32) {
        self.travellers[Self::place(id)].start[3] = DONE;
    }

    /// Keeps what a ray has found.
    #[inline(always)]
    pub fn keep_one(&mut self, id: i32, t: f32, primitive: i32) {
        let traveller = &mut self.travellers[Self::place(id)];
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
            let traveller = &self.travellers[Self::place(ids[lane])];
            starts[lane] = &traveller.start;
            primitives[lane] = traveller.inverse[3].to_bits() as i32;
        }
        let [x, y, z, closest] = L::columns(&starts);
        (Closest::of_found(closest, L::ids_of(&primitives), [L::splat(0.0); 2]), [x, y, z])
    }

    /// Rays' directions, or their shears, and `tnear`.
    #[inline(always)]
    pub fn ways<const W: usize, L: Dense<W>>(&self, ids: &[i32; W]) -> [L; 4] {
        let mut ways = [&[0.0; 4]; W];
        for lane in 0..W {
            ways[lane] = &self.ways[Self::place(ids[lane])];
        }
        L::columns(&ways)
    }

    /// The triangles that the rays from number `16 * sixteen` on have found, or [`NONE`], where it is kept.
    #[inline(always)]
    pub fn primitives(&self, sixteen: usize) -> [i32; 16] {
        let travellers: &[Traveller; 16] =
            self.travellers[16 * sixteen..].first_chunk().expect("sixteens fill the lot");
        std::array::from_fn(|lane| travellers[lane].inverse[3].to_bits() as i32)
    }

    /// A bit for each of those rays that is done.
    #[inline(always)]
    pub fn done(&self, sixteen: usize) -> u32 {
        let travellers = self.travellers[16 * sixteen..].iter().take(16);
        let done = travellers.map(|traveller| u32::from(traveller.start[3] == DONE));
        done.enumerate().fold(0, |bits, (lane, done)| bits | done << lane)
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

    /// Of those rays, the ones that are left to the packet kernel.
    pub fn odd(&self, sixteen: usize) -> u32 {
        u32::from(self.odd[sixteen])
    }
}
