use super::numbers;
use crate::definition::Definition;

/// The path that was probably meant: a path that ends with the given text, or the most similar path if it is close.
pub(super) fn nearest(definition: &Definition, asked: &str) -> Option<String> {
    let paths = numbers(definition);
    let end = format!(".{asked}");
    let alike = |path: &String| strsim::jaro_winkler(path, asked);
    let longer = paths.iter().find(|path| path.ends_with(&end));
    let similar = || paths.iter().max_by(|a, b| alike(a).total_cmp(&alike(b)));
    longer.or_else(|| similar().filter(|path| is_near(asked, path))).cloned()
}

/// Whether `asked` may be a misspelling of `path`: at most a third of the letters differ.
fn is_near(asked: &str, path: &str) -> bool {
    let letters = asked.chars().count().max(path.chars().count());
    strsim::osa_distance(asked, path) <= (letters / 3).max(1)
}
