use crate::definition::{Count, Definition, EMPTY, Kind, Struct};

/// The most paths that are listed: more than any reasonable message has.
const MOST: usize = 2000;

/// The most fields that are visited: types without numbers can be nested extensively.
const MOST_FIELDS: usize = 10 * MOST;

/// The paths of all numbers in a message of a type, with the first value of each array. Strings are
/// included, as they may contain numbers.
pub fn numbers(definition: &Definition) -> Vec<String> {
    let mut listing = Listing { paths: Vec::new(), fields: 0 };
    listing.collect(definition.root(), "");
    listing.paths
}

struct Listing {
    paths: Vec<String>,
    /// The number of fields visited.
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
