//! Manipulators on whole arrays.

use std::sync::Arc;

use nalgebra::Vector3;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use tactid_dynamics::{BaseKind, ModelError, Urdf};

use crate::arrays::{Series, extend_with, output};
use crate::errors::{IntoPyErr, detached, guarded};
use crate::findings::findings;
use crate::inertia::MassProperties;
use crate::poses::homogeneous;
use crate::states::StateArrays;
use crate::text::Text;
use crate::urdf::{ReadUrdf, base_kind, urdf_folder, urdf_text};
use crate::workspaces::Workspaces;

type Array<'py> = Bound<'py, PyArrayDyn<f64>>;
type Argument<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// A robot: a base, floating or fixed, and a tree of links.
///
/// Immutable; made by :meth:`from_urdf`. Joints are in the order of :attr:`joint_names`: walking
/// down the tree depth first, children in the order of the file. Match them by name.
///
/// All computations work on whole arrays. Let ``n`` be :attr:`dof`; an argument is of the shape
/// given here for one sample, or has a leading axis of N samples. Arguments of one sample hold for
/// all N. Results have the leading axis where any argument has it. The arguments in common:
///
/// - ``q``, ``qd``, ``qdd``: joint positions, velocities, accelerations, (n,); rad or m and
///   seconds. Zero where they are left out.
/// - ``base_pose``: the base in the world, ``world_from_base``, (4, 4), or (7,) as
///   ``[x, y, z, qx, qy, qz, qw]``. Identity where it is left out.
/// - ``base_twist``: velocity of the base frame's origin, then angular velocity, both in world
///   axes, (6,); m/s, rad/s. Zero where it is left out.
/// - ``base_acceleration``: classical acceleration of the base frame's origin (the derivative of
///   its velocity), then angular acceleration, both in world axes, (6,); m/s², rad/s². Zero where
///   left out.
///
/// A shape that does not fit raises an ``ArgumentError`` with the shape expected and the one given.
/// The interpreter is released while a series is worked through.
#[pyclass(module = "tactid", frozen)]
pub(crate) struct Manipulator {
    pub(crate) robot: tactid_dynamics::Manipulator,
    /// What the robot was read from: it has the limits of velocities and efforts.
    pub(crate) urdf: Arc<ReadUrdf>,
    workspaces: Workspaces,
    /// Whether the dynamics know the mass of something that moves.
    has_mass: bool,
}

/// How a frame moves, in the world: positions from the world's origin, all vectors in world axes.
///
/// Each attribute has a leading axis of N samples where the arguments had one.
#[pyclass(module = "tactid", frozen, get_all)]
pub(crate) struct FrameMotion {
    /// ``world_from_frame``, (4, 4), m.
    pose: Py<PyArrayDyn<f64>>,
    /// Velocity of the frame's origin, (3,), m/s.
    velocity: Py<PyArrayDyn<f64>>,
    /// Angular velocity, (3,), rad/s.
    angular_velocity: Py<PyArrayDyn<f64>>,
    /// Classical acceleration of the frame's origin, the derivative of ``velocity``, (3,), m/s².
    acceleration: Py<PyArrayDyn<f64>>,
    /// Angular acceleration, (3,), rad/s².
    angular_acceleration: Py<PyArrayDyn<f64>>,
}

#[pymethods]
impl Manipulator {
    /// Reads a URDF.
    ///
    /// Args: urdf: The path of a file, or the text itself, which begins with ``<``. base:
    /// ``"fixed"`` for a robot that is bolted down, ``"floating"`` for one whose base moves, such
    /// as a spacecraft or a mobile robot. base_link: Link to take as the base, with what hangs
    /// below it; the root where left out.
    ///
    /// A link without ``<inertial>`` has no mass: enough for poses, and for identification from
    /// wrenches. An inertia that no body has is used as it is written. :attr:`findings` lists these
    /// and other defects.
    ///
    /// Raises: ModelError: It cannot be read, its links are no tree, or a joint has an impossible
    /// axis, pose or type; the message names it. ArgumentError: ``base`` is something else, or
    /// ``urdf`` is neither text nor a path.
    #[staticmethod]
    #[pyo3(
        signature = (urdf, base=Text("fixed".to_owned()), *, base_link=None),
        text_signature = "(urdf, base=\"fixed\", *, base_link=None)"
    )]
    fn from_urdf(urdf: &Bound<'_, PyAny>, base: Text, base_link: Option<Text>) -> PyResult<Self> {
        let kind = base_kind(&base)?;
        let (text, folder) = (urdf_text(urdf)?, urdf_folder(urdf));
        let read = || {
            let urdf = Urdf::from_xml(&text)?;
            let robot = urdf.manipulator_below(kind, base_link.as_deref())?;
            Ok::<_, ModelError>(Self::new(robot, Arc::new(ReadUrdf { urdf, folder })))
        };
        detached(urdf.py(), read)?.map_err(IntoPyErr::into_py_err)
    }

    /// How many independent joints there are; mimic joints do not count.
    #[getter]
    fn dof(&self) -> usize {
        self.robot.dof()
    }

    /// The independent joints' names, in the order of ``q``.
    #[getter]
    fn joint_names(&self) -> Vec<String> {
        self.robot.joint_names().to_vec()
    }

    /// The names of all links, the root first.
    #[getter]
    fn frame_names(&self) -> Vec<String> {
        self.robot.frame_names().map(str::to_owned).collect()
    }

    /// ``"floating"`` or ``"fixed"``.
    #[getter]
    fn base(&self) -> &'static str {
        match self.robot.base_kind() {
            BaseKind::Floating => "floating",
            BaseKind::Fixed => "fixed",
        }
    }

    /// Mass of everything, kg.
    #[getter]
    fn mass(&self) -> f64 {
        self.robot.mass()
    }

    /// What is wrong in the URDF and what was assumed instead, a list of :class:`tactid.Finding`;
    /// ``print`` shows each as a sentence.
    ///
    /// An inertia or a mass that no body has, numbers that are missing, moving links without mass,
    /// and parts that were ignored. A result reports those that matter for its method. Masses and
    /// inertias on a fixed base have no effect and are not listed.
    #[getter]
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        findings(py, &self.robot.findings(), "keyword")
    }

    /// The robot with a body attached rigidly to a link; ``body`` is in that link's frame.
    ///
    /// Raises:
    ///     ModelError: There is no such link.
    fn with_payload(&self, frame: Text, body: &MassProperties) -> PyResult<Self> {
        let frame = self.robot.frame(&frame).map_err(IntoPyErr::into_py_err)?;
        let body = body.0.into();
        Ok(Self::new(
            self.robot.with_payload(frame, &body),
            self.urdf.clone(),
        ))
    }

    /// The robot without the masses of the links below ``frame`` (its own stays); joints stay.
    ///
    /// Raises:
    ///     ModelError: There is no such link.
    fn without_subtree(&self, frame: Text) -> PyResult<Self> {
        let frame = self.robot.frame(&frame).map_err(IntoPyErr::into_py_err)?;
        Ok(Self::new(
            self.robot.without_subtree(frame),
            self.urdf.clone(),
        ))
    }

    /// How a link's frame moves, equations (1)-(20).
    ///
    /// Raises:
    ///     ModelError: There is no such link.
    ///     ArgumentError: A shape does not fit.
    #[pyo3(signature = (frame, q, qd=None, qdd=None, *, base_pose=None, base_twist=None, base_acceleration=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn kinematics<'py>(
        &self,
        py: Python<'py>,
        frame: Text,
        q: &Bound<'py, PyAny>,
        qd: Argument<'_, 'py>,
        qdd: Argument<'_, 'py>,
        base_pose: Argument<'_, 'py>,
        base_twist: Argument<'_, 'py>,
        base_acceleration: Argument<'_, 'py>,
    ) -> PyResult<FrameMotion> {
        let frame = self.robot.frame(&frame).map_err(IntoPyErr::into_py_err)?;
        let base = [base_pose, base_twist, base_acceleration];
        let arrays = StateArrays::read(&self.robot, (q, qd, qdd), base)?;
        let samples = arrays.samples()?;
        let count = samples.unwrap_or(1);
        let states = arrays.whole()?;
        let mut poses = Vec::with_capacity(16 * count);
        let mut vectors = [(); 4].map(|()| Vec::with_capacity(3 * count));
        detached(py, || {
            states.each(&self.workspaces, samples, |workspace| {
                let motion = workspace.frame_motion(frame);
                poses.extend(homogeneous(&motion.pose));
                let moved = [
                    motion.velocity,
                    motion.angular_velocity,
                    motion.acceleration,
                    motion.angular_acceleration,
                ];
                for (values, vector) in vectors.iter_mut().zip(&moved) {
                    values.extend(vector.iter());
                }
                Ok(())
            })
        })??;
        let vector = |values| Ok::<_, PyErr>(output(py, values, samples, &[3])?.unbind());
        let [
            velocity,
            angular_velocity,
            acceleration,
            angular_acceleration,
        ] = vectors;
        Ok(FrameMotion {
            pose: output(py, poses, samples, &[4, 4])?.unbind(),
            velocity: vector(velocity)?,
            angular_velocity: vector(angular_velocity)?,
            acceleration: vector(acceleration)?,
            angular_acceleration: vector(angular_acceleration)?,
        })
    }

    /// Joint torques and base wrench that a motion takes, equations (21)-(41).
    ///
    /// Args: gravity: Gravitational acceleration in world axes, (3,), m/s², pointing down; zero
    /// where left out, as in orbit.
    ///
    /// Returns: ``(torques, base_wrench)``: torques (n,), N m (N for a prismatic joint), along each
    /// joint's axis on the link it moves; base_wrench (6,), force then moment that the outside
    /// applies to the base, in world axes, about the base frame's origin, N and N m. Those of many
    /// states, which the widest vector unit of the processor computes together, may differ from
    /// those of one by rounding.
    ///
    /// Raises:
    ///     ArgumentError: A shape does not fit.
    ///     ModelError: No link that moves has mass.
    #[pyo3(signature = (q, qd=None, qdd=None, *, base_pose=None, base_twist=None, base_acceleration=None, gravity=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn inverse_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: Argument<'_, 'py>,
        qdd: Argument<'_, 'py>,
        base_pose: Argument<'_, 'py>,
        base_twist: Argument<'_, 'py>,
        base_acceleration: Argument<'_, 'py>,
        gravity: Argument<'_, 'py>,
    ) -> PyResult<(Array<'py>, Array<'py>)> {
        self.check_masses()?;
        let gravity = Series::read_or_zero(gravity, "gravity", 3)?;
        let gravity = Vector3::from_column_slice(gravity.single()?);
        let base = [base_pose, base_twist, base_acceleration];
        let arrays = StateArrays::read(&self.robot, (q, qd, qdd), base)?;
        let samples = arrays.samples()?;
        let (dof, count) = (self.robot.dof(), samples.unwrap_or(1));
        let (mut torques, mut wrenches) = (vec![0.0; count * dof], vec![[0.0; 6]; count]);
        if samples.is_some() {
            let workspace = self.workspaces.series(&self.robot);
            arrays.in_parts(py, count, |states, part| {
                let bases = states.bases()?;
                let torques = &mut torques[part.start * dof..part.end * dof];
                workspace
                    .inverse_dynamics(
                        &states.series(&bases),
                        &gravity,
                        torques,
                        &mut wrenches[part],
                    )
                    .map_err(IntoPyErr::into_py_err)
            })?;
        } else {
            let states = arrays.whole()?;
            guarded(|| {
                states.first(&self.workspaces, &gravity, |workspace| {
                    tactid_dynamics::forces(workspace, &gravity);
                    torques.copy_from_slice(workspace.joint_torques()?);
                    let wrench = workspace.base_wrench()?;
                    wrenches[0][..3].copy_from_slice(wrench.force.as_slice());
                    wrenches[0][3..].copy_from_slice(wrench.moment.as_slice());
                    Ok(())
                })
            })??;
        }
        Ok((
            output(py, torques, samples, &[dof])?,
            output(py, wrenches.into_flattened(), samples, &[6])?,
        ))
    }

    /// Returns the acceleration of a free-floating base for a given joint motion, without external
    /// forces.
    ///
    /// Returns: (6,): classical acceleration of the base frame's origin, then angular acceleration,
    /// in world axes; m/s², rad/s².
    ///
    /// Raises:
    ///     ArgumentError: A shape does not fit.
    ///     ModelError: Nothing that moves has mass: no link, nor the floating base.
    #[pyo3(signature = (q, qd=None, qdd=None, *, base_pose=None, base_twist=None))]
    fn base_acceleration<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: Argument<'_, 'py>,
        qdd: Argument<'_, 'py>,
        base_pose: Argument<'_, 'py>,
        base_twist: Argument<'_, 'py>,
    ) -> PyResult<Array<'py>> {
        self.check_masses()?;
        let base = [base_pose, base_twist, None];
        let arrays = StateArrays::read(&self.robot, (q, qd, qdd), base)?;
        let samples = arrays.samples()?;
        let count = samples.unwrap_or(1);
        let states = arrays.whole()?;
        let mut values = Vec::with_capacity(6 * count);
        detached(py, || {
            self.workspaces.with(&self.robot, |workspace| {
                for sample in 0..count {
                    let (base, joints) = states.at(sample);
                    let acceleration = tactid_dynamics::base_acceleration(workspace, &base, joints)
                        .map_err(IntoPyErr::into_py_err)?;
                    extend_with(&mut values, &acceleration.linear, &acceleration.angular);
                }
                Ok::<_, PyErr>(())
            })
        })??;
        output(py, values, samples, &[6])
    }

    /// Total momentum.
    ///
    /// Returns: (6,): linear momentum, kg m/s, then angular momentum about the world's origin, kg
    /// m²/s, in world axes.
    ///
    /// Raises:
    ///     ArgumentError: A shape does not fit.
    ///     ModelError: Nothing that moves has mass: no link, nor the floating base.
    #[pyo3(signature = (q, qd=None, *, base_pose=None, base_twist=None))]
    fn momentum<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: Argument<'_, 'py>,
        base_pose: Argument<'_, 'py>,
        base_twist: Argument<'_, 'py>,
    ) -> PyResult<Array<'py>> {
        self.check_masses()?;
        let base = [base_pose, base_twist, None];
        let arrays = StateArrays::read(&self.robot, (q, qd, None), base)?;
        let samples = arrays.samples()?;
        let count = samples.unwrap_or(1);
        let states = arrays.whole()?;
        let mut values = Vec::with_capacity(6 * count);
        detached(py, || {
            states.each(&self.workspaces, samples, |workspace| {
                let total = tactid_dynamics::momentum(workspace);
                extend_with(&mut values, &total.linear, &total.angular);
                Ok(())
            })
        })??;
        output(py, values, samples, &[6])
    }

    fn __repr__(&self) -> String {
        format!(
            "<Manipulator: {} base, {} joints, {} links, {} kg>",
            self.base(),
            self.robot.dof(),
            self.robot.frame_names().count(),
            self.robot.mass()
        )
    }
}

impl Manipulator {
    fn new(robot: tactid_dynamics::Manipulator, urdf: Arc<ReadUrdf>) -> Self {
        Self {
            urdf,
            has_mass: robot.check_masses(None).is_ok(),
            workspaces: Workspaces::default(),
            robot,
        }
    }

    /// Checks that the dynamics know the mass of something that moves.
    fn check_masses(&self) -> PyResult<()> {
        if self.has_mass {
            return Ok(());
        }
        self.robot
            .check_masses(None)
            .map_err(IntoPyErr::into_py_err)
    }
}
