//! The STL reader on any bytes.
#![no_main]

#[allow(dead_code)] // The readers are one file, and each fuzzer runs one of them.
#[path = "../../tests/fuzzing/readers.rs"]
mod readers;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| readers::stl(bytes));
