use std::ffi::OsStr;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use teampulse_core::clock::Stopwatch;
use tempfile::TempDir;
use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::process::{Child, Command};
use tokio::time::sleep;

use super::EmulatedBluetoothError;

/// Runs a daemon until standard input is closed, which happens however the process that holds it ends. A temporary
/// folder of the daemon is then removed, too.
const GUARD: &str = r#"command -v dbus-daemon >/dev/null || exit 127
exec 3>&1 >/dev/null
dbus-daemon --nofork --nopidfile --print-address=1 --config-file "$1" >&3 3>&- &
exec 3>&-
read -r _
kill $!
wait $!
rm -f "$1"
[ -z "$2" ] || rmdir "$2" 2>/dev/null"#;
/// How long a daemon that is shutting down may take to remove its socket.
const LEAVING: Duration = Duration::from_secs(2);
/// How often to check whether the socket is gone.
const LOOK: Duration = Duration::from_millis(10);
/// The shell's exit code for a missing program.
const NO_PROGRAM: i32 = 127;

/// A private `dbus-daemon` on which every process of this user may do everything. It ends when this is dropped, or with
/// this process.
#[derive(Debug)]
pub(super) struct Daemon {
    /// The address in D-Bus notation.
    pub address: String,
    // Keeps the standard input open.
    _guard: Child,
    _folder: Option<TempDir>,
}

impl Daemon {
    /// Starts a daemon in a temporary folder, which is removed with it.
    pub async fn start() -> Result<Self, EmulatedBluetoothError> {
        let folder = tempfile::Builder::new().prefix("teampulse-dbus-").tempdir();
        let folder = folder.map_err(|error| EmulatedBluetoothError::Daemon(error.to_string()))?;
        let daemon = Self::guarded(folder.path(), folder.path().as_os_str()).await?;
        Ok(Self { _folder: Some(folder), ..daemon })
    }

    /// Starts a daemon whose socket is `bus` in an existing folder, which is kept.
    pub async fn start_in(folder: &Path) -> Result<Self, EmulatedBluetoothError> {
        // Programs running in other folders use this address, too.
        let folder = std::path::absolute(folder)
            .map_err(|error| EmulatedBluetoothError::Daemon(error.to_string()))?;
        Self::guarded(&folder, OsStr::new("")).await
    }

    /// Starts a daemon whose guard removes the folder `removed`, if that is not empty.
    async fn guarded(folder: &Path, removed: &OsStr) -> Result<Self, EmulatedBluetoothError> {
        let failed =
            |error: &dyn std::fmt::Display| EmulatedBluetoothError::Daemon(error.to_string());
        let settings = folder.join("bus.conf");
        let socket = folder.join("bus");
        left(&socket).await.map_err(|error| failed(&error))?;
        let text = CONFIGURATION.replace("SOCKET", &socket.to_string_lossy());
        std::fs::write(&settings, text).map_err(|error| failed(&error))?;
        let guard = Command::new("sh")
            .args(["-c", GUARD, "dbus-daemon"])
            .arg(&settings)
            .arg(removed)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            // Ctrl-C in a terminal is meant for this process: the guard must outlive it.
            .process_group(0)
            .spawn();
        let mut guard = guard.map_err(|error| failed(&error))?;
        let output = guard.stdout.take().ok_or_else(|| failed(&"it has no output"))?;
        let line = BufReader::new(output).lines().next_line().await;
        let Some(address) = line.map_err(|error| failed(&error))? else {
            drop(guard.stdin.take());
            let status = guard.wait().await.map_err(|error| failed(&error))?;
            return Err(match status.code() {
                Some(NO_PROGRAM) => EmulatedBluetoothError::NoDaemon,
                _ => failed(&"dbus-daemon ended at once"),
            });
        };
        // Without the daemon's GUID, so that programs reconnect to the next daemon with this socket.
        let address = address.split_once(",guid=").map_or(&*address, |(path, _)| path).to_owned();
        Ok(Self { address, _guard: guard, _folder: None })
    }
}

/// Waits until an earlier daemon has removed its socket; a socket that remains belongs to a dead daemon and is removed.
async fn left(socket: &Path) -> std::io::Result<()> {
    let since = Stopwatch::start();
    while socket.exists() && since.elapsed() < LEAVING {
        sleep(LOOK).await;
    }
    if socket.exists() { std::fs::remove_file(socket) } else { Ok(()) }
}

/// Whether `dbus-daemon` is installed on this machine.
pub async fn is_installed() -> bool {
    let asked = Command::new("dbus-daemon")
        .arg("--version")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    asked.await.is_ok_and(|status| status.success())
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
