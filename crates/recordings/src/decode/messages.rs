//! Decoding of each type of message.

use std::mem;
use std::sync::Arc;

use nalgebra::{Isometry3, Quaternion, Translation3, Vector3};
use tactid_dynamics::{BaseAcceleration, Wrench};
use tactid_identify::BaseState;
use tactid_logs::RawMessage;
use tactid_logs::messages::{self, AccelStamped, Imu, JointState};

use super::Decoder;
use super::joints::Mapping;
use crate::alignment::{JointValues, Measured, SpecificForce};
use crate::fault::{FaultKind, check};
use crate::unit_quaternion;

impl Decoder {
    pub(super) fn joints(&mut self, message: &RawMessage) -> Result<Measured, FaultKind> {
        let mut state = mem::take(&mut self.joint_state);
        let decoded = message.decode_into(&mut state);
        let result = match decoded {
            Ok(()) => self.joint_values(message, &state),
            Err(_) => Err(FaultKind::Undecodable),
        };
        self.joint_state = state;
        result
    }

    fn joint_values(
        &mut self,
        message: &RawMessage,
        state: &JointState,
    ) -> Result<Measured, FaultKind> {
        let time_s = self.time_s(message, state.header.stamp)?;
        let mapping = self.mapping(&state.name).ok_or(FaultKind::PartialJoints)?;
        self.set_origin(message, mapping.group, time_s);
        let count = state.name.len();
        if state.position.len() != count {
            return Err(FaultKind::PositionCount);
        }
        if self.decoding.uses_effort && state.effort.len() != count {
            return Err(FaultKind::NoEffort);
        }
        let pick = |values: &[f64]| -> Vec<f64> {
            if values.len() == count {
                mapping.entries.iter().map(|&entry| values[entry]).collect()
            } else {
                Vec::new()
            }
        };
        let uses_effort = self.decoding.uses_effort;
        let values = JointValues {
            position: pick(&state.position),
            velocity: pick(&state.velocity),
            effort: if uses_effort {
                pick(&state.effort)
            } else {
                Vec::new()
            },
        };
        let topic = message.topic.name.as_str();
        if values.velocity.is_empty() {
            self.faults.add(topic, FaultKind::NoVelocity, time_s);
        }
        let (names, gains) = (self.decoding.joints.names(), &self.decoding.effort_gains);
        let checked = values.check(&mapping.places, names, gains);
        let (values, fault) = checked.map_err(|(_, kind)| kind)?;
        if let Some(kind) = fault {
            self.faults.add(topic, kind, time_s);
        }
        Ok(match mapping.group.checked_sub(1) {
            None => Measured::Joints(spread(values, &mapping.places, self.decoding.joints.dof())),
            Some(other) => Measured::MoreJoints(other, values),
        })
    }

    /// Returns the meaning of a list of joint names.
    fn mapping(&mut self, names: &[String]) -> Option<Arc<Mapping>> {
        let known = self.mappings.iter().find(|(known, _)| known == names);
        if let Some((_, mapping)) = known {
            return mapping.clone();
        }
        let mapping = self.decoding.joints.mapping(names).map(Arc::new);
        self.mappings.push((names.to_vec(), mapping.clone()));
        mapping
    }

    pub(super) fn odometry(&mut self, message: &RawMessage) -> Result<Measured, FaultKind> {
        let decoded = message.decode_into(&mut self.odometry);
        decoded.map_err(|_| FaultKind::Undecodable)?;
        let time_s = self.time_s(message, self.odometry.header.stamp)?;
        self.set_origin(message, 0, time_s);
        let (pose, twist) = (&self.odometry.pose.pose, &self.odometry.twist.twist);
        let (p, q) = (&pose.position, &pose.orientation);
        check(&[p.x, p.y, p.z, q.w, q.x, q.y, q.z])?;
        let rotation = unit_quaternion(Quaternion::new(q.w, q.x, q.y, q.z));
        let rotation = rotation.ok_or(FaultKind::NotUnitQuaternion)?;
        // The twist of odometry is in the moving frame, that of a state in the inertial one.
        let base = BaseState {
            pose: Isometry3::from_parts(Translation3::new(p.x, p.y, p.z), rotation),
            velocity: rotation * vector(twist.linear),
            angular_velocity: rotation * vector(twist.angular),
            acceleration: None,
            angular_acceleration: None,
        };
        check(base.velocity.iter().chain(&base.angular_velocity))?;
        Ok(Measured::Base(Box::new(base)))
    }

    pub(super) fn acceleration(&mut self, message: &RawMessage) -> Result<Measured, FaultKind> {
        let decoded = message.decode::<AccelStamped>();
        let stamped = decoded.map_err(|_| FaultKind::Undecodable)?;
        let time_s = self.time_s(message, stamped.header.stamp)?;
        self.set_origin(message, 0, time_s);
        let acceleration = BaseAcceleration {
            linear: vector(stamped.accel.linear),
            angular: vector(stamped.accel.angular),
        };
        let values = acceleration.linear.iter().chain(&acceleration.angular);
        check(values)?;
        Ok(Measured::Acceleration(acceleration))
    }

    /// An inertial unit measures `p̈ - g` in its own frame, which is all that the equations need:
    /// the inertial frame is taken to be one that rotates with the unit, in which there is no
    /// gravity.
    pub(super) fn imu(&mut self, message: &RawMessage) -> Result<Measured, FaultKind> {
        let imu = self.specific_force(message)?;
        let base = BaseState {
            angular_velocity: imu.angular_velocity,
            acceleration: Some(imu.linear),
            ..BaseState::fixed()
        };
        Ok(Measured::Base(Box::new(base)))
    }

    pub(super) fn base_imu(&mut self, message: &RawMessage) -> Result<Measured, FaultKind> {
        Ok(Measured::BaseImu(self.specific_force(message)?))
    }

    fn specific_force(&mut self, message: &RawMessage) -> Result<SpecificForce, FaultKind> {
        let decoded = message.decode::<Imu>();
        let imu = decoded.map_err(|_| FaultKind::Undecodable)?;
        let time_s = self.time_s(message, imu.header.stamp)?;
        self.set_origin(message, 0, time_s);
        let measured = SpecificForce {
            linear: vector(imu.linear_acceleration),
            angular_velocity: vector(imu.angular_velocity),
        };
        check(measured.linear.iter().chain(&measured.angular_velocity))?;
        Ok(measured)
    }

    pub(super) fn wrench(
        &mut self,
        sensor: usize,
        message: &RawMessage,
    ) -> Result<Measured, FaultKind> {
        let (header, read, left_out) = self.wrenches.read(message)?;
        let stamp = header.stamp;
        let time_s = self.time_s(message, stamp)?;
        self.set_origin(message, 0, time_s);
        if left_out > 0 {
            let (topic, kind) = (&message.topic.name, FaultKind::PointNotFinite);
            self.faults.add_many(topic, kind, left_out, time_s);
        }
        let mut wrench = Wrench {
            force: read.force * self.decoding.wrench_sign,
            moment: read.moment * self.decoding.wrench_sign,
        };
        let channels = wrench.force.iter_mut().chain(&mut wrench.moment);
        for (channel, is_unmeasured) in channels.zip(self.decoding.unmeasured[sensor]) {
            if is_unmeasured {
                *channel = 0.0;
            }
        }
        check(wrench.force.iter().chain(&wrench.moment))?;
        Ok(Measured::Wrench(sensor, wrench))
    }
}

/// Writes the joints of the first publisher to their places among all; the others are zero until
/// the alignment fills them in.
fn spread(values: JointValues, places: &[usize], dof: usize) -> JointValues {
    if places.len() == dof {
        return values;
    }
    let spread = |values: Vec<f64>| -> Vec<f64> {
        let mut all = vec![0.0; if values.is_empty() { 0 } else { dof }];
        for (&place, value) in places.iter().zip(values) {
            all[place] = value;
        }
        all
    };
    JointValues {
        position: spread(values.position),
        velocity: spread(values.velocity),
        effort: spread(values.effort),
    }
}

fn vector(v: messages::Vector3) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}
