use crate::definition::{Count, Definition, EMPTY, Kind, Struct};

/// How many paths are listed: more than any sensible message has.
const MOST: usize = 2000;

/// How many fields are looked at for them: types without any number can be nested without end.
const MOST_FIELDS: usize = 10 * MOST;

/// The paths of all numbers in a message of a type; of many values the first. Strings, which may
/// spell numbers, are among them.
pub fn numbers(definition: &Definition) -> Vec<String> {
    let mut listing = Listing { paths: Vec::new(), fields: 0 };
    listing.collect(definition.root(), "");
    listing.paths
}

struct Listing {
    paths: Vec<String>,
    /// How many fields were looked at.
    fields: usize,
}

impl Listing {
    fn collect(&mut self, within: &Struct, prefix: &str) {
        for field in within.fields.iter().filter(|field| field.name != EMPTY) {
            self.fields += 1;
            if self.paths.len() >= MOST || self.fields >= MOST_FIELDS {
                return;
            }
            let index = if field.count == Count::One { "" } else { "[0]" };
            let path = format!("{prefix}{}{index}", field.name);
            match &field.kind {
                Kind::Struct(nested) => self.collect(nested, &format!("{path}.")),
                _ => self.paths.push(path),
            }
        }
    }
}
