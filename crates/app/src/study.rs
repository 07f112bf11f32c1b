//! A study: the sources, features and sinks of a session, in one TOML file.

mod settings;
mod checks;
mod key_commands;
mod error;
mod syntax;
mod mistyped;
mod elsewhere;
mod place;
mod excerpt;
mod plain;

use std::io::{ErrorKind, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};

use miette::NamedSource;
use teampulse_core::registry::{Entry, Settings, SettingsError};
use teampulse_core::text::{LONGEST_LABEL, LONGEST_NAME, label, on_one_line};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::components::Components;

use self::error::{MISSING, nearest, suggestion};
use self::excerpt::excerpt;
use self::place::{nearest_place, walk};
use self::plain::plain;

pub use self::error::{StudyError, is_near};
pub use self::key_commands::KeyCommands;
pub use self::settings::{FeatureSettings, General, SessionClock, SessionSettings, Shown};

/// The longest name of a session [bytes]: the time and a number are appended to it, and a file system
/// allows 255.
const MOST_NAME_BYTES: usize = 200;
/// The largest study that is read [bytes].
const LARGEST: u64 = 4 << 20;

/// A parsed study: its text, and the settings that all studies share.
#[derive(Debug)]
pub struct Study {
    path: PathBuf,
    text: String,
    /// The settings that all studies share.
    pub general: General,
}

/// The names of tables that a study may contain several times.
const ARRAYS: [&str; 5] = ["sources", "sinks", "workers", "phases", "alerts"];

/// The tables of a study that [`General`] does not read.
const OWN_TABLES: [&str; 4] = ["sources", "sinks", "workers", "simulate"];

impl Study {
    /// Reads a study from a file, or from standard input if the path is `-`.
    pub fn read(path: &Path) -> Result<Study, StudyError> {
        let unreadable = |reason: String| StudyError {
            message: line(&format!("failed to read the study {}: {reason}", path.display())),
            hint: Some("give the path of a study file, such as studies/demo.toml".into()),
            place: None,
        };
        let mut text = String::new();
        let read = if path == Path::new("-") {
            std::io::stdin().take(LARGEST).read_to_string(&mut text)
        } else {
            let file = std::fs::File::open(path).map_err(|error| unreadable(error.to_string()))?;
            file.take(LARGEST).read_to_string(&mut text)
        };
        let size = read.map_err(|error| match error.kind() {
            ErrorKind::InvalidData => StudyError {
                hint: Some("save it with the encoding UTF-8 in your editor".into()),
                ..unreadable("it is not UTF-8, as TOML must be".into())
            },
            _ => unreadable(error.to_string()),
        })? as u64;
        if size == LARGEST {
            return Err(unreadable(format!("it has {LARGEST} bytes or more")));
        }
        Study::parse(path, text)
    }

    /// Reads a study from its text; `path` names it in messages.
    pub fn parse(path: &Path, text: String) -> Result<Study, StudyError> {
        let mut study = Study { path: path.to_owned(), text, general: General::default() };
        let table = study.table()?;
        let span = table.span();
        let (mut keys, own): (DeTable<'_>, Vec<_>) = split(table.into_inner());
        study.set_features_apart(&mut keys)?;
        for (key, value) in own {
            study.check_own(&key, &value)?;
        }
        let rest = Settings::new(Spanned::new(span, DeValue::Table(keys)));
        study.general = rest.read().map_err(|error| study.wrong(with_own_tables(error), None))?;
        study.check_name()?;
        Ok(study)
    }

    /// The study's text, as it is stored in the bag.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Builds all components of one of the study's arrays (`sources`, `sinks`, `workers`) from their table.
    pub fn build<T: ?Sized, C>(
        &self,
        key: &str,
        entries: &[Entry<T, C>],
        context: &C,
    ) -> Result<Vec<(String, Box<T>)>, StudyError> {
        let values = self.entries(key)?.into_iter();
        values.map(|value| self.component(value, key, entries, context)).collect()
    }

    /// Reads the settings of one of the study's own tables (`simulate`).
    pub fn settings<S: serde::de::DeserializeOwned>(
        &self,
        key: &str,
    ) -> Result<Option<S>, StudyError> {
        let read = |value| Settings::new(value).read().map_err(|error| self.wrong(error, None));
        self.own(key)?.map(read).transpose()
    }

    /// Reads the settings of all entries of one kind in one of the study's arrays.
    pub fn settings_of<S: serde::de::DeserializeOwned>(
        &self,
        key: &str,
        kind: &str,
    ) -> Result<Vec<S>, StudyError> {
        let mut found = Vec::new();
        for value in self.entries(key)? {
            let span = value.span();
            let DeValue::Table(mut table) = value.into_inner() else { continue };
            let named = table.remove("type");
            if named.is_some_and(|named| named.get_ref().as_str() == Some(kind)) {
                let settings = Settings::new(Spanned::new(span.clone(), DeValue::Table(table)));
                found.push(settings.read().map_err(|error| self.wrong(error, Some(span)))?);
            }
        }
        Ok(found)
    }

    /// Returns the `type` of each entry in one of the study's arrays.
    pub fn kinds(&self, key: &str) -> Vec<String> {
        self.texts(key, "type").into_iter().flatten().collect()
    }

    /// Returns the text under a name in each entry of one of the study's arrays.
    pub fn texts(&self, key: &str, name: &str) -> Vec<Option<String>> {
        let text = |value: Spanned<DeValue<'_>>| match value.into_inner() {
            DeValue::Table(mut table) => table.remove(name)?.get_ref().as_str().map(str::to_owned),
            _ => None,
        };
        self.entries(key).unwrap_or_default().into_iter().map(text).collect()
    }

    /// Creates an error at one of the study's tables, or at a key in it; at the start of the study if the table does
    /// not exist.
    pub fn error(
        &self,
        (table, key): (&str, &str),
        message: impl Into<String>,
        hint: impl Into<String>,
    ) -> StudyError {
        let error = SettingsError::new(message).with_hint(hint);
        self.misplaced(error.at(if key.is_empty() {
            table.into()
        } else {
            format!("{table}.{key}")
        }))
    }

    /// Creates an error in settings whose path starts at the root of the study.
    pub fn misplaced(&self, error: SettingsError) -> StudyError {
        let whole = self.whole().ok();
        let span = whole.as_ref().and_then(|whole| nearest_place(whole, &error.path));
        self.wrong(error, span.or(Some(0..0)))
    }

    /// Whether a setting is written in the study.
    fn has(&self, path: &str) -> bool {
        self.whole().is_ok_and(|whole| walk(&whole, path).1)
    }

    fn whole(&self) -> Result<Spanned<DeValue<'_>>, StudyError> {
        let table = self.table()?;
        Ok(Spanned::new(table.span(), DeValue::Table(table.into_inner())))
    }

    /// Returns the settings of a feature: the table `[features.<kind>]`, or an empty one.
    pub fn feature(&self, kind: &str) -> Result<Settings<'_>, StudyError> {
        let own = self.own("features")?.and_then(|features| match features.into_inner() {
            DeValue::Table(mut table) => table.remove(kind),
            _ => None,
        });
        Ok(match own {
            Some(settings) => Settings::new(settings),
            None => Settings::empty(),
        })
    }

    /// Creates an error in a feature: in its own table, or in the settings of all features.
    pub fn wrong_feature(&self, kind: &str, error: SettingsError) -> StudyError {
        if error.span.is_some() {
            return self.wrong(error, None);
        }
        let own = format!("features.{kind}");
        let paths = [format!("{own}.{}", error.path), format!("features.{}", error.path)];
        let written = paths.into_iter().find(|path| self.has(path));
        self.misplaced(error.at(written.unwrap_or(own)))
    }

    /// Returns the commands of the terminal's letters and digits.
    pub fn key_commands(&self) -> Result<KeyCommands, StudyError> {
        KeyCommands::read(&self.general.keys).map_err(|error| self.misplaced(error))
    }

    fn component<T: ?Sized, C>(
        &self,
        value: Spanned<DeValue<'_>>,
        key: &str,
        entries: &[Entry<T, C>],
        context: &C,
    ) -> Result<(String, Box<T>), StudyError> {
        let span = value.span();
        let DeValue::Table(mut table) = value.into_inner() else {
            let error = SettingsError::new(format!("an entry of `{key}` is not a table"));
            return Err(self.wrong(error.with_hint(format!("start it with [[{key}]]")), Some(span)));
        };
        let kind = self.kind(&mut table, key, &span, entries)?;
        let whole = Spanned::new(span.clone(), DeValue::Table(table));
        let built = (kind.build)(Settings::new(whole.clone()), context);
        built.map(|it| (kind.kind.to_owned(), it)).map_err(|error| {
            let span = nearest_place(&whole, &error.path).unwrap_or(span);
            self.wrong(with_example(error, kind.example), Some(span))
        })
    }

    /// Removes the `type` from a component's table and looks it up.
    fn kind<'e, T: ?Sized, C>(
        &self,
        table: &mut DeTable<'_>,
        key: &str,
        span: &Range<usize>,
        entries: &'e [Entry<T, C>],
    ) -> Result<&'e Entry<T, C>, StudyError> {
        let kinds: Vec<&str> = entries.iter().map(|entry| entry.kind).collect();
        let hint = format!("the {key} are {}", kinds.join(", "));
        let Some(kind) = table.remove("type") else {
            let error = SettingsError::new("`type` is missing").with_hint(hint);
            return Err(self.wrong(error, Some(span.clone())));
        };
        let span = kind.span();
        let word = kind.get_ref().as_str().unwrap_or_default();
        entries.iter().find(|entry| entry.kind == word).ok_or_else(|| {
            let hint = nearest(word, &kinds).map_or(hint, |near| format!("did you mean `{near}`?"));
            let error = SettingsError::new(format!("there is no `{word}` among the {key}"));
            self.wrong(error.with_hint(hint), Some(span))
        })
    }

    fn table(&self) -> Result<Spanned<DeTable<'_>>, StudyError> {
        DeTable::parse(&self.text).map_err(|error| {
            self.wrong(syntax::explained(&self.text, error.message(), error.span()), None)
        })
    }

    fn own(&self, key: &str) -> Result<Option<Spanned<DeValue<'_>>>, StudyError> {
        Ok(self.table()?.into_inner().remove(key))
    }

    /// Returns the entries of one of the study's own arrays.
    fn entries(&self, key: &str) -> Result<Vec<Spanned<DeValue<'_>>>, StudyError> {
        match self.own(key)?.map(Spanned::into_inner) {
            Some(DeValue::Array(array)) => Ok(array.into_iter().collect()),
            _ => Ok(Vec::new()),
        }
    }

    /// Fails if the session's name can't be the name of a folder.
    fn check_name(&self) -> Result<(), StudyError> {
        let name = &self.general.session.name;
        let fits = |each: char| each.is_alphanumeric() || matches!(each, '_' | '-' | '.');
        // `rm` would take `-rf_2026…` for an option.
        let is_plain = name.len() <= MOST_NAME_BYTES && !name.starts_with(['.', '-']);
        if !name.is_empty() && is_plain && name.chars().all(fits) {
            return Ok(());
        }
        let name = label(name.clone(), LONGEST_NAME);
        let message = format!("`{name}` can't be the name of a session's folder");
        let hint = format!(
            "use letters and digits of any script, `_`, `-` and `.`; do not start with `.` or `-`; use \
             at most {MOST_NAME_BYTES} bytes"
        );
        Err(self.error(("session", "name"), message, hint))
    }

    /// Moves the tables of single features out of `[features]`, since the features read them themselves.
    fn set_features_apart(&self, general: &mut DeTable<'_>) -> Result<(), StudyError> {
        let Some(features) = general.get_mut("features") else { return Ok(()) };
        let DeValue::Table(table) = features.get_mut() else { return Ok(()) };
        for (key, value) in std::mem::take(table) {
            let word = key.get_ref().as_ref();
            let is_table = value.get_ref().is_table();
            if !Components::of_this_program().features.iter().any(|entry| entry.kind == word) {
                if is_table {
                    return Err(self.no_feature(word, key.span()));
                }
                table.insert(key, value);
            } else if !is_table {
                let error = SettingsError::new(format!("`{word}` is not a table"));
                let hint = format!("start its settings with [features.{word}]");
                return Err(self.wrong(error.with_hint(hint), Some(value.span())));
            }
        }
        Ok(())
    }

    fn no_feature(&self, word: &str, span: Range<usize>) -> StudyError {
        let entries = Components::of_this_program().features;
        let kinds: Vec<&str> = entries.iter().map(|entry| entry.kind).collect();
        let hint = match nearest(word, &kinds) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("the features are {}", kinds.join(", ")),
        };
        let error = SettingsError::new(format!("there is no feature `{word}`"));
        self.wrong(error.with_hint(hint), Some(span))
    }

    /// Fails unless `sources`, `sinks` and `workers` are arrays of tables, and `simulate` is a table.
    fn check_own(&self, key: &str, value: &Spanned<DeValue<'_>>) -> Result<(), StudyError> {
        let fits = match value.get_ref() {
            DeValue::Array(_) => key != "simulate",
            DeValue::Table(_) => key == "simulate",
            _ => false,
        };
        if fits {
            return Ok(());
        }
        let (written, shape) = if key == "simulate" {
            ("[simulate]", "expected a table: start it with")
        } else {
            ("[[…]]", "expected an array of tables: start each with")
        };
        let error = SettingsError::new(format!("`{key}` is not {written}"));
        let hint = format!("{shape} {}", header(key));
        Err(self.wrong(error.with_hint(hint), Some(value.span())))
    }

    fn wrong(&self, error: SettingsError, whole: Option<Range<usize>>) -> StudyError {
        let hint =
            if error.hint.is_empty() { suggestion(&error.message) } else { Some(error.hint) };
        let span = error.span.or(whole).unwrap_or(0..0);
        let (text, span) = excerpt(&self.text, &span);
        let source = NamedSource::new(line(&self.path.display().to_string()), text);
        let place = Some(Box::new((source.with_language("toml"), span)));
        StudyError {
            message: line(&plain(&error.message)),
            hint: hint.map(|hint| line(&hint)),
            place,
        }
    }
}

/// Adds the separately read tables to an error, since an unknown table may be a misspelt one of these.
fn with_own_tables(mut error: SettingsError) -> SettingsError {
    let unknown = error.message.strip_prefix("unknown field `");
    let Some((word, known)) = unknown.and_then(|rest| rest.split_once("`, expected one of `"))
    else {
        return error;
    };
    if !known.starts_with("session`") {
        return error;
    }
    let shared = known.split('`').step_by(2);
    let all: Vec<&str> = shared.filter(|key| !key.is_empty()).chain(OWN_TABLES).collect();
    if let Some(near) = nearest(word, &all).filter(|near| OWN_TABLES.contains(near)) {
        error.hint = format!("did you mean `{}`?", header(near));
    }
    error.message += &OWN_TABLES.map(|key| format!(", `{}`", header(key))).concat();
    error
}

/// Adds the line of an example that sets the missing setting, if the error is about one.
fn with_example(error: SettingsError, example: &str) -> SettingsError {
    let missing = error.message.strip_prefix(MISSING).and_then(|rest| rest.strip_suffix('`'));
    let sets =
        |line: &&str| line.split_once('=').is_some_and(|(key, _)| Some(key.trim()) == missing);
    match example.lines().find(sets) {
        Some(line) => error.with_hint(format!("add a line such as {line}")),
        None => error,
    }
}

/// Returns the header of a separately read table, as written in a study.
fn header(key: &str) -> String {
    if key == "simulate" { format!("[{key}]") } else { format!("[[{key}]]") }
}

/// Limits the length of an error's text and removes terminal control characters.
fn line(text: &str) -> String {
    let lines = text.lines().map(|line| on_one_line(line).into_owned());
    let mut lines = lines.take(20).map(|line| label(line, LONGEST_LABEL));
    let mut all = lines.next().unwrap_or_default();
    for line in lines {
        all.push('\n');
        all += &line;
    }
    all
}

type Own<'a> = Vec<(String, Spanned<DeValue<'a>>)>;

/// Splits a study's tables into the general ones and those that are read separately.
fn split(table: DeTable<'_>) -> (DeTable<'_>, Own<'_>) {
    let mut general = DeTable::new();
    let mut own = Vec::new();
    for (key, value) in table {
        if OWN_TABLES.contains(&key.get_ref().as_ref()) {
            own.push((key.get_ref().to_string(), value));
        } else {
            general.insert(key, value);
        }
    }
    (general, own)
}

#[cfg(test)]
mod tests;
