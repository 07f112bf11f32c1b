use std::time::Duration;

use pulseaudio::protocol::SourceInfo;
use teampulse_core::source::SourceError;
use tokio::time::timeout;

use super::server::Server;

/// How long a server may take to list its microphones.
const PATIENCE: Duration = Duration::from_secs(3);

/// A microphone connected to this computer, as its sound server describes it; no sound is read from it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundMicrophone {
    /// The server's name for it, such as `alsa_input.usb-Example-00.mono-fallback`.
    pub name: String,
    /// The name for display.
    pub description: String,
    /// Whether this is the monitor of a loudspeaker's output.
    pub is_monitor: bool,
    /// Whether this is the desktop's default microphone.
    pub is_default: bool,
}

impl FoundMicrophone {
    /// Returns this computer's microphones, without monitors of loudspeakers; none if no sound server is running.
    pub async fn all() -> Vec<FoundMicrophone> {
        let asked = async { Server::connect().await.ok()?.microphones().await.ok() };
        let found = timeout(PATIENCE, asked).await.ok().flatten().unwrap_or_default();
        found.into_iter().filter(|found| !found.is_monitor).collect()
    }

    pub(super) fn of(info: &SourceInfo, default: &str) -> FoundMicrophone {
        let name = info.name.to_string_lossy().into_owned();
        let description = info.description.as_ref().map(|text| text.to_string_lossy().into_owned());
        FoundMicrophone {
            is_default: name == default,
            description: description.unwrap_or_else(|| name.clone()),
            is_monitor: info.monitor_of_sink_index.is_some(),
            name,
        }
    }

    /// Returns the index of the microphone with this text in its name or description; without a text, of the desktop's
    /// default microphone. A monitor of a loudspeaker is chosen only by its full name.
    pub(super) fn chosen(all: &[FoundMicrophone], text: &str) -> Result<usize, SourceError> {
        let is_in = |name: &str| name.to_lowercase().contains(&text.to_lowercase());
        let is_meant = |found: &FoundMicrophone| match text {
            "" => found.is_default && !found.is_monitor,
            _ => {
                found.name == text
                    || (!found.is_monitor && (is_in(&found.name) || is_in(&found.description)))
            }
        };
        let meant: Vec<usize> = (0..all.len()).filter(|place| is_meant(&all[*place])).collect();
        let listed = |places: &mut dyn Iterator<Item = usize>| {
            let names: Vec<&str> = places.map(|place| all[place].description.as_str()).collect();
            names.join(", ")
        };
        let mut microphones = (0..all.len()).filter(|place| !all[*place].is_monitor).peekable();
        match meant.as_slice() {
            [one] => Ok(*one),
            [] if microphones.peek().is_none() => Err(SourceError::Gone {
                message: "find a microphone: this computer has none".to_owned(),
                hint: "plug it in; `pactl list short sources` lists what the sound server knows"
                    .to_owned(),
            }),
            [] => Err(SourceError::Gone {
                message: format!("find the microphone `{text}` among {}", listed(&mut microphones)),
                hint: "plug it in, or set `device` to a part of one of these".to_owned(),
            }),
            several => Err(SourceError::Fatal {
                message: format!("choose among {}", listed(&mut several.iter().copied())),
                hint: "set `device` to a longer part of one of these names".to_owned(),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(name: &str) -> FoundMicrophone {
        FoundMicrophone {
            name: name.to_owned(),
            description: format!("the {name}"),
            is_monitor: name.ends_with(".monitor"),
            is_default: name == "headset",
        }
    }

    fn chosen(all: &[FoundMicrophone], text: &str) -> Result<usize, String> {
        FoundMicrophone::chosen(all, text).map_err(|error| match error {
            SourceError::Gone { message, .. } => message,
            SourceError::Fatal { message, .. } => format!("fatal: {message}"),
        })
    }

    #[test]
    fn one_is_chosen_by_a_part_of_its_name() {
        let all = [found("speaker.monitor"), found("headset"), found("webcam")];
        assert_eq!(chosen(&all, ""), Ok(1));
        assert_eq!(chosen(&all, "WEB"), Ok(2));
        assert_eq!(chosen(&all, "speaker.monitor"), Ok(0));
        assert_eq!(
            chosen(&all, "speaker").unwrap_err(),
            "find the microphone `speaker` among the headset, the webcam"
        );
        assert_eq!(chosen(&all, "e").unwrap_err(), "fatal: choose among the headset, the webcam");
        assert_eq!(chosen(&all[..1], "").unwrap_err(), "find a microphone: this computer has none");
    }
}
