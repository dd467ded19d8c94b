//! What acts on the payload from outside: the measured wrench less what the sensor's zero and the load explain.

use std::f64::consts::{SQRT_2, TAU};

use nalgebra::{Isometry3, Matrix6, SVector, Translation3, UnitQuaternion, Vector4, Vector6};
use tactid_dynamics::{BaseKind, FrameId, Manipulator, Wrench};

use super::least_squares::OnlineLeastSquares;
use super::noise_tracker::{INITIAL_WINDOWS, MEMORY_WINDOWS};
use super::trusted::JointEstimate;
use crate::IdentifyError;
use crate::equations::window::{NOISE_BANDWIDTH, PRODUCT_CORRELATION};
use crate::equations::{
    Equation, MOTION_TERMS, Model, WORLD, WRENCH, WrenchRegressor, columns_expressed_in,
};
use crate::solve::offsets::WrenchNoise;
use crate::solve::subspace::PIVOT_ROUNDING;
use crate::solve::uncertainty::students_widening;
use crate::solve::weights::rare_distance;

/// Point about which the moment of a wrench is, and axes along which it is expressed: see
/// [`Identifier::wrench_frame`](crate::Identifier::wrench_frame).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrenchFrame {
    /// Pose of the point and of the axes in the tool frame. Its rotation is not used where the axes are fixed to the world.
    tool_from_frame: Isometry3<f64>,
    /// Rotation from the axes of the world to those of the frame, where these do not move with the tool.
    frame_from_world: Option<UnitQuaternion<f64>>,
}

impl WrenchFrame {
    /// Finds the frame at the origin of the link `point`, along the axes of the link `axes`, or of [`WORLD`].
    pub(crate) fn new(
        robot: &Manipulator,
        tool: FrameId,
        point: &str,
        axes: Option<&str>,
    ) -> Result<Self, IdentifyError> {
        let moves = |link: &str| IdentifyError::Option {
            option: "wrench_frame",
            what: format!("`wrench_frame`: the link `{link}` moves relative to the end-effector"),
        };
        let tool_from_point = robot
            .fixed_transform(tool, robot.frame(point)?)
            .ok_or_else(|| moves(point))?;
        let fixed_to_tool = |rotation| Self {
            tool_from_frame: Isometry3::from_parts(tool_from_point.translation, rotation),
            frame_from_world: None,
        };
        let fixed_to_world = |rotation| Self {
            frame_from_world: Some(rotation),
            ..fixed_to_tool(UnitQuaternion::identity())
        };
        let Some(link) = axes else {
            return Ok(fixed_to_tool(tool_from_point.rotation));
        };
        if link == WORLD && robot.frame(WORLD).is_err() {
            return Ok(fixed_to_world(UnitQuaternion::identity()));
        }
        let frame = robot.frame(link)?;
        if let Some(tool_from_link) = robot.fixed_transform(tool, frame) {
            return Ok(fixed_to_tool(tool_from_link.rotation));
        }
        let fixed = robot
            .fixed_transform(frame, robot.base_frame())
            .filter(|_| robot.base_kind() == BaseKind::Fixed);
        Ok(fixed_to_world(fixed.ok_or_else(|| moves(link))?.rotation))
    }

    /// Returns the pose of the tool in this frame, given the rotation from the tool to the world.
    fn frame_from_tool(&self, world_from_tool: &UnitQuaternion<f64>) -> Isometry3<f64> {
        let mut frame_from_tool = self.tool_from_frame.inverse();
        if let Some(frame_from_world) = self.frame_from_world {
            let rotation = frame_from_world * world_from_tool;
            let point = rotation * -self.tool_from_frame.translation.vector;
            frame_from_tool = Isometry3::from_parts(Translation3::from(point), rotation);
        }
        frame_from_tool
    }
}

/// Whether a wrench is what it says, or may be a payload that has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactState {
    /// The estimate of the load is that of the payload that is held, as far as the measurements show.
    Settled,
    /// The measurements contradict the load: something touches the payload, or the payload has changed. The load is held
    /// at its last estimate that nothing contradicted, and the standard deviations of the contact contain all of it.
    Changing,
}

/// A wrench with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrenchEstimate {
    /// Time to which the wrench belongs, on the clock of the samples, s: that of the last sample less the
    /// [latency](crate::Identifier::contact_latency_s).
    pub time_s: f64,
    /// Force, N, and moment, N m, with the sign of the measured wrenches.
    pub wrench: Wrench,
    /// Covariance of force, N, then moment, N m.
    pub covariance: Matrix6<f64>,
    /// Whether the payload may have changed.
    pub state: ContactState,
}

impl WrenchEstimate {
    /// Makes the channels unknown that contain a wrench which is not measured: the columns, in the frame of the estimate.
    fn hide(&mut self, unmeasured: &Matrix6<f64>) {
        for (channel, share) in unmeasured.row_iter().enumerate() {
            if share.amax() > PIVOT_ROUNDING {
                let Wrench { force, moment } = &mut self.wrench;
                let values = force.iter_mut().chain(moment);
                values
                    .skip(channel)
                    .take(1)
                    .for_each(|value| *value = f64::NAN);
                self.covariance[(channel, channel)] = f64::INFINITY;
            }
        }
    }

    /// Returns the same wrench times a sign.
    #[must_use]
    pub fn with_sign(self, sign: f64) -> Self {
        Self {
            wrench: Wrench {
                force: self.wrench.force * sign,
                moment: self.wrench.moment * sign,
            },
            ..self
        }
    }

    /// Returns the standard deviations of force, N, then moment, N m.
    #[must_use]
    pub fn std_devs(&self) -> [f64; 6] {
        std::array::from_fn(|k| self.covariance[(k, k)].max(0.0).sqrt())
    }
}

/// Entries of an instant: the wrench, the terms of the motion, and the quaternion of the tool.
type Entries = SVector<f64, { WRENCH + MOTION_TERMS + 4 }>;

/// Low-pass of fourth order with equal time constants, causal, for samples at any times. Its order suppresses the noise of
/// accelerations, which grows with frequency.
#[derive(Clone, Debug)]
struct LowPass {
    time_constant_s: f64,
    /// Outputs of the stages, one after the other.
    stages: [Entries; 4],
    /// Time of the last instant, s; `None` before the first.
    last_s: Option<f64>,
    /// Gain of a stage for the last instant.
    gain: f64,
    /// Time between the last two instants, s.
    period_s: f64,
}

impl LowPass {
    /// Creates a low-pass that has lost 3 dB at a frequency, Hz.
    fn new(cutoff_hz: f64) -> Self {
        Self {
            time_constant_s: (SQRT_2.sqrt() - 1.0).sqrt() / (TAU * cutoff_hz),
            stages: [Entries::zeros(); 4],
            last_s: None,
            gain: 1.0,
            period_s: 0.0,
        }
    }

    fn push(&mut self, time_s: f64, entries: &Entries) {
        let Some(last_s) = self.last_s.replace(time_s) else {
            self.stages = [*entries; 4];
            return;
        };
        self.period_s = time_s - last_s;
        self.gain = -(-self.period_s / self.time_constant_s).exp_m1();
        let mut input = *entries;
        for stage in &mut self.stages {
            *stage += (input - *stage) * self.gain;
            input = *stage;
        }
    }

    fn output(&self) -> &Entries {
        &self.stages[3]
    }

    /// Delay of what changes slowly, s.
    fn delay_s(&self) -> f64 {
        4.0 * self.period_s * (1.0 - self.gain) / self.gain
    }

    /// Variance of filtered white noise relative to that of one instant.
    fn noise_power(&self) -> f64 {
        // The impulse response is gain⁴ C(n + 3, 3) (1 - gain)ⁿ.
        let x = (1.0 - self.gain).powi(2);
        self.gain.powi(8) * (1.0 + x * (9.0 + x * (9.0 + x))) / (1.0 - x).powi(7)
    }
}

/// Filters the measured wrench together with the motion, and compares it with the load.
///
/// Both pass the same low-pass, so that a load cancels whatever the filter does, and it does so for any estimate: one
/// that changes leaves no transient behind.
#[derive(Clone, Debug)]
pub(crate) struct ContactObserver {
    filter: LowPass,
    /// Covariance of what noise leaves of the filtered wrench, N and N m, in the tool frame, and the number of windows
    /// that it was estimated from.
    noise: Matrix6<f64>,
    windows: f64,
    /// Projection of a wrench in the tool frame onto the channels that are measured; `None` where all are.
    projection: Option<Matrix6<f64>>,
}

/// The filtered wrench with what the load explains of it, in the tool frame.
struct Parts {
    load: Vector6<f64>,
    of_load: Matrix6<f64>,
    contact: Vector6<f64>,
    of_contact: Matrix6<f64>,
}

impl ContactObserver {
    pub(crate) fn new(cutoff_hz: f64, projection: Option<Matrix6<f64>>) -> Self {
        Self {
            projection,
            filter: LowPass::new(cutoff_hz),
            noise: Matrix6::zeros(),
            windows: 0.0,
        }
    }

    /// Discards the instants so far: a new stretch begins.
    pub(crate) fn start_stretch(&mut self) {
        self.filter.last_s = None;
    }

    /// Adds the measurements at an instant.
    pub(crate) fn push(&mut self, time_s: f64, model: &Model) {
        let Some((wrench, terms, pose)) = model.wrench_terms() else {
            return;
        };
        let mut entries = Entries::zeros();
        entries.fixed_rows_mut::<WRENCH>(0).copy_from_slice(wrench);
        entries
            .fixed_rows_mut::<MOTION_TERMS>(WRENCH)
            .copy_from_slice(terms);
        let before = self.filter.stages[0].fixed_rows::<4>(WRENCH + MOTION_TERMS);
        let rotation = pose.rotation.coords;
        let side = 1f64.copysign(rotation.dot(&before));
        entries
            .fixed_rows_mut::<4>(WRENCH + MOTION_TERMS)
            .copy_from(&(rotation * side));
        if entries.iter().all(|entry| entry.is_finite()) {
            self.filter.push(time_s, &entries);
        }
    }

    /// Updates the noise after a window that shows it, where nothing contradicts the estimate.
    pub(crate) fn observe_noise(&mut self, equation: &Equation, estimator: &OnlineLeastSquares) {
        let weight = estimator.noise_weight();
        let Some(estimate) = estimator.trusted().filter(|_| estimator.is_trusted()) else {
            return;
        };
        let Some(noise) = estimator.wrench_noise() else {
            return;
        };
        if self.windows == 0.0 {
            let samples = f64::from(equation.instants) / NOISE_BANDWIDTH;
            self.noise = noise.covariance * (samples * self.filter.noise_power());
            self.windows = INITIAL_WINDOWS as f64;
        }
        if let Some(parts) = self.parts(estimate, &noise) {
            self.windows = (self.windows + weight).min(MEMORY_WINDOWS);
            let product = parts.contact * parts.contact.transpose();
            self.noise += (product - self.noise) * (weight / self.windows);
        }
    }

    /// Time to which the filtered wrench belongs, s; `None` before the first instant.
    pub(crate) fn time_s(&self) -> Option<f64> {
        Some(self.filter.last_s? - self.filter.delay_s())
    }

    fn parts(&self, estimate: &JointEstimate, noise: &WrenchNoise) -> Option<Parts> {
        self.filter.last_s?;
        let filtered = self.filter.output();
        let measured = filtered.fixed_rows::<WRENCH>(0);
        let terms = filtered.fixed_rows::<MOTION_TERMS>(WRENCH).into_owned();
        let regressor = WrenchRegressor::new(&terms).parameters;
        let load = regressor * estimate.parameters;
        let offset = estimate
            .offsets
            .map_or(Vector6::zeros(), |offsets| offsets.values);
        let widening = students_widening(self.windows / PRODUCT_CORRELATION);
        let rest = measured - offset - load;
        Some(Parts {
            load,
            of_load: regressor * estimate.covariance * regressor.transpose(),
            contact: self.projection.map_or(rest, |measured| measured * rest),
            of_contact: self.noise * (widening.powi(2) * noise.factor)
                + estimate.covariance_of_load(&regressor),
        })
    }

    /// Returns the wrench of the load and that of the contact in a frame; `None` before the estimate of the load has
    /// settled for the first time. `is_held` says that the payload cannot have changed.
    pub(crate) fn wrenches(
        &self,
        estimator: &OnlineLeastSquares,
        frame: &WrenchFrame,
        is_held: bool,
    ) -> Option<[WrenchEstimate; 2]> {
        let parts = self.parts(estimator.trusted()?, &estimator.wrench_noise()?)?;
        let Parts {
            contact,
            of_contact,
            ..
        } = parts;
        let distance = of_contact
            .cholesky()
            .map(|root| contact.dot(&root.solve(&contact)));
        let is_rare = distance.is_none_or(|distance| distance > rare_distance(WRENCH));
        let is_settled = is_held || estimator.is_trusted() && !is_rare;
        let (state, ambiguity) = if is_settled {
            (ContactState::Settled, Matrix6::zeros())
        } else {
            (ContactState::Changing, contact * contact.transpose())
        };
        let time_s = self.time_s()?;
        let quaternion: Vector4<f64> = self
            .filter
            .output()
            .fixed_rows::<4>(WRENCH + MOTION_TERMS)
            .into();
        let world_from_tool = UnitQuaternion::new_normalize(quaternion.into());
        let map = columns_expressed_in(
            &Matrix6::identity(),
            &frame.frame_from_tool(&world_from_tool),
        );
        let expressed = |wrench: &Vector6<f64>, covariance: Matrix6<f64>| {
            let wrench = map * wrench;
            WrenchEstimate {
                time_s,
                wrench: Wrench {
                    force: wrench.fixed_rows::<3>(0).into(),
                    moment: wrench.fixed_rows::<3>(3).into(),
                },
                covariance: map * covariance * map.transpose(),
                state,
            }
        };
        let mut of_contact = expressed(&contact, of_contact + ambiguity);
        if let Some(measured) = &self.projection {
            of_contact.hide(&(map * (Matrix6::identity() - measured)));
        }
        Some([
            expressed(&parts.load, parts.of_load + ambiguity),
            of_contact,
        ])
    }
}
