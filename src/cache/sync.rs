//! What threads share and wait for, from one place: `tests/interleavings` puts a scheduler of its own in its
//! stead, and has the protocol's files run under that.

pub use std::sync::atomic::{AtomicBool, AtomicU16, AtomicU32, AtomicU64, AtomicUsize, Ordering, fence};
pub use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
pub use std::thread;
