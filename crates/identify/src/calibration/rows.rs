//! The equation of one joint in one window, linearised about the present unknowns.

use nalgebra::DMatrix;

use super::arm::JointColumns;
use super::layout::{Group, Layout};
use super::recording::EffortRecording;
use crate::solve::subspace::Vector;

/// What the columns depend on beside the unknowns: their order, and the size of the torques.
#[derive(Clone, Debug)]
pub(crate) struct EffortModel {
    pub(crate) layout: Layout,
    /// Rms torque of each joint in the first fit, N m or N; positive.
    pub(crate) reference_torques: Vec<f64>,
}

/// The unknowns: those of the arm, and the ten parameters of each payload.
#[derive(Clone, Debug)]
pub(crate) struct Unknowns {
    pub(crate) arm: Vec<f64>,
    pub(crate) payloads: Vec<Vector>,
}

/// Fraction of a joint's rms torque within which the magnitude of a torque is smoothed.
const SMOOTHING: f64 = 0.1;

/// Modelled effort of one window.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Modelled {
    /// Torques of links and payload, as efforts.
    pub(crate) torque: f64,
    /// Friction, offset and rotor.
    pub(crate) friction: f64,
}

/// The values of one joint that its columns need.
struct Terms {
    inverse_gain: f64,
    /// Torques of the arm and of the payload.
    arm: f64,
    payload: f64,
    /// Columns of the load-dependent friction of arm and payload together, and of what the payload's differs.
    load: f64,
    payload_load: f64,
    /// Derivatives of the effort with respect to the torques of arm and payload, times the gain.
    arm_slope: f64,
    payload_slope: f64,
}

impl EffortModel {
    /// Indices of a joint's unknowns: those of the links that it moves, then its own in the order of the groups.
    pub(crate) fn indices(&self, recording: &EffortRecording, joint: usize) -> Vec<usize> {
        let links = 10 * recording.arm.first_links[joint]..self.layout.link_range().end;
        let groups = self.layout.groups();
        let own = groups.map(|group| self.layout.index(group, joint));
        links.chain(own).collect()
    }

    /// Returns the modelled effort of a joint in a window.
    pub(crate) fn effort(
        &self,
        recording: &EffortRecording,
        (window, joint): (usize, usize),
        arm: &[f64],
        payload: &Vector,
    ) -> Modelled {
        let columns = recording.columns(window, joint);
        let terms = self.terms(recording, joint, &columns, arm, payload);
        let of = |group: Group| arm[self.layout.index(group, joint)];
        let widths = self.layout.widths.iter().enumerate();
        let coulomb: f64 = widths
            .map(|(place, &width)| of(Group::Friction(place)) * columns.friction[width])
            .sum();
        Modelled {
            torque: terms.inverse_gain * (terms.arm + terms.payload),
            friction: of(Group::Offset)
                + of(Group::Viscous) * columns.velocity
                + coulomb
                + of(Group::Load) * terms.load
                + of(Group::PayloadLoad) * terms.payload_load
                + of(Group::Rotor) * columns.acceleration,
        }
    }

    /// Returns a row for each of the windows: the derivatives of the modelled effort in the order of [`Self::indices`]
    /// and, where there is a payload, of its ten parameters; then measured less modelled effort.
    pub(crate) fn rows(
        &self,
        recording: &EffortRecording,
        joint: usize,
        windows: &[usize],
        arm: &[f64],
        payload: Option<&Vector>,
    ) -> DMatrix<f64> {
        let own = self.indices(recording, joint).len();
        let width = own + if payload.is_some() { 10 } else { 0 } + 1;
        let mut rows = DMatrix::zeros(windows.len(), width);
        let held = payload.copied().unwrap_or_default();
        for (row, &window) in windows.iter().enumerate() {
            let columns = recording.columns(window, joint);
            let terms = self.terms(recording, joint, &columns, arm, &held);
            let modelled = self.effort(recording, (window, joint), arm, &held);
            let links = columns.links.len();
            for (k, entry) in columns.links.iter().enumerate() {
                rows[(row, k)] = terms.inverse_gain * terms.arm_slope * entry;
            }
            for (place, group) in self.layout.groups().enumerate() {
                rows[(row, links + place)] = match group {
                    Group::Offset => 1.0,
                    Group::Viscous => columns.velocity,
                    Group::Friction(width) => columns.friction[self.layout.widths[width]],
                    Group::Load => terms.load,
                    Group::PayloadLoad => terms.payload_load,
                    Group::Rotor => columns.acceleration,
                    Group::InverseGain => {
                        terms.arm * terms.arm_slope + terms.payload * terms.payload_slope
                    }
                };
            }
            if payload.is_some() {
                let factor = terms.inverse_gain * terms.payload_slope;
                for (k, entry) in columns.payload.iter().enumerate() {
                    rows[(row, own + k)] = factor * entry;
                }
            }
            rows[(row, width - 1)] = columns.effort - modelled.torque - modelled.friction;
        }
        rows
    }

    fn terms(
        &self,
        recording: &EffortRecording,
        joint: usize,
        columns: &JointColumns<'_>,
        arm: &[f64],
        payload: &Vector,
    ) -> Terms {
        let first = 10 * recording.arm.first_links[joint];
        let others = columns.described - dot(columns.links, &recording.arm.described[first..]);
        let scale = self.reference_torques[joint];
        let of = |group: Group| arm[self.layout.index(group, joint)];
        let [inverse_gain, k, l] = [Group::InverseGain, Group::Load, Group::PayloadLoad].map(of);
        let of_arm = others + dot(columns.links, &arm[first..self.layout.link_range().end]);
        let of_payload = columns.payload.dot(payload);
        // Magnitude of an effort, smoothed, and its derivative times the smoothed sign of the velocity.
        let magnitude = |effort: f64| effort.hypot(SMOOTHING * scale);
        let slope = |effort: f64| columns.sign * effort / magnitude(effort);
        let (alone, loaded) = (inverse_gain * of_arm, inverse_gain * (of_arm + of_payload));
        let payload_slope = 1.0 + (k + l) * slope(loaded);
        Terms {
            inverse_gain,
            arm: of_arm,
            payload: of_payload,
            load: columns.sign * (magnitude(loaded) - scale),
            payload_load: columns.sign * (magnitude(loaded) - magnitude(alone)),
            arm_slope: payload_slope - l * slope(alone),
            payload_slope,
        }
    }
}

/// Returns the sum of products.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
