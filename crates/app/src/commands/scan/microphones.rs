//! This computer's microphones.

use serde::Serialize;
use teampulse_sources::microphone::FoundMicrophone;

use crate::output;

/// A microphone of this computer.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub struct Microphone {
    device: String,
    name: String,
}

impl Microphone {
    /// Returns all microphones of this computer.
    pub async fn all() -> Vec<Microphone> {
        FoundMicrophone::all().await.into_iter().map(Microphone::of).collect()
    }

    fn of(found: FoundMicrophone) -> Microphone {
        Microphone { device: found.name, name: found.description }
    }

    fn line(&self) -> String {
        format!("  {:<38} {}", self.name, self.device)
    }

    /// Returns the lines of a study that read it.
    fn source(&self) -> String {
        let device = toml::Value::from(self.device.as_str());
        format!("[[sources]]\ntype   = \"microphone\"\nperson = \"p001\"\ndevice = {device}\n")
    }
}

/// Prints microphones, with the lines of a study that read them.
pub fn show(microphones: &[Microphone]) {
    if microphones.is_empty() {
        return;
    }
    output::line(format!("microphones: {}", microphones.len()));
    output::lines(microphones.iter().map(Microphone::line));
    output::line(
        "\nlines for a study, each with the person who speaks into it; how they speak is recorded, not what they say:",
    );
    output::lines(microphones.iter().map(Microphone::source));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_microphone_has_lines_of_a_study() {
        let microphone = Microphone::of(FoundMicrophone {
            name: "alsa_input.usb-Headset-00.mono-fallback".into(),
            description: "Headset Mono".into(),
            is_monitor: false,
            is_default: true,
        });
        let study: toml::Table = toml::from_str(&microphone.source()).expect("lines of a study");
        let source = &study["sources"][0];
        assert_eq!(source["type"].as_str(), Some("microphone"));
        assert_eq!(source["device"].as_str(), Some("alsa_input.usb-Headset-00.mono-fallback"));
    }
}
