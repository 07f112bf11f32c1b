//! A study: what to watch, what to compute, what to keep, in one TOML file.

mod settings;
mod error;
mod place;

use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

use miette::NamedSource;
use teampulse_core::registry::{Entry, Settings, SettingsError};
use teampulse_features::FEATURES;
use teampulse_sources::session;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use self::error::{nearest, suggestion};
use self::place::{nearest_place, walk};

pub use self::error::StudyError;
pub use self::settings::{FeatureSettings, General, SessionClock, SessionSettings};

/// The largest study that is read [bytes].
const LARGEST: u64 = 4 << 20;

/// A study as it was read: its text, and the parts of it that are the same for every study.
#[derive(Debug)]
pub struct Study {
    path: PathBuf,
    text: String,
    /// What is common to all studies.
    pub general: General,
}

/// The parts of a study that are read by somebody else than [`General`].
const OWN_TABLES: [&str; 3] = ["sources", "sinks", "simulate"];

impl Study {
    /// Reads a study from a file, or from standard input where the path is `-`.
    pub fn read(path: &Path) -> Result<Study, StudyError> {
        let unreadable = |reason: String| StudyError {
            message: format!("failed to read the study {}: {reason}", path.display()),
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
        let size = read.map_err(|error| unreadable(error.to_string()))? as u64;
        if size == LARGEST {
            return Err(unreadable(format!("it has {LARGEST} bytes or more")));
        }
        Study::parse(path, text)
    }

    /// Reads a study from its text; `path` is what it is called in messages.
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
        study.general = rest.read().map_err(|error| study.wrong(error, None))?;
        study.check_name()?;
        Ok(study)
    }

    /// The study's text, as it is kept in the bag.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Builds all components of one of the study's arrays (`sources`, `sinks`) by their table.
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

    /// An error at one of the study's tables, or at a key of it; at the beginning of the study
    /// where it is not written.
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

    /// What is wrong with settings whose path begins at the study.
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

    /// The settings of one kind of feature: the table `[features.<kind>]`, or none.
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

    /// What is wrong with a feature: in its own table, or in what the study says to all features.
    pub fn wrong_feature(&self, kind: &str, error: SettingsError) -> StudyError {
        if error.span.is_some() {
            return self.wrong(error, None);
        }
        let own = format!("features.{kind}");
        let paths = [format!("{own}.{}", error.path), format!("features.{}", error.path)];
        let written = paths.into_iter().find(|path| self.has(path));
        self.misplaced(error.at(written.unwrap_or(own)))
    }

    /// Fails where phases are named or timed as none can be.
    pub fn check_phases(&self) -> Result<(), StudyError> {
        session::check_phases(&self.general.phases).map_err(|error| {
            let path = format!("phases.{}", error.path);
            self.misplaced(error.at(path))
        })
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
            return Err(self.wrong(error.with_hint(format!("begin it with [[{key}]]")), Some(span)));
        };
        let kind = self.kind(&mut table, key, &span, entries)?;
        let whole = Spanned::new(span.clone(), DeValue::Table(table));
        let built = (kind.build)(Settings::new(whole.clone()), context);
        built.map(|it| (kind.kind.to_owned(), it)).map_err(|error| {
            let span = nearest_place(&whole, &error.path).unwrap_or(span);
            self.wrong(error, Some(span))
        })
    }

    /// Takes the `type` out of a component's table and finds it.
    fn kind<'e, T: ?Sized, C>(
        &self,
        table: &mut DeTable<'_>,
        key: &str,
        span: &Range<usize>,
        entries: &'e [Entry<T, C>],
    ) -> Result<&'e Entry<T, C>, StudyError> {
        let kinds: Vec<&str> = entries.iter().map(|entry| entry.kind).collect();
        let hint = format!("known {key} are {}", kinds.join(", "));
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
            let span = error.span();
            self.wrong(SettingsError::new(error.message().to_owned()), span)
        })
    }

    fn own(&self, key: &str) -> Result<Option<Spanned<DeValue<'_>>>, StudyError> {
        Ok(self.table()?.into_inner().remove(key))
    }

    /// The entries of one of the study's own arrays.
    fn entries(&self, key: &str) -> Result<Vec<Spanned<DeValue<'_>>>, StudyError> {
        match self.own(key)?.map(Spanned::into_inner) {
            Some(DeValue::Array(array)) => Ok(array.into_iter().collect()),
            _ => Ok(Vec::new()),
        }
    }

    /// The session's name becomes that of a folder.
    fn check_name(&self) -> Result<(), StudyError> {
        let name = &self.general.session.name;
        let fits = |each: char| each.is_alphanumeric() || matches!(each, '_' | '-' | '.');
        if !name.is_empty() && !name.starts_with('.') && name.chars().all(fits) {
            return Ok(());
        }
        let message = format!("`{name}` can't be the name of a session's folder");
        let hint = "it is made of letters, digits, `_`, `-` and `.`";
        Err(self.error(("session", "name"), message, hint))
    }

    /// Takes the tables of single features out of `[features]`: the features read them.
    fn set_features_apart(&self, general: &mut DeTable<'_>) -> Result<(), StudyError> {
        let Some(features) = general.get_mut("features") else { return Ok(()) };
        let DeValue::Table(table) = features.get_mut() else { return Ok(()) };
        for (key, value) in std::mem::take(table) {
            let word = key.get_ref().as_ref();
            let is_table = value.get_ref().is_table();
            if !FEATURES.iter().any(|entry| entry.kind == word) {
                if is_table {
                    return Err(self.no_feature(word, key.span()));
                }
                table.insert(key, value);
            } else if !is_table {
                let error = SettingsError::new(format!("`{word}` is not written as a table"));
                let hint = format!("begin its settings with [features.{word}]");
                return Err(self.wrong(error.with_hint(hint), Some(value.span())));
            }
        }
        Ok(())
    }

    fn no_feature(&self, word: &str, span: Range<usize>) -> StudyError {
        let kinds: Vec<&str> = FEATURES.iter().map(|entry| entry.kind).collect();
        let hint = match nearest(word, &kinds) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("the features are {}", kinds.join(", ")),
        };
        let error = SettingsError::new(format!("there is no feature `{word}`"));
        self.wrong(error.with_hint(hint), Some(span))
    }

    /// `sources` and `sinks` are arrays of tables, `simulate` is a table.
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
            ("[simulate]", "table")
        } else {
            ("[[…]]", "array of tables")
        };
        let error = SettingsError::new(format!("`{key}` is not written as {written}"));
        let hint = format!("it is an {shape}: begin each with [[{key}]]");
        Err(self.wrong(error.with_hint(hint), Some(value.span())))
    }

    fn wrong(&self, error: SettingsError, whole: Option<Range<usize>>) -> StudyError {
        let hint =
            if error.hint.is_empty() { suggestion(&error.message) } else { Some(error.hint) };
        let span = error.span.or(whole).unwrap_or(0..0);
        let name = self.path.display().to_string();
        let source = NamedSource::new(name, self.text.clone()).with_language("toml");
        StudyError { message: error.message, hint, place: Some(Box::new((source, span))) }
    }
}

type Own<'a> = Vec<(String, Spanned<DeValue<'a>>)>;

/// Splits a study's tables into the general ones and those that others read.
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
mod tests {
    use std::sync::Arc;

    use miette::{GraphicalReportHandler, GraphicalTheme};
    use proptest::prelude::*;
    use teampulse_core::clock::Clock;
    use teampulse_ros::bus::Bus;
    use teampulse_ros::buses::Buses;
    use teampulse_ros::memory::MemoryBus;
    use teampulse_sources::{SOURCES, SourceContext};

    use super::*;

    /// Reads a study and builds its sources, as `run` does.
    fn read(text: &str) -> Result<usize, StudyError> {
        let study = Study::parse(Path::new("study.toml"), text.to_owned())?;
        study.check_phases()?;
        let bus: Arc<dyn Bus> = MemoryBus::new("/test");
        let buses = Arc::new(Buses::holding([(0, bus)]));
        let context = SourceContext { clock: Clock::told(), buses };
        study.build("sources", SOURCES, &context).map(|sources| sources.len())
    }

    /// What is shown of a mistake.
    fn shown(text: &str) -> String {
        let handler = GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor());
        let error = read(text).expect_err("the study has a mistake");
        let mut shown = String::new();
        handler.with_width(90).render_report(&mut shown, &error).expect("a string takes all");
        shown
    }

    #[test]
    fn a_ten_line_study_is_enough() {
        let text = "[session]\nname = \"my_team\"\n[[sources]]\ntype = \"robots\"\n\
                    namespace = \"/robot*\"\nrequired = [\"battery\"]\n[[sinks]]\ntype = \"bag\"\n";
        assert_eq!(read(text).expect("a study"), 1);
        assert_eq!(read("").expect("an empty study is one of defaults"), 0);
    }

    #[test]
    fn a_misspelt_key_is_shown_at_its_place_with_the_right_one() {
        insta::assert_snapshot!(shown("[[sources]]\ntype = \"robots\"\nnamspace = \"/robot*\"\n"), @r#"
         × unknown field `namspace`, expected one of `namespace`, `domain`, `prefix`,
         │ `battery`, `link`, `odometry`, `diagnostics`, `temperature`, `numbers`, `images`,
         │ `commands`, `topics`, `required`, `robots`
          ╭─[study.toml:3:1]
        2 │ type = "robots"
        3 │ namspace = "/robot*"
          · ────────
          ╰────
         help: did you mean `namespace`?
        "#);
    }

    #[test]
    fn a_mistyped_value_is_shown_at_its_place() {
        insta::assert_snapshot!(shown("[[sources]]\ntype = \"robots\"\ndomain = \"zero\"\n"), @r#"
         × invalid type: string "zero", expected u32
          ╭─[study.toml:3:10]
        2 │ type = "robots"
        3 │ domain = "zero"
          ·          ──────
          ╰────
        "#);
    }

    #[test]
    fn an_unknown_kind_is_shown_with_the_nearest() {
        insta::assert_snapshot!(shown("[[sources]]\ntype = \"robot\"\n"), @r#"
         × there is no `robot` among the sources
          ╭─[study.toml:2:8]
        1 │ [[sources]]
        2 │ type = "robot"
          ·        ───────
          ╰────
         help: did you mean `robots`?
        "#);
    }

    #[test]
    fn phases_that_overlap_are_shown_at_the_later_one() {
        let text = "[[phases]]\nname = \"task\"\nfrom_secs = 50\n\
                    [[phases]]\nname = \"baseline\"\nfrom_secs = 0\nto_secs = 60\n";
        insta::assert_snapshot!(shown(text), @r#"
         × the phases `baseline` (from 0 s to 60 s) and `task` (from 50 s) overlap
          ╭─[study.toml:3:13]
        2 │ name = "task"
        3 │ from_secs = 50
          ·             ──
        4 │ [[phases]]
          ╰────
         help: one phase at a time: let the first end before the next begins
        "#);
    }

    #[test]
    fn a_feature_has_a_table_of_its_own() {
        let built = |text: &str| {
            let study = Study::parse(Path::new("study.toml"), text.to_owned())?;
            crate::setup::features(&study).map_err(|error| error.study().expect("of the study"))
        };
        let all = built("").expect("defaults").len();
        let set = "[features]\nwindows_secs = [10]\n[features.state]\nstale_secs = 3\n\
                   [features.heart]\nwindows_secs = [300]\n";
        assert_eq!(built(set).expect("settings").len(), all);
        for (text, told, place) in [
            ("[features.stat]\n", "there is no feature `stat`", "stat"),
            ("[features]\nstate = 3", "`state` is not written as a table", "3"),
            ("[features.state]\nstale = 3", "unknown field `stale`", "stale"),
            ("[features.state]\nstale_secs = \"a\"", "invalid type", "\"a\""),
            ("[features.state]\nstale_secs = -3", "`stale_secs` of -3 s", "-3"),
            ("[features.heart]\nwindows_secs = [-3]", "a window of -3 s", "[-3]"),
            ("[features]\nwindows_secs = [-3]\n[features.state]", "a window of -3 s", "[-3]"),
            ("[features]\ndisable = [\"state\"]\n[features.state]\nx = 1", "unknown field", "x"),
            ("[features.attention]\nlow_battery = 7", "a share from 0 to 1", "7"),
            ("[features.link_quality]\nweak_dbm = nan", "not a level", "nan"),
        ] {
            let error = built(text).err().expect(text);
            assert!(error.message.contains(told), "{text}: {}", error.message);
            let (_, span) = *error.place.expect("a place");
            assert_eq!(&text[span], place, "{text}");
        }
    }

    #[test]
    fn every_other_mistake_is_told_with_its_place() {
        for (text, told) in [
            ("[session\nname = 1", "unclosed table"),
            ("[session]\nname = 1", "invalid type: integer"),
            ("[sesion]\n", "unknown field `sesion`"),
            ("[session]\nclock = \"sundial\"", "unknown variant `sundial`"),
            ("[session]\nname = \"../x\"", "can't be the name"),
            ("sources = 3", "`sources` is not written as [[…]]"),
            ("[[sources]]\nnamespace = \"/r*\"", "`type` is missing"),
            ("sources = [3]", "an entry of `sources` is not a table"),
            (
                "[[sources]]\ntype = \"robots\"\nrequired = [\"wings\"]",
                "`wings` is not a parameter",
            ),
            ("[[sources]]\ntype = \"robots\"\nnamespace = \"/\"", "need a `prefix`"),
            ("[[sources]]\ntype = \"topics\"\nnames = [\"tf\"]", "not a pattern of ROS names"),
            ("[[sources]]\ntype = \"robots\"\nnamespace = \"r*\"", "not a pattern of ROS names"),
            ("[[sources]]\ntype = \"robots\"\ndomain = 7", "join"),
            ("[[phases]]\nname = \"baseline\"", "missing field `from_secs`"),
            ("[[phases]]\nname = \"\"\nfrom_secs = 0", "a phase has no name"),
        ] {
            let error = read(text).expect_err(text);
            assert!(error.message.contains(told), "{text}: {}", error.message);
            assert!(error.place.is_some(), "{text}: no place");
        }
    }

    #[test]
    fn every_example_is_a_study() {
        for entry in SOURCES {
            let text = format!("[[sources]]\ntype = \"{}\"\n{}\n", entry.kind, entry.example);
            assert_eq!(read(&text).unwrap_or_else(|error| panic!("{text}: {error}")), 1);
        }
    }

    proptest! {
        #[test]
        fn no_text_makes_it_panic(text in ".*") {
            drop(read(&text));
        }

        #[test]
        fn no_study_like_text_makes_it_panic(
            lines in prop::collection::vec("\\[?\\[?[a-z]{0,9}\\]?\\]? ?=? ?[\\[{\"a-z0-9/*.}\\]]{0,9}", 0..9),
        ) {
            drop(read(&lines.join("\n")));
        }
    }
}
