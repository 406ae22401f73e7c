//! What waits while a walk is elsewhere.

use crate::kdtree::MAX_DEPTH;
use std::mem::MaybeUninit;

/// Subtrees that wait for their turn. Left uninitialised: clearing 8 KB would cost more than a short
/// walk.
pub struct Stack<T> {
    entries: [MaybeUninit<T>; MAX_DEPTH + 1],
    len: usize,
}

impl<T: Copy> Stack<T> {
    /// An empty stack.
    #[inline(always)]
    pub fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; MAX_DEPTH + 1], len: 0 }
    }

    /// Panics beyond `MAX_DEPTH + 1` entries: a walk waits at most once a level, and for where it is.
    #[inline(always)]
    pub fn push(&mut self, waiting: T) {
        self.entries[self.len].write(waiting);
        self.len += 1;
    }

    /// The entry that was pushed last.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<T> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: `len` only grows in `push`, which has written every entry below it.
        Some(unsafe { self.entries[self.len].assume_init() })
    }
}
