//! What every run must keep to: momentum, the grasp, Newton and Euler.

use nalgebra::{Isometry3, Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use tactid_dynamics::MassProperties;

use crate::SimError;
use crate::contact::ContactPoint;
use crate::error::ADVICE_GRASP;
use crate::experiment::Bounds;
use crate::robot::Robot;
use crate::scene::{BodyState, State};

/// How well a run kept to physics. All are the worst of the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Checks {
    /// Change of the system's linear momentum, as a fraction of the largest of any single body.
    pub linear_momentum_drift: f64,
    /// Change of the system's angular momentum about the world's origin, as a fraction of the largest of any single
    /// body.
    pub angular_momentum_drift: f64,
    /// How far the payload moved in the tool frame, m.
    pub grasp_drift_m: f64,
    /// How far it turned, rad.
    pub grasp_drift_rad: f64,
    /// Contact force minus the payload's mass times acceleration, as a fraction of the largest contact force.
    pub newton_residual: f64,
    /// Contact moment about the payload's centre of mass minus what Euler's equation asks for, as a fraction of the
    /// largest contact moment.
    pub euler_residual: f64,
}

/// Below these a momentum (N s, N m s), a force (N) or a moment (N m) is no measure for a drift.
const SMALLEST_MOMENTUM: f64 = 0.1;
const SMALLEST_WRENCH: f64 = 1.0;

/// Steps between two looks at the momentum and the grasp.
const EVERY: u64 = 10;

/// The largest deviation so far and the largest value it is a fraction of.
#[derive(Clone, Copy, Default)]
struct Ratio {
    deviation: f64,
    scale: f64,
}

impl Ratio {
    fn look(&mut self, deviation: f64, scale: f64, smallest: f64) {
        self.deviation = self.deviation.max(deviation);
        self.scale = self.scale.max(scale).max(smallest);
    }

    fn value(self) -> f64 {
        if self.scale > 0.0 {
            self.deviation / self.scale
        } else {
            0.0
        }
    }
}

/// Watches a run.
pub(crate) struct Monitor {
    bounds: Bounds,
    robot: Vec<MassProperties>,
    payload: MassProperties,
    dt: f64,
    /// At the start of the excitation.
    momentum: [Vector3<f64>; 2],
    tool_from_payload: Isometry3<f64>,
    linear: Ratio,
    angular: Ratio,
    newton: Ratio,
    euler: Ratio,
    grasp_drift_m: f64,
    grasp_drift_rad: f64,
}

impl Monitor {
    pub(crate) fn new(
        bounds: &Bounds,
        robot: &Robot,
        payload: MassProperties,
        dt: f64,
        start: &State,
        world_from_tool: &Isometry3<f64>,
    ) -> Self {
        let mut monitor = Self {
            bounds: bounds.clone(),
            robot: robot.bodies.iter().map(|body| body.mass).collect(),
            payload: MassProperties {
                center_of_mass: Vector3::zeros(),
                ..payload
            },
            dt,
            momentum: [Vector3::zeros(); 2],
            tool_from_payload: world_from_tool.inverse() * start.payload.pose,
            linear: Ratio::default(),
            angular: Ratio::default(),
            newton: Ratio::default(),
            euler: Ratio::default(),
            grasp_drift_m: 0.0,
            grasp_drift_rad: 0.0,
        };
        monitor.momentum = monitor.total_momentum(start).0;
        monitor
    }

    /// The checks so far.
    pub(crate) fn checks(&self) -> Checks {
        Checks {
            linear_momentum_drift: self.linear.value(),
            angular_momentum_drift: self.angular.value(),
            grasp_drift_m: self.grasp_drift_m,
            grasp_drift_rad: self.grasp_drift_rad,
            newton_residual: self.newton.value(),
            euler_residual: self.euler.value(),
        }
    }

    /// Looks at step `index`, which began in `before` at `time_s` and ended in `after`.
    pub(crate) fn look(
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
        self.look_at_contacts(before, after, contacts);
        if index.is_multiple_of(EVERY) {
            let ([linear, angular], [largest_linear, largest_angular]) = self.total_momentum(after);
            let [linear_0, angular_0] = self.momentum;
            let (linear, angular) = ((linear - linear_0).norm(), (angular - angular_0).norm());
            self.linear.look(linear, largest_linear, SMALLEST_MOMENTUM);
            self.angular
                .look(angular, largest_angular, SMALLEST_MOMENTUM);
            let moved = self.tool_from_payload.inverse()
                * (world_from_tool.inverse() * before.payload.pose);
            self.grasp_drift_m = self.grasp_drift_m.max(moved.translation.vector.norm());
            self.grasp_drift_rad = self.grasp_drift_rad.max(moved.rotation.angle());
        }
        self.enforce(time_s)
    }

    /// Linear and angular momentum of all bodies about the world's origin, and the largest of any single one.
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

    /// Newton and Euler of the payload alone.
    fn look_at_contacts(
        &mut self,
        before: &State,
        after: &State,
        contacts: &[Vec<ContactPoint>; 2],
    ) {
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
        let newton = self.payload.mass_kg * acceleration;
        self.newton
            .look((force - newton).norm(), force.norm(), SMALLEST_WRENCH);
        self.euler
            .look((moment - euler).norm(), moment.norm(), SMALLEST_WRENCH);
    }

    fn enforce(&self, time_s: f64) -> Result<(), SimError> {
        let (c, b) = (self.checks(), &self.bounds);
        #[rustfmt::skip] // a table
        let limits = [
            ("the payload's displacement in the grasp", c.grasp_drift_m, b.grasp_drift_m, GRASP_M),
            ("the payload's rotation in the grasp", c.grasp_drift_rad, b.grasp_drift_rad, GRASP_RAD),
            ("the drift of linear momentum", c.linear_momentum_drift, b.momentum_drift, MOMENTUM),
            ("the drift of angular momentum", c.angular_momentum_drift, b.momentum_drift, MOMENTUM),
            ("the contact force beside Newton's", c.newton_residual, b.newton_euler_residual, WRENCH),
            ("the contact moment beside Euler's", c.euler_residual, b.newton_euler_residual, WRENCH),
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

/// A field of [`Bounds`], its unit, and what helps when it is exceeded.
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

fn inertia_in_world(inertia: &Matrix3<f64>, body: &BodyState) -> Matrix3<f64> {
    let world_from_body = body.pose.rotation.to_rotation_matrix();
    world_from_body.matrix() * inertia * world_from_body.matrix().transpose()
}

/// Linear and angular momentum about the world's origin.
pub(crate) fn momentum(mass: &MassProperties, body: &BodyState) -> [Vector3<f64>; 2] {
    let center = body.pose * nalgebra::Point3::from(mass.center_of_mass);
    let linear = mass.mass_kg * body.velocity;
    let spin = inertia_in_world(&mass.inertia, body) * body.angular_velocity;
    [linear, center.coords.cross(&linear) + spin]
}
