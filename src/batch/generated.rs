//! Rays that are made when they are traced, and answers that are taken at once: nothing is kept of either.

use super::work::{CHUNK, Plan, Traced};
use crate::geometry::{Hit, Ray};
use crate::traverse::{Accel, Kernel};
use std::cell::Cell;
use std::ops::Range;

/// A batch whose rays come from a function, some thousand at a time, so that there may be any number of them.
///
/// ```
/// use raypack::Vec3;
/// use raypack::batch::Generated;
/// use raypack::geometry::Ray;
/// use raypack::kdtree::BuildParams;
/// use raypack::mesh::generate::shapes;
/// use raypack::traverse::Accel;
/// use std::sync::atomic::{AtomicUsize, Ordering};
///
/// let accel = Accel::build(&shapes::soup(100, 1), &BuildParams::default())?;
/// let ray = |number: u64| Ray::new(Vec3::new(number as f32 * 1e-5, 0.5, -1.0), Vec3::Z);
/// let hits = AtomicUsize::new(0);
/// Generated::new(&accel, 100_000).intersect(
///     |numbers, rays| rays.extend(numbers.map(ray)),
///     |_numbers, _rays, found| {
///         hits.fetch_add(found.iter().filter(|hit| hit.is_hit()).count(), Ordering::Relaxed);
///     },
/// );
/// assert!(hits.into_inner() > 0);
/// # Ok::<(), raypack::Error>(())
/// ```
///
/// Rays have numbers from 0 on. Each chunk of them is made, traced and taken by one thread, one after the other;
/// which thread, and in which order the chunks come, is not known. Answers are those of [`Batch`](super::Batch).
#[derive(Clone, Copy, Debug)]
pub struct Generated<'a> {
    accel: &'a Accel,
    count: u64,
    kernel: Option<Kernel>,
    threads: usize,
}

/// A chunk's rays, hits and other answers.
#[derive(Default)]
struct Chunk {
    rays: Vec<Ray>,
    hits: Vec<Hit>,
    occluded: Vec<bool>,
}

thread_local! {
    /// A thread's chunk. It is taken out, not borrowed: `make` and `take` may trace batches of their own.
    static CHUNK_OF_THREAD: Cell<Chunk> = Cell::default();
}

impl<'a> Generated<'a> {
    /// So many rays, to be traced by the kernels that suit them, on all processors.
    pub const fn new(accel: &'a Accel, count: u64) -> Self {
        Self { accel, count, kernel: None, threads: 0 }
    }

    /// The same, traced by `kernel`; `None` for whichever is found to be quickest, lot by lot.
    pub const fn with_kernel(self, kernel: Option<Kernel>) -> Self {
        Self { kernel, ..self }
    }

    /// The same, traced by so many threads; 0 for as many as there are processors.
    pub const fn with_threads(self, threads: usize) -> Self {
        Self { threads, ..self }
    }

    /// Finds the closest hits. `make` appends the rays of these numbers to an empty list, `take` gets them back
    /// with their hits. Panics if `make` makes more or fewer.
    pub fn intersect(
        &self,
        make: impl Fn(Range<u64>, &mut Vec<Ray>) + Sync,
        take: impl Fn(Range<u64>, &[Ray], &[Hit]) + Sync,
    ) -> Traced {
        self.plan().run(self.chunks(), |tracer, numbers| {
            let mut chunk = CHUNK_OF_THREAD.take();
            let Chunk { rays, hits, .. } = &mut chunk;
            refill(rays, &numbers, &make);
            hits.resize(rays.len(), Hit::MISS);
            tracer.intersect(rays, hits);
            take(numbers, rays, hits);
            CHUNK_OF_THREAD.set(chunk);
        })
    }

    /// Finds out whether anything lies in each ray's interval, likewise.
    pub fn occluded(
        &self,
        make: impl Fn(Range<u64>, &mut Vec<Ray>) + Sync,
        take: impl Fn(Range<u64>, &[Ray], &[bool]) + Sync,
    ) -> Traced {
        self.plan().run(self.chunks(), |tracer, numbers| {
            let mut chunk = CHUNK_OF_THREAD.take();
            let Chunk { rays, occluded, .. } = &mut chunk;
            refill(rays, &numbers, &make);
            occluded.resize(rays.len(), false);
            tracer.occluded(rays, occluded);
            take(numbers, rays, occluded);
            CHUNK_OF_THREAD.set(chunk);
        })
    }

    fn plan(&self) -> Plan<'_> {
        Plan { accel: self.accel, kernel: self.kernel, threads: self.threads }
    }

    /// The numbers, a chunk at a time.
    fn chunks(&self) -> Vec<Range<u64>> {
        let chunk = CHUNK as u64;
        (0..self.count.div_ceil(chunk)).map(|i| i * chunk..self.count.min((i + 1) * chunk)).collect()
    }
}

/// Has the rays of a chunk made.
fn refill(rays: &mut Vec<Ray>, numbers: &Range<u64>, make: impl Fn(Range<u64>, &mut Vec<Ray>)) {
    rays.clear();
    make(numbers.clone(), rays);
    assert_eq!(rays.len() as u64, numbers.end - numbers.start, "a ray for each number");
}
