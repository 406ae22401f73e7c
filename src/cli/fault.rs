//! What becomes of a mapped file that is cut short while it is open, or whose disk fails: the command ends as it does
//! for any other error, with a line that names the file, and no file is left behind that is not complete.
//!
//! The system says it by a signal (SIGBUS) to the thread that reads there. On Linux; elsewhere that ends the process.

#[cfg(target_os = "linux")]
pub use linux::handle;

/// Nothing can be done.
#[cfg(not(target_os = "linux"))]
pub fn handle() {}

#[cfg(target_os = "linux")]
mod linux {
    use crate::{files, mapped};
    use libc::{c_int, c_void, siginfo_t};
    use std::io::IoSlice;
    use std::mem::MaybeUninit;
    use std::ptr;
    use std::sync::atomic::{AtomicBool, Ordering};

    /// From now on, mapped files that cannot be read end the process so.
    pub fn handle() {
        let handler: extern "C" fn(c_int, *mut siginfo_t, *mut c_void) = fault;
        // SAFETY: all zeros is an action with an empty mask. The handler is of the kind that SA_SIGINFO says; it does
        // only what may be done there, see `fault`. It runs on the thread's own stack, which is not what overflowed.
        let failed = unsafe {
            let mut action: libc::sigaction = MaybeUninit::zeroed().assume_init();
            action.sa_sigaction = handler as *const () as usize;
            action.sa_flags = libc::SA_SIGINFO;
            libc::sigaction(libc::SIGBUS, &raw const action, ptr::null_mut()) != 0
        };
        if failed {
            let error = std::io::Error::last_os_error();
            tracing::warn!("a file that is cut short while it is open will end this without a word: {error}");
        }
    }

    /// Whether a thread has begun to end the process.
    static ENDS: AtomicBool = AtomicBool::new(false);

    /// A thread was reading at an address where nothing could be read.
    ///
    /// Where that is in a mapped file, the thread was doing just that, and holds no lock of the allocator, or of the
    /// list of temporary files: these are not locked while a mapped file is read. So both may be used then.
    extern "C" fn fault(signal: c_int, info: *mut siginfo_t, _: *mut c_void) {
        // SAFETY: the system hands over what it knows. What another process sent has no address.
        let (by_system, address) = unsafe { ((*info).si_code > 0, (*info).si_addr().addr()) };
        if by_system {
            // SAFETY: this thread was interrupted where it was reading there.
            unsafe { mapped::with_name_at::<()>(address, |name| end(name)) };
        }
        // Somebody else's: what it would have done by itself, as soon as this returns.
        // SAFETY: both may be called by handlers.
        unsafe {
            libc::signal(signal, libc::SIG_DFL);
            libc::raise(signal);
        }
    }

    /// Says what happened to a file, and ends the process.
    fn end(name: &str) -> ! {
        if ENDS.swap(true, Ordering::AcqRel) {
            // Another thread is at it.
            loop {
                // SAFETY: it waits for a signal.
                unsafe { libc::pause() };
            }
        }
        // SAFETY: it only asks.
        let on_terminal = unsafe { libc::isatty(libc::STDERR_FILENO) } == 1;
        // A bar that shows progress may be in the way.
        let clear = if on_terminal { "\r\x1b[K" } else { "" };
        let message = [
            clear,
            "raypack: error: cannot read ",
            name,
            ": it was cut short while it was open, or its disk fails; see that it is whole, and begin again\n",
        ]
        .map(|part| IoSlice::new(part.as_bytes()));
        // SAFETY: a slice for I/O is what the system takes for one, and they live. All at once, so that nobody else's
        // words come between.
        unsafe { libc::writev(libc::STDERR_FILENO, message.as_ptr().cast(), message.len() as c_int) };
        files::abandon();
        // SAFETY: ends the process without anybody's doing.
        unsafe { libc::_exit(1) }
    }
}
