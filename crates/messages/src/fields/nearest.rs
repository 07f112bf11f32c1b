use super::numbers;
use crate::definition::Definition;

/// The path that was probably meant: one that ends with the given text, or the most similar.
pub(super) fn nearest(definition: &Definition, asked: &str) -> Option<String> {
    let paths = numbers(definition);
    let end = format!(".{asked}");
    let alike = |path: &String| strsim::jaro_winkler(path, asked);
    let longer = paths.iter().find(|path| path.ends_with(&end));
    longer.or(paths.iter().max_by(|a, b| alike(a).total_cmp(&alike(b)))).cloned()
}
