//! The commands of the terminal's letters and digits.

use std::collections::BTreeMap;

use teampulse_core::command::Command;
use teampulse_core::registry::SettingsError;

/// The commands that keys send; any other letter or digit sets a marker named after it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KeyCommands(BTreeMap<char, Command>);

impl KeyCommands {
    /// Reads the table `[keys]` of a study.
    pub fn read(settings: &BTreeMap<String, String>) -> Result<KeyCommands, SettingsError> {
        let read = |(key, command): (&String, &String)| {
            let at = format!("keys.{key}");
            let wrong = |message: String| SettingsError::new(message).at(at.clone());
            let mut chars = key.chars();
            let (Some(name), None) = (chars.next(), chars.next()) else {
                return Err(wrong(format!("`{key}` is not a key: expected one letter or digit")));
            };
            if !name.is_ascii_alphanumeric() {
                return Err(wrong(format!(
                    "`{key}` can't have a command: expected a letter or digit"
                )));
            }
            if name == 'q' {
                return Err(wrong("`q` can't have a command: it ends the session".into()));
            }
            let command = command.parse().map_err(|error| {
                wrong(format!("failed to {error}"))
                    .with_hint("a marker, for example, is `mark robot lost`")
            })?;
            Ok((name, command))
        };
        settings.iter().map(read).collect::<Result<_, _>>().map(KeyCommands)
    }

    /// The command of a key.
    pub fn of(&self, key: char) -> Option<&Command> {
        self.0.get(&key)
    }

    /// The components to which keys send requests, with the keys.
    pub fn asked(&self) -> impl Iterator<Item = (char, &str)> {
        self.0.iter().filter_map(|(key, command)| match command {
            Command::Do { component, .. } => Some((*key, component.as_str())),
            _ => None,
        })
    }

    /// The markers among them, with their keys.
    pub fn markers(&self) -> impl Iterator<Item = (char, &str)> {
        self.0.iter().filter_map(|(key, command)| match command {
            Command::Mark(label) => Some((*key, label.as_str())),
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(key: &str, command: &str) -> Result<KeyCommands, SettingsError> {
        KeyCommands::read(&BTreeMap::from([(key.to_owned(), command.to_owned())]))
    }

    #[test]
    fn a_key_sends_its_command() {
        let keys = read("l", "mark robot lost").unwrap();
        assert_eq!(keys.of('l'), Some(&Command::Mark("robot lost".into())));
        assert_eq!(keys.of('L'), None);
        assert_eq!(keys.markers().collect::<Vec<_>>(), [('l', "robot lost")]);
        let keys = read("1", "do nback start 2").unwrap();
        assert_eq!(keys.of('1').map(ToString::to_string), Some("do nback start 2".into()));
        assert_eq!(keys.markers().count(), 0);
    }

    #[test]
    fn what_no_key_can_send_is_an_error_at_its_place() {
        for (key, command, message) in [
            ("ll", "split", "one letter or digit"),
            ("", "split", "one letter or digit"),
            ("ä", "split", "a letter or digit"),
            ("q", "split", "it ends the session"),
            ("l", "robot lost", "there is no `robot`"),
        ] {
            let error = read(key, command).unwrap_err();
            assert!(error.message.contains(message), "{}", error.message);
            assert_eq!(error.path, format!("keys.{key}"));
        }
    }
}
