//! What is asked for while tiles are traced: what the tiles after them will need, and after the last of them those of
//! the next frame.
//!
//! A scene that is in memory in part waits for blocks. The upper tree is always there, and says of a few rays of a
//! tile that is to come where they will look first. A worker asks about that when it takes a tile; loaders
//! fetch what it finds while the tiles before are traced. Each tile is asked about twice, so that what hangs on
//! something else (triangles on lists, nodes on nodes) is asked for as well.
//!
//! The other way, to ask for what the same tile used in the frame before, would need lists of that for each tile, and
//! knows nothing of what comes into view.

use super::order::Tile;
use super::scheduler::{Sharing, Workers};
use crate::cache::Cached;
use crate::geometry::Ray;
use crate::scene::{Camera, View};
use crate::traverse::{Accel, look_ahead};
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// How many tiles beforehand those are asked about that all workers take from one queue, for each thread at work.
const QUEUE: [usize; 2] = [12, 4];

/// The same where each worker has tiles of its own.
const RUNS: [usize; 2] = [2, 1];

/// Rays across a tile, and down.
const SIDE: u32 = 3;

/// Where a camera goes, in a scene of which blocks may come before they are needed.
#[derive(Debug)]
pub(super) struct Course<'a> {
    cached: &'a Cached,
    path: Mutex<Path>,
}

#[derive(Debug, Default)]
struct Path {
    /// The camera of the last frame.
    last: Option<Camera>,
    /// The next one, or that there is none, if somebody has said so.
    next: Option<Option<Camera>>,
}

impl<'a> Course<'a> {
    /// None where nothing is looked ahead for: all of the scene is in memory, or blocks come only when they are needed.
    pub fn of(accel: &'a Accel) -> Option<Self> {
        let cached = accel.cached().filter(|cached| cached.plan().ahead > 0)?;
        Some(Self { cached, path: Mutex::default() })
    }

    fn path(&self) -> MutexGuard<'_, Path> {
        self.path.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Says which camera comes after the one of the frame that begins next.
    pub fn announce(&self, next: Option<Camera>) {
        self.path().next = Some(next);
    }

    /// A frame begins with a camera: which one comes after it.
    pub fn after(&self, now: &Camera) -> Option<Camera> {
        self.path().after(now)
    }

    /// Looks ahead while a frame's tiles are rendered that are taken in this order, by `workers`, `threads` of whom are
    /// at work at a time.
    pub fn lookahead(
        &self,
        seen: Seen,
        tiles: Vec<Tile>,
        workers: &Workers,
        threads: usize,
    ) -> Lookahead<'a> {
        Lookahead::new(self.cached, seen, tiles, workers, threads)
    }
}

impl Path {
    /// Which camera comes after one that is there now: as was said, or if it goes on as it came here.
    fn after(&mut self, now: &Camera) -> Option<Camera> {
        let last = self.last.replace(*now);
        self.next.take().unwrap_or_else(|| last.and_then(|last| onward(&last, now)))
    }
}

/// The camera that is as far from the second as that is from the first, if that is one.
fn onward(last: &Camera, now: &Camera) -> Option<Camera> {
    let next = Camera { eye: now.eye * 2.0 - last.eye, at: now.at * 2.0 - last.at, ..*now };
    next.check().is_ok().then_some(next)
}

/// How a frame is seen, and the one after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub view: View,
    /// The next frame's.
    pub next: Option<View>,
    /// Whether camera rays go in beams where memory is not short.
    pub in_beams: bool,
}

/// Looks ahead while a frame's tiles are rendered.
#[derive(Debug)]
pub(super) struct Lookahead<'a> {
    cached: &'a Cached,
    seen: Seen,
    /// The frame's tiles in the order of its jobs. The next frame's order is the reverse.
    tiles: Vec<Tile>,
    /// Each tile's job, by its corner.
    jobs: HashMap<(u32, u32), usize>,
    /// How many tiles beforehand they are asked about.
    ahead: [usize; 2],
    /// Into how many runs tiles are shared out: who is at a run's end goes on at the same place in the next frame.
    runs: usize,
}

impl<'a> Lookahead<'a> {
    fn new(cached: &'a Cached, seen: Seen, tiles: Vec<Tile>, workers: &Workers, threads: usize) -> Self {
        let (ahead, runs) = match workers.sharing {
            Sharing::Queue => (QUEUE.map(|tiles| tiles * threads), 1),
            Sharing::Runs | Sharing::MirroredRuns => (RUNS, workers.threads.max(1)),
        };
        // In a picture of few tiles, not beyond the next ones.
        let ahead = ahead.map(|count| count.min(tiles.len() / 8).max(1));
        let jobs = tiles.iter().enumerate().map(|(job, tile)| ((tile.x, tile.y), job)).collect();
        Self { cached, seen, tiles, jobs, ahead, runs }
    }

    /// Asks for what will be needed after a tile that is begun.
    pub fn at(&self, tile: &Tile) {
        let Some(&job) = self.jobs.get(&(tile.x, tile.y)).filter(|_| self.cached.looks_ahead()) else {
            return;
        };
        let in_beams = self.seen.in_beams && !self.cached.is_short();
        let [far, near] = self.ahead;
        for ahead in [Some(far), Some(near).filter(|&near| near < far)].into_iter().flatten() {
            if let Some((tile, view)) = self.coming(job, ahead) {
                look_ahead(self.cached, rays(tile, view), in_beams);
            }
        }
    }

    /// The tile that is begun so many after a job, and how it is seen.
    fn coming(&self, job: usize, ahead: usize) -> Option<(&Tile, &View)> {
        let end = end_of_run(job, self.tiles.len(), self.runs);
        let at = job + ahead;
        if at < end {
            return Some((&self.tiles[at], &self.seen.view));
        }
        // The next frame begins with what this one ends with.
        let back = (2 * end).checked_sub(at + 1)?;
        Some((self.tiles.get(back)?, self.seen.next.as_ref()?))
    }
}

/// Where the run ends that a job is in, of so many runs of equal length.
fn end_of_run(job: usize, jobs: usize, runs: usize) -> usize {
    let run = job * runs / jobs.max(1);
    (jobs * (run + 1)).div_ceil(runs).min(jobs)
}

/// Rays through points of a tile that lie evenly.
fn rays(tile: &Tile, view: &View) -> impl Iterator<Item = Ray> {
    let at = |start: u32, length: u32, i: u32| start + (2 * i + 1) * length / (2 * SIDE);
    (0..SIDE * SIDE).map(move |i| {
        let (x, y) = (at(tile.x, tile.width, i % SIDE), at(tile.y, tile.height, i / SIDE));
        view.ray(x, y, [0.5, 0.5])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;

    #[test]
    fn a_camera_goes_on_as_it_came_unless_somebody_knows_better() {
        let camera = |x: f32| Camera::new(Vec3::new(x, 1.0, 0.0), Vec3::new(x, 0.0, -1.0));
        let mut path = Path::default();
        assert_eq!(path.after(&camera(0.0)), None, "nothing is known of a first one");
        assert_eq!(path.after(&camera(2.0)), Some(camera(4.0)));
        path.next = Some(Some(camera(7.0)));
        assert_eq!(path.after(&camera(4.0)), Some(camera(7.0)));
        path.next = Some(None);
        assert_eq!(path.after(&camera(7.0)), None, "the last of a path");
        let huge = camera(f32::MAX);
        assert_eq!(path.after(&huge), None, "nowhere");
    }

    #[test]
    fn rays_go_through_the_tile() {
        let view = Camera::new(Vec3::ZERO, Vec3::NEG_Z).view(100, 100);
        for (width, height) in [(32, 32), (1, 1), (2, 31)] {
            let tile = Tile { x: 5, y: 60, width, height };
            let all: Vec<Ray> = rays(&tile, &view).collect();
            assert_eq!(all.len(), (SIDE * SIDE) as usize);
            for ray in all {
                let inside = (tile.x..tile.x + width)
                    .any(|x| (tile.y..tile.y + height).any(|y| view.ray(x, y, [0.5, 0.5]) == ray));
                assert!(inside, "{tile:?}: {ray:?}");
            }
        }
    }

    #[test]
    fn runs_are_those_of_the_workers() {
        for (jobs, runs) in [(256, 16), (10, 3), (3, 16), (1, 1), (100, 7)] {
            let ends: Vec<usize> = (0..jobs).map(|job| end_of_run(job, jobs, runs)).collect();
            assert!(ends.iter().enumerate().all(|(job, &end)| end > job && end <= jobs), "{ends:?}");
            assert!(ends.is_sorted());
            assert_eq!(ends[jobs - 1], jobs);
        }
        assert_eq!([0, 15, 16, 255].map(|job| end_of_run(job, 256, 16)), [16, 16, 32, 256]);
    }
}
