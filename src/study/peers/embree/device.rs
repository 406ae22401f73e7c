//! A device: Embree's configuration, and the account of its memory.

use super::abi::{Handle, PROPERTY_VERSION_MAJOR, error_name};
use super::locate::{Loaded, load};
use crate::error::{Error, Result};
use crate::simd::Isa;
use std::ffi::{CString, c_void};
use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

/// `major.minor.patch`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    /// 4.
    pub major: u32,
    /// Minor.
    pub minor: u32,
    /// Patch.
    pub patch: u32,
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

/// An Embree device.
pub struct Device {
    library: &'static Loaded,
    handle: Handle,
    version: Version,
    isa: &'static str,
    /// Bytes that the device's objects hold now. Boxed: Embree keeps its address.
    bytes: Box<AtomicI64>,
}

// SAFETY: Embree's device functions may be called from any thread, and `bytes` is atomic.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

impl Device {
    /// Loads Embree if it is not loaded yet, and makes a device that builds with `threads` threads (0:
    /// all). `isa` holds Embree to an instruction set; `None` leaves it the machine's best.
    ///
    /// # Errors
    /// Embree is not here, is not version 4, or refuses the configuration.
    pub fn new(threads: usize, isa: Option<Isa>) -> Result<Arc<Self>> {
        let library = load()?;
        let mut config = format!("threads={threads},start_threads=1");
        if let Some(isa) = isa {
            config += &format!(",isa={}", embree_name(isa));
        }
        let c_config = CString::new(config.as_str()).expect("a configuration holds no NUL");
        // SAFETY: the string is NUL-terminated and outlives the call.
        let handle = unsafe { (library.api.new_device)(c_config.as_ptr()) }.ok_or_else(|| {
            // SAFETY: without a device the function reports the calling thread's last error.
            let code = unsafe { (library.api.device_error)(None) };
            refused(&library.path, format!("no device for \"{config}\": {}", error_name(code)))
        })?;
        // SAFETY: the device is alive, and the three properties are consecutive numbers.
        let [major, minor, patch] = [0, 1, 2]
            .map(|i| unsafe { (library.api.device_property)(handle, PROPERTY_VERSION_MAJOR + i) } as u32);
        let device = Self {
            library,
            handle,
            version: Version { major, minor, patch },
            isa: isa.map_or_else(best_isa, embree_name),
            bytes: Box::new(AtomicI64::new(0)),
        };
        if major != 4 {
            return Err(refused(
                &library.path,
                format!("it is version {}, and 4 is needed; run scripts/get-embree", device.version),
            ));
        }
        let user = (&raw const *device.bytes).cast_mut().cast::<c_void>();
        // SAFETY: the counter's address is stable, and `drop` unregisters the monitor before it goes.
        unsafe { (library.api.set_memory_monitor)(handle, Some(count_bytes), user) };
        Ok(Arc::new(device))
    }

    /// Embree's version.
    pub fn version(&self) -> Version {
        self.version
    }

    /// The instruction set that this device uses, by Embree's name for it.
    pub fn isa(&self) -> &'static str {
        self.isa
    }

    /// The library's file.
    pub fn path(&self) -> &Path {
        &self.library.path
    }

    /// Bytes that the device's scenes and geometries hold now.
    pub fn bytes(&self) -> i64 {
        self.bytes.load(Ordering::Relaxed)
    }

    pub(super) fn library(&self) -> &'static Loaded {
        self.library
    }

    pub(super) fn handle(&self) -> Handle {
        self.handle
    }

    /// The last error of the calling thread, if there is one; asking clears it.
    pub(super) fn check(&self, doing: &str) -> Result<()> {
        // SAFETY: the device is alive.
        match unsafe { (self.library.api.device_error)(Some(self.handle)) } {
            0 => Ok(()),
            code => Err(refused(&self.library.path, format!("{doing}: {}", error_name(code)))),
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: scenes hold the device, so none is left; the monitor is unregistered before `bytes` goes.
        unsafe {
            (self.library.api.set_memory_monitor)(self.handle, None, std::ptr::null_mut());
            (self.library.api.release_device)(self.handle);
        }
    }
}

impl fmt::Debug for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Embree {} ({}) from {}", self.version, self.isa, self.library.path.display())
    }
}

/// Embree's memory monitor: keeps the sum.
unsafe extern "C" fn count_bytes(user: *mut c_void, bytes: isize, _after: bool) -> bool {
    // SAFETY: `user` is the device's counter, registered in `Device::new` and alive until unregistered.
    let total = unsafe { &*user.cast::<AtomicI64>() };
    total.fetch_add(bytes as i64, Ordering::Relaxed);
    true
}

fn refused(library: &Path, reason: String) -> Error {
    Error::Missing { what: "a usable Embree 4".into(), remedy: format!("{}: {reason}", library.display()) }
}

/// The instruction set of Embree's that is nearest to one of ours.
const fn embree_name(isa: Isa) -> &'static str {
    match isa {
        Isa::Portable => "sse2",
        Isa::Avx2 => "avx2",
        Isa::Avx512 => "avx512",
    }
}

/// What Embree chooses when left free: the best that both it and the machine have.
fn best_isa() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::is_x86_feature_detected as has;
        if has!("avx512f") && has!("avx512cd") && has!("avx512dq") && has!("avx512bw") && has!("avx512vl") {
            return "avx512";
        }
        if has!("avx2") && has!("fma") && has!("bmi1") && has!("bmi2") {
            return "avx2";
        }
        if has!("avx") {
            return "avx";
        }
        if has!("sse4.2") { "sse4.2" } else { "sse2" }
    }
    #[cfg(not(target_arch = "x86_64"))]
    "neon"
}
