//! A page's triangles against a beam: culled, then tested.

use super::beam::{Beam, PACKETS};
use super::outline::{Block, Window};
use super::probe::Probe;
use crate::geometry::triangle::{Mode, Test};
use crate::kdtree::Tree;
use crate::simd::{Lanes, Mask};
use crate::traverse::closest::Closest;
use crate::traverse::lanes::{HitPacket, RayPacket};
use crate::traverse::packet::descend;
use crate::traverse::walk::{Interval, Walk};

/// The work after which a tile is given up: some five times what a tile takes whose rays are worth
/// tracing together. Rays that are not, because each packet's go all over the place, or because there are
/// many triangles between one ray and the next, would meet every triangle in a packet's window.
pub const WORK: u32 = 4096;

/// The work of a block, of culling a triangle for packets, and of a packet's test.
const BLOCK_WORK: u32 = 12;
const CULL_WORK: u32 = 3;
const TEST_WORK: u32 = 4;

/// Most parts that sixteen packets are traced in: halves, where registers hold eight lanes.
const PARTS: usize = 2 * PACKETS;

/// What the tests of `N` rays keep for a beam.
type Kept<M, R, const N: usize> = <<M as Mode>::Test<N, R> as Test<N, R>>::Kept;

/// A triangle as the tests see it from a beam's apex.
type Placed<M, R, const N: usize> = <<M as Mode>::Test<N, R> as Test<N, R>>::Placed;

/// A tile's rays on their way.
///
/// Packets stand in the lanes of `L`, as the beam has them. Rays stand in the lanes of `R`, as many as a
/// register holds: part `i` of packet `p` is at `p * (16 / N) + i`.
pub struct Tile<'a, L, R, T, M, const N: usize, const ANY: bool>
where
    L: Lanes<16>,
    R: Lanes<N>,
    T: Tree,
    M: Mode,
{
    pub tree: &'a T,
    pub records: &'a [M::Record],
    rays: &'a [RayPacket<16>],
    /// Which lanes of each packet count.
    active: &'a [u32; PACKETS],
    pub beam: &'a Beam<L>,
    kept: [Kept<M, R, N>; PARTS],
    closest: [Closest<N, R>; PARTS],
    /// The depth beyond which no ray of a packet looks for anything any more.
    pub reach: [f32; PACKETS],
    /// What was done for the tile so far, in steps of about one upper node.
    pub work: u32,
    /// What the packets see of the scene, depths apart.
    window: Window<L>,
    block: Block,
    /// The block's triangles that are left.
    placed: [Placed<M, R, N>; 16],
}

impl<'a, L, R, T, M, const N: usize, const ANY: bool> Tile<'a, L, R, T, M, N, ANY>
where
    L: Lanes<16>,
    R: Lanes<N>,
    T: Tree,
    M: Mode,
{
    /// The rays at their start.
    #[inline(always)]
    pub fn new(
        tree: &'a T,
        records: &'a [M::Record],
        rays: &'a [RayPacket<16>],
        active: &'a [u32; PACKETS],
        beam: &'a Beam<L>,
    ) -> Self {
        let [never, ever] = [L::splat(f32::NEG_INFINITY), L::splat(f32::INFINITY)];
        let mut tile = Self {
            tree,
            records,
            rays,
            active,
            beam,
            kept: [Default::default(); PARTS],
            closest: [Closest::new(R::splat(f32::NEG_INFINITY)); PARTS],
            reach: [f32::INFINITY; PACKETS],
            work: 0,
            window: Window::new(beam.low, beam.high, never, ever),
            block: Block::new(),
            placed: [Default::default(); 16],
        };
        for packet in 0..rays.len().min(PACKETS) {
            for part in 0..16 / N {
                let rays = &rays[packet];
                let place = packet * (16 / N) + part;
                let direction = load_part3::<N, R>(&rays.direction, part);
                tile.kept[place] = M::Test::<N, R>::keep(&direction, beam.axes[2]);
                // Lanes that do not count have found what they look for.
                let tfar = R::select(
                    tile.counts(packet, part),
                    load_part::<N, R>(&rays.tfar, part),
                    R::splat(f32::NEG_INFINITY),
                );
                tile.closest[place] = Closest::new(tfar);
            }
        }
        tile
    }

    /// The lanes of a part that count.
    #[inline(always)]
    fn counts(&self, packet: usize, part: usize) -> R::Mask {
        R::mask_from_bits(self.active[packet] >> (part * N) & ((1 << N) - 1))
    }

    /// A part's test.
    #[inline(always)]
    fn part_test(&self, packet: usize, part: usize) -> M::Test<N, R> {
        let direction = load_part3::<N, R>(&self.rays[packet].direction, part);
        let kept = &self.kept[packet * (16 / N) + part];
        M::Test::<N, R>::revive(kept, &self.beam.apex, &direction, self.beam.axes[2])
    }

    /// Writes a packet's hits.
    #[inline(always)]
    pub fn give(&self, packet: usize, hits: &mut HitPacket<16>) {
        for part in 0..16 / N {
            let test = self.part_test(packet, part);
            let again = if M::Test::<N, R>::DEFERS { Some(&test) } else { None };
            let found =
                self.closest[packet * (16 / N) + part].records::<T, M>(self.tree, self.records, again);
            *part_mut(&mut hits.t, part) = found.t;
            *part_mut(&mut hits.u, part) = found.u;
            *part_mut(&mut hits.v, part) = found.v;
            *part_mut(&mut hits.primitive, part) = found.primitive;
            for axis in 0..3 {
                *part_mut(&mut hits.normal[axis], part) = found.normal[axis];
            }
        }
    }

    /// A packet's lanes that found something.
    #[inline(always)]
    pub fn found(&self, packet: usize) -> u32 {
        let mut found = 0;
        for part in 0..16 / N {
            found |= self.closest[packet * (16 / N) + part].found() << (part * N);
        }
        found & self.active[packet]
    }

    /// Looks for hits among a page's triangles, for the packets in `live` in their depths.
    #[inline(always)]
    pub fn visit<P: Probe>(&mut self, page: &[u32], interval: &Interval<L>, live: u32, probe: &mut P) {
        if page.is_empty() {
            return;
        }
        probe.page(live.count_ones());
        let mut window = self.window;
        (window.nearest, window.farthest) = (interval.tmin, interval.tmax);
        let all = union(&window, L::mask_from_bits(live));
        for primitives in page.chunks(16) {
            if self.work > WORK {
                return;
            }
            self.work += BLOCK_WORK;
            // Cull for the beam.
            for (lane, &primitive) in primitives.iter().enumerate() {
                self.block.set(lane, self.tree.triangle(primitive));
            }
            let outline = self.block.outline(self.beam);
            let present = (1 << primitives.len()) - 1;
            let left = outline.meets(&all).bits() & present;
            probe.block(primitives.len(), left.count_ones());
            if left == 0 {
                continue;
            }

            for triangle in bits(left) {
                let record = &self.records[primitives[triangle] as usize];
                let Beam { apex, axes, sign, .. } = self.beam;
                self.placed[triangle & 15] =
                    M::Test::<N, R>::place(record, apex, axes[2], *sign, &self.block.edges_of(triangle));
            }

            self.work += left.count_ones().min(live.count_ones()) * CULL_WORK;

            // Cull for packets, the rarer of packets and triangles one by one.
            let mut chosen = [0; PACKETS];
            if left.count_ones() <= live.count_ones() {
                for triangle in bits(left) {
                    let meeting = self.block.one::<L>(triangle).meets(&window).bits() & live;
                    for packet in bits(meeting) {
                        chosen[packet & 15] |= 1 << triangle;
                    }
                }
            } else {
                for packet in bits(live) {
                    chosen[packet & 15] = outline.meets(&one(&window, packet)).bits() & left;
                }
            }

            // Test what is left.
            for packet in bits(live) {
                if chosen[packet & 15] != 0 {
                    self.work += chosen[packet & 15].count_ones() * TEST_WORK;
                    probe.tests(chosen[packet & 15].count_ones());
                    self.test(packet, primitives, chosen[packet & 15]);
                }
            }
            window.farthest = L::load(&self.reach).min(window.farthest);
        }
    }

    /// Tests one packet against the triangles in `chosen`.
    #[inline(always)]
    fn test(&mut self, packet: usize, primitives: &[u32], chosen: u32) {
        let packet = packet & 15;
        let mut changed = false;
        for part in 0..16 / N {
            let test = self.part_test(packet, part);
            let place = packet * (16 / N) + part;
            let mut closest = self.closest[place];
            let tnear = load_part::<N, R>(&self.rays[packet].tnear, part);
            let live = self.counts(packet, part);
            let mut part_changed = false;
            for triangle in bits(chosen) {
                let primitive = primitives[triangle];
                let placed = &self.placed[triangle & 15];
                let candidate = test.test_placed(&self.records[primitive as usize], placed, live);
                part_changed |=
                    closest.take::<ANY>(&candidate, primitive, tnear, live, !M::Test::<N, R>::DEFERS);
            }
            if part_changed {
                self.closest[place] = closest;
            }
            changed |= part_changed;
        }
        if changed {
            self.shorten(packet);
        }
    }

    /// Draws a packet's reach in to what its rays still look for.
    #[inline(always)]
    fn shorten(&mut self, packet: usize) {
        let mut reach = f32::NEG_INFINITY;
        for part in 0..16 / N {
            let speed = load_part::<N, R>(&self.rays[packet].direction[self.beam.axes[2]], part).abs();
            let depth = (self.closest[packet * (16 / N) + part].t * speed).greatest();
            reach = if depth > reach { depth } else { reach };
        }
        self.reach[packet] = reach + reach.abs() * ROUNDINGS;
    }

    /// One packet walks on by itself, through the full tree below a place of the upper one, from the
    /// depth `tmin` to `tmax`.
    #[inline(always)]
    pub fn go_alone(&mut self, packet: usize, place: usize, tmin: f32, tmax: f32) {
        let all = &self.rays[packet];
        let mut changed = false;
        for part in 0..16 / N {
            let rays = RayPacket::<N> {
                origin: [
                    *part_of(&all.origin[0], part),
                    *part_of(&all.origin[1], part),
                    *part_of(&all.origin[2], part),
                ],
                direction: [
                    *part_of(&all.direction[0], part),
                    *part_of(&all.direction[1], part),
                    *part_of(&all.direction[2], part),
                ],
                tnear: *part_of(&all.tnear, part),
                tfar: *part_of(&all.tfar, part),
            };
            let active = self.active[packet] >> (part * N) & ((1 << N) - 1);
            let (walk, inside) = Walk::<N, R>::new(&rays, active, self.tree.bounds());
            let speed = R::load(&rays.direction[self.beam.axes[2]]).abs();
            let mut closest = self.closest[packet * (16 / N) + part];
            let interval = Interval {
                tmin: (R::splat(tmin - tmin.abs() * ROUNDINGS) / speed).max(inside.tmin),
                tmax: (R::splat(tmax + tmax.abs() * ROUNDINGS) / speed).min(inside.tmax).min(closest.t),
            };
            if interval.live().any() {
                let test = self.part_test(packet, part);
                let tnear = R::load(&rays.tnear);
                let node = self.tree.beneath(place);
                descend::<N, R, T, M, ANY>(
                    self.tree,
                    self.records,
                    &walk,
                    &test,
                    tnear,
                    node,
                    interval,
                    &mut closest,
                );
                self.closest[packet * (16 / N) + part] = closest;
                changed = true;
            }
        }
        if changed {
            self.shorten(packet);
        }
    }
}

/// What depths are widened by, relative to themselves.
const ROUNDINGS: f32 = 1.0 / (1 << 20) as f32;

/// A part of a packet's row.
#[inline(always)]
fn part_of<const N: usize, V>(row: &[V; 16], part: usize) -> &[V; N] {
    &row.as_chunks::<N>().0[part]
}

#[inline(always)]
fn part_mut<const N: usize, V>(row: &mut [V; 16], part: usize) -> &mut [V; N] {
    &mut row.as_chunks_mut::<N>().0[part]
}

#[inline(always)]
fn load_part<const N: usize, R: Lanes<N>>(row: &[f32; 16], part: usize) -> R {
    R::load(part_of(row, part))
}

#[inline(always)]
fn load_part3<const N: usize, R: Lanes<N>>(rows: &[[f32; 16]; 3], part: usize) -> [R; 3] {
    [load_part(&rows[0], part), load_part(&rows[1], part), load_part(&rows[2], part)]
}

/// What some of a window's packets see together.
#[inline(always)]
fn union<L: Lanes<16>>(window: &Window<L>, packets: L::Mask) -> Window<L> {
    let (low, high) = (L::splat(f32::INFINITY), L::splat(f32::NEG_INFINITY));
    Window::new(
        [
            L::splat(L::select(packets, window.low[0], low).least()),
            L::splat(L::select(packets, window.low[1], low).least()),
        ],
        [
            L::splat(L::select(packets, window.high[0], high).greatest()),
            L::splat(L::select(packets, window.high[1], high).greatest()),
        ],
        L::splat(L::select(packets, window.nearest, low).least()),
        L::splat(L::select(packets, window.farthest, high).greatest()),
    )
}

/// What one packet sees.
#[inline(always)]
fn one<L: Lanes<16>>(window: &Window<L>, packet: usize) -> Window<L> {
    Window {
        low: [window.low[0].lane(packet), window.low[1].lane(packet)],
        high: [window.high[0].lane(packet), window.high[1].lane(packet)],
        center: [window.center[0].lane(packet), window.center[1].lane(packet)],
        half: [window.half[0].lane(packet), window.half[1].lane(packet)],
        nearest: window.nearest.lane(packet),
        farthest: window.farthest.lane(packet),
    }
}

/// The places of the bits that are set.
#[inline(always)]
fn bits(mut set: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = (set != 0).then(|| set.trailing_zeros() as usize)?;
        set &= set - 1;
        Some(place)
    })
}
