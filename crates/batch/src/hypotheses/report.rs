//! The causes that were found, with the values that the data show.

use nalgebra::{Matrix6, Rotation3, SMatrix, SVector, UnitQuaternion, Vector4};
use tactid_dynamics::BaseKind;
use tactid_identify::VALUE_NAMES;
use tactid_identify::checks::{BEYOND_NOISE, MODEL_ERROR};
use tactid_identify::equations::EquationStream;
use tactid_identify::solve::{HALF_WIDTH_95, propagated, std_devs, value_jacobian, values_of};

use super::fitted::Fitted;
use super::windows::Windows;
use crate::finding::{CHANNELS, Hypothesis, WrongAssumption};
use crate::fit::Fit;

/// A cause that was found.
pub(super) struct Cause {
    pub(super) hypothesis: Hypothesis,
    /// Another hypothesis that explains the data as well.
    pub(super) runner_up: Option<Hypothesis>,
    /// Residual with the cause relative to that without it.
    pub(super) residual_ratio: f64,
}

/// Returns whether a fit leaves next to nothing of the load unexplained.
pub(super) fn explains_load(windows: &Windows, found: &Fitted) -> bool {
    let ratio = (found.squares / windows.measurements()).sqrt();
    let is_small = |k: usize| {
        windows.measured[k] == 0.0
            || ratio * windows.std_devs[k] < MODEL_ERROR * windows.loads[k / 3]
    };
    ratio < BEYOND_NOISE || (0..6).all(is_small)
}

/// Returns what is reported of causes, given the windows, the fit whose values are reported, and
/// those of the test without and with all of them.
pub(super) fn causes(
    stream: &EquationStream,
    windows: &Windows,
    reported: &Fit,
    [given, found]: [&Fitted; 2],
    causes: &[Cause],
) -> Vec<WrongAssumption> {
    let measurements = windows.measurements();
    let value_change = change_of(reported, found, measurements);
    let covariance = found.parameter_covariance(measurements);
    let [mass_change, shift_m] = changes(given, found, measurements).map(Change::least);
    let report = |cause: &Cause| {
        let Shown {
            names,
            assumed,
            values,
            std_devs,
        } = shown(stream, windows, found, cause.hypothesis);
        WrongAssumption {
            cause: cause.hypothesis,
            runner_up: cause.runner_up,
            names,
            assumed,
            values,
            std_devs,
            frame: stream.offset_frame().name().clone(),
            along_m_s2: (cause.hypothesis == Hypothesis::Weight && found.model.is_along_given)
                .then(|| stream.gravity().into()),
            residual_ratio: cause.residual_ratio,
            mass_kg: found.model.parameters[0],
            mass_std_dev_kg: covariance[(0, 0)].sqrt(),
            mass_change,
            shift_m,
            value_change,
            is_applied: false,
        }
    };
    let is_turned = causes
        .iter()
        .any(|cause| cause.hypothesis == Hypothesis::Gravity);
    let reported = causes.iter().map(report);
    if is_turned {
        return reported.collect();
    }
    reported
        .map(|weight| on_earth(&weight, found, stream, &covariance).unwrap_or(weight))
        .collect()
}

/// Returns gravity of the length that it has on Earth in the place of a weight that explains the
/// same: one with the centre of mass of the load, beside a given gravity of another length or of the
/// opposite sign.
fn on_earth(
    weight: &WrongAssumption,
    found: &Fitted,
    stream: &EquationStream,
    covariance: &SMatrix<f64, 10, 10>,
) -> Option<WrongAssumption> {
    let given = stream.gravity();
    let usual = BaseKind::Fixed.default_gravity().norm();
    let is_usual = |length: f64, error: f64| (length / usual - 1.0).abs() < error;
    if weight.cause != Hypothesis::Weight
        || found.model.is_along_given
        || stream.model().subtracted().is_some()
    {
        return None;
    }
    let (load, half_widths) = intervals(&found.model.parameters, covariance)?;
    let is_at_center = |k: usize| {
        let std_dev = weight.std_devs[k] + half_widths[k] / HALF_WIDTH_95;
        (weight.values[k] - load[k]).abs() < BEYOND_NOISE * std_dev
    };
    let size = 1.0 - weight.values[0] / weight.mass_kg;
    let error = weight.mass_std_dev_kg / weight.mass_kg;
    let is_other = size < 0.0 || !is_usual(given.norm(), MODEL_ERROR);
    // A mass that is hardly known does not tell this length from none.
    let tolerance = (MODEL_ERROR + BEYOND_NOISE * error.abs()).min(0.5);
    let is_likely = is_usual((size * given).norm(), tolerance);
    (is_other && is_likely && (1..4).all(is_at_center)).then(|| WrongAssumption {
        cause: Hypothesis::Gravity,
        runner_up: Some(Hypothesis::Weight),
        names: ["x", "y", "z"].map(str::to_owned).to_vec(),
        values: (given * size).as_slice().to_vec(),
        std_devs: (given * (size * error)).abs().as_slice().to_vec(),
        assumed: given.as_slice().to_vec(),
        ..weight.clone()
    })
}

/// A change of a value by another fit, with half of its 95 % interval.
#[derive(Clone, Copy)]
pub(super) struct Change {
    size: f64,
    half_width: f64,
}

impl Change {
    /// Returns the change that is certain.
    pub(super) fn least(self) -> f64 {
        (self.size - self.half_width).max(0.0)
    }

    /// Returns the change that is possible.
    pub(super) fn most(self) -> f64 {
        self.size + self.half_width
    }
}

/// Returns by how much the mass, relative to that of `found`, and the centre of mass, m, change,
/// given the number of measurements.
pub(super) fn changes(given: &Fitted, found: &Fitted, measurements: f64) -> [Change; 2] {
    let covariance = found.parameter_covariance(measurements);
    let parameters = &found.model.parameters;
    let mass_kg = parameters[0].abs();
    let of_mass = Change {
        size: (parameters[0] - given.model.parameters[0]).abs() / mass_kg,
        half_width: HALF_WIDTH_95 * covariance[(0, 0)].sqrt() / mass_kg,
    };
    let old = values_of(&given.model.parameters);
    let (Some((new, half_widths)), Some(old)) = (intervals(parameters, &covariance), old) else {
        let unknown = Change {
            size: 0.0,
            half_width: f64::INFINITY,
        };
        return [of_mass, unknown];
    };
    let moved: f64 = (1..4).map(|k| (new[k] - old[k]).powi(2)).sum();
    let of_center = Change {
        size: moved.sqrt(),
        half_width: half_widths.fixed_rows::<3>(1).norm(),
    };
    [of_mass, of_center]
}

/// Returns the ten values of parameters with half of their 95 % intervals; `None` for a mass of
/// zero.
fn intervals(
    parameters: &SVector<f64, 10>,
    covariance: &SMatrix<f64, 10, 10>,
) -> Option<([f64; 10], SVector<f64, 10>)> {
    let slopes = value_jacobian(parameters)?;
    let of_values = slopes * covariance * slopes.transpose();
    let half_widths = of_values
        .diagonal()
        .map(|variance| HALF_WIDTH_95 * variance.sqrt());
    Some((values_of(parameters)?, half_widths))
}

/// Returns the [change of the values](value_change) between a fit and that with the causes; zero for
/// a mass of zero.
fn change_of(given: &Fit, found: &Fitted, measurements: f64) -> f64 {
    let parameters = &found.model.parameters;
    let covariance = found.parameter_covariance(measurements);
    let of_given = std_devs(&given.parameters, &given.covariance, &given.null_space).std_devs;
    let of_found = value_jacobian(parameters)
        .map(|slopes| std::array::from_fn(|k| propagated(&slopes.row(k).into(), &covariance)));
    let old = values_of(&given.parameters).zip(Some(of_given));
    let new = values_of(parameters).zip(of_found);
    old.zip(new)
        .map_or(0.0, |(old, new)| value_change([old, new]))
}

/// Returns the largest change of a value between two fits, relative to half of its interval, the
/// larger one of both, given the ten values of each fit with their standard deviations. Values that
/// one of them does not determine do not count.
pub(crate) fn value_change([old, new]: [([f64; 10], [f64; 10]); 2]) -> f64 {
    let change = |k: usize| (new.0[k] - old.0[k]).abs() / (HALF_WIDTH_95 * old.1[k].max(new.1[k]));
    (0..10).map(change).fold(0.0, f64::max)
}

/// What the data show of a cause, an entry for each of its values.
struct Shown {
    names: Vec<String>,
    assumed: Vec<f64>,
    values: Vec<f64>,
    std_devs: Vec<f64>,
}

fn shown(
    stream: &EquationStream,
    windows: &Windows,
    found: &Fitted,
    hypothesis: Hypothesis,
) -> Shown {
    let model = &found.model;
    let mut std_devs = found.std_devs_of(hypothesis, windows.measurements());
    let named = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    let axes = || named(&["x", "y", "z"]);
    let mut assumed = vec![0.0; std_devs.len()];
    let (names, values) = match hypothesis {
        Hypothesis::Offset => (named(&CHANNELS), model.offset.as_slice().to_vec()),
        Hypothesis::Weight => {
            let known = known_weight(stream);
            let weight = model.weight + known;
            let of_center = std_devs.iter_mut().skip(1);
            of_center.for_each(|std_dev| *std_dev /= weight[0].abs());
            if known[0] != 0.0 {
                assumed = body_of(&known);
            }
            (named(&VALUE_NAMES[..4]), body_of(&weight))
        }
        Hypothesis::Gravity => {
            assumed = stream.gravity().as_slice().to_vec();
            (axes(), model.gravity.as_slice().to_vec())
        }
        Hypothesis::SensorPlace => (axes(), model.place.as_slice().to_vec()),
        Hypothesis::SensorRotation => {
            let turn = Rotation3::from_matrix_unchecked(model.rotation.transpose());
            // A matrix shows no axis of half a turn.
            let turn = UnitQuaternion::from_rotation_matrix(&turn);
            (axes(), turn.scaled_axis().as_slice().to_vec())
        }
        Hypothesis::AxisGains => {
            assumed.fill(1.0);
            (named(&CHANNELS), model.gains.as_slice().to_vec())
        }
        Hypothesis::Delay => (named(&["delay"]), vec![model.delay_s]),
        Hypothesis::JointZeros => (
            stream.robot().joint_names().to_vec(),
            model.zeros.as_slice().to_vec(),
        ),
        Hypothesis::Axes => {
            assumed = vec![1.0; 6];
            shown_axes(&model.axes)
        }
        Hypothesis::Saturation => model.cut_ends(windows),
    };
    // What is no column has neither a standard deviation nor, but for axes, an assumed value.
    std_devs.resize(values.len(), 0.0);
    assumed.resize(values.len(), f64::INFINITY);
    Shown {
        names,
        assumed,
        values,
        std_devs,
    }
}

/// Returns mass, kg, and first moments, kg m, of the weight that is known to have been subtracted,
/// which the wrenches no longer lack.
fn known_weight(stream: &EquationStream) -> Vector4<f64> {
    let known = stream.model().subtracted();
    let known = known.filter(|load| !load.with_inertia);
    known.map_or(Vector4::zeros(), |load| {
        load.body.as_vector().fixed_rows::<4>(0).into()
    })
}

/// Returns mass, kg, and centre of mass, m, of a weight.
fn body_of(weight: &Vector4<f64>) -> Vec<f64> {
    let center = weight.fixed_rows::<3>(1) / weight[0];
    [&[weight[0]], center.as_slice()].concat()
}

/// Returns for each true channel the name of the measured one that has it, and its sign.
fn shown_axes(axes: &Matrix6<f64>) -> (Vec<String>, Vec<f64>) {
    let places = axes.row_iter().filter_map(|row| {
        let place = row.iter().position(|entry| *entry != 0.0)?;
        Some((CHANNELS[place].to_owned(), row[place]))
    });
    places.unzip()
}
