//! Monitoring of a run: conservation of momentum, the grasp, and the payload's equations of motion.

use nalgebra::{Isometry3, Matrix3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_dynamics::{BaseKind, MassProperties};

use crate::contact::ContactPoint;
use crate::error::ADVICE_GRASP;
use crate::experiment::Bounds;
use crate::robot::Robot;
use crate::scene::{BodyState, State};
use crate::{Experiment, SimError};

/// Largest violations of conservation laws and of the grasp in a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Checks {
    /// Change of the system's linear momentum, as a fraction of the largest one of a single body;
    /// `None` for a fixed base, which exchanges momentum with the ground.
    pub linear_momentum_drift: Option<f64>,
    /// Change of the system's angular momentum about the world's origin, as a fraction of the
    /// largest angular momentum of any single body, without a unit; `None` for a fixed base.
    pub angular_momentum_drift: Option<f64>,
    /// Displacement of the payload in the tool frame, m.
    pub grasp_drift_m: f64,
    /// Rotation of the payload in the tool frame, rad.
    pub grasp_drift_rad: f64,
    /// Residual of Newton's equation of the payload under the contact forces and gravity, as a
    /// fraction of the largest contact force, without a unit.
    pub newton_residual: f64,
    /// Residual of Euler's equation of the payload about its centre of mass, as a fraction of the
    /// largest contact moment, without a unit.
    pub euler_residual: f64,
}

/// Largest motion of a free-floating base from where the excitation started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaseExcursion {
    /// Angle by which the base link is turned, degrees.
    pub attitude_deg: f64,
    /// Distance of the origin of the base link's frame from its start, m.
    pub position_m: f64,
}

/// Smallest reference for a relative change of momentum, N s and N m s.
const SMALLEST_MOMENTUM: f64 = 0.1;
/// Smallest reference for a relative residual of force and moment, N and N m.
const SMALLEST_WRENCH: f64 = 1.0;

/// Number of steps between two checks of the momentum and the grasp.
const EVERY: u64 = 10;

/// Largest residual so far, relative to the largest reference so far.
#[derive(Clone, Copy, Default)]
struct Ratio {
    residual: f64,
    scale: f64,
}

impl Ratio {
    fn add(&mut self, residual: f64, scale: f64, smallest: f64) {
        self.residual = self.residual.max(residual);
        self.scale = self.scale.max(scale).max(smallest);
    }

    fn value(self) -> f64 {
        if self.scale > 0.0 {
            self.residual / self.scale
        } else {
            0.0
        }
    }
}

/// Monitor of a run, which compares [`Checks`] with the experiment's bounds.
pub(crate) struct Monitor {
    bounds: Bounds,
    robot: Vec<MassProperties>,
    payload: MassProperties,
    gravity: Vector3<f64>,
    /// Whether momentum is conserved: the base floats.
    is_free: bool,
    dt: f64,
    /// Linear and angular momentum at the start of the excitation.
    momentum: [Vector3<f64>; 2],
    tool_from_payload: Isometry3<f64>,
    linear: Ratio,
    angular: Ratio,
    newton: Ratio,
    euler: Ratio,
    grasp_drift_m: f64,
    grasp_drift_rad: f64,
    /// Pose of the base link on its body, which has its frame at the centre of mass.
    body_from_base: Isometry3<f64>,
    /// Inverse of the pose of the base link at the start, in the world frame.
    start_from_world: Isometry3<f64>,
    excursion: BaseExcursion,
}

impl Monitor {
    pub(crate) fn new(
        experiment: &Experiment,
        robot: &Robot,
        start: &State,
        world_from_tool: &Isometry3<f64>,
    ) -> Self {
        let mut monitor = Self {
            bounds: experiment.bounds.clone(),
            robot: robot.bodies.iter().map(|body| body.mass).collect(),
            payload: MassProperties {
                center_of_mass: Vector3::zeros(),
                ..experiment.payload.mass_properties()
            },
            gravity: experiment.gravity(),
            is_free: robot.base == BaseKind::Floating,
            dt: experiment.step_s,
            momentum: [Vector3::zeros(); 2],
            tool_from_payload: world_from_tool.inverse() * start.payload.pose,
            linear: Ratio::default(),
            angular: Ratio::default(),
            newton: Ratio::default(),
            euler: Ratio::default(),
            grasp_drift_m: 0.0,
            grasp_drift_rad: 0.0,
            body_from_base: robot.links[0].body_from_link,
            start_from_world: (start.bodies[0].pose * robot.links[0].body_from_link).inverse(),
            excursion: BaseExcursion::default(),
        };
        monitor.momentum = monitor.total_momentum(start).0;
        monitor
    }

    /// Returns the checks up to the last step.
    pub(crate) fn checks(&self) -> Checks {
        Checks {
            linear_momentum_drift: self.is_free.then(|| self.linear.value()),
            angular_momentum_drift: self.is_free.then(|| self.angular.value()),
            grasp_drift_m: self.grasp_drift_m,
            grasp_drift_rad: self.grasp_drift_rad,
            newton_residual: self.newton.value(),
            euler_residual: self.euler.value(),
        }
    }

    /// Returns how far a free-floating base has moved up to the last step; `None` for a fixed base.
    pub(crate) fn base_excursion(&self) -> Option<BaseExcursion> {
        self.is_free.then_some(self.excursion)
    }

    /// Checks the step `index`, which starts in `before` at `time_s` and ends in `after`.
    ///
    /// # Errors
    /// Returns [`SimError::Diverged`], [`SimError::Lost`] or [`SimError::Bound`].
    pub(crate) fn check_step(
        &mut self,
        index: u64,
        time_s: f64,
        (before, after): (&State, &State),
        contacts: &[Vec<ContactPoint>; 2],
        world_from_tool: &Isometry3<f64>,
    ) -> Result<(), SimError> {
        if !after.is_finite() {
            let what = "the state after a step";
            return Err(SimError::Diverged { time_s, what });
        }
        if contacts.iter().all(Vec::is_empty) {
            return Err(SimError::Lost { time_s });
        }
        self.check_contacts(before, after, contacts);
        let moved = self.start_from_world * after.bodies[0].pose * self.body_from_base;
        let BaseExcursion {
            attitude_deg,
            position_m,
        } = &mut self.excursion;
        *attitude_deg = attitude_deg.max(moved.rotation.angle().to_degrees());
        *position_m = position_m.max(moved.translation.vector.norm());
        if index.is_multiple_of(EVERY) {
            if self.is_free {
                self.check_momentum(after);
            }
            let moved = self.tool_from_payload.inverse()
                * (world_from_tool.inverse() * before.payload.pose);
            self.grasp_drift_m = self.grasp_drift_m.max(moved.translation.vector.norm());
            self.grasp_drift_rad = self.grasp_drift_rad.max(moved.rotation.angle());
        }
        self.enforce(time_s)
    }

    /// Adds the change of the system's momentum since the start.
    fn check_momentum(&mut self, state: &State) {
        let ([linear, angular], [largest_linear, largest_angular]) = self.total_momentum(state);
        let [linear_0, angular_0] = self.momentum;
        let (linear, angular) = ((linear - linear_0).norm(), (angular - angular_0).norm());
        self.linear.add(linear, largest_linear, SMALLEST_MOMENTUM);
        self.angular
            .add(angular, largest_angular, SMALLEST_MOMENTUM);
    }

    /// Returns linear and angular momentum of all bodies about the world's origin, and the largest
    /// of any single body.
    fn total_momentum(&self, state: &State) -> ([Vector3<f64>; 2], [f64; 2]) {
        let mut total = [Vector3::zeros(); 2];
        let mut largest = [0.0_f64; 2];
        let payload = std::iter::once((&self.payload, &state.payload));
        for (mass, body) in self.robot.iter().zip(&state.bodies).chain(payload) {
            let momentum = momentum(mass, body);
            for i in 0..2 {
                total[i] += momentum[i];
                largest[i] = largest[i].max(momentum[i].norm());
            }
        }
        (total, largest)
    }

    /// Adds the residuals of the payload's equations of motion under the contact forces.
    fn check_contacts(&mut self, before: &State, after: &State, contacts: &[Vec<ContactPoint>; 2]) {
        let (x, next) = (&before.payload, &after.payload);
        let center = x.pose.translation.vector;
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for point in contacts.iter().flatten() {
            force += point.force;
            moment += (point.position - center).cross(&point.force);
        }
        let acceleration = (next.velocity - x.velocity) / self.dt;
        let inertia = inertia_in_world(&self.payload.inertia, x);
        let angular_velocity = (x.angular_velocity + next.angular_velocity) * 0.5;
        let angular_acceleration = (next.angular_velocity - x.angular_velocity) / self.dt;
        let euler =
            inertia * angular_acceleration + angular_velocity.cross(&(inertia * angular_velocity));
        let newton = self.payload.mass_kg * (acceleration - self.gravity);
        self.newton
            .add((force - newton).norm(), force.norm(), SMALLEST_WRENCH);
        self.euler
            .add((moment - euler).norm(), moment.norm(), SMALLEST_WRENCH);
    }

    /// Returns the first check that exceeds its bound as an error.
    fn enforce(&self, time_s: f64) -> Result<(), SimError> {
        let (c, b) = (self.checks(), &self.bounds);
        let linear = c.linear_momentum_drift.unwrap_or(0.0);
        let angular = c.angular_momentum_drift.unwrap_or(0.0);
        #[rustfmt::skip] // a table
        let limits = [
            ("the payload's displacement in the grasp", c.grasp_drift_m, b.grasp_drift_m, GRASP_M),
            ("the payload's rotation in the grasp", c.grasp_drift_rad, b.grasp_drift_rad, GRASP_RAD),
            ("the drift of linear momentum", linear, b.momentum_drift, MOMENTUM),
            ("the drift of angular momentum", angular, b.momentum_drift, MOMENTUM),
            ("the residual of Newton's equation", c.newton_residual, b.newton_euler_residual, WRENCH),
            ("the residual of Euler's equation", c.euler_residual, b.newton_euler_residual, WRENCH),
        ];
        for (
            what,
            value,
            bound,
            Limit {
                field,
                unit,
                advice,
            },
        ) in limits
        {
            if value > bound {
                return Err(SimError::Bound {
                    time_s,
                    what,
                    value,
                    bound,
                    unit,
                    field,
                    advice,
                });
            }
        }
        Ok(())
    }
}

/// A field of [`Bounds`] with its unit and the advice for a run that exceeds it.
struct Limit {
    field: &'static str,
    unit: &'static str,
    advice: &'static str,
}

const ADVICE_STEP: &str = "make step_s shorter, or drive the joints less hard";
const GRASP_M: Limit = Limit {
    field: "grasp_drift_m",
    unit: "m",
    advice: ADVICE_GRASP,
};
const GRASP_RAD: Limit = Limit {
    field: "grasp_drift_rad",
    unit: "rad",
    advice: ADVICE_GRASP,
};
const MOMENTUM: Limit = Limit {
    field: "momentum_drift",
    unit: "of the largest body's",
    advice: ADVICE_STEP,
};
const WRENCH: Limit = Limit {
    field: "newton_euler_residual",
    unit: "of the largest",
    advice: ADVICE_STEP,
};

/// Returns an inertia of a body's frame along the axes of the world frame.
fn inertia_in_world(inertia: &Matrix3<f64>, body: &BodyState) -> Matrix3<f64> {
    let world_from_body = body.pose.rotation.to_rotation_matrix();
    world_from_body.matrix() * inertia * world_from_body.matrix().transpose()
}

/// Returns linear and angular momentum of a body about the world's origin.
pub(crate) fn momentum(mass: &MassProperties, body: &BodyState) -> [Vector3<f64>; 2] {
    let center = body.pose * nalgebra::Point3::from(mass.center_of_mass);
    let linear = mass.mass_kg * body.velocity;
    let spin = inertia_in_world(&mass.inertia, body) * body.angular_velocity;
    [linear, center.coords.cross(&linear) + spin]
}
