//! Arrays in large pages of memory, where the system has them.
//!
//! Rays that have nothing in common read a tree all over the place, and every page of 4 KiB that is read has to be
//! looked up in tables, which themselves have to be fetched: in pages of 2 MiB there are five hundred times fewer. The
//! system gives them for the asking, before the array is written for the first time. Where it does not, nothing
//! is different.

/// A large page of most machines. Where it is another, the advice is as good.
const LARGE: usize = 2 << 20;

/// A vector with room for so many values. Panics as [`Vec::with_capacity`].
pub fn room_for<T>(count: usize) -> Vec<T> {
    let vector: Vec<T> = Vec::with_capacity(count);
    advise(vector.as_ptr().addr(), vector.capacity() * size_of::<T>());
    vector
}

/// So many copies of a value.
pub fn copies_of<T: Copy>(value: T, count: usize) -> Vec<T> {
    let mut vector = room_for(count);
    vector.resize(count, value);
    vector
}

/// The large pages that lie wholly in some bytes.
fn inside(first: usize, bytes: usize) -> std::ops::Range<usize> {
    first.next_multiple_of(LARGE)..(first + bytes) / LARGE * LARGE
}

/// Asks for large pages in place of those that are not in use yet.
#[cfg(all(target_os = "linux", not(miri)))]
fn advise(first: usize, bytes: usize) {
    let pages = inside(first, bytes);
    if pages.start < pages.end {
        let start = std::ptr::without_provenance_mut(pages.start);
        // SAFETY: the range lies in an allocation of ours, and this advice changes nothing that a program can see.
        // A refusal is no fault: then pages stay small.
        unsafe { libc::madvise(start, pages.len(), libc::MADV_HUGEPAGE) };
    }
}

#[cfg(not(all(target_os = "linux", not(miri))))]
fn advise(first: usize, bytes: usize) {
    let _ = inside(first, bytes);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_pages_are_spoken_of() {
        assert_eq!(inside(0, LARGE), 0..LARGE);
        assert_eq!(inside(1, 2 * LARGE), LARGE..2 * LARGE);
        assert!(inside(1, LARGE).is_empty());
        assert!(inside(LARGE - 8, 16).is_empty());
    }

    #[test]
    fn arrays_are_what_they_would_be_anyway() {
        for count in [0, 1, 1000, 3 * LARGE / 4] {
            let copies = copies_of(7u32, count);
            assert_eq!(copies.len(), count);
            assert!(copies.iter().all(|&copy| copy == 7));
            assert!(room_for::<u32>(count).capacity() >= count);
        }
    }
}
