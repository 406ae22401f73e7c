//! The walk of the upper tree, and a page's triangles against a beam: culled, then handed on to be
//! tested.

use super::FEW;
use super::beam::{Beam, Extent};
use super::bundle::{Bundle, packet_of, packets_of};
use super::outline::{Block, Outline, Window};
use super::pairs::Pairs;
use super::probe::Probe;
use crate::kdtree::Tree;
use crate::simd::{Mask, Sixteen, prefetch_both, stay_a_branch};
use crate::traverse::stack::Stack;
use crate::traverse::walk::Interval;

/// The work of a block, of culling a triangle for packets, and of a packet's test, in steps of about one
/// upper node.
const BLOCK_WORK: u32 = 12;
const CULL_WORK: u32 = 3;
const TEST_WORK: u32 = 4;

/// So many triangles, or fewer, are culled for packets at once, and not for a wide beam's squares before.
const FEW_TRIANGLES: u32 = 2;

/// A subtree that waits for its turn, with the packets' depths in it.
#[derive(Clone, Copy)]
struct Waiting<L> {
    place: usize,
    interval: Interval<L>,
}

impl<L: Sixteen> Waiting<L> {
    /// The depths in it that are of interest yet.
    #[inline(always)]
    fn until(&self, reach: L) -> Interval<L> {
        Interval { tmin: self.interval.tmin, tmax: reach.min(self.interval.tmax) }
    }
}

/// What a square's packets see of a page, depths alone.
#[derive(Clone, Copy)]
struct Part<L> {
    nearest: L,
    farthest: L,
    /// The packets for which that is anything.
    live: u32,
    /// What they see together, once it is asked for.
    all: Option<Window<L>>,
}

/// What a square's packets see of a block.
struct View<'a, L> {
    square: usize,
    window: &'a Window<L>,
    /// The packets that see anything.
    live: u32,
}

/// What is left of a block.
struct Left<'a, L, const PARALLEL: bool> {
    outline: &'a Outline<L, PARALLEL>,
    /// The ids of all of its triangles.
    primitives: &'a [u32],
    /// Those that are left.
    triangles: u32,
}

/// A bundle of rays on its way down the upper tree.
pub struct Descent<'a, L, T, const PARALLEL: bool, const K: usize> {
    tree: &'a T,
    beam: &'a Beam<L, PARALLEL>,
    /// What the lanes see of the scene, depths apart.
    lanes: Window<L>,
    /// What each square's packets do. A square alone is what the lanes are.
    squares: &'a [Window<L>; K],
    block: Block,
    pairs: Pairs,
    /// What was done so far.
    work: u32,
}

impl<'a, L: Sixteen, T: Tree, const PARALLEL: bool, const K: usize> Descent<'a, L, T, PARALLEL, K> {
    /// A bundle for whose tile so much work was done before.
    #[inline(always)]
    pub fn new(tree: &'a T, beam: &'a Beam<L, PARALLEL>, squares: &'a [Window<L>; K], work: u32) -> Self {
        let [never, ever] = [L::splat(f32::NEG_INFINITY), L::splat(f32::INFINITY)];
        let lanes = Window::new(beam.low, beam.high, never, ever, beam.spread.blur::<PARALLEL>());
        Self { tree, beam, lanes, squares, block: Block::new(), pairs: Pairs::none(), work }
    }

    /// Walks the upper tree with all packets of a tile, in which they are in `interval`. Gives the work that this took beside
    /// what was done before, or `None` if that was so much that it was given up, and each packet went on alone through the rest.
    #[inline(always)]
    pub fn walk<B: Bundle<L, K>, P: Probe>(
        mut self,
        bundle: &mut B,
        mut interval: Interval<L>,
        probe: &mut P,
    ) -> Option<u32> {
        let (tree, beam) = (self.tree, self.beam);
        let mut live = interval.live().bits();
        if live == 0 {
            return Some(self.work);
        }

        // Packets whose rays are not alike go on alone at once: with them, all would see too much.
        let width = (beam.high[0] - beam.low[0]).max(beam.high[1] - beam.low[1]);
        let narrow = width.le(L::splat(B::WIDEST));
        let loose = live & !narrow.bits();
        if loose != 0 {
            go_alone(bundle, &interval, loose, 0, probe);
            live &= !loose;
            if live == 0 {
                return Some(self.work);
            }
            interval.tmin = L::select(narrow, interval.tmin, L::splat(f32::INFINITY));
        }
        let start = interval;
        let mut place = 0;
        let mut node = tree.upper(place);
        let mut stack = Stack::new();
        loop {
            // Descend to a page, leaving far children on the stack.
            let mut nodes = 0;
            loop {
                nodes += 1;
                probe.node(live.count_ones());
                if node.is_leaf() {
                    tree.enter_page(node);
                    // It waits, too, until nothing is left of it. (Kept in registers meanwhile, it cost shadow rays a tenth.)
                    if B::TAKES_UP_THE_REST {
                        stack.push(Waiting { place, interval });
                    }
                    self.visit(bundle, tree.page(node), &interval, live, probe);
                    if B::TAKES_UP_THE_REST && self.work <= B::PATIENCE * K as u32 {
                        stack.pop();
                    }
                    break;
                }
                if live.count_ones() <= FEW {
                    go_alone(bundle, &interval, live, place, probe);
                    break;
                }
                let crossing = beam.crossing(node.axis(), node.split());
                let near = Interval { tmin: interval.tmin, tmax: crossing.leave.min(interval.tmax) };
                let far = Interval { tmin: crossing.enter.max(interval.tmin), tmax: interval.tmax };
                let (in_near, in_far) = (near.live().bits(), far.live().bits());
                let below = node.below() as usize;
                let (near_place, far_place) = (below + crossing.near, below + (1 - crossing.near));
                if in_far == 0 {
                    // Whoever was live still is: the near cell holds all that is left.
                    stay_a_branch();
                    place = near_place;
                } else if in_near == 0 {
                    place = far_place;
                } else {
                    stack.push(Waiting { place: far_place, interval: far });
                    (place, interval, live) = (near_place, near, in_near);
                }
                node = tree.upper(place);
            }

            // Where it does not pay, each packet goes on alone: from the start, with what was found as its bound, or through
            // all that waits.
            self.work += nodes;
            if self.work > B::PATIENCE * K as u32 {
                if !B::TAKES_UP_THE_REST {
                    let interval = Waiting { place: 0, interval: start }.until(bundle.reach_of_lanes());
                    go_alone(bundle, &interval, interval.live().bits(), 0, probe);
                    return None;
                }
                while let Some(next) = stack.pop() {
                    let interval = next.until(bundle.reach_of_lanes());
                    go_alone(bundle, &interval, interval.live().bits(), next.place, probe);
                }
                return None;
            }

            // Take up the next subtree that some packet can still find something in.
            loop {
                let Some(next) = stack.pop() else { return Some(self.work) };
                interval = next.until(bundle.reach_of_lanes());
                live = interval.live().bits();
                if live != 0 {
                    place = next.place;
                    break;
                }
            }
            node = tree.upper(place);
        }
    }

    /// Looks for hits among a page's triangles, for the packets in `live` in their depths.
    #[inline(always)]
    fn visit<B: Bundle<L, K>, P: Probe>(
        &mut self,
        bundle: &mut B,
        page: &[u32],
        interval: &Interval<L>,
        live: u32,
        probe: &mut P,
    ) {
        if page.is_empty() {
            return;
        }
        probe.page(live.count_ones());
        let blur = self.beam.spread.blur::<PARALLEL>();
        let lanes = Window { nearest: interval.tmin, farthest: interval.tmax, ..self.lanes };
        let all = union(&lanes, L::mask_from_bits(live), blur);

        let mut window = lanes;
        let mut squares = None;
        let mut blocks = page.chunks(16);
        let mut next = blocks.next();
        while let Some(primitives) = next {
            if self.work > B::PATIENCE * K as u32 {
                return;
            }
            next = blocks.next();
            for &primitive in next.unwrap_or_default() {
                prefetch_both(&raw const *self.tree.triangle(primitive));
            }
            self.work += BLOCK_WORK;

            // Cull for the beam.
            self.block.fill::<L, _>(primitives, self.tree);
            let outline = self.block.outline(self.beam);
            let present = (1 << primitives.len()) - 1;
            let left = outline.meets(&all).bits() & present;
            probe.block(primitives.len(), left.count_ones());
            if left == 0 {
                continue;
            }
            self.block.keep(&outline, &self.beam.frame);

            if K == 1 {
                let view = View { square: 0, window: &window, live };
                let left = Left { outline: &outline, primitives, triangles: left };
                self.visit_square(bundle, &view, &left, probe);
                window.farthest = bundle.reach(0).min(window.farthest);
                continue;
            }
            let squares: &mut [Part<L>; K] = match &mut squares {
                Some(squares) => squares,
                none => none.insert(self.parts(bundle, interval, live)),
            };
            for square in 0..K {
                let part = &mut squares[square];
                if part.live == 0 {
                    continue;
                }
                // Cull for the square, if that may spare more than it takes.
                let window =
                    Window { nearest: part.nearest, farthest: part.farthest, ..self.squares[square] };
                let mut triangles = left;
                if triangles.count_ones() > FEW_TRIANGLES {
                    let all = match part.all {
                        Some(all) => all,
                        None => union(&window, L::mask_from_bits(part.live), blur),
                    };
                    part.all = Some(all);
                    triangles &= outline.meets(&all).bits();
                    if triangles == 0 {
                        continue;
                    }
                }
                let view = View { square, window: &window, live: part.live };
                let left = Left { outline: &outline, primitives, triangles };
                self.visit_square(bundle, &view, &left, probe);
                part.farthest = bundle.reach(square).min(part.farthest);
            }
        }
    }

    /// What the squares' packets see between the depths in which the lanes in `live` are in a page.
    #[inline(always)]
    fn parts<B: Bundle<L, K>>(&self, bundle: &B, interval: &Interval<L>, live: u32) -> [Part<L>; K] {
        let mut parts = [Part { nearest: interval.tmin, farthest: interval.tmax, live, all: None }; K];
        for square in 0..K {
            let part = &mut parts[square];
            part.nearest = interval.tmin.spread(square);
            part.farthest = bundle.reach(square).min(interval.tmax.spread(square));
            part.live = packets_of::<K>(live, square) & part.nearest.le(part.farthest).bits();
        }
        parts
    }

    /// Looks for hits of a square's packets among the triangles that are left of a block.
    #[inline(always)]
    fn visit_square<B: Bundle<L, K>, P: Probe>(
        &mut self,
        bundle: &mut B,
        view: &View<'_, L>,
        left: &Left<'_, L, PARALLEL>,
        probe: &mut P,
    ) {
        let View { square, window, live } = *view;
        let Left { outline, primitives, triangles } = *left;

        // Cull for packets, the rarer of packets and triangles one by one.
        self.work += triangles.count_ones().min(live.count_ones()) * CULL_WORK;
        self.pairs.clear();
        if triangles.count_ones() <= live.count_ones() {
            for triangle in bits(triangles) {
                let packets = self.block.one::<L, PARALLEL>(triangle).meets(window).bits() & live;
                self.pairs.add_packets::<L>(triangle, packets);
            }
        } else {
            let rows = window.rows();
            for packet in bits(live) {
                let triangles = outline.meets(&rows.one(packet)).bits() & triangles;
                self.pairs.add_triangles::<L>(packet, triangles);
            }
        }

        // Test what is left.
        let tests = self.pairs.len() as u32;
        if tests != 0 {
            self.work += tests * TEST_WORK;
            probe.tests(tests);
            bundle.test(square, &self.pairs, &self.block, primitives);
        }
    }
}

/// Packets go on alone below a place of the upper tree.
#[inline(always)]
fn go_alone<L: Sixteen, B: Bundle<L, K>, P: Probe, const K: usize>(
    bundle: &mut B,
    interval: &Interval<L>,
    lanes: u32,
    place: usize,
    probe: &mut P,
) {
    probe.alone(lanes.count_ones() * K as u32);
    let (tmin, tmax) = (interval.tmin.store(), interval.tmax.store());
    for lane in bits(lanes) {
        for k in 0..K {
            let (square, packet) = packet_of::<K>(lane & 15, k);
            bundle.go_alone(square, packet, place, tmin[lane & 15], tmax[lane & 15]);
        }
    }
}

/// What squares' packets see of the scene, depths apart.
#[inline(always)]
pub fn windows<L: Sixteen, const K: usize>(extents: &[Extent<L>; K], blur: f32) -> [Window<L>; K] {
    let [never, ever] = [L::splat(f32::NEG_INFINITY), L::splat(f32::INFINITY)];
    let mut windows = [Window::new(extents[0].low, extents[0].high, never, ever, blur); K];
    for square in 1..K {
        let Extent { low, high, .. } = extents[square];
        windows[square] = Window::new(low, high, never, ever, blur);
    }
    windows
}

/// What some of a window's packets see together.
#[inline(always)]
fn union<L: Sixteen>(window: &Window<L>, packets: L::Mask, blur: f32) -> Window<L> {
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
        blur,
    )
}

/// The places of the bits that are set.
#[inline(always)]
pub fn bits(mut set: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = (set != 0).then(|| set.trailing_zeros() as usize)?;
        set &= set - 1;
        Some(place)
    })
}
