//! Laws of the table of components in a crate's `src/lib.rs`: shared by the crates that have such a table.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use teampulse_core::registry::{Entry, Settings};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The components in a crate's files that are missing from its table, each with the lines to add. `kind` is
/// the trait that they build: `Source`.
pub fn missing(crate_folder: &str, kind: &str) -> Vec<String> {
    let source = Path::new(crate_folder).join("src");
    let table = fs::read_to_string(source.join("lib.rs")).expect("a readable lib.rs");
    let mut files = Vec::new();
    collect(&source, &mut files);
    let rows = files.iter().filter_map(|file| missing_row(&source, file, kind, &table));
    rows.collect()
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

fn missing_row(source: &Path, file: &Path, kind: &str, table: &str) -> Option<String> {
    let text = fs::read_to_string(file).expect("a readable file");
    let begin = format!("impl Component<dyn {kind}, ");
    let built = text.lines().find(|line| line.starts_with(&begin))?;
    let settings = built.split(" for ").nth(1)?.split_whitespace().next()?;
    let inside = file.strip_prefix(source).expect("a file of the crate");
    let names = inside.with_extension("");
    let names: Vec<_> = names.iter().map(|name| name.to_string_lossy()).collect();
    let modules = names.strip_suffix(&["mod".into()]).unwrap_or(&names);
    let mut rows = table.split("Entry::new::<").skip(1).filter_map(|row| row.split('>').next());
    let first = modules.first().map(|name| &**name);
    let is_its_row =
        |row: &str| row.split("::").next() == first && row.ends_with(&format!("::{settings}"));
    if rows.any(is_its_row) {
        return None;
    }
    let (module, path) = (modules.last()?, modules.join("::"));
    let row = format!("`Entry::new::<{path}::{settings}>(\"{module}\"),`");
    let added = match parent(source, modules) {
        Some(parent) => format!("`pub mod {module};` to {parent} and {row} to src/lib.rs"),
        None => format!("`mod {module};` and {row} to src/lib.rs"),
    };
    Some(format!("src/{}: `{settings}` is in no table: add {added}", inside.display()))
}

/// The file of the module above a nested one.
fn parent(source: &Path, modules: &[Cow<'_, str>]) -> Option<String> {
    let (_, above) = modules.split_last().filter(|(_, above)| !above.is_empty())?;
    let file = format!("{}.rs", above.join("/"));
    let is_file = source.join(&file).exists();
    Some(if is_file { format!("src/{file}") } else { format!("src/{}/mod.rs", above.join("/")) })
}

/// The documentation that a row lacks: its first sentence, that of a setting, or an example in
/// TOML.
pub fn undocumented<T: ?Sized, C>(entry: &Entry<T, C>) -> Vec<String> {
    let mut lacking = Vec::new();
    if !entry.summary().ends_with(['.', ':']) {
        lacking.push(format!("{}: its settings have no first sentence", entry.kind));
    }
    let schema = (entry.schema)().to_value();
    for (name, property) in schema["properties"].as_object().into_iter().flatten() {
        if property.get("description").is_none() {
            lacking.push(format!("{}: the setting `{name}` is not documented", entry.kind));
        }
    }
    if let Err(error) = DeTable::parse(entry.example) {
        lacking.push(format!("{}: its example is not TOML: {error}", entry.kind));
    }
    lacking
}

/// The error of building the example of a row, if any.
pub fn broken_example<T: ?Sized, C>(entry: &Entry<T, C>, context: &C) -> Option<String> {
    example(entry, context)?.err()
}

/// The component of a row's example, or the error of building it; `None` if the example is not TOML.
pub fn example<T: ?Sized, C>(entry: &Entry<T, C>, context: &C) -> Option<Result<Box<T>, String>> {
    let table = DeTable::parse(entry.example).ok()?;
    let table = Spanned::new(table.span(), DeValue::Table(table.into_inner()));
    let built = (entry.build)(Settings::new(table), context);
    Some(built.map_err(|error| format!("{}: failed to build its example: {error}", entry.kind)))
}
