//! The calibrated model of an arm as plain data.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};
use tactid_batch::diagnosis::CONTRADICTION;
use tactid_dynamics::{InertialParameters, Manipulator};
use tactid_identify::equations::window;
use tactid_identify::solve::Vector;

use super::arm::{Arm, WIDTHS};
use super::compare::{EffortComparison, compare};
use super::delay::LONGEST;
use super::description::{Difference, LinkDescription, first_difference};
use super::layout::{Group, Layout};
use super::noise::EffortNoise;
use super::recording::{EffortRecording, check_names, check_settings};
use super::rows::EffortModel;
use super::settings::CalibrationSettings;
use super::solver::Prior;
use crate::CalibrateError;

/// Largest noise of window means that is plausible, in reference torques. A reference torque is at
/// least 0.003 of the range of the joint's efforts, so that a larger noise exceeds three times this
/// range; the noise of the measured arms of the tests is at most 12.
const LARGEST_NOISE_RATIO: f64 = 1e3;

/// Velocity at which friction must brake, rad/s or m/s: a convention.
const FRICTION_VELOCITY: f64 = 1.0;

/// Largest friction that drives its joint by an error of the fit, a fraction of its rms torque.
const DRIVING_FRICTION: f64 = 0.05;

/// What a calibration knows of an arm: mean and precision of all unknowns, and noise of each joint.
///
/// All fields are plain data, so that a program can write them to a file and read them back;
/// [`Self::check`] refuses data that do not fit together or belong to another robot. `n` is the
/// number of joints between base and tool, `B` the number of bodies that they move (`n`, but for
/// mimic joints), `T` of `friction_widths`, and `K = 10 B + (6 + T) n + 1` of the unknowns.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Name of the link that has the frame of the payload.
    pub tool: String,
    /// Names of the `n` joints between the base and the tool, in the robot's order.
    pub joints: Vec<String>,
    /// Names of the `B` links that these joints move, from the base outwards.
    pub links: Vec<String>,
    /// What the description of the robot says of these links: another robot differs in this where
    /// all names are the same.
    pub descriptions: Vec<LinkDescription>,
    /// Gravitational acceleration in the inertial frame, m/s².
    pub gravity: Vector3<f64>,
    /// Cutoff of the window means, Hz. Recordings for an identification must have the same.
    pub cutoff_hz: f64,
    /// Velocities `v` of the friction terms `tanh(q̇ / v)`, rad/s or m/s.
    pub friction_widths: Vec<f64>,
    /// The `K` unknowns, by groups: ten inertial parameters of each link (in the order of
    /// [`InertialParameters`], about the frame of the link, with all links fixed to it), then for
    /// each joint: offset (N m or N), viscous friction, one friction for each of `friction_widths`,
    /// load-dependent friction, what a payload's adds (both fractions), rotor inertia (kg m² or
    /// kg), and inverse gain (1 where efforts are torques), and last the delay of the efforts (s).
    /// Each group has all joints in order; [`Self::parameter_names`] names them.
    pub parameters: Vec<f64>,
    /// Prior standard deviation of each unknown, which is the unit of its column in `precision`; 0
    /// for a gain that is known.
    pub scales: Vec<f64>,
    /// Lower triangle, row by row, of the precision (inverse covariance) of the unknowns divided by
    /// `scales`: `K (K + 1) / 2` numbers.
    pub precision: Vec<f64>,
    /// Noise of each joint.
    pub noise: Vec<EffortNoise>,
    /// Rms torque of each joint in the first fit, N m or N.
    pub reference_torques: Vec<f64>,
    /// Log evidence of the model on the calibrating recordings.
    pub log_evidence: f64,
}

impl Calibration {
    /// Returns the name of each unknown, such as `forearm_link mass*com x` or
    /// `elbow_joint viscous friction`. Friction terms are numbered by their velocity.
    ///
    /// # Errors
    /// Returns [`CalibrateError::Field`] if a friction term has a velocity that the model does not
    /// have.
    pub fn parameter_names(&self) -> Result<Vec<String>, CalibrateError> {
        Ok(self.layout()?.names(&self.links, &self.joints))
    }

    /// Checks that the data fit together, and belong to a robot and the link `tool`: the names of
    /// joints and links, the masses of the links, and the places of their joints. Links beyond the
    /// tool, the place of the base, and rounding do not matter.
    ///
    /// # Errors
    /// Returns [`CalibrateError::Field`] if a field has the wrong length or a number that is not
    /// valid, or friction would drive its joint, [`CalibrateError::Identify`] if the robot does not
    /// have the link, and [`CalibrateError::Robot`] if the base floats, no joint moves the link, or
    /// with the first joint or link that differs.
    pub fn check(&self, robot: &Manipulator, tool: &str) -> Result<(), CalibrateError> {
        self.check_data()?;
        let arm = Arm::new(robot, tool, &CalibrationSettings::default())?;
        self.check_arm(&arm)
    }

    /// Checks that a recording is of the calibrated robot with the same settings.
    pub(crate) fn check_recording(
        &self,
        recording: &EffortRecording,
    ) -> Result<(), CalibrateError> {
        let arm = &recording.arm;
        self.check_arm(arm)?;
        check_settings(
            (self.cutoff_hz, arm.cutoff_hz),
            (self.gravity.as_slice(), arm.gravity.as_slice()),
        )
    }

    fn check_arm(&self, arm: &Arm) -> Result<(), CalibrateError> {
        check_names("joint", &self.joints, &arm.joints)?;
        check_names("link", &self.links, &arm.links)?;
        check_names("tool", &[&self.tool], &[&arm.tool])?;
        let own = self.descriptions.iter();
        let difference = first_difference(&self.links, own, &arm.descriptions, &self.gravity)?;
        difference.map_or(Ok(()), |(link, Difference { property, values })| {
            let [expected, found] = values;
            Err(CalibrateError::Robot(format!(
                "the calibration is of another robot, whose link `{link}` has the {property} {expected} instead of {found}"
            )))
        })
    }

    /// Returns the length of the averaging windows, s, which belongs to the cutoff.
    #[must_use]
    pub fn window_s(&self) -> f64 {
        window::length_s(self.cutoff_hz)
    }

    /// Returns the longest delay of efforts in either direction, s: means of longer ones fail.
    #[must_use]
    pub fn longest_delay_s(&self) -> f64 {
        LONGEST * self.window_s()
    }

    /// Returns the largest standard deviation of the noise of a joint's window means that is
    /// plausible, N m or N; `None` where the calibration has no such joint.
    #[must_use]
    pub fn largest_noise(&self, joint: usize) -> Option<f64> {
        let torque = self.reference_torques.get(joint)?;
        Some(LARGEST_NOISE_RATIO * torque)
    }

    /// Checks that all fields have the right lengths and valid numbers.
    pub(crate) fn check_data(&self) -> Result<(), CalibrateError> {
        let layout = self.layout()?;
        let (unknowns, joints, links) = (layout.len(), layout.joints, 10 * layout.links);
        if joints == 0 || links == 0 {
            return invalid(
                "joints",
                "a calibration has at least one joint and one link",
            );
        }
        let fields: [(_, &[f64], _); 4] = [
            ("parameters", &self.parameters, unknowns),
            ("scales", &self.scales, unknowns),
            ("precision", &self.precision, unknowns * (unknowns + 1) / 2),
            ("reference_torques", &self.reference_torques, joints),
        ];
        for (field, values, expected) in fields {
            if values.len() != expected {
                let given = values.len();
                return invalid(field, &format!("{given} numbers instead of {expected}"));
            }
            check_numbers(field, values.iter().copied(), f64::is_finite)?;
        }
        if self.noise.len() != joints {
            let given = self.noise.len();
            return invalid("noise", &format!("{given} entries instead of {joints}"));
        }
        let noise = self.noise.iter();
        let noise = noise.flat_map(|n| [n.white, n.slow, n.slow_time_s, n.standstill]);
        let is_positive = |value: f64| value > 0.0 && value.is_finite();
        check_numbers("noise", noise, is_positive)?;
        check_numbers("gravity", self.gravity.iter().copied(), f64::is_finite)?;
        self.check_unknowns(&layout)?;
        let torques = self.reference_torques.iter().copied();
        check_numbers("reference_torques", torques, is_positive)?;
        check_numbers("cutoff_hz", [self.cutoff_hz].into_iter(), is_positive)?;
        for (joint, noise) in self.noise.iter().enumerate() {
            let largest = self.largest_noise(joint).unwrap_or(0.0);
            let noise = [noise.white, noise.slow, noise.standstill].into_iter();
            check_numbers("noise", noise, |value| value <= largest)?;
        }
        let delay = [self.parameters[layout.index(Group::Delay, 0)]].into_iter();
        let longest_s = self.longest_delay_s();
        check_numbers("delay", delay, |delay_s| delay_s.abs() <= longest_s)
    }

    /// Checks that gains are positive, that only those that are known have no scale, and that the
    /// precision is the inverse of a covariance.
    fn check_unknowns(&self, layout: &Layout) -> Result<(), CalibrateError> {
        let gains = layout.range(Group::InverseGain);
        let inverse_gains = self.parameters[gains.clone()].iter().copied();
        check_numbers("parameters", inverse_gains, |gain| gain > 0.0)?;
        let scales = self.scales.iter().copied().enumerate();
        let without_unit =
            scales.filter(|(k, scale)| *scale < 0.0 || *scale == 0.0 && !gains.contains(k));
        check_numbers("scales", without_unit.map(|(_, scale)| scale), |_| false)?;
        let (_, prior) = self.model()?;
        match prior.precision.cholesky() {
            Some(factor) => self.check_friction(layout, &factor),
            None => invalid("precision", "it is not positive definite"),
        }
    }

    /// Checks that no friction drives its joint at [`FRICTION_VELOCITY`] beyond its uncertainty and
    /// a small fraction of the torque, given the Cholesky factor of the precision.
    fn check_friction(
        &self,
        layout: &Layout,
        precision: &Cholesky<f64, Dyn>,
    ) -> Result<(), CalibrateError> {
        for (joint, torque) in self.reference_torques.iter().enumerate() {
            let of_width = |(term, &width): (usize, &usize)| {
                let share = (FRICTION_VELOCITY / WIDTHS[width]).tanh();
                (layout.index(Group::Friction(term), joint), share)
            };
            let viscous = (layout.index(Group::Viscous, joint), FRICTION_VELOCITY);
            let mut slopes = DVector::zeros(layout.len());
            let mut friction = 0.0;
            for (unknown, slope) in layout
                .widths
                .iter()
                .enumerate()
                .map(of_width)
                .chain([viscous])
            {
                slopes[unknown] = self.scales[unknown] * slope;
                friction += self.parameters[unknown] * slope;
            }
            let std_dev = slopes.dot(&precision.solve(&slopes)).sqrt();
            if friction < -(CONTRADICTION * std_dev).max(DRIVING_FRICTION * torque) {
                let reason = format!(
                    "the friction of `{}` at {FRICTION_VELOCITY} rad/s (m/s) is {friction:.3} N m (N): it would drive the \
                     joint. Usual causes are an unloaded recording that holds a payload, and a file that was edited",
                    self.joints[joint]
                );
                return invalid("parameters", &reason);
            }
        }
        Ok(())
    }

    /// Returns the order of the unknowns.
    pub(crate) fn layout(&self) -> Result<Layout, CalibrateError> {
        let index = |width: &f64| WIDTHS.iter().position(|known| known == width);
        let widths = self.friction_widths.iter().map(index);
        match widths.collect::<Option<Vec<_>>>() {
            Some(widths) => Ok(Layout {
                links: self.links.len(),
                joints: self.joints.len(),
                widths,
            }),
            None => invalid(
                "friction_widths",
                &format!("each must be one of {WIDTHS:?}"),
            ),
        }
    }

    /// Returns the model and its prior for an identification.
    pub(crate) fn model(&self) -> Result<(EffortModel, Prior), CalibrateError> {
        let layout = self.layout()?;
        let count = layout.len();
        let triangle =
            |i: usize, k: usize| self.precision[i.max(k) * (i.max(k) + 1) / 2 + i.min(k)];
        let prior = Prior {
            mean: self.parameters.clone(),
            scales: self.scales.clone(),
            precision: DMatrix::from_fn(count, count, triangle),
        };
        let model = EffortModel {
            layout,
            reference_torques: self.reference_torques.clone(),
        };
        Ok((model, prior))
    }

    /// Returns measured and modelled efforts of a recording, for plots: by the robot's description
    /// alone, and by the calibration. `payload` is held in it, in the tool frame; `None` for an
    /// unloaded recording.
    ///
    /// # Errors
    /// Returns [`CalibrateError::Robot`] or [`CalibrateError::Field`], as [`Self::identify`] does.
    pub fn compare(
        &self,
        recording: &EffortRecording,
        payload: Option<&InertialParameters>,
    ) -> Result<EffortComparison, CalibrateError> {
        self.check_data()?;
        self.check_recording(recording)?;
        let (model, _) = self.model()?;
        let payload = payload.map_or(Vector::zeros(), |payload| *payload.as_vector());
        Ok(compare(&model, recording, &self.parameters, &payload))
    }
}

/// Returns the error of a field.
fn invalid<T>(field: &'static str, reason: &str) -> Result<T, CalibrateError> {
    Err(CalibrateError::Field {
        field,
        reason: reason.to_owned(),
    })
}

/// Checks each number of a field.
fn check_numbers(
    field: &'static str,
    mut values: impl Iterator<Item = f64>,
    is_valid: impl Fn(f64) -> bool,
) -> Result<(), CalibrateError> {
    match values.find(|value| !is_valid(*value)) {
        Some(value) => invalid(field, &format!("{value} is out of range")),
        None => Ok(()),
    }
}
