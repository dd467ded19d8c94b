//! Values of options: how each is read, and the numbers in it.

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::{Matrix3, Vector3};
use serde::de::Error;
use serde::{Deserialize, Deserializer};
use tactid_dynamics::{MassProperties, Urdf};
use tactid_identify::{ActsOn, BoundingBox, EffortContent, Method};

use crate::Kind;

/// A type of the values of options.
pub trait Value: Sized {
    /// Kind of the values, for the table of options.
    const KIND: Kind;

    /// Reads a value.
    ///
    /// # Errors
    /// Returns the error of a value that is none of the type.
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error>;

    /// Returns the numbers of a value, which the range of the option is for.
    fn numbers(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Returns whether the value asks for something else than what holds without it.
    fn is_effective(&self) -> bool {
        true
    }
}

/// One of something, or several.
#[derive(Deserialize)]
#[serde(untagged)]
enum OneOrSeveral<T> {
    One(T),
    Several(Vec<T>),
}

impl<T> From<OneOrSeveral<T>> for Vec<T> {
    fn from(given: OneOrSeveral<T>) -> Self {
        match given {
            OneOrSeveral::One(one) => vec![one],
            OneOrSeveral::Several(several) => several,
        }
    }
}

/// A truth value and nothing that could be taken for one, such as a text.
#[derive(Deserialize)]
#[serde(untagged)]
enum Flag {
    Flag(bool),
}

impl From<Flag> for bool {
    fn from(Flag::Flag(flag): Flag) -> Self {
        flag
    }
}

/// Writes the kind of a [`Value`], and its reading from what serde reads as another type.
#[macro_export]
macro_rules! read_as {
    ($kind:expr, $type:ty) => {
        const KIND: $crate::Kind = $kind;

        fn read<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            <$type as serde::Deserialize>::deserialize(deserializer).map(Self::from)
        }
    };
}
impl Value for bool {
    read_as!(Kind::Flag, Flag);

    fn is_effective(&self) -> bool {
        *self
    }
}

impl Value for f64 {
    read_as!(Kind::Number, f64);

    fn numbers(&self) -> Vec<f64> {
        vec![*self]
    }

    fn is_effective(&self) -> bool {
        *self != 0.0
    }
}

impl Value for ActsOn {
    read_as!(Kind::Choice(&["payload", "sensor"]), Self);

    fn is_effective(&self) -> bool {
        *self == Self::Sensor
    }
}

impl Value for u32 {
    read_as!(Kind::Count, u32);
}

impl Value for u64 {
    read_as!(Kind::Count, u64);
}

impl Value for String {
    read_as!(Kind::Text, String);
}

impl Value for PathBuf {
    read_as!(Kind::Path, PathBuf);
}

impl Value for Vec<PathBuf> {
    read_as!(Kind::Recordings, OneOrSeveral<PathBuf>);
}

/// Read from the path of its file.
impl Value for Urdf {
    const KIND: Kind = Kind::Path;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let path = PathBuf::deserialize(deserializer)?;
        Self::from_file(&path).map_err(D::Error::custom)
    }
}

impl Value for BTreeMap<String, String> {
    read_as!(Kind::Names, BTreeMap<String, String>);
}

impl Value for Vec<String> {
    read_as!(Kind::Texts, OneOrSeveral<String>);

    fn is_effective(&self) -> bool {
        !self.is_empty()
    }
}

impl Value for Vector3<f64> {
    read_as!(Kind::Vector, [f64; 3]);

    fn numbers(&self) -> Vec<f64> {
        self.as_slice().to_vec()
    }
}

impl Value for Vec<f64> {
    read_as!(Kind::Numbers, OneOrSeveral<f64>);

    fn numbers(&self) -> Vec<f64> {
        self.clone()
    }
}

impl Value for [f64; 6] {
    read_as!(Kind::Wrench, [f64; 6]);

    fn numbers(&self) -> Vec<f64> {
        self.to_vec()
    }
}

impl Value for Vec<[f64; 3]> {
    read_as!(Kind::EachPoint, OneOrSeveral<[f64; 3]>);

    fn numbers(&self) -> Vec<f64> {
        self.as_flattened().to_vec()
    }
}

impl Value for Vec<[[f64; 3]; 3]> {
    read_as!(Kind::EachInertia, OneOrSeveral<[[f64; 3]; 3]>);

    fn numbers(&self) -> Vec<f64> {
        self.as_flattened().as_flattened().to_vec()
    }
}

impl Value for Vec<[f64; 6]> {
    read_as!(Kind::Wrenches, OneOrSeveral<[f64; 6]>);

    fn numbers(&self) -> Vec<f64> {
        self.as_flattened().to_vec()
    }
}

/// Its corners are checked by [`BoundingBox`] itself.
impl Value for BoundingBox {
    const KIND: Kind = Kind::Box;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        <[[f64; 3]; 2]>::deserialize(deserializer).map(between)
    }
}

/// Their corners are checked by [`BoundingBox`] itself.
impl Value for BTreeMap<String, BoundingBox> {
    const KIND: Kind = Kind::Boxes;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let boxes = BTreeMap::<String, [[f64; 3]; 2]>::deserialize(deserializer)?;
        let boxes = boxes.into_iter();
        Ok(boxes
            .map(|(name, corners)| (name, between(corners)))
            .collect())
    }
}

/// Returns the box between two corners, m.
fn between([min, max]: [[f64; 3]; 2]) -> BoundingBox {
    let (min, max) = (min.into(), max.into());
    BoundingBox { min, max }
}

impl Value for MassProperties {
    const KIND: Kind = Kind::Body;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Body {
            mass_kg: f64,
            center_of_mass: [f64; 3],
            inertia: [[f64; 3]; 3],
        }
        let body = Body::deserialize(deserializer)?;
        Ok(Self {
            mass_kg: body.mass_kg,
            center_of_mass: body.center_of_mass.into(),
            inertia: Matrix3::from(body.inertia).transpose(),
        })
    }

    fn numbers(&self) -> Vec<f64> {
        let vectors = self.center_of_mass.iter().chain(&self.inertia);
        std::iter::once(&self.mass_kg)
            .chain(vectors)
            .copied()
            .collect()
    }
}

impl Value for EffortContent {
    read_as!(
        Kind::Choice(&["measured", "without-gravity", "external"]),
        Self
    );

    fn is_effective(&self) -> bool {
        *self != Self::Measured
    }
}

impl Value for Method {
    const KIND: Kind = Kind::Choice(&["tactile", "effort", "joint-sensing", "combined"]);

    /// The recording decides whether the combined method uses efforts.
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let given = String::deserialize(deserializer)?;
        let methods = [
            Self::Tactile,
            Self::Effort,
            Self::JointSensing,
            Self::Combined { effort: true },
        ];
        let chosen = methods.into_iter().find(|method| method.name() == given);
        chosen.ok_or_else(|| D::Error::custom(format!("there is no method {given}")))
    }
}
