//! Discovery: finding the senders of matching streams.

use super::{LslError, StreamInfo};

/// The largest size of a discovery request [bytes], and the deepest nesting of a query.
const LARGEST_BYTES: usize = 4096;
const DEEPEST: usize = 32;

/// A request for descriptions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Discovery {
    /// The condition that streams must meet.
    pub query: String,
    /// The UDP port to reply to.
    pub port: u16,
    /// The text at the start of the reply.
    pub id: String,
}

impl Discovery {
    /// Encodes the request as a datagram.
    pub fn encode(&self) -> String {
        format!("LSL:shortinfo\r\n{}\r\n{} {}\r\n", self.query, self.port, self.id)
    }

    /// Parses a datagram; `None` if it is not a discovery request.
    pub fn parse(datagram: &[u8]) -> Option<Discovery> {
        let text = std::str::from_utf8(datagram).ok().filter(|text| text.len() <= LARGEST_BYTES)?;
        let mut lines = text.split('\n');
        if lines.next()?.trim() != "LSL:shortinfo" {
            return None;
        }
        let query = lines.next()?.trim().to_owned();
        let mut words = lines.next()?.split_ascii_whitespace();
        let port = words.next()?.parse().ok()?;
        Some(Discovery { query, port, id: words.next()?.to_owned() })
    }

    /// Returns the reply with the description of a stream.
    pub fn reply(&self, stream: &StreamInfo) -> String {
        format!("{}\r\n{}", self.id, stream.short_xml())
    }
}

/// Returns the stream in a reply to the request with this id; `None` for a reply to another request.
pub fn discovered(datagram: &[u8], id: &str) -> Option<Result<StreamInfo, LslError>> {
    let text = std::str::from_utf8(datagram).ok()?;
    let (first, document) = text.split_once('\n')?;
    (first.trim() == id).then(|| StreamInfo::parse(document))
}

/// A condition on the description of a stream, in `XPath`. Comparisons of elements with texts, `and`, `or`, `not`,
/// `starts-with` and `contains` are supported.
#[derive(Clone, Debug, PartialEq)]
pub struct Query(Condition);

#[derive(Clone, Debug, PartialEq)]
enum Condition {
    Always,
    All(Vec<Condition>),
    Any(Vec<Condition>),
    Not(Box<Condition>),
    Is(Comparison, String, String),
    Exists(String),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Comparison {
    Equal,
    Unequal,
    StartsWith,
    Contains,
}

impl Query {
    /// Parses a query; an empty one matches all streams. Returns `None` if the query is not supported.
    pub fn parse(text: &str) -> Option<Query> {
        if text.trim().is_empty() {
            return Some(Query(Condition::Always));
        }
        let mut parser = Parser { rest: text, depth: 0 };
        let condition = parser.any()?;
        parser.rest.trim().is_empty().then_some(Query(condition))
    }

    /// Whether the query matches a stream.
    pub fn matches(&self, stream: &StreamInfo) -> bool {
        self.0.holds(&stream.fields())
    }
}

impl Condition {
    fn holds(&self, fields: &[(&'static str, String)]) -> bool {
        let field =
            |name: &str| fields.iter().find(|(known, _)| *known == name).map(|(_, text)| text);
        match self {
            Condition::Always => true,
            Condition::All(all) => all.iter().all(|each| each.holds(fields)),
            Condition::Any(any) => any.iter().any(|each| each.holds(fields)),
            Condition::Not(condition) => !condition.holds(fields),
            Condition::Exists(name) => field(name).is_some(),
            Condition::Is(comparison, name, value) => {
                field(name).is_some_and(|text| match comparison {
                    Comparison::Equal => is_same(text, value),
                    Comparison::Unequal => !is_same(text, value),
                    Comparison::StartsWith => text.starts_with(value),
                    Comparison::Contains => text.contains(value),
                })
            }
        }
    }
}

/// Whether two texts are equal, or the same number, as libraries format rates differently.
fn is_same(text: &str, value: &str) -> bool {
    let numbers = (text.parse::<f64>(), value.parse::<f64>());
    text == value || matches!(numbers, (Ok(a), Ok(b)) if a.total_cmp(&b).is_eq())
}

struct Parser<'a> {
    rest: &'a str,
    depth: usize,
}

impl Parser<'_> {
    fn any(&mut self) -> Option<Condition> {
        let mut any = vec![self.all()?];
        while self.takes_word("or") {
            any.push(self.all()?);
        }
        if any.len() == 1 { any.pop() } else { Some(Condition::Any(any)) }
    }

    fn all(&mut self) -> Option<Condition> {
        let mut all = vec![self.one()?];
        while self.takes_word("and") {
            all.push(self.one()?);
        }
        if all.len() == 1 { all.pop() } else { Some(Condition::All(all)) }
    }

    fn one(&mut self) -> Option<Condition> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return None;
        }
        let condition = self.condition();
        self.depth -= 1;
        condition
    }

    fn condition(&mut self) -> Option<Condition> {
        if self.takes("(") {
            let inner = self.any()?;
            return self.takes(")").then_some(inner);
        }
        let name = self.name()?;
        if self.takes("(") {
            return self.function(&name);
        }
        let comparison = if self.takes("!=") {
            Comparison::Unequal
        } else if self.takes("=") {
            Comparison::Equal
        } else {
            return Some(Condition::Exists(name));
        };
        Some(Condition::Is(comparison, name, self.value()?))
    }

    fn function(&mut self, name: &str) -> Option<Condition> {
        let comparison = match name {
            "not" => {
                let inner = self.any()?;
                return self.takes(")").then(|| Condition::Not(Box::new(inner)));
            }
            "starts-with" => Comparison::StartsWith,
            "contains" => Comparison::Contains,
            _ => return None,
        };
        let field = self.name()?;
        let value = self.takes(",").then(|| self.value())??;
        self.takes(")").then_some(Condition::Is(comparison, field, value))
    }

    /// Parses the name of an element of the description, or of a function.
    fn name(&mut self) -> Option<String> {
        self.rest = self.rest.trim_start();
        for root in ["/info/", "//info/", "./"] {
            self.rest = self.rest.strip_prefix(root).unwrap_or(self.rest);
        }
        let is_part = |each: char| each.is_ascii_alphanumeric() || matches!(each, '_' | '-' | '/');
        let end = self.rest.find(|each| !is_part(each)).unwrap_or(self.rest.len());
        let (name, rest) = self.rest.split_at(end);
        self.rest = rest;
        (!name.is_empty()).then(|| name.to_owned())
    }

    fn value(&mut self) -> Option<String> {
        self.rest = self.rest.trim_start();
        for quote in ['\'', '"'] {
            if let Some(rest) = self.rest.strip_prefix(quote) {
                let (value, rest) = rest.split_once(quote)?;
                self.rest = rest;
                return Some(value.to_owned());
            }
        }
        let is_part = |each: char| each.is_ascii_digit() || matches!(each, '.' | '-');
        let end = self.rest.find(|each| !is_part(each)).unwrap_or(self.rest.len());
        let (value, rest) = self.rest.split_at(end);
        self.rest = rest;
        (!value.is_empty()).then(|| value.to_owned())
    }

    fn takes(&mut self, symbol: &str) -> bool {
        let rest = self.rest.trim_start().strip_prefix(symbol);
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }

    fn takes_word(&mut self, word: &str) -> bool {
        let rest = self.rest.trim_start().strip_prefix(word);
        let rest = rest.filter(|rest| rest.starts_with([' ', '(', '\t']));
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }
}
