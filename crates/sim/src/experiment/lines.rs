//! Places of fields in the text of an experiment's file, for errors.

use toml::de::{DeTable, DeValue};

use crate::SimError;

/// Returns the error of a parser in one line, with the line of `text` and the key there.
pub(super) fn syntax(error: &toml::de::Error, text: &str) -> SimError {
    let mut message = error.message().trim().to_owned();
    for (rust, plain) in [
        ("expected f64", "expected a number"),
        ("expected u64", "expected an integer that is not negative"),
        ("expected a string", "expected a text"),
    ] {
        message = message.replace(rust, plain);
    }
    let Some(span) = error.span() else {
        return SimError::Syntax(message);
    };
    let before = text.get(..span.start).unwrap_or(text);
    let line = 1 + before.matches('\n').count();
    let source = text.lines().nth(line - 1).unwrap_or_default();
    // Where the error is in the value, the key before it names the field.
    let start_of_line = before.rfind('\n').map_or(0, |newline| newline + 1);
    let key = source.split_once('=').map(|(key, _)| key);
    let key = key.filter(|key| span.start - start_of_line > key.len());
    SimError::Syntax(match key {
        Some(key) => format!("line {line}: {}: {message}", key.trim()),
        None => format!("line {line}: {message}"),
    })
}

/// Adds the line of `text` that contains the field to a [`SimError::Value`]. Where the text does
/// not have the field, the value is reported as the default.
pub(crate) fn with_line(error: SimError, text: &str) -> SimError {
    match error {
        SimError::Value {
            field, value, why, ..
        } => {
            let found = line_of(&field, text);
            let is_given = found.is_some_and(|(_, is_given)| is_given);
            SimError::Value {
                line: found.map(|(line, _)| line),
                field,
                value: if is_given {
                    value
                } else {
                    format!("{value} (the default)")
                },
                why,
            }
        }
        other => other,
    }
}

/// Returns whether the text of an experiment's file has a field.
pub(crate) fn is_given(field: &str, text: &str) -> bool {
    line_of(field, text).is_some_and(|(_, is_given)| is_given)
}

/// Returns the line, counted from 1, of `table.field` or `table.list[2].field`, or of the innermost
/// table or list that the file contains, and whether the file contains the field itself.
fn line_of(field: &str, text: &str) -> Option<(usize, bool)> {
    let document = DeTable::parse(text).ok()?;
    let mut span = None;
    let mut value: Option<&DeValue<'_>> = None;
    let parts = field
        .split(['.', '['])
        .map(|part| part.trim_end_matches(']'));
    let mut is_given = true;
    for part in parts {
        let table = match value {
            None => Some(document.get_ref()),
            Some(value) => value.as_table(),
        };
        let next = match (
            table,
            value.and_then(DeValue::as_array),
            part.parse::<usize>(),
        ) {
            (Some(table), _, _) => table
                .get_key_value(part)
                .map(|(key, value)| (key.span(), value)),
            (None, Some(list), Ok(index)) => list.get(index).map(|value| (value.span(), value)),
            _ => None,
        };
        let Some((at, inner)) = next else {
            is_given = false;
            break;
        };
        (span, value) = (Some(at), Some(inner.get_ref()));
    }
    let start = span?.start;
    Some((1 + text.get(..start)?.matches('\n').count(), is_given))
}
