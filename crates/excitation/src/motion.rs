//! Motions of all joints of a robot over a time.

use tactid_dynamics::JointMotion;

use crate::spline::Spline;

/// Positions, velocities and accelerations of all joints at one time, in the robot's order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointStates {
    /// Positions, rad or m.
    pub position: Vec<f64>,
    /// Velocities, rad/s or m/s.
    pub velocity: Vec<f64>,
    /// Accelerations, rad/s² or m/s².
    pub acceleration: Vec<f64>,
}

impl JointStates {
    /// Returns joints that rest at positions.
    #[must_use]
    pub fn at_rest(position: &[f64]) -> Self {
        Self {
            position: position.to_vec(),
            velocity: vec![0.0; position.len()],
            acceleration: vec![0.0; position.len()],
        }
    }

    /// Returns the states as the dynamics take them.
    #[must_use]
    pub fn joints(&self) -> JointMotion<'_> {
        JointMotion {
            position: &self.position,
            velocity: &self.velocity,
            acceleration: &self.acceleration,
        }
    }
}

/// A motion of the joints of a robot.
pub trait Motion {
    /// Returns how long it takes, s.
    fn duration_s(&self) -> f64;

    /// Returns the states of all joints at a time since its beginning, s.
    fn at(&self, time_s: f64) -> JointStates;
}

/// A motion of some joints along splines, while the other joints of the robot rest.
///
/// A long motion goes along its splines several times, in turn forth and back. On the way back,
/// positions and accelerations are the same in reverse order and velocities have the opposite sign,
/// so that torques and wrenches, which are quadratic in velocities, are the same as on the way
/// forth, and a free-floating base without momentum returns along its own path. A limit that holds
/// in the first pass therefore holds in all of them.
#[derive(Clone, Debug)]
pub struct Trajectory {
    pass_s: f64,
    passes: usize,
    posture: Vec<f64>,
    splines: Vec<(usize, Spline)>,
}

impl Trajectory {
    /// Creates the motion from the posture of all joints, and the index and the spline of each
    /// joint that moves.
    pub(crate) fn new(duration_s: f64, posture: &[f64], splines: Vec<(usize, Spline)>) -> Self {
        Self {
            pass_s: duration_s,
            passes: 1,
            posture: posture.to_vec(),
            splines,
        }
    }

    /// Returns the motion with a number of passes along the splines, in turn forth and back.
    pub(crate) fn with_passes(self, passes: usize) -> Self {
        Self { passes, ..self }
    }

    /// Returns the number of passes along the splines, in turn forth and back.
    #[must_use]
    pub fn passes(&self) -> usize {
        self.passes
    }

    /// Returns the spline of each joint that moves in the first pass, with the index of the joint
    /// in the robot's order.
    pub fn splines(&self) -> impl ExactSizeIterator<Item = (usize, &Spline)> {
        self.splines.iter().map(|(joint, spline)| (*joint, spline))
    }
}

impl Motion for Trajectory {
    fn duration_s(&self) -> f64 {
        self.pass_s * self.passes as f64
    }

    fn at(&self, time_s: f64) -> JointStates {
        let pass = ((time_s / self.pass_s) as usize).min(self.passes - 1);
        let since_s = time_s - pass as f64 * self.pass_s;
        let (time_s, sign) = if pass.is_multiple_of(2) {
            (since_s, 1.0)
        } else {
            (self.pass_s - since_s, -1.0)
        };
        let mut states = JointStates::at_rest(&self.posture);
        for (joint, spline) in &self.splines {
            let [position, velocity, acceleration] = spline.at(time_s);
            states.position[*joint] = position;
            states.velocity[*joint] = sign * velocity;
            states.acceleration[*joint] = acceleration;
        }
        states
    }
}
