//! XML of exports.

use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use crate::error::Failure;

/// Makes a document of the elements that `write` writes.
pub(super) fn document(write: impl Fn(&mut Writer<Vec<u8>>) -> io::Result<()>) -> Result<String, Failure> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 1);
    let declaration = Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None));
    xml.write_event(declaration).and_then(|()| write(&mut xml)).map_err(Failure::running)?;
    String::from_utf8(xml.into_inner()).map_err(Failure::running)
}

/// Writes an element that contains a text.
pub(super) fn element(xml: &mut Writer<Vec<u8>>, name: &str, text: &str) -> io::Result<()> {
    xml.create_element(name).write_text_content(BytesText::new(text))?;
    Ok(())
}
