//! The equation of one joint in one window, linearised about the present unknowns.

use nalgebra::DMatrix;
use tactid_identify::solve::Vector;

use super::arm::JointColumns;
use super::layout::{Group, Layout};
use super::recording::EffortRecording;

/// What the columns depend on beside the unknowns: their order, and the size of the torques.
#[derive(Clone, Debug)]
pub(crate) struct EffortModel {
    pub(crate) layout: Layout,
    /// Rms torque of each joint in the first fit, N m or N; positive.
    pub(crate) reference_torques: Vec<f64>,
}

/// The unknowns of the arm, and the ten parameters of each payload.
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
    /// Columns of load-dependent friction of arm and payload, and of the payload's difference.
    load: f64,
    payload_load: f64,
    /// Derivatives of the effort with respect to the torques of arm and payload, times the gain.
    arm_slope: f64,
    payload_slope: f64,
}

impl EffortModel {
    /// Indices of a joint's unknowns: of the links that it moves, then its own in order of groups.
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
        self.modelled(joint, &columns, &terms, arm)
    }

    /// Returns the measured effort of a joint that belongs to the motion in a window.
    pub(crate) fn measured(
        &self,
        recording: &EffortRecording,
        (window, joint): (usize, usize),
        arm: &[f64],
    ) -> f64 {
        recording.effort(window, joint, arm[self.layout.index(Group::Delay, joint)])
    }

    /// Returns the modelled effort of a joint from its columns in a window and their terms.
    fn modelled(
        &self,
        joint: usize,
        columns: &JointColumns<'_>,
        terms: &Terms,
        arm: &[f64],
    ) -> Modelled {
        let of = |group: Group| arm[self.layout.index(group, joint)];
        Modelled {
            torque: terms.inverse_gain * (terms.arm + terms.payload),
            friction: of(Group::Offset)
                + self.dry_and_viscous_friction(joint, columns, arm)
                + of(Group::Load) * terms.load
                + of(Group::PayloadLoad) * terms.payload_load
                + of(Group::Rotor) * columns.acceleration,
        }
    }

    /// Returns the friction of a joint in a window that does not depend on the load.
    pub(crate) fn dry_and_viscous_friction(
        &self,
        joint: usize,
        columns: &JointColumns<'_>,
        arm: &[f64],
    ) -> f64 {
        let of = |group: Group| arm[self.layout.index(group, joint)];
        let widths = self.layout.widths.iter().enumerate();
        let dry =
            widths.map(|(place, &width)| of(Group::Friction(place)) * columns.friction[width]);
        of(Group::Viscous) * columns.velocity + dry.sum::<f64>()
    }

    /// Returns a row for each of the windows: the derivatives of modelled less measured effort in
    /// the order of [`Self::indices`] and, where there is a payload, of its ten parameters; then
    /// measured less modelled effort.
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
            let modelled = self.modelled(joint, &columns, &terms, arm);
            let effort = self.measured(recording, (window, joint), arm);
            let delay_s = arm[self.layout.index(Group::Delay, joint)];
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
                    Group::Delay => -recording.effort_slope(window, joint, delay_s),
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
            rows[(row, width - 1)] = effort - modelled.torque - modelled.friction;
        }
        rows
    }

    /// Computes the terms of equation (C1) of the [module](super) that are products of unknowns.
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
        // Smoothed magnitude of an effort, and its derivative times the velocity's smoothed sign.
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

#[cfg(test)]
mod tests {
    use tactid_dynamics::{BaseKind, InertialParameters, Manipulator};

    use super::*;
    use crate::{CalibrationSettings, EffortRecorder};
    use tactid_identify::{BaseState, Sample};

    /// A turntable that carries a slide, an arm that follows the turntable, a fixed tool, and a
    /// finger that is not part of the chain.
    const URDF: &str = "<robot name='arm'><link name='base'/>
      <link name='table'><inertial><origin xyz='0.1 0 0'/><mass value='3'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/></inertial></link>
      <link name='slide'><inertial><origin xyz='0 0.1 0.2'/><mass value='2'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/></inertial></link>
      <link name='arm'><inertial><origin xyz='0.2 0 0'/><mass value='1'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/></inertial></link>
      <link name='tool'/>
      <link name='finger'><inertial><origin xyz='0.05 0 0'/><mass value='0.4'/><inertia ixx='0.01' ixy='0' ixz='0' iyy='0.01' iyz='0' izz='0.01'/></inertial></link>
      <joint name='turn' type='continuous'><parent link='base'/><child link='table'/><origin rpy='1.2 0 0'/><axis xyz='0 0 1'/></joint>
      <joint name='lift' type='prismatic'><parent link='table'/><child link='slide'/><origin xyz='0.3 0 0'/><axis xyz='0 0.6 0.8'/></joint>
      <joint name='follow' type='continuous'><parent link='slide'/><child link='arm'/><origin xyz='0 0.2 0'/><axis xyz='1 0 0'/><mimic joint='turn' multiplier='-0.7'/></joint>
      <joint name='mount' type='fixed'><parent link='arm'/><child link='tool'/><origin xyz='0.3 0 0.1' rpy='0.4 0 0'/></joint>
      <joint name='grip' type='continuous'><parent link='tool'/><child link='finger'/><origin xyz='0 0.05 0'/><axis xyz='0 1 0'/></joint></robot>";

    /// Returns a recording of a smooth motion, with efforts that do not matter.
    fn recording() -> EffortRecording {
        recording_of(&CalibrationSettings::default(), [0.0; 3])
    }

    /// Returns the recording with a number that is added to all positions of each joint, rad or m.
    fn recording_of(settings: &CalibrationSettings, moved: [f64; 3]) -> EffortRecording {
        let robot = Manipulator::from_urdf(URDF, BaseKind::Fixed).unwrap();
        let mut recorder = EffortRecorder::new(&robot, "tool", settings).unwrap();
        for k in 0..200 {
            let t = 0.01 * f64::from(k);
            let position = [(2.0 * t).sin(), 0.2 * (3.0 * t).cos(), (1.7 * t).cos()];
            let position: [f64; 3] = std::array::from_fn(|joint| position[joint] + moved[joint]);
            let sample = Sample {
                time_s: t,
                base: BaseState::fixed(),
                joint_position: &position,
                joint_velocity: &[],
                joint_effort: &position,
                wrenches: &[],
            };
            recorder.push(&sample).unwrap();
        }
        recorder.finish().unwrap()
    }

    fn model() -> EffortModel {
        EffortModel {
            layout: Layout {
                links: 3,
                joints: 2,
                widths: vec![0, 2],
            },
            reference_torques: vec![4.0, 7.0],
        }
    }

    /// The chain has the bodies between base and tool; what other bodies need is known, and does
    /// not depend on the chain's parameters. With the parameters as described, the modelled effort
    /// without friction is their torque.
    #[test]
    fn torques_of_the_chain_and_of_other_bodies_sum_to_those_described() {
        let recording = recording();
        let (arm, model) = (&recording.arm, model());
        assert_eq!(arm.joints, ["turn", "lift"]);
        assert_eq!(arm.links, ["table", "slide", "arm"]);
        assert_eq!(
            (&*arm.first_links, &*arm.units),
            (&[0, 1][..], &["N m", "N"][..])
        );
        let mut unknowns = arm.described.clone();
        unknowns.resize(model.layout.len(), 0.0);
        unknowns[model.layout.range(Group::InverseGain)].fill(1.0);
        // A finger rests relative to the tool only as part of it: its torques must be there, too.
        let mut others: f64 = 0.0;
        for window in 0..recording.windows() {
            for joint in 0..2 {
                let columns = recording.columns(window, joint);
                let first = 10 * arm.first_links[joint];
                let of_chain = dot(columns.links, &arm.described[first..]);
                others = others.max((columns.described - of_chain).abs());
                let modelled =
                    model.effort(&recording, (window, joint), &unknowns, &Vector::zeros());
                assert!((modelled.torque - columns.described).abs() < 1e-12);
                assert_eq!(modelled.friction, 0.0);
            }
        }
        assert!(others > 0.1, "{others}");
    }

    /// Slopes are the derivatives of the torque with respect to a tilt of gravity towards either
    /// direction and to the zero of each joint, of the links as described and of a payload with
    /// mass and first moments.
    #[test]
    fn slopes_are_derivatives() {
        const STEP: f64 = 1e-4;
        let settings = CalibrationSettings::default();
        let recording = recording();
        let payload = Vector::from_column_slice(&[2.0, 0.3, -0.2, 0.5, 0., 0., 0., 0., 0., 0.]);
        let moved = |slope: usize, step: f64| match slope {
            0 | 1 => {
                let mut tilt = nalgebra::Vector2::zeros();
                tilt[slope] = step;
                let gravity = Some(recording.arm.tilted_gravity(tilt));
                let tilted = CalibrationSettings {
                    gravity,
                    ..settings.clone()
                };
                recording_of(&tilted, [0.0; 3])
            }
            _ => {
                let mut shift = [0.0; 3];
                shift[slope - 2] = step;
                recording_of(&settings, shift)
            }
        };
        for slope in 0..4 {
            let (after, before) = (moved(slope, STEP), moved(slope, -STEP));
            let mut largest: f64 = 0.0;
            for (window, joint) in (0..recording.windows()).flat_map(|w| [(w, 0), (w, 1)]) {
                let torque = |recording: &EffortRecording| {
                    let columns = recording.columns(window, joint);
                    columns.described + columns.payload.dot(&payload)
                };
                let difference = (torque(&after) - torque(&before)) / (2.0 * STEP);
                let found = recording
                    .columns(window, joint)
                    .slope(slope, Some(&payload));
                let error = (found - difference).abs();
                assert!(
                    error < 2e-3 * (1.0 + difference.abs()),
                    "{slope} {joint}: {found} {difference}"
                );
                largest = largest.max(difference.abs());
            }
            assert!(largest > 1.0, "{slope}: {largest}");
        }
    }

    /// Rows are the derivatives of modelled less measured effort with respect to every unknown, at
    /// gains and friction far from their prior; the last column is measured less modelled effort.
    #[test]
    fn rows_are_derivatives() {
        let (recording, model) = (recording(), model());
        let mut arm = recording.arm.described.clone();
        let own = (arm.len()..model.layout.len()).map(|k| 0.3 + 0.1 * (k as f64).sin());
        arm.extend(own);
        let payload =
            InertialParameters::from_vector(Vector::from_fn(|k, _| 1.0 - 0.08 * k as f64));
        let payload = payload.as_vector();
        let difference = |at: (usize, usize), arm: &[f64], payload: &Vector| {
            let modelled = model.effort(&recording, at, arm, payload);
            let measured = model.measured(&recording, at, arm);
            modelled.torque + modelled.friction - measured
        };
        let windows = [0, 3];
        for joint in 0..2 {
            let rows = model.rows(&recording, joint, &windows, &arm, Some(payload));
            let indices = model.indices(&recording, joint);
            for (row, &window) in windows.iter().enumerate() {
                let at = (window, joint);
                for column in 0..rows.ncols() - 1 {
                    let moved = |step: f64| {
                        let (mut arm, mut payload) = (arm.clone(), *payload);
                        match indices.get(column) {
                            Some(&index) => arm[index] += step,
                            None => payload[column - indices.len()] += step,
                        }
                        difference(at, &arm, &payload)
                    };
                    let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                    let error = (rows[(row, column)] - slope).abs();
                    assert!(
                        error < 1e-7 * (1.0 + slope.abs()),
                        "{joint} {column} {slope}"
                    );
                }
                let residual = -difference(at, &arm, payload);
                assert!((rows[(row, rows.ncols() - 1)] - residual).abs() < 1e-12);
            }
        }
    }
}
