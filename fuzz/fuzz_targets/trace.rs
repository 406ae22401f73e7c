//! Any triangles and rays, through every kernel.
#![no_main]

#[path = "../../tests/fuzzing/trace.rs"]
mod trace;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| trace::build_and_trace(bytes));
