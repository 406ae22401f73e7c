//! Letting go of what has been read of a mapped file.

use memmap2::Mmap;
use std::cell::Cell;
use std::ops::Range;

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
    pub fn release(&self, part: f32) {
        let end = ((self.map.len() as f64 * f64::from(part)) as usize).saturating_sub(Self::KEPT);
        let begin = self.released.get();
        if end > begin {
            let_go(self.map, begin..end);
            self.released.set(end);
        }
    }
}

/// Lets go of what is in memory of some bytes of a mapped file.
#[cfg(unix)]
pub(in crate::mesh) fn let_go(map: &Mmap, bytes: Range<usize>) {
    // SAFETY: the map is of a file and only ever read: what is let go of is read from the file again if it is touched
    // again. That it cannot be done changes nothing.
    let _ =
        unsafe { map.unchecked_advise_range(memmap2::UncheckedAdvice::DontNeed, bytes.start, bytes.len()) };
}

/// Nothing can be done.
#[cfg(not(unix))]
pub(in crate::mesh) fn let_go(_map: &Mmap, _bytes: Range<usize>) {}

/// Has the system bring small pages of a mapped file into memory, for who looks at it here and there: of files that it
/// keeps in large pieces itself, Linux maps 2 MiB for a byte.
pub(in crate::mesh) fn in_small_pages(map: &Mmap) {
    // A system that does not know of this has no large pages.
    #[cfg(target_os = "linux")]
    let _ = map.advise(memmap2::Advice::NoHugePage);
    #[cfg(not(target_os = "linux"))]
    let _ = map;
}
