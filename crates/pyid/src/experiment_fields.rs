//! Changes of an experiment's fields, as Python gives them: keywords, and dictionaries for tables.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyMapping, PyString};
use tactid_dynamics::symmetric_entries;
use tactid_sim::{Experiment, Posture};
use toml::{Table, Value};

use crate::errors::{ExperimentError, IntoPyErr};
use crate::inertia::MassProperties;
use crate::text::Text;

/// Keywords of single values with the fields of the experiment's file that they set.
const VALUES: [(&str, &str); 5] = [
    ("posture", "posture"),
    ("seed", "seed"),
    ("duration", "duration_s"),
    ("step", "step_s"),
    ("gravity", "gravity_m_s2"),
];
/// What a posture may be.
const POSTURE: &str = "\"identifiable\", \"table1\" or a list of one number for each joint";
/// Keyword of the frequency of every driven joint, which is not a field of its own in the file.
const FREQUENCY: &str = "frequency";
/// Keywords of tables, which have the names of the tables in the experiment's file.
const TABLES: [&str; 7] = [
    "robot",
    "base",
    "payload",
    "gripper",
    "excitation",
    "noise",
    "bounds",
];

/// Returns an experiment with some of its fields changed; a field that is None stays.
pub(crate) fn replaced(
    experiment: &Experiment,
    fields: &Bound<'_, PyDict>,
) -> PyResult<Experiment> {
    let mut document = Table::try_from(experiment).map_err(refused)?;
    let mut frequency_hz = None;
    for (name, value) in fields {
        let name = name.extract::<Text>()?.0;
        let field = VALUES.iter().find(|(keyword, _)| *keyword == name);
        if field.is_none() && name != FREQUENCY && !TABLES.contains(&&*name) {
            return Err(no_such_field(&name));
        }
        if value.is_none() {
            continue;
        }
        if name == FREQUENCY {
            frequency_hz = Some(number(&name, &value)?);
        } else if let Some((_, field)) = field {
            let read = read(&name, &value)?;
            if name == "posture" && read.clone().try_into::<Posture>().is_err() {
                return Err(wrong(&name, &value, POSTURE));
            }
            document.insert((*field).to_owned(), read);
        } else {
            merge(
                &mut document,
                name.clone(),
                Value::Table(table(&name, &value)?),
            );
        }
    }
    let mut experiment: Experiment = document.try_into().map_err(refused)?;
    if let Some(frequency_hz) = frequency_hz {
        experiment.set_frequency(frequency_hz);
    }
    experiment.check().map_err(IntoPyErr::into_py_err)?;
    Ok(experiment)
}

fn no_such_field(name: &str) -> PyErr {
    let values = VALUES.iter().map(|(keyword, _)| *keyword);
    let known: Vec<&str> = std::iter::once(FREQUENCY)
        .chain(values)
        .chain(TABLES)
        .collect();
    ExperimentError::new_err(format!(
        "an experiment has no field `{name}`; it has {}",
        known.join(", ")
    ))
}

/// Puts a parser's error, which may have the field on a line of its own, on one line.
fn refused(error: impl std::fmt::Display) -> PyErr {
    let text = error.to_string();
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    ExperimentError::new_err(lines.join(" "))
}

/// Sets a value, field by field where it is a table.
fn merge(document: &mut Table, name: String, value: Value) {
    match (document.get_mut(&name), value) {
        (Some(Value::Table(present)), Value::Table(changes)) => {
            for (name, value) in changes {
                merge(present, name, value);
            }
        }
        (_, value) => {
            document.insert(name, value);
        }
    }
}

/// Reads a table: a dictionary, or the mass properties of a payload.
fn table(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Table> {
    if let Ok(body) = value.cast::<MassProperties>() {
        let body = &body.get().0;
        return Ok(Table::from_iter([
            ("mass_kg".to_owned(), Value::Float(body.mass_kg)),
            (
                "center_of_mass_m".to_owned(),
                floats(body.center_of_mass.iter().copied()),
            ),
            (
                "inertia_kg_m2".to_owned(),
                floats(symmetric_entries(&body.inertia)),
            ),
        ]));
    }
    let Ok(fields) = value.cast::<PyMapping>() else {
        return Err(wrong(name, value, "a dictionary of its fields"));
    };
    let mut table = Table::new();
    for item in fields.items()? {
        let (field, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
        let Ok(field) = field.extract::<String>() else {
            return Err(wrong(name, &field, "names of fields as the keys"));
        };
        let place = format!("{name}.{field}");
        table.insert(field, read(&place, &value)?);
    }
    Ok(table)
}

fn floats(values: impl IntoIterator<Item = f64>) -> Value {
    Value::Array(values.into_iter().map(Value::Float).collect())
}

/// Reads a text, a path, a number, a list or a dictionary; `name` names it in an error.
fn read(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if value.is_instance_of::<PyString>() {
        return Ok(Value::String(value.extract::<Text>()?.0));
    }
    if value.is_instance_of::<PyBool>() {
        return Err(wrong(
            name,
            value,
            "a number, a text, a list or a dictionary",
        ));
    }
    if value.hasattr("__fspath__")? {
        let path: PathBuf = value.extract()?;
        return Ok(Value::String(path.to_string_lossy().into_owned()));
    }
    if value.hasattr("__index__")? && value.try_iter().is_err() {
        let expected = "an integer of at most 63 bits";
        return Ok(Value::Integer(
            value.extract().map_err(|_| wrong(name, value, expected))?,
        ));
    }
    if value.cast::<PyMapping>().is_ok() {
        return Ok(Value::Table(table(name, value)?));
    }
    let Ok(entries) = value.try_iter() else {
        return number(name, value).map(Value::Float);
    };
    let entries = entries.enumerate();
    let entries = entries.map(|(k, entry)| read(&format!("{name}[{k}]"), &entry?));
    Ok(Value::Array(entries.collect::<PyResult<_>>()?))
}

/// Reads a number of any type that converts to a float, as NumPy's do.
fn number(name: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    value.extract().map_err(|_| wrong(name, value, "a number"))
}

fn wrong(name: &str, value: &Bound<'_, PyAny>, expected: &str) -> PyErr {
    match value.repr() {
        Ok(shown) => ExperimentError::new_err(format!("{name} = {shown}: expected {expected}")),
        Err(error) => error,
    }
}
