//! Collision shapes of a robot's links.

use std::collections::{HashMap, HashSet};
use std::fmt;

use parry3d_f64::shape::SharedShape;
use tactid_dynamics::{
    CollisionShape, Manipulator, ModelError, Urdf, shortened,
    urdf_rs::{Geometry, JointType},
};

use super::convert::glam_pose;
use super::mesh::ConvexHulls;
use super::placed::Placed;
use crate::ExcitationError;
use crate::checks::LARGEST_SIZE_M;
use crate::untested::{UntestedLink, VISUAL};

/// Largest number of characters of the name of a shape in a finding.
const LONGEST_NAME: usize = 200;

/// Largest number of shapes that are tested, of which each pair costs time at each step: a dual arm
/// with a convex decomposition of each link has fewer.
const MAX_SHAPES: usize = 200;

/// Largest number of shapes that have a finding each.
const MAX_LEFT_OUT: usize = 20;

/// Returns the bytes of a mesh file by its name in the URDF, or the reason why they cannot be read.
pub type MeshReader<'a> = dyn FnMut(&str) -> Result<Vec<u8>, String> + 'a;

/// Shapes of the links of a robot that must not touch one another, the payload or a keep-out box:
/// boxes, cylinders, capsules, spheres, and the convex hulls of meshes.
#[derive(Clone, Debug)]
pub struct CollisionModel {
    /// Name of each link that has shapes, with its shapes.
    pub(crate) links: Vec<(String, Vec<Placed>)>,
    /// Links of which a shape is not tested, each once.
    pub(crate) untested: Vec<UntestedLink>,
    /// Whether a motion may be designed although shapes are missing.
    pub(crate) accepts_untested: bool,
    findings: Vec<CollisionFinding>,
}

/// What a test for collisions leaves out or relaxes.
#[derive(Clone, Debug, PartialEq)]
pub enum CollisionFinding {
    /// No link has a collision shape, so that collisions of the robot are not tested.
    NoShapes,
    /// A shape of a link is left out.
    ShapeLeftOut {
        /// Name of the link.
        link: String,
        /// File of the mesh, or the element of a shape that is unknown.
        shape: String,
        /// The reason.
        because: String,
    },
    /// Pairs that are not tested, although one can move relative to the other.
    PairsNotTested {
        /// Names of both, such as two links.
        pairs: Vec<[String; 2]>,
        /// The reason.
        because: NotTested,
    },
    /// Links with a visual shape and no collision shape. No motion is designed where one of them is
    /// a part of the arm; others, such as a camera, are not tested.
    LinksWithoutShapes {
        /// Names of the links.
        links: Vec<String>,
    },
    /// More shapes are left out than have a finding each.
    MoreShapesLeftOut {
        /// Number of these shapes.
        count: usize,
    },
    /// The robot has more collision shapes than are tested.
    TooManyShapes {
        /// Number of shapes that are not tested.
        count: usize,
    },
    /// A pair is so close at the start that it keeps less than the least distance: half of its
    /// distance at the start.
    LeastDistanceReduced {
        /// Names of both, such as two links.
        pair: [String; 2],
        /// Distance at the start, m.
        at_start_m: f64,
        /// Least distance that the problem asks for, m.
        asked_m: f64,
    },
}

/// Why a pair is not tested for collisions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotTested {
    /// One joint lies between the two links. Shapes of neighbours mostly overlap at their joint.
    Adjacent,
    /// They touch at the start of the motion, as finger and payload do.
    InContact,
}

impl fmt::Display for NotTested {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Adjacent => "one joint connects them",
            Self::InContact => "they touch at the start",
        })
    }
}

impl fmt::Display for CollisionFinding {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoShapes => formatter
                .write_str("no link has a collision shape that can be tested: collisions of the robot are not tested"),
            Self::ShapeLeftOut {
                link,
                shape,
                because,
            } => write!(
                formatter,
                "the collision shape `{shape}` of link {link} is left out: {because}"
            ),
            Self::LinksWithoutShapes { links } => write!(
                formatter,
                "not tested for collisions, because the URDF has no collision shape of them: {}",
                links.join(", ")
            ),
            Self::MoreShapesLeftOut { count } => {
                write!(formatter, "{count} more collision shapes are left out")
            }
            Self::TooManyShapes { count } => write!(
                formatter,
                "{count} more collision shapes are not tested: at most {MAX_SHAPES} are"
            ),
            Self::LeastDistanceReduced {
                pair: [first, second],
                at_start_m,
                asked_m,
            } => write!(
                formatter,
                "{first} and {second} keep half of the {:.1} mm that they have at the start, in place of {:.1} mm",
                1e3 * at_start_m,
                1e3 * asked_m
            ),
            Self::PairsNotTested { pairs, because } => {
                let names = pairs
                    .iter()
                    .map(|[first, second]| format!("{first} and {second}"));
                let names: Vec<String> = names.collect();
                let names = names.join(", ");
                write!(
                    formatter,
                    "not tested for collisions, because {because}: {names}"
                )
            }
        }
    }
}

impl CollisionModel {
    /// Returns the collision shapes of a robot from its URDF. `read_mesh` reads the files of
    /// meshes, of which STL, OBJ and PLY are understood; other shapes that cannot be used are left out,
    /// see [`CollisionModel::findings`].
    ///
    /// No motion is designed for a robot with shapes left out, because it could run through them:
    /// [`CollisionModel::accepting_untested`] allows it.
    ///
    /// # Errors
    /// Returns [`ExcitationError::Identify`] for a pose or a size of a shape that is not finite
    /// numbers or not positive.
    pub fn of_urdf(
        urdf: &Urdf,
        robot: &Manipulator,
        read_mesh: &mut MeshReader<'_>,
    ) -> Result<Self, ExcitationError> {
        let mut reading = Reading {
            read_mesh,
            hulls: ConvexHulls::default(),
            tested: 0,
            too_many: 0,
            left_out: 0,
            model: Self {
                links: Vec::new(),
                untested: Vec::new(),
                accepts_untested: false,
                findings: Vec::new(),
            },
        };
        let mut without = Vec::new();
        for link in robot.frame_names() {
            let shapes = match urdf.collision_shapes(link) {
                // A frame that was added to the robot.
                Err(ModelError::UnknownFrame { .. }) => continue,
                shapes => shapes?,
            };
            if shapes.is_empty() && urdf.has_visual(link) {
                without.push(link.to_owned());
            }
            reading.link(link, &shapes);
        }
        Ok(reading.finish(without, urdf))
    }

    /// Returns what is left out.
    #[must_use]
    pub fn findings(&self) -> &[CollisionFinding] {
        &self.findings
    }

    /// Returns the links of which a shape is left out, each once with the first of these shapes.
    #[must_use]
    pub fn untested(&self) -> &[UntestedLink] {
        &self.untested
    }

    /// Accepts motions that are not tested against the shapes that are left out.
    #[must_use]
    pub fn accepting_untested(mut self) -> Self {
        self.accepts_untested = true;
        self
    }
}

/// The reading of the shapes of a robot, link by link.
struct Reading<'a, 'b> {
    read_mesh: &'a mut MeshReader<'b>,
    hulls: ConvexHulls,
    /// Number of shapes that are tested, too many, and left out for another reason.
    tested: usize,
    too_many: usize,
    left_out: usize,
    model: CollisionModel,
}

impl Reading<'_, '_> {
    /// Adds the shapes of a link.
    fn link(&mut self, link: &str, shapes: &[CollisionShape]) {
        let mut placed = Vec::new();
        for shape in shapes {
            if self.tested == MAX_SHAPES {
                self.too_many += 1;
                self.leave_out(
                    link,
                    name_of(shape),
                    format!("at most {MAX_SHAPES} are tested"),
                );
                continue;
            }
            match shape_of(shape, self.read_mesh, &mut self.hulls) {
                Ok(shape) => {
                    placed.push(shape);
                    self.tested += 1;
                }
                Err(because) => {
                    let shape = name_of(shape);
                    self.left_out += 1;
                    if self.left_out <= MAX_LEFT_OUT {
                        self.model.findings.push(CollisionFinding::ShapeLeftOut {
                            link: link.to_owned(),
                            shape: shape.clone(),
                            because: because.clone(),
                        });
                    }
                    self.leave_out(link, shape, because);
                }
            }
        }
        if !placed.is_empty() {
            self.model.links.push((link.to_owned(), placed));
        }
    }

    /// Remembers a link of which a shape is not tested.
    fn leave_out(&mut self, link: &str, shape: String, because: String) {
        let untested = &mut self.model.untested;
        if untested.last().is_none_or(|last| last.link != link) {
            let link = link.to_owned();
            untested.push(UntestedLink {
                link,
                shape,
                because,
            });
        }
    }

    /// Returns the model with findings about all links; `without` have a visual shape only.
    fn finish(mut self, without: Vec<String>, urdf: &Urdf) -> CollisionModel {
        // Where there are other shapes, those of the arm are lost.
        if !self.model.links.is_empty() || !self.model.untested.is_empty() {
            let parts = parts_of_arms(urdf);
            for link in without.iter().filter(|link| parts.contains(link.as_str())) {
                let because = "the URDF has no collision shape of it";
                self.leave_out(link, VISUAL.to_owned(), because.to_owned());
            }
        }
        let Self { mut model, .. } = self;
        let findings = &mut model.findings;
        if let Some(count) = self
            .left_out
            .checked_sub(MAX_LEFT_OUT)
            .filter(|&count| count > 0)
        {
            findings.push(CollisionFinding::MoreShapesLeftOut { count });
        }
        if self.too_many > 0 {
            let count = self.too_many;
            findings.push(CollisionFinding::TooManyShapes { count });
        }
        if model.links.is_empty() {
            findings.push(CollisionFinding::NoShapes);
        } else if !without.is_empty() {
            findings.push(CollisionFinding::LinksWithoutShapes { links: without });
        }
        model
    }
}

/// Returns the links that joints move or that carry joints, but not what is fixed to them, such as a
/// camera.
fn parts_of_arms(urdf: &Urdf) -> HashSet<&str> {
    let joints = &urdf.robot().joints;
    let parents: HashMap<&str, &str> = joints
        .iter()
        .map(|joint| (joint.child.link.as_str(), joint.parent.link.as_str()))
        .collect();
    let moving = joints
        .iter()
        .filter(|joint| joint.joint_type != JointType::Fixed);
    let mut parts = HashSet::new();
    for joint in moving {
        let mut link = Some(joint.child.link.as_str());
        // The links above one that is known are known.
        while let Some(part) = link.filter(|part| parts.insert(*part)) {
            link = parents.get(part).copied();
        }
    }
    parts
}

/// Returns the name of a shape: the file of a mesh, or the element of the URDF.
fn name_of(shape: &CollisionShape) -> String {
    let name = match &shape.geometry {
        Ok(Geometry::Box { .. }) => "box",
        Ok(Geometry::Sphere { .. }) => "sphere",
        Ok(Geometry::Cylinder { .. }) => "cylinder",
        Ok(Geometry::Capsule { .. }) => "capsule",
        Ok(Geometry::Mesh { filename, .. }) => filename,
        Err(element) => element,
    };
    shortened(name, LONGEST_NAME)
}

/// Returns a shape, or the reason why it is left out.
fn shape_of(
    shape: &CollisionShape,
    read_mesh: &mut MeshReader<'_>,
    hulls: &mut ConvexHulls,
) -> Result<Placed, String> {
    let placed = placed_of(shape, read_mesh, hulls)?;
    let bounds = placed.shape.compute_aabb(&placed.pose);
    let farthest_m = bounds.mins.abs().max(bounds.maxs.abs()).max_element();
    if farthest_m > LARGEST_SIZE_M {
        return Err("it reaches beyond 1000 km".to_owned());
    }
    Ok(placed)
}

/// Returns a shape in its place on the link, or the reason why it is left out.
fn placed_of(
    shape: &CollisionShape,
    read_mesh: &mut MeshReader<'_>,
    hulls: &mut ConvexHulls,
) -> Result<Placed, String> {
    let mut pose = shape.link_from_shape;
    // Cylinders and capsules of parry are along y.
    let along_z = nalgebra::UnitQuaternion::from_axis_angle(
        &nalgebra::Vector3::x_axis(),
        std::f64::consts::FRAC_PI_2,
    );
    let shape = match &shape.geometry {
        Ok(Geometry::Box { size }) => {
            let [x, y, z] = size.map(|length| 0.5 * length);
            SharedShape::cuboid(x, y, z)
        }
        Ok(Geometry::Sphere { radius }) => SharedShape::ball(*radius),
        Ok(Geometry::Cylinder { radius, length }) => {
            pose.rotation *= along_z;
            SharedShape::cylinder(0.5 * length, *radius)
        }
        Ok(Geometry::Capsule { radius, length }) => {
            pose.rotation *= along_z;
            SharedShape::capsule_y(0.5 * length, *radius)
        }
        Ok(Geometry::Mesh { filename, scale }) => {
            let scale = nalgebra::Vector3::from(scale.map_or([1.0; 3], |scale| *scale));
            let bytes = read_mesh(filename);
            let hull = bytes.and_then(|bytes| hulls.hull(filename, &bytes, &scale));
            return Ok(Placed {
                pose: glam_pose(&pose),
                ..hull?
            });
        }
        Err(_) => {
            return Err("the format has no such shape".to_owned());
        }
    };
    Ok(Placed {
        pose: glam_pose(&pose),
        shape,
        margin_m: 0.0,
    })
}
