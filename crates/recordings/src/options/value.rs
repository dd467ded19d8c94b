//! Values of options: how each is read, and the numbers in it.

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::{Matrix3, Vector3};
use serde::de::Error;
use serde::{Deserialize, Deserializer};
use tactid_dynamics::MassProperties;
use tactid_identify::{BoundingBox, Method};

use super::Kind;

/// A type of the values of options.
pub(crate) trait Value: Sized {
    /// Kind of the values, for the table of options.
    const KIND: Kind;

    /// Reads a value.
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

/// Reads one of some names, and returns what it stands for.
pub(crate) fn choice<'de, D: Deserializer<'de>, T: Copy>(
    deserializer: D,
    choices: &[(&str, T)],
) -> Result<T, D::Error> {
    let given = String::deserialize(deserializer)?;
    let chosen = choices.iter().find(|(name, _)| *name == given);
    chosen
        .map(|(_, value)| *value)
        .ok_or_else(|| D::Error::custom(format!("there is no choice {given}")))
}

impl Value for bool {
    const KIND: Kind = Kind::Flag;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        /// Reads a truth value and nothing that could be taken for one, such as a text.
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Flag {
            Flag(bool),
        }
        let Flag::Flag(flag) = Flag::deserialize(deserializer)?;
        Ok(flag)
    }

    fn is_effective(&self) -> bool {
        *self
    }
}

impl Value for f64 {
    const KIND: Kind = Kind::Number;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::deserialize(deserializer)
    }

    fn numbers(&self) -> Vec<f64> {
        vec![*self]
    }

    fn is_effective(&self) -> bool {
        *self != 0.0
    }
}

impl Value for u32 {
    const KIND: Kind = Kind::Count;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::deserialize(deserializer)
    }
}

impl Value for String {
    const KIND: Kind = Kind::Text;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::deserialize(deserializer)
    }
}

impl Value for PathBuf {
    const KIND: Kind = Kind::Path;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::deserialize(deserializer)
    }
}

impl Value for Vec<String> {
    const KIND: Kind = Kind::Texts;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        OneOrSeveral::deserialize(deserializer).map(Self::from)
    }

    fn is_effective(&self) -> bool {
        !self.is_empty()
    }
}

impl Value for BTreeMap<String, String> {
    const KIND: Kind = Kind::Names;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::deserialize(deserializer)
    }
}

impl Value for Vector3<f64> {
    const KIND: Kind = Kind::Vector;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        <[f64; 3]>::deserialize(deserializer).map(Self::from)
    }

    fn numbers(&self) -> Vec<f64> {
        self.as_slice().to_vec()
    }
}

impl Value for Vec<f64> {
    const KIND: Kind = Kind::Numbers;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        OneOrSeveral::deserialize(deserializer).map(Self::from)
    }

    fn numbers(&self) -> Vec<f64> {
        self.clone()
    }
}

impl Value for Vec<[f64; 6]> {
    const KIND: Kind = Kind::Wrenches;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        OneOrSeveral::deserialize(deserializer).map(Self::from)
    }

    fn numbers(&self) -> Vec<f64> {
        self.as_flattened().to_vec()
    }
}

/// Its corners are checked by [`BoundingBox`] itself.
impl Value for BoundingBox {
    const KIND: Kind = Kind::Box;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let [min, max] = <[[f64; 3]; 2]>::deserialize(deserializer)?;
        let (min, max) = (min.into(), max.into());
        Ok(Self { min, max })
    }
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

impl Value for Method {
    const KIND: Kind = Kind::Choice(&["tactile", "effort", "joint-sensing", "combined"]);

    /// The recording decides whether the combined method uses efforts.
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let methods = [
            Self::Tactile,
            Self::Effort,
            Self::JointSensing,
            Self::Combined { effort: true },
        ];
        choice(deserializer, &methods.map(|method| (method.name(), method)))
    }
}
