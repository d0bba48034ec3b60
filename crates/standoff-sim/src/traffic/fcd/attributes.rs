//! Finds the attributes of an XML element, with their places.

use std::borrow::Cow;

use quick_xml::events::BytesStart;
use quick_xml::{Error, XmlVersion};

use super::super::lines::{Fault, Position};
use crate::text;

/// An attribute of an element.
pub(super) struct Found<'a> {
    pub(super) text: Cow<'a, str>,
    /// Where its name begins.
    pub(super) position: Position,
}

impl Found<'_> {
    /// What `read` makes of the value.
    pub(super) fn read<T>(&self, read: impl FnOnce(&str) -> Result<T, String>) -> Result<T, Fault> {
        read(&self.text).map_err(|message| Fault::at(self.position, message))
    }
}

/// The attributes named `keys` of `element`, which starts at `start`.
pub(super) fn attributes<'a, const N: usize>(
    element: &'a BytesStart<'_>,
    start: Position,
    keys: [&str; N],
) -> Result<[Option<Found<'a>>; N], Fault> {
    let mut all = [const { None }; N];
    for attribute in element.attributes() {
        let attribute = attribute.map_err(|error| not_xml(start, &error.into()))?;
        let key = attribute.key.into_inner();
        let Some(slot) = keys.iter().position(|&wanted| wanted == key).and_then(|index| all.get_mut(index)) else {
            continue;
        };
        // The key is a part of the element's text, behind its `<`.
        let before = key.as_ptr().addr().saturating_sub(element.as_ptr().addr());
        let position = start.after(b"<").after(element.as_bytes().get(..before).unwrap_or_default());
        let text = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|error| not_xml(position, &error))?;
        *slot = Some(Found { text, position });
    }
    Ok(all)
}

/// An attribute that must be there is not.
pub(super) fn missing(start: Position, who: &str, key: &str) -> Fault {
    Fault::at(start, format!("{who}: {key} is missing; must be an attribute; let SUMO write id, x, y, speed and angle"))
}

/// The XML reader can make nothing of the text.
pub(super) fn not_xml(start: Position, error: &Error) -> Fault {
    Fault::at(
        start,
        format!("not well-formed XML: {}; cut off or damaged? make the file again", text::words(&error.to_string())),
    )
}
