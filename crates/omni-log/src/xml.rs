//! XML elements and comments; the only module that names quick-xml.

use std::fmt::Display;
use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesText, Event};

/// XML that is being written.
pub(crate) type Xml = Writer<Vec<u8>>;

/// A document of one element: what `parts` writes into it.
pub(crate) fn document(
    element_name: &str,
    attributes: &[(&str, &str)],
    parts: impl FnOnce(&mut Xml) -> io::Result<()>,
) -> String {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    // Memory takes all that is written, and names and numbers are text.
    let _ = element(&mut xml, element_name, attributes, parts);
    String::from_utf8(xml.into_inner()).unwrap_or_default()
}

/// An element with something in it.
pub(crate) fn element(
    xml: &mut Xml,
    name: &str,
    attributes: &[(&str, &str)],
    inner: impl FnOnce(&mut Xml) -> io::Result<()>,
) -> io::Result<()> {
    let element = xml
        .create_element(name)
        .with_attributes(attributes.iter().copied());
    element.write_inner_content(inner).map(drop)
}

/// An element that has only attributes.
pub(crate) fn leaf(xml: &mut Xml, name: &str, attributes: &[(&str, &dyn Display)]) -> io::Result<()> {
    let texts = attributes.iter().map(|(key, value)| (*key, value.to_string()));
    let texts: Vec<_> = texts.collect();
    let attributes = texts.iter().map(|(key, text)| (*key, text.as_str()));
    xml.create_element(name)
        .with_attributes(attributes)
        .write_empty()
        .map(drop)
}

/// An element with text in it.
pub(crate) fn text_of(xml: &mut Xml, name: &str, attributes: &[(&str, &str)], text: &str) -> io::Result<()> {
    xml.create_element(name)
        .with_attributes(attributes.iter().copied())
        .write_text_content(BytesText::new(text))
        .map(drop)
}

/// A comment, which may not have two hyphens side by side.
pub(crate) fn comment(xml: &mut Xml, text: &str) -> io::Result<()> {
    let text = format!(" {} ", text.replace("--", "- -"));
    xml.write_event(Event::Comment(BytesText::from_escaped(text)))
}

/// Numbers side by side.
pub(crate) fn list(numbers: &[f64]) -> String {
    let texts: Vec<_> = numbers.iter().map(f64::to_string).collect();
    texts.join(" ")
}
