//! Kernels of tactid behind a C interface, for the comparisons in `bench/peers`.
//!
//! A kernel computes one state, or all of them, and writes its result. The loop that repeats it is
//! here, so that one call from Python runs for milliseconds and its own cost does not count.

mod dynamics;
mod estimators;
mod online;

use std::ffi::{CStr, c_char};

use dynamics::{Dynamics, kernel};
use online::Online;

/// Creates the robot of a URDF (its text) with the states to compute.
///
/// `states` has `count` rows: pose of the base (x, y, z, qx, qy, qz, qw), its twist and classical
/// acceleration in world axes (6 each), then positions, velocities and accelerations of the joints.
/// Returns null where the robot has no link `tool`.
///
/// # Safety
/// The strings end with zero, and each of the `count` rows of `states` has 19 numbers of the base
/// and three for each joint.
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
        dynamics.add_states(numbers);
        Box::into_raw(Box::new(dynamics))
    })
}

/// Computes all states `repetitions` times with the kernel of a name, and returns whether there is
/// such a kernel and no error. The results of the states lie one after another in `out`, which has
/// `len` numbers.
///
/// # Safety
/// The handle is one that the constructor returned and not null, the name ends with zero, and `out`
/// has `len` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_dynamics_run(
    dynamics: *mut Dynamics,
    name: *const c_char,
    repetitions: usize,
    out: *mut f64,
    len: usize,
) -> bool {
    // SAFETY: the caller's promise.
    let (dynamics, name, out) = unsafe {
        (
            &mut *dynamics,
            CStr::from_ptr(name),
            std::slice::from_raw_parts_mut(out, len),
        )
    };
    let Some(kernel) = kernel(&name.to_string_lossy()) else {
        return false;
    };
    (0..repetitions).all(|_| kernel(dynamics, std::hint::black_box(&mut *out)).is_some())
}

/// Presents rows, each of ten entries and a target, `repetitions` times to a new estimator of a
/// name, and returns whether there is such an estimator. The ten parameters after the last row lie
/// in `out`.
///
/// # Safety
/// `rows` has eleven numbers for each of `count` rows, and `out` has ten.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_estimator_run(
    name: *const c_char,
    rows: *const f64,
    count: usize,
    repetitions: usize,
    out: *mut f64,
) -> bool {
    // SAFETY: the caller's promise.
    let (name, numbers, out) = unsafe {
        (
            CStr::from_ptr(name),
            std::slice::from_raw_parts(rows, 11 * count),
            std::slice::from_raw_parts_mut(out, 10),
        )
    };
    let Some(kernel) = estimators::kernel(&name.to_string_lossy()) else {
        return false;
    };
    let rows = estimators::rows(numbers);
    for _ in 0..repetitions {
        let parameters = kernel(std::hint::black_box(&rows));
        out.copy_from_slice(parameters.as_slice());
    }
    true
}

/// Creates the robot of a URDF (its text) on a fixed base with a wrench sensor at the link `tool`,
/// and `len` numbers of samples: time, positions and velocities of the joints, force and moment.
/// Returns null where the robot has no such link.
///
/// # Safety
/// The strings end with zero, and `samples` has `len` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_online_new(
    urdf: *const c_char,
    tool: *const c_char,
    samples: *const f64,
    len: usize,
) -> *mut Online {
    // SAFETY: the caller's promise.
    let (urdf, tool, samples) = unsafe {
        (
            CStr::from_ptr(urdf),
            CStr::from_ptr(tool),
            std::slice::from_raw_parts(samples, len),
        )
    };
    Online::new(&urdf.to_string_lossy(), &tool.to_string_lossy(), samples)
        .map_or(std::ptr::null_mut(), |online| {
            Box::into_raw(Box::new(online))
        })
}

/// Presents all samples `repetitions` times with the kernel of a name, and returns whether there is
/// such a kernel and no error. The last result lies in `out`, which has `len` numbers.
///
/// # Safety
/// The handle is one that the constructor returned and not null, the name ends with zero, and `out`
/// has `len` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_online_run(
    online: *const Online,
    name: *const c_char,
    repetitions: usize,
    out: *mut f64,
    len: usize,
) -> bool {
    // SAFETY: the caller's promise.
    let (online, name, out) = unsafe {
        (
            &*online,
            CStr::from_ptr(name),
            std::slice::from_raw_parts_mut(out, len),
        )
    };
    let Some(kernel) = online::kernel(&name.to_string_lossy()) else {
        return false;
    };
    (0..repetitions).all(|_| kernel(online, std::hint::black_box(&mut *out)).is_some())
}
