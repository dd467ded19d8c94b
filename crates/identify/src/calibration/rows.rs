//! The equation of one joint in one window, linearised about the present unknowns.

use nalgebra::DMatrix;

use super::arm::JointColumns;
use super::layout::{Group, Layout};
use super::recording::EffortRecording;
use crate::solve::subspace::Vector;

/// What the columns depend on beside the unknowns: the order of the unknowns, and the torques of the first fit.
#[derive(Clone, Debug)]
pub(crate) struct EffortModel {
    pub(crate) layout: Layout,
    /// Link parameters of the first fit.
    pub(crate) reference_links: Vec<f64>,
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
    /// Columns of the load-dependent friction of the arm and of the payload.
    load: f64,
    payload_load: f64,
    /// Derivative of `payload_load` with respect to the effort of the payload.
    slope: f64,
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
            let load = arm[self.layout.index(Group::PayloadLoad, joint)];
            let links = columns.links.len();
            for (k, entry) in columns.links.iter().enumerate() {
                rows[(row, k)] = terms.inverse_gain * entry;
            }
            for (place, group) in self.layout.groups().enumerate() {
                rows[(row, links + place)] = match group {
                    Group::Offset => 1.0,
                    Group::Viscous => columns.velocity,
                    Group::Friction(width) => columns.friction[self.layout.widths[width]],
                    Group::Load => terms.load,
                    Group::PayloadLoad => terms.payload_load,
                    Group::Rotor => columns.acceleration,
                    Group::InverseGain => terms.arm + terms.payload * (1.0 + load * terms.slope),
                };
            }
            if payload.is_some() {
                let factor = terms.inverse_gain * (1.0 + load * terms.slope);
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
        let reference = others + dot(columns.links, &self.reference_links[first..]);
        let scale = self.reference_torques[joint];
        let magnitude = |torque: f64| torque.hypot(SMOOTHING * scale);
        let inverse_gain = arm[self.layout.index(Group::InverseGain, joint)];
        let of_payload = columns.payload.dot(payload);
        let loaded = reference + inverse_gain * of_payload;
        Terms {
            inverse_gain,
            arm: others + dot(columns.links, &arm[first..self.layout.link_range().end]),
            payload: of_payload,
            load: columns.sign * (magnitude(reference) - scale),
            payload_load: columns.sign * (magnitude(loaded) - magnitude(reference)),
            slope: columns.sign * loaded / magnitude(loaded),
        }
    }
}

/// Returns the sum of products.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
