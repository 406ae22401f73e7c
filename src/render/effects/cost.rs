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
    /// What was done for effects that cast no rays.
    pub uses: Uses,
    /// Time in which what rays hit was shaded.
    pub shading: Duration,
}

impl Index<Effect> for Tallies {
    type Output = Tally;

    fn index(&self, effect: Effect) -> &Tally {
        &self.by_effect[effect as usize]
    }
}

impl Tallies {
    /// Adds rays and the time that they took.
    pub fn add(&mut self, effect: Effect, rays: u64, time: Duration) {
        self.by_effect[effect as usize] += Tally { rays, time };
    }

    /// All rays.
    pub fn rays(&self) -> u64 {
        self.by_effect.iter().map(|tally| tally.rays).sum()
    }
}

impl AddAssign for Tallies {
    fn add_assign(&mut self, other: Self) {
        self.by_effect.iter_mut().zip(other.by_effect).for_each(|(tally, other)| *tally += other);
        self.uses.0.iter_mut().zip(other.uses.0).for_each(|(uses, other)| *uses += other);
        self.shading += other.shading;
    }
}

/// How often an effect was used that casts no rays, and the time of those uses that were timed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Usage {
    /// All.
    pub uses: u64,
    /// Those that were timed.
    pub timed: u64,
    /// The time of these.
    pub time: Duration,
}

impl Usage {
    /// Uses that were timed all.
    pub fn timed(uses: u64, time: Duration) -> Self {
        Self { uses, timed: uses, time }
    }

    /// Seconds of all, if those that were timed are like the others.
    fn seconds(&self) -> f64 {
        match self.timed {
            0 => 0.0,
            timed => self.time.as_secs_f64() * (self.uses as f64 / timed as f64),
        }
    }
}

impl AddAssign for Usage {
    fn add_assign(&mut self, other: Self) {
        self.uses += other.uses;
        self.timed += other.timed;
        self.time += other.time;
    }
}

/// [`Usage`] by effect.
#[derive(Clone, Copy, Debug, Default)]
pub struct Uses([Usage; EFFECTS]);

impl Index<Effect> for Uses {
    type Output = Usage;

    #[inline]
    fn index(&self, effect: Effect) -> &Usage {
        &self.0[effect as usize]
    }
}

impl IndexMut<Effect> for Uses {
    #[inline]
    fn index_mut(&mut self, effect: Effect) -> &mut Usage {
        &mut self.0[effect as usize]
    }
}

/// What an effect cost in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct EffectCost {
    /// The rays that it cast: see [`Effect::casts_rays`].
    pub rays: u64,
    /// How often it was used, if it is one that casts none: see [`Effect::unit`].
    pub uses: u64,
    /// Seconds that went into it, averaged over the workers: of rays, into making and tracing them; of uses, as a sample
    /// of them has it. [`Effect::Antialiasing`] has all of the samples beyond the first, the other effects' part in
    /// them included.
    pub seconds: f64,
    /// Those seconds as a part of the frame's.
    pub share: f64,
    /// Rays per second of all workers together; 0 if there were none.
    pub rays_per_s: f64,
}

impl EffectCost {
    /// Its rays or uses, whichever it has.
    pub fn count(&self) -> u64 {
        self.rays + self.uses
    }
}

/// What the effects of a frame cost: for each that ran, its rays or uses and its time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EffectCosts {
    ran: EffectSet,
    /// Rays, uses and seconds.
    counts: [(u64, u64, f64); EFFECTS],
    shading: f64,
    frame: f64,
}

impl EffectCosts {
    /// Of a frame that took so many seconds.
    pub(crate) fn new(ran: EffectSet, tallies: &Tallies, workers: usize, frame: f64) -> Self {
        let mut counts = [(0, 0, 0.0); EFFECTS];
        for (count, &effect) in counts.iter_mut().zip(Effect::ALL) {
            let (Tally { rays, time }, uses) = (tallies[effect], tallies.uses[effect]);
            *count = (rays, uses.uses, (time.as_secs_f64() + uses.seconds()) / workers as f64);
        }
        Self { ran, counts, shading: tallies.shading.as_secs_f64() / workers as f64, frame }
    }

    /// Of frames that the plain renderer made, in which there may have been shadows.
    pub fn plain(shadows: RayCount, frame: f64) -> Self {
        let mut costs = Self { frame, ..Self::default() };
        if shadows.rays > 0 {
            costs.ran = EffectSet::of(&[Effect::Shadows]);
            costs.counts[Effect::Shadows as usize] = (shadows.rays, 0, shadows.seconds);
        }
        costs
    }

    /// Whether none ran.
    pub fn is_empty(&self) -> bool {
        self.ran.is_empty()
    }

    /// Those that ran, and what each cost.
    pub fn iter(&self) -> impl Iterator<Item = (Effect, EffectCost)> {
        let part = |of: f64, all: f64| if of > 0.0 && all > 0.0 { of / all } else { 0.0 };
        self.ran.iter().map(move |effect| {
            let (rays, uses, seconds) = self.counts[effect as usize];
            let (share, rays_per_s) = (part(seconds, self.frame), part(rays as f64, seconds));
            (effect, EffectCost { rays, uses, seconds, share, rays_per_s })
        })
    }

    /// Seconds in which what rays hit was shaded, pictures on surfaces looked up and new rays made, averaged over the
    /// workers: what the effects that cast no rays of their own have their parts of.
    pub fn shading(&self) -> f64 {
        self.shading
    }

    /// The same of several frames together.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        let mut sum = Self {
            ran: self.ran.or(other.ran),
            shading: self.shading + other.shading,
            frame: self.frame + other.frame,
            ..*self
        };
        for (sum, other) in sum.counts.iter_mut().zip(other.counts) {
            *sum = (sum.0 + other.0, sum.1 + other.1, sum.2 + other.2);
        }
        sum
    }
}

impl Serialize for EffectCosts {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Named {
            effect: Effect,
            #[serde(flatten)]
            cost: EffectCost,
        }
        let mut costs = serializer.serialize_seq(None)?;
        for (effect, cost) in self.iter() {
            costs.serialize_element(&Named { effect, cost })?;
        }
        costs.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uses_that_were_timed_stand_for_all() {
        let mut tallies = Tallies::default();
        let time = Duration::from_millis(3);
        tallies.uses[Effect::Textures] += Usage { uses: 1000, timed: 10, time };
        tallies.uses[Effect::Textures] += Usage { uses: 500, timed: 5, time };
        tallies.uses[Effect::Antialiasing] += Usage::timed(7, time);
        tallies.uses[Effect::Fresnel] += Usage { uses: 9, ..Usage::default() };
        tallies.add(Effect::Shadows, 50, time);
        let ran = EffectSet::of(&[Effect::Textures, Effect::Shadows, Effect::Fresnel, Effect::Antialiasing]);
        let costs = EffectCosts::new(ran, &tallies, 2, 0.6);
        let of = |wanted: Effect| {
            let cost = costs.iter().find(|(effect, _)| *effect == wanted).expect("it ran").1;
            (cost.rays, cost.uses, (cost.seconds * 1e6).round(), (cost.share * 1e4).round())
        };
        assert_eq!(of(Effect::Textures), (0, 1500, 300_000.0, 5000.0));
        assert_eq!(of(Effect::Antialiasing), (0, 7, 1500.0, 25.0));
        assert_eq!(of(Effect::Fresnel), (0, 9, 0.0, 0.0), "none was timed");
        assert_eq!(of(Effect::Shadows), (50, 0, 1500.0, 25.0));
        assert_eq!(costs.iter().count(), 4);
        let twice = costs.and(&costs);
        let (_, textures) = twice.iter().next().expect("it ran");
        assert_eq!((textures.uses, (textures.share * 1e4).round()), (3000, 5000.0));
    }
}
