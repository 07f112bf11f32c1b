use super::{Count, Kind, Number, Problem};

/// A declaration: one line of a definition.
#[derive(Debug)]
pub(super) struct Declaration<'a> {
    pub name: &'a str,
    pub item: Item<'a>,
    pub count: Count,
    pub value: Value<'a>,
}

/// A type as written in a declaration.
#[derive(Debug)]
pub(super) enum Item<'a> {
    Plain(Kind),
    Named(&'a str),
}

/// The value after the name.
#[derive(Debug)]
pub(super) enum Value<'a> {
    /// The default of a field; empty for none.
    Default(&'a str),
    /// The value of a constant.
    Constant(&'a str),
}

impl<'a> Declaration<'a> {
    /// Parses a line; `None` for a blank line or a comment.
    pub fn read(line: &'a str) -> Result<Option<Declaration<'a>>, Problem> {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            return Ok(None);
        }
        let incomplete = || Problem::Incomplete(line.to_owned());
        let (written, rest) = line.split_once(char::is_whitespace).ok_or_else(incomplete)?;
        let (name, value) = name_and_value(rest.trim_start())?;
        let (item, count) = split_count(written).ok_or_else(|| no_type(written))?;
        let item = plain_kind(item).ok_or_else(|| no_type(written))?;
        Ok(Some(Declaration { name, item, count, value }))
    }
}

fn no_type(written: &str) -> Problem {
    Problem::Type(written.to_owned())
}

fn name_and_value(rest: &str) -> Result<(&str, Value<'_>), Problem> {
    let end = rest.find(|c: char| !is_name_char(c)).unwrap_or(rest.len());
    let (name, behind) = rest.split_at(end);
    let value = match behind.trim_start().strip_prefix('=') {
        Some(value) => Value::Constant(value.trim_start()),
        None => Value::Default(behind.trim_start()),
    };
    let is_apart = behind.is_empty() || behind.starts_with(['=', ' ', '\t']);
    if is_apart && is_name(name) {
        Ok((name, value))
    } else {
        Err(Problem::FieldName(rest.to_owned()))
    }
}

/// The type and the number of its values: `uint8[4]`, `string[<=5]`, `float64[]`.
fn split_count(written: &str) -> Option<(&str, Count)> {
    let Some((item, count)) = written.strip_suffix(']').and_then(|rest| rest.rsplit_once('['))
    else {
        return Some((written, Count::One));
    };
    let count = match (count, count.strip_prefix("<=")) {
        ("", _) => Count::Any,
        (_, Some(bound)) => Count::AtMost(positive(bound)?),
        (length, None) => Count::Array(positive(length)?),
    };
    Some((item, count))
}

fn plain_kind(item: &str) -> Option<Item<'_>> {
    let (word, bound) = match item.split_once("<=") {
        Some((word, bound)) => (word, Some(positive(bound)?)),
        None => (item, None),
    };
    match (word, bound) {
        ("string", bound) => Some(Item::Plain(Kind::Text(bound))),
        ("wstring", bound) => Some(Item::Plain(Kind::WideText(bound))),
        (word, None) => {
            Some(number(word).map_or(Item::Named(word), |n| Item::Plain(Kind::Number(n))))
        }
        (_, Some(_)) => None,
    }
}

fn number(word: &str) -> Option<Number> {
    Some(match word {
        "bool" => Number::Bool,
        "byte" => Number::Byte,
        "char" => Number::Char,
        "int8" => Number::Int8,
        "uint8" => Number::Uint8,
        "int16" => Number::Int16,
        "uint16" => Number::Uint16,
        "int32" => Number::Int32,
        "uint32" => Number::Uint32,
        "int64" => Number::Int64,
        "uint64" => Number::Uint64,
        "float32" => Number::Float32,
        "float64" => Number::Float64,
        _ => return None,
    })
}

/// A positive decimal number.
fn positive(digits: &str) -> Option<u64> {
    let all_digits = digits.bytes().all(|byte| byte.is_ascii_digit());
    digits.parse().ok().filter(|count| all_digits && *count > 0)
}

/// The longest name of a package, a type or a field [bytes], as in ROS's own tools.
const LONGEST_NAME: usize = 255;

/// Whether a word is a valid name of a package, a type or a field.
pub(super) fn is_name(word: &str) -> bool {
    word.len() <= LONGEST_NAME
        && word.starts_with(|c: char| c.is_ascii_alphabetic())
        && word.chars().all(is_name_char)
}

fn is_name_char(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}
