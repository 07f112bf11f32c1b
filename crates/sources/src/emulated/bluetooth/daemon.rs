use std::io::ErrorKind;
use std::process::Stdio;

use tempfile::TempDir;
use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::process::{Child, Command};

use super::EmulatedBluetoothError;

/// A `dbus-daemon` of our own, on which everybody of this machine's user may do everything. It ends when this is
/// dropped.
#[derive(Debug)]
pub(super) struct Daemon {
    /// As D-Bus writes addresses.
    pub address: String,
    _process: Child,
    _folder: TempDir,
}

impl Daemon {
    pub async fn start() -> Result<Self, EmulatedBluetoothError> {
        let failed =
            |error: &dyn std::fmt::Display| EmulatedBluetoothError::Daemon(error.to_string());
        let folder = tempfile::Builder::new().prefix("teampulse-dbus-").tempdir();
        let folder = folder.map_err(|error| failed(&error))?;
        let settings = folder.path().join("bus.conf");
        let socket = folder.path().join("socket");
        let text = CONFIGURATION.replace("SOCKET", &socket.to_string_lossy());
        std::fs::write(&settings, text).map_err(|error| failed(&error))?;
        let process = Command::new("dbus-daemon")
            .args(["--nofork", "--nopidfile", "--print-address=1", "--config-file"])
            .arg(&settings)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .kill_on_drop(true)
            .spawn();
        let mut process = process.map_err(|error| match error.kind() {
            ErrorKind::NotFound => EmulatedBluetoothError::NoDaemon,
            _ => failed(&error),
        })?;
        let output = process.stdout.take().ok_or_else(|| failed(&"it has no output"))?;
        let line = BufReader::new(output).lines().next_line().await;
        let line = line.map_err(|error| failed(&error))?;
        let address = line.ok_or_else(|| failed(&"dbus-daemon ended at once"))?;
        Ok(Self { address, _process: process, _folder: folder })
    }
}

const CONFIGURATION: &str = r#"<!DOCTYPE busconfig PUBLIC "-//freedesktop//DTD D-Bus Bus Configuration 1.0//EN"
 "http://www.freedesktop.org/standards/dbus/1.0/busconfig.dtd">
<busconfig>
  <listen>unix:path=SOCKET</listen>
  <auth>EXTERNAL</auth>
  <policy context="default">
    <allow own="*"/>
    <allow send_destination="*" eavesdrop="true"/>
    <allow eavesdrop="true"/>
  </policy>
</busconfig>
"#;
