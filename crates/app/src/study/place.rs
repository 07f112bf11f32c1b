//! Finds the place of a setting in a study.

use std::ops::Range;

use toml::Spanned;
use toml::de::DeValue;

/// Returns the place of a setting, or of the nearest table above it; `None` if not even the first key exists.
pub(super) fn nearest_place(whole: &Spanned<DeValue<'_>>, path: &str) -> Option<Range<usize>> {
    let (found, _) = walk(whole, path);
    (!std::ptr::eq(found, whole)).then(|| found.span())
}

/// Follows a path as far as it exists; returns whether it was followed to its end.
pub(super) fn walk<'v, 'a>(
    whole: &'v Spanned<DeValue<'a>>,
    path: &str,
) -> (&'v Spanned<DeValue<'a>>, bool) {
    let mut found = whole;
    for key in path.split('.').filter(|key| !key.is_empty()) {
        let below = match found.get_ref() {
            DeValue::Array(array) => key.parse().ok().and_then(|place: usize| array.get(place)),
            other => other.get(key),
        };
        let Some(below) = below else { return (found, false) };
        found = below;
    }
    (found, true)
}
