//! Kernels of tactid behind a C interface, for the comparisons in `bench/peers`.
//!
//! A kernel computes one state, or all of them, and writes its result. The loop that repeats it and the clock are here, so
//! that no call from Python is timed.

mod dynamics;
mod estimators;

use std::ffi::{CStr, c_char};
use std::time::Instant;

use dynamics::{Dynamics, kernel};

/// Creates the robot of a URDF (its text) with the states to compute.
///
/// `states` has `count` rows: pose of the base (x, y, z, qx, qy, qz, qw), its twist and classical acceleration in world
/// axes (6 each), then positions, velocities and accelerations of the joints. Returns null where the robot has no link
/// `tool`.
///
/// # Safety
/// The strings end with zero, and `states` has as many numbers as said.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_dynamics_new(
    urdf: *const c_char,
    is_floating: bool,
    tool: *const c_char,
    states: *const f64,
    count: usize,
) -> *mut Dynamics {
    // SAFETY: the caller's promise.
    let (urdf, tool) = unsafe { (CStr::from_ptr(urdf), CStr::from_ptr(tool)) };
    let made = Dynamics::new(
        &urdf.to_string_lossy(),
        is_floating,
        &tool.to_string_lossy(),
    );
    made.map_or(std::ptr::null_mut(), |mut dynamics| {
        // SAFETY: the caller's promise.
        let numbers =
            unsafe { std::slice::from_raw_parts(states, count * dynamics.numbers_per_state()) };
        dynamics.set_states(numbers);
        Box::into_raw(Box::new(dynamics))
    })
}

/// Frees what [`tactid_dynamics_new`] made.
///
/// # Safety
/// The pointer comes from there and is not used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_dynamics_free(dynamics: *mut Dynamics) {
    // SAFETY: the caller's promise.
    drop(unsafe { Box::from_raw(dynamics) });
}

/// Computes all states `repetitions` times with the kernel of a name and returns the seconds of one state, or -1 for an
/// unknown kernel. The results of the states lie one after another in `out`, which has `len` numbers.
///
/// # Safety
/// The pointers are valid, and `out` has `len` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_dynamics_time(
    dynamics: *mut Dynamics,
    name: *const c_char,
    repetitions: usize,
    out: *mut f64,
    len: usize,
) -> f64 {
    // SAFETY: the caller's promise.
    let (dynamics, name, out) = unsafe {
        (
            &mut *dynamics,
            CStr::from_ptr(name),
            std::slice::from_raw_parts_mut(out, len),
        )
    };
    let Some(kernel) = kernel(&name.to_string_lossy()) else {
        return -1.0;
    };
    let start = Instant::now();
    for _ in 0..repetitions {
        kernel(dynamics, std::hint::black_box(&mut *out));
    }
    start.elapsed().as_secs_f64() / (repetitions * dynamics.count()) as f64
}

/// Presents rows, each of ten entries and a target, `repetitions` times to a new estimator of a name, and returns the
/// seconds of one row, or -1 for an unknown name. The ten parameters after the last row lie in `out`.
///
/// # Safety
/// `rows` has eleven numbers for each of `count` rows, and `out` has ten.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_estimator_time(
    name: *const c_char,
    rows: *const f64,
    count: usize,
    repetitions: usize,
    out: *mut f64,
) -> f64 {
    // SAFETY: the caller's promise.
    let (name, numbers, out) = unsafe {
        (
            CStr::from_ptr(name),
            std::slice::from_raw_parts(rows, 11 * count),
            std::slice::from_raw_parts_mut(out, 10),
        )
    };
    let Some(kernel) = estimators::kernel(&name.to_string_lossy()) else {
        return -1.0;
    };
    let rows = estimators::rows(numbers);
    let start = Instant::now();
    for _ in 0..repetitions {
        let parameters = kernel(std::hint::black_box(&rows));
        out.copy_from_slice(parameters.as_slice());
    }
    start.elapsed().as_secs_f64() / (repetitions * count) as f64
}
