//! Serialisable structures as Python objects: each becomes an instance of the class of its name in
//! `tactid._results.records`, and numbers in rows of equal length become one array.

use std::borrow::Cow;
use std::fmt::Display;

use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString};
use pyo3::{IntoPyObjectExt, intern};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Serialize;
use serde::ser::{Error as _, Impossible, SerializeMap, SerializeSeq, SerializeStruct, Serializer};
use serde::ser::{SerializeTuple, SerializeTupleStruct};

use crate::arrays::output;

/// Returns the fields of a structure by their names, of which the inner structures are instances of
/// their classes.
pub(crate) fn fields<'py, T: Serialize>(
    py: Python<'py>,
    structure: &T,
) -> PyResult<Bound<'py, PyDict>> {
    match structure.serialize(ToPython(py)).map_err(|error| error.0)? {
        Value::Structure(_, fields) => Ok(fields),
        other => Ok(other
            .into_object(py)
            .map_err(|error| error.0)?
            .cast_into()?),
    }
}

/// What a value becomes, numbers not yet as objects of Python.
enum Value<'py> {
    Object(Bound<'py, PyAny>),
    Number(f64),
    Flag(bool),
    /// Numbers row by row, and the shape of their array.
    Numbers(Vec<f64>, Vec<usize>),
    Flags(Vec<bool>),
    /// The name of a structure and its fields.
    Structure(&'static str, Bound<'py, PyDict>),
}

impl<'py> Value<'py> {
    fn into_object(self, py: Python<'py>) -> Result<Bound<'py, PyAny>, Error> {
        Ok(match self {
            Self::Object(object) => object,
            Self::Number(number) => number.into_pyobject(py)?.into_any(),
            Self::Flag(flag) => flag.into_pyobject(py)?.to_owned().into_any(),
            Self::Numbers(numbers, shape) => output(py, numbers, None, &shape)?.into_any(),
            Self::Flags(flags) => PyArray1::from_vec(py, flags).into_any(),
            Self::Structure(name, fields) => class(py, name)?.call((), Some(&fields))?,
        })
    }
}

/// Returns the class of a structure.
fn class<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    let classes = py.import(intern!(py, "tactid._results.records"))?;
    classes.getattr(intern!(py, "CLASSES"))?.get_item(name)
}

/// An error of Python.
#[derive(Debug)]
struct Error(PyErr);

impl<T: Into<PyErr>> From<T> for Error {
    fn from(error: T) -> Self {
        Self(error.into())
    }
}

impl Display for Error {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(formatter)
    }
}

impl std::error::Error for Error {}

impl serde::ser::Error for Error {
    fn custom<T: Display>(message: T) -> Self {
        Self(PyValueError::new_err(message.to_string()))
    }
}

/// The serializer.
#[derive(Clone, Copy)]
struct ToPython<'py>(Python<'py>);

impl<'py> ToPython<'py> {
    fn object<T: IntoPyObjectExt<'py>>(self, value: T) -> Result<Value<'py>, Error> {
        Ok(Value::Object(value.into_bound_py_any(self.0)?))
    }
}

/// Serialises integers and text as objects of Python.
macro_rules! objects {
    ($($method:ident: $type:ty),*) => {
        $(fn $method(self, value: $type) -> Result<Value<'py>, Error> {
            self.object(value)
        })*
    };
}

impl<'py> Serializer for ToPython<'py> {
    type Ok = Value<'py>;
    type Error = Error;
    type SerializeSeq = Sequence<'py>;
    type SerializeTuple = Sequence<'py>;
    type SerializeTupleStruct = Sequence<'py>;
    type SerializeTupleVariant = Impossible<Value<'py>, Error>;
    type SerializeMap = Structure<'py>;
    type SerializeStruct = Structure<'py>;
    type SerializeStructVariant = Impossible<Value<'py>, Error>;

    objects!(serialize_i8: i8, serialize_i16: i16, serialize_i32: i32, serialize_i64: i64);
    objects!(serialize_u8: u8, serialize_u16: u16, serialize_u32: u32, serialize_u64: u64);
    objects!(serialize_char: char, serialize_str: &str, serialize_bytes: &[u8]);

    fn serialize_bool(self, value: bool) -> Result<Value<'py>, Error> {
        Ok(Value::Flag(value))
    }

    fn serialize_f32(self, value: f32) -> Result<Value<'py>, Error> {
        Ok(Value::Number(value.into()))
    }

    fn serialize_f64(self, value: f64) -> Result<Value<'py>, Error> {
        Ok(Value::Number(value))
    }

    fn serialize_none(self) -> Result<Value<'py>, Error> {
        self.serialize_unit()
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<Value<'py>, Error> {
        value.serialize(self)
    }

    fn serialize_unit(self) -> Result<Value<'py>, Error> {
        Ok(Value::Object(self.0.None().into_bound(self.0)))
    }

    fn serialize_unit_struct(self, _: &'static str) -> Result<Value<'py>, Error> {
        self.serialize_unit()
    }

    fn serialize_unit_variant(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
    ) -> Result<Value<'py>, Error> {
        Ok(Value::Object(PyString::intern(self.0, variant).into_any()))
    }

    /// A body is its ten values in the class of its name.
    fn serialize_newtype_struct<T: Serialize + ?Sized>(
        self,
        name: &'static str,
        value: &T,
    ) -> Result<Value<'py>, Error> {
        let inner = value.serialize(self)?;
        if name != "MassProperties" {
            return Ok(inner);
        }
        let values = inner.into_object(self.0)?;
        let body = self.0.get_type::<crate::inertia::MassProperties>();
        Ok(Value::Object(
            body.call_method1(intern!(self.0, "from_values"), (values,))?,
        ))
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        name: &'static str,
        _: u32,
        variant: &'static str,
        _: &T,
    ) -> Result<Value<'py>, Error> {
        Err(no_class(name, variant))
    }

    fn serialize_seq(self, length: Option<usize>) -> Result<Sequence<'py>, Error> {
        let (py, capacity) = (self.0, length.unwrap_or(0));
        Ok(Sequence {
            py,
            capacity,
            items: Items::None,
        })
    }

    fn serialize_tuple(self, length: usize) -> Result<Sequence<'py>, Error> {
        self.serialize_seq(Some(length))
    }

    fn serialize_tuple_struct(
        self,
        _: &'static str,
        length: usize,
    ) -> Result<Sequence<'py>, Error> {
        self.serialize_seq(Some(length))
    }

    fn serialize_tuple_variant(
        self,
        name: &'static str,
        _: u32,
        variant: &'static str,
        _: usize,
    ) -> Result<Self::SerializeTupleVariant, Error> {
        Err(no_class(name, variant))
    }

    /// A map is a structure with another one's fields among its own, which loses its name.
    fn serialize_map(self, length: Option<usize>) -> Result<Structure<'py>, Error> {
        self.serialize_struct("", length.unwrap_or(0))
    }

    fn serialize_struct(self, name: &'static str, _: usize) -> Result<Structure<'py>, Error> {
        let (serializer, fields) = (self, PyDict::new(self.0));
        Ok(Structure {
            serializer,
            name,
            fields,
            key: None,
        })
    }

    fn serialize_struct_variant(
        self,
        name: &'static str,
        _: u32,
        variant: &'static str,
        _: usize,
    ) -> Result<Self::SerializeStructVariant, Error> {
        Err(no_class(name, variant))
    }

    fn is_human_readable(&self) -> bool {
        false
    }
}

fn no_class(name: &str, variant: &str) -> Error {
    Error::custom(format!("the variant {variant} of {name} has no class"))
}

/// A sequence that grows.
struct Sequence<'py> {
    py: Python<'py>,
    capacity: usize,
    items: Items<'py>,
}

/// Items of a sequence.
enum Items<'py> {
    None,
    Numbers {
        numbers: Vec<f64>,
        row: Vec<usize>,
        count: usize,
    },
    Flags(Vec<bool>),
    Objects(Vec<Bound<'py, PyAny>>),
}

impl<'py> Sequence<'py> {
    fn push(&mut self, value: Value<'py>) -> Result<(), Error> {
        if matches!(self.items, Items::None) {
            self.items = self.first(&value);
        }
        match (&mut self.items, value) {
            (
                Items::Numbers {
                    numbers,
                    row,
                    count,
                },
                Value::Number(number),
            ) if row.is_empty() => {
                numbers.push(number);
                *count += 1;
            }
            (
                Items::Numbers {
                    numbers,
                    row,
                    count,
                },
                Value::Numbers(more, shape),
            ) if *row == shape => {
                numbers.extend(more);
                *count += 1;
            }
            (Items::Flags(flags), Value::Flag(flag)) => flags.push(flag),
            (Items::Objects(objects), value) => objects.push(value.into_object(self.py)?),
            _ => return Err(Error::custom("a sequence has entries of different shapes")),
        }
        Ok(())
    }

    /// Returns the items of a sequence, still none, that begins with this value.
    fn first(&self, value: &Value<'_>) -> Items<'py> {
        let numbers = |row: Vec<usize>| Items::Numbers {
            numbers: Vec::with_capacity(self.capacity * row.iter().product::<usize>()),
            row,
            count: 0,
        };
        match value {
            Value::Number(_) => numbers(Vec::new()),
            Value::Numbers(_, shape) => numbers(shape.clone()),
            Value::Flag(_) => Items::Flags(Vec::with_capacity(self.capacity)),
            Value::Object(_) | Value::Flags(_) | Value::Structure(..) => {
                Items::Objects(Vec::with_capacity(self.capacity))
            }
        }
    }

    fn finish(self) -> Result<Value<'py>, Error> {
        Ok(match self.items {
            Items::None => Value::Object(PyList::empty(self.py).into_any()),
            Items::Numbers {
                numbers,
                mut row,
                count,
            } => {
                row.insert(0, count);
                Value::Numbers(numbers, row)
            }
            Items::Flags(flags) => Value::Flags(flags),
            Items::Objects(objects) => Value::Object(PyList::new(self.py, objects)?.into_any()),
        })
    }
}

/// Implements the traits of a sequence for each way in which serde calls it.
macro_rules! sequence {
    ($($trait:ident: $method:ident),*) => {
        $(impl<'py> $trait for Sequence<'py> {
            type Ok = Value<'py>;
            type Error = Error;

            fn $method<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Error> {
                self.push(value.serialize(ToPython(self.py))?)
            }

            fn end(self) -> Result<Value<'py>, Error> {
                self.finish()
            }
        })*
    };
}

sequence!(SerializeSeq: serialize_element, SerializeTuple: serialize_element, SerializeTupleStruct: serialize_field);

/// A structure that gets its fields.
struct Structure<'py> {
    serializer: ToPython<'py>,
    name: &'static str,
    fields: Bound<'py, PyDict>,
    key: Option<Bound<'py, PyAny>>,
}

impl<'py> SerializeMap for Structure<'py> {
    type Ok = Value<'py>;
    type Error = Error;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), Error> {
        self.key = Some(
            key.serialize(self.serializer)?
                .into_object(self.serializer.0)?,
        );
        Ok(())
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Error> {
        let value = value.serialize(self.serializer)?;
        let value = value.into_object(self.serializer.0)?;
        Ok(self.fields.set_item(self.key.take(), value)?)
    }

    fn end(self) -> Result<Value<'py>, Error> {
        Ok(Value::Structure(self.name, self.fields))
    }
}

impl<'py> SerializeStruct for Structure<'py> {
    type Ok = Value<'py>;
    type Error = Error;

    fn serialize_field<T: Serialize + ?Sized>(
        &mut self,
        name: &'static str,
        value: &T,
    ) -> Result<(), Error> {
        let value = value
            .serialize(self.serializer)?
            .into_object(self.serializer.0)?;
        Ok(self
            .fields
            .set_item(PyString::intern(self.serializer.0, name), value)?)
    }

    fn end(self) -> Result<Value<'py>, Error> {
        Ok(Value::Structure(self.name, self.fields))
    }
}

/// Fields that are added to those of a structure where it is converted.
macro_rules! added {
    ($($name:ident: $title:literal),*) => {
        $(
            #[doc = concat!("A list of ", $title, ", which is added where a structure is converted.")]
            pub(crate) struct $name;

            impl Serialize for $name {
                fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                    serializer.collect_seq(std::iter::empty::<()>())
                }
            }

            impl JsonSchema for $name {
                fn inline_schema() -> bool {
                    true
                }

                fn schema_name() -> Cow<'static, str> {
                    stringify!($name).into()
                }

                fn json_schema(_: &mut SchemaGenerator) -> Schema {
                    let entry = concat!("#/$defs/", $title);
                    json_schema!({"type": "array", "items": {"$ref": entry}})
                }
            }
        )*
    };
}

added!(
    AddedFindings: "Finding",
    AddedCalibrationFindings: "CalibrationFinding",
    AddedFaults: "DataFault"
);
