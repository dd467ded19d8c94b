//! Settings of a calibration.

use nalgebra::Vector3;
use tactid_dynamics::BaseKind;
use tactid_identify::{IdentifyError, Range};

/// Range of [`CalibrationSettings::gain_std_dev`].
const GAIN: Range = Range {
    expected: "at least zero and less than one (0.2 for 20 %), because a gain is positive: rough gains must be given where efforts have another unit",
    ..Range::GAIN_STD_DEV
};

/// How efforts are recorded and calibrated. Recordings can be combined if gravity and cutoff agree.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationSettings {
    /// Gravity in the inertial frame, m/s², pointing down. Default (`None`): 9.81 along -z.
    pub gravity: Option<Vector3<f64>>,
    /// Frequency at which the window means have lost 3 dB, Hz. It should be some four times the
    /// highest frequency of the motion. Default: 2.
    pub cutoff_hz: f64,
    /// Longest time between two samples across which the motion is differentiated, s. A longer time
    /// is a gap. Default: 0.1.
    pub max_gap_s: f64,
    /// Standard deviation of the inverse gain of each joint about 1, a fraction: what is known of
    /// the gains before the calibration. 0 where efforts are torques, 0.05 where gains are claimed,
    /// 0.2 where they are found with a recording of a known mass. Default: 0.
    pub gain_std_dev: f64,
    /// Whether recordings keep what a [`Contradiction`](super::Contradiction) of a calibration, or
    /// a [zero that has moved](super::CalibratedEstimate::moved_zero) since, is found from. It
    /// takes an inverse dynamics for each joint and sample. Default: true.
    pub finds_contradictions: bool,
}

impl Default for CalibrationSettings {
    fn default() -> Self {
        Self {
            gravity: None,
            cutoff_hz: 2.0,
            max_gap_s: 0.1,
            gain_std_dev: 0.0,
            finds_contradictions: true,
        }
    }
}

impl CalibrationSettings {
    /// Returns the gravitational acceleration in the inertial frame, m/s².
    #[must_use]
    pub fn gravity(&self) -> Vector3<f64> {
        self.gravity
            .unwrap_or_else(|| BaseKind::Fixed.default_gravity())
    }

    /// Checks that the values are in range.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Option`] with the name of a setting that is out of range.
    pub fn check(&self) -> Result<(), IdentifyError> {
        Range::CUTOFF_HZ.check("cutoff_hz", &[self.cutoff_hz])?;
        Range::GAP_S.check("max_gap_s", &[self.max_gap_s])?;
        Range::FINITE.check("max_gap_s", &[self.max_gap_s])?;
        GAIN.check("gain_std_dev", &[self.gain_std_dev])?;
        Range::FINITE.check("gravity", self.gravity().as_slice())
    }
}
