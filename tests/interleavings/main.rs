//! The cache's protocol under a scheduler that decides who runs next (shuttle: after Burckhardt et al., "A
//! Randomized Scheduler with Probabilistic Guarantees of Finding Bugs", 2010).
//!
//! The files of the protocol are compiled once more, with shuttle's locks and atomics in place of the standard
//! library's (`sync`): every lock, wait and atomic access is a point at which another thread may go on. Thousands
//! of schedules are tried, from fixed seeds; one that fails is printed and can be run again. What no scheduler of
//! this kind sees is memory that is seen out of order: all accesses here are in one order.
//!
//! A file without tests of its own `main`, so that the unit tests in those files stay where they are.

#![allow(dead_code, unused_imports)]

#[path = "../../src/cache/ahead.rs"]
mod ahead;
#[path = "../../src/cache/beside.rs"]
mod beside;
#[path = "../../src/cache/blocks.rs"]
mod blocks;
#[path = "../../src/cache/deadline.rs"]
mod deadline;
#[path = "../../src/cache/directory.rs"]
mod directory;
#[path = "../../src/cache/epoch.rs"]
mod epoch;
#[path = "../../src/cache/eras.rs"]
mod eras;
#[path = "../../src/cache/gate.rs"]
mod gate;
#[path = "../../src/cache/gather.rs"]
mod gather;
#[path = "../../src/cache/known.rs"]
mod known;
#[path = "../../src/cache/layout.rs"]
mod layout;
#[path = "../../src/cache/loaders.rs"]
mod loaders;
#[path = "../../src/cache/pieces.rs"]
mod pieces;
#[path = "../../src/cache/plan.rs"]
mod plan;
#[path = "../../src/cache/policy/mod.rs"]
mod policy;
#[path = "../../src/cache/quota.rs"]
mod quota;
#[path = "../../src/cache/requests.rs"]
mod requests;
#[path = "../../src/cache/retired.rs"]
mod retired;
#[path = "../../src/cache/room.rs"]
mod room;
#[path = "../../src/cache/slots.rs"]
mod slots;
#[path = "../../src/cache/source.rs"]
mod source;
#[path = "../../src/cache/stats.rs"]
mod stats;
#[path = "../../src/cache/whole.rs"]
mod whole;
#[path = "../../src/cache/words.rs"]
mod words;

/// What the included files use of the library.
mod error {
    pub use raypack::error::{Error, Result};
}

/// What threads share, under shuttle.
mod sync {
    pub use shuttle::sync::atomic::{
        AtomicBool, AtomicU16, AtomicU32, AtomicU64, AtomicUsize, Ordering, fence,
    };
    pub use shuttle::sync::{Arc, Condvar, Mutex, MutexGuard};
    pub use shuttle::thread;
    pub use std::sync::PoisonError;
}

mod parts;
mod scenes;

use std::env;
use std::time::Instant;

/// What is tried, and in how many schedules.
const CHECKS: [(&str, fn(), usize); 18] = [
    ("blocks are whole for as long as they are read", scenes::blocks_are_whole, 1500),
    ("the same in sets of one block", scenes::sets_of_one, 1500),
    ("a block may be asked for while it goes", scenes::asked_for_again, 6000),
    ("blocks move while they are read", scenes::blocks_move, 3000),
    ("nobody waits for ever for a block that failed", scenes::a_failure_ends, 1500),
    ("a deadline leaves nothing behind", scenes::a_deadline, 6000),
    ("a block may be needed while it comes ahead of need", scenes::ahead_of_need, 1500),
    ("the same ahead of need, in sets of one block", scenes::ahead_in_sets_of_one, 1500),
    ("what cannot come ahead of need is no error", scenes::ahead_fails, 1500),
    ("blocks come with those beside them", scenes::beside, 3000),
    ("one that cannot come is no error for those beside it", scenes::beside_fails, 1500),
    ("a whole scene is whole for as long as it is read", scenes::all_goes, 6000),
    ("a scene becomes whole, and is no longer", scenes::whole_and_not, 3000),
    ("loaders end whatever was asked for ahead of need", scenes::ahead_at_the_end, 1500),
    ("what is retired is freed when nobody reads it", parts::epochs_hold, 3000),
    ("what is known to be here can be read", parts::known_lists_hold, 6000),
    ("the gate lets in as many as there are places", parts::the_gate_holds, 3000),
    ("a quota comes to all who want some of it", parts::the_quota_comes_round, 3000),
];

/// How many threads may be put off in a schedule of the second kind.
const DEPTH: usize = 3;

fn main() {
    // As the test harness does it: words choose checks; of a list, as tools ask for, there is nothing to tell.
    let words: Vec<String> = env::args().skip(1).collect();
    if words.iter().any(|word| word == "--list") {
        return;
    }
    let chosen = |name: &str| {
        let mut filters = words.iter().filter(|word| !word.starts_with('-')).peekable();
        filters.peek().is_none() || filters.any(|word| name.contains(word.as_str()))
    };
    for (name, check, schedules) in CHECKS {
        if chosen(name) {
            let start = Instant::now();
            shuttle::check_random(check, schedules);
            shuttle::check_pct(check, schedules / 3, DEPTH);
            println!("test {name} ... ok ({schedules} schedules, {:.1} s)", start.elapsed().as_secs_f64());
        }
    }
}
