//! A wrench with its uncertainty as C reads it.

use tactid_identify::WrenchOffset;

use crate::border::{self, Extensible};

/// A wrench with its uncertainty. Force, N, comes before moment, N m. The sign is that of the measured wrenches, which act on the
/// payload.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct tactid_wrench {
    /// `sizeof(tactid_wrench)`.
    pub size: usize,
    /// Force, then moment.
    pub values: [f64; 6],
    /// Standard deviation of each value, in its unit; infinite where the motion does not determine it, NaN where it is not
    /// estimated.
    pub std_devs: [f64; 6],
}

// SAFETY: it is repr(C), begins with its size, and has numbers alone.
unsafe impl Extensible for tactid_wrench {}

impl From<WrenchOffset> for tactid_wrench {
    fn from(offset: WrenchOffset) -> Self {
        Self {
            values: offset.values(),
            std_devs: offset.std_devs.unwrap_or([f64::NAN; 6]),
            ..border::zeroed()
        }
    }
}
