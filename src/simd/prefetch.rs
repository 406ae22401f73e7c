//! A hint to the caches.

/// Asks for the two cache lines that a value of up to 64 bytes may lie in, as [`prefetch`] does.
#[inline(always)]
pub fn prefetch_both<T>(at: *const T) {
    prefetch(at);
    prefetch(at.cast::<u8>().wrapping_add(size_of::<T>() - 1));
}

/// Asks for the cache line at an address. A hint: it changes no result, the address need not be one of
/// anything, and nothing happens where the machine has no such instruction.
#[inline(always)]
pub fn prefetch<T>(at: *const T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 machine has the instruction, and it never faults, whatever the address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(at.cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = at;
}
