//! Requests: what calibrates an arm. Every option is declared here, once, beside those of an
//! identification.

use std::path::PathBuf;

use nalgebra::{Matrix3, Vector3};
use tactid_calibrate::KnownPayload;
use tactid_dynamics::words::counted;
use tactid_options::{Kind, Use, options};

use crate::RecordingError;

const CALIBRATION: &[Use] = &[Use::Calibration];

const RECORDINGS: &str = "Recordings";

options! {
    /// From which recordings an arm is calibrated, and what is known of their payloads. The paths
    /// are for whoever reads the options: [`CalibrationSources`](crate::CalibrationSources) has the
    /// recordings, which may be arrays.
    pub struct CalibrationRequest {
        /// Recordings without a payload that move all joints in both directions.
        #[option(RECORDINGS, CALIBRATION)]
        pub unloaded: Option<Vec<PathBuf>>,
        /// Recordings with a payload of known mass, which find the gains.
        #[option(RECORDINGS, CALIBRATION)]
        pub loaded: Option<Vec<PathBuf>>,
        /// Mass that the payload of each loaded recording adds to the unloaded arm.
        #[option(RECORDINGS, CALIBRATION, unit = "kg", kind = Kind::EachNumber)]
        pub payload_mass_kg: Option<Vec<f64>>,
        /// Standard deviation of these masses.
        #[option(RECORDINGS, CALIBRATION, unit = "kg", default = "0")]
        pub payload_mass_std_dev_kg: Option<f64>,
        /// Centre of mass of the payload of each loaded recording in the tip's frame, (3,) or
        /// (L, 3), to a millimetre.
        #[option(RECORDINGS, CALIBRATION, unit = "m", default = "not known")]
        pub payload_com: Option<Vec<[f64; 3]>>,
        /// Inertia of the payload of each loaded recording about its centre of mass, along the axes
        /// of the tip's frame, (3, 3) or (L, 3, 3), to some percent. It needs ``payload_com``.
        #[option(RECORDINGS, CALIBRATION, unit = "kg m²", default = "not known")]
        pub payload_inertia: Option<Vec<[[f64; 3]; 3]>>,
        /// Recordings without a payload that are not used, but compared with the calibrated model.
        #[option(RECORDINGS, CALIBRATION)]
        pub hold_out: Option<Vec<PathBuf>>,
        /// Standard deviation of the gain of each joint before the calibration: a fraction in
        /// Python, 0.05, and a percentage on the command line, 5%; 0 where efforts are torques.
        #[option(
            RECORDINGS, CALIBRATION,
            default = "20 % with loaded recordings; without any, 5 % where ``effort_gain`` is \
                given, else 0",
            kind = Kind::GainPercentage
        )]
        pub gain_std_dev: Option<f64>,
    }
}

impl CalibrationRequest {
    /// Returns what is known of the payload of each of some loaded recordings.
    ///
    /// # Errors
    /// Returns [`RecordingError::Option`] for options that do not fit each other or the number of
    /// recordings.
    pub fn payloads(&self, loaded: usize) -> Result<Vec<KnownPayload>, RecordingError> {
        if loaded == 0 {
            let mut given = self.given().map(|given| given.option.name);
            return match given.find(|name| name.starts_with("payload_")) {
                Some(name) => Err(conflict(name, "is given, but no loaded recording")),
                None => Ok(Vec::new()),
            };
        }
        let name = "payload_mass_kg";
        let Some(masses) = &self.payload_mass_kg else {
            let reason = "is missing: give the mass of each loaded recording's payload";
            return Err(conflict(name, reason));
        };
        if masses.len() != loaded {
            return Err(wrong_count(name, masses.len(), loaded, "one for each"));
        }
        if self.payload_inertia.is_some() && self.payload_com.is_none() {
            let reason = "is about the centre of mass, which is not given";
            return Err(conflict("payload_inertia", reason));
        }
        let centers = for_each("payload_com", self.payload_com.as_deref(), loaded)?;
        let inertias = for_each("payload_inertia", self.payload_inertia.as_deref(), loaded)?;
        let each = masses.iter().zip(centers).zip(inertias);
        type Inertia = [[f64; 3]; 3];
        type Each<'a> = ((&'a f64, Option<[f64; 3]>), Option<Inertia>);
        let payload = |((&mass_kg, center), inertia): Each<'_>| KnownPayload {
            mass_kg,
            mass_std_dev_kg: self.payload_mass_std_dev_kg.unwrap_or(0.0),
            center_of_mass: center.map(Vector3::from),
            // `from` takes columns; an inertia that is not symmetric is refused.
            inertia: inertia.map(Matrix3::from),
        };
        Ok(each.map(payload).collect())
    }
}

/// Returns what is given once for all of some recordings, or once for each, for each of them.
fn for_each<T: Copy>(
    name: &'static str,
    given: Option<&[T]>,
    count: usize,
) -> Result<Vec<Option<T>>, RecordingError> {
    match given {
        None => Ok(vec![None; count]),
        Some([one]) => Ok(vec![Some(*one); count]),
        Some(each) if each.len() == count => Ok(each.iter().copied().map(Some).collect()),
        Some(each) => Err(wrong_count(
            name,
            each.len(),
            count,
            "one for all, or one for each",
        )),
    }
}

fn wrong_count(name: &'static str, given: usize, loaded: usize, expected: &str) -> RecordingError {
    let values = counted(given, "value");
    let recordings = counted(loaded, "loaded recording");
    conflict(
        name,
        &format!("has {values} for {recordings}: give {expected}"),
    )
}

fn conflict(name: &'static str, reason: &str) -> RecordingError {
    RecordingError::Option {
        option: name,
        what: format!("`{name}` {reason}"),
    }
}
