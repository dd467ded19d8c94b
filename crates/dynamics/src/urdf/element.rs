//! The elements of an XML document as a tree.

use std::borrow::Cow;
use std::ops::Range;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use crate::{ModelError, text_file::MAX_BYTES};

/// Number of elements that may be nested. A URDF needs six and the plugins inside some files a few
/// more; the limit bounds the depth of every recursion over the tree, in its destructor, too.
const MAX_DEPTH: usize = 200;

/// Largest number of elements; bounds the memory to about 200 MB.
const MAX_ELEMENTS: usize = 1_000_000;

/// Largest number of attributes of one element; they are compared with one another.
const MAX_ATTRIBUTES: usize = 1_000;

/// An element of an XML document with attributes and child elements, without text and comments.
///
/// Names are compared as they are written: a name with a prefix, as in `drake:joint`, is another
/// name than `joint`, whether or not the prefix is declared.
#[derive(Debug, Default)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) attributes: Vec<(String, String)>,
    pub(super) children: Vec<Element>,
    /// Bytes of the start tag in the text.
    pub(super) tag: Range<usize>,
    /// Bytes of the whole element in the text.
    pub(super) span: Range<usize>,
}

impl Element {
    /// Returns the value of an attribute, without escapes.
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        let mut attributes = self.attributes.iter();
        let found = attributes.find(|(known, _)| known == name);
        found.map(|(_, value)| value.as_str())
    }

    /// Returns the first child with a name.
    pub(super) fn child(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|child| child.name == name)
    }

    /// Returns the children with a name, in the order of the text.
    pub(super) fn children<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Self> {
        self.children.iter().filter(move |child| child.name == name)
    }
}

/// Reads an XML document and returns its root element.
///
/// # Errors
/// Returns [`ModelError::Syntax`], which names the line, if the text is not an XML document, nests
/// more than [`MAX_DEPTH`] elements, or is larger than any robot needs.
pub(super) fn parse(xml: &str) -> Result<Element, ModelError> {
    if xml.len() as u64 > MAX_BYTES {
        let (given, most) = (xml.len().div_ceil(1 << 20), MAX_BYTES >> 20);
        let message = format!("it has {given} MiB, but at most {most} MiB are read");
        return Err(ModelError::Syntax(message));
    }
    let mut elements = 0;
    let mut reader = Reader::from_str(xml);
    let mut open: Vec<Element> = Vec::new();
    let mut root = None;
    loop {
        let start = offset(reader.buffer_position());
        let event = reader.read_event();
        let end = offset(reader.buffer_position());
        let event = event
            .map_err(|error| syntax(xml, offset(reader.error_position()), &error.to_string()))?;
        elements += usize::from(matches!(event, Event::Start(_) | Event::Empty(_)));
        if elements > MAX_ELEMENTS {
            let message = format!("there are more than {MAX_ELEMENTS} elements");
            return Err(syntax(xml, start, &message));
        }
        let closed = match event {
            Event::Start(tag) => {
                if open.len() == MAX_DEPTH {
                    let message = format!("more than {MAX_DEPTH} elements are nested");
                    return Err(syntax(xml, start, &message));
                }
                open.push(element(xml, &tag, start..end)?);
                continue;
            }
            Event::Empty(tag) => element(xml, &tag, start..end)?,
            Event::End(_) => {
                // The reader has checked that an element of this name is open.
                let Some(mut closed) = open.pop() else {
                    continue;
                };
                closed.span.end = end;
                closed
            }
            Event::Text(text) if open.is_empty() && !text.trim_ascii().is_empty() => {
                return Err(syntax(xml, start, "there is text outside the root element"));
            }
            Event::Eof => break,
            _ => continue,
        };
        match open.last_mut() {
            Some(parent) => parent.children.push(closed),
            None if root.is_none() => root = Some(closed),
            None => return Err(syntax(xml, start, "there is a second root element")),
        }
    }
    if let Some(unclosed) = open.last() {
        let message = format!("<{}> is not closed", unclosed.name);
        return Err(syntax(xml, unclosed.span.start, &message));
    }
    root.ok_or_else(|| ModelError::Syntax("there is no element".to_owned()))
}

/// Returns an element without children from its start tag, which has the given place in the text.
fn element(xml: &str, tag: &BytesStart<'_>, place: Range<usize>) -> Result<Element, ModelError> {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let mut attributes = Vec::new();
    for attribute in tag.attributes() {
        let attribute = attribute.map_err(|error| syntax(xml, place.start, &error.to_string()))?;
        if attributes.len() == MAX_ATTRIBUTES {
            let message = format!("an element has more than {MAX_ATTRIBUTES} attributes");
            return Err(syntax(xml, place.start, &message));
        }
        // A reference to an entity of a document type stays as it is written.
        let value = attribute.unescape_value();
        let value = value.map_or_else(|_| text(&attribute.value), Cow::into_owned);
        if value.contains(is_no_character) {
            let message = "an attribute has a character that XML does not allow";
            return Err(syntax(xml, place.start, message));
        }
        attributes.push((text(attribute.key.into_inner()), value));
    }
    Ok(Element {
        name: text(tag.name().into_inner()),
        attributes,
        children: Vec::new(),
        tag: place.clone(),
        span: place,
    })
}

/// Returns whether XML forbids a character.
fn is_no_character(character: char) -> bool {
    matches!(character, '\0'..='\x08' | '\x0b' | '\x0c' | '\x0e'..='\x1f' | '\u{fffe}'..='\u{ffff}')
}

/// Returns the error for a place in the text.
pub(super) fn syntax(xml: &str, place: usize, message: &str) -> ModelError {
    let before = xml.as_bytes().iter().take(place);
    let line = 1 + before.filter(|&&byte| byte == b'\n').count();
    ModelError::Syntax(format!("line {line}: {message}"))
}

/// Returns a position of the reader as an index into the text.
fn offset(position: u64) -> usize {
    usize::try_from(position).unwrap_or(usize::MAX)
}
