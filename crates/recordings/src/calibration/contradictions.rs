//! Contradictions of a calibration, as its file has them.

use tactid_calibrate::Contradiction;
use toml::Table;

use super::check::{Fault, Place};

/// Returns the tables of contradictions.
pub(super) fn tables(contradictions: &[Contradiction]) -> Result<Vec<Table>, toml::ser::Error> {
    contradictions.iter().map(Table::try_from).collect()
}

/// Reads the tables of contradictions in a text, whose keys must all be known: serde ignores
/// unknown ones beside what is flattened.
pub(super) fn read(tables: Vec<Table>, text: &str) -> Result<Vec<Contradiction>, Fault> {
    let read = |(index, table): (usize, Table)| {
        let place = Place::numbered(text, "contradiction", index);
        let found: Contradiction = table
            .clone()
            .try_into()
            .map_err(|error: toml::de::Error| place.fault("assumption", error.message()))?;
        let known = Table::try_from(&found)
            .map_err(|error| place.fault("assumption", &error.to_string()))?;
        match table.keys().find(|key| !known.contains_key(*key)) {
            Some(key) => Err(place.fault(key, "the key is unknown")),
            None => Ok(found),
        }
    };
    tables.into_iter().enumerate().map(read).collect()
}
