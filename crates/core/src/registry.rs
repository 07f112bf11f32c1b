//! The registry: components by name, each built from its settings in a study.

use std::ops::Range;

use schemars::{JsonSchema, Schema};
use serde::de::DeserializeOwned;
use thiserror::Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// An entry in a table of components: a kind of source, feature, sink or worker.
pub struct Entry<T: ?Sized, C> {
    /// The component's name in a study: `type = "robots"`.
    pub kind: &'static str,
    /// Working settings, as written in a study; shown in the documentation and tested.
    pub example: &'static str,
    /// Builds the component from its settings.
    pub build: fn(Settings<'_>, &C) -> Result<Box<T>, SettingsError>,
    /// The JSON schema of the component's settings, with their documentation.
    pub schema: fn() -> Schema,
}

/// The settings of a kind of component: how they are read and what they build.
pub trait Component<T: ?Sized, C>: DeserializeOwned + JsonSchema {
    /// Working settings, without the `type`.
    const EXAMPLE: &'static str;

    /// Builds the component.
    fn build(self, context: &C) -> Result<Box<T>, SettingsError>;
}

impl<T: ?Sized, C> Clone for Entry<T, C> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T: ?Sized, C> Copy for Entry<T, C> {}

impl<T: ?Sized, C> Entry<T, C> {
    /// Creates the entry of the component with settings `S`.
    pub const fn new<S: Component<T, C>>(kind: &'static str) -> Entry<T, C> {
        Entry {
            kind,
            example: S::EXAMPLE,
            build: |settings, context| settings.read::<S>()?.build(context),
            schema: || schemars::schema_for!(S),
        }
    }

    /// The first sentence of the component's documentation.
    pub fn summary(&self) -> String {
        let schema = (self.schema)();
        let text = schema.get("description").and_then(|text| text.as_str()).unwrap_or_default();
        text.lines().take_while(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
    }
}

/// The settings of one component as written in a study, with their position in it.
#[derive(Clone, Debug)]
pub struct Settings<'a>(Spanned<DeValue<'a>>);

impl<'a> Settings<'a> {
    /// Empty settings, with which every default applies.
    pub fn empty() -> Settings<'static> {
        Settings(Spanned::new(0..0, DeValue::Table(DeTable::new())))
    }

    /// The table of a component, without its `type`.
    pub fn new(table: Spanned<DeValue<'a>>) -> Settings<'a> {
        Settings(table)
    }

    /// Reads the settings; an unknown or mistyped key is an error with its exact place.
    pub fn read<S: DeserializeOwned>(self) -> Result<S, SettingsError> {
        let table = self.0.span();
        S::deserialize(toml::de::ValueDeserializer::from(self.0)).map_err(|error| SettingsError {
            message: error.message().to_owned(),
            hint: String::new(),
            path: String::new(),
            span: Some(error.span().unwrap_or(table)),
        })
    }
}

/// An error in settings, and its place in the study.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{message}")]
pub struct SettingsError {
    /// The message: the value, and what was expected.
    pub message: String,
    /// What the user can do; may be empty.
    pub hint: String,
    /// The path of the wrong setting within the component: keys and indices separated by dots, such as
    /// `script.2.robot`; empty for the whole component.
    pub path: String,
    /// The byte range of the wrong part of the study, if known; otherwise `path` locates it.
    pub span: Option<Range<usize>>,
}

impl SettingsError {
    /// An error about the component as a whole.
    pub fn new(message: impl Into<String>) -> SettingsError {
        let (hint, path) = (String::new(), String::new());
        SettingsError { message: message.into(), hint, path, span: None }
    }

    /// Returns the error with the path of a setting of the component.
    #[must_use]
    pub fn at(mut self, path: impl Into<String>) -> SettingsError {
        self.path = path.into();
        self
    }

    /// Returns the error with a hint.
    #[must_use]
    pub fn with_hint(mut self, hint: impl Into<String>) -> SettingsError {
        self.hint = hint.into();
        self
    }
}
