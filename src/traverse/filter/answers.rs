//! Where the answers of rays in lists go: ray by ray, or into packets.
//!
//! (A branch for each answer costs nothing, and a kernel for each form would have to be compiled for every instruction set and mode.)

use crate::geometry::triangle::Mode;
use crate::geometry::{Hit, Ray};
use crate::traverse::HitPacket;
use crate::traverse::pool::answers::{Told, is_nearer};
use crate::traverse::records::Resident;
use crate::traverse::stream::{Answers, Any, Closest};

/// What is asked of each ray, sixteen answers at a time.
pub trait BySixteens: Told {
    /// Gives the answers of the rays in the places from number `16 * sixteen` on, as far as they are known: which of them are done.
    /// Closest hits are told afterwards.
    fn give(&mut self, sixteen: usize, done: u32);
}

/// Closest hits.
pub enum Hits<'a> {
    /// One by one.
    Rays(&'a mut [Hit]),
    /// Sixteen by sixteen.
    Lanes(&'a mut [HitPacket<16>]),
}

impl Answers for Hits<'_> {
    const ANY: bool = false;

    #[cold]
    #[inline(never)]
    fn odd<M: Mode>(&mut self, tree: &Resident<'_, M::Record>, number: usize, ray: &Ray) {
        let mut found = [Hit::MISS];
        Closest(&mut found).odd::<M>(tree, 0, ray);
        match self {
            Self::Rays(hits) => hits[number] = found[0],
            Self::Lanes(hits) => hits[number / 16].set(number % 16, &found[0]),
        }
    }
}

impl Told for Hits<'_> {
    #[inline(always)]
    fn offer(&mut self, ray: usize, hit: &Hit) {
        match self {
            Self::Rays(hits) => Closest(hits).offer(ray, hit),
            Self::Lanes(hits) => {
                let (hits, lane) = (&mut hits[ray / 16], ray % 16);
                if is_nearer(hit, hits.t[lane], hits.primitive[lane]) {
                    hits.set(lane, hit);
                }
            }
        }
    }
}

impl BySixteens for Hits<'_> {
    #[inline(always)]
    fn give(&mut self, sixteen: usize, _: u32) {
        match self {
            Self::Rays(hits) => {
                for hit in hits[16 * sixteen..].iter_mut().take(16) {
                    *hit = Hit::MISS;
                }
            }
            Self::Lanes(hits) => hits[sixteen] = HitPacket::miss(),
        }
    }
}

/// Whether rays hit anything.
pub enum Found<'a> {
    /// One by one.
    Rays(&'a mut [bool]),
    /// Sixteen by sixteen, a bit for each; none is set beforehand.
    Lanes(&'a mut [u32]),
}

impl Answers for Found<'_> {
    const ANY: bool = true;

    #[cold]
    #[inline(never)]
    fn odd<M: Mode>(&mut self, tree: &Resident<'_, M::Record>, number: usize, ray: &Ray) {
        let mut found = [false];
        Any(&mut found).odd::<M>(tree, 0, ray);
        if found[0] {
            self.hits(number);
        }
    }
}

impl Told for Found<'_> {
    #[inline(always)]
    fn hits(&mut self, ray: usize) {
        match self {
            Self::Rays(rays) => rays[ray] = true,
            Self::Lanes(lanes) => lanes[ray / 16] |= 1 << (ray % 16),
        }
    }
}

impl BySixteens for Found<'_> {
    #[inline(always)]
    fn give(&mut self, sixteen: usize, done: u32) {
        match self {
            Self::Rays(rays) => {
                for (lane, ray) in rays[16 * sixteen..].iter_mut().take(16).enumerate() {
                    *ray = done >> lane & 1 == 1;
                }
            }
            Self::Lanes(lanes) => lanes[sixteen] |= done,
        }
    }
}
