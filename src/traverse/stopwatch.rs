//! Time spent on tracing, and not on waiting for what is to be traced.

use super::Accel;
use std::time::{Duration, Instant};

/// Measures what a thread does from its start on, without what it waits for blocks of a scene that is not
/// all in memory: that says nothing about a kernel, and others work meanwhile.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    start: Instant,
    stalled: Duration,
}

impl Stopwatch {
    /// Starts it.
    #[inline]
    pub fn start(accel: &Accel) -> Self {
        Self { stalled: stalled(accel), start: Instant::now() }
    }

    /// The time since then.
    #[inline]
    pub fn elapsed(&self, accel: &Accel) -> Duration {
        let elapsed = self.start.elapsed();
        elapsed.saturating_sub(stalled(accel).saturating_sub(self.stalled))
    }
}

fn stalled(accel: &Accel) -> Duration {
    accel.cached().map_or(Duration::ZERO, |cached| cached.stalled())
}
