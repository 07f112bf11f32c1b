//! The wearables of the demo's operator: emulated devices, read by the same drivers as real ones.

use std::io;
use std::path::PathBuf;

use teampulse_sources::emulated::bluetooth::is_installed;
use teampulse_sources::wearables::bluetooth::Bluetooth;
use tempfile::TempDir;

const H10: &str = "A0:9E:1A:00:00:01";
const MYO: &str = "A0:9E:1A:00:00:02";

/// The operator's devices, and the folder with the socket and the port that lead to them.
pub struct Worn {
    folder: TempDir,
    /// Whether Bluetooth devices can be emulated on this machine.
    has_bluetooth: bool,
}

impl Worn {
    /// The devices that can be emulated on this machine.
    pub async fn choose() -> io::Result<Worn> {
        let folder = tempfile::Builder::new().prefix("teampulse-demo-").tempdir()?;
        Ok(Worn { folder, has_bluetooth: is_installed().await })
    }

    /// Returns the folder through which the devices are reached.
    pub fn folder(&self) -> PathBuf {
        self.folder.path().to_owned()
    }

    /// Returns the number of sockets and ports that lead to the devices.
    pub const fn places(&self) -> usize {
        1 + self.has_bluetooth as usize
    }

    /// Returns the connection to the Bluetooth devices.
    pub fn bluetooth(&self) -> Bluetooth {
        Bluetooth::at(format!("unix:path={}", self.folder.path().join("bus").display()))
    }

    /// Returns the lines of a study that emulate the devices and read them.
    pub fn study(&self) -> String {
        let radios = [("polar", "polar_h10", H10), ("myo", "myo", MYO)];
        let radios = radios.into_iter().filter(|_| self.has_bluetooth);
        let radios = radios.map(|(source, emulated, address)| of_radio(source, emulated, address));
        self.of_port() + &radios.collect::<String>()
    }

    fn of_port(&self) -> String {
        let port = toml::Value::from(self.folder.path().join("shimmer3").display().to_string());
        format!(
            r#"
[[sources]]
type    = "shimmer3"
person  = "p001"
port    = {port}
sensors = ["eda"]

[[simulate.wearables]]
type   = "shimmer3"
person = "p001"
port   = {port}
"#
        )
    }

    /// Describes to the user what the operator wears.
    pub const fn words(&self) -> &'static str {
        if self.has_bluetooth {
            "the operator wears an emulated Polar H10 and Myo (Bluetooth) and Shimmer3 (serial \
             port), read like real ones;"
        } else {
            "the operator wears an emulated Shimmer3 (serial port), read like a real one; a Polar H10 and a Myo \
             (Bluetooth) need dbus-daemon, which is not installed (apt install dbus-daemon), so ECG and EMG come \
             over ROS;"
        }
    }
}

fn of_radio(source: &str, emulated: &str, address: &str) -> String {
    format!(
        r#"
[[sources]]
type    = "{source}"
person  = "p001"
address = "{address}"

[[simulate.wearables]]
type    = "{emulated}"
person  = "p001"
address = "{address}"
"#
    )
}

#[cfg(test)]
mod tests {
    use teampulse_sources::emulated::EmulatedWearable;
    use teampulse_sources::simulated::SimulatedTeam;

    use super::*;

    #[test]
    fn what_is_emulated_is_read() {
        for (has_bluetooth, kinds) in
            [(true, vec!["shimmer3", "polar", "myo"]), (false, vec!["shimmer3"])]
        {
            let folder = tempfile::tempdir().expect("a folder");
            let worn = Worn { folder, has_bluetooth };
            let study: toml::Table = toml::from_str(&worn.study()).expect("lines of a study");
            let sources = study["sources"].as_array().expect("sources");
            let found: Vec<_> = sources.iter().filter_map(|one| one["type"].as_str()).collect();
            assert_eq!(found, kinds);
            let team: SimulatedTeam = study["simulate"].clone().try_into().expect("a simulation");
            assert_eq!(team.wearables.len(), kinds.len());
            assert_eq!(team.wearables.iter().any(EmulatedWearable::is_bluetooth), has_bluetooth);
        }
    }
}
