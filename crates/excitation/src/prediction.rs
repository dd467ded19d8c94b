//! Prediction of how well a motion determines the payload.

use nalgebra::{DMatrix, Isometry3, SMatrix, UnitQuaternion};
use tactid_dynamics::FrameMotion;
use tactid_identify::equations::window::{NOISE_BANDWIDTH, NOISE_CORRELATIONS};
use tactid_identify::{BaseState, EquationStream, HALF_WIDTH_95, Sample, Wrench, value_jacobian};

use crate::ExcitationError;
use crate::motion::Motion;
use crate::objective::remove_offsets;
use crate::plant::Plant;
use crate::problem::Problem;

/// How well a motion determines the payload, if only the sensors have noise, as in the problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Covariance of the ten linear parameters, in the order of
    /// [`InertialParameters`](tactid_dynamics::InertialParameters), in the tool frame and in SI
    /// units.
    pub covariance: SMatrix<f64, 10, 10>,
    /// Standard deviations of the ten values, in the order and the units of
    /// [`VALUE_NAMES`](tactid_identify::VALUE_NAMES).
    pub std_devs: [f64; 10],
    /// Half width of the 95 % interval of each value over its target.
    pub ratios: [f64; 10],
}

impl Prediction {
    /// Returns the index of the value with the largest ratio of interval to target, and the ratio.
    #[must_use]
    pub fn largest(&self) -> (usize, f64) {
        let ratios = self.ratios.iter().copied().enumerate();
        ratios.fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a })
    }
}

/// Predicts how well a motion determines the first payload of a problem.
///
/// The samples of the motion pass the equation stream of the estimators, and the covariance comes
/// from least squares over its averaging windows: weights follow from the noise of the sensors, and
/// the noise of overlapping windows is correlated. Noise of the joints' motion is not part of it.
///
/// # Errors
/// Returns [`ExcitationError::TooShort`] for a motion without a whole window,
/// [`ExcitationError::TooFewSamples`] for windows without enough samples,
/// [`ExcitationError::NotObservable`] for one that does not determine all values, and the errors of
/// a design for a problem that is not valid.
pub fn predict(problem: &Problem, motion: &dyn Motion) -> Result<Prediction, ExcitationError> {
    MotionWindows::new(problem, motion)?.prediction(motion.duration_s())
}

/// The averaging windows of a motion, whose beginnings predict what each of them determines.
pub struct MotionWindows<'a> {
    problem: &'a Problem,
    /// Rows of each window, whitened by the noise of their means, and the sample that ends it.
    windows: Vec<(DMatrix<f64>, usize)>,
    /// Number of leading channels with an unknown offset.
    offsets: usize,
}

impl<'a> MotionWindows<'a> {
    /// Computes the windows of a motion.
    ///
    /// Cost: one inverse dynamics and one sample of the equation stream per `1 / rate_hz`.
    ///
    /// # Errors
    /// Returns the errors of a design for a problem that is not valid.
    pub fn new(problem: &'a Problem, motion: &dyn Motion) -> Result<Self, ExcitationError> {
        problem.check()?;
        let mut plant = Plant::new(problem)?;
        Ok(Self {
            problem,
            windows: window_rows(problem, &mut plant, motion)?,
            offsets: plant.offsets,
        })
    }

    /// Predicts how well the motion up to a time since its beginning determines the payload.
    ///
    /// # Errors
    /// Returns the errors of [`predict`] for a motion that ends there.
    pub fn prediction(&self, until_s: f64) -> Result<Prediction, ExcitationError> {
        let sensing = &self.problem.sensing;
        let last = (until_s * sensing.rate_hz) as usize;
        let windows = self.windows.iter().take_while(|(_, end)| *end <= last);
        let mut windows: Vec<DMatrix<f64>> = windows.map(|(rows, _)| rows.clone()).collect();
        if windows.is_empty() {
            return Err(sensing.no_window(until_s));
        }
        remove_offsets(&mut windows, self.offsets);
        prediction(self.problem, &windows)
    }
}

/// Returns what windows determine, whose rows are whitened and without offsets.
fn prediction(problem: &Problem, windows: &[DMatrix<f64>]) -> Result<Prediction, ExcitationError> {
    // With whitened rows the weights are one.
    let mut information = SMatrix::<f64, 10, 10>::zeros();
    let mut scores = SMatrix::<f64, 10, 10>::zeros();
    for (k, rows) in windows.iter().enumerate() {
        information += rows.tr_mul(rows).fixed_view::<10, 10>(0, 0);
        for (lag, correlation) in NOISE_CORRELATIONS.iter().enumerate() {
            if let Some(later) = windows.get(k + lag + 1) {
                let product = rows.tr_mul(later);
                let both = &product + product.transpose();
                scores += both.fixed_view::<10, 10>(0, 0) * *correlation;
            }
        }
    }
    scores += information;
    let units = information.diagonal().map(|x| x.sqrt().recip());
    let scaling = SMatrix::from_diagonal(&units);
    let factor = (scaling * information * scaling).cholesky();
    let inverse = factor.ok_or(ExcitationError::NotObservable)?.inverse();
    let inverse = scaling * inverse * scaling;
    let covariance = inverse * scores * inverse;
    let slopes = value_jacobian(problem.payloads[0].as_vector());
    let slopes = slopes.ok_or(ExcitationError::NotObservable)?;
    let variances = (slopes * covariance * slopes.transpose()).diagonal();
    if !variances.iter().all(|variance| *variance > 0.0) {
        return Err(ExcitationError::NotObservable);
    }
    let std_devs: [f64; 10] = variances.map(f64::sqrt).into();
    Ok(Prediction {
        covariance,
        std_devs,
        ratios: std::array::from_fn(|k| HALF_WIDTH_95 * std_devs[k] / problem.targets[k]),
    })
}

/// Returns the rows of all windows, whitened by the noise of their means, and the sample that ends
/// each.
fn window_rows(
    problem: &Problem,
    plant: &mut Plant,
    motion: &dyn Motion,
) -> Result<Vec<(DMatrix<f64>, usize)>, ExcitationError> {
    let sensing = &problem.sensing;
    let sensors: Vec<&str> = sensing.sensors.iter().map(String::as_str).collect();
    let (robot, tool) = (&problem.robot, &problem.tool);
    let mut stream = EquationStream::new(robot, tool, &sensors, &sensing.equations)?;
    let wrenches = vec![Wrench::zero(); sensors.len()];
    let efforts = vec![0.0; robot.dof()];
    let step_s = sensing.rate_hz.recip();
    let mut pose = Isometry3::identity();
    let mut windows = Vec::new();
    for k in 0..=(motion.duration_s() * sensing.rate_hz) as usize {
        let time_s = k as f64 * step_s;
        let states = motion.at(time_s);
        let base = plant.base_motion(0, &pose, &states)?;
        let sample = Sample {
            time_s,
            base: BaseState {
                pose,
                velocity: base.velocity,
                angular_velocity: base.angular_velocity,
                acceleration: None,
                angular_acceleration: None,
            },
            joint_position: &states.position,
            joint_velocity: &states.velocity,
            joint_effort: &efforts,
            wrenches: &wrenches,
        };
        if let (_, Some(equation)) = stream.push(&sample)? {
            let rows = plant.whitened(&equation.rows);
            // The plant whitens one second of samples; a mean has the noise of its samples.
            let samples = f64::from(equation.instants) / NOISE_BANDWIDTH;
            let scale = (samples / sensing.rate_hz).sqrt();
            let entry = |channel: usize, parameter: usize| scale * rows[channel][parameter];
            windows.push((DMatrix::from_fn(rows.len(), 10, entry), k));
        }
        pose = moved(&base, step_s);
    }
    Ok(windows)
}

/// Returns the pose of a base after a short time, to second order.
pub(crate) fn moved(base: &FrameMotion, step_s: f64) -> Isometry3<f64> {
    let turn = base.angular_velocity * step_s + base.angular_acceleration * (0.5 * step_s * step_s);
    let shift = base.velocity * step_s + base.acceleration * (0.5 * step_s * step_s);
    Isometry3::from_parts(
        (base.pose.translation.vector + shift).into(),
        UnitQuaternion::from_scaled_axis(turn) * base.pose.rotation,
    )
}
