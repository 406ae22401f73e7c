//! A scene of which all blocks are here, where there is room for all.
//!
//! Then its arrays lie in memory as they do in the file, from one home to the next, and nothing ever has to go: who looks at
//! them need not ask whether a block is here. Kernels run as they do for a resident tree, which is what it is by now.
//!
//! What a scene is used for seldom touches all of it. So where there is room, [the rest](Blocks::load_rest) comes too, once
//! half of the scene is here, and [little by little](REST): when loaders have nothing else to do, one of them reads what is
//! absent, from the first block to the last.
//!
//! **Who may rely on it.** As with [homes](super::slots): a reader that has entered an [epoch](super::epoch) and then sees
//! that the scene is whole may do without words until it leaves. A block that goes (because the cache is cleared) ends the
//! wholeness before its epoch, and keeps its memory for the readers of that one.

use super::blocks::Blocks;
use super::sync::{AtomicBool, AtomicU32, Ordering};
use crate::error::Result;

/// Bytes of the rest that may come a second, so that no frame takes much longer for it. To bring 285 MiB that the system had
/// in its memory took a processor 0.2 seconds (power plant, an EPYC of family 26, two processors): as quickly as could be, it
/// made frames of 20 ms take up to twice as long, with 4 MiB a frame 1.2 times. So it is a fortieth of a processor's time; and
/// frames that are traced as in memory take 0.93 to 0.98 of the time that they took before.
const REST: f64 = (32 << 20) as f64;

/// Whether all blocks are here, and how far the rest has come.
#[derive(Debug, Default)]
pub struct Whole {
    is_so: AtomicBool,
    /// Blocks before this one were here, or somebody else's to bring, when the rest was last looked for.
    rest: AtomicU32,
    /// Blocks of it that may still come with this frame.
    allowed: AtomicU32,
}

impl Whole {
    /// From now on, nobody takes it for granted that all blocks are here.
    pub fn end(&self) {
        self.is_so.store(false, Ordering::SeqCst);
    }

    /// The rest is looked for from the first block on.
    pub fn begin_anew(&self) {
        self.rest.store(0, Ordering::Relaxed);
    }
}

impl Blocks {
    /// Whether all blocks are here, and will be for who is in an epoch.
    pub fn is_whole(&self) -> bool {
        self.whole.is_so.load(Ordering::SeqCst)
    }

    /// Whether the rest is to come: there is room for all blocks, half of them are here, and some may lack that were not
    /// looked for.
    pub fn lacks_few(&self) -> bool {
        let count = self.layout.blocks();
        let may_lack = (self.whole.rest.load(Ordering::Relaxed) as usize) < count;
        self.holds_all() && may_lack && self.committed.load(Ordering::Relaxed) >= count / 2
    }

    /// Looks whether all blocks are here. From then on that is [taken for granted](Self::is_whole), unless uses are being
    /// noted down, which nobody would notice.
    pub fn look_whether_whole(&self) -> bool {
        let count = self.layout.blocks();
        let has_all = || self.committed.load(Ordering::Relaxed) == count;
        if !self.slots.hold_all() || self.words.is_tracing() || self.is_whole() || !has_all() {
            return self.is_whole();
        }
        // A block goes in two steps: its word says so, and then, under this lock, the wholeness ends. So what is seen here
        // is over before that, or is not true any more.
        let _retired = self.retired();
        let is_whole = (0..count).all(|block| self.words.is_here(block));
        self.whole.is_so.store(is_whole, Ordering::SeqCst);
        is_whole
    }

    /// From now on, so much of the rest may come as in so many seconds since the last frame began. If that was long ago, less:
    /// it all comes in the frame that begins now.
    pub fn allow_rest(&self, seconds: f64) {
        let blocks = (seconds.min(0.25) * REST / self.layout.block_bytes() as f64) as u32;
        self.whole.allowed.store(blocks.max(1), Ordering::Relaxed);
    }

    /// Reads some of the rest for this frame; whether there may be more. What cannot be read is no error until somebody needs
    /// it. One thread does this at a time.
    pub fn load_rest_of_frame(&self) -> bool {
        let came = self.load_rest().unwrap_or(0) as u32;
        let allowed = self.whole.allowed.load(Ordering::Relaxed).saturating_sub(came);
        self.whole.allowed.store(allowed, Ordering::Relaxed);
        came > 0 && allowed > 0
    }

    /// Reads some blocks that lie beside one another and are not here; how many: none if there are no more.
    ///
    /// # Errors
    /// They cannot be read. Then no more are looked for, and who needs them is told why.
    pub fn load_rest(&self) -> Result<usize> {
        let count = self.layout.blocks() as u32;
        let from = self.whole.rest.load(Ordering::Relaxed);
        let Some(next) = (from..count).find(|&block| self.claim(block)) else {
            self.whole.rest.store(count, Ordering::Relaxed);
            return Ok(0);
        };
        let blocks = self.claim_beside(next);
        match self.read(blocks.clone(), false) {
            Ok(_) => {
                self.whole.rest.store(blocks.end, Ordering::Relaxed);
                for block in blocks.clone() {
                    self.came_unasked(block);
                }
                Ok(blocks.len())
            }
            Err(error) => {
                self.whole.rest.store(count, Ordering::Relaxed);
                for block in blocks {
                    self.give_room();
                    self.directory(block).failed(block);
                }
                Err(error)
            }
        }
    }
}
