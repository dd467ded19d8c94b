//! Computations for many states at once, in the lanes of a register, by the same recursion as one.

use nalgebra::{SMatrix, Vector3};

use crate::lanes::{FourLanes, Lanes, MOST_LANES, Register};
use crate::placement::FixedFrame;
use crate::recursion::{
    BaseMotion, BodyModel, BodyState, JointModel, JointState, JointStates, JointTorques, inward,
    outward,
};
use crate::rows::regressor_entries;
use crate::vector::{Mat3, Vec3};
use crate::{FrameId, FrameMotion, JointMotion, Manipulator, StateError};

/// States of a robot, one after another.
///
/// Each part has an entry for each state, or one entry that holds for all of them.
#[derive(Clone, Copy, Debug)]
pub struct StateSeries<'a> {
    /// Motion of the base frame.
    pub base: &'a [FrameMotion],
    /// Joints: the entries of a state are contiguous, in the order of [`Manipulator::joint_names`].
    pub joints: JointMotion<'a>,
}

/// The vector unit of a processor.
#[derive(Clone, Copy, Debug)]
pub enum VectorUnit {
    /// The widest of the processor: eight lanes of AVX-512, four of AVX2, two of NEON, with fused
    /// products, or the baseline.
    Widest,
    /// Four lanes of what every processor has, such as SSE2: results do not depend on it.
    Baseline,
}

/// Batched dynamics: computations for many states of a [`Manipulator`] at once, a [`StateSeries`].
///
/// A computation takes its states two, four or eight at a time. Results agree with the results of a
/// [`Workspace`](crate::Workspace) to rounding and not bit by bit, because some processors round a
/// product and a sum once. Each call allocates one register for each entry of the bodies' states; a
/// control loop, which has one state at a time, uses a [`Workspace`](crate::Workspace), which
/// allocates nothing.
///
/// ```
/// # use nalgebra::{Isometry3, Vector3};
/// # use tactid_dynamics::*;
/// # let urdf = r#"<robot name="pendulum">
/// #   <link name="base"/>
/// #   <link name="arm"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
/// #     <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
/// #   <joint name="hinge" type="continuous">
/// #     <parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint>
/// # </robot>"#;
/// # let robot = Manipulator::from_urdf(urdf, BaseKind::Fixed)?;
/// let states = StateSeries {
///     base: &[FrameMotion::at_rest(Isometry3::identity())],
///     joints: JointMotion { position: &[0.0, 3.0, 0.5], velocity: &[0.0], acceleration: &[0.0] },
/// };
/// let (mut torques, mut base_wrenches) = ([0.0; 3], [[0.0; 6]; 3]);
/// let gravity = Vector3::new(0.0, 0.0, -9.81);
/// BatchDynamics::new(&robot).inverse_dynamics(&states, &gravity, &mut torques, &mut base_wrenches)?;
/// assert!((torques[0] + 2.0 * 9.81 * 0.5).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct BatchDynamics {
    bodies: Vec<BodyModel>,
    frames: Vec<FixedFrame>,
    robot: Manipulator,
    /// Instructions to compute with; `Scalar` stands for the baseline.
    arch: pulp::Arch,
}

impl BatchDynamics {
    /// Computes the constants of a robot, for the widest vector unit.
    #[must_use]
    pub fn new(robot: &Manipulator) -> Self {
        let bodies = BodyModel::of_bodies(&robot.bodies);
        Self {
            frames: FixedFrame::of_links(&robot.links, &bodies),
            bodies,
            robot: robot.clone(),
            arch: pulp::Arch::new(),
        }
    }

    /// Returns the same computations on another vector unit.
    #[must_use]
    pub fn with_unit(self, unit: VectorUnit) -> Self {
        let arch = match unit {
            VectorUnit::Widest => pulp::Arch::new(),
            VectorUnit::Baseline => pulp::Arch::Scalar,
        };
        Self { arch, ..self }
    }

    /// Computes the joint torques and the wrench on the base of each state, as
    /// [`inverse_dynamics`](crate::inverse_dynamics()) does: in `torques` one entry for each joint,
    /// state after state, and in `base_wrenches` force and moment of
    /// [`Workspace::base_wrench`](crate::Workspace::base_wrench). There are as many states as base
    /// wrenches.
    ///
    /// # Errors
    /// Returns [`StateError::Series`] if a part of `states`, or `torques`, has another length.
    pub fn inverse_dynamics(
        &self,
        states: &StateSeries<'_>,
        gravity: &Vector3<f64>,
        torques: &mut [f64],
        base_wrenches: &mut [[f64; 6]],
    ) -> Result<(), StateError> {
        let count = base_wrenches.len();
        let strides = Strides::new(states, self.robot.dof(), count)?;
        check_series("the torques", torques.len(), self.robot.dof(), count)?;
        self.dispatch(InverseDynamics {
            bodies: &self.bodies,
            source: Source {
                states,
                strides,
                gravity,
                count,
            },
            torques,
            base_wrenches,
        });
        Ok(())
    }

    /// Computes the regressor of the wrench on a body that is fixed to a frame for each state: the
    /// [`wrench_regressor`](crate::wrench_regressor) of the frame's motion. Only the bodies above
    /// the frame are moved. There are as many states as regressors.
    ///
    /// # Errors
    /// Returns [`StateError::Series`] if a part of `states` has another length.
    pub fn wrench_regressors(
        &self,
        frame: FrameId,
        states: &StateSeries<'_>,
        gravity: &Vector3<f64>,
        regressors: &mut [SMatrix<f64, 6, 10>],
    ) -> Result<(), StateError> {
        let count = regressors.len();
        let strides = Strides::new(states, self.robot.dof(), count)?;
        let frame = &self.frames[self.robot.position(frame)];
        self.dispatch(WrenchRegressors {
            bodies: &chain_to(&self.bodies, frame.body),
            frame,
            source: Source {
                states,
                strides,
                gravity,
                count,
            },
            regressors,
        });
        Ok(())
    }

    /// Runs a computation on the vector unit.
    fn dispatch<C: Computation>(&self, computation: C) {
        match self.arch {
            pulp::Arch::Scalar => computation.run(FourLanes::ZERO),
            arch => arch.dispatch(OnUnit(computation)),
        }
    }
}

/// Returns the bodies from the base to one body, in which each body follows its parent.
fn chain_to(bodies: &[BodyModel], last: usize) -> Vec<BodyModel> {
    let above = |&index: &usize| (index > 0).then(|| bodies[index].parent);
    let mut chain: Vec<BodyModel> = std::iter::successors(Some(last), above)
        .map(|index| bodies[index].clone())
        .collect();
    chain.reverse();
    let count = chain.len();
    for (place, body) in chain.iter_mut().enumerate() {
        (body.parent, body.end) = (place.saturating_sub(1), count);
    }
    chain
}

/// A computation for the lanes of any vector unit.
trait Computation {
    fn run<T: Lanes>(self, zero: T);
}

/// Lets pulp compile a computation for each vector unit.
struct OnUnit<C>(C);

impl<C: Computation> pulp::WithSimd for OnUnit<C> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        self.0.run(Register::zero(simd));
    }
}

/// Distance between the entries of neighbouring states: zero where one entry holds for all.
#[derive(Clone, Copy)]
struct Strides {
    base: usize,
    position: usize,
    velocity: usize,
    acceleration: usize,
}

impl Strides {
    fn new(states: &StateSeries<'_>, dof: usize, count: usize) -> Result<Self, StateError> {
        let stride = |what, given: usize, each: usize| {
            if given == each && count != 1 {
                return Ok(0);
            }
            check_series(what, given, each, count).map(|()| each)
        };
        let joints = &states.joints;
        Ok(Self {
            base: stride("the base", states.base.len(), 1)?,
            position: stride("position", joints.position.len(), dof)?,
            velocity: stride("velocity", joints.velocity.len(), dof)?,
            acceleration: stride("acceleration", joints.acceleration.len(), dof)?,
        })
    }
}

fn check_series(
    what: &'static str,
    given: usize,
    each: usize,
    count: usize,
) -> Result<(), StateError> {
    if given == each * count {
        return Ok(());
    }
    Err(StateError::Series {
        what,
        given,
        each,
        count,
    })
}

/// States of a computation, with the distances between their entries.
#[derive(Clone, Copy)]
struct Source<'a> {
    states: &'a StateSeries<'a>,
    strides: Strides,
    gravity: &'a Vector3<f64>,
    count: usize,
}

impl Source<'_> {
    /// Returns the numbers of the states in the lanes from `first` on. Later lanes repeat the last.
    #[inline(always)]
    fn lanes<T: Lanes>(&self, zero: T, first: usize, at: impl Fn(usize) -> f64) -> T {
        let mut numbers = [0.0; MOST_LANES];
        for (lane, number) in numbers[..T::COUNT].iter_mut().enumerate() {
            *number = at((first + lane).min(self.count - 1));
        }
        zero.read(&numbers)
    }

    /// Returns the motion of the base in the lanes from `first` on.
    #[inline(always)]
    fn base<T: Lanes>(&self, zero: T, first: usize) -> BaseMotion<T> {
        if self.strides.base == 0 {
            return BaseMotion::splat(zero, &BaseMotion::new(&self.states.base[0], self.gravity));
        }
        let mut all = [BaseMotion::<f64>::new(&self.states.base[first], self.gravity); MOST_LANES];
        for (lane, base) in all[..T::COUNT].iter_mut().enumerate().skip(1) {
            let state = (first + lane).min(self.count - 1);
            *base = BaseMotion::new(&self.states.base[state], self.gravity);
        }
        let mut numbers = [[0.0; MOST_LANES]; 21];
        for (lane, base) in all.iter().enumerate() {
            let vectors = [
                &base.rotation.0[0],
                &base.rotation.0[1],
                &base.rotation.0[2],
                &base.position.0,
                &base.angular_velocity.0,
                &base.angular_acceleration.0,
                &base.acceleration.0,
            ];
            for (numbers, entry) in numbers.iter_mut().zip(vectors.into_iter().flatten()) {
                numbers[lane] = *entry;
            }
        }
        BaseMotion {
            rotation: Mat3([
                read_vector(zero, &numbers, 0).0,
                read_vector(zero, &numbers, 3).0,
                read_vector(zero, &numbers, 6).0,
            ]),
            position: read_vector(zero, &numbers, 9),
            angular_velocity: read_vector(zero, &numbers, 12),
            angular_acceleration: read_vector(zero, &numbers, 15),
            acceleration: read_vector(zero, &numbers, 18),
        }
    }

    /// Moves the bodies in the lanes from `first` on.
    #[inline(always)]
    fn move_bodies<T: Lanes>(
        &self,
        bodies: &[BodyModel],
        states: &mut [BodyState<T>],
        zero: T,
        first: usize,
    ) {
        let base = self.base(zero, first);
        let joints = JointLanes {
            source: self,
            zero,
            first,
        };
        outward(bodies, states, &base, &joints);
    }
}

/// Returns the lanes of three successive entries.
#[inline(always)]
fn read_vector<T: Lanes>(zero: T, numbers: &[[f64; MOST_LANES]; 21], at: usize) -> Vec3<T> {
    Vec3([
        zero.read(&numbers[at]),
        zero.read(&numbers[at + 1]),
        zero.read(&numbers[at + 2]),
    ])
}

/// The states of the joints in the lanes from `first` on.
struct JointLanes<'a, T> {
    source: &'a Source<'a>,
    zero: T,
    first: usize,
}

impl<T: Lanes> JointStates<T> for JointLanes<'_, T> {
    #[inline(always)]
    fn state(&self, joint: &JointModel) -> JointState<T> {
        let (source, zero, first) = (self.source, self.zero, self.first);
        let (values, strides) = (&source.states.joints, &source.strides);
        let at = joint.coordinate;
        let position =
            |state: usize| joint.position(values.position[state * strides.position + at]);
        let velocity = |state: usize| values.velocity[state * strides.velocity + at];
        let acceleration = |state: usize| values.acceleration[state * strides.acceleration + at];
        JointState {
            position: source.lanes(zero, first, position),
            velocity: source.lanes(zero, first, velocity) * joint.ratio,
            acceleration: source.lanes(zero, first, acceleration) * joint.ratio,
        }
    }
}

/// The torques of the joints, a register for each.
struct TorqueLanes<T> {
    zero: T,
    numbers: Vec<[f64; MOST_LANES]>,
}

impl<T: Lanes> JointTorques<T> for TorqueLanes<T> {
    #[inline(always)]
    fn add(&mut self, joint: &JointModel, torque: T) {
        let sum = &mut self.numbers[joint.coordinate];
        (self.zero.read(sum) + torque * joint.ratio).write(sum);
    }
}

/// Calls `write` with each lane that belongs to a state, and the state.
#[inline(always)]
fn each_lane<T: Lanes>(first: usize, count: usize, mut write: impl FnMut(usize, usize)) {
    for lane in 0..T::COUNT.min(count - first) {
        write(lane, first + lane);
    }
}

struct InverseDynamics<'a> {
    bodies: &'a [BodyModel],
    source: Source<'a>,
    torques: &'a mut [f64],
    base_wrenches: &'a mut [[f64; 6]],
}

impl Computation for InverseDynamics<'_> {
    #[inline(always)]
    fn run<T: Lanes>(self, zero: T) {
        let count = self.source.count;
        let mut states = vec![BodyState::at_rest(zero); self.bodies.len()];
        let dof = self.torques.len().checked_div(count).unwrap_or(0);
        let numbers = vec![[0.0; MOST_LANES]; dof];
        let mut torques = TorqueLanes { zero, numbers };
        for first in (0..count).step_by(T::COUNT) {
            self.source
                .move_bodies(self.bodies, &mut states, zero, first);
            torques.numbers.fill([0.0; MOST_LANES]);
            inward(self.bodies, &mut states, &mut torques);
            let base = &states[0];
            let (force, moment) = (&base.rotation * base.force, &base.rotation * base.moment);
            let mut wrench = [[0.0; MOST_LANES]; 6];
            for k in 0..3 {
                force.0[k].write(&mut wrench[k]);
                moment.0[k].write(&mut wrench[3 + k]);
            }
            each_lane::<T>(first, count, |lane, state| {
                let of_state = &mut self.torques[state * dof..(state + 1) * dof];
                for (torque, lanes) in of_state.iter_mut().zip(&torques.numbers) {
                    *torque = lanes[lane];
                }
                self.base_wrenches[state] = wrench.each_ref().map(|lanes| lanes[lane]);
            });
        }
    }
}

struct WrenchRegressors<'a> {
    bodies: &'a [BodyModel],
    frame: &'a FixedFrame,
    source: Source<'a>,
    regressors: &'a mut [SMatrix<f64, 6, 10>],
}

impl Computation for WrenchRegressors<'_> {
    #[inline(always)]
    fn run<T: Lanes>(self, zero: T) {
        let count = self.source.count;
        let mut states = vec![BodyState::at_rest(zero); self.bodies.len()];
        for first in (0..count).step_by(T::COUNT) {
            self.source
                .move_bodies(self.bodies, &mut states, zero, first);
            let Some(body) = states.last() else { return };
            let seen = self.frame.motion(body);
            let entries = regressor_entries(
                seen.acceleration,
                seen.angular_acceleration,
                seen.angular_velocity.products(),
            );
            for (index, entry) in entries.iter().flatten().enumerate() {
                let mut lanes = [0.0; MOST_LANES];
                entry.write(&mut lanes);
                each_lane::<T>(first, count, |lane, state| {
                    self.regressors[state].as_mut_slice()[index] = lanes[lane];
                });
            }
        }
    }
}

#[cfg(test)]
mod tests;
