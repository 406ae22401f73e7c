//! Having blocks here that a walk needs all at once.

use super::blocks::Blocks;
use super::directory::Asked;
use super::loaders::Loaders;
use super::stats::{PARTS, add};
use super::sync::Ordering;

/// Blocks were not here when the time was over.
#[derive(Debug)]
pub struct Late;

/// Blocks that are here and will be as long as this is.
#[must_use]
pub struct Gathered<'a> {
    blocks: &'a Blocks,
    pinned: Vec<u32>,
    taken: usize,
}

impl Drop for Gathered<'_> {
    fn drop(&mut self) {
        self.pinned.iter().for_each(|&block| self.blocks.pins.unpin(block));
        self.blocks.quota.give(self.taken);
    }
}

impl Blocks {
    /// Pins blocks and has all of them come. The caller must be in no epoch.
    ///
    /// `aside` is called before anything is waited for that another thread may have to have a place at the
    /// gate for: the caller must have none then.
    ///
    /// # Errors
    /// The deadline has passed. What was asked for still comes.
    pub fn gather(
        &self,
        loaders: &Loaders,
        wanted: &[u32],
        aside: impl FnOnce(),
    ) -> Result<Gathered<'_>, Late> {
        if self.deadline.has_passed() {
            return Err(Late);
        }
        let mut aside = Some(aside);
        let mut step_aside = || {
            if let Some(aside) = aside.take() {
                self.waits.fetch_add(1, Ordering::Relaxed);
                aside();
            }
        };
        let taken = self.quota.try_take(wanted.len()).unwrap_or_else(|| {
            step_aside();
            self.quota.take(wanted.len())
        });
        let mut gathered = Gathered { blocks: self, pinned: Vec::with_capacity(wanted.len()), taken };
        let (mut absent, mut missed) = (Vec::new(), [0; PARTS]);
        for &block in wanted {
            let gone = &mut |gone| self.retire(gone);
            let asked = self.directory(block).pin(block, &self.words, &self.pins, gone);
            gathered.pinned.push(block);
            missed[self.layout.part(block)] += u64::from(asked != Asked::Here);
            match asked {
                // It may have come ahead of need since it was looked for.
                Asked::Here => self.words.use_first(block as usize, self.tick()),
                Asked::Coming => (),
                Asked::Absent => absent.push(block),
            }
        }
        if loaders.are_there() {
            // What the system has in memory is copied sooner than it is asked for.
            absent.retain(|&block| !self.load(block, true));
        }
        // Unless time is limited, this thread reads them itself, one by one: they come later than if loaders read them all at
        // once, but what others need comes meanwhile, and fewer threads change places. Where several were left to loaders,
        // frames took as long or longer (16 and 39 % of the power plant in memory, from a disk).
        let is_patient = self.deadline.left().is_none();
        for &block in &absent {
            let own = if is_patient { loaders.own() } else { None };
            if loaders.are_there() {
                step_aside();
                self.ahead.was_slow();
            }
            match own {
                Some(_own) => self.load_with_others(block),
                None => self.need(loaders, block),
            }
        }
        let counts = self.counters.parts.iter().zip(missed).filter(|&(_, missed)| missed > 0);
        counts.for_each(|(part, missed)| add(&part.misses, missed));
        for &block in wanted {
            while !self.words.is_here(block as usize) {
                step_aside();
                if !self.directory(block).wait(block, &self.deadline) {
                    return Err(Late);
                }
                if self.words.is_here(block as usize) || self.has_failed() {
                    break;
                }
                // It was to come ahead of need, and did not. Now it is needed.
                let gone = &mut |gone| self.retire(gone);
                if self.directory(block).ask(block, &self.words, &self.pins, gone) == Asked::Absent {
                    self.need(loaders, block);
                }
            }
        }
        Ok(gathered)
    }

    /// Has a block come that the directory has said is absent: asks a loader for it, or reads it here if there is none.
    fn need(&self, loaders: &Loaders, block: u32) {
        if !loaders.need(block) {
            self.load(block, false);
        }
    }
}
