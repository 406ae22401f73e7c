//! Rays in bulk: traced by all processors, and read from and written to NumPy's files.
//!
//! ```
//! use raypack::Vec3;
//! use raypack::batch::Batch;
//! use raypack::geometry::{Hit, Ray};
//! use raypack::kdtree::BuildParams;
//! use raypack::mesh::Mesh;
//! use raypack::traverse::Accel;
//!
//! let mesh = Mesh {
//!     positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
//!     triangles: vec![[0, 1, 2]],
//!     ..Mesh::default()
//! };
//! let accel = Accel::build(&mesh, &BuildParams::default())?;
//!
//! let rays: Vec<Ray> =
//!     (0..1000).map(|i| Ray::new(Vec3::new(i as f32 * 0.01, 0.25, 1.0), -Vec3::Z)).collect();
//! let mut hits = vec![Hit::MISS; rays.len()];
//! Batch::new(&accel, &rays).intersect(&mut hits);
//! assert_eq!(hits.iter().filter(|hit| hit.is_hit()).count(), 76);
//! # Ok::<(), raypack::Error>(())
//! ```
//!
//! # In which order
//!
//! Any, as answers are the same. But rays that have something in common are quicker if they follow one another. That holds also for those
//! that start anywhere and run anywhere: through pools ([`Accel::make_pools`]), lists trace them up to 1.6 times as fast if those whose directions have the same
//! signs come together, and of these, those that start near one another (`docs/incoherent.md`).
//!
//! # What an answer says
//!
//! The same as that of [`Accel::intersect`] and [`Accel::occluded`], to the bit, whatever the kernel,
//! the instruction set and the number of threads; each ray stands for itself.
//!
//! - **The interval is closed**: a hit at exactly `tnear` or `tfar` counts. `tfar` may be infinite; an
//!   empty interval (`tnear > tfar`) is a miss.
//! - **`t` is counted in lengths of the direction**, which need not be normalised: the point is `origin
//!   + t * direction`.
//! - **On an edge or a vertex** that triangles share, several of them have the same `t`; the one with the
//!   lowest primitive id is reported. (Their `t` may also differ by a rounding; then the least wins.)
//! - **Both sides of a triangle count.** The normal is `(p1 - p0) x (p2 - p0)`, not normalised, whichever
//!   side the ray came from: its length is twice the triangle's area.
//! - **A ray that is none** (a NaN anywhere, an infinite origin or direction, a zero direction) is a miss.
//!
//! Of a scene that is in memory in part, a block that cannot be read unwinds: see
//! [`Cached::or_error`](crate::cache::Cached::or_error).

mod generated;
#[cfg(feature = "numpy")]
pub mod numpy;
mod work;

pub use generated::Generated;
pub use work::Traced;

use crate::geometry::{Hit, Ray};
use crate::traverse::{Accel, Kernel};
use std::sync::atomic::{AtomicUsize, Ordering};
use work::{CHUNK, Plan};

/// Rays to be traced, and how.
#[derive(Debug)]
pub struct Batch<'a> {
    accel: &'a Accel,
    rays: &'a [Ray],
    kernel: Option<Kernel>,
    threads: usize,
    done: AtomicUsize,
}

impl<'a> Batch<'a> {
    /// A batch to be traced by the kernel that suits it, on all processors.
    pub fn new(accel: &'a Accel, rays: &'a [Ray]) -> Self {
        Self { accel, rays, kernel: None, threads: 0, done: AtomicUsize::new(0) }
    }

    /// The same, traced by `kernel`; `None` for whichever is found to be quickest, lot by lot.
    ///
    /// Packets and beams are several times quicker if rays that follow one another go the same way, and
    /// streams if they do not. Answers are the same.
    pub fn with_kernel(self, kernel: Option<Kernel>) -> Self {
        Self { kernel, ..self }
    }

    /// The same, traced by so many threads; 0 for as many as there are processors.
    pub fn with_threads(self, threads: usize) -> Self {
        Self { threads, ..self }
    }

    /// What part of the rays (0 to 1) is done, to be read from another thread.
    pub fn fraction(&self) -> f64 {
        self.done.load(Ordering::Relaxed) as f64 / self.rays.len().max(1) as f64
    }

    /// The closest hit of each ray, [`Hit::MISS`] where there is none. Panics if there are not as many
    /// `hits` as rays.
    pub fn intersect(&self, hits: &mut [Hit]) -> Traced {
        assert_eq!(self.rays.len(), hits.len(), "as many answers as rays");
        let jobs = self.rays.chunks(CHUNK).zip(hits.chunks_mut(CHUNK)).collect();
        self.plan().run(jobs, |tracer, (rays, hits)| {
            tracer.intersect(rays, hits);
            self.done.fetch_add(rays.len(), Ordering::Relaxed);
        })
    }

    /// Whether anything lies in each ray's interval. Panics if there are not as many answers as rays.
    pub fn occluded(&self, occluded: &mut [bool]) -> Traced {
        assert_eq!(self.rays.len(), occluded.len(), "as many answers as rays");
        let jobs = self.rays.chunks(CHUNK).zip(occluded.chunks_mut(CHUNK)).collect();
        self.plan().run(jobs, |tracer, (rays, occluded)| {
            tracer.occluded(rays, occluded);
            self.done.fetch_add(rays.len(), Ordering::Relaxed);
        })
    }

    /// How to trace, from the beginning.
    fn plan(&self) -> Plan<'_> {
        self.done.store(0, Ordering::Relaxed);
        Plan { accel: self.accel, kernel: self.kernel, threads: self.threads }
    }

    /// About how many bytes a batch of so many rays takes beside the rays and their answers.
    pub fn bytes_beside(rays: usize) -> usize {
        // A job's two slices, which are copied when they are shared out.
        rays.div_ceil(CHUNK) * 2 * size_of::<(&[Ray], &mut [Hit])>()
    }
}

#[cfg(test)]
mod tests;
