use crate::definition::{Count, Definition, EMPTY, Kind, Struct};

/// How many paths are looked at: more than any sensible message has.
const MOST: usize = 2000;

/// The paths of all numbers in a message of a type; of many values the first. Strings, which may
/// spell numbers, are among them.
pub fn numbers(definition: &Definition) -> Vec<String> {
    let mut paths = Vec::new();
    collect(definition.root(), "", &mut paths);
    paths
}

fn collect(within: &Struct, prefix: &str, paths: &mut Vec<String>) {
    for field in within.fields.iter().filter(|field| field.name != EMPTY) {
        if paths.len() >= MOST {
            return;
        }
        let index = if field.count == Count::One { "" } else { "[0]" };
        let path = format!("{prefix}{}{index}", field.name);
        match &field.kind {
            Kind::Struct(nested) => collect(nested, &format!("{path}."), paths),
            _ => paths.push(path),
        }
    }
}
