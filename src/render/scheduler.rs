//! Workers that share out jobs by stealing.

use crossbeam::deque::{Steal, Stealer, Worker};
use std::panic;
use std::thread;

/// How many workers there are, and whether each stays on one processor.
#[derive(Clone, Copy, Debug)]
pub struct Workers {
    /// Threads, at least one.
    pub threads: usize,
    /// Whether each is bound to a processor of its own (as far as there are enough).
    pub pin: bool,
    /// Who does which job.
    pub sharing: Sharing,
}

/// Who does which job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sharing {
    /// Each worker begins with a run of jobs that follow one another and does them in order; one that has
    /// none left steals from the far end of another's run, job by job.
    Runs,
    /// The same, but the first worker begins with the last run. Where jobs come in reverse order every other time, each
    /// worker then has those that it had before, and finds what they need in its processor's caches.
    MirroredRuns,
    /// Each takes the first job that is left: all are near one another all the time.
    Queue,
}

impl Sharing {
    /// The jobs that each of so many workers begins with.
    fn deal<J>(self, jobs: Vec<J>, count: usize) -> Vec<Worker<J>> {
        match self {
            Self::Runs => shares(jobs, count),
            Self::MirroredRuns => {
                let mut shares = shares(jobs, count);
                shares.reverse();
                shares
            }
            Self::Queue => queue(jobs, count),
        }
    }
}

/// What is left when all jobs are done.
#[derive(Debug)]
pub struct Outcome<S> {
    /// Each worker's state.
    pub states: Vec<S>,
    /// Workers that were bound to a processor.
    pub pinned: usize,
}

impl<S> Default for Outcome<S> {
    fn default() -> Self {
        Self { states: Vec::new(), pinned: 0 }
    }
}

impl Workers {
    /// Does every job once and returns when all are done.
    ///
    /// As no job makes new ones, a worker that finds nothing left is done. `state` makes what a worker keeps from job to job: it is called once per worker, on
    /// its thread.
    ///
    /// # Panics
    /// If `work` panics, with the same payload, after the other workers have finished.
    pub fn run<J: Send, S: Send>(
        &self,
        jobs: Vec<J>,
        state: impl Fn() -> S + Sync,
        work: impl Fn(&mut S, J) + Sync,
    ) -> Outcome<S> {
        let threads = self.threads.max(1);
        let deques = self.sharing.deal(jobs, threads);
        let stealers: Vec<Stealer<J>> = deques.iter().map(Worker::stealer).collect();
        let cores = if self.pin { core_affinity::get_core_ids().unwrap_or_default() } else { Vec::new() };

        thread::scope(|scope| {
            let (stealers, cores, state, work) = (&stealers, &cores, &state, &work);
            let handles: Vec<_> = deques
                .into_iter()
                .enumerate()
                .map(|(me, deque)| {
                    scope.spawn(move || {
                        let core = cores.get(me % cores.len().max(1));
                        let pinned = core.is_some_and(|&core| core_affinity::set_for_current(core));
                        let mut state = state();
                        while let Some(job) = deque.pop().or_else(|| steal(stealers, me)) {
                            work(&mut state, job);
                        }
                        (state, pinned)
                    })
                })
                .collect();

            let mut outcome = Outcome { states: Vec::with_capacity(handles.len()), pinned: 0 };
            let mut panicked = None;
            for handle in handles {
                match handle.join() {
                    Ok((state, pinned)) => {
                        outcome.states.push(state);
                        outcome.pinned += usize::from(pinned);
                    }
                    Err(payload) => panicked = Some(payload),
                }
            }
            panicked.map_or(outcome, |payload| panic::resume_unwind(payload))
        })
    }
}

/// All jobs in the first deque, which is taken from at the front whoever takes.
fn queue<J>(jobs: Vec<J>, count: usize) -> Vec<Worker<J>> {
    let deques: Vec<Worker<J>> = (0..count).map(|_| Worker::new_fifo()).collect();
    jobs.into_iter().for_each(|job| deques[0].push(job));
    deques
}

/// Runs of jobs of almost equal length. The owner pops at one end and thieves take from the
/// other, so the first job goes in last.
fn shares<J>(mut jobs: Vec<J>, count: usize) -> Vec<Worker<J>> {
    let mut deques: Vec<Worker<J>> = (0..count)
        .rev()
        .map(|share| {
            let deque = Worker::new_lifo();
            let start = jobs.len() * share / (share + 1);
            jobs.drain(start..).rev().for_each(|job| deque.push(job));
            deque
        })
        .collect();
    deques.reverse();
    deques
}

/// A job of another worker, asked in turn from the next one on; `None` when there is none left.
fn steal<J>(stealers: &[Stealer<J>], me: usize) -> Option<J> {
    let others = || stealers.iter().cycle().skip(me + 1).take(stealers.len() - 1);
    loop {
        let attempt: Steal<J> = others().map(Stealer::steal).collect();
        match attempt {
            Steal::Success(job) => return Some(job),
            Steal::Empty => return None,
            Steal::Retry => std::hint::spin_loop(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU32, Ordering};

    #[test]
    fn every_job_is_done_once() {
        use Sharing::{MirroredRuns, Queue, Runs};
        for (threads, jobs, sharing) in [
            (1, 0, Runs),
            (1, 10, Runs),
            (2, 1, Runs),
            (3, 100, Runs),
            (16, 1000, Runs),
            (7, 6, Runs),
            (3, 100, MirroredRuns),
            (1, 0, Queue),
            (16, 1000, Queue),
        ] {
            let done: Vec<AtomicU32> = (0..jobs).map(|_| AtomicU32::new(0)).collect();
            let outcome = Workers { threads, pin: false, sharing }.run(
                (0..jobs).collect(),
                || 0,
                |count, job: usize| {
                    done[job].fetch_add(1, Ordering::Relaxed);
                    *count += 1;
                },
            );
            assert!(done.iter().all(|n| n.load(Ordering::Relaxed) == 1), "{threads} threads, {jobs} jobs");
            assert_eq!(outcome.states.len(), threads);
            assert_eq!(outcome.states.iter().sum::<usize>(), jobs);
        }
    }

    #[test]
    fn one_worker_keeps_the_order() {
        let outcome = Workers { threads: 1, pin: false, sharing: Sharing::Runs }.run(
            (0..50).collect(),
            Vec::new,
            |seen, job: u32| seen.push(job),
        );
        assert_eq!(outcome.states[0], (0..50).collect::<Vec<_>>());
    }

    #[test]
    fn a_queue_is_taken_from_at_the_front() {
        let deques = queue((0..10).collect(), 3);
        let stealers: Vec<Stealer<u32>> = deques.iter().map(Worker::stealer).collect();
        assert_eq!(deques[0].pop(), Some(0));
        assert_eq!(steal(&stealers, 2), Some(1));
        assert_eq!(steal(&stealers, 1), Some(2));
        assert_eq!(deques[0].pop(), Some(3));
    }

    #[test]
    fn shares_are_runs_of_equal_length() {
        let shares: Vec<Vec<u32>> = shares((0..10).collect(), 4)
            .iter()
            .map(|deque| std::iter::from_fn(|| deque.pop()).collect())
            .collect();
        assert!(shares.iter().all(|s| (2..=3).contains(&s.len())), "{shares:?}");
        assert_eq!(shares.concat(), (0..10).collect::<Vec<_>>());
    }

    #[test]
    fn mirrored_runs_are_of_the_same_jobs_backwards() {
        let dealt = |sharing: Sharing, jobs: Vec<u32>| -> Vec<Vec<u32>> {
            sharing.deal(jobs, 4).iter().map(|deque| std::iter::from_fn(|| deque.pop()).collect()).collect()
        };
        let there = dealt(Sharing::Runs, (0..12).collect());
        let mut back = dealt(Sharing::MirroredRuns, (0..12).rev().collect());
        assert_eq!(there[0], [0, 1, 2]);
        back.iter_mut().for_each(|run| run.reverse());
        assert_eq!(there, back);
    }

    #[test]
    fn idle_workers_steal() {
        // The owner of the first run waits in its first job until all others are done: of its run
        // nothing but that job is its own work.
        let others = AtomicU32::new(0);
        Workers { threads: 2, pin: false, sharing: Sharing::Runs }.run(
            (0..64).collect(),
            || (),
            |(), job: u32| {
                if job == 0 {
                    while others.load(Ordering::Acquire) < 63 {
                        thread::yield_now();
                    }
                } else {
                    others.fetch_add(1, Ordering::Release);
                }
            },
        );
    }

    #[test]
    fn a_panic_comes_through() {
        let caught = panic::catch_unwind(|| {
            Workers { threads: 3, pin: false, sharing: Sharing::Runs }.run(
                (0..9).collect(),
                || (),
                |(), job: u32| {
                    assert!(job != 4, "job four is broken");
                },
            )
        });
        let payload = caught.expect_err("it panicked");
        assert!(payload.downcast_ref::<&str>().is_some_and(|said| said.contains("job four")));
    }

    #[test]
    fn pinning_is_reported() {
        let outcome =
            Workers { threads: 2, pin: true, sharing: Sharing::Runs }.run(vec![(); 4], || (), |(), ()| {});
        assert!(outcome.pinned <= 2);
        let outcome =
            Workers { threads: 2, pin: false, sharing: Sharing::Runs }.run(vec![(); 4], || (), |(), ()| {});
        assert_eq!(outcome.pinned, 0);
    }
}
