//! Letting go of what has been read of a mapped file.

use memmap2::Mmap;
use std::cell::Cell;

/// Lets go of what has been read of a mapped file, so that it is not in memory all at once.
pub(super) struct Behind<'a> {
    map: &'a Mmap,
    released: Cell<usize>,
}

impl<'a> Behind<'a> {
    /// Of this file nothing has been read yet.
    pub fn new(map: &'a Mmap) -> Self {
        Self { map, released: Cell::new(0) }
    }
}

impl Behind<'_> {
    /// Bytes before the part that is read that are kept: `part` is rounded.
    const KEPT: usize = 1 << 20;

    /// Lets go of what lies before this part (0 to 1).
    #[cfg(unix)]
    pub fn release(&self, part: f32) {
        let end = ((self.map.len() as f64 * f64::from(part)) as usize).saturating_sub(Self::KEPT);
        let begin = self.released.get();
        if end > begin {
            // SAFETY: the map is of a file and only ever read: what is let go of is read from the file again if
            // it is touched again. That it cannot be done changes nothing.
            let _ = unsafe {
                self.map.unchecked_advise_range(memmap2::UncheckedAdvice::DontNeed, begin, end - begin)
            };
            self.released.set(end);
        }
    }

    /// Nothing can be done.
    #[cfg(not(unix))]
    pub fn release(&self, _part: f32) {}
}
