//! Workers: the same for every engine. Chunks are handed out by an atomic counter.
//!
//! **What is timed is tracing, not memory.** A renderer makes its rays tile by tile and uses what they find at once, so
//! that neither is ever far away. Here a million rays and their results lie ready, 60 bytes and more for each, which
//! no cache holds: fetching them took up to a third of the time of the quickest kernels (of lost-empire's camera rays,
//! raypack traced 52 million a second with it and 75 without, Embree 34 and 46). So a chunk is brought into the
//! caches before its clock runs, for every engine alike.

use super::engine::Contender;
use crossbeam::channel::{Receiver, Sender, unbounded};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// A run: a contender's chunks, each traced `repeats` times.
struct Job {
    contender: usize,
    /// How many chunks have been handed out.
    next: AtomicUsize,
    chunks: usize,
    repeats: usize,
}

/// A crew of workers that lives as long as a race does, so that runs do not pay for threads' starts.
pub struct Crew {
    workers: Vec<(Sender<Arc<Job>>, Receiver<Duration>)>,
    chunks: usize,
}

impl Crew {
    /// Has contender number `contender` trace all its chunks `repeats` times; the seconds
    /// for which the worker that traced longest did so.
    ///
    /// # Panics
    /// When a contender panicked.
    pub fn run(&self, contender: usize, repeats: usize) -> f64 {
        let job = Arc::new(Job { contender, next: AtomicUsize::new(0), chunks: self.chunks, repeats });
        for (orders, _) in &self.workers {
            orders.send(Arc::clone(&job)).expect("a worker is gone: its contender panicked");
        }
        let spans = self
            .workers
            .iter()
            .map(|(_, done)| done.recv().expect("a worker is gone: its contender panicked"));
        spans.max().expect("a crew has a worker").as_secs_f64()
    }
}

/// Calls `race` with a crew of `threads` workers, pinned each to its own core if `pin` says so, to run
/// `contenders` over sets of `chunks` chunks.
pub fn with_crew<T>(
    contenders: &[Box<dyn Contender + '_>],
    chunks: usize,
    threads: usize,
    pin: bool,
    race: impl FnOnce(&Crew) -> T,
) -> T {
    let cores = if pin { core_affinity::get_core_ids().unwrap_or_default() } else { Vec::new() };
    std::thread::scope(|scope| {
        let worker = |i: usize| {
            let (order_sender, orders) = unbounded::<Arc<Job>>();
            let (done, done_receiver) = unbounded();
            let core = cores.get(i % cores.len().max(1)).copied();
            scope.spawn(move || {
                if let Some(core) = core {
                    core_affinity::set_for_current(core);
                }
                for job in orders {
                    if done.send(work(&*contenders[job.contender], &job)).is_err() {
                        break;
                    }
                }
            });
            (order_sender, done_receiver)
        };
        race(&Crew { workers: (0..threads.max(1)).map(worker).collect(), chunks })
        // The crew goes here, and with its channels every worker's loop.
    })
}

/// Traces chunks until none is left; how long it did so.
fn work(contender: &dyn Contender, job: &Job) -> Duration {
    let mut traced = Duration::ZERO;
    loop {
        let i = job.next.fetch_add(1, Ordering::Relaxed);
        if i >= job.chunks * job.repeats {
            return traced;
        }
        contender.fetch(i % job.chunks);
        let start = Instant::now();
        contender.trace(i % job.chunks);
        traced += start.elapsed();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::bench::engine::Results;

    struct Counting(Vec<AtomicUsize>);

    impl Contender for Counting {
        fn mode(&self) -> String {
            "counting".into()
        }
        fn build_seconds(&self) -> f64 {
            0.0
        }
        fn bytes(&self) -> u64 {
            0
        }
        fn trace(&self, chunk: usize) {
            self.0[chunk].fetch_add(1, Ordering::Relaxed);
        }
        fn results(&self) -> Results {
            Results::Any(self.0.iter().map(|n| n.load(Ordering::Relaxed) == 3).collect())
        }
    }

    #[test]
    fn every_chunk_runs_as_often_as_asked() {
        for threads in [1, 3] {
            let counting: Vec<Box<dyn Contender>> =
                vec![Box::new(Counting((0..100).map(|_| AtomicUsize::new(0)).collect()))];
            with_crew(&counting, 100, threads, false, |crew| {
                assert!(crew.run(0, 1) >= 0.0);
                crew.run(0, 2);
            });
            assert_eq!(counting[0].results(), Results::Any(vec![true; 100]), "{threads} threads");
        }
    }

    #[test]
    #[should_panic(expected = "panicked")]
    fn a_panicking_contender_ends_the_race() {
        let none: Vec<Box<dyn Contender>> = vec![Box::new(Counting(Vec::new()))];
        with_crew(&none, 1, 2, false, |crew| crew.run(0, 1));
    }
}
