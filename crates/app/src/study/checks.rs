//! Checks of the settings that the whole study shares.

use teampulse_core::command::VERBS;
use teampulse_core::registry::SettingsError;
use teampulse_core::text::{LONGEST_NAME, label};
use teampulse_features::thresholds;
use teampulse_sources::session;
use toml::Spanned;
use toml::de::DeValue;

use super::error::nearest;
use super::{Study, StudyError};
use crate::components::Components;

impl Study {
    /// Fails if phases, commands, alerts or the hiding of faces are invalid.
    pub fn check(&self) -> Result<(), StudyError> {
        self.check_phases()?;
        self.check_commands()?;
        self.check_alerts()?;
        self.check_faces()
    }

    /// Fails if the names or times of phases are invalid.
    fn check_phases(&self) -> Result<(), StudyError> {
        session::check_phases(&self.general.phases).map_err(|error| {
            let path = format!("phases.{}", error.path);
            self.misplaced(error.at(path))
        })
    }

    /// Fails if an alert is invalid, or if the feature that raises alerts is disabled.
    fn check_alerts(&self) -> Result<(), StudyError> {
        thresholds::check(&self.general.alerts).map_err(|error| {
            let path = format!("alerts.{}", error.path);
            self.misplaced(error.at(path))
        })?;
        let is_disabled = self.general.features.disable.iter().any(|kind| kind == "attention");
        if is_disabled && !self.general.alerts.is_empty() {
            let message = "the feature `attention`, which raises the [[alerts]], is disabled";
            return Err(self.error(
                ("features", "disable"),
                message,
                "enable it, or remove the [[alerts]]",
            ));
        }
        Ok(())
    }

    /// Fails if faces are to be hidden but no worker hides them, or if a worker hides faces but no source has any to
    /// hide.
    fn check_faces(&self) -> Result<(), StudyError> {
        let hides = self.kinds("workers").iter().any(|kind| kind == "blur");
        let mut asked = None;
        for source in self.entries("sources")? {
            let DeValue::Table(table) = source.into_inner() else { continue };
            let faces = table.get("faces").filter(|faces| faces.get_ref().as_str() == Some("blur"));
            asked = asked.or(faces.map(Spanned::span));
        }
        match (hides, asked) {
            (false, Some(span)) => {
                let error = SettingsError::new(
                    "nothing hides these faces, so no picture would be recorded",
                );
                let hint = "add [[workers]] of the type `blur`, with a model that finds faces";
                Err(self.wrong(error.with_hint(hint), Some(span)))
            }
            (true, None) => {
                let error = SettingsError::new("no source has faces to hide for the worker `blur`");
                let hint = "write `faces = \"blur\"` below the cameras, robots or topics whose faces are to be hidden";
                Err(self.misplaced(error.with_hint(hint).at("workers")))
            }
            _ => Ok(()),
        }
    }

    /// Fails if an unknown command is allowed, if an unknown component may send commands, or if a key has no valid
    /// command.
    fn check_commands(&self) -> Result<(), StudyError> {
        self.key_commands()?;
        self.check_commanders()?;
        let Some((setting, place, word)) = self.general.commands.unknown() else { return Ok(()) };
        let verbs = VERBS.map(|(verb, _, _)| verb);
        let near = nearest(word, &verbs).map(|near| format!("did you mean `{near}`?"));
        let hint = near.unwrap_or_else(|| format!("the commands are {}, or *", verbs.join(", ")));
        let message = format!("there is no command `{}`", label(word.to_owned(), LONGEST_NAME));
        let error = SettingsError::new(message).with_hint(hint);
        Err(self.misplaced(error.at(format!("commands.{setting}.{place}"))))
    }

    fn check_commanders(&self) -> Result<(), StudyError> {
        let known = Components::of_this_program().kinds();
        let mut components = self.general.commands.components.keys();
        let Some(unknown) = components.find(|it| !known.contains(&it.as_str())) else {
            return Ok(());
        };
        let settings: Vec<&str> = ["keys", "ros"].into_iter().chain(known).collect();
        let near = nearest(unknown, &settings).map(|near| format!("did you mean `{near}`?"));
        let hint = near.unwrap_or_else(|| "expected keys, ros or the `type` of a component".into());
        let name = label(unknown.clone(), LONGEST_NAME);
        let error =
            SettingsError::new(format!("there is no component `{name}` that could send commands"));
        Err(self.misplaced(error.with_hint(hint).at(format!("commands.{unknown}"))))
    }
}
