//! Identification of the payload by least squares on `[f; n] = Y π` from the samples, without log,
//! filter or tactid-identify.

use nalgebra::{Isometry3, SMatrix, SVector, Translation3, Vector3};
use tactid_dynamics::{
    FrameId, FrameMotion, InertialParameters, JointMotion, Manipulator, MassProperties, ToolMotion,
    Workspace, Wrench, forces, motion, symmetric_entries, wrench_on_end_effector, wrench_regressor,
};
use tactid_sim::{Sample, Simulation};

type Failure = Box<dyn std::error::Error>;

/// Normal equations of `[f; n] = Y π`.
pub(crate) struct LeastSquares {
    normal: SMatrix<f64, 10, 10>,
    right: SVector<f64, 10>,
}

impl Default for LeastSquares {
    fn default() -> Self {
        Self {
            normal: SMatrix::zeros(),
            right: SVector::zeros(),
        }
    }
}

impl LeastSquares {
    fn push(&mut self, tool: &ToolMotion, wrench: &Wrench) {
        let rows = wrench_regressor(tool);
        let Wrench { force, moment } = wrench;
        let wrench = SVector::<f64, 6>::from_iterator(force.iter().chain(moment.iter()).copied());
        self.normal += rows.transpose() * rows;
        self.right += rows.transpose() * wrench;
    }

    fn solve(&self) -> Result<InertialParameters, Failure> {
        let normal = self.normal.cholesky().ok_or("not identifiable")?;
        Ok(InertialParameters::from_vector(normal.solve(&self.right)))
    }
}

/// State in the middle between two samples.
struct Middle {
    base: FrameMotion,
    position: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
}

impl Middle {
    fn new(a: &Sample, b: &Sample) -> Self {
        let dt = b.time_s - a.time_s;
        let each = |a: &[f64], b: &[f64], f: fn(f64, f64, f64) -> f64| {
            a.iter().zip(b).map(|(a, b)| f(*a, *b, dt)).collect()
        };
        let position = (a.base.pose.translation.vector + b.base.pose.translation.vector) * 0.5;
        let rotation = a.base.pose.rotation.slerp(&b.base.pose.rotation, 0.5);
        Self {
            base: FrameMotion {
                pose: Isometry3::from_parts(Translation3::from(position), rotation),
                velocity: (a.base.velocity + b.base.velocity) * 0.5,
                angular_velocity: (a.base.angular_velocity + b.base.angular_velocity) * 0.5,
                acceleration: (b.base.velocity - a.base.velocity) / dt,
                angular_acceleration: (b.base.angular_velocity - a.base.angular_velocity) / dt,
            },
            position: each(&a.joint_position, &b.joint_position, |a, b, _| {
                0.5 * (a + b)
            }),
            velocity: each(&a.joint_velocity, &b.joint_velocity, |a, b, _| {
                0.5 * (a + b)
            }),
            acceleration: each(&a.joint_velocity, &b.joint_velocity, |a, b, dt| {
                (b - a) / dt
            }),
        }
    }

    fn joints(&self) -> JointMotion<'_> {
        JointMotion {
            position: &self.position,
            velocity: &self.velocity,
            acceleration: &self.acceleration,
        }
    }
}

/// Forms the equations of both methods from consecutive samples, and compares joint torques with
/// the inverse dynamics.
pub(crate) struct Identifier {
    /// State of the robot with its gripper and without payload.
    robot: Workspace,
    /// State of the robot without its gripper, which joint sensing identifies with the payload.
    rest: Workspace,
    /// State of the robot with the payload.
    loaded: Workspace,
    tool: FrameId,
    fingers: [FrameId; 2],
    gravity: Vector3<f64>,
    last: Option<Sample>,
    tactile: LeastSquares,
    joint_sensing: LeastSquares,
    /// Sum of squares of the torque errors.
    torque_error: f64,
    torque: f64,
}

impl Identifier {
    pub(crate) fn new(simulation: &Simulation) -> Result<Self, Failure> {
        let experiment = simulation.experiment();
        let robot = Manipulator::from_urdf(simulation.urdf(), experiment.robot.base.kind())?;
        assert_eq!(robot.joint_names(), simulation.joint_names());
        let tool = robot.frame("tool0")?;
        let payload = InertialParameters::from(*simulation.payload_in_tool());
        Ok(Self {
            rest: Workspace::new(&robot.without_subtree(tool)),
            loaded: Workspace::new(&robot.with_payload(tool, &payload)),
            tool,
            fingers: [
                robot.frame("finger_left_link")?,
                robot.frame("finger_right_link")?,
            ],
            robot: Workspace::new(&robot),
            gravity: experiment.gravity(),
            last: None,
            tactile: LeastSquares::default(),
            joint_sensing: LeastSquares::default(),
            torque_error: 0.0,
            torque: 0.0,
        })
    }

    /// Returns the sum of the fingers' wrenches in the tool frame, with the fingers' poses from
    /// their joint positions.
    fn wrench_in_tool(&mut self, sample: &Sample) -> Result<Wrench, Failure> {
        let joints = JointMotion {
            position: &sample.joint_position,
            velocity: &sample.joint_velocity,
            acceleration: &sample.joint_velocity,
        };
        motion(
            &mut self.robot,
            &FrameMotion::at_rest(sample.base.pose),
            joints,
        )?;
        let tool_from_world = self.robot.pose(self.tool).inverse();
        let mut sum = Wrench::zero();
        for (frame, finger) in self.fingers.into_iter().zip(&sample.fingers) {
            let tool_from_finger = tool_from_world * self.robot.pose(frame);
            sum = sum + finger.wrench.expressed_in(&tool_from_finger);
        }
        Ok(sum)
    }

    /// Adds the equations of the interval that ends with `sample`.
    pub(crate) fn push(&mut self, sample: &Sample) -> Result<(), Failure> {
        let Some(last) = self.last.replace(sample.clone()) else {
            return Ok(());
        };
        let (a, b) = (self.wrench_in_tool(&last)?, self.wrench_in_tool(sample)?);
        let mean = Wrench {
            force: (a.force + b.force) * 0.5,
            moment: (a.moment + b.moment) * 0.5,
        };
        let middle = Middle::new(&last, sample);
        let gravity = self.gravity;

        motion(&mut self.robot, &middle.base, middle.joints())?;
        let tool = self.robot.frame_motion(self.tool).in_frame(&gravity);
        self.tactile.push(&tool, &mean);

        motion(&mut self.loaded, &middle.base, middle.joints())?;
        forces(&mut self.loaded, &gravity);
        for (joint, expected) in self.loaded.joint_torques()?.iter().take(6).enumerate() {
            let torque = 0.5 * (last.joint_torque[joint] + sample.joint_torque[joint]);
            self.torque_error += (torque - expected).powi(2);
            self.torque += expected.powi(2);
        }

        motion(&mut self.rest, &middle.base, middle.joints())?;
        let wrench = wrench_on_end_effector(&self.rest, self.tool);
        self.joint_sensing.push(&tool, &wrench);
        Ok(())
    }

    /// Returns the payload from the contact wrenches.
    pub(crate) fn tactile(&self) -> Result<MassProperties, Failure> {
        Ok(self.tactile.solve()?.mass_properties().ok_or("no mass")?)
    }

    /// Returns the payload from the motion of base and links, with the gripper subtracted.
    pub(crate) fn joint_sensing(&mut self) -> Result<MassProperties, Failure> {
        let Some(sample) = self.last.clone() else {
            return Err("no samples".into());
        };
        self.wrench_in_tool(&sample)?; // moves the robot there
        let gripper = self.robot.subtree_parameters(self.tool);
        let payload = self.joint_sensing.solve()? - gripper;
        Ok(payload.mass_properties().ok_or("no mass")?)
    }

    /// Returns the rms difference between measured joint torques and inverse dynamics, relative to
    /// the rms torque.
    pub(crate) fn torque_error(&self) -> f64 {
        (self.torque_error / self.torque).sqrt()
    }
}

/// Returns the error of each parameter in percent of its nominal value, or of the largest of its
/// kind for a zero.
pub(crate) fn errors_percent(
    estimate: &MassProperties,
    nominal: &MassProperties,
) -> Vec<(&'static str, f64)> {
    let relative = |value: f64, nominal: f64, largest: f64| {
        100.0 * (value - nominal) / if nominal == 0.0 { largest } else { nominal }
    };
    let mut errors = vec![("m", relative(estimate.mass_kg, nominal.mass_kg, 0.0))];
    for (i, name) in ["x", "y", "z"].into_iter().enumerate() {
        let (a, n) = (estimate.center_of_mass[i], nominal.center_of_mass[i]);
        errors.push((name, relative(a, n, nominal.center_of_mass.amax())));
    }
    let (a, n) = (
        symmetric_entries(&estimate.inertia),
        symmetric_entries(&nominal.inertia),
    );
    for (i, name) in ["xx", "xy", "xz", "yy", "yz", "zz"].into_iter().enumerate() {
        errors.push((name, relative(a[i], n[i], nominal.inertia.amax())));
    }
    errors
}

/// Returns the largest error of the ten parameters in percent.
#[allow(dead_code)] // not every user of this module asks
pub(crate) fn worst_percent(estimate: &MassProperties, nominal: &MassProperties) -> f64 {
    let errors = errors_percent(estimate, nominal);
    errors
        .iter()
        .map(|(_, error)| error.abs())
        .fold(0.0, f64::max)
}
