//! A page's triangles against a beam: culled, then tested.

use super::beam::{Beam, PACKETS};
use super::outline::{Block, Window};
use super::probe::Probe;
use crate::geometry::triangle::{Mode, Test};
use crate::kdtree::Tree;
use crate::simd::{Lanes, Mask};
use crate::traverse::closest::Closest;
use crate::traverse::lanes::RayPacket;
use crate::traverse::walk::{Interval, load3};

/// A tile's rays on their way.
pub struct Tile<'a, L: Lanes<16>, T: Tree, M: Mode, const ANY: bool> {
    pub tree: &'a T,
    pub records: &'a [M::Record],
    pub rays: &'a [RayPacket<16>],
    /// Which lanes of each packet count.
    pub active: &'a [u32; PACKETS],
    pub beam: &'a Beam<L>,
    /// The packets' tests, as the packet kernel makes them.
    pub tests: [M::Test<16, L>; PACKETS],
    pub closest: [Closest<16, L>; PACKETS],
    /// The depth beyond which no ray of a packet looks for anything any more.
    pub reach: [f32; PACKETS],
    /// What the packets see of the scene, depths apart.
    window: Window<L>,
    block: Block,
    /// The block's triangles that are left, as their test sees them from the beam's apex.
    placed: [<M::Test<16, L> as Test<16, L>>::Placed; 16],
}

impl<'a, L: Lanes<16>, T: Tree, M: Mode, const ANY: bool> Tile<'a, L, T, M, ANY> {
    #[inline(always)]
    pub fn new(
        tree: &'a T,
        records: &'a [M::Record],
        rays: &'a [RayPacket<16>],
        active: &'a [u32; PACKETS],
        beam: &'a Beam<L>,
    ) -> Self {
        let zero = [L::splat(0.0); 3];
        let mut tests = [M::Test::<16, L>::new(&zero, &zero, 0); PACKETS];
        let mut closest = [Closest::new(L::splat(f32::NEG_INFINITY)); PACKETS];
        for (packet, rays) in rays.iter().enumerate() {
            let counts = L::mask_from_bits(active[packet]);
            tests[packet] =
                M::Test::<16, L>::new(&load3(&rays.origin), &load3(&rays.direction), active[packet]);
            // Lanes that do not count have found what they look for.
            let tfar = L::select(counts, L::load(&rays.tfar), L::splat(f32::NEG_INFINITY));
            closest[packet] = Closest::new(tfar);
        }
        let [never, ever] = [L::splat(f32::NEG_INFINITY), L::splat(f32::INFINITY)];
        Self {
            tree,
            records,
            rays,
            active,
            beam,
            tests,
            closest,
            reach: [f32::INFINITY; PACKETS],
            window: Window::new(beam.low, beam.high, never, ever),
            block: Block::new(),
            placed: Default::default(),
        }
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
            // Cull for the beam.
            for (lane, &primitive) in primitives.iter().enumerate() {
                self.block.set(lane, self.tree.triangle(primitive), &self.beam.axes);
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
                self.placed[triangle] = M::Test::<16, L>::place(record, &self.beam.apex);
            }

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
        let test = &self.tests[packet];
        let mut closest = self.closest[packet];
        let tnear = L::load(&self.rays[packet].tnear);
        let live = L::mask_from_bits(self.active[packet]);
        let mut changed = false;
        for triangle in bits(chosen) {
            let primitive = primitives[triangle];
            let candidate = test.test_placed(&self.records[primitive as usize], &self.placed[triangle & 15], live);
            changed |= closest.take::<ANY>(&candidate, primitive, tnear, live);
        }
        if changed {
            self.closest[packet] = closest;
            self.shorten(packet);
        }
    }

    /// Draws a packet's reach in to what its rays still look for.
    #[inline(always)]
    pub fn shorten(&mut self, packet: usize) {
        self.reach[packet] = self.beam.depth(&self.rays[packet], self.closest[packet].t).greatest();
    }
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
