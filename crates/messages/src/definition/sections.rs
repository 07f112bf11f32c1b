use std::collections::BTreeMap;

use super::name::full_name;
use super::{Misread, Problem};

/// The text of one type.
#[derive(Clone, Debug, Default)]
pub(super) struct Section<'a> {
    /// Its lines, each with its number in the whole text, counted from 1.
    pub lines: Vec<(usize, &'a str)>,
}

/// Splits a text into those of its types, by full name. Of two with one name the first counts.
pub(super) fn split<'a>(
    root: &str,
    text: &'a str,
) -> Result<BTreeMap<String, Section<'a>>, Misread> {
    let mut sections = BTreeMap::new();
    let (mut name, mut section) = (root.to_owned(), Section::default());
    let mut lines = text.lines().enumerate().map(|(k, line)| (k + 1, line));
    while let Some((number, line)) = lines.next() {
        if is_separator(line) {
            sections.entry(name).or_insert(section);
            let title = lines.next().and_then(|(_, title)| titled(title));
            name = title.ok_or(Misread { line: number + 1, problem: Problem::Separator })?;
            section = Section::default();
        } else {
            section.lines.push((number, line));
        }
    }
    sections.entry(name).or_insert(section);
    Ok(sections)
}

fn is_separator(line: &str) -> bool {
    let line = line.trim_end();
    line.len() >= 80 && line.bytes().all(|byte| byte == b'=')
}

fn titled(title: &str) -> Option<String> {
    full_name(title.strip_prefix("MSG:")?.trim(), "")
}
