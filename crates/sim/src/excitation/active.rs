//! Active identification: the robot identifies its payload while it moves, and plans each next
//! motion from what it knows.

use nalgebra::{Isometry3, SMatrix};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_batch::{BatchIdentifier, BatchSettings};
use tactid_dynamics::{BaseKind, InertialParameters, Urdf};
use tactid_excitation::{
    ActiveSettings, BaseBounds, CollisionModel, ExcitationError, JointLimits, KeepOutBox, Motion,
    OrientedBox, Planner, Prior, PriorBound, PriorContradiction, Problem, Sensing, Step,
    Trajectory,
};
use tactid_identify::{BaseState, EquationSettings, IdentifyError, PayloadEstimate, VALUE_NAMES};

use super::Start;
use super::grip::grip;
use crate::experiment::{ActiveExcitation, BoxCorners, Noise};
use crate::sample::Sample;
use crate::{Experiment, SimError};

/// Standard deviations of a wrench that the planner assumes where the experiment has no noise, N
/// and N m: those that `tactid excite` assumes.
const ASSUMED_FORCE_N: f64 = 0.5;
const ASSUMED_MOMENT_NM: f64 = 0.05;

/// What active identification has reached.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ActiveReport {
    /// Number of motions that were planned.
    pub plans: u64,
    /// Time at which all ten 95 % intervals were found within their targets, s, when a next motion
    /// was to be planned; `None` where they were not.
    pub reached_s: Option<f64>,
    /// Value with the largest 95 % interval relative to its target.
    pub widest: String,
    /// Ratio of the half width of that interval to its target, without a unit; `None` where the
    /// value is not known at all.
    pub interval_ratio: Option<f64>,
    /// Whether planning ended early, because several plans in a row did not make the widest
    /// interval smaller.
    pub out_of_reach: bool,
    /// Limit that binds the last plan, where planning ended early.
    pub binding: Option<String>,
    /// Bounds of the payload that its estimate contradicts. Planning ends with the first.
    pub contradictions: Vec<ActiveContradiction>,
    /// Shapes of the robot that are not tested for collisions, with the reason; none where
    /// collisions are not tested at all.
    #[serde(default)]
    pub untested_shapes: Vec<String>,
}

/// A bound of the payload that the estimate contradicts: motions may have exceeded their limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ActiveContradiction {
    /// The bound's place in the table `excitation.active` of the experiment, such as `mass_kg[1]`.
    pub field: String,
    /// Value of the bound, kg or m.
    pub bound: f64,
    /// Estimate of what it bounds, kg or m.
    pub estimate: f64,
    /// Standard deviation of that estimate, kg or m.
    pub std_dev: f64,
}

impl From<PriorContradiction> for ActiveContradiction {
    fn from(found: PriorContradiction) -> Self {
        let field = match found.bound {
            PriorBound::LeastMass => "mass_kg[0]",
            PriorBound::LargestMass => "mass_kg[1]",
            PriorBound::CenterOfMass => "center_of_mass_m",
            PriorBound::HalfDiagonal => "half_diagonal_m",
        };
        Self {
            field: field.to_owned(),
            bound: found.bound_value,
            estimate: found.estimate,
            std_dev: found.std_dev,
        }
    }
}

/// Planner and identifier of an arm, and the motion that it follows.
pub(super) struct ActiveControl {
    planner: Planner,
    prior: Prior,
    identifier: BatchIdentifier,
    /// Index in the robot's joints of each joint of the arm.
    arm: Vec<usize>,
    /// Positions of the robot's joints where no motion is planned for them, rad or m.
    posture: Vec<f64>,
    /// Pose of the base link at the start, in the world frame; `None` for a fixed base.
    start: Option<Isometry3<f64>>,
    /// Measured pose of the base relative to the start.
    base: Isometry3<f64>,
    /// The motion that the arm follows, and the time at which it begins, s.
    motion: Option<(f64, Trajectory)>,
    plans: u64,
    reached_s: Option<f64>,
    out_of_reach: bool,
    is_contradicted: bool,
    binding: Option<String>,
    untested_shapes: Vec<String>,
    dt: f64,
}

impl ActiveControl {
    /// Creates the control of an experiment's arm that holds its payload at rest.
    ///
    /// # Errors
    /// Returns [`SimError::Robot`] or [`SimError::Planning`] if no motion of the arm can be
    /// planned.
    pub(super) fn new(experiment: &Experiment, start: &Start<'_>) -> Result<Self, SimError> {
        let settings = experiment.excitation.active.clone().unwrap_or_default();
        let problem = problem(experiment, &settings, start)?;
        let sensors: Vec<&str> = problem.sensing.sensors.iter().map(String::as_str).collect();
        let identifier = BatchIdentifier::new(
            &problem.robot,
            &problem.tool,
            &sensors,
            problem.sensing.equations.clone(),
            BatchSettings::default(),
        )
        .map_err(planning)?;
        let findings = problem.collisions.iter().flat_map(CollisionModel::findings);
        let untested_shapes = findings.map(ToString::to_string).collect();
        let base = &start.robot.links[0];
        let start_pose = start.state.bodies[0].pose * base.body_from_link;
        let prior = Prior {
            mass_kg: settings.mass_kg.into(),
            center_of_mass_m: settings.center_of_mass_m,
            half_diagonal_m: settings.half_diagonal_m,
        };
        let joints = 0..problem.robot.dof();
        let velocity_noise = joints.map(|joint| experiment.noise.joint_velocity_rad_s.of(joint));
        let active = ActiveSettings {
            within: settings.within,
            seed: experiment.seed,
            velocity_noise: velocity_noise.collect(),
            ..ActiveSettings::default()
        };
        Ok(Self {
            identifier,
            arm: start.roles.arm.iter().map(|body| body - 1).collect(),
            posture: problem.start.clone(),
            start: (start.robot.base == BaseKind::Floating).then_some(start_pose),
            base: Isometry3::identity(),
            planner: Planner::new(problem, prior, active).map_err(planning)?,
            prior,
            motion: None,
            plans: 0,
            reached_s: None,
            out_of_reach: false,
            is_contradicted: false,
            binding: None,
            untested_shapes,
            dt: experiment.step_s,
        })
    }

    /// Returns whether further motions are planned.
    fn is_planning(&self) -> bool {
        self.reached_s.is_none() && !self.out_of_reach && !self.is_contradicted
    }

    /// Plans the next motion if the present one has been followed for as long as it is to be.
    pub(super) fn plan_if_due(&mut self, time_s: f64) -> Result<(), SimError> {
        let begins_s = self.plans as f64 * self.planner.followed_s();
        // Times are multiples of the step up to rounding.
        if !self.is_planning() || time_s < begins_s - 1e-6 * self.dt {
            return Ok(());
        }
        let (estimate, covariance) = self.estimate()?;
        let step = self
            .planner
            .plan(&estimate, covariance.as_ref(), &self.base)
            .map_err(planning)?;
        match step {
            Step::Move(motion) => {
                self.motion = Some((begins_s, motion));
                self.plans += 1;
            }
            Step::Reached => self.reached_s = Some(time_s),
            Step::OutOfReach { binding, .. } => {
                self.out_of_reach = true;
                self.binding = binding.map(|limit| limit.to_string());
            }
            Step::Contradicted(_) => self.is_contradicted = true,
        }
        Ok(())
    }

    /// Returns the position of a joint of the arm, rad or m.
    pub(super) fn position(&self, joint: usize, time_s: f64) -> f64 {
        let joint = self.arm[joint];
        let planned = self.motion.as_ref().and_then(|(begins_s, motion)| {
            let mut splines = motion.splines();
            let (_, spline) = splines.find(|(of, _)| *of == joint)?;
            let [position, ..] = spline.at(time_s - begins_s);
            Some(position)
        });
        planned.unwrap_or(self.posture[joint])
    }

    /// Identifies the payload from one sample more.
    pub(super) fn observe(&mut self, sample: &Sample) -> Result<(), SimError> {
        let mut base = BaseState::fixed();
        if let Some(start) = &self.start {
            self.base = start.inverse() * sample.base.pose;
            base.pose = sample.base.pose;
            base.velocity = sample.base.velocity;
            base.angular_velocity = sample.base.angular_velocity;
        }
        let measured = tactid_identify::Sample {
            time_s: sample.time_s,
            base,
            joint_position: &sample.joint_position,
            joint_velocity: &sample.joint_velocity,
            joint_effort: &[],
            wrenches: &sample.fingers.each_ref().map(|finger| finger.wrench),
        };
        self.identifier.push(&measured).map_err(planning)?;
        Ok(())
    }

    /// Returns the estimate from all samples so far, as an identification of the log up to here has
    /// it, and its covariance; `None` where the samples do not determine all values.
    fn estimate(&self) -> Result<(PayloadEstimate, Option<SMatrix<f64, 10, 10>>), SimError> {
        let result = match self.identifier.solve() {
            Ok(result) => result,
            Err(IdentifyError::TooLittle(_)) => return Ok((self.identifier.unknown(), None)),
            Err(error) => return Err(planning(error)),
        };
        let std_devs = result.estimate.std_devs;
        let is_known = std_devs.iter().all(|std_dev| std_dev.is_finite());
        let covariance = is_known.then_some(result.linear.covariance);
        Ok((result.estimate, covariance))
    }

    /// Returns whether nothing more is planned and the last motion is at its end.
    pub(super) fn is_finished(&self, time_s: f64) -> bool {
        let end_s = |(begins_s, motion): &(f64, Trajectory)| begins_s + motion.duration_s();
        let end_s = self.motion.as_ref().map_or(0.0, end_s);
        !self.is_planning() && time_s >= end_s - 1e-6 * self.dt
    }

    /// Returns what all samples so far have determined.
    pub(super) fn report(&self) -> ActiveReport {
        let estimate = self.estimate();
        let (estimate, covariance) = estimate.unwrap_or_else(|_| (self.identifier.unknown(), None));
        let body = InertialParameters::from(estimate.body);
        let contradictions = covariance
            .map(|covariance| self.prior.contradictions(&body, &covariance))
            .unwrap_or_default();
        let (widest, ratio) = self.planner.largest_ratio(&estimate);
        ActiveReport {
            plans: self.plans,
            reached_s: self.reached_s,
            widest: VALUE_NAMES[widest].to_owned(),
            interval_ratio: ratio.is_finite().then_some(ratio),
            out_of_reach: self.out_of_reach,
            binding: self.binding.clone(),
            contradictions: contradictions.into_iter().map(Into::into).collect(),
            untested_shapes: self.untested_shapes.clone(),
        }
    }
}

/// Returns the problem of the planner: what the arm measures and what limits its motion.
fn problem(
    experiment: &Experiment,
    settings: &ActiveExcitation,
    start: &Start<'_>,
) -> Result<Problem, SimError> {
    let (robot, roles) = (start.robot, start.roles);
    let urdf = Urdf::from_xml(&robot.urdf)?;
    let model = urdf.manipulator(robot.base)?;
    let limits =
        JointLimits::of_robot(&model, settings.acceleration_rad_s2, 1.0).map_err(planning)?;
    let sensing = sensing(experiment, settings, start);
    let world_from_tool = start.state.bodies[roles.tool.body].pose * roles.tool.body_from_link;
    let friction = (
        start.grip_force_n,
        experiment.gripper.friction,
        settings.friction_used,
    );
    let posture = &start.state.joint_position;
    let tool = &experiment.robot.tool;
    // The planner replaces payload and targets by its prior's.
    let payload = experiment.payload.mass_properties().into();
    let mut problem = Problem::new(model, tool, posture, limits, sensing, payload, [1.0; 10]);
    problem.grip = Some(grip(start.contacts, &world_from_tool, friction)?);
    problem.base = BaseBounds {
        attitude_rad: settings.base_attitude_deg.map(f64::to_radians),
        position_m: settings.base_position_m,
    };
    if settings.collisions {
        let not_read = &mut |_: &str| Err("the simulation reads no meshes".to_owned());
        let shapes = CollisionModel::of_urdf(&urdf, &problem.robot, not_read);
        // A simulated collision harms nobody, and the report names the shapes that are not tested.
        problem.collisions = Some(shapes.map_err(planning)?.accepting_untested());
    }
    let between = |[low, high]: BoxCorners| OrientedBox::between(low, high);
    problem.payload_box = settings.payload_box_m.map(between);
    problem.workspace.inside = settings.workspace_m.map(between);
    let keep_out = settings
        .keep_out_m
        .iter()
        .map(|(name, &corners)| KeepOutBox {
            name: name.clone(),
            place: between(corners),
        });
    problem.workspace.keep_out = keep_out.collect();
    Ok(problem)
}

/// Returns what the fingers measure.
fn sensing(experiment: &Experiment, settings: &ActiveExcitation, start: &Start<'_>) -> Sensing {
    let (robot, roles) = (start.robot, start.roles);
    Sensing {
        sensors: roles
            .fingers
            .map(|body| robot.moved_link(body).to_owned())
            .to_vec(),
        equations: EquationSettings {
            gravity: Some(experiment.gravity()),
            cutoff_hz: settings.cutoff_hz,
            wrench_noise: [0, 1]
                .map(|finger| wrench_noise(&experiment.noise, finger))
                .to_vec(),
            ..EquationSettings::default()
        },
        rate_hz: experiment.step_s.recip(),
        base_noise: None,
    }
}

/// Returns standard deviations of the wrench of a finger, 0 or 1: three forces, N, and moments, N
/// m.
fn wrench_noise(noise: &Noise, finger: usize) -> [f64; 6] {
    let assumed = |std_dev: f64, assumed: f64| if std_dev > 0.0 { std_dev } else { assumed };
    std::array::from_fn(|k| match k {
        0..3 => assumed(noise.finger_force_n.of(3 * finger + k), ASSUMED_FORCE_N),
        _ => assumed(
            noise.finger_moment_nm.of(3 * finger + k - 3),
            ASSUMED_MOMENT_NM,
        ),
    })
}

/// Returns the error of a motion that cannot be planned, in terms of the experiment.
fn planning(error: impl Into<ExcitationError>) -> SimError {
    match error.into() {
        ExcitationError::NoVelocityLimit { joint } => SimError::Robot(format!(
            "joint `{joint}` has no positive velocity limit in the URDF, which a planned motion needs"
        )),
        error => SimError::Planning(error),
    }
}
