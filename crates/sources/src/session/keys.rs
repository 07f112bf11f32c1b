//! Markers set from the keyboard of the terminal.

use std::io::Read;

use async_trait::async_trait;
use rustix::termios::{self, LocalModes, OptionalActions, Termios};
use teampulse_core::data::EventKind;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::{Source, SourceError};
use tokio::sync::mpsc;

use super::happen;

/// Keys of the terminal: any letter or digit sets a marker of that name, the space bar one named
/// `mark`. `q` is left to whoever ends the session.
pub struct Keys {
    pressed: mpsc::Receiver<u8>,
    /// Puts the terminal back as it was.
    _restore: Restore,
}

impl Keys {
    /// Begins to read the keyboard, key by key; `None` when standard input is no terminal. `quit`
    /// is called when `q` is pressed.
    pub fn open(quit: impl Fn() + Send + 'static) -> Option<Keys> {
        let stdin = std::io::stdin();
        let was = termios::tcgetattr(&stdin).ok()?;
        let mut raw = was.clone();
        raw.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
        termios::tcsetattr(&stdin, OptionalActions::Now, &raw).ok()?;
        let (sender, pressed) = mpsc::channel(16);
        std::thread::spawn(move || read(&sender, quit));
        Some(Keys { pressed, _restore: Restore(was) })
    }
}

/// Reads keys until nobody wants them; blocked in a read, it ends with the process.
fn read(sender: &mpsc::Sender<u8>, quit: impl Fn()) {
    for key in std::io::stdin().lock().bytes().map_while(Result::ok) {
        if key == b'q' {
            quit();
        } else if sender.blocking_send(key).is_err() {
            return;
        }
    }
}

#[async_trait]
impl Source for Keys {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        loop {
            tokio::select! {
                key = self.pressed.recv() => match key {
                    Some(b' ') => happen(outlet, EventKind::Marker, "mark", 0.0),
                    Some(key) if key.is_ascii_alphanumeric() => {
                        happen(outlet, EventKind::Marker, &char::from(key).to_string(), 0.0);
                    }
                    Some(_) => {}
                    None => outlet.closed().await,
                },
                () = outlet.closed() => return Ok(()),
            }
        }
    }
}

/// Lets the space bar of the terminal call `pause`, and `q` call `quit`, as long as the keys are held;
/// `None` when standard input is no terminal.
pub fn pause_by_key(
    mut pause: impl FnMut() + Send + 'static,
    quit: impl Fn() + Send + 'static,
) -> Option<PauseKeys> {
    let mut keys = Keys::open(quit)?;
    let listening = tokio::spawn(async move {
        while let Some(key) = keys.pressed.recv().await {
            if key == b' ' {
                pause();
            }
        }
    });
    Some(PauseKeys(listening))
}

/// The keys of a playback; they end, and the terminal is as it was, when this is dropped.
#[derive(Debug)]
pub struct PauseKeys(tokio::task::JoinHandle<()>);

impl Drop for PauseKeys {
    fn drop(&mut self) {
        self.0.abort();
    }
}

struct Restore(Termios);

impl Drop for Restore {
    fn drop(&mut self) {
        let restored = termios::tcsetattr(std::io::stdin(), OptionalActions::Now, &self.0);
        if let Err(error) = restored {
            tracing::warn!("failed to restore the terminal: {error}; type `reset`");
        }
    }
}
