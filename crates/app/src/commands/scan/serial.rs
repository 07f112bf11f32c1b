//! The serial ports with a device attached, and the device as far as the kernel identifies it.

use serde::Serialize;
use teampulse_sources::serial::FoundPort;

use crate::output;

/// A serial port with a device attached.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub struct Port {
    #[serde(rename = "port")]
    path: String,
    device: String,
    /// The type of the source that reads it, if one is known.
    #[serde(rename = "type")]
    kind: Option<&'static str>,
    /// The command that gives this user permission to open it, if that is missing.
    permit: Option<String>,
}

impl Port {
    /// Returns all serial ports of this computer.
    pub fn all() -> Vec<Port> {
        FoundPort::all().iter().map(Port::of).collect()
    }

    fn of(found: &FoundPort) -> Port {
        let permit = found.lacks_group.as_ref();
        Port {
            path: found.path.display().to_string(),
            device: found.device.clone(),
            kind: is_shimmer(found).then_some("shimmer3"),
            permit: permit.map(|group| format!("sudo usermod -aG {group} $USER")),
        }
    }

    fn line(&self) -> String {
        let Port { path, device, kind, .. } = self;
        let line = format!("  {path:<38} {device:<38} {}", kind.unwrap_or("not a known wearable"));
        let permit = self
            .permit
            .as_ref()
            .map(|command| format!("\n    no permission: `{command}`, then log out and in again"));
        line + permit.as_deref().unwrap_or_default()
    }

    fn source(&self, person: usize) -> Option<String> {
        let (kind, port) = (self.kind?, toml::Value::from(self.path.as_str()));
        Some(format!(
            "[[sources]]\ntype    = \"{kind}\"\nperson  = \"p{person:03}\"\nport    = {port}\n"
        ))
    }
}

/// Whether a port leads to a Shimmer: it was bound by `rfcomm`, which no other supported wearable needs, or the device
/// gives its name over USB.
fn is_shimmer(found: &FoundPort) -> bool {
    let is_named = |text: &str| text.to_ascii_lowercase().contains("shimmer");
    found.bluetooth.is_some() || is_named(&found.device) || is_named(&found.path.to_string_lossy())
}

/// Prints ports, with the lines of a study that read them; people are numbered from `person`.
pub fn show(ports: &[Port], person: usize) {
    if ports.is_empty() {
        return;
    }
    output::line(format!("serial ports: {}", ports.len()));
    output::lines(ports.iter().map(Port::line));
    let known = ports.iter().filter(|port| port.kind.is_some());
    let lines: Vec<String> =
        known.zip(person..).filter_map(|(port, person)| port.source(person)).collect();
    if !lines.is_empty() {
        output::line("\nlines for a study, each with the person who wears it:");
    }
    output::lines(lines);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn port(path: &str, bluetooth: Option<&str>, lacks_group: Option<&str>) -> Port {
        Port::of(&FoundPort {
            path: path.into(),
            device: bluetooth.unwrap_or("FTDI FT232R USB UART").to_owned(),
            usb: None,
            bluetooth: bluetooth.map(str::to_owned),
            lacks_group: lacks_group.map(str::to_owned),
        })
    }

    #[test]
    fn a_port_of_a_bluetooth_device_has_lines_of_a_study() {
        let port = port("/dev/rfcomm0", Some("00:06:66:A0:00:01"), None);
        assert!(port.line().ends_with("shimmer3"), "{}", port.line());
        let study: toml::Table =
            toml::from_str(&port.source(2).expect("is known")).expect("lines of a study");
        let source = &study["sources"][0];
        assert_eq!(source["type"].as_str(), Some("shimmer3"));
        assert_eq!(source["person"].as_str(), Some("p002"));
        assert_eq!(source["port"].as_str(), Some("/dev/rfcomm0"));
    }

    #[test]
    fn a_port_without_permission_says_which_command_gives_it() {
        let port = port("/dev/ttyUSB0", None, Some("dialout"));
        assert_eq!(port.source(1), None);
        let line = port.line();
        assert!(line.contains("not a known wearable"), "{line}");
        assert!(line.contains("`sudo usermod -aG dialout $USER`, then log out and in"), "{line}");
    }
}
