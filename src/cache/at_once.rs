//! Reading what the system has in memory, and nothing else.

use std::fs::File;

/// Fills `into` from a file's bytes at `offset` on if the system has all of them in memory. `false` if not, or
/// if that cannot be told.
#[cfg(target_os = "linux")]
pub fn read_at(file: &File, into: &mut [u8], offset: u64) -> bool {
    use std::os::fd::AsRawFd;
    let Ok(offset) = libc::off_t::try_from(offset) else { return false };
    let part = libc::iovec { iov_base: into.as_mut_ptr().cast(), iov_len: into.len() };
    // SAFETY: the descriptor is open for as long as `file` is borrowed, and the one part lies in `into`, which
    // nobody else has while it is written to.
    let read = unsafe { libc::preadv2(file.as_raw_fd(), &raw const part, 1, offset, libc::RWF_NOWAIT) };
    usize::try_from(read) == Ok(into.len())
}

/// Elsewhere it cannot be told.
#[cfg(not(target_os = "linux"))]
pub fn read_at(_file: &File, _into: &mut [u8], _offset: u64) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn what_was_just_written_is_there_at_once_or_not_at_all() {
        let mut file = tempfile::tempfile().expect("a file");
        let bytes: Vec<u8> = (0..20_000).map(|i| (i / 7) as u8).collect();
        file.write_all(&bytes).expect("written");
        let mut into = vec![0; 4096];
        // Some file systems never tell.
        if read_at(&file, &mut into, 8192) {
            assert_eq!(into, bytes[8192..8192 + 4096]);
        }
        assert!(!read_at(&file, &mut into, 18_000), "it ends before");
        assert!(!read_at(&file, &mut into, u64::MAX), "no file is so long");
    }
}
