//! Regressors of the joint torques: the torques are linear in the inertial parameters of each body.

use nalgebra::{SVector, Vector3};

use crate::recursion::{BodyModel, BodyState};
use crate::vector::Vec3;
use crate::virtual_work::power_regressor;
use crate::{FrameId, JointKind, StateError, ToolMotion, Workspace};

impl Workspace {
    /// Computes the regressor of the joint torques (forces of prismatic joints) for a body that is
    /// fixed to a frame: the torque that joint `j` must add to move the body is `rows[j] · π`, N m
    /// or N, with `π` the [`InertialParameters`](crate::InertialParameters) of the body in the
    /// frame. `gravity` is the gravitational acceleration in the inertial frame, m/s², pointing
    /// down. The row of a joint that does not move the frame is zero.
    ///
    /// Over all bodies of a robot, each in the frame of its first link, the products sum to
    /// [`joint_torques`](Self::joint_torques). The base moves no joint, so its parameters do not
    /// count; it may float.
    ///
    /// The cost is one pass over the bodies above the frame. Nothing is allocated, and
    /// [`forces`](crate::forces()) is not needed.
    ///
    /// # Errors
    /// Returns [`StateError::Length`] if `rows` does not have one entry for each independent joint.
    pub fn body_torque_regressor(
        &self,
        frame: FrameId,
        gravity: &Vector3<f64>,
        rows: &mut [SVector<f64, 10>],
    ) -> Result<(), StateError> {
        self.robot.check_count("the regressor", rows.len())?;
        rows.fill(SVector::zeros());
        let motion = self.tool_motion(frame, gravity);
        for (joint, column) in self.jacobian_columns(frame) {
            let (v, u) = (column.fixed_rows::<3>(0), column.fixed_rows::<3>(3));
            // principle of virtual work, not in the paper
            rows[joint.coordinate] += power_regressor(&motion, &v.into(), &u.into()) * joint.ratio;
        }
        Ok(())
    }

    /// Computes the regressor of the joint torques for all bodies that joints move: row
    /// `joint · n + k` is the row `joint` of [`body_torque_regressor`](Self::body_torque_regressor)
    /// for the `k`-th of these `n` bodies, in the order of
    /// [`Manipulator::bodies`](crate::Manipulator::bodies) without the base, and for the frame of
    /// the body. A row is zero where the joint does not move the body.
    ///
    /// The cost is a product for each joint and each body below it; where `gravity` differs from
    /// the motion's, each body also costs a pass over those above it. Nothing is allocated, and
    /// [`forces`](crate::forces()) is not needed.
    ///
    /// # Errors
    /// Returns [`StateError::Rows`] if `rows` does not have one entry for each independent joint
    /// and moving body.
    pub fn joint_torque_regressor(
        &mut self,
        gravity: &Vector3<f64>,
        rows: &mut [SVector<f64, 10>],
    ) -> Result<(), StateError> {
        let moving = self.bodies.len() - 1;
        let expected = moving * self.robot.dof();
        if rows.len() != expected {
            let given = rows.len();
            return Err(StateError::Rows { given, expected });
        }
        rows.fill(SVector::zeros());
        self.set_gravity(gravity);
        for (index, body) in self.bodies.iter().enumerate() {
            self.regressor_states[index].motion = body.own_motion(&self.states[index]);
        }
        for first in 1..self.bodies.len() {
            let Some(joint) = self.bodies[first].joint else {
                continue;
            };
            let along = Vec3([0.0, 0.0, joint.ratio]);
            self.regressor_states[first].column = match joint.kind {
                JointKind::Revolute => [Vec3([0.0; 3]), along],
                JointKind::Prismatic => [along, Vec3([0.0; 3])],
            };
            // In depth-first order the bodies below a joint are contiguous.
            for index in first..self.bodies.len() {
                let body = &self.bodies[index];
                if index > first {
                    if body.parent < first {
                        break;
                    }
                    let [linear, angular] = self.regressor_states[body.parent].column;
                    let state = &self.states[index];
                    let linear = linear + angular.cross(state.translation);
                    self.regressor_states[index].column =
                        [linear, angular].map(|v| state.rotation.tr_mul(v));
                }
                let of_body = &self.regressor_states[index];
                let [v, u] = of_body.column.map(|vector| body.in_own_frame(vector));
                let row = &mut rows[joint.coordinate * moving + index - 1];
                *row += power_regressor(&of_body.motion, &v, &u);
            }
        }
        Ok(())
    }
}

impl BodyModel {
    /// Returns a vector of the joint frame in the frame of the body.
    fn in_own_frame(&self, vector: Vec3<f64>) -> Vector3<f64> {
        let vector = vector.into();
        match &self.body_from_joint {
            None => vector,
            Some(rotation) => rotation * vector,
        }
    }

    /// Returns the motion of the body in its own frame.
    fn own_motion(&self, state: &BodyState<f64>) -> ToolMotion {
        ToolMotion {
            acceleration: self.in_own_frame(state.acceleration),
            angular_velocity: self.in_own_frame(state.angular_velocity),
            angular_acceleration: self.in_own_frame(state.angular_acceleration),
        }
    }
}
