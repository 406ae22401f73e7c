//! What a frame cost.

use super::effects::EffectCosts;
use serde::Serialize;
use std::iter::Sum;
use std::ops::AddAssign;
use std::time::Duration;

/// Rays of one kind, counted by one worker.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    pub rays: u64,
    /// Time in which the worker made and traced them.
    pub time: Duration,
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.time += other.time;
    }
}

impl Sum for Tally {
    fn sum<I: Iterator<Item = Self>>(tallies: I) -> Self {
        tallies.fold(Self::default(), |mut sum, tally| {
            sum += tally;
            sum
        })
    }
}

/// Rays of one kind in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RayCount {
    /// How many.
    pub rays: u64,
    /// Seconds that went into making and tracing them, averaged over the workers.
    pub seconds: f64,
    /// Rays per second of all workers together; 0 if there were none.
    pub rays_per_s: f64,
}

impl RayCount {
    pub(super) fn new(tally: Tally, workers: usize) -> Self {
        Self::of(tally.rays, tally.time.as_secs_f64() / workers as f64)
    }

    /// A number of rays in a number of seconds.
    pub fn of(rays: u64, seconds: f64) -> Self {
        let rays_per_s = if rays > 0 && seconds > 0.0 { rays as f64 / seconds } else { 0.0 };
        Self { rays, seconds, rays_per_s }
    }
}

/// The time that a share of some times stays below: 0 of none.
pub(crate) fn quantile(times: &mut [f32], share: f64) -> f64 {
    if times.is_empty() {
        return 0.0;
    }
    let at = ((times.len() as f64 * share) as usize).min(times.len() - 1);
    f64::from(*times.select_nth_unstable_by(at, f32::total_cmp).1)
}

/// What a frame cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FrameStats {
    /// Rays from the eye.
    pub camera: RayCount,
    /// Rays to the light.
    pub shadow: RayCount,
    /// All rays, with the frame's whole time: shading and assembly included.
    pub total: RayCount,
    /// Wall-clock time of the frame in seconds.
    pub seconds: f64,
    /// Tiles.
    pub tiles: usize,
    /// Seconds that half of the tiles stayed below, from their beginning to their end.
    pub tile_p50: f64,
    /// Seconds that 99 % of them stayed below.
    pub tile_p99: f64,
    /// Workers.
    pub threads: usize,
    /// Workers that were bound to a processor.
    pub pinned: usize,
    /// Samples per pixel, on average.
    pub samples: f64,
    /// What effects cost, if any ran.
    #[serde(skip_serializing_if = "EffectCosts::is_empty")]
    pub costs: EffectCosts,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_times() {
        let mut times: Vec<f32> = (0..1000).rev().map(|i| i as f32).collect();
        assert_eq!([0.0, 0.5, 0.99, 1.0].map(|q| quantile(&mut times, q)), [0.0, 500.0, 990.0, 999.0]);
        assert_eq!(quantile(&mut [], 0.5), 0.0);
    }
}
