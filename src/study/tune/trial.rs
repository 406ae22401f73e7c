//! Candidates, what they are timed on, and how two of them are compared.

use super::{Goal, Load, Options};
use crate::error::Result;
use crate::geometry::{Hit, Ray};
use crate::kdtree::TreeStats;
use crate::mesh::Mesh;
use crate::profile::Profile;
use crate::render::{RenderSettings, Renderer};
use crate::scene::{Camera, Lighting};
use crate::study::rays::{RayKind, RaySets, Setup};
use crate::traverse::{Accel, Kernel};
use rayon::prelude::*;
use std::time::Instant;

/// Rays that a thread takes at a time.
const CHUNK: usize = 4096;

/// Runs of one measurement, and the seconds that it lasts unless its runs are long.
const LEAST_RUNS: usize = 2;
const MOST_RUNS: usize = 20;
const RUN_SECONDS: f64 = 0.08;

/// Pairs of measurements after which a comparison may end early, and after which it ends.
const LEAST_PAIRS: usize = 3;
const MOST_PAIRS: usize = 9;

/// A candidate is worse for certain if every pair says so and the middle one by this much, ...
const CLEARLY_WORSE: f64 = 1.04;
/// ... better for certain if every pair says so and the middle one by this much, ...
const CLEARLY_BETTER: f64 = 0.96;
/// ... and counts as better in the end if the middle one of so many pairs says so by this much.
const BETTER: f64 = 0.98;
const PAIRS_TO_WIN: usize = 5;

/// A profile with its tree.
pub struct Candidate {
    pub profile: Profile,
    pub accel: Accel,
    pub stats: TreeStats,
    pub build_seconds: f64,
}

impl Candidate {
    /// Builds the tree of a profile; `like`, if it has the same, gives its own.
    ///
    /// # Errors
    /// As [`Accel::build`].
    pub fn new(profile: Profile, mesh: &Mesh, options: &Options, like: Option<&Self>) -> Result<Self> {
        if let Some(like) = like.filter(|like| like.profile.build == profile.build) {
            let (accel, stats) = (like.accel.clone(), like.stats.clone());
            return Ok(Self { profile, accel, stats, build_seconds: like.build_seconds });
        }
        let start = Instant::now();
        let accel = Accel::build(mesh, &profile.build)?;
        let build_seconds = start.elapsed().as_secs_f64();
        let accel = accel.with_isa(options.isa).with_accuracy(options.accuracy);
        Ok(Self { profile, stats: accel.stats(), accel, build_seconds })
    }

    /// What the SAH says of a ray's cost, with the costs of `start`, so that trees can be compared that were
    /// built for different costs.
    pub fn predicted(&self, start: &Profile) -> f64 {
        f64::from(start.build.traversal_cost) * self.stats.expected_steps
            + f64::from(start.build.intersection_cost) * self.stats.expected_tests
    }
}

/// What candidates are timed on, from one camera.
struct View {
    camera: Camera,
    lighting: Lighting,
    rays: Vec<(RayKind, Vec<Ray>)>,
}

/// All that candidates are timed on.
pub struct Track<'a> {
    mesh: &'a Mesh,
    options: &'a Options,
    views: Vec<View>,
    /// The seconds that each load of each view took at the start: so much is 1.
    usual: Vec<f64>,
}

impl<'a> Track<'a> {
    /// Makes the rays, with the first candidate, and times it.
    ///
    /// # Errors
    /// A camera that makes no sense, or settings that do not.
    pub fn new(mesh: &'a Mesh, options: &'a Options, start: &Candidate) -> Result<Self> {
        let views = options.cameras.iter().map(|&camera| {
            let setup = Setup::new(camera, options.size.width, mesh.bounds(), options.seed);
            let closest = |rays: &[Ray]| {
                let mut hits = vec![Hit::MISS; rays.len()];
                start.accel.intersect_many(Kernel::Packet8, rays, &mut hits);
                hits
            };
            let sets = RaySets::new(setup, mesh, closest);
            let kinds = options.loads.iter().filter_map(|load| match load {
                Load::Frame => None,
                Load::Rays(kind) => Some((*kind, sets.rays(*kind))),
            });
            View { camera, lighting: Lighting::for_view(&camera, &start.accel), rays: kinds.collect() }
        });
        let mut track = Self { mesh, options, views: views.collect(), usual: Vec::new() };
        // The first run fetches the model's data.
        track.seconds(start)?;
        track.usual = track.seconds(start)?;
        Ok(track)
    }

    /// The seconds that each load of each view takes: the least of some runs, since what else the machine
    /// does only ever adds to them.
    fn seconds(&self, candidate: &Candidate) -> Result<Vec<f64>> {
        let mut seconds = Vec::new();
        for view in &self.views {
            if self.options.loads.contains(&Load::Frame) {
                let mut settings = RenderSettings::new(self.options.size);
                settings.tuning = candidate.profile.render.clone();
                let renderer = Renderer::new(&candidate.accel, self.mesh, settings)?;
                seconds.push(least(|| renderer.frame(&view.camera, &view.lighting).1.seconds));
            }
            for (kind, rays) in &view.rays {
                seconds.push(least(|| trace(candidate, *kind, rays)));
            }
        }
        Ok(seconds)
    }

    /// What a candidate costs, by the goal: what it takes beside the first candidate, averaged over the
    /// loads; or the seconds that building it and rendering so many frames take.
    fn cost(&self, candidate: &Candidate) -> Result<f64> {
        let seconds = self.seconds(candidate)?;
        let count = seconds.len().max(1) as f64;
        Ok(match self.options.goal {
            Goal::Trace => seconds.iter().zip(&self.usual).map(|(s, usual)| s / usual).sum::<f64>() / count,
            Goal::Frames(frames) => {
                candidate.build_seconds + f64::from(frames) * seconds.iter().sum::<f64>() / count
            }
        })
    }

    /// Runs two candidates in turn, so that whatever disturbs the machine disturbs both alike. `None` if
    /// `over` says so before there are enough pairs.
    ///
    /// # Errors
    /// Settings that make no sense.
    pub fn compare(
        &self,
        best: &Candidate,
        candidate: &Candidate,
        over: &dyn Fn() -> bool,
    ) -> Result<Option<Comparison>> {
        let mut ratios = Vec::with_capacity(MOST_PAIRS);
        while ratios.len() < MOST_PAIRS {
            if over() {
                break;
            }
            let ratio = if ratios.len() % 2 == 0 {
                let of_best = self.cost(best)?;
                self.cost(candidate)? / of_best
            } else {
                self.cost(candidate)? / self.cost(best)?
            };
            ratios.push(ratio);
            if ratios.len() >= LEAST_PAIRS && Comparison::of(&ratios).is_clear() {
                break;
            }
        }
        Ok((ratios.len() >= LEAST_PAIRS).then(|| Comparison::of(&ratios)))
    }
}

/// The least of some runs: of at least [`LEAST_RUNS`], and of as many as [`RUN_SECONDS`] hold.
fn least(run: impl Fn() -> f64) -> f64 {
    let start = Instant::now();
    let mut least = f64::INFINITY;
    let mut runs = 0;
    while runs < LEAST_RUNS || runs < MOST_RUNS && start.elapsed().as_secs_f64() < RUN_SECONDS {
        least = least.min(run());
        runs += 1;
    }
    least
}

/// Traces rays with all threads; the seconds that it took.
fn trace(candidate: &Candidate, kind: RayKind, rays: &[Ray]) -> f64 {
    let kernel = candidate.profile.render.packet;
    let start = Instant::now();
    if kind.any_hit() {
        rays.par_chunks(CHUNK).for_each_init(
            || vec![false; CHUNK],
            |out, rays| candidate.accel.occluded_many(kernel, rays, &mut out[..rays.len()]),
        );
    } else {
        rays.par_chunks(CHUNK).for_each_init(
            || vec![Hit::MISS; CHUNK],
            |out, rays| candidate.accel.intersect_many(kernel, rays, &mut out[..rays.len()]),
        );
    }
    start.elapsed().as_secs_f64()
}

/// How a candidate's cost compares with the best's: less than 1 is better.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// The middle of the pairs.
    pub ratio: f64,
    /// The least and the greatest.
    pub low: f64,
    pub high: f64,
    /// Pairs in which the candidate was better.
    better: usize,
    /// How many pairs.
    pub pairs: usize,
}

impl Comparison {
    fn of(ratios: &[f64]) -> Self {
        let mut sorted = ratios.to_vec();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted.len() / 2;
        let ratio =
            if sorted.len() % 2 == 1 { sorted[middle] } else { 0.5 * (sorted[middle - 1] + sorted[middle]) };
        let better = sorted.iter().filter(|&&ratio| ratio < 1.0).count();
        Self { ratio, low: sorted[0], high: sorted[sorted.len() - 1], better, pairs: sorted.len() }
    }

    /// Whether more pairs are not needed.
    fn is_clear(&self) -> bool {
        let better = self.pairs >= PAIRS_TO_WIN && self.high < 1.0 && self.ratio < CLEARLY_BETTER;
        better || self.low > 1.0 && self.ratio > CLEARLY_WORSE
    }

    /// Whether the candidate is better, beyond what noise explains: by the middle pair, and in three of four.
    pub fn is_better(&self) -> bool {
        self.pairs >= PAIRS_TO_WIN && self.ratio < BETTER && 4 * self.better >= 3 * self.pairs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_not_taken_for_a_gain() {
        let all = [0.9, 0.91, 0.93, 0.94, 0.95];
        assert!(Comparison::of(&all).is_better() && Comparison::of(&all).is_clear());
        // Three pairs may be luck.
        assert!(!Comparison::of(&all[..3]).is_better() && !Comparison::of(&all[..3]).is_clear());
        // Two pairs of five were worse.
        assert!(!Comparison::of(&[0.8, 0.97, 0.98, 1.01, 1.2]).is_better());
        assert!(!Comparison::of(&[0.8, 0.97, 0.98, 1.01, 1.2]).is_clear());
        assert!(!Comparison::of(&[0.98, 0.985, 0.985, 0.99, 0.99]).is_better());
        assert!(
            Comparison::of(&[1.02, 1.05, 1.3]).is_clear() && !Comparison::of(&[1.02, 1.05, 1.3]).is_better()
        );
    }
}
