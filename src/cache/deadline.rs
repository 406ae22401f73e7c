//! When a thread stops waiting for blocks.

use super::sync::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A point in time, or none; set by one thread and looked at by all.
#[derive(Debug)]
pub struct Deadline {
    begin: Instant,
    /// Nanoseconds after `begin`; [`NEVER`] if there is none.
    after: AtomicU64,
}

const NEVER: u64 = u64::MAX;

impl Default for Deadline {
    fn default() -> Self {
        Self { begin: Instant::now(), after: AtomicU64::new(NEVER) }
    }
}

impl Deadline {
    /// From now on there is this one.
    pub fn set(&self, deadline: Option<Instant>) {
        let after = |at: Instant| at.saturating_duration_since(self.begin).as_nanos() as u64;
        self.after.store(deadline.map_or(NEVER, after), Ordering::Release);
    }

    /// Whether there is one that has passed.
    pub fn has_passed(&self) -> bool {
        self.left().is_some_and(|left| left.is_zero())
    }

    /// How long there is still to wait; `None` if as long as it takes.
    pub fn left(&self) -> Option<Duration> {
        let after = self.after.load(Ordering::Acquire);
        (after != NEVER).then(|| Duration::from_nanos(after).saturating_sub(self.begin.elapsed()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_passes_if_there_is_one() {
        let deadline = Deadline::default();
        assert!(!deadline.has_passed() && deadline.left().is_none());
        deadline.set(Some(Instant::now() + Duration::from_secs(3600)));
        assert!(!deadline.has_passed() && deadline.left() > Some(Duration::from_secs(3000)));
        deadline.set(Some(Instant::now()));
        assert!(deadline.has_passed());
        deadline.set(None);
        assert!(!deadline.has_passed());
    }
}
