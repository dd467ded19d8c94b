//! The estimate as C reads it.

use tactid_identify::{Identifier, Observability, PayloadEstimate};

use crate::border::{self, Extensible};

/// The motion excites the value, and 1.96 standard deviations are less than the largest value of
/// its kind; of the mass, one standard deviation is at most a quarter of it.
pub const TACTID_IDENTIFIABLE: u32 = 0;
/// The motion excites the value, but noise leaves it a wider interval.
pub const TACTID_UNCERTAIN: u32 = 1;
/// The motion does not excite the value. Its number is meaningless.
pub const TACTID_UNOBSERVABLE: u32 = 2;

/// The identified payload. The ten values are mass, kg; centre of mass in the tip's frame, m;
/// inertia about the centre of mass along the axes of the tip's frame, kg m² (xx, xy, xz, yy, yz,
/// zz).
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct tactid_estimate {
    /// `sizeof(tactid_estimate)`.
    pub size: usize,
    /// The ten values.
    pub values: [f64; 10],
    /// Standard deviation of each value, in its unit; infinite where the value is unobservable, or
    /// divided by a mass that is not known to a quarter.
    pub std_devs: [f64; 10],
    /// Limits of the 95 % interval of each value, in its unit; infinite where nothing bounds it.
    pub intervals: [[f64; 2]; 10],
    /// Covariance of the linear parameters: mass, kg; mass times centre of mass, kg m; inertia
    /// about the origin of the tip's frame, kg m², in the order of the values. An unobservable
    /// direction has the variance of parameters of plausible size. NaN during the first seven
    /// windows, in which the noise is not known, and while nothing explains the windows since a
    /// payload change.
    pub covariance: [[f64; 10]; 10],
    /// What the motion shows of each value: `TACTID_IDENTIFIABLE`, `TACTID_UNCERTAIN` or
    /// `TACTID_UNOBSERVABLE`.
    pub observability: [u32; 10],
    /// 1 where a body with these values can exist, within 1 % of its largest principal moment,
    /// else 0.
    pub is_physical: u32,
    /// 1 where the estimate is that of the payload that is held now: at least 32 windows contribute
    /// to it, the most recent ones show no evidence of a change, and since the last change they show
    /// a payload that no contact could be; else 0.
    pub is_settled: u32,
    /// The ten values of the payload before the last change; NaN before a change, and where it had
    /// not been known long enough.
    pub values_before: [f64; 10],
    /// Standard deviations of those values, as `std_devs`.
    pub std_devs_before: [f64; 10],
    /// Time of the last payload change on the samples' clock, s, or minus infinity: the estimate
    /// uses the samples after it.
    pub since_s: f64,
    /// Number of payload changes.
    pub payload_changes: u64,
    /// Number of averaging windows, those before a payload change included.
    pub windows: u64,
    /// Number of samples that were ignored, because of a number that is not finite or a time that
    /// is not later than the one before.
    pub rejected: u64,
    /// Number of gaps between samples that were too long to be bridged.
    pub gaps: u64,
    /// 1 where the motion has determined what the wrench of a contact is measured against: mass and
    /// centre of mass of the load, and the offset where it is an unknown; else 0.
    pub knows_weight: u32,
    /// 1 while `tactid_identifier_hold_payload` holds the payload, else 0.
    pub is_held: u32,
}

// SAFETY: it is repr(C), begins with its size, and has numbers alone.
unsafe impl Extensible for tactid_estimate {}

impl Default for tactid_estimate {
    fn default() -> Self {
        border::zeroed()
    }
}

impl tactid_estimate {
    /// Returns what an identifier knows now.
    pub(crate) fn of(identifier: &Identifier) -> Self {
        let estimate = identifier.estimate();
        let before = identifier.estimate_before_change();
        Self {
            size: size_of::<Self>(),
            values: estimate.values(),
            std_devs: estimate.std_devs,
            intervals: estimate.intervals,
            covariance: identifier
                .covariance()
                .map_or([[f64::NAN; 10]; 10], Into::into),
            observability: estimate.observability.map(|of| match of {
                Observability::Identifiable => TACTID_IDENTIFIABLE,
                Observability::Uncertain => TACTID_UNCERTAIN,
                Observability::Unobservable => TACTID_UNOBSERVABLE,
            }),
            is_physical: u32::from(estimate.is_physical),
            is_settled: u32::from(identifier.is_settled()),
            values_before: before
                .as_ref()
                .map_or([f64::NAN; 10], PayloadEstimate::values),
            std_devs_before: before.map_or([f64::NAN; 10], |before| before.std_devs),
            since_s: estimate.since_s,
            payload_changes: estimate.payload_changes,
            windows: estimate.windows,
            rejected: estimate.rejected,
            gaps: estimate.gaps,
            knows_weight: u32::from(identifier.knows_weight()),
            is_held: u32::from(identifier.is_payload_held()),
        }
    }
}
