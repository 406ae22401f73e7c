//! What the bench asks of an engine, and the memory that its runs share.

use crate::geometry::{Accuracy, Hit, Ray};
use crate::simd::prefetch;
use crate::traverse::Kernel;
use std::sync::{Mutex, PoisonError};

/// Rays that a worker takes at a time, at least.
pub const CHUNK: usize = 1024;

/// How many of so many rays a worker takes at a time: as many as lists of rays hold, if enough for all workers is left then.
pub const fn chunk_of(rays: usize) -> usize {
    if rays >= 1 << 17 { 4 * CHUNK } else { CHUNK }
}

/// A library under test, with every tree built that its modes need.
pub trait Engine: Sync {
    /// `raypack`, `embree` or `obvhs`.
    fn name(&self) -> &'static str;

    /// Its version.
    fn version(&self) -> String;

    /// The instruction set that it runs on.
    fn isa(&self) -> String;

    /// How it decides hits, if it has raypack's modes.
    fn accuracy(&self) -> Option<Accuracy> {
        None
    }

    /// Whether modes that are far behind may be dropped after the qualifying round.
    fn qualifies(&self) -> bool {
        true
    }

    /// Every mode that it has, with the rays prepared for it. `any_hit` asks for any hit, not the closest.
    fn contenders<'a>(&'a self, rays: &[Ray], any_hit: bool) -> Vec<Box<dyn Contender + 'a>>;
}

/// One engine in one mode with one set of rays.
pub trait Contender: Sync {
    /// The mode's name in tables.
    fn mode(&self) -> String;

    /// Seconds that building its tree took.
    fn build_seconds(&self) -> f64;

    /// Bytes that its tree holds.
    fn bytes(&self) -> u64;

    /// Brings a chunk's rays, and the memory for its results, into the caches: before the clock runs.
    fn fetch(&self, _chunk: usize) {}

    /// Kernels, and how many rays each has traced since the beginning, for a mode that chooses among some.
    fn traced(&self) -> Vec<(Kernel, u64)> {
        Vec::new()
    }

    /// Traces one chunk and writes its results; the chunks of a set may run at the same time.
    fn trace(&self, chunk: usize);

    /// What the last trace of every chunk found, in the rays' order.
    fn results(&self) -> Results;
}

/// What a set of rays found.
#[derive(Clone, Debug, PartialEq)]
pub enum Results {
    /// The closest hits.
    Closest(Vec<Hit>),
    /// Whether anything was hit.
    Any(Vec<bool>),
}

impl Results {
    /// How many rays hit something.
    pub fn hits(&self) -> usize {
        match self {
            Self::Closest(hits) => hits.iter().filter(|h| h.is_hit()).count(),
            Self::Any(hits) => hits.iter().filter(|&&h| h).count(),
        }
    }
}

/// A chunk: its rays as an engine likes them, and where the results go, in the form that it likes.
///
/// Locking costs some twenty nanoseconds a chunk and lets every engine run without `unsafe`; a chunk is
/// traced by one worker at a time, so nobody ever waits.
#[derive(Debug)]
pub struct Lot<R, C, A> {
    /// The rays.
    pub rays: R,
    /// The results.
    pub out: Mutex<Out<C, A>>,
}

/// Results in an engine's own form.
#[derive(Debug)]
pub enum Out<C, A> {
    /// Records of closest hits.
    Closest(Vec<C>),
    /// Flags.
    Any(Vec<A>),
}

impl<R, C: Clone, A: Clone + Default> Lot<R, C, A> {
    /// Cuts rays into chunks and prepares each; `per_ray` says how many records `n` rays have.
    pub fn cut(
        rays: &[Ray],
        any_hit: bool,
        miss: C,
        records: impl Fn(usize) -> usize,
        prepare: impl Fn(&[Ray]) -> R,
    ) -> Vec<Self> {
        let lot = |chunk: &[Ray]| {
            let n = records(chunk.len());
            let out =
                if any_hit { Out::Any(vec![A::default(); n]) } else { Out::Closest(vec![miss.clone(); n]) };
            Self { rays: prepare(chunk), out: Mutex::new(out) }
        };
        rays.chunks(chunk_of(rays.len())).map(lot).collect()
    }

    /// Brings the lot into the caches: the memory for results, and the slice that the rays are in.
    pub fn fetch<T>(&self, rays: impl FnOnce(&R) -> &[T]) {
        fetch(rays(&self.rays));
        match &*self.out.lock().unwrap_or_else(PoisonError::into_inner) {
            Out::Closest(hits) => fetch(hits),
            Out::Any(hits) => fetch(hits),
        }
    }

    /// Runs one of two tracers, whichever kind of result this lot is for.
    #[inline(always)]
    pub fn trace(&self, closest: impl FnOnce(&R, &mut [C]), any: impl FnOnce(&R, &mut [A])) {
        match &mut *self.out.lock().unwrap_or_else(PoisonError::into_inner) {
            Out::Closest(hits) => closest(&self.rays, hits),
            Out::Any(hits) => any(&self.rays, hits),
        }
    }
}

/// Asks for all the cache lines of a slice.
fn fetch<T>(slice: &[T]) {
    const LINE: usize = 64;
    let start = slice.as_ptr().cast::<u8>();
    for offset in (0..size_of_val(slice)).step_by(LINE) {
        prefetch(start.wrapping_add(offset));
    }
}

/// Puts the results of all lots into the common form: `hits` and `flags` append one lot's.
pub fn collect<R, C, A>(
    lots: &[Lot<R, C, A>],
    hits: impl Fn(&[C], &R, &mut Vec<Hit>),
    flags: impl Fn(&[A], &R, &mut Vec<bool>),
) -> Results {
    let (mut closest, mut any, mut is_any) = (Vec::new(), Vec::new(), false);
    for lot in lots {
        match &*lot.out.lock().unwrap_or_else(PoisonError::into_inner) {
            Out::Closest(out) => hits(out, &lot.rays, &mut closest),
            Out::Any(out) => {
                is_any = true;
                flags(out, &lot.rays, &mut any);
            }
        }
    }
    if is_any { Results::Any(any) } else { Results::Closest(closest) }
}
