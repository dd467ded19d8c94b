//! A wrench with its uncertainty as C reads it.

use tactid_identify::{ContactState, WrenchEstimate, WrenchOffset};

use crate::border::{self, Extensible};

/// The load is that of the payload that is held, as far as the measurements show.
pub const TACTID_SETTLED: u32 = 0;
/// The measurements contradict the load: something touches the payload, or it has changed. The load
/// is held at its last estimate that nothing contradicted, and the standard deviations of the
/// contact contain all of it.
pub const TACTID_CHANGING: u32 = 1;

/// A wrench with its uncertainty. Force, N, comes before moment, N m. The sign is that of the
/// measured wrenches, see `wrench_acts_on`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct tactid_wrench {
    /// `sizeof(tactid_wrench)`.
    pub size: usize,
    /// Force, then moment; NaN for a channel of a contact that the sensor does not measure.
    pub values: [f64; 6],
    /// Standard deviation of each value, in its unit; infinite where the motion does not determine
    /// it, or the sensor does not measure it, NaN where it is not estimated.
    pub std_devs: [f64; 6],
    /// Covariance of the values; NaN for an offset.
    pub covariance: [[f64; 6]; 6],
    /// Time to which the wrench belongs, on the clock of the samples, s: earlier than that of the
    /// last sample by the latency of the filter, 28 ms and some samples at a cutoff of 10 Hz. NaN
    /// for an offset.
    pub time_s: f64,
    /// `TACTID_SETTLED` or `TACTID_CHANGING`.
    pub state: u32,
    /// Always 0.
    pub reserved: u32,
}

// SAFETY: it is repr(C), begins with its size, and has numbers alone.
unsafe impl Extensible for tactid_wrench {}

impl Default for tactid_wrench {
    fn default() -> Self {
        border::zeroed()
    }
}

impl From<WrenchOffset> for tactid_wrench {
    fn from(offset: WrenchOffset) -> Self {
        Self {
            values: offset.values(),
            std_devs: offset.std_devs.unwrap_or([f64::NAN; 6]),
            covariance: [[f64::NAN; 6]; 6],
            time_s: f64::NAN,
            ..Self::default()
        }
    }
}

impl From<WrenchEstimate> for tactid_wrench {
    fn from(estimate: WrenchEstimate) -> Self {
        let (f, n) = (&estimate.wrench.force, &estimate.wrench.moment);
        Self {
            values: [f.x, f.y, f.z, n.x, n.y, n.z],
            std_devs: estimate.std_devs(),
            covariance: estimate.covariance.into(),
            time_s: estimate.time_s,
            state: match estimate.state {
                ContactState::Settled => TACTID_SETTLED,
                ContactState::Changing => TACTID_CHANGING,
            },
            ..Self::default()
        }
    }
}
