//! Reads XML one element at a time: elements and attributes with their positions.

use std::borrow::Cow;
use std::io::Read;

use quick_xml::errors::IllFormedError;
use quick_xml::escape::{EscapeError, resolve_predefined_entity};
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Error, Reader, XmlVersion};

use super::limits::MAX_DEPTH;
use super::{Fault, Lines, NOT_UTF_8, Position, input_fault};
use crate::display_text::{self, quoted};

/// Receiver of the elements of a file.
pub trait Elements {
    /// Handles an element that starts at `start` within `depth` enclosing elements.
    fn element(&mut self, element: &BytesStart<'_>, start: Position, depth: usize) -> Result<(), Fault>;

    /// Handles text directly within the element that was handled last; long text comes in parts.
    fn text(&mut self, _text: &str) {}

    /// Handles the end of an element within `depth` enclosing elements.
    fn end(&mut self, _depth: usize) -> Result<(), Fault> {
        Ok(())
    }

    /// Handles a comment.
    fn comment(&mut self, _text: &str) {}
}

/// Reads a file to its end. Fails if it is not XML, ends early, nests too deeply, or `elements` fails.
pub fn walk(lines: Lines<impl Read>, elements: &mut impl Elements) -> Result<(), Fault> {
    let mut reader = Reader::from_reader(lines);
    let (mut buffer, mut depth) = (Vec::new(), 0);
    loop {
        buffer.clear();
        let start = reader.get_mut().begin();
        let event = match reader.read_event_into(&mut buffer) {
            Ok(event) => event,
            Err(Error::Io(error)) => return Err(input_fault(Some(reader.get_mut().position()), &error)),
            Err(error) => return Err(not_xml(start, &error)),
        };
        match event {
            Event::Start(element) => {
                elements.element(&element, start, depth)?;
                depth += 1;
                if depth > MAX_DEPTH {
                    return Err(Fault::at(start, format!("elements are nested too deeply; at most {MAX_DEPTH} deep")));
                }
            }
            Event::Empty(element) => {
                elements.element(&element, start, depth)?;
                elements.end(depth)?;
            }
            Event::End(_) => {
                depth -= 1;
                elements.end(depth)?;
            }
            Event::Text(text) => elements.text(&text),
            Event::GeneralRef(reference) => match reference.resolve_char_ref() {
                Ok(Some(character)) => elements.text(character.encode_utf8(&mut [0; 4])),
                _ => elements.text(resolve_predefined_entity(&reference).ok_or_else(|| unknown(start, &reference))?),
            },
            Event::CData(text) => elements.text(&text),
            Event::Comment(comment) => elements.comment(&comment),
            Event::Eof if depth > 0 => {
                let message = "the file ends inside an element; it is cut off: copy or create it again";
                return Err(Fault::at(start, message.into()));
            }
            Event::Eof => return Ok(()),
            _ => {}
        }
    }
}

/// An attribute of an element.
#[derive(Debug)]
pub struct Found<'a> {
    /// Its value.
    pub text: Cow<'a, str>,
    /// Where its name begins.
    pub position: Position,
}

impl Found<'_> {
    /// Parses the value with `read`.
    pub fn read<T>(&self, read: impl FnOnce(&str) -> Result<T, String>) -> Result<T, Fault> {
        read(&self.text).map_err(|message| Fault::at(self.position, message))
    }
}

/// Returns the attributes named `keys` of `element`, which starts at `start`.
pub fn attributes<'a, const N: usize>(
    element: &'a BytesStart<'_>,
    start: Position,
    keys: [&str; N],
) -> Result<[Option<Found<'a>>; N], Fault> {
    let mut all = [const { None }; N];
    for attribute in element.attributes() {
        let attribute = attribute.map_err(|error| not_xml(start, &error.into()))?;
        let key = attribute.key.into_inner();
        let Some(slot) = keys.iter().position(|&name| name == key).and_then(|index| all.get_mut(index)) else {
            continue;
        };
        // The key is a slice of the element's text after its `<`.
        let before = key.as_ptr().addr().saturating_sub(element.as_ptr().addr());
        let position = start.after(b"<").after(element.as_bytes().get(..before).unwrap_or_default());
        let text = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|error| match error {
            Error::Escape(EscapeError::UnrecognizedEntity(_, entity)) => unknown(position, &entity),
            error => not_xml(position, &error),
        })?;
        *slot = Some(Found { text, position });
    }
    Ok(all)
}

/// Creates the error of an entity that a file may declare, or that does not exist.
fn unknown(start: Position, entity: &str) -> Fault {
    if !entity.chars().all(|c| c.is_alphanumeric() || "#-._:".contains(c)) {
        return ampersand(start);
    }
    let entity = quoted(&format!("&{entity};"));
    let message = format!(
        "entity = {entity} is not read; only &amp; &lt; &gt; &apos; &quot; and numbers of characters are, such as &#233; \
         for \u{e9}; replace it by its text"
    );
    Fault::at(start, message)
}

/// Creates the error of an ampersand that begins no entity.
fn ampersand(start: Position) -> Fault {
    Fault::at(start, "not well-formed XML: & begins no entity; write &amp; for it".to_owned())
}

/// Creates the error of text that is not XML.
fn not_xml(start: Position, error: &Error) -> Fault {
    if matches!(error, Error::Encoding(_)) {
        return Fault::at(start, NOT_UTF_8.to_owned());
    }
    if let Error::IllFormed(IllFormedError::UnclosedReference) | Error::Escape(EscapeError::UnterminatedEntity(_)) =
        error
    {
        return ampersand(start);
    }
    Fault::at(
        start,
        format!(
            "not well-formed XML: {}; cut off or damaged? create the file again",
            display_text::printable(&error.to_string())
        ),
    )
}
