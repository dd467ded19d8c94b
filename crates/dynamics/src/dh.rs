//! Construction of a [`Manipulator`] from a Denavit-Hartenberg table.

use std::sync::Arc;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::manipulator::{BaseKind, Joint, JointKind, Manipulator, check_body};
use crate::{InertialParameters, ModelError};

/// One row of a standard Denavit-Hartenberg table and the link that it describes.
///
/// The transform from frame `i - 1` to frame `i` of the table is `Rz(θ) Tz(d) Tx(a) Rx(α)`. Joint
/// `i` moves about or along the z axis of frame `i - 1`.
#[derive(Clone, Debug)]
pub struct DhLink {
    /// Name of the joint.
    pub joint: String,
    /// Name of the link and of frame `i`.
    pub link: String,
    /// Kind of the joint. The position of a revolute joint adds to `theta`, the position of a
    /// prismatic joint to `d`.
    pub kind: JointKind,
    /// Joint angle θ at joint position zero, rad.
    pub theta: f64,
    /// Link offset d at joint position zero, m.
    pub d: f64,
    /// Link length a, m.
    pub a: f64,
    /// Link twist α, rad.
    pub alpha: f64,
    /// Inertial parameters of the link, expressed in frame `i` of the table.
    pub parameters: InertialParameters,
}

/// Description of a serial manipulator on its base by a Denavit-Hartenberg table.
#[derive(Clone, Debug)]
pub struct DhRobot {
    /// Whether the base moves.
    pub base_kind: BaseKind,
    /// Name of the base and of its frame.
    pub base: String,
    /// Inertial parameters of the base, expressed in its frame. They may be zero for a fixed base.
    pub base_parameters: InertialParameters,
    /// Pose of the table's frame 0 in the base frame.
    pub base_from_table: Isometry3<f64>,
    /// Rows of the table, from the base outwards.
    pub links: Vec<DhLink>,
}

impl Manipulator {
    /// Builds a serial manipulator from its Denavit-Hartenberg table.
    ///
    /// ```
    /// use nalgebra::{Isometry3, Matrix3, Vector3};
    /// use tactid_dynamics::{
    ///     BaseKind, DhLink, DhRobot, InertialParameters, JointKind, Manipulator, MassProperties,
    /// };
    ///
    /// let rod = InertialParameters::from(MassProperties {
    ///     mass_kg: 3.0,
    ///     center_of_mass: Vector3::new(-0.25, 0.0, 0.0), // back towards the joint
    ///     inertia: Matrix3::from_diagonal(&Vector3::new(0.001, 0.0625, 0.0625)),
    /// });
    /// let robot = Manipulator::from_dh(&DhRobot {
    ///     base_kind: BaseKind::Fixed,
    ///     base: "base".into(),
    ///     base_parameters: InertialParameters::zero(),
    ///     base_from_table: Isometry3::identity(),
    ///     links: vec![DhLink {
    ///         joint: "hinge".into(),
    ///         link: "rod".into(),
    ///         kind: JointKind::Revolute,
    ///         theta: 0.0,
    ///         d: 0.0,
    ///         a: 0.5,
    ///         alpha: 0.0,
    ///         parameters: rod,
    ///     }],
    /// })?;
    /// assert_eq!(robot.joint_names(), ["hinge"]);
    /// # Ok::<(), tactid_dynamics::ModelError>(())
    /// ```
    ///
    /// # Errors
    /// Returns [`ModelError::Mass`] or [`ModelError::Inertia`] for an impossible body,
    /// [`ModelError::NotFinite`] for a number that is not finite and [`ModelError::Duplicate`] for
    /// a name used twice.
    pub fn from_dh(robot: &DhRobot) -> Result<Self, ModelError> {
        let mut model = Self::with_root(robot.base_kind, &robot.base, robot.base_parameters);
        let massless = robot.base_parameters == InertialParameters::zero();
        if robot.base_kind == BaseKind::Floating || !massless {
            check_body(&robot.base, &robot.base_parameters)?;
        }
        let base_from_table = robot.base_from_table.to_homogeneous();
        if !base_from_table.iter().all(|entry| entry.is_finite()) {
            return Err(ModelError::NotFinite {
                what: "the pose of frame 0 of the table",
                name: robot.base.clone(),
            });
        }
        let (mut parent_body, mut parent_link) = (0, 0);
        let mut parent_from_table = robot.base_from_table;
        for link in &robot.links {
            check_link(&model, link)?;
            // The joint moves about or along z of the table's previous frame. The body's frame is
            // there and moves with it.
            let theta = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), link.theta);
            let lift = Translation3::new(0.0, 0.0, link.d);
            let joint = Joint {
                name: link.joint.clone(),
                kind: link.kind,
                axis: Vector3::z_axis(),
                parent_from_zero: parent_from_table * theta,
                coordinate: model.joint_names.len(),
                ratio: 1.0,
                offset: 0.0,
                is_mimic: false,
                limits: None,
                velocity_limit: None,
                effort_limit: None,
            };
            let body_from_frame = Isometry3::from_parts(
                lift * Translation3::new(link.a, 0.0, 0.0),
                UnitQuaternion::from_axis_angle(&Vector3::x_axis(), link.alpha),
            );
            parent_body = model.add_body(parent_body, joint);
            Arc::make_mut(&mut model.joint_names).push(link.joint.clone());
            parent_link = model.add_link(
                &link.link,
                parent_link,
                parent_body,
                body_from_frame,
                link.parameters,
            );
            parent_from_table = body_from_frame;
        }
        Ok(model)
    }
}

/// Checks that a row has new names, finite numbers and a possible body.
fn check_link(model: &Manipulator, link: &DhLink) -> Result<(), ModelError> {
    if model.frame_names().any(|name| name == link.link) {
        return Err(ModelError::Duplicate("link", link.link.clone()));
    }
    if model.joint_index(&link.joint).is_some() {
        return Err(ModelError::Duplicate("joint", link.joint.clone()));
    }
    if ![link.theta, link.d, link.a, link.alpha]
        .iter()
        .all(|value| value.is_finite())
    {
        return Err(ModelError::NotFinite {
            what: "the row of the table",
            name: link.joint.clone(),
        });
    }
    check_body(&link.link, &link.parameters)
}
