//! What effects cost.

use crate::render::stats::{RayCount, Tally};
use crate::scene::effects::{Effect, EffectSet};
use serde::ser::SerializeSeq;
use serde::{Serialize, Serializer};
use std::ops::{AddAssign, Index, IndexMut};
use std::time::Duration;

const EFFECTS: usize = Effect::ALL.len();

/// What a worker did for each effect.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tallies {
    by_effect: [Tally; EFFECTS],
    /// Time in which what rays hit was shaded.
    pub shading: Duration,
}

impl Index<Effect> for Tallies {
    type Output = Tally;

    fn index(&self, effect: Effect) -> &Tally {
        &self.by_effect[effect as usize]
    }
}

impl IndexMut<Effect> for Tallies {
    fn index_mut(&mut self, effect: Effect) -> &mut Tally {
        &mut self.by_effect[effect as usize]
    }
}

impl Tallies {
    /// Adds rays and the time that they took.
    pub fn add(&mut self, effect: Effect, rays: u64, time: Duration) {
        self[effect] += Tally { rays, time };
    }

    /// All rays.
    pub fn rays(&self) -> u64 {
        self.by_effect.iter().map(|tally| tally.rays).sum()
    }
}

impl AddAssign for Tallies {
    fn add_assign(&mut self, other: Self) {
        self.by_effect.iter_mut().zip(other.by_effect).for_each(|(tally, other)| *tally += other);
        self.shading += other.shading;
    }
}

/// What the effects of a frame cost: for each that ran, its rays and its time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EffectCosts {
    ran: EffectSet,
    counts: [RayCount; EFFECTS],
    shading: f64,
}

impl EffectCosts {
    pub(crate) fn new(ran: EffectSet, tallies: &Tallies, workers: usize) -> Self {
        Self {
            ran,
            counts: tallies.by_effect.map(|tally| RayCount::new(tally, workers)),
            shading: tallies.shading.as_secs_f64() / workers as f64,
        }
    }

    /// Whether none ran.
    pub fn is_empty(&self) -> bool {
        self.ran.is_empty()
    }

    /// Those that ran, with their rays and the seconds that they took, averaged over the workers.
    pub fn iter(&self) -> impl Iterator<Item = (Effect, RayCount)> {
        self.ran.iter().map(|effect| (effect, self.counts[effect as usize]))
    }

    /// Seconds in which what rays hit was shaded, pictures on surfaces looked up and new rays made, averaged over the
    /// workers: what effects cost that cast no rays of their own.
    pub fn shading(&self) -> f64 {
        self.shading
    }

    /// The same of several frames together.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        let mut sum = Self { ran: self.ran.or(other.ran), shading: self.shading + other.shading, ..*self };
        for (sum, other) in sum.counts.iter_mut().zip(other.counts) {
            *sum = RayCount::of(sum.rays + other.rays, sum.seconds + other.seconds);
        }
        sum
    }
}

impl Serialize for EffectCosts {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Cost {
            effect: Effect,
            #[serde(flatten)]
            count: RayCount,
        }
        let mut costs = serializer.serialize_seq(None)?;
        for (effect, count) in self.iter() {
            costs.serialize_element(&Cost { effect, count })?;
        }
        costs.end()
    }
}
