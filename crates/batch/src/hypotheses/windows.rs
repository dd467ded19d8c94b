//! What a bounded number of windows measure, in the frame of the sensor.

use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, SVector, Vector3, Vector6};
use tactid_dynamics::{FrameMotion, JointMotion};
use tactid_identify::equations::{Equation, EquationStream, Geometry, MotionRows, WRENCH};
use tactid_identify::solve::{least_signal_of_columns, std_devs};

use crate::fit::Fit;

/// Most windows of the test, evenly thinned: a cause that needs more to be seen harms no value.
const MOST_WINDOWS: usize = 400;

/// Error of a sound model in each channel, relative to the load: cross-talk and gains of a
/// calibrated sensor.
const OWN_ERROR: f64 = 0.005;

/// Moment of cross-talk for each newton of force, m, relative to that in a channel of force: half
/// of the size of a sensor.
const LEVER_M: f64 = 0.1;

/// Fraction of errors, of what a fit leaves, or of what a motion shows, that is little.
pub(crate) const SLIGHT: f64 = 0.1;

/// The wrench of a window, and what it is linear in.
pub(super) struct Window {
    /// Regressor of the wrench in the tool frame.
    pub(super) regressor: SMatrix<f64, 6, 10>,
    /// Wrench in the tool frame of the weight of each kg, and of each kg m of first moment.
    pub(super) gravity: SMatrix<f64, 6, 4>,
    /// Measured wrench in the frame of the sensor, N and N m.
    pub(super) target: Vector6<f64>,
    /// Half-difference of the regressor: noise of the motion alone.
    pub(super) regressor_noise: SMatrix<f64, 6, 10>,
    /// Half-difference of the measured wrench: noise of the sensor alone.
    pub(super) target_noise: Vector6<f64>,
    /// Derivative of the measured wrench, N/s and N m/s.
    pub(super) rate: Vector6<f64>,
    /// Mean rotation from the inertial frame to the tool frame; where the geometry is not kept, of
    /// gravity alone.
    pub(super) tool_from_world: Matrix3<f64>,
    /// Derivative of the regressor with respect to the position of each joint, 1/rad; empty where
    /// it is not known.
    pub(super) of_zeros: Vec<SMatrix<f64, 6, 10>>,
    /// Root of the robust weight.
    pub(super) root: f64,
}

/// The windows of the test, with the size of their errors.
pub(super) struct Windows {
    pub(super) windows: Vec<Window>,
    /// Maps a wrench in the tool frame to the frame of the sensor.
    pub(super) sensor_from_tool: Matrix6<f64>,
    /// Standard deviation of the noise of each channel, N and N m.
    pub(super) noise: Vector6<f64>,
    /// Standard deviation of noise and of the error of a sound model in each channel, N and N m.
    pub(super) std_devs: Vector6<f64>,
    /// One for each channel that is measured, zero for others.
    pub(super) measured: Vector6<f64>,
    /// Sum of the squares of the whitened noise of all windows.
    pub(super) noise_squares: f64,
    /// Rms of the measured force and moment, N and N m.
    pub(super) loads: [f64; 2],
    /// Largest value of each channel, and largest one with the opposite sign, N and N m.
    pub(super) ends: [Vector6<f64>; 2],
    /// Parameters whose columns are noise alone, which keep their values.
    pub(super) held: Vec<usize>,
}

impl Windows {
    /// Takes the first six channels of equations, with the robust weights of a fit. `None` without
    /// any load.
    pub(super) fn new(equations: &[Equation], fit: &Fit, stream: &EquationStream) -> Option<Self> {
        let sensor_from_tool = stream.offset_frame().map();
        let step = equations.len().div_ceil(MOST_WINDOWS).max(1);
        let kept = || equations.iter().zip(&fit.weights).step_by(step);
        let windows: Vec<Window> = kept()
            .map(|(equation, weight)| Window::new(equation, *weight, stream))
            .collect();
        let total = kept().map(|(_, weight)| weight).sum::<f64>();
        let mut noise = Vector6::zeros();
        for (equation, weight) in kept() {
            let differences = equation.differences.iter().take(WRENCH);
            let differences = differences.map(|row| fit.remainder(row));
            let difference = sensor_from_tool * Vector6::from_iterator(differences);
            noise += difference.component_mul(&difference) * (*weight / total);
        }
        let mut squares = [0.0; 2];
        for window in &windows {
            let weight = window.root.powi(2) / total;
            squares[0] += weight * window.target.fixed_rows::<3>(0).norm_squared();
            squares[1] += weight * window.target.fixed_rows::<3>(3).norm_squared();
        }
        let loads = squares.map(f64::sqrt);
        let own = [loads[0], loads[1].hypot(LEVER_M * loads[0])].map(|load| OWN_ERROR * load);
        let std_devs = Vector6::from_fn(|k, _| noise[k].sqrt().hypot(own[k / 3]));
        let measured = *stream.offset_frame().measured();
        let held = columns_of_noise(&windows, sensor_from_tool, &std_devs);
        let ends = [1.0, -1.0].map(|sign| {
            let values = windows.iter().map(|window| window.target * sign);
            values.fold(Vector6::repeat(f64::NEG_INFINITY), |a, b| a.sup(&b))
        });
        let of_noise = noise.component_div(&std_devs.component_mul(&std_devs));
        (loads[0] > 0.0 && std_devs.iter().all(|size| size.is_normal())).then_some(Self {
            windows,
            sensor_from_tool: *sensor_from_tool,
            noise: Vector6::from_fn(|k, _| noise[k].sqrt().max(SLIGHT * own[k / 3])),
            std_devs,
            noise_squares: total * of_noise.dot(&measured),
            measured,
            loads,
            held,
            ends,
        })
    }

    /// Number of measurements, each with its robust weight.
    pub(super) fn measurements(&self) -> f64 {
        let weights = self.windows.iter().map(|window| window.root.powi(2));
        self.measured.sum() * weights.sum::<f64>()
    }

    /// Computes the derivatives with respect to the positions of the joints from the geometry of
    /// the equations, where it is kept and the motion of a fit determines a value: noise that hides
    /// the motion is explained by any zeros of the joints.
    pub(super) fn add_joints(
        &mut self,
        equations: &[Equation],
        stream: &EquationStream,
        fit: &Fit,
    ) {
        let of_values = std_devs(&fit.parameters, &fit.covariance, &fit.null_space);
        if !of_values.observable.contains(&true) {
            return;
        }
        let step = equations.len().div_ceil(MOST_WINDOWS).max(1);
        let mut rows = stream.motion_rows();
        for (window, equation) in self.windows.iter_mut().zip(equations.iter().step_by(step)) {
            let geometry = Geometry::new(&equation.geometry);
            let derivatives = geometry.and_then(|geometry| derivatives(&mut rows, geometry));
            window.of_zeros = derivatives.unwrap_or_default();
        }
    }

    /// Number of joints whose zeros the windows show.
    pub(super) fn joints(&self) -> usize {
        let counts = self.windows.iter().map(|window| window.of_zeros.len());
        counts.min().unwrap_or(0)
    }
}

/// Returns the parameters whose columns are noise alone, in units of the errors of the channels.
fn columns_of_noise(
    windows: &[Window],
    sensor_from_tool: &Matrix6<f64>,
    std_devs: &Vector6<f64>,
) -> Vec<usize> {
    let precisions = std_devs.map(|std_dev| std_dev.powi(-2));
    let squares = |of: fn(&Window) -> &SMatrix<f64, 6, 10>| {
        let of_window = |window: &Window| {
            let columns = sensor_from_tool * of(window);
            columns.component_mul(&columns).tr_mul(&precisions) * window.root.powi(2)
        };
        windows.iter().map(of_window).sum::<SVector<f64, 10>>()
    };
    let noises = squares(|window| &window.regressor_noise);
    let signals = squares(|window| &window.regressor) - noises;
    let least = least_signal_of_columns(signals.as_slice(), noises.as_slice(), windows.len());
    (0..10)
        .filter(|&k| signals[k] <= least * noises[k])
        .collect()
}

impl Window {
    fn new(equation: &Equation, weight: f64, stream: &EquationStream) -> Self {
        let rows = &equation.rows[..WRENCH];
        let map = stream.offset_frame().map();
        let gravity = stream.gravity();
        let in_tool = Vector3::from_fn(|k, _| rows[k].gravity[0]);
        let of_gravity =
            || in_tool * gravity.transpose() / gravity.norm_squared().max(f64::EPSILON);
        let geometry = Geometry::new(&equation.geometry);
        Self {
            regressor: SMatrix::from_fn(|k, column| rows[k].regressor[column]),
            gravity: SMatrix::from_fn(|k, column| rows[k].gravity[column]),
            target: map * Vector6::from_fn(|k, _| rows[k].target),
            regressor_noise: SMatrix::from_fn(|k, column| {
                equation.differences[k].regressor[column]
            }),
            target_noise: map * Vector6::from_fn(|k, _| equation.differences[k].target),
            rate: map * Vector6::from_fn(|k, _| equation.rates[k]),
            tool_from_world: geometry.map_or_else(of_gravity, Geometry::tool_from_world),
            of_zeros: Vec::new(),
            root: weight.sqrt(),
        }
    }
}

/// Returns the derivative of the regressor of a wrench in the tool frame with respect to the
/// position of each joint, 1/rad, by differences.
fn derivatives(rows: &mut MotionRows, geometry: Geometry<'_>) -> Option<Vec<SMatrix<f64, 6, 10>>> {
    let joints = geometry.joints();
    // Rounding and the second derivative are of similar size.
    let step_rad = f64::EPSILON.cbrt();
    let base = FrameMotion::at_rest(Isometry3::identity());
    let mut position = joints.position.to_vec();
    let mut at = |position: &[f64]| -> Option<SMatrix<f64, 6, 10>> {
        let joints = JointMotion { position, ..joints };
        let rows = rows.at(&base, joints).ok()?;
        Some(SMatrix::from_fn(|k, column| rows[k].regressor[column]))
    };
    let given = at(&position)?;
    let mut found = Vec::with_capacity(position.len());
    for joint in 0..position.len() {
        position[joint] += step_rad;
        found.push((at(&position)? - given) / step_rad);
        position[joint] = joints.position[joint];
    }
    Some(found)
}
