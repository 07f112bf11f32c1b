//! XML, as far as stream descriptions need it: elements and text. Memory and depth are bounded for any input.

use super::LslError;

/// The largest number of elements, and their deepest nesting.
const MOST_ELEMENTS: usize = 100_000;
const DEEPEST: usize = 32;
/// The largest document [bytes].
pub(super) const LARGEST_BYTES: usize = 4 << 20;

/// An element: its name, its text without the text of its children, and its children.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Element {
    pub name: String,
    pub text: String,
    pub children: Vec<Element>,
}

impl Element {
    /// Parses a document; returns its root.
    pub fn parse(document: &str) -> Result<Element, LslError> {
        if document.len() > LARGEST_BYTES {
            return Err(LslError::Description("it is too large"));
        }
        let mut reader = Reader { rest: document, open: Vec::new(), count: 0 };
        reader.read()
    }

    /// Returns the first child with this name.
    pub fn child(&self, name: &str) -> Option<&Element> {
        self.children.iter().find(|child| child.name == name)
    }

    /// Returns the text of the first child with this name, without surrounding space; empty if there is none.
    pub fn text_of(&self, name: &str) -> &str {
        self.child(name).map_or("", |child| child.text.trim())
    }
}

struct Reader<'a> {
    rest: &'a str,
    open: Vec<Element>,
    count: usize,
}

impl<'a> Reader<'a> {
    fn read(&mut self) -> Result<Element, LslError> {
        loop {
            let Some((text, rest)) = self.rest.split_once('<') else {
                return Err(LslError::Description("it ends early"));
            };
            if let Some(element) = self.open.last_mut() {
                unescape(text, &mut element.text);
            }
            self.rest = rest;
            if let Some(root) = self.tag()? {
                return Ok(root);
            }
        }
    }

    /// Parses markup that begins with `<`; returns the root once it is closed.
    fn tag(&mut self) -> Result<Option<Element>, LslError> {
        if let Some(rest) = self.rest.strip_prefix("!--") {
            self.rest = rest;
            return self.until("-->").map(|_| None);
        }
        if let Some(rest) = self.rest.strip_prefix("![CDATA[") {
            self.rest = rest;
            let text = self.until("]]>")?;
            if let Some(element) = self.open.last_mut() {
                element.text.push_str(text);
            }
            return Ok(None);
        }
        if self.rest.starts_with('?') {
            return self.until("?>").map(|_| None);
        }
        if self.rest.starts_with('!') {
            return Err(LslError::Description("it has declarations"));
        }
        let tag = self.until(">")?;
        if let Some(name) = tag.strip_prefix('/') {
            return self.close(name.trim());
        }
        let (tag, is_empty) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
        let name = tag.split_ascii_whitespace().next().unwrap_or_default().to_owned();
        self.count += 1;
        if name.is_empty() || self.count > MOST_ELEMENTS || self.open.len() >= DEEPEST {
            return Err(LslError::Description("it is not XML, or too deep or long"));
        }
        self.open.push(Element { name: name.clone(), ..Element::default() });
        if is_empty { self.close(&name) } else { Ok(None) }
    }

    fn close(&mut self, name: &str) -> Result<Option<Element>, LslError> {
        let Some(element) = self.open.pop().filter(|element| element.name == name) else {
            return Err(LslError::Description("its elements are not closed in order"));
        };
        let Some(parent) = self.open.last_mut() else { return Ok(Some(element)) };
        parent.children.push(element);
        Ok(None)
    }

    fn until(&mut self, end: &str) -> Result<&'a str, LslError> {
        let (text, rest) =
            self.rest.split_once(end).ok_or(LslError::Description("it ends early"))?;
        self.rest = rest;
        Ok(text)
    }
}

/// Appends text with its entities replaced; unknown ones are kept.
fn unescape(text: &str, out: &mut String) {
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('&') {
        out.push_str(before);
        let entity = after.split_once(';').filter(|(entity, _)| entity.len() <= 8);
        let known = entity.and_then(|(entity, rest)| Some((character(entity)?, rest)));
        let (character, after) = known.unwrap_or(('&', after));
        out.push(character);
        rest = after;
    }
    out.push_str(rest);
}

fn character(entity: &str) -> Option<char> {
    match entity {
        "amp" => Some('&'),
        "lt" => Some('<'),
        "gt" => Some('>'),
        "quot" => Some('"'),
        "apos" => Some('\''),
        _ => {
            let number = entity.strip_prefix('#')?;
            let code = match number.strip_prefix('x') {
                Some(digits) => u32::from_str_radix(digits, 16).ok()?,
                None => number.parse().ok()?,
            };
            char::from_u32(code)
        }
    }
}

/// Writes an element with text.
pub(super) fn write(out: &mut String, name: &str, text: &str) {
    out.extend(["<", name, ">"]);
    for each in text.chars() {
        match each {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            // XML documents may not contain control characters.
            each if each.is_control() => out.push(' '),
            each => out.push(each),
        }
    }
    out.extend(["</", name, ">"]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_text_and_entities_are_read() {
        let document = "<?xml version=\"1.0\"?><!-- a -->\n<info><name>A &amp; B &#956;&lt;&no;</name>\
                        <desc a=\"1\"><x/><x><![CDATA[<raw>]]></x></desc></info>";
        let root = Element::parse(document).expect("is XML");
        assert_eq!(root.text_of("name"), "A & B μ<&no;");
        let desc = root.child("desc").expect("is there");
        assert_eq!(desc.children.len(), 2);
        assert_eq!(desc.children[1].text, "<raw>");
    }

    #[test]
    fn what_is_not_xml_or_too_deep_is_refused() {
        let deep = "<a>".repeat(1000);
        for document in
            ["", "text", "<a>", "<a></b>", "<!DOCTYPE a [<!ENTITY b \"c\">]><a/>", &deep]
        {
            assert!(Element::parse(document).is_err(), "{document}");
        }
    }

    #[test]
    fn what_is_written_is_read_again() {
        let mut out = String::new();
        write(&mut out, "name", "<µ> & \"'");
        assert_eq!(Element::parse(&out).expect("is XML").text, "<µ> & \"'");
    }
}
