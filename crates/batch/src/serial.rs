//! Serialisation of matrices of a recording's result.

use std::borrow::Cow;

use nalgebra::{Dyn, OMatrix, SMatrix, SVector, U10};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Ten numbers as a sequence.
pub(crate) mod ten {
    use super::{Deserialize, Deserializer, SVector, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(
        of: &SVector<f64, 10>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        of.as_slice().serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<SVector<f64, 10>, D::Error> {
        <[f64; 10]>::deserialize(from).map(SVector::from)
    }
}

/// A matrix of ten rows as the sequence of its columns.
pub(crate) mod columns {
    use super::{Deserialize, Deserializer, Dyn, OMatrix, Serialize, Serializer, U10};

    pub(crate) fn serialize<S: Serializer>(
        of: &OMatrix<f64, U10, Dyn>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        of.as_slice().as_chunks::<10>().0.serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<OMatrix<f64, U10, Dyn>, D::Error> {
        let columns = Vec::<[f64; 10]>::deserialize(from)?;
        Ok(OMatrix::from_fn_generic(
            U10,
            Dyn(columns.len()),
            |row, column| columns[column][row],
        ))
    }
}

/// A matrix of ten rows and columns as the sequence of its columns.
pub(crate) mod square {
    use super::{Deserialize, Deserializer, SMatrix, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(
        of: &SMatrix<f64, 10, 10>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        of.data.0.serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<SMatrix<f64, 10, 10>, D::Error> {
        <[[f64; 10]; 10]>::deserialize(from).map(SMatrix::from)
    }
}

/// Numbers in rows of equal length.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Number of columns.
    pub columns: usize,
    /// The numbers, row by row.
    pub values: Vec<f64>,
}

impl Table {
    /// Returns the rows.
    pub fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.values.chunks_exact(self.columns.max(1))
    }
}

impl Serialize for Table {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.rows())
    }
}

impl JsonSchema for Table {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Table".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        Vec::<Vec<f64>>::json_schema(generator)
    }
}
