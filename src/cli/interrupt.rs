//! What an interrupt (Ctrl-C) does: it ends the process, and no file is left behind that is not complete.

use crate::files;
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// What the first interrupt sets instead, for a command that then ends by itself.
static STOP: Mutex<Option<Arc<AtomicBool>>> = Mutex::new(None);

/// What shells say of a process that an interrupt has ended.
const INTERRUPTED: i32 = 130;

/// From now on, interrupts end the process so.
pub fn handle() {
    if let Err(error) = ctrlc::set_handler(interrupted) {
        tracing::warn!("an interrupt will leave files behind that are not complete: {error}");
    }
}

/// From now on, the next interrupt sets `stop`; the one after that ends the process.
pub fn sets(stop: &Arc<AtomicBool>) {
    *STOP.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::clone(stop));
}

fn interrupted() {
    let stop = STOP.lock().unwrap_or_else(PoisonError::into_inner).take();
    match stop {
        Some(stop) => stop.store(true, Ordering::Relaxed),
        None => {
            files::abandon();
            process::exit(INTERRUPTED);
        }
    }
}
