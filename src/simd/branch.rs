//! Branches that have to stay branches.

/// Keeps the way of an `if` that it stands in a way of its own: no compiler makes an arithmetic choice of both.
///
/// For walks. Which child comes next hangs on a comparison of vectors, some twenty cycles long, and is foreseen right most of
/// the time. A processor that foresees it has the child's planes at work meanwhile; one that has to choose by
/// arithmetic waits for the comparison at each node. Which of the two a compiler makes of the same source differs from one
/// copy of a kernel to the next: packets of 16 through a cached scene took 1.4 times as long as through a resident one for
/// it (power plant from inside, AVX-512, Zen 5).
#[inline(always)]
pub fn stay_a_branch() {
    #[cfg(all(not(miri), any(target_arch = "x86_64", target_arch = "aarch64")))]
    // SAFETY: there is no instruction in it.
    unsafe {
        std::arch::asm!("", options(nomem, nostack, preserves_flags));
    }
}
