//! Ranges of settings: each stated once, as a test and in words.

use crate::IdentifyError;

/// Range of a number of a setting.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    /// Whether a number is in the range.
    pub contains: fn(f64) -> bool,
    /// What a number must be, in words.
    pub expected: &'static str,
}

impl Range {
    /// Range of a delay online, s.
    pub const ONLINE_DELAY_S: Self = Self {
        contains: |delay_s| delay_s.abs() <= 1.0,
        expected: "between -1 and 1",
    };

    /// Every number, also those that are not finite.
    pub const ANY: Self = Self {
        contains: |_| true,
        expected: "a number",
    };

    /// Finite numbers.
    pub const FINITE: Self = Self {
        contains: f64::is_finite,
        expected: "finite",
    };

    /// Frequency of a low-pass, Hz.
    pub const CUTOFF_HZ: Self = Self {
        contains: |value| value > 0.0 && value.is_finite(),
        expected: "more than zero, and finite",
    };

    /// Longest time between two samples, s.
    pub const GAP_S: Self = Self {
        contains: |value| value > 0.0,
        expected: "more than zero",
    };

    /// Standard deviation of a measurement. Beyond these limits its square, or the inverse of that,
    /// is no number.
    pub const NOISE_STD_DEV: Self = Self {
        contains: |value| (1e-30..=1e30).contains(&value),
        expected: "a standard deviation between 1e-30 and 1e30",
    };

    /// Standard deviation of the relative error of a gain. With 1 or more, not even the sign of the
    /// measurement would be known.
    pub const GAIN_STD_DEV: Self = Self {
        contains: |value| (0.0..1.0).contains(&value),
        expected: "a fraction from 0 to below 1, such as 0.05 for 5 %",
    };

    /// Checks that each value of the setting `name` is in the range.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Option`] with the first value that is not.
    pub fn check(&self, name: &'static str, values: &[f64]) -> Result<(), IdentifyError> {
        match values.iter().find(|value| !(self.contains)(**value)) {
            Some(&given) => Err(IdentifyError::out_of_range(name, given, self.expected)),
            None => Ok(()),
        }
    }
}
