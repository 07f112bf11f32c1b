use super::error::Misread;
use super::name::{checked_name, full_name, short_name};
use super::{DefinitionError, Problem};

/// The text of one type.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section<'a> {
    pub text: &'a str,
    /// The number of lines before the section in the whole text.
    pub lines_before: usize,
}

/// Splits a text into the texts of its types, each with the full name of the type.
pub(super) fn split<'a>(root: &str, text: &'a str) -> Result<Vec<(String, Section<'a>)>, Misread> {
    let mut sections = Vec::new();
    let (mut name, mut begin, mut lines_before) = (root.to_owned(), 0, 0);
    let mut end = 0;
    let mut lines = text.split_inclusive('\n').enumerate();
    while let Some((before, line)) = lines.next() {
        if is_separator(line) {
            sections.push((name, Section { text: &text[begin..end], lines_before }));
            let title = lines.next().map_or("", |(_, title)| title);
            let wrong = Misread { line: before + 2, problem: Problem::Separator };
            name = titled(title).ok_or(wrong)?;
            (begin, lines_before) = (end + line.len() + title.len(), before + 2);
            end = begin;
        } else {
            end += line.len();
        }
    }
    sections.push((name, Section { text: &text[begin..], lines_before }));
    Ok(sections)
}

/// The texts of a type and of all types that it refers to.
pub(super) fn parts(type_name: &str, text: &str) -> Result<Vec<(String, String)>, DefinitionError> {
    let type_name = checked_name(type_name)?;
    let sections = split(&type_name, text)
        .map_err(|Misread { line, problem }| DefinitionError::Line { type_name, line, problem })?;
    let last = sections.len() - 1;
    let parts = sections.into_iter().enumerate().map(|(k, (name, section))| {
        let behind = if k == last { "" } else { "\n" };
        (name, section.text.strip_suffix(behind).unwrap_or(section.text).to_owned())
    });
    Ok(parts.collect())
}

/// The separator before the type with this full name.
pub(super) fn separator(full_name: &str) -> String {
    format!("\n{:=<80}\nMSG: {}\n", "", short_name(full_name))
}

fn is_separator(line: &str) -> bool {
    let line = line.trim_end();
    line.len() >= 80 && line.bytes().all(|byte| byte == b'=')
}

fn titled(title: &str) -> Option<String> {
    full_name(title.strip_prefix("MSG:")?.trim(), "")
}
