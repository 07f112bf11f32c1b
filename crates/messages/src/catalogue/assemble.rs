use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use crate::definition::referenced;

/// The definition of a type with all that it is made of, in the order in which rosbag2 writes it:
/// what a type refers to comes behind it, by name, each type once.
pub(super) fn assemble<'a>(
    type_name: &str,
    text_of: impl Fn(&str) -> Option<&'a str> + Copy,
) -> String {
    let mut whole = text_of(type_name).unwrap_or_default().to_owned();
    append(type_name, text_of, &mut BTreeSet::new(), &mut whole);
    whole
}

fn append<'a>(
    within: &str,
    text_of: impl Fn(&str) -> Option<&'a str> + Copy,
    seen: &mut BTreeSet<String>,
    whole: &mut String,
) {
    let text = text_of(within).unwrap_or_default();
    let references: BTreeMap<_, _> = referenced(text, within).collect();
    for (short_name, full_name) in references {
        if seen.insert(full_name.clone()) {
            let text = text_of(&full_name).unwrap_or_default();
            write!(whole, "\n{:=<80}\nMSG: {short_name}\n{text}", "").expect("a string takes it");
            append(&full_name, text_of, seen, whole);
        }
    }
}
