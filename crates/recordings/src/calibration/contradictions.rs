//! Contradictions of a calibration, as its file has them.

use serde::de::Error;
use serde::{Deserialize, Deserializer};
use tactid_calibrate::Contradiction;
use toml::Table;

/// Reads contradictions whose keys are all known: serde ignores unknown ones beside what is flattened.
pub(super) fn read<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<Contradiction>, D::Error> {
    let tables = Vec::<Table>::deserialize(deserializer)?;
    let read = |table: Table| {
        let found: Contradiction = table.clone().try_into()?;
        let known = Table::try_from(&found).map_err(Error::custom)?;
        match table.keys().find(|key| !known.contains_key(*key)) {
            Some(key) => Err(Error::custom(format!("unknown field `{key}`"))),
            None => Ok(found),
        }
    };
    let all: Result<_, toml::de::Error> = tables.into_iter().map(read).collect();
    all.map_err(D::Error::custom)
}
