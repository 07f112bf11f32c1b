//! Commands from the keyboard of the terminal.

use std::io::Read;

use async_trait::async_trait;
use rustix::termios::{self, LocalModes, OptionalActions, SpecialCodeIndex, Termios};
use teampulse_core::command::{Command, Sender};
use teampulse_core::outlet::Outlet;
use teampulse_core::source::{Source, SourceError};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::mpsc;

use super::keyboard::{Decoder, Key};

/// The keyboard of the terminal, whose keys may send commands.
pub struct Keys {
    commands: mpsc::Receiver<Command>,
    /// The terminal's mode while keys are read.
    raw: Termios,
    /// Restores the terminal when dropped.
    _restore: Restore,
}

impl Keys {
    /// Starts to read the keyboard; `None` if standard input is not a terminal, or belongs to another job. `pressed`
    /// returns the command of each key.
    pub fn open(pressed: impl FnMut(Key) -> Option<Command> + Send + 'static) -> Option<Keys> {
        let stdin = std::io::stdin();
        let was = termios::tcgetattr(&stdin).ok()?;
        if !is_ours() {
            return None;
        }
        let mut raw = was.clone();
        raw.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
        // Ctrl-Z, next to Ctrl-X on the keyboard, would suspend a recording.
        raw.special_codes[SpecialCodeIndex::VSUSP] = 0;
        termios::tcsetattr(&stdin, OptionalActions::Now, &raw).ok()?;
        let (sender, commands) = mpsc::channel(16);
        std::thread::spawn(move || read(std::io::stdin().lock(), &sender, pressed));
        Some(Keys { commands, raw, _restore: Restore(was) })
    }
}

/// Whether the terminal belongs to this job: a background job that changes its modes would be stopped.
fn is_ours() -> bool {
    let foreground = termios::tcgetpgrp(std::io::stdin());
    foreground.is_ok_and(|group| group == rustix::process::getpgrp())
}

/// Returns the default marker of a key: a letter or digit sets a marker named after it, the space bar one named `mark`.
pub fn marker(key: Key) -> Option<Command> {
    match key {
        Key::Char(' ') => Some(Command::Mark("mark".to_owned())),
        Key::Char(key) if key.is_ascii_alphanumeric() => Some(Command::Mark(key.to_string())),
        _ => None,
    }
}

/// Reads keys until cancelled; if it is blocked in a read, it ends with the process.
fn read(
    mut from: impl Read,
    sender: &mpsc::Sender<Command>,
    mut pressed: impl FnMut(Key) -> Option<Command>,
) {
    let (mut decoder, mut bytes) = (Decoder::default(), [0; 256]);
    loop {
        let count = match from.read(&mut bytes) {
            Ok(0) => return,
            Ok(count) => count,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(_) => return,
        };
        let mut keys: Vec<Key> = Vec::new();
        keys.extend(bytes[..count].iter().filter_map(|byte| decoder.take(*byte)));
        keys.extend(decoder.pause());
        for command in keys.into_iter().filter_map(&mut pressed) {
            if sender.blocking_send(command).is_err() {
                return;
            }
        }
    }
}

#[async_trait]
impl Source for Keys {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let mut continued =
            signal(SignalKind::from_raw(rustix::process::Signal::CONT.as_raw())).ok();
        loop {
            tokio::select! {
                // A shell resets the terminal while this process is suspended.
                () = heard(&mut continued) => {
                    if is_ours() {
                        termios::tcsetattr(std::io::stdin(), OptionalActions::Now, &self.raw).ok();
                    }
                }
                command = self.commands.recv() => match command {
                    // A refusal is recorded as an event.
                    Some(command) => drop(outlet.command(&Sender::keys(), command)),
                    None => outlet.closed().await,
                },
                () = outlet.closed() => return Ok(()),
            }
        }
    }
}

/// Resolves when a signal arrives.
async fn heard(signal: &mut Option<Signal>) {
    match signal {
        Some(signal) => drop(signal.recv().await),
        None => std::future::pending().await,
    }
}

/// Makes the space bar call `pause` and `q` call `quit`, until the returned value is dropped; `None` if standard input
/// is not a terminal.
pub fn pause_by_key(
    mut pause: impl FnMut() + Send + 'static,
    quit: impl Fn() + Send + 'static,
) -> Option<PauseKeys> {
    let pressed = move |key| {
        match key {
            Key::Char(' ') => pause(),
            Key::Char('q') => quit(),
            _ => {}
        }
        None
    };
    Keys::open(pressed).map(PauseKeys)
}

/// The keys of a playback. Restores the terminal when dropped.
pub struct PauseKeys(#[expect(dead_code, reason = "held for its end")] Keys);

struct Restore(Termios);

impl Drop for Restore {
    fn drop(&mut self) {
        if !is_ours() {
            return;
        }
        let restored = termios::tcsetattr(std::io::stdin(), OptionalActions::Now, &self.0);
        if let Err(error) = restored {
            tracing::warn!("failed to restore the terminal: {error}; type `reset`");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_letters_digits_and_the_space_bar_set_markers() {
        let (sender, mut markers) = mpsc::channel(100);
        let typed: &[u8] = b"a\x1b[A\x1b[6~9 \t\r-\x1bOB\x0eZ\xc3\xa9";
        read(typed, &sender, marker);
        drop(sender);
        let set: Vec<Command> = std::iter::from_fn(|| markers.blocking_recv()).collect();
        assert_eq!(set, ["a", "9", "mark", "Z"].map(|label| Command::Mark(label.to_owned())));
    }
}
