//! How much memory the process occupies, as the system sees it.

use std::fs;
use std::sync::atomic::{AtomicU64, Ordering};

/// The most bytes that were resident before a measurement had the system forget them.
static FORGOTTEN: AtomicU64 = AtomicU64::new(0);

/// A measurement of how far the resident memory rises. On Linux; elsewhere there is none.
///
/// It sees all libraries alike, whatever allocator they use. What an allocator has kept from before is used
/// again without a rise, so that figures are good to a few per cent of what the process has freed before.
#[derive(Clone, Copy, Debug)]
pub struct Resident {
    before: u64,
}

impl Resident {
    /// Starts to measure; `None` if the system does not say, or does not let the peak be forgotten.
    pub fn start() -> Option<Self> {
        FORGOTTEN.fetch_max(status("VmHWM:")?, Ordering::Relaxed);
        // "5" sets the peak back to what is resident now (proc(5)).
        fs::write("/proc/self/clear_refs", "5").ok()?;
        Some(Self { before: status("VmRSS:")? })
    }

    /// Bytes by which the memory has risen at its peak.
    pub fn rise(self) -> Option<u64> {
        Some(status("VmHWM:")?.saturating_sub(self.before))
    }
}

/// Bytes that are resident now; `None` if the system does not say.
pub fn now() -> Option<u64> {
    status("VmRSS:")
}

/// The most bytes that the process ever had resident so far; `None` if the system does not say.
pub fn peak() -> Option<u64> {
    status("VmHWM:").map(|peak| peak.max(FORGOTTEN.load(Ordering::Relaxed)))
}

/// A line of the process's status, in bytes.
fn status(key: &str) -> Option<u64> {
    let text = fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_array_is_seen() {
        let Some(resident) = Resident::start() else { return };
        let array = std::hint::black_box(vec![1u8; 64 << 20]);
        let rise = resident.rise().expect("the system says");
        assert!(rise >= 48 << 20 && array.len() == 64 << 20, "{rise}");
    }

    #[test]
    fn a_peak_outlasts_measurements_after_it() {
        let array = std::hint::black_box(vec![1u8; 64 << 20]);
        let Some(before) = peak() else { return };
        assert!(before >= array.len() as u64);
        drop(array);
        let _ = Resident::start();
        // The system counts pages by processor, and adds up now and then.
        let (after, slack) = (peak().expect("the system said before"), 8 << 20);
        assert!(after + slack >= before, "{after} after {before}");
    }
}
