use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::declaration::{Declaration, Item, Value};
use super::error::Misread;
use super::name::{checked_name, full_name, package_of};
use super::sections::{Section, split};
use super::{Constant, Count, DefinitionError, EMPTY, Field, Kind, Number, Problem, Struct};

/// The maximum nesting depth of types.
pub(super) const DEEPEST: usize = 32;

/// The largest total size of the fixed-size fields of a message [bytes].
const LARGEST_BYTES: u64 = 1 << 30;

/// Reads a type and all types that it refers to.
pub(super) fn read(type_name: &str, text: &str) -> Result<Arc<Struct>, DefinitionError> {
    let type_name = checked_name(type_name)?;
    let root = split(&type_name, text).and_then(|sections| {
        // Of two types with the same name, the first is used.
        let sections = sections.into_iter().rev().collect();
        let mut linker = Linker { sections, done: BTreeMap::new(), open: Vec::new() };
        linker.link(&type_name, 1)
    });
    root.map_err(|Misread { line, problem }| DefinitionError::Line { type_name, line, problem })
}

/// Reads types on demand, each once, and referenced types before the types that contain them.
struct Linker<'a> {
    sections: BTreeMap<String, Section<'a>>,
    done: BTreeMap<String, Arc<Struct>>,
    /// The types being read, each a part of the previous one.
    open: Vec<String>,
}

impl Linker<'_> {
    /// The type with this full name, as referenced in a line.
    fn link(&mut self, name: &str, line: usize) -> Result<Arc<Struct>, Misread> {
        let wrong = |problem| Err(Misread { line, problem });
        if let Some(done) = self.done.get(name) {
            let is_deep = self.open.len() + done.depth > DEEPEST;
            return if is_deep { wrong(Problem::Deep) } else { Ok(Arc::clone(done)) };
        }
        if self.open.iter().any(|open| open == name) {
            return wrong(Problem::Recursive(name.to_owned()));
        }
        if self.open.len() == DEEPEST {
            return wrong(Problem::Deep);
        }
        let Some(section) = self.sections.remove(name) else {
            return wrong(Problem::Undefined(name.to_owned()));
        };
        self.open.push(name.to_owned());
        let read = Arc::new(self.read(name, section)?);
        self.open.pop();
        if read.least_bytes > LARGEST_BYTES {
            return wrong(Problem::Large(read.least_bytes));
        }
        self.done.insert(name.to_owned(), Arc::clone(&read));
        Ok(read)
    }

    fn read(&mut self, name: &str, section: Section<'_>) -> Result<Struct, Misread> {
        let (mut fields, mut constants) = (Vec::new(), Vec::new());
        let mut names = BTreeSet::new();
        for (before, text) in section.text.lines().enumerate() {
            let number = section.lines_before + before + 1;
            let wrong = |problem| Misread { line: number, problem };
            let Some(line) = Declaration::read(text).map_err(wrong)? else { continue };
            if !names.insert(line.name) {
                return Err(wrong(Problem::Twice(line.name.to_owned())));
            }
            match line.value {
                Value::Constant(value) => constants.push(constant(&line, value).map_err(wrong)?),
                Value::Default(default) => fields.push(self.field(&line, default, name, number)?),
            }
        }
        if fields.is_empty() {
            fields.push(placeholder());
        }
        Ok(Struct::new(name.to_owned(), fields, constants))
    }

    fn field(
        &mut self,
        line: &Declaration<'_>,
        default: &str,
        within: &str,
        number: usize,
    ) -> Result<Field, Misread> {
        let kind = match &line.item {
            Item::Plain(kind) => kind.clone(),
            Item::Named(written) => {
                let unreadable = || Misread { line: number, problem: no_type(written) };
                let name = full_name(written, package_of(within)).ok_or_else(unreadable)?;
                Kind::Struct(self.link(&name, number)?)
            }
        };
        let (name, default) = (line.name.to_owned(), default.to_owned());
        Ok(Field { name, kind, count: line.count, default })
    }
}

fn no_type(written: &str) -> Problem {
    Problem::Type(written.to_owned())
}

fn constant(line: &Declaration<'_>, value: &str) -> Result<Constant, Problem> {
    match (&line.item, line.count) {
        (Item::Plain(kind), Count::One) => {
            let (name, value) = (line.name.to_owned(), value.to_owned());
            Ok(Constant { name, kind: kind.clone(), value })
        }
        _ => Err(Problem::Constant(line.name.to_owned())),
    }
}

/// The field that stands for an empty type.
fn placeholder() -> Field {
    Field {
        name: EMPTY.to_owned(),
        kind: Kind::Number(Number::Uint8),
        count: Count::One,
        default: String::new(),
    }
}
