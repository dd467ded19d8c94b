//! From a request to what is designed: every default is chosen, and every range is checked, here.

use nalgebra::Vector3;
use tactid_dynamics::{InertialParameters, Manipulator, MassProperties};
use tactid_identify::{BoundingBox, EquationSettings, values_of_body};

use crate::ExcitationError;
use crate::joint_limits::JointLimits;
use crate::problem::{BaseBounds, DURATION_S, Problem, Sensing, targets_within};
use crate::request::MotionRequest;
use crate::settings::DesignSettings;
use crate::shortest::ShortestSettings;
use crate::start::posture;
use crate::workspace_bounds::{KeepOutBox, OrientedBox};

/// Accuracy of the inertia of an expected payload, relative to its size: a plate that is given in
/// four digits is a body.
const ROUNDING_OF_INERTIA: f64 = 1e-3;

/// Default target for half of each 95 % interval, as a fraction of the largest value of its kind.
const WITHIN: f64 = 0.01;

/// Default rate of the states and of the sensors, Hz.
const RATE_HZ: f64 = 1000.0;

/// Default of the largest acceleration of a joint, rad/s² or m/s².
const ACCELERATION: f64 = 2.0;

/// Standard deviations of a wrench of which nothing is known, N and N m.
const WRENCH_NOISE: [f64; 6] = [0.5, 0.5, 0.5, 0.05, 0.05, 0.05];

/// Standard deviation of a joint effort of which nothing is known, N m or N.
const EFFORT_NOISE: f64 = 0.5;

/// A request with all that it leaves open.
#[derive(Clone, Debug)]
pub struct MotionPlan {
    /// The motion to be designed; of the shortest motion, the first that is tried. Collision shapes
    /// are still missing.
    pub problem: Problem,
    /// Settings of the design.
    pub settings: DesignSettings,
    /// Settings of the search for the shortest motion; `None` where the duration is given.
    pub shortest: Option<ShortestSettings>,
    /// Whether the links of the robot are tested for collisions.
    pub tests_collisions: bool,
    /// The ten values of the expected payload.
    pub expected_payload: [f64; 10],
    /// Target for half of each 95 % interval, as a fraction of the largest value of its kind.
    pub within: f64,
    /// Rate of the states of the motion, Hz.
    pub rate_hz: f64,
    /// Options of noise that is not given, so that a default stands for it.
    pub assumed_noise: Vec<&'static str>,
    /// The boxes around the robot, such as `the workspace` and `the keep-out box table`.
    pub surroundings: Vec<String>,
}

impl MotionRequest {
    /// Resolves a request for a robot, the link with the frame of the payload, and the equations
    /// that it is to be identified by.
    ///
    /// # Errors
    /// Returns [`ExcitationError::Identify`] with the name of an option that is out of range,
    /// [`ExcitationError::Option`] for options that do not fit each other or the robot, and
    /// [`ExcitationError::NoVelocityLimit`] for a joint without one.
    pub fn plan(
        &self,
        robot: &Manipulator,
        tip: &str,
        mut equations: EquationSettings,
    ) -> Result<MotionPlan, ExcitationError> {
        self.check()?;
        let (expected, others) = self.payloads()?;
        let within = self.within.unwrap_or(WITHIN);
        let targets = targets(&expected.into(), within)?;
        let rate_hz = self.rate.unwrap_or(RATE_HZ);
        let assumed_noise = assume_noise(&mut equations);
        let sensing = Sensing {
            sensors: self.sensors.clone().unwrap_or_else(|| vec![tip.to_owned()]),
            equations,
            rate_hz: self.sample_rate.unwrap_or(rate_hz),
            base_noise: self.base_noise,
        };
        let acceleration = self.acceleration.unwrap_or(ACCELERATION);
        let scale = self.limit_scale.unwrap_or(1.0);
        let limits = JointLimits::of_robot(robot, acceleration, scale)?;
        let start = posture(self.start.as_ref(), robot, tip)?;
        let expected_payload = values_of_body(&expected);
        let (robot, expected) = (robot.clone(), expected.into());
        let mut problem = Problem::new(robot, tip, &start, limits, sensing, expected, targets);
        self.bound(&mut problem);
        if !others.is_empty() {
            problem.payloads.extend(others);
            // With the hand that holds nothing, efforts and wrenches on a fixed base hold for all
            // bodies between the payloads.
            problem.payloads.push(InertialParameters::zero());
        }
        let settings = DesignSettings {
            seed: self.seed.unwrap_or_default(),
            ..DesignSettings::default()
        };
        let shortest = self.shortest(settings);
        problem.duration_s = match &shortest {
            Some(shortest) => DURATION_S.min(shortest.longest_s),
            None => self.duration.unwrap_or(DURATION_S),
        };
        Ok(MotionPlan {
            surroundings: surroundings(&problem),
            problem,
            settings,
            shortest,
            tests_collisions: self.collisions.unwrap_or(true),
            expected_payload,
            within,
            rate_hz,
            assumed_noise,
        })
    }

    /// Checks each range, and options that exclude each other.
    fn check(&self) -> Result<(), ExcitationError> {
        self.given().try_for_each(|given| given.check())?;
        if self.duration.is_some() && self.within.is_some() {
            let reason = "`duration` and `within` are both given: give one of them";
            return Err(option("within", reason));
        }
        let boxes = [
            ("payload_box", self.payload_box),
            ("workspace", self.workspace),
        ];
        for (name, given) in boxes {
            given.map_or(Ok(()), |given| given.check(name))?;
        }
        for (name, given) in self.keep_out.iter().flatten() {
            given
                .check("keep_out")
                .map_err(|error| option("keep_out", &format!("`keep_out` of {name}: {error}")))?;
        }
        Ok(())
    }

    /// Returns the settings of the search for the shortest motion, if one is asked for.
    fn shortest(&self, design: DesignSettings) -> Option<ShortestSettings> {
        self.within?;
        let defaults = ShortestSettings::default();
        Some(ShortestSettings {
            design,
            longest_s: self.longest.unwrap_or(defaults.longest_s),
            ..defaults
        })
    }

    /// Sets what bounds the motion beyond the limits of the joints.
    fn bound(&self, problem: &mut Problem) {
        problem.criterion = self.criterion.unwrap_or_default();
        problem.base = BaseBounds {
            attitude_rad: self.base_attitude,
            position_m: self.base_position,
        };
        problem.wrench = self.wrench_limit;
        problem.grip = self.grip;
        problem.payload_box = self.payload_box.map(oriented);
        problem.workspace.inside = self.workspace.map(oriented);
        let keep_out = self.keep_out.iter().flatten();
        let keep_out = keep_out.map(|(name, given)| KeepOutBox {
            name: name.clone(),
            place: oriented(*given),
        });
        problem.workspace.keep_out = keep_out.collect();
        if let Some(distance_m) = self.least_distance {
            problem.least_distance_m = distance_m;
        }
    }

    /// Returns the expected payload, and those with which the limits must hold, too.
    fn payloads(&self) -> Result<(MassProperties, Vec<InertialParameters>), ExcitationError> {
        let (Some(mass_kg), Some(given)) = (self.payload_mass_max, self.payload_box) else {
            if self.payload_mass_max.is_some()
                || self.payload.is_none() && self.payload_box.is_some()
            {
                return Err(missing(self.payload_box.is_none()));
            }
            let reason = "the payload is missing: give the expected one as `payload`, or its largest mass and a box";
            let expected = self.payload.ok_or_else(|| option("payload", reason))?;
            return Ok((expected, Vec::new()));
        };
        let [x, y, z] = (given.max - given.min)
            .map(|side| side * side / 12.0)
            .into();
        let half_kg = 0.5 * mass_kg;
        let even = MassProperties {
            mass_kg: half_kg,
            center_of_mass: 0.5 * (given.min + given.max),
            inertia: half_kg * nalgebra::Matrix3::from_diagonal(&Vector3::new(y + z, x + z, x + y)),
        };
        // On a fixed base, the force on a body in the box is between those on these bodies and
        // none. Its moment has second moments, too, which inside the box are smaller by up to
        // m d² / 4.
        let corner =
            |k: usize| {
                let is_high = Vector3::new(k & 4, k & 2, k & 1);
                let point = is_high.zip_zip_map(&given.min, &given.max, |is_high, low, high| {
                    if is_high > 0 { high } else { low }
                });
                MassProperties {
                    mass_kg,
                    center_of_mass: point,
                    inertia: nalgebra::Matrix3::zeros(),
                }
                .into()
            };
        Ok((self.payload.unwrap_or(even), (0..8).map(corner).collect()))
    }
}

/// Returns the error that one of the largest mass and the box is missing.
fn missing(is_box: bool) -> ExcitationError {
    let name = if is_box {
        "payload_box"
    } else {
        "payload_mass_max"
    };
    option(
        name,
        &format!("`{name}` is missing: mass and box belong together"),
    )
}

fn option(option: &'static str, what: &str) -> ExcitationError {
    ExcitationError::Option {
        option,
        what: what.to_owned(),
    }
}

fn oriented(given: BoundingBox) -> OrientedBox {
    OrientedBox::between(given.min.into(), given.max.into())
}

/// Returns the names of the boxes around the robot.
fn surroundings(problem: &Problem) -> Vec<String> {
    let workspace = problem.workspace.inside.map(|_| "the workspace".to_owned());
    let keep_out = problem.workspace.keep_out.iter();
    let keep_out = keep_out.map(|given| format!("the keep-out box {}", given.name));
    workspace.into_iter().chain(keep_out).collect()
}

/// Gives noise that the method needs and that is not known a default, and returns the names of
/// these options.
fn assume_noise(equations: &mut EquationSettings) -> Vec<&'static str> {
    let mut assumed = Vec::new();
    if equations.method.uses_wrench() && equations.wrench_noise.is_empty() {
        equations.wrench_noise = vec![WRENCH_NOISE];
        assumed.push("wrench_noise");
    }
    if equations.method.uses_effort() && equations.effort_noise.is_empty() {
        equations.effort_noise = vec![EFFORT_NOISE];
        assumed.push("effort_noise");
    }
    assumed
}

/// Returns the targets of an expected payload, which must be a body with an inertia.
fn targets(expected: &InertialParameters, within: f64) -> Result<[f64; 10], ExcitationError> {
    // A point is a payload of which the inertia is not known.
    if !expected.is_physical_within(ROUNDING_OF_INERTIA) {
        let reason = "the inertia of the expected payload is that of no body: expected a positive definite matrix whose \
                      largest principal moment is at most the sum of the others";
        return Err(option("payload", reason));
    }
    let (Some(targets), Some(body)) =
        (targets_within(expected, within), expected.mass_properties())
    else {
        return Err(option("payload", "the expected payload has no mass"));
    };
    if body.inertia.trace() <= 0.0 {
        let reason = "the inertia of the expected payload is zero, so that no precision can be a fraction of it: give an \
                      estimate of it";
        return Err(option("payload", reason));
    }
    Ok(targets)
}
