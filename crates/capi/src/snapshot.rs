//! Findings, outside of the control loop.

use std::ffi::c_char;
use std::fmt::Write;

use tactid_batch::online_findings;
use tactid_identify::Snapshot;
use tactid_identify::dynamics::{Notice, Reader};

use crate::border::{self, guarded};
use crate::status::tactid_status;
use crate::tactid_identifier;

/// What the findings of an identifier follow from, as of one sample.
#[derive(Debug)]
pub struct tactid_snapshot(Snapshot);

/// Creates a snapshot of an identifier for `tactid_snapshot_findings`. It is the caller's, who ends
/// it with `tactid_snapshot_free`, and needs its identifier only for an update. `*snapshot` is null
/// after an error. Allocates.
///
/// # Safety
/// `identifier` was created here, and `snapshot` is writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_snapshot_new(
    identifier: *const tactid_identifier,
    snapshot: *mut *mut tactid_snapshot,
) -> tactid_status {
    guarded(|| {
        // SAFETY: the caller's promise.
        let snapshot = unsafe { border::place(snapshot) }?;
        *snapshot = std::ptr::null_mut();
        // SAFETY: the caller's promise.
        let of = unsafe { border::reference(identifier) }?;
        *snapshot = Box::into_raw(Box::new(tactid_snapshot(of.identifier.snapshot())));
        Ok(tactid_status::Ok)
    })
}

/// Ends a snapshot. Null is allowed.
///
/// # Safety
/// `snapshot` is null, or was created here and not ended before, and no call uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_snapshot_free(snapshot: *mut tactid_snapshot) {
    guarded(|| {
        if !snapshot.is_null() {
            // SAFETY: the caller's promise; `Box::into_raw` made it.
            drop(unsafe { Box::from_raw(snapshot) });
        }
        Ok(tactid_status::Ok)
    });
}

/// Updates a snapshot by the identifier of which it was made, in the control loop, while no other
/// thread uses the snapshot. Allocates nothing.
///
/// # Safety
/// `identifier` and `snapshot` were created here.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_snapshot_update(
    snapshot: *mut tactid_snapshot,
    identifier: *const tactid_identifier,
) -> tactid_status {
    guarded(|| {
        // SAFETY: the caller's promise.
        let snapshot = unsafe { border::place(snapshot) }?;
        // SAFETY: the caller's promise.
        let of = unsafe { border::reference(identifier) }?;
        of.identifier.update_snapshot(&mut snapshot.0);
        Ok(tactid_status::Ok)
    })
}

/// Copies what the most recent samples show about the assumptions: a wrong sign, an offset,
/// velocities in other units. Each finding is a line that begins with `contradicts: `, `doubts: `
/// or `notes: `, the gravest first; the text is empty where there is none. `*needed`, where it is
/// not null, becomes the number of bytes that the whole text needs with the zero at its end. A
/// buffer that is shorter gets the beginning of the text; it may be null where `size` is 0.
///
/// Allocates; some 20 ms: call it in another thread than that of the control loop.
///
/// # Safety
/// `snapshot` was created here, `buffer` is null or has `size` writable bytes, and `needed` is
/// null or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tactid_snapshot_findings(
    snapshot: *const tactid_snapshot,
    buffer: *mut c_char,
    size: usize,
    needed: *mut usize,
) -> tactid_status {
    guarded(|| {
        // SAFETY: the caller's promise.
        let snapshot = unsafe { border::reference(snapshot) }?;
        let mut findings = online_findings(&snapshot.0);
        findings.sort_by_key(Notice::severity);
        let mut text = String::new();
        for finding in &findings {
            // Writing to a text does not fail.
            let _ = writeln!(
                text,
                "{}: {}",
                finding.severity().name(),
                finding.words(Reader::Online)
            );
        }
        // SAFETY: the caller's promise.
        let length = unsafe { border::write_text(&text, buffer, size) };
        // SAFETY: the caller's promise.
        if let Ok(needed) = unsafe { border::place(needed) } {
            *needed = length;
        }
        Ok(tactid_status::Ok)
    })
}
