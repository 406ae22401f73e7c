//! The tile kernel: up to 256 rays from one point, or 1024, walk the tree together.
//!
//! Neighbouring rays of a picture visit the same nodes and miss the same triangles. So what a packet
//! does for its rays, this kernel does for packets: each lane stands for one of sixteen packets, by
//! *intervals* that hold what all of its rays do (multi-level ray tracing: Reshetov, Soupikov & Hurley
//! 2005; interval traversal: Boulos, Wald & Benthin 2008). In order:
//!
//! 1. `form`: the rays are made a beam (`beam`); that decides whether they are alike enough at all.
//!    They are if they part from one point, run toward one, or are parallel. Rays that run fastest along another axis
//!    make another beam: a packet may be part of two.
//! 2. `page`: the beam descends the *upper tree*, whose leaves are pages of some fifty triangles, near
//!    cells first.
//! 3. `outline`: of a page's triangles, sixteen at a time, those that no ray can hit are culled: first
//!    for the whole beam, then for single packets. What is left is a list of `pairs`.
//! 4. `nearest`: what is left is tested by the mode's own test, sixteen rays against one triangle, as
//!    the packet kernel does, and so with the same answers to the bit. `shadow`, for any hit: only where
//!    an error bound leaves doubt.
//! 5. Where no more than [`FEW`] packets of the beam are left at a node, each goes on alone as a
//!    packet through the full tree below; and so does every packet of a tile that has taken so much work that its rays
//!    cannot be alike.
//!
//! **Wide beams** hold four *squares* of sixteen packets, and a lane stands for four packets that follow one another.
//! The walk, bringing triangles into lanes and culling for the whole beam are shared by four times as many rays; from
//! there on each square goes on by itself, as a beam of its own does. Rays that ask for any hit have none: those
//! toward a light are seldom alike enough (`docs/coherent.md`).

mod beam;
mod bundle;
mod form;
mod nearest;
mod outline;
mod page;
mod pairs;
mod probe;
mod shadow;

pub use beam::{PACKETS, WIDE};
pub use probe::{Probe, TileCounts};

use super::closest::Normals;
use super::lanes::{HitPacket, RayPacket};
use crate::geometry::triangle::Mode;
use crate::kdtree::Tree;
use crate::simd::{Mask, Simd, Sixteen};
use crate::traverse::records::Records;
use beam::{Beam, Extent, Frame, Spread};
use form::{Form, Seen, Slopes};
use nearest::{Nearest, SEEN};
use page::Descent;
use shadow::Shadows;

/// So many packets, or fewer, go on alone.
const FEW: u32 = 1;

/// A tile may be so many beams, one after the other: where a light is near, its rays run fastest along different axes.
const BEAMS: usize = 3;

/// The closest hits of the lanes in `active` of up to `K` squares of sixteen packets. Gives the lanes that are part of no
/// beam from one point: for them, and for lanes that are not active, nothing is done. `K` is 1, or [`WIDE`].
#[inline(always)]
pub fn intersect<S: Simd, T: Records<M>, M: Mode, P: Probe, const K: usize>(
    tree: &T,
    rays: &[RayPacket<16>],
    active: &[[u32; PACKETS]; K],
    hits: &mut [HitPacket<16>],
    probe: &mut P,
) -> [[u32; PACKETS]; K] {
    let (mut left, mut work) = (*active, 0);
    for _ in 0..BEAMS {
        let done = nearest::<S, T, M, P, K>(tree, rays, &left, work, hits, probe);
        let Some(so_far) = done.take_from(&mut left) else { break };
        work = so_far;
    }
    left
}

/// Adds the lanes in `active` that hit anything to `found`, packet by packet. Gives the lanes that are part of no beam: for
/// them, and for lanes that are not active, nothing is done.
#[inline(always)]
pub fn occluded<S: Simd, T: Records<M>, M: Mode, P: Probe>(
    tree: &T,
    rays: &[RayPacket<16>],
    active: &[u32; PACKETS],
    found: &mut [u32],
    probe: &mut P,
) -> [u32; PACKETS] {
    let (mut left, mut work) = ([*active], 0);
    for _ in 0..BEAMS {
        let done = shadows::<S, T, M, P>(tree, rays, &left, work, found, probe);
        let Some(so_far) = done.take_from(&mut left) else { break };
        work = so_far;
    }
    let [left] = left;
    left
}

/// What a beam did.
struct Done<const K: usize> {
    /// The lanes that it was.
    lanes: [[u32; PACKETS]; K],
    /// The work done for its tile so far, if it paid: if its rays were alike enough not to be given up.
    work: Option<u32>,
}

impl<const K: usize> Done<K> {
    /// No beam at all.
    const NOTHING: Self = Self { lanes: [[0; PACKETS]; K], work: None };

    /// Takes its lanes out of those that are left, and gives the work so far if there may be another beam among these
    /// that pays.
    #[inline(always)]
    fn take_from(&self, left: &mut [[u32; PACKETS]; K]) -> Option<u32> {
        let (mut packets, mut all) = (0, 0);
        for (left, done) in left.as_flattened_mut().iter_mut().zip(self.lanes.as_flattened()) {
            *left &= !done;
            packets += u32::from(*left != 0);
            all |= done;
        }
        // Where nothing was taken, the same rays would be tried again.
        self.work.filter(|_| all != 0 && packets > FEW)
    }
}

/// A beam of [`intersect`]; which lanes it was.
#[inline(always)]
fn nearest<S: Simd, T: Records<M>, M: Mode, P: Probe, const K: usize>(
    tree: &T,
    rays: &[RayPacket<16>],
    active: &[[u32; PACKETS]; K],
    work: u32,
    hits: &mut [HitPacket<16>],
    probe: &mut P,
) -> Done<K> {
    if !tree.scale().is_none() {
        return Done::NOTHING;
    }
    let Some((Form::From, frame)) = form::guess(rays, active) else { return Done::NOTHING };
    let (mut belong, mut slopes) = (*active, Slopes::new());
    let Some(extents) = form::from_apex::<S::F16, K>(&frame, rays, &mut belong, &mut slopes) else {
        return Done::NOTHING;
    };
    let extent = Extent::of_lanes(&extents);
    let (beam, interval) = Beam::<S::F16, false>::new(frame, &extent, Spread::default(), tree.bounds());
    if !interval.live().any() {
        // Nothing but sky. It is a large part of many a picture, and what comes now makes ready for more than that.
        miss(&belong, hits);
        return Done { lanes: belong, work: Some(work) };
    }
    let mut bundle = Nearest::<S, T, M, K>::new(tree, rays, &belong, &beam, &slopes);
    bundle.begin();
    let squares = page::windows(&extents, beam.spread.blur::<false>());
    let work = Descent::new(tree, &beam, &squares, work).walk(&mut bundle, interval, probe);
    let mut normals = Normals::<SEEN>::new();
    for (square, (hits, belong)) in hits.chunks_mut(PACKETS).zip(&belong).enumerate() {
        for (packet, hits) in hits.iter_mut().enumerate() {
            if belong[packet & 15] != 0 {
                bundle.give(square, packet, &mut normals, hits);
            }
        }
    }
    Done { lanes: belong, work }
}

/// Writes misses in the given lanes.
#[inline(always)]
fn miss<const K: usize>(lanes: &[[u32; PACKETS]; K], hits: &mut [HitPacket<16>]) {
    for (hits, &lanes) in hits.iter_mut().zip(lanes.as_flattened()) {
        hits.set_part(0, &HitPacket::<16>::miss(), lanes);
    }
}

/// A beam of [`occluded`]; which lanes it was.
#[inline(always)]
fn shadows<S: Simd, T: Records<M>, M: Mode, P: Probe>(
    tree: &T,
    rays: &[RayPacket<16>],
    active: &[[u32; PACKETS]; 1],
    work: u32,
    found: &mut [u32],
    probe: &mut P,
) -> Done<1> {
    if !tree.scale().is_none() {
        return Done::NOTHING;
    }
    let Some((form, frame)) = form::guess(rays, active) else { return Done::NOTHING };
    let mut seen = Seen::new();
    let [mut belong] = *active;
    let Some((extent, spread)) = form::of_form::<S::F16>(form, &frame, rays, &mut belong, &mut seen) else {
        return Done::NOTHING;
    };
    let trace = Trace { tree, rays, active: &belong, frame, extent, spread };
    let (open, work) = if form == Form::Along {
        trace.shadows::<S, M, P, true>(&mut seen, work, probe)
    } else {
        trace.shadows::<S, M, P, false>(&mut seen, work, probe)
    };
    for ((found, open), belong) in found.iter_mut().zip(open).zip(&belong) {
        *found |= belong & !open;
    }
    Done { lanes: [belong], work }
}

/// Rays that are known to be a beam.
struct Trace<'a, L, T> {
    tree: &'a T,
    rays: &'a [RayPacket<16>],
    active: &'a [u32; PACKETS],
    frame: Frame,
    extent: Extent<L>,
    spread: Spread,
}

impl<L: Sixteen, T: Tree> Trace<'_, L, T> {
    /// The lanes that find nothing, and the work so far if the beam paid.
    #[inline(always)]
    fn shadows<S, M, P, const PARALLEL: bool>(
        &self,
        seen: &mut Seen,
        work: u32,
        probe: &mut P,
    ) -> ([u32; PACKETS], Option<u32>)
    where
        S: Simd<F16 = L>,
        M: Mode,
        T: Records<M>,
        P: Probe,
    {
        let Self { tree, rays, active, frame, ref extent, spread } = *self;
        let (beam, interval) = Beam::<L, PARALLEL>::new(frame, extent, spread, tree.bounds());
        let mut bundle =
            Shadows::<S, T, M, PARALLEL>::new(tree, rays, active, frame.axes[2], seen, &interval);
        let squares = page::windows(&[*extent], spread.blur::<PARALLEL>());
        let work = Descent::new(tree, &beam, &squares, work).walk(&mut bundle, interval, probe);
        (bundle.open, work)
    }
}
