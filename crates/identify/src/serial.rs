//! Serialisation of matrices, bodies and tables of numbers, and their JSON schemas.

use std::borrow::Cow;
use std::marker::PhantomData;

use nalgebra::Vector3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A vector as a sequence of its entries.
pub mod vector {
    use super::{Deserialize, Deserializer, Serialize, Serializer, Vector3};

    /// Serialises a vector.
    ///
    /// # Errors
    /// Returns the errors of the serializer.
    pub fn serialize<S: Serializer>(of: &Vector3<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        of.as_slice().serialize(serializer)
    }

    /// Deserialises a vector.
    ///
    /// # Errors
    /// Returns the errors of the deserializer, and one if there are not three entries.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vector3<f64>, D::Error> {
        <[f64; 3]>::deserialize(from).map(Vector3::from)
    }
}

/// Serialises what an estimator may not know; as NaN where it does not.
pub(crate) fn or_nan<const N: usize, S: Serializer>(
    known: &Option<[f64; N]>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    known
        .unwrap_or([f64::NAN; N])
        .as_slice()
        .serialize(serializer)
}

/// Schema of something that a payload has for each of its [ten values](crate::VALUE_NAMES): by
/// their names.
pub struct TenValues<T>(PhantomData<T>);

impl<T: JsonSchema> JsonSchema for TenValues<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("TenValues_{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let one = generator.subschema_for::<T>();
        json_schema!({
            "type": "object",
            "description": "What belongs to mass, kg, centre of mass, m, and inertia about it, kg m², along the axes of the frame.",
            "properties": {
                "mass": one,
                "com": {
                    "type": "object",
                    "properties": {"x": one, "y": one, "z": one},
                    "required": ["x", "y", "z"],
                    "additionalProperties": false,
                },
                "inertia": {
                    "type": "object",
                    "properties": {"xx": one, "xy": one, "xz": one, "yy": one, "yz": one, "zz": one},
                    "required": ["xx", "xy", "xz", "yy", "yz", "zz"],
                    "additionalProperties": false,
                },
            },
            "required": ["mass", "com", "inertia"],
            "additionalProperties": false,
        })
    }
}
