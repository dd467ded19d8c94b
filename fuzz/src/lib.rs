//! A limit of the memory that one input of a fuzz target may allocate.
//!
//! Each file in `targets/` is a program of libFuzzer, which mutates inputs towards new coverage,
//! and runs a function of `checks/`. A target fails by a panic, by more than [`MEMORY`] for one
//! input, and by an input that takes longer than libFuzzer's `-timeout`.

use std::alloc::System;

use cap::Cap;

/// Allocator of all targets. Memory that SQLite and zstd allocate in C is bounded by libFuzzer's
/// `-rss_limit_mb`.
#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

/// The program of a target: it gives the inputs of libFuzzer to a check, within [`MEMORY`].
#[macro_export]
macro_rules! target {
    ($check:path) => {
        libfuzzer_sys::fuzz_target!(|bytes: &[u8]| $crate::within_memory(|| $check(bytes)));
    };
}

/// Largest memory that one input may need in addition to what is allocated before it, bytes.
pub const MEMORY: usize = 512 << 20;

/// Runs `check` with an allocator that refuses more than [`MEMORY`], which ends the process.
///
/// # Panics
/// Panics if the limit cannot be set, which is below what is allocated only if other threads
/// allocate meanwhile.
pub fn within_memory<T>(check: impl FnOnce() -> T) -> T {
    let limit = ALLOCATOR.allocated().saturating_add(MEMORY);
    assert!(
        ALLOCATOR.set_limit(limit).is_ok(),
        "a limit of {limit} bytes"
    );
    check()
}
