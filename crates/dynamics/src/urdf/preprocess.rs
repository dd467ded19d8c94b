//! Reading of the text of a URDF: the preprocessing checks and repairs it for urdf-rs.
//!
//! urdf-rs alone refuses a whole robot for what no model needs, such as a mesh without the name of
//! its file, and exhausts the stack where elements nest. The preprocessing keeps what
//! [`super::format`] names and completes it: a number that is missing in an `<inertial>`, or is
//! unreadable, becomes NaN, which [`super::build`] reports.

use std::collections::HashMap;

use nalgebra::{Quaternion, UnitQuaternion};
use quick_xml::escape::escape;
use urdf_rs::Robot;

use super::element::{Element, parse, syntax};
use super::format::{
    Attribute, JOINT_TYPES, LEAVES, QUATERNION, REPEATABLE, REQUIRED, SHAPES, UNKNOWN, attributes,
    children, unused,
};
use crate::finding::IgnoredPart;
use crate::{ModelError, shortened};

/// Largest number of characters of an attribute in an error.
const LONGEST_TEXT: usize = 200;

/// Length of the documents that urdf-rs reads, bytes. A large robot is read in pieces, because
/// urdf-rs needs 1.5 kB of memory for each element of a document.
const PIECE_BYTES: usize = 64 << 10;

/// Most elements that are kept of all links and joints. urdf-rs reads 200 000 a second.
const MAX_KEPT: usize = 400_000;

/// Largest number of elements that are kept of one link, which is not read in pieces.
const MAX_KEPT_OF_LINK: usize = 100_000;

/// What the preprocessing has changed in links and joints, by name.
#[derive(Clone, Debug, Default)]
pub(super) struct Repairs {
    pub(super) links: HashMap<String, Repair>,
    pub(super) joints: HashMap<String, Repair>,
}

/// What the preprocessing has changed in a link or joint.
#[derive(Clone, Debug, Default)]
pub(super) struct Repair {
    /// Parts that are left out: the element that contains each, what it is, and its name.
    pub(super) ignored: Vec<(&'static str, IgnoredPart, String)>,
    /// Collision shapes that are left out.
    pub(super) shapes: Vec<LeftOut>,
    /// Attribute that gives the rotation of the `<inertial>`, where it is unreadable.
    pub(super) rotation: Option<&'static str>,
    /// Whether the link has a `<visual>`, which no model needs.
    pub(super) has_visual: bool,
}

/// A collision shape that is left out.
#[derive(Clone, Debug)]
pub(super) struct LeftOut {
    /// Name of its element; empty where there is none.
    pub(super) element: String,
    /// What is wrong in the shape or its pose; `None` for a shape that the format does not have.
    pub(super) fault: Option<Unreadable>,
}

/// An attribute without the finite numbers that it must have.
#[derive(Clone, Debug)]
pub(super) struct Unreadable {
    element: &'static str,
    attribute: &'static str,
    text: String,
    count: usize,
}

impl Unreadable {
    /// Returns the error for the attribute in a `link` or `joint` with a name.
    pub(super) fn of(&self, kind: &'static str, name: &str) -> ModelError {
        let (element, attribute, text) = (self.element, self.attribute, &self.text);
        ModelError::Numbers {
            kind,
            name: name.to_owned(),
            given: format!("{element} {attribute}=\"{text}\""),
            expected: self.count,
        }
    }
}

/// Reads the text of a URDF, and returns the robot with what is changed in it.
///
/// # Errors
/// Returns [`ModelError::Syntax`] for text that is not a URDF, for a link or joint without a name,
/// and for a joint that does not name its links; [`ModelError::JointKind`] for a type that the
/// format does not have, and [`ModelError::Numbers`] for a pose or axis that is not finite numbers.
pub(super) fn read(text: &str) -> Result<(Robot, Repairs), ModelError> {
    let root = parse(text)?;
    if root.name != "robot" {
        let message = format!("the root element is <{}>, not <robot>", root.name);
        return Err(syntax(text, root.span.start, &message));
    }
    let mut document = Document {
        text,
        robot: Robot {
            name: root.attribute("name").unwrap_or_default().to_owned(),
            version: None,
            links: Vec::new(),
            joints: Vec::new(),
            materials: Vec::new(),
        },
        piece: String::new(),
        kept: 0,
        repair: Repair::default(),
        unreadable: Vec::new(),
    };
    let mut repairs = Repairs::default();
    for element in &root.children {
        let before = document.kept;
        let (name, repair) = match element.name.as_str() {
            "link" => (document.link(element)?, &mut repairs.links),
            "joint" => (document.joint(element)?, &mut repairs.joints),
            _ => continue,
        };
        repair.insert(name.to_owned(), std::mem::take(&mut document.repair));
        for (kept, most, what) in [
            (document.kept, MAX_KEPT, "the links and joints have"),
            (document.kept - before, MAX_KEPT_OF_LINK, "this link has"),
        ] {
            if kept > most {
                let message = format!("{what} more than {most} elements");
                return Err(syntax(text, element.span.start, &message));
            }
        }
        if document.piece.len() > PIECE_BYTES {
            document.read_piece()?;
        }
    }
    document.read_piece()?;
    if document.robot.links.is_empty() {
        let is_macro = |element: &Element| element.name.starts_with("xacro:");
        let has_macros = root.children.iter().any(is_macro);
        let advice = ", but there are xacro macros: expand them with `xacro`";
        let message = format!("there is no link{}", if has_macros { advice } else { "" });
        return Err(ModelError::Syntax(message));
    }
    Ok((document.robot, repairs))
}

/// The document for urdf-rs while it is written, and what urdf-rs has read of it.
struct Document<'a> {
    text: &'a str,
    robot: Robot,
    /// Links and joints that urdf-rs has not read yet.
    piece: String,
    /// Number of elements written.
    kept: usize,
    /// What is changed in the link or joint that is being written.
    repair: Repair,
    /// Attributes that were replaced by [`UNKNOWN`] in what is being written.
    unreadable: Vec<Unreadable>,
}

impl Document<'_> {
    /// Lets urdf-rs read what is written.
    fn read_piece(&mut self) -> Result<(), ModelError> {
        let document = format!("<robot>{}</robot>", std::mem::take(&mut self.piece));
        let read = urdf_rs::read_from_string(&document);
        let read = read.map_err(|error| ModelError::Syntax(error.to_string()))?;
        self.robot.links.extend(read.links);
        self.robot.joints.extend(read.joints);
        Ok(())
    }

    /// Writes a link, and returns its name.
    fn link<'e>(&mut self, link: &'e Element) -> Result<&'e str, ModelError> {
        let name = self.name_in(link, "name")?;
        self.element(link, "link");
        let mut unreadable = self.unreadable.drain(..).map(|one| one.attribute);
        self.repair.rotation = unreadable.find(|name| ["rpy", QUATERNION].contains(name));
        Ok(name)
    }

    /// Writes a joint, and returns its name.
    fn joint<'e>(&mut self, joint: &'e Element) -> Result<&'e str, ModelError> {
        let name = self.name_in(joint, "name")?;
        for end in ["parent", "child"] {
            let message = format!("this <joint> has no <{end}>");
            let missing = || syntax(self.text, joint.span.start, &message);
            self.name_in(joint.child(end).ok_or_else(missing)?, "link")?;
        }
        let kind = joint.attribute("type").unwrap_or_default();
        let lower_case = kind.to_ascii_lowercase();
        if !JOINT_TYPES.contains(&lower_case.as_str()) {
            return Err(ModelError::JointKind {
                joint: name.to_owned(),
                kind: kind.to_owned(),
            });
        }
        self.element(joint, "joint");
        let has_axis = ["revolute", "continuous", "prismatic"].contains(&lower_case.as_str());
        let mut unreadable = self.unreadable.drain(..);
        let is_fault = |one: &Unreadable| match one.element {
            "origin" => true,
            "axis" => has_axis,
            _ => false,
        };
        let fault = unreadable.find(is_fault);
        fault.map_or(Ok(name), |fault| Err(fault.of("joint", name)))
    }

    /// Writes what is kept of an element with the name `element`.
    fn element(&mut self, given: &Element, element: &'static str) {
        self.report(given, element);
        self.kept += 1;
        self.piece += &format!("<{element}");
        for &attribute in attributes(element) {
            let value = self.value(given, element, attribute);
            self.piece += &format!(" {}=\"{}\"", attribute.0, escape(value));
        }
        self.piece += ">";
        for child in children(element) {
            match given.child(child) {
                Some(given) => self.element(given, child),
                None if REQUIRED.contains(child) => self.element(&Element::default(), child),
                None => {}
            }
        }
        if element == "link" {
            self.repair.has_visual = given.child("visual").is_some();
            given
                .children("collision")
                .for_each(|one| self.collision(one));
        }
        self.piece += &format!("</{element}>");
    }

    /// Writes a `<collision>`, or notes why it is left out.
    fn collision(&mut self, collision: &Element) {
        let (start, before) = (self.piece.len(), self.unreadable.len());
        let ignored = self.repair.ignored.len();
        self.kept += 2; // `<collision>` and `<geometry>`
        let geometry = collision.child("geometry");
        let shapes = geometry.map_or(&[][..], |geometry| &geometry.children);
        let shape = shapes.iter().find(|shape| !is_foreign(&shape.name));
        let known = shape.and_then(|shape| SHAPES.into_iter().find(|&known| shape.name == known));
        self.piece += "<collision>";
        if let Some(origin) = collision.child("origin") {
            self.element(origin, "origin");
        }
        // A misspelled attribute of its origin means nothing for motion and mass.
        self.repair.ignored.truncate(ignored);
        self.piece += "<geometry>";
        if let (Some(shape), Some(known)) = (shape, known) {
            self.element(shape, known);
        }
        self.piece += "</geometry></collision>";
        let fault = self.unreadable.drain(before..).next();
        if known.is_none() || fault.is_some() {
            self.piece.truncate(start);
            let element = shape.map_or("", |shape| &shape.name).to_owned();
            self.repair.shapes.push(LeftOut { element, fault });
        }
    }

    /// Returns what is written for an attribute of an element.
    fn value(
        &mut self,
        given: &Element,
        element: &'static str,
        (name, count, default): Attribute,
    ) -> String {
        let quaternion = given.attribute(QUATERNION).filter(|_| name == "rpy");
        let (attribute, text, expected) = match (given.attribute(name), quaternion) {
            (None, None) => return default.to_owned(),
            (Some(text), _) if name == "type" => return text.to_ascii_lowercase(),
            (Some(text), _) if count == 0 || finite_numbers(text, count).is_some() => {
                return text.to_owned();
            }
            (None, Some(text)) => match roll_pitch_yaw(text) {
                Some([roll, pitch, yaw]) => return format!("{roll} {pitch} {yaw}"),
                None => (QUATERNION, text, 4),
            },
            (Some(text), _) => (name, text, count),
        };
        self.unreadable.push(Unreadable {
            element,
            attribute,
            text: shortened(text, LONGEST_TEXT),
            count: expected,
        });
        vec![UNKNOWN; count].join(" ")
    }

    /// Notes the parts of an element that the format does not have.
    fn report(&mut self, given: &Element, element: &'static str) {
        let ignored = &mut self.repair.ignored;
        let mut ignore = |part, name: &str| ignored.push((element, part, name.to_owned()));
        let is_leaf = LEAVES.contains(&element);
        for (name, _) in given.attributes.iter().filter(|_| is_leaf) {
            let is_known = attributes(element).iter().any(|known| known.0 == name)
                || (element, name.as_str()) == ("origin", QUATERNION);
            if !(is_known || name == "xmlns" || is_foreign(name)) {
                ignore(IgnoredPart::UnknownAttribute, name);
            }
        }
        if !is_leaf && children(element).is_empty() {
            return;
        }
        let mut met: Vec<&str> = Vec::new();
        for child in given.children.iter().filter(|one| !is_foreign(&one.name)) {
            let name = child.name.as_str();
            if !children(element)
                .iter()
                .chain(unused(element))
                .any(|known| *known == name)
            {
                ignore(IgnoredPart::UnknownElement, name);
            } else if !met.contains(&name) {
                met.push(name);
            } else if !REPEATABLE.contains(&name) {
                ignore(IgnoredPart::RepeatedElement, name);
            }
        }
    }

    /// Returns the name in an attribute of an element.
    ///
    /// # Errors
    /// Returns [`ModelError::Syntax`], which names the line, if there is none.
    fn name_in<'e>(&self, element: &'e Element, attribute: &str) -> Result<&'e str, ModelError> {
        element.attribute(attribute).ok_or_else(|| {
            let message = format!("this <{}> has no attribute `{attribute}`", element.name);
            syntax(self.text, element.span.start, &message)
        })
    }
}

/// Returns whether a name has a prefix, as in `drake:acceleration`: it belongs to another program.
fn is_foreign(name: &str) -> bool {
    name.contains(':')
}

/// Returns `count` finite numbers with white space between them, or `None` for another text.
fn finite_numbers(text: &str, count: usize) -> Option<Vec<f64>> {
    let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    let numbers = numbers.ok().filter(|numbers| numbers.len() == count);
    numbers.filter(|numbers| numbers.iter().all(|number| number.is_finite()))
}

/// Returns roll, pitch and yaw of a quaternion, or `None` for a text that is none.
///
/// urdf-rs converts quaternions itself, but for documents of version 1.1 and later only, and where
/// the pitch is near a right angle with an error of up to 0.3°.
fn roll_pitch_yaw(text: &str) -> Option<[f64; 3]> {
    let quaternion = Quaternion::from(<[f64; 4]>::try_from(finite_numbers(text, 4)?).ok()?);
    let r = UnitQuaternion::try_new(quaternion, 1e-9)?.to_rotation_matrix();
    let yaw = r[(1, 0)].atan2(r[(0, 0)]);
    // R_z(-yaw) R = R_y(pitch) R_x(roll) has entries that stay exact at a right angle of pitch.
    let (sin, cos) = yaw.sin_cos();
    let pitch = (-r[(2, 0)]).atan2(cos * r[(0, 0)] + sin * r[(1, 0)]);
    let sin_roll = sin * r[(0, 2)] - cos * r[(1, 2)];
    let cos_roll = cos * r[(1, 1)] - sin * r[(0, 1)];
    Some([sin_roll.atan2(cos_roll), pitch, yaw])
}
