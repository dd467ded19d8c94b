//! From a URDF to a [`Manipulator`].

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::Path;

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use urdf_rs::JointType;

use crate::manipulator::{BaseKind, Frame, Joint, JointKind, Manipulator, check_body};
use crate::{InertialParameters, MassProperties, ModelError, symmetric_matrix};

impl Manipulator {
    /// Reads the text of a URDF. Meshes are not looked for.
    ///
    /// # Errors
    /// Each says which link or joint is at fault and why.
    pub fn from_urdf(xml: &str, base_kind: BaseKind) -> Result<Self, ModelError> {
        Self::from_urdf_below(xml, base_kind, None)
    }

    /// As [`Self::from_urdf`], from a file.
    ///
    /// # Errors
    /// As [`Self::from_urdf`], or [`ModelError::File`].
    pub fn from_urdf_file(path: &Path, base_kind: BaseKind) -> Result<Self, ModelError> {
        let xml = std::fs::read_to_string(path).map_err(|source| ModelError::File {
            path: path.display().to_string(),
            source,
        })?;
        Self::from_urdf(&xml, base_kind)
    }

    /// As [`Self::from_urdf`], but only `base` and what hangs below it; the URDF's root for `None`.
    ///
    /// # Errors
    /// As [`Self::from_urdf`], or [`ModelError::UnknownFrame`].
    pub fn from_urdf_below(
        xml: &str,
        base_kind: BaseKind,
        base: Option<&str>,
    ) -> Result<Self, ModelError> {
        let urdf = urdf_rs::read_from_string(&with_declared_prefixes(xml))
            .map_err(|error| ModelError::Syntax(error.to_string()))?;
        Tree::new(&urdf)?.build(base_kind, base)
    }
}

/// The text with every namespace prefix declared: generators leave `drake:` and the like undeclared, and
/// other URDF parsers let them pass.
fn with_declared_prefixes(xml: &str) -> Cow<'_, str> {
    let mut declared = HashSet::new();
    let mut declarations = String::new();
    // A name before a colon, which stands after `<`, `</` or a space within a tag.
    for (at, _) in xml.match_indices(':') {
        let before = &xml[..at];
        let start = before
            .rfind(|c: char| !(c.is_alphanumeric() || "_-.".contains(c)))
            .map_or(0, |k| {
                k + before[k..].chars().next().map_or(1, char::len_utf8)
            });
        let prefix = &before[start..];
        let in_a_tag = before.rfind('<') > before.rfind('>');
        let is_name = prefix.starts_with(|c: char| c.is_alphabetic() || c == '_');
        let quotes = before[before.rfind('<').unwrap_or(0)..]
            .matches('"')
            .count();
        if !in_a_tag || !is_name || quotes % 2 == 1 || ["xml", "xmlns"].contains(&prefix) {
            continue;
        }
        if !xml.contains(&format!("xmlns:{prefix}=")) && declared.insert(prefix) {
            declarations += &format!(" xmlns:{prefix}=\"urn:{prefix}\"");
        }
    }
    match xml.find("<robot") {
        Some(at) if !declarations.is_empty() => {
            let (head, tail) = xml.split_at(at + "<robot".len());
            Cow::Owned(format!("{head}{declarations}{tail}"))
        }
        _ => Cow::Borrowed(xml),
    }
}

/// The links and joints of a URDF, found by name and checked to form a tree.
struct Tree<'a> {
    urdf: &'a urdf_rs::Robot,
    links: HashMap<&'a str, &'a urdf_rs::Link>,
    joints: HashMap<&'a str, &'a urdf_rs::Joint>,
    /// The joint above each link but the root.
    above: HashMap<&'a str, &'a urdf_rs::Joint>,
    /// Joints below each link, in the file's order.
    below: HashMap<&'a str, Vec<&'a urdf_rs::Joint>>,
}

impl<'a> Tree<'a> {
    fn new(urdf: &'a urdf_rs::Robot) -> Result<Self, ModelError> {
        let mut tree = Self {
            urdf,
            links: HashMap::new(),
            joints: HashMap::new(),
            above: HashMap::new(),
            below: HashMap::new(),
        };
        for link in &urdf.links {
            if tree.links.insert(&link.name, link).is_some() {
                return Err(ModelError::Duplicate("link", link.name.clone()));
            }
        }
        for joint in &urdf.joints {
            tree.add_joint(joint)?;
        }
        Ok(tree)
    }

    fn add_joint(&mut self, joint: &'a urdf_rs::Joint) -> Result<(), ModelError> {
        let (parent, child) = (&joint.parent.link, &joint.child.link);
        if self.joints.insert(&joint.name, joint).is_some() {
            return Err(ModelError::Duplicate("joint", joint.name.clone()));
        }
        for link in [parent, child] {
            if !self.links.contains_key(link.as_str()) {
                return Err(ModelError::MissingLink {
                    joint: joint.name.clone(),
                    link: link.clone(),
                });
            }
        }
        if self.above.insert(child, joint).is_some() {
            return Err(ModelError::Loop(child.clone()));
        }
        self.below.entry(parent).or_default().push(joint);
        Ok(())
    }

    /// The one link without a parent, from which all others must be reached.
    fn root(&self) -> Result<&'a str, ModelError> {
        let names = || self.urdf.links.iter().map(|link| link.name.as_str());
        let roots: Vec<_> = names()
            .filter(|name| !self.above.contains_key(name))
            .collect();
        if roots.len() > 1 {
            let names = roots.into_iter().map(str::to_owned).collect();
            return Err(ModelError::Roots(names));
        }
        let reached = self.reached_from(&roots);
        // With one parent each, links that no root reaches hang below a loop.
        if let Some(lost) = names().find(|name| !reached.contains(name)) {
            return Err(ModelError::Loop(self.in_loop_above(lost).to_owned()));
        }
        let root = roots.first().copied();
        root.ok_or_else(|| ModelError::Syntax("there is no link".to_owned()))
    }

    fn reached_from(&self, roots: &[&'a str]) -> HashSet<&'a str> {
        let mut reached = HashSet::new();
        let mut open = roots.to_vec();
        while let Some(link) = open.pop() {
            reached.insert(link);
            let below = self.joints_below(link).iter();
            open.extend(below.map(|joint| joint.child.link.as_str()));
        }
        reached
    }

    /// The first link met twice on the way up.
    fn in_loop_above(&self, mut link: &'a str) -> &'a str {
        let mut met = HashSet::new();
        while met.insert(link) {
            link = self
                .above
                .get(link)
                .map_or(link, |joint| &joint.parent.link);
        }
        link
    }

    fn joints_below(&self, link: &str) -> &[&'a urdf_rs::Joint] {
        self.below.get(link).map_or(&[], Vec::as_slice)
    }

    fn build(&self, base_kind: BaseKind, base: Option<&str>) -> Result<Manipulator, ModelError> {
        let mut root = self.root()?;
        if let Some(name) = base {
            root = match self.links.get_key_value(name) {
                Some((&known, _)) => known,
                None => {
                    let links = self.urdf.links.iter().map(|link| link.name.as_str());
                    return Err(ModelError::unknown_frame(name, links));
                }
            };
        }
        let mut robot = Manipulator::with_root(base_kind, root, link_parameters(self.links[root])?);
        let mimics = self.add_links(root, &mut robot)?;
        self.resolve_mimics(&mut robot, &mimics)?;
        self.check_every_body_has_mass(&robot)?;
        Ok(robot)
    }

    /// Adds everything below the root, depth first, and returns the bodies that mimic.
    fn add_links(
        &self,
        root: &str,
        robot: &mut Manipulator,
    ) -> Result<Vec<(usize, &'a urdf_rs::Joint)>, ModelError> {
        let mut mimics = Vec::new();
        let mut open: Vec<_> = self
            .joints_below(root)
            .iter()
            .rev()
            .map(|&joint| (joint, 0))
            .collect();
        while let Some((joint, frame)) = open.pop() {
            let Frame {
                body,
                body_from_frame,
                ..
            } = robot.frames[frame];
            let zero = body_from_frame * isometry(&joint.origin, "the origin", &joint.name)?;
            let child = &joint.child.link;
            let own = link_parameters(self.links[child.as_str()])?;
            let child_frame = match moving_joint(joint, zero)? {
                None => robot.add_frame(child, frame, body, zero, own),
                Some(mut moving) => {
                    moving.coordinate = robot.joint_names.len();
                    let moved = robot.add_body(body, moving);
                    if joint.mimic.is_some() {
                        mimics.push((moved, joint));
                    } else {
                        robot.joint_names.push(joint.name.clone());
                    }
                    robot.add_frame(child, frame, moved, Isometry3::identity(), own)
                }
            };
            let below = self.joints_below(child).iter().rev();
            open.extend(below.map(|&joint| (joint, child_frame)));
        }
        Ok(mimics)
    }

    /// Lets each mimic joint share the coordinate of the joint it follows.
    fn resolve_mimics(
        &self,
        robot: &mut Manipulator,
        mimics: &[(usize, &urdf_rs::Joint)],
    ) -> Result<(), ModelError> {
        for &(body, joint) in mimics {
            // Only joints with a mimic element are in the list.
            let Some(mimic) = &joint.mimic else { continue };
            let refuse = |why| ModelError::Mimic {
                joint: joint.name.clone(),
                source_joint: mimic.joint.clone(),
                why,
            };
            let coordinate = robot.joint_index(&mimic.joint).ok_or_else(|| {
                refuse(match self.joints.get(mimic.joint.as_str()) {
                    None => "which the URDF does not have",
                    Some(source) if source.mimic.is_some() => {
                        "which mimics a joint itself: name the joint that leads"
                    }
                    Some(_) => "which does not move or is not below the base",
                })
            })?;
            let (ratio, offset) = (mimic.multiplier.unwrap_or(1.0), mimic.offset.unwrap_or(0.0));
            if !(ratio.is_finite() && offset.is_finite()) {
                return Err(refuse("with a multiplier or offset that is not finite"));
            }
            if let Some(moving) = &mut robot.bodies[body].joint {
                (moving.coordinate, moving.ratio, moving.offset) = (coordinate, ratio, offset);
            }
        }
        Ok(())
    }

    /// Every body that moves must have mass; it may come from a link on a fixed joint below it.
    fn check_every_body_has_mass(&self, robot: &Manipulator) -> Result<(), ModelError> {
        for (index, body) in robot.bodies.iter().enumerate() {
            let fixed = index == 0 && robot.base_kind == BaseKind::Fixed;
            if body.mass_kg > 0.0 || fixed {
                continue;
            }
            // The first frame of a body is the link that its joint moves.
            let first = robot.frames.iter().find(|frame| frame.body == index);
            let link = first.map(|frame| frame.name.clone()).unwrap_or_default();
            return Err(match self.above.get(link.as_str()) {
                Some(joint) if index > 0 => ModelError::NoInertial(link, joint.name.clone()),
                _ => ModelError::MasslessBase(link),
            });
        }
        Ok(())
    }
}

fn isometry(
    origin: &urdf_rs::Pose,
    what: &'static str,
    name: &str,
) -> Result<Isometry3<f64>, ModelError> {
    let ([x, y, z], [roll, pitch, yaw]) = (origin.xyz.0, origin.rpy.0);
    if [x, y, z, roll, pitch, yaw].iter().all(|v| v.is_finite()) {
        Ok(Isometry3::from_parts(
            Translation3::new(x, y, z),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        ))
    } else {
        Err(ModelError::NotFinite {
            what,
            name: name.to_owned(),
        })
    }
}

/// The joint of a moving link; `None` where it is fixed.
fn moving_joint(
    joint: &urdf_rs::Joint,
    parent_from_zero: Isometry3<f64>,
) -> Result<Option<Joint>, ModelError> {
    let kind = match joint.joint_type {
        JointType::Fixed => return Ok(None),
        JointType::Revolute | JointType::Continuous => JointKind::Revolute,
        JointType::Prismatic => JointKind::Prismatic,
        ref other => {
            return Err(ModelError::JointKind {
                joint: joint.name.clone(),
                kind: format!("{other:?}").to_lowercase(),
            });
        }
    };
    let axis = Vector3::from(joint.axis.xyz.0);
    if !axis.iter().all(|v| v.is_finite()) {
        return Err(ModelError::NotFinite {
            what: "the axis",
            name: joint.name.clone(),
        });
    }
    let axis = Unit::try_new(axis, 1e-9).ok_or_else(|| ModelError::Axis(joint.name.clone()))?;
    Ok(Some(Joint {
        kind,
        axis,
        parent_from_zero,
        coordinate: 0,
        ratio: 1.0,
        offset: 0.0,
    }))
}

/// The link's inertial parameters in the link's frame; zero for a link that has no mass.
fn link_parameters(link: &urdf_rs::Link) -> Result<InertialParameters, ModelError> {
    let inertial = &link.inertial;
    let inertia = &inertial.inertia;
    let entries = [
        inertia.ixx,
        inertia.ixy,
        inertia.ixz,
        inertia.iyy,
        inertia.iyz,
        inertia.izz,
    ];
    let mass_kg = inertial.mass.value;
    // A link without <inertial> arrives here as one of zeros.
    if mass_kg == 0.0 && entries.iter().all(|&entry| entry == 0.0) {
        return Ok(InertialParameters::zero());
    }
    let link_from_inertial = isometry(&inertial.origin, "the inertial origin", &link.name)?;
    let body = InertialParameters::from(MassProperties {
        mass_kg,
        center_of_mass: Vector3::zeros(),
        inertia: symmetric_matrix(entries),
    });
    check_body(&link.name, &body)?;
    Ok(body.expressed_in(&link_from_inertial))
}
