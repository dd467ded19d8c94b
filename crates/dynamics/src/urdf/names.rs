//! Removal of XML names with a prefix, which are not part of the URDF format.

use std::borrow::Cow;

use quick_xml::events::attributes::Attribute;
use quick_xml::events::{BytesStart, Event};
use quick_xml::name::QName;
use quick_xml::{Reader, Writer};

use crate::ModelError;

/// Returns the text without the elements and attributes whose names have a prefix, as in `drake:acceleration`.
///
/// The URDF format has no prefixed names. Generators add them for other programs and often leave the prefix undeclared,
/// which ROS tools accept because they do not interpret namespaces, and which the XML parser of urdf-rs refuses. A text
/// without such names is returned unchanged.
///
/// # Errors
/// Returns [`ModelError::Syntax`] if the text is not XML.
pub(super) fn without_prefixed_names(xml: &str) -> Result<Cow<'_, str>, ModelError> {
    let mut reader = Reader::from_str(xml);
    let mut writer = Writer::new(Vec::new());
    let mut has_removed = false;
    loop {
        let event = reader.read_event().map_err(syntax)?;
        let replacement = match &event {
            Event::Eof => break,
            Event::Start(tag) if is_foreign(tag.name()) => {
                reader.read_to_end(tag.name()).map_err(syntax)?;
                has_removed = true;
                continue;
            }
            Event::Empty(tag) if is_foreign(tag.name()) => {
                has_removed = true;
                continue;
            }
            Event::Start(tag) => without_foreign(tag)?.map(Event::Start),
            Event::Empty(tag) => without_foreign(tag)?.map(Event::Empty),
            _ => None,
        };
        has_removed |= replacement.is_some();
        let event = replacement.unwrap_or(event);
        writer.write_event(event).map_err(syntax)?;
    }
    if !has_removed {
        return Ok(Cow::Borrowed(xml));
    }
    let text = String::from_utf8(writer.into_inner()).map_err(syntax)?;
    Ok(Cow::Owned(text))
}

/// Returns the tag without its foreign attributes, or `None` if it has none.
fn without_foreign(tag: &BytesStart<'_>) -> Result<Option<BytesStart<'static>>, ModelError> {
    let mut attributes = tag.attributes();
    let attributes = attributes.with_checks(false);
    let attributes: Vec<Attribute<'_>> = attributes.collect::<Result<_, _>>().map_err(syntax)?;
    if !attributes.iter().any(|attribute| is_foreign(attribute.key)) {
        return Ok(None);
    }
    let name = String::from_utf8_lossy(tag.name().into_inner()).into_owned();
    let mut kept = BytesStart::new(name);
    for attribute in attributes {
        if !is_foreign(attribute.key) {
            let key = String::from_utf8_lossy(attribute.key.into_inner());
            // The writer encloses values in double quotes.
            let value = String::from_utf8_lossy(&attribute.value).replace('"', "&quot;");
            kept.push_attribute((key.as_bytes(), value.as_bytes()));
        }
    }
    Ok(Some(kept))
}

/// Returns whether a name has a prefix that XML itself does not define.
fn is_foreign(name: QName<'_>) -> bool {
    let prefix = name.prefix();
    prefix.is_some_and(|prefix| !prefix.is_xmlns() && !prefix.is_xml())
}

fn syntax(error: impl std::fmt::Display) -> ModelError {
    ModelError::Syntax(error.to_string())
}
