//! Numbers in the attributes of a URDF.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::element::Element;
use crate::{ModelError, shortened};

/// Largest number of characters of an attribute in an error.
const LONGEST_TEXT: usize = 200;

/// An attribute whose text is not the finite numbers that it must be.
#[derive(Clone, Debug)]
pub(super) struct Unreadable {
    pub(super) attribute: &'static str,
    /// The element and its attribute, such as `origin xyz="0 0"`.
    given: String,
    expected: usize,
}

impl Unreadable {
    fn new(element: &Element, attribute: &'static str, expected: usize) -> Self {
        let text = element.attribute(attribute).unwrap_or_default();
        let shown = shortened(text, LONGEST_TEXT);
        Self {
            attribute,
            given: format!("{} {attribute}=\"{shown}\"", element.name),
            expected,
        }
    }

    /// Returns the error for the attribute in a `link` or `joint` with a name.
    pub(super) fn of(self, kind: &'static str, name: &str) -> ModelError {
        ModelError::Numbers {
            kind,
            name: name.to_owned(),
            given: self.given,
            expected: self.expected,
        }
    }
}

/// Returns the `N` numbers of an attribute, or `None` if the element does not have it.
///
/// # Errors
/// Returns [`Unreadable`] if the text is not `N` finite numbers with white space between them.
pub(super) fn numbers<const N: usize>(
    element: &Element,
    attribute: &'static str,
) -> Result<Option<[f64; N]>, Unreadable> {
    let Some(given) = element.attribute(attribute) else {
        return Ok(None);
    };
    let read: Result<Vec<f64>, _> = given.split_whitespace().map(str::parse).collect();
    let read = read.ok().and_then(|read| <[f64; N]>::try_from(read).ok());
    let finite = read.filter(|read| read.iter().all(|value| value.is_finite()));
    finite
        .map(Some)
        .ok_or_else(|| Unreadable::new(element, attribute, N))
}

/// Returns the number of an attribute, or `None` if the element does not have it.
///
/// # Errors
/// Returns [`Unreadable`] if the text is not a finite number.
pub(super) fn number(
    element: &Element,
    attribute: &'static str,
) -> Result<Option<f64>, Unreadable> {
    Ok(numbers::<1>(element, attribute)?.map(|[value]| value))
}

/// Returns the translation of an `<origin>`, m; zero where it has none.
pub(super) fn translation(origin: &Element) -> Result<Translation3<f64>, Unreadable> {
    Ok(numbers(origin, "xyz")?.map_or_else(Translation3::identity, Translation3::from))
}

/// Returns the rotation of an `<origin>`: its roll, pitch and yaw, or the quaternion of URDF 1.2.
pub(super) fn rotation(origin: &Element) -> Result<UnitQuaternion<f64>, Unreadable> {
    if let Some([roll, pitch, yaw]) = numbers(origin, "rpy")? {
        return Ok(UnitQuaternion::from_euler_angles(roll, pitch, yaw));
    }
    let Some(quaternion) = numbers::<4>(origin, "quat_xyzw")? else {
        return Ok(UnitQuaternion::identity());
    };
    let unit = UnitQuaternion::try_new(Quaternion::from(quaternion), 1e-9);
    unit.ok_or_else(|| Unreadable::new(origin, "quat_xyzw", 4))
}

/// Returns the `<origin>` of an element as a transform, the identity where it has none.
pub(super) fn origin(owner: &Element) -> Result<Isometry3<f64>, Unreadable> {
    let Some(origin) = owner.child("origin") else {
        return Ok(Isometry3::identity());
    };
    Ok(Isometry3::from_parts(
        translation(origin)?,
        rotation(origin)?,
    ))
}

/// Returns the `xyz` of an `<axis>` of a joint, `(1, 0, 0)` where there is none.
pub(super) fn axis(joint: &Element) -> Result<Vector3<f64>, Unreadable> {
    let axis = joint.child("axis").map(|axis| numbers(axis, "xyz"));
    Ok(axis
        .transpose()?
        .flatten()
        .map_or_else(Vector3::x, Vector3::from))
}
