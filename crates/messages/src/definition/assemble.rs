use std::collections::BTreeSet;

use thiserror::Error;

use super::name::referenced;
use super::sections::separator;

/// The most types in a definition.
const MOST_PARTS: usize = 1000;

/// Why a definition could not be assembled.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum AssembleError {
    /// The text of a type is not available.
    #[error("find the text of {0}")]
    Missing(String),
    /// The type refers to more types than is reasonable.
    #[error("assemble {0}: it consists of more than {MOST_PARTS} types")]
    Endless(String),
}

/// Assembles the definition of a type from the `.msg` texts of all types that it refers to, in the order of
/// rosbag2: referenced types follow by name, each type once. Each text is requested by the full name of its
/// type.
pub fn assemble<T: AsRef<str>>(
    type_name: &str,
    text_of: impl FnMut(&str) -> Option<T>,
) -> Result<String, AssembleError> {
    let mut assembly = Assembly { text_of, seen: BTreeSet::new(), whole: String::new() };
    match assembly.append(type_name) {
        Ok(()) if assembly.seen.len() <= MOST_PARTS => Ok(assembly.whole),
        Ok(()) => Err(AssembleError::Endless(type_name.to_owned())),
        Err(missing) => Err(missing),
    }
}

struct Assembly<F> {
    text_of: F,
    seen: BTreeSet<String>,
    whole: String,
}

impl<F, T: AsRef<str>> Assembly<F>
where
    F: FnMut(&str) -> Option<T>,
{
    fn append(&mut self, type_name: &str) -> Result<(), AssembleError> {
        let missing = || AssembleError::Missing(type_name.to_owned());
        let text = (self.text_of)(type_name).ok_or_else(missing)?;
        self.whole.push_str(text.as_ref());
        let parts: BTreeSet<_> = referenced(text.as_ref(), type_name).collect();
        for part in parts {
            if self.seen.len() <= MOST_PARTS && self.seen.insert(part.clone()) {
                self.whole.push_str(&separator(&part));
                self.append(&part)?;
            }
        }
        Ok(())
    }
}
