//! A robot that holds a payload and moves as planned, exactly but for the noise of its sensors.

use std::error::Error;
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::{SeedableRng, rngs::StdRng};
use rand_distr::{Distribution, StandardNormal};
use tactid_dynamics::{
    BaseKind, FrameId, FrameMotion, InertialParameters, Workspace, free_base_motion,
    inverse_dynamics, wrench_regressor,
};
use tactid_excitation::{JointStates, Motion, Planner, Problem, Step, Trajectory};
use tactid_identify::{BaseState, Identifier, Sample, Wrench};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Standard deviations of the white noise of one sample.
#[derive(Clone, Debug)]
pub(crate) struct Noise {
    /// Positions of the joints, rad or m.
    pub(crate) position: Vec<f64>,
    /// Velocities of the joints, rad/s or m/s.
    pub(crate) velocity: Vec<f64>,
    /// Rotation of the base as a vector, rad, and its position, m.
    pub(crate) pose: [f64; 6],
    /// Angular velocity, rad/s, and velocity of the base, m/s.
    pub(crate) twist: [f64; 6],
    /// Force, N, and moment, N m.
    pub(crate) wrench: [f64; 6],
}

/// Motions that follow one another, each until the next begins.
#[derive(Clone, Debug)]
pub(crate) struct Followed {
    segments: Vec<(f64, Trajectory)>,
}

impl Motion for Followed {
    fn duration_s(&self) -> f64 {
        self.segments
            .last()
            .map_or(0.0, |(start_s, last)| start_s + last.duration_s())
    }

    fn at(&self, time_s: f64) -> JointStates {
        let begun = self
            .segments
            .iter()
            .rev()
            .find(|(start_s, _)| *start_s <= time_s + 1e-9);
        let (start_s, motion) = begun.unwrap_or(&self.segments[0]);
        motion.at(time_s - start_s)
    }
}

/// The robot with its true payload.
pub(crate) struct Robot {
    workspace: Workspace,
    tool: FrameId,
    floats: bool,
    gravity: Vector3<f64>,
    payload: InertialParameters,
    base: FrameMotion,
    step_s: f64,
}

/// What sensors without noise measure.
#[derive(Clone, Debug)]
pub(crate) struct Exact {
    states: JointStates,
    base: FrameMotion,
    wrench: [f64; 6],
}

impl Robot {
    pub(crate) fn new(problem: &Problem, payload: &InertialParameters) -> Result<Self> {
        let tool = problem.robot.frame(&problem.tool)?;
        let kind = problem.robot.base_kind();
        Ok(Self {
            workspace: Workspace::new(&problem.robot.with_payload(tool, payload)),
            tool,
            floats: kind == BaseKind::Floating,
            gravity: problem.sensing.equations.gravity_for(kind),
            payload: *payload,
            base: FrameMotion::at_rest(Isometry3::identity()),
            step_s: problem.sensing.rate_hz.recip(),
        })
    }

    /// Moves the joints to the states of the next sample, and the base as momentum demands.
    pub(crate) fn step(&mut self, states: JointStates) -> Result<Exact> {
        if self.floats {
            let pose = self.base.pose;
            self.base = free_base_motion(&mut self.workspace, &pose, states.joints())?;
        } else {
            inverse_dynamics(
                &mut self.workspace,
                &self.base,
                states.joints(),
                &self.gravity,
            )?;
        }
        let regressor = wrench_regressor(&self.workspace.tool_motion(self.tool, &self.gravity));
        let wrench = regressor * self.payload.as_vector();
        let exact = Exact {
            states,
            base: self.base,
            wrench: wrench.into(),
        };
        if self.floats {
            let half = 0.5 * self.step_s * self.step_s;
            let base = &self.base;
            let turn = base.angular_velocity * self.step_s + base.angular_acceleration * half;
            let shift = base.velocity * self.step_s + base.acceleration * half;
            self.base.pose = Isometry3::from_parts(
                (base.pose.translation.vector + shift).into(),
                UnitQuaternion::from_scaled_axis(turn) * base.pose.rotation,
            );
        }
        Ok(exact)
    }
}

impl Noise {
    /// Returns no noise for so many joints.
    pub(crate) fn none(joints: usize) -> Self {
        Self {
            position: vec![0.0; joints],
            velocity: vec![0.0; joints],
            pose: [0.0; 6],
            twist: [0.0; 6],
            wrench: [0.0; 6],
        }
    }

    /// Returns a fraction of each channel's peak along a motion: without signal there is no noise.
    pub(crate) fn of_peaks(
        fraction: f64,
        problem: &Problem,
        payload: &InertialParameters,
        motion: &dyn Motion,
    ) -> Result<Self> {
        let mut robot = Robot::new(problem, payload)?;
        let mut peaks = Self::none(problem.robot.dof());
        let raise = |peaks: &mut [f64], values: &[f64]| {
            for (peak, value) in peaks.iter_mut().zip(values) {
                *peak = peak.max(value.abs());
            }
        };
        for k in 0..=(motion.duration_s() * problem.sensing.rate_hz) as usize {
            let exact = robot.step(motion.at(k as f64 * robot.step_s))?;
            let moved = exact.states.position.iter().zip(&problem.start);
            let moved: Vec<f64> = moved.map(|(position, start)| position - start).collect();
            raise(&mut peaks.position, &moved);
            raise(&mut peaks.velocity, &exact.states.velocity);
            let pose = &exact.base.pose;
            let turn = pose.rotation.scaled_axis();
            raise(&mut peaks.pose[..3], turn.as_slice());
            raise(&mut peaks.pose[3..], pose.translation.vector.as_slice());
            raise(
                &mut peaks.twist[..3],
                exact.base.angular_velocity.as_slice(),
            );
            raise(&mut peaks.twist[3..], exact.base.velocity.as_slice());
            raise(&mut peaks.wrench, &exact.wrench);
        }
        let all = [
            peaks.position.as_mut_slice(),
            &mut peaks.velocity,
            &mut peaks.pose,
            &mut peaks.twist,
            &mut peaks.wrench,
        ];
        all.into_iter().flatten().for_each(|peak| *peak *= fraction);
        Ok(peaks)
    }
}

/// A control loop: the identifier gets a sample in each cycle.
pub(crate) struct Loop<'a> {
    problem: &'a Problem,
    robot: Robot,
    noise: &'a Noise,
    random: StdRng,
    pub(crate) identifier: Identifier,
    samples: u64,
    base: Isometry3<f64>,
}

impl<'a> Loop<'a> {
    pub(crate) fn new(
        problem: &'a Problem,
        payload: &InertialParameters,
        noise: &'a Noise,
        seed: u64,
    ) -> Result<Self> {
        let sensing = &problem.sensing;
        let sensors: Vec<&str> = sensing.sensors.iter().map(String::as_str).collect();
        let (robot, tool) = (&problem.robot, &problem.tool);
        Ok(Self {
            robot: Robot::new(problem, payload)?,
            noise,
            random: StdRng::seed_from_u64(seed),
            identifier: Identifier::new(robot, tool, &sensors, &sensing.equations)?,
            samples: 0,
            base: Isometry3::identity(),
            problem,
        })
    }

    /// Time of the next sample, s.
    pub(crate) fn time_s(&self) -> f64 {
        self.samples as f64 / self.problem.sensing.rate_hz
    }

    /// Measures one sample of a motion.
    pub(crate) fn cycle(&mut self, motion: &dyn Motion) -> Result<()> {
        let time_s = self.time_s();
        self.samples += 1;
        let mut exact = self.robot.step(motion.at(time_s))?;
        let Self { random, noise, .. } = self;
        let mut add = |values: &mut [f64], std_devs: &[f64]| {
            for (value, std_dev) in values.iter_mut().zip(std_devs) {
                let normal: f64 = StandardNormal.sample(random);
                *value += std_dev * normal;
            }
        };
        add(&mut exact.states.position, &noise.position);
        add(&mut exact.states.velocity, &noise.velocity);
        add(&mut exact.wrench, &noise.wrench);
        let mut base = BaseState::fixed();
        if self.robot.floats {
            let (mut turn, mut shift) = (Vector3::zeros(), exact.base.pose.translation.vector);
            add(turn.as_mut_slice(), &noise.pose[..3]);
            add(shift.as_mut_slice(), &noise.pose[3..]);
            add(
                exact.base.angular_velocity.as_mut_slice(),
                &noise.twist[..3],
            );
            add(exact.base.velocity.as_mut_slice(), &noise.twist[3..]);
            let rotation = UnitQuaternion::from_scaled_axis(turn) * exact.base.pose.rotation;
            base.pose = Isometry3::from_parts(shift.into(), rotation);
            base.velocity = exact.base.velocity;
            base.angular_velocity = exact.base.angular_velocity;
        }
        self.base = base.pose;
        let [fx, fy, fz, nx, ny, nz] = exact.wrench;
        let wrench = Wrench {
            force: [fx, fy, fz].into(),
            moment: [nx, ny, nz].into(),
        };
        self.identifier.push(&Sample {
            time_s,
            base,
            joint_position: &exact.states.position,
            joint_velocity: &exact.states.velocity,
            joint_effort: &[],
            wrenches: &[wrench],
        })?;
        Ok(())
    }
}

/// What active identification did.
#[derive(Debug)]
pub(crate) struct Outcome {
    /// Time at which all intervals were within their targets, s.
    pub(crate) reached_s: Option<f64>,
    /// Largest ratio of an interval to its target at the beginning of each plan.
    pub(crate) ratios: Vec<f64>,
    /// Time that each plan took.
    pub(crate) plans: Vec<Duration>,
    /// The whole motion.
    pub(crate) motion: Followed,
    /// The ten values at the end.
    pub(crate) values: [f64; 10],
    /// Why it ended without the targets.
    pub(crate) failure: Option<String>,
}

/// Identifies a payload with a planner, for at most so long.
pub(crate) fn identify(
    cycles: &mut Loop<'_>,
    planner: &mut Planner,
    longest_s: f64,
) -> Result<Outcome> {
    let mut motion = Followed {
        segments: Vec::new(),
    };
    let mut outcome = Outcome {
        reached_s: None,
        ratios: Vec::new(),
        plans: Vec::new(),
        motion: motion.clone(),
        values: [0.0; 10],
        failure: None,
    };
    let followed = (planner.followed_s() * cycles.problem.sensing.rate_hz).round() as usize;
    'plans: while cycles.time_s() < longest_s {
        let estimate = cycles.identifier.estimate();
        outcome.ratios.push(planner.largest_ratio(&estimate).1);
        let covariance = cycles.identifier.covariance();
        let began = Instant::now();
        let step = planner.plan(&estimate, covariance.as_ref(), &cycles.base)?;
        outcome.plans.push(began.elapsed());
        match step {
            Step::Move(next) => motion.segments.push((cycles.time_s(), next)),
            Step::Reached => break,
            Step::Contradicted(found) => {
                outcome.failure = Some(format!("{found:?}"));
                break;
            }
            Step::OutOfReach {
                value,
                ratio,
                binding,
            } => {
                outcome.failure = Some(format!("{value} {ratio:.2} {binding:?}"));
                break;
            }
        }
        for _ in 0..followed {
            cycles.cycle(&motion)?;
            if planner.largest_ratio(&cycles.identifier.estimate()).1 <= 1.0 {
                outcome.reached_s = Some(cycles.time_s());
                break 'plans;
            }
        }
    }
    outcome.values = cycles.identifier.estimate().values();
    outcome.motion = motion;
    Ok(outcome)
}
