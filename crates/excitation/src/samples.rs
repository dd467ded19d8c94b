//! Outputs of the plant along a motion, at equidistant times.

use crate::ExcitationError;
use crate::motion::JointStates;
use crate::plant::Plant;
use crate::spline::{LOCAL, LocalBasis};
use crate::variables::{ControlPoint, Variables};

/// Step of the finite differences, rad, rad/s or rad/s² (m for a prismatic joint). The outputs are
/// smooth and of the size of their derivatives: rounding and curvature both leave some six digits.
const STEP: f64 = 1e-6;

/// Orders of the derivatives that a state has: position, velocity and acceleration.
const ORDERS: usize = 3;

/// Times at which a motion is sampled, with the spline functions there.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    /// Time between two samples, s.
    pub(crate) step_s: f64,
    bases: Vec<LocalBasis>,
}

impl Grid {
    /// Divides each span of the splines into so many steps. Both ends of the motion are samples.
    pub(crate) fn new(variables: &Variables, steps_per_span: usize) -> Self {
        let basis = &variables.basis;
        let steps = basis.spans() * steps_per_span;
        let step_s = basis.duration_s() / steps as f64;
        Self {
            step_s,
            bases: (0..=steps).map(|k| basis.at(k as f64 * step_s)).collect(),
        }
    }

    /// Number of samples.
    pub(crate) fn count(&self) -> usize {
        self.bases.len()
    }
}

/// Outputs at all times of a grid.
#[derive(Clone, Debug)]
pub(crate) struct Samples {
    /// Number of outputs of a sample.
    pub(crate) outputs: usize,
    /// The outputs of all samples, one sample after another.
    pub(crate) values: Vec<f64>,
    /// Derivatives of the outputs with respect to the states of the joints, sample after sample:
    /// for each joint position, velocity and acceleration. Empty unless they were asked for.
    slopes: Vec<f64>,
}

impl Samples {
    /// Creates samples without derivatives.
    pub(crate) fn of_values(outputs: usize, values: Vec<f64>) -> Self {
        Self {
            outputs,
            values,
            slopes: Vec::new(),
        }
    }

    /// Returns these outputs with the derivatives of other samples, almost the same near these.
    pub(crate) fn with_slopes_of(self, other: Self) -> Self {
        Self {
            slopes: other.slopes,
            ..self
        }
    }

    /// Returns the outputs of one sample.
    pub(crate) fn at(&self, sample: usize) -> &[f64] {
        &self.values[sample * self.outputs..(sample + 1) * self.outputs]
    }

    /// Number of samples.
    pub(crate) fn count(&self) -> usize {
        self.values.len() / self.outputs
    }
}

/// Computes samples of a motion of some joints, and their derivatives with respect to the variables
/// of its splines.
#[derive(Clone, Debug)]
pub(crate) struct Sampler {
    pub(crate) plant: Plant,
    pub(crate) variables: Variables,
    pub(crate) grid: Grid,
    /// Indices of the joints that move.
    joints: Vec<usize>,
    posture: Vec<f64>,
}

impl Sampler {
    /// Creates a sampler for the joints with indices `joints` of a robot that starts in a posture.
    pub(crate) fn new(
        plant: Plant,
        variables: Variables,
        grid: Grid,
        joints: Vec<usize>,
        posture: Vec<f64>,
    ) -> Self {
        Self {
            plant,
            variables,
            grid,
            joints,
            posture,
        }
    }

    /// Computes the outputs at all times for values of the variables, and their derivatives by
    /// finite differences if `with_slopes`: three evaluations for each joint and sample.
    pub(crate) fn sample(
        &mut self,
        values: &[f64],
        with_slopes: bool,
    ) -> Result<Samples, ExcitationError> {
        let outputs = self.plant.layout().count();
        let (count, inputs) = (self.grid.count(), ORDERS * self.joints.len());
        let mut samples = Samples {
            outputs,
            values: vec![0.0; count * outputs],
            slopes: vec![
                0.0;
                if with_slopes {
                    count * inputs * outputs
                } else {
                    0
                }
            ],
        };
        let mut states = JointStates::at_rest(&self.posture);
        for sample in 0..count {
            self.set_states(values, sample, &mut states);
            let at = &mut samples.values[sample * outputs..(sample + 1) * outputs];
            self.plant.evaluate(&states, at)?;
            if !with_slopes {
                continue;
            }
            let slopes = &mut samples.slopes[sample * inputs * outputs..];
            for input in 0..inputs {
                let slopes = &mut slopes[input * outputs..(input + 1) * outputs];
                *self.input(&mut states, input) += STEP;
                self.plant.evaluate_near(&states, slopes)?;
                *self.input(&mut states, input) -= STEP;
                for (slope, value) in slopes.iter_mut().zip(&*at) {
                    *slope = (*slope - value) / STEP;
                }
            }
        }
        Ok(samples)
    }

    /// Returns an input of the plant: for each joint position, velocity and acceleration.
    fn input<'a>(&self, states: &'a mut JointStates, input: usize) -> &'a mut f64 {
        let joint = self.joints[input / ORDERS];
        match input % ORDERS {
            0 => &mut states.position[joint],
            1 => &mut states.velocity[joint],
            _ => &mut states.acceleration[joint],
        }
    }

    /// Sets the states of the joints that move to their states at a sample.
    fn set_states(&self, values: &[f64], sample: usize, states: &mut JointStates) {
        let local = &self.grid.bases[sample];
        for input in 0..ORDERS * self.joints.len() {
            let weights = local.values[input % ORDERS];
            let points = (0..LOCAL).map(|k| self.point(values, input / ORDERS, local.first + k));
            let sum = weights.iter().zip(points).map(|(w, c)| w * c).sum();
            *self.input(states, input) = sum;
        }
    }

    fn point(&self, values: &[f64], place: usize, point: usize) -> f64 {
        match self.variables.control_point(place, point) {
            ControlPoint::Variable(variable) => values[variable],
            ControlPoint::Fixed(fixed) => fixed,
        }
    }

    /// Adds the gradient of a multiple of a linear function of one sample's outputs to `gradient`,
    /// with respect to the variables. The function is `terms`: places of outputs with their
    /// factors.
    pub(crate) fn add_gradient(
        &self,
        samples: &Samples,
        sample: usize,
        terms: &[(usize, f64)],
        multiple: f64,
        gradient: &mut [f64],
    ) {
        let inputs = ORDERS * self.joints.len();
        let slopes = &samples.slopes[sample * inputs * samples.outputs..];
        for input in 0..inputs {
            let slopes = &slopes[input * samples.outputs..];
            let terms = terms.iter();
            let slope: f64 = terms.map(|(place, f)| f * multiple * slopes[*place]).sum();
            self.add_input(sample, input, slope, gradient);
        }
    }

    /// Adds the gradient of a function from its derivatives by the inputs of one sample.
    pub(crate) fn add_input(&self, sample: usize, input: usize, slope: f64, gradient: &mut [f64]) {
        if slope == 0.0 {
            return;
        }
        let local = &self.grid.bases[sample];
        let weights = local.values[input % ORDERS];
        for (k, weight) in weights.iter().enumerate() {
            let point = self
                .variables
                .control_point(input / ORDERS, local.first + k);
            if let ControlPoint::Variable(variable) = point {
                gradient[variable] += slope * weight;
            }
        }
    }

    /// Returns the derivatives of the outputs of a sample with respect to each input.
    pub(crate) fn slopes<'a>(
        &self,
        samples: &'a Samples,
        sample: usize,
    ) -> impl Iterator<Item = (usize, &'a [f64])> {
        let inputs = ORDERS * self.joints.len();
        let of_sample = inputs * samples.outputs;
        let slopes = &samples.slopes[sample * of_sample..(sample + 1) * of_sample];
        slopes.chunks_exact(samples.outputs).enumerate()
    }
}
