use std::collections::BTreeSet;

use thiserror::Error;

use super::name::referenced;
use super::sections::separator;

/// How many types a definition is made of at most.
const MOST_PARTS: usize = 1000;

/// Why a definition could not be put together.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum AssembleError {
    /// The text of a type is not to be had.
    #[error("find the text of {0}")]
    Missing(String),
    /// It is made of more types than any sensible one.
    #[error("put {0} together: it is made of more than {MOST_PARTS} types")]
    Endless(String),
}

/// Puts the definition of a type together from the `.msg` texts of all that it is made of, in the
/// order in which rosbag2 writes it: what a type refers to comes behind it, by name, each type once.
/// Each text is asked for by the full name of its type.
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
