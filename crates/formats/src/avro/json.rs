//! The part of JSON that schemas use.

use std::collections::BTreeMap;

/// The deepest nesting of values.
const MOST_DEPTH: usize = 64;

/// A value of JSON.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Json {
    Text(String),
    Number(f64),
    Array(Vec<Json>),
    Object(BTreeMap<String, Json>),
    /// `null`, `true` or `false`.
    Word,
}

impl Json {
    /// Parses a text; `None` if it is not JSON.
    pub(super) fn parse(text: &str) -> Option<Json> {
        let mut parser = Parser { rest: text };
        let json = parser.value(0)?;
        parser.skip().is_empty().then_some(json)
    }

    pub(super) fn text(&self) -> Option<&str> {
        match self {
            Json::Text(text) => Some(text),
            _ => None,
        }
    }

    /// A member of an object.
    pub(super) fn get(&self, name: &str) -> Option<&Json> {
        match self {
            Json::Object(members) => members.get(name),
            _ => None,
        }
    }
}

struct Parser<'a> {
    rest: &'a str,
}

impl<'a> Parser<'a> {
    fn skip(&mut self) -> &'a str {
        self.rest = self.rest.trim_start();
        self.rest
    }

    /// Consumes the next character if it is `wanted`; returns whether it was.
    fn eat(&mut self, wanted: char) -> bool {
        let after = self.skip().strip_prefix(wanted);
        self.rest = after.unwrap_or(self.rest);
        after.is_some()
    }

    fn value(&mut self, depth: usize) -> Option<Json> {
        if depth > MOST_DEPTH {
            return None;
        }
        match self.skip().chars().next()? {
            '{' => self.object(depth),
            '[' => self.array(depth),
            '"' => self.string().map(Json::Text),
            '-' | '0'..='9' => self.number(),
            _ => self.word(),
        }
    }

    fn object(&mut self, depth: usize) -> Option<Json> {
        let mut members = BTreeMap::new();
        self.eat('{');
        if self.eat('}') {
            return Some(Json::Object(members));
        }
        loop {
            self.skip();
            let name = self.string()?;
            if !self.eat(':') {
                return None;
            }
            members.insert(name, self.value(depth + 1)?);
            if !self.eat(',') {
                return self.eat('}').then_some(Json::Object(members));
            }
        }
    }

    fn array(&mut self, depth: usize) -> Option<Json> {
        let mut values = Vec::new();
        self.eat('[');
        if self.eat(']') {
            return Some(Json::Array(values));
        }
        loop {
            values.push(self.value(depth + 1)?);
            if !self.eat(',') {
                return self.eat(']').then_some(Json::Array(values));
            }
        }
    }

    fn string(&mut self) -> Option<String> {
        let inside = self.rest.strip_prefix('"')?;
        let mut text = String::new();
        let mut chars = inside.char_indices();
        while let Some((place, each)) = chars.next() {
            match each {
                '"' => {
                    self.rest = &inside[place + 1..];
                    return Some(text);
                }
                '\\' => match chars.next()?.1 {
                    'n' => text.push('\n'),
                    't' => text.push('\t'),
                    'r' | 'b' | 'f' => text.push(' '),
                    'u' => {
                        let digits: String =
                            chars.by_ref().take(4).map(|(_, digit)| digit).collect();
                        let code = u32::from_str_radix(&digits, 16).ok()?;
                        text.push(char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER));
                    }
                    other => text.push(other),
                },
                other => text.push(other),
            }
        }
        None
    }

    fn number(&mut self) -> Option<Json> {
        let is_of = |each: char| each.is_ascii_digit() || "+-.eE".contains(each);
        let end = self.rest.find(|each| !is_of(each)).unwrap_or(self.rest.len());
        let (number, rest) = self.rest.split_at(end);
        self.rest = rest;
        number.parse().ok().map(Json::Number)
    }

    fn word(&mut self) -> Option<Json> {
        let words = ["null", "true", "false"];
        let rest = words.iter().find_map(|word| self.rest.strip_prefix(word))?;
        self.rest = rest;
        Some(Json::Word)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_schemas_contain_is_parsed() {
        let json = Json::parse(r#" {"a": [1.5, null, "x\"\u00e9"], "b": {}, "c": []} "#);
        let json = json.expect("it is JSON");
        let Some(Json::Array(values)) = json.get("a") else { panic!("{json:?}") };
        assert_eq!(values[0], Json::Number(1.5));
        assert_eq!(values[2].text(), Some("x\"é"));
        assert_eq!(json.get("c"), Some(&Json::Array(Vec::new())));
    }

    #[test]
    fn what_is_not_json_is_refused() {
        let deep = "[".repeat(1000);
        for text in ["", "{", "{\"a\"}", "[1 2]", "nul", "1 2", "\"a", &deep] {
            assert_eq!(Json::parse(text), None, "{text}");
        }
    }
}
