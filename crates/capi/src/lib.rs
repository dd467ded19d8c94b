//! The C interface of tactid's online [`Identifier`]: `libtactid` and its header `tactid.h`,
//! which cbindgen writes from this crate.
//!
//! What crosses the border is plain: an opaque handle, structs that begin with their size, arrays
//! of the caller, and a status. All unsafe code of tactid is here: `border` turns pointers into
//! references, and the rest of the crate calls it.

#![allow(non_camel_case_types, reason = "types have the names of the header")]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod border;
mod estimate;
mod options;
mod sample;
mod snapshot;
mod status;
mod wrench;

use std::cell::RefCell;
use std::ffi::{CStr, c_char};

use tactid_identify::{Identifier, Manipulator, PushOutcome, WrenchFrame};

pub use estimate::{TACTID_IDENTIFIABLE, TACTID_UNCERTAIN, TACTID_UNOBSERVABLE, tactid_estimate};
pub use options::{
    TACTID_ACTS_ON_PAYLOAD, TACTID_ACTS_ON_SENSOR, TACTID_EFFORT_EXTERNAL, TACTID_EFFORT_MEASURED,
    TACTID_EFFORT_WITHOUT_GRAVITY, TACTID_METHOD_COMBINED, TACTID_METHOD_COMBINED_WITH_EFFORT,
    TACTID_METHOD_EFFORT, TACTID_METHOD_JOINT_SENSING, TACTID_METHOD_TACTILE,
    TACTID_WRENCH_CONTACT, TACTID_WRENCH_RAW, TACTID_WRENCH_WITHOUT_WEIGHT, tactid_options,
};
pub use sample::tactid_sample;
pub use snapshot::{
    tactid_snapshot, tactid_snapshot_findings, tactid_snapshot_free, tactid_snapshot_new,
    tactid_snapshot_update,
};
pub use status::tactid_status;
pub use wrench::{TACTID_CHANGING, TACTID_SETTLED, tactid_wrench};

use border::guarded;
use sample::Samples;
use status::{Failure, meaning};

/// An online identifier of one payload on one robot.
#[derive(Debug)]
pub struct tactid_identifier {
    identifier: Identifier,
    samples: Samples,
    /// The frame of load and contact.
    wrench_frame: WrenchFrame,
}

thread_local! {
    /// Why the last identifier of this thread was not created.
    static LAST_ERROR: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Returns the version of the library, such as `0.1.0`. The text is static.
#[unsafe(no_mangle)]
pub extern "C" fn tactid_version() -> *const c_char {
    const VERSION: &CStr =
        match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
            Ok(version) => version,
            Err(_) => c"",
        };
    VERSION.as_ptr()
}

/// Returns what a status means, in English, also of a number that is none. The text is static.
#[unsafe(no_mangle)]
pub extern "C" fn tactid_status_text(status: i32) -> *const c_char {
    meaning(status).as_ptr()
}

/// Copies why the last `tactid_identifier_new` of this thread failed, in English, and returns the
/// number of bytes that the whole text needs with the zero at its end. A buffer that is shorter
/// gets the beginning of the text; it may be null where `size` is 0.
///
/// # Safety
/// `buffer` is null, or has `size` writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_last_error(buffer: *mut c_char, size: usize) -> usize {
    // SAFETY: the caller's promise.
    LAST_ERROR.with_borrow(|text| unsafe { border::write_text(text, buffer, size) })
}

/// Creates an identifier for the robot of a URDF, given as its text, whose end-effector frame is
/// the link `tip`.
///
/// `joints` has the `joint_count` names of the joints in the order in which samples have them. It
/// must name all joints that move the tip or a sensor; others may be missing and count as zero, and
/// names that the robot does not have are ignored. Methods that use efforts or the momentum of a
/// floating base need all joints. `options` may be null: all then have their defaults.
/// `*identifier` is the caller's, who ends it with `tactid_identifier_free`; it is null after an
/// error, whose text `tactid_last_error` returns.
///
/// Allocates; some 1 ms.
///
/// # Safety
/// Texts end with zero, and pointers are null or point to what is documented.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_identifier_new(
    urdf: *const c_char,
    tip: *const c_char,
    joints: *const *const c_char,
    joint_count: usize,
    options: *const tactid_options,
    identifier: *mut *mut tactid_identifier,
) -> tactid_status {
    guarded(|| {
        // SAFETY: the caller's promise.
        let identifier = unsafe { border::place(identifier) };
        let made = identifier.map_err(Failure::from).and_then(|identifier| {
            *identifier = std::ptr::null_mut();
            // SAFETY: the caller's promise.
            let made = unsafe { created(urdf, tip, joints, joint_count, options) }?;
            *identifier = Box::into_raw(Box::new(made));
            Ok(())
        });
        made.map_err(|failure| {
            LAST_ERROR.set(failure.text);
            failure.status
        })?;
        Ok(tactid_status::Ok)
    })
}

/// Creates an identifier from the arguments of [`tactid_identifier_new`].
///
/// # Safety
/// As there.
unsafe fn created(
    urdf: *const c_char,
    tip: *const c_char,
    joints: *const *const c_char,
    joint_count: usize,
    options: *const tactid_options,
) -> Result<tactid_identifier, Failure> {
    // SAFETY: the caller's promise.
    let urdf = unsafe { border::text(urdf) }?;
    // SAFETY: the caller's promise.
    let tip = unsafe { border::text(tip) }?;
    // SAFETY: the caller's promise.
    let joints = unsafe { border::texts(joints, joint_count) }?;
    let options = if options.is_null() {
        tactid_options::default()
    } else {
        // SAFETY: the caller's promise.
        unsafe { border::read(options) }?
    };
    // SAFETY: the caller's promise.
    let settings = unsafe { options.settings() }?;
    // SAFETY: the caller's promise.
    let sensors = unsafe { options.sensor_names(tip) }?;
    let robot = Manipulator::from_urdf(urdf, options.base_kind())
        .map_err(|error| Failure::robot(error.to_string()))?;
    let needs_all = options.method != TACTID_METHOD_TACTILE;
    let samples = Samples::new(&robot, &joints, tip, &sensors, needs_all)?;
    // SAFETY: the caller's promise.
    let online = unsafe { options.online_settings() }?;
    let identifier = Identifier::with_settings(&robot, tip, &sensors, &settings, &online)?;
    // SAFETY: the caller's promise.
    let wrench_frame = unsafe { options.wrench_frame(&identifier, tip) }?;
    Ok(tactid_identifier {
        identifier,
        samples,
        wrench_frame,
    })
}

/// Ends an identifier. Null is allowed.
///
/// # Safety
/// `identifier` is null, or was created here and not ended before, and no call uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_identifier_free(identifier: *mut tactid_identifier) {
    guarded(|| {
        if !identifier.is_null() {
            // SAFETY: the caller's promise; `Box::into_raw` made it.
            drop(unsafe { Box::from_raw(identifier) });
        }
        Ok(tactid_status::Ok)
    });
}

/// Adds one sample, and answers `TACTID_STATUS_OK`, `TACTID_STATUS_STARTED`,
/// `TACTID_STATUS_PAYLOAD_CHANGED` or `TACTID_STATUS_PAYLOAD_RETURNED`, or an error.
///
/// Allocates nothing; some 2 µs, and some 100 µs at three samples of the first second.
///
/// # Safety
/// `identifier` was created here, and the arrays of the sample have the documented lengths.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_identifier_push(
    identifier: *mut tactid_identifier,
    sample: *const tactid_sample,
) -> tactid_status {
    guarded(|| {
        // SAFETY: the caller's promise.
        let tactid_identifier {
            identifier,
            samples,
            ..
        } = unsafe { border::place(identifier) }?;
        // SAFETY: the caller's promise.
        let sample = unsafe { border::read(sample) }?;
        // SAFETY: the caller's promise.
        let sample = unsafe { samples.fill(&sample) }?;
        let outcome = identifier
            .push(&sample)
            .map_err(|_| tactid_status::WrongCount)?;
        match outcome {
            PushOutcome::Used => Ok(tactid_status::Ok),
            PushOutcome::PayloadChanged => Ok(tactid_status::PayloadChanged),
            PushOutcome::PayloadReturned => Ok(tactid_status::PayloadReturned),
            PushOutcome::Started => Ok(tactid_status::Started),
            PushOutcome::Rejected => Err(tactid_status::Rejected),
        }
    })
}

/// Completes the update by the most recent window at once, so that the estimate includes it: after
/// the last sample of a recording. In a control loop, the samples that follow do the same.
/// Allocates nothing.
///
/// # Safety
/// `identifier` was created here.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_identifier_finish(
    identifier: *mut tactid_identifier,
) -> tactid_status {
    guarded(|| {
        // SAFETY: the caller's promise.
        unsafe { border::place(identifier) }?.identifier.finish();
        Ok(tactid_status::Ok)
    })
}

/// Writes what is known now into a struct of the caller, as far as its `size` has room. Allocates
/// nothing; some 0.1 µs.
///
/// # Safety
/// `identifier` was created here, and `estimate` has `size` writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_identifier_estimate(
    identifier: *const tactid_identifier,
    estimate: *mut tactid_estimate,
) -> tactid_status {
    guarded(|| {
        // SAFETY: the caller's promise.
        let identifier = unsafe { border::reference(identifier) }?;
        // SAFETY: the caller's promise.
        unsafe { border::write(estimate, &tactid_estimate::of(&identifier.identifier)) }?;
        Ok(tactid_status::Ok)
    })
}

/// Writes the constant offset of the wrenches, which a measured wrench contains. It is expressed in
/// the frame of the sensor where there is one that does not move relative to the tip, and otherwise
/// it is that of the sum of the wrenches in the tip's frame. Answers `TACTID_STATUS_UNKNOWN` where
/// the option `wrench_offset` is not set, and before the first window. Allocates nothing.
///
/// # Safety
/// `identifier` was created here, and `offset` has `size` writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_identifier_wrench_offset(
    identifier: *const tactid_identifier,
    offset: *mut tactid_wrench,
) -> tactid_status {
    guarded(|| {
        // SAFETY: the caller's promise.
        let identifier = unsafe { border::reference(identifier) }?;
        let found = identifier
            .identifier
            .wrench_offset()
            .map(tactid_wrench::from);
        // SAFETY: the caller's promise.
        unsafe { written(found, offset) }
    })
}

/// Writes the wrench by which the robot carries and accelerates the payload: what the sensors would
/// measure of it without offset, noise and contact. Frame and answers are those of
/// `tactid_identifier_contact_wrench`. Allocates nothing.
///
/// # Safety
/// `identifier` was created here, and `load` has `size` writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_identifier_load_wrench(
    identifier: *const tactid_identifier,
    load: *mut tactid_wrench,
) -> tactid_status {
    guarded(|| {
        // SAFETY: the caller's promise.
        let of = unsafe { border::reference(identifier) }?;
        let found = of
            .identifier
            .load_wrench(&of.wrench_frame)
            .map(tactid_wrench::from);
        // SAFETY: the caller's promise.
        unsafe { written(found, load) }
    })
}

/// Writes the wrench of a contact: the measured wrench less offset and load, all behind the same
/// causal low-pass with the cutoff `cutoff_hz`. It has the sign of the measured wrenches: where
/// these act on the payload, it is what the payload exerts on what it touches; where they act on the
/// sensor, it is what acts on the payload from outside. Its moment is about the origin of the link
/// `contact_point`, and its axes are those of `contact_axes`.
///
/// What the load does not explain may be a contact or a payload change, and the first samples do
/// not show which: `state` is then `TACTID_CHANGING`. Answers `TACTID_STATUS_UNKNOWN` before 32
/// windows determine the load for the first time, after a gap, and for methods without wrenches.
/// Channels that the sensor does not measure are NaN, with an infinite variance. Allocates nothing.
///
/// # Safety
/// `identifier` was created here, and `contact` has `size` writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_identifier_contact_wrench(
    identifier: *const tactid_identifier,
    contact: *mut tactid_wrench,
) -> tactid_status {
    guarded(|| {
        // SAFETY: the caller's promise.
        let of = unsafe { border::reference(identifier) }?;
        let found = of
            .identifier
            .contact_wrench(&of.wrench_frame)
            .map(tactid_wrench::from);
        // SAFETY: the caller's promise.
        unsafe { written(found, contact) }
    })
}

/// Holds the payload (nonzero), from when it has settled until the gripper opens, or ends that
/// (zero). Samples of such a time neither update the estimate nor show a payload change, and
/// whatever the load does not explain is a contact. A payload that fewer than 32 windows determine
/// is not held: `TACTID_STATUS_UNKNOWN`. Allocates nothing.
///
/// # Safety
/// `identifier` was created here.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_identifier_hold_payload(
    identifier: *mut tactid_identifier,
    is_held: u32,
) -> tactid_status {
    guarded(|| {
        // SAFETY: the caller's promise.
        let identifier = unsafe { border::place(identifier) }?;
        let is_so = identifier.identifier.hold_payload(is_held != 0);
        Ok(tactid_status::known(is_so))
    })
}

/// Sets the zero of the sensor, as after its drift, and keeps the estimate of the payload: the
/// samples that follow determine the offset of the wrenches anew, the first of them within 0.2 s at
/// a cutoff of 10 Hz. A payload change that was the zero's is taken back. Nothing may touch the
/// payload meanwhile; the arm may move. Answers `TACTID_STATUS_UNKNOWN`, and does nothing, where the
/// option `wrench_offset` is not set, before 32 windows determine the load for the first time, and
/// while the payload is held. Allocates nothing.
///
/// # Safety
/// `identifier` was created here.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_identifier_tare(
    identifier: *mut tactid_identifier,
) -> tactid_status {
    guarded(|| {
        // SAFETY: the caller's promise.
        let identifier = unsafe { border::place(identifier) }?;
        Ok(tactid_status::known(identifier.identifier.tare()))
    })
}

/// Writes what may be unknown.
///
/// # Safety
/// As for [`border::write`].
unsafe fn written(
    found: Option<tactid_wrench>,
    place: *mut tactid_wrench,
) -> Result<tactid_status, tactid_status> {
    let Some(found) = found else {
        return Ok(tactid_status::Unknown);
    };
    // SAFETY: the caller's promise.
    unsafe { border::write(place, &found) }?;
    Ok(tactid_status::Ok)
}
