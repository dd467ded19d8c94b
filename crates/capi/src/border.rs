//! The border to C: pointers become references, panics become a status.

use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::status::tactid_status;

/// Largest `size` of a struct that is believed, bytes: far above any version, and low enough that
/// it is no address.
const LARGEST_SIZE: usize = 4096;

/// A struct of the interface: its first member is its `size`, and all its bits may be zero.
///
/// # Safety
/// The type is `repr(C)`, begins with a `usize`, is valid for any bits, and needs no drop.
pub(crate) unsafe trait Extensible: Copy {}

/// Returns a struct with its `size`, and zero in every other member.
pub(crate) fn zeroed<T: Extensible>() -> T {
    let mut value = std::mem::MaybeUninit::<T>::zeroed();
    // SAFETY: by the trait, the struct begins with its size, and any bits are valid.
    unsafe { value.as_mut_ptr().cast::<usize>().write(size_of::<T>()) };
    // SAFETY: any bits are valid, by the trait.
    unsafe { value.assume_init() }
}

/// Runs a call; a panic is a status.
pub(crate) fn guarded(
    call: impl FnOnce() -> Result<tactid_status, tactid_status>,
) -> tactid_status {
    // A panic leaves numbers behind, not broken memory: the crates below have no unsafe code.
    let answered = catch_unwind(AssertUnwindSafe(call));
    answered.map_or(tactid_status::Internal, |status| {
        status.unwrap_or_else(|error| error)
    })
}

/// Returns what a pointer that may not be null points to.
///
/// # Safety
/// The pointer is null, or points to a valid value for as long as the reference is used.
pub(crate) unsafe fn reference<'a, T>(pointer: *const T) -> Result<&'a T, tactid_status> {
    // SAFETY: the caller's promise.
    unsafe { pointer.as_ref() }.ok_or(tactid_status::NullPointer)
}

/// Returns the place that a pointer that may not be null points to.
///
/// # Safety
/// The pointer is null, or points to a valid value that nothing else uses for as long as the
/// reference is used.
pub(crate) unsafe fn place<'a, T>(pointer: *mut T) -> Result<&'a mut T, tactid_status> {
    // SAFETY: the caller's promise.
    unsafe { pointer.as_mut() }.ok_or(tactid_status::NullPointer)
}

/// Returns an array; one of no entries may be null.
///
/// # Safety
/// The pointer is null, or points to `count` valid values for as long as the slice is used.
pub(crate) unsafe fn slice<'a, T>(
    pointer: *const T,
    count: usize,
) -> Result<&'a [T], tactid_status> {
    if count == 0 {
        return Ok(&[]);
    }
    if pointer.is_null() {
        return Err(tactid_status::NullPointer);
    }
    if count > isize::MAX as usize / size_of::<T>() {
        return Err(tactid_status::WrongCount);
    }
    // SAFETY: the caller's promise; it is not null, and its size is no more than a slice may have.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// Returns an array of known length that may be absent.
///
/// # Safety
/// The pointer is null, or points to `N` numbers.
pub(crate) unsafe fn optional<const N: usize>(pointer: *const f64) -> Option<[f64; N]> {
    // SAFETY: the caller's promise.
    unsafe { pointer.cast::<[f64; N]>().as_ref() }.copied()
}

/// Returns a text.
///
/// # Safety
/// The pointer is null, or points to bytes that end with zero, for as long as the text is used.
pub(crate) unsafe fn text<'a>(pointer: *const c_char) -> Result<&'a str, tactid_status> {
    if pointer.is_null() {
        return Err(tactid_status::NullPointer);
    }
    // SAFETY: the caller's promise.
    let bytes = unsafe { CStr::from_ptr(pointer) };
    bytes.to_str().map_err(|_| tactid_status::InvalidText)
}

/// Returns a text that may be absent.
///
/// # Safety
/// As for [`text`].
pub(crate) unsafe fn optional_text<'a>(
    pointer: *const c_char,
) -> Result<Option<&'a str>, tactid_status> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller's promise.
    unsafe { text(pointer) }.map(Some)
}

/// Returns the texts of an array.
///
/// # Safety
/// The pointer is null, or points to `count` pointers as [`text`] takes them.
pub(crate) unsafe fn texts<'a>(
    pointer: *const *const c_char,
    count: usize,
) -> Result<Vec<&'a str>, tactid_status> {
    // SAFETY: the caller's promise.
    let pointers = unsafe { slice(pointer, count) }?;
    // SAFETY: the caller's promise.
    pointers.iter().map(|&each| unsafe { text(each) }).collect()
}

/// Returns a struct that the caller's version of the header has in its `size`; what that version
/// lacks is zero.
///
/// # Safety
/// The pointer is null, or points to as many bytes as its first member counts.
pub(crate) unsafe fn read<T: Extensible>(pointer: *const T) -> Result<T, tactid_status> {
    // SAFETY: the caller's promise, and that of the trait.
    let size = unsafe { checked_size(pointer) }?;
    let known = size.min(size_of::<T>());
    // A later version of the header has members that this library does not know: they must have
    // their default. SAFETY: the caller's promise; the bytes after the known ones are within
    // `size`.
    let beyond = unsafe { slice(pointer.cast::<u8>().wrapping_add(known), size - known) }?;
    if beyond.iter().any(|byte| *byte != 0) {
        return Err(tactid_status::WrongSize);
    }
    let mut value = zeroed::<T>();
    let target = (&raw mut value).cast::<u8>();
    // SAFETY: both have at least `known` bytes, any of which are valid, and the value here is not
    // the caller's.
    unsafe { pointer.cast::<u8>().copy_to_nonoverlapping(target, known) };
    Ok(value)
}

/// Writes a struct as far as the caller's version of the header has it in its `size`, which stays.
///
/// # Safety
/// The pointer is null, or points to as many writable bytes as its first member counts.
pub(crate) unsafe fn write<T: Extensible>(pointer: *mut T, value: &T) -> Result<(), tactid_status> {
    // SAFETY: the caller's promise, and that of the trait.
    let size = unsafe { checked_size(pointer) }?;
    let head = size_of::<usize>();
    let count = size.min(size_of::<T>()) - head;
    let source = std::ptr::from_ref(value).cast::<u8>().wrapping_add(head);
    let target = pointer.cast::<u8>().wrapping_add(head);
    // SAFETY: both have `count` bytes after the first member, and the caller's value is not the
    // library's.
    unsafe { source.copy_to_nonoverlapping(target, count) };
    Ok(())
}

/// Returns the `size` of a struct, if it can be one.
///
/// # Safety
/// The pointer is null, or points to a `usize`.
unsafe fn checked_size<T: Extensible>(pointer: *const T) -> Result<usize, tactid_status> {
    // SAFETY: the caller's promise; by the trait, the struct begins with its size.
    let size = *unsafe { reference(pointer.cast::<usize>()) }?;
    if (size_of::<usize>()..=LARGEST_SIZE).contains(&size) {
        Ok(size)
    } else {
        Err(tactid_status::WrongSize)
    }
}

/// Writes as much of a text as fits into a buffer, with a zero at its end, and returns the number
/// of bytes that the whole text and its zero need. A buffer of no bytes may be null.
///
/// # Safety
/// The buffer is null, or has `size` writable bytes.
pub(crate) unsafe fn write_text(text: &str, buffer: *mut c_char, size: usize) -> usize {
    if !buffer.is_null() && size > 0 {
        let mut ends = (0..=text.len().min(size - 1)).rev();
        let length = ends.find(|&end| text.is_char_boundary(end)).unwrap_or(0);
        let target = buffer.cast::<u8>();
        // SAFETY: the buffer has room for these bytes and the zero, and it is not the library's.
        unsafe { text.as_ptr().copy_to_nonoverlapping(target, length) };
        // SAFETY: `length` is less than `size`.
        unsafe { target.wrapping_add(length).write(0) };
    }
    text.len() + 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_status() {
        assert_eq!(guarded(|| panic!("a test")), tactid_status::Internal);
    }
}
