//! What batches have in common: workers who trace chunks of rays, and learn which kernel is quickest.

use crate::geometry::{Hit, Ray};
use crate::render::{Sharing, Workers};
use crate::traverse::{Accel, Kernel, SliceDispatch, tally};
use std::thread;
use std::time::Instant;

/// Rays that a worker takes at once: some milliseconds, and a whole number of packets.
pub(super) const CHUNK: usize = 4096;

/// How a batch was traced.
#[derive(Clone, Debug)]
pub struct Traced {
    /// The kernels, each with the number of rays that it traced, the one with the most first.
    pub kernels: Vec<(Kernel, u64)>,
    /// Threads at work at a time: no more than there was work for.
    pub threads: usize,
    /// Wall-clock time, the choice of kernels included.
    pub seconds: f64,
}

impl Traced {
    /// The kernel that traced the most rays; [`Kernel::Stream`] if there were none.
    pub fn kernel(&self) -> Kernel {
        self.kernels.first().map_or(Kernel::Stream, |&(kernel, _)| kernel)
    }
}

/// How chunks are to be traced.
pub(super) struct Plan<'a> {
    pub accel: &'a Accel,
    /// `None` for whatever is quickest.
    pub kernel: Option<Kernel>,
    /// 0 for as many as there are processors.
    pub threads: usize,
}

/// What traces a worker's chunks.
pub(super) struct Tracer<'a> {
    accel: &'a Accel,
    kernel: Option<Kernel>,
    learnt: SliceDispatch,
    /// Rays traced by the kernel that was named.
    named: u64,
}

impl Tracer<'_> {
    /// The closest hits.
    pub fn intersect(&mut self, rays: &[Ray], hits: &mut [Hit]) {
        let Some(kernel) = self.kernel else { return self.learnt.intersect(self.accel, rays, hits) };
        self.accel.intersect_many(kernel, rays, hits);
        self.named += rays.len() as u64;
    }

    /// Whether anything is hit.
    pub fn occluded(&mut self, rays: &[Ray], occluded: &mut [bool]) {
        let Some(kernel) = self.kernel else { return self.learnt.occluded(self.accel, rays, occluded) };
        self.accel.occluded_many(kernel, rays, occluded);
        self.named += rays.len() as u64;
    }

    /// Kernels, and how many rays each has traced.
    fn traced(&self) -> impl Iterator<Item = (Kernel, u64)> {
        let named = self.kernel.map(|kernel| (kernel, self.named));
        self.learnt.traced().chain(named)
    }
}

impl Plan<'_> {
    /// Has all jobs done, one a chunk.
    pub fn run<J: Send>(&self, jobs: Vec<J>, work: impl Fn(&mut Tracer<'_>, J) + Sync) -> Traced {
        let start = Instant::now();
        let threads = match self.threads {
            0 => thread::available_parallelism().map_or(1, usize::from),
            threads => threads,
        };
        let threads = threads.min(jobs.len());
        let cached = self.accel.cached();
        if let Some(cached) = cached {
            cached.begin_frame();
        }
        let workers = match cached {
            None => Workers { threads, pin: false, sharing: Sharing::Runs },
            // More threads, of which some wait for their blocks. Rays that follow one another in the file are likely
            // to need the same ones.
            Some(cached) => {
                let threads = cached.workers(threads).min(jobs.len());
                Workers { threads, pin: false, sharing: Sharing::Queue }
            }
        };
        let tracer =
            || Tracer { accel: self.accel, kernel: self.kernel, learnt: SliceDispatch::default(), named: 0 };
        let outcome = workers.run(jobs, tracer, |tracer, job| {
            // A scene that is in memory in part gives its turns by chunks.
            let _session = cached.map(|cached| cached.session());
            work(tracer, job);
        });

        let mut kernels = tally(outcome.states.iter().flat_map(Tracer::traced));
        kernels.sort_by_key(|&(_, rays)| std::cmp::Reverse(rays));
        Traced { kernels, threads, seconds: start.elapsed().as_secs_f64() }
    }
}
