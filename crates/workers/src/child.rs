//! The process of a program: its input, its output lines, and its exit.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process_group};
use teampulse_core::clock::Stopwatch;
use teampulse_core::text::{LONGEST_LABEL, label};
use teampulse_core::worker::WorkerError;

use crate::guard::Guard;

/// The longest line that a program may write [bytes].
pub(crate) const LONGEST_LINE: u64 = 16 << 20;
/// The number of last lines of the program's standard error that are kept.
const LAST_WORDS: usize = 3;
/// How long the program may take to exit once its input is closed.
const FAREWELL: Duration = Duration::from_secs(1);
/// The interval at which the program's exit is checked for.
const LOOK: Duration = Duration::from_millis(5);

/// A running program. Dropping it kills it together with all processes that it has started.
pub(crate) struct Child {
    process: std::process::Child,
    /// The queue of the program's input; `None` once the input is closed.
    input: Option<SyncSender<Vec<u8>>>,
    lines: Receiver<Written>,
    last_words: LastWords,
    /// The thread that reads the program's standard error.
    listener: JoinHandle<()>,
    guard: Option<Guard>,
}

/// A piece of a program's output.
enum Written {
    Whole(String),
    /// A piece of a line that is longer than [`LONGEST_LINE`].
    TooLong,
}

/// The result of waiting for a line.
pub(crate) enum Answer {
    /// A line.
    Read(String),
    /// No line yet.
    None,
    /// A line that is longer than [`LONGEST_LINE`].
    TooLong,
    /// The program has exited.
    Ended(Ended),
}

/// How a program exited.
pub(crate) struct Ended {
    /// The exit status, in words.
    pub(crate) status: String,
    /// The last lines of the program's standard error; may be empty.
    pub(crate) last_words: String,
}

type LastWords = Arc<Mutex<VecDeque<String>>>;

/// Whether a program can be started: a path to an executable file, or a name in one of the folders of
/// `PATH`.
pub(crate) fn is_installed(program: &str) -> bool {
    let is_executable = |path: &Path| {
        path.metadata().is_ok_and(|file| file.is_file() && file.permissions().mode() & 0o111 != 0)
    };
    if program.contains('/') {
        return is_executable(Path::new(program));
    }
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| is_executable(&folder.join(program)))
}

impl Child {
    /// Starts a program in its own process group, which Ctrl-C does not reach; it should exit when its input is closed.
    /// `variables` are added to its environment.
    pub(crate) fn start(
        command: &[String],
        variables: &[(&str, &str)],
    ) -> Result<Child, WorkerError> {
        let failed = |why: String| WorkerError {
            message: format!("start `{}`: {why}", command.join(" ")),
            hint: "run the command by hand".into(),
        };
        let (program, arguments) =
            command.split_first().ok_or_else(|| failed("no command".into()))?;
        let mut process = Command::new(program)
            .args(arguments)
            .envs(variables.iter().copied())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .process_group(0)
            .spawn()
            .map_err(|error| failed(error.to_string()))?;
        let pipes = (process.stdin.take(), process.stdout.take(), process.stderr.take());
        let (Some(stdin), Some(stdout), Some(stderr)) = pipes else {
            return Err(failed("its pipes are missing".into()));
        };
        let guard = Guard::of(&process);
        let (input, waiting) = sync_channel(1);
        let (read, lines) = sync_channel(1);
        let last_words = LastWords::default();
        let words = Arc::clone(&last_words);
        // These threads end with the process, when its pipes are closed.
        thread::spawn(move || write_all(stdin, &waiting));
        thread::spawn(move || {
            each_line(stdout, |line| {
                let may_follow = matches!(line, Written::Whole(_));
                read.send(line).is_ok() && may_follow
            });
        });
        let listener = thread::spawn(move || each_line(stderr, |line| keep(&words, line)));
        Ok(Child { process, input: Some(input), lines, last_words, listener, guard })
    }

    /// Queues the program's next input, without waiting until it is read.
    pub(crate) fn write(&self, bytes: Vec<u8>) {
        // If this fails, the program has exited, which the next answer reports.
        if let Some(input) = &self.input {
            drop(input.try_send(bytes));
        }
    }

    /// Waits for the program's next line, for at most `patience`.
    pub(crate) fn read(&mut self, patience: Duration) -> Answer {
        match self.lines.recv_timeout(patience) {
            Ok(Written::Whole(line)) => Answer::Read(line),
            Ok(Written::TooLong) => Answer::TooLong,
            Err(RecvTimeoutError::Timeout) => Answer::None,
            Err(RecvTimeoutError::Disconnected) => Answer::Ended(self.ended()),
        }
    }

    /// Fails if the program has exited although its input is open.
    pub(crate) fn check(&mut self) -> Result<(), Ended> {
        match self.process.try_wait() {
            Ok(None) => Ok(()),
            _ => Err(self.ended()),
        }
    }

    /// Closes the program's input, and gives it a moment to exit by itself.
    pub(crate) fn end(&mut self) {
        self.input = None;
        let began = Stopwatch::start();
        while began.elapsed() < FAREWELL && matches!(self.process.try_wait(), Ok(None)) {
            thread::sleep(LOOK);
        }
    }

    /// Reports how the program exited; a program that has closed its output but still runs is killed.
    fn ended(&mut self) -> Ended {
        self.end();
        self.kill();
        let status = self.process.wait();
        let status = status.map_or_else(|error| error.to_string(), shown);
        self.listen();
        let words = self.last_words.lock().unwrap_or_else(PoisonError::into_inner);
        let words: Vec<_> = words.iter().map(String::as_str).collect();
        Ended { status, last_words: words.join(" · ") }
    }

    /// Waits until standard error has been read, for a limited time, as a process that left the group may hold it open.
    fn listen(&self) {
        let began = Stopwatch::start();
        while began.elapsed() < FAREWELL && !self.listener.is_finished() {
            thread::sleep(LOOK);
        }
    }

    fn kill(&self) {
        if let Some(group) = Pid::from_raw(self.process.id().cast_signed()) {
            // This fails if all processes of the group have exited.
            let _ended = kill_process_group(group, Signal::KILL);
        }
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        // The guard goes before the process is reaped, as the group id cannot have been reused until then.
        self.guard = None;
        self.kill();
        drop(self.process.wait());
    }
}

fn shown(status: ExitStatus) -> String {
    match status.code() {
        Some(code) => format!("code {code}"),
        None => status.to_string(),
    }
}

/// Writes all input until there is no more or the reader is gone.
fn write_all(mut to: impl Write, pieces: &Receiver<Vec<u8>>) {
    while let Ok(piece) = pieces.recv() {
        if to.write_all(&piece).and_then(|()| to.flush()).is_err() {
            return;
        }
    }
}

/// Passes on each line of a pipe, until the pipe closes or `take` returns `false`. For a line that is too long, it
/// passes on [`Written::TooLong`] for each full piece, and the remainder as a line of its own.
fn each_line(from: impl Read, mut take: impl FnMut(Written) -> bool) {
    let mut from = BufReader::new(from);
    loop {
        let mut line = Vec::new();
        match (&mut from).take(LONGEST_LINE).read_until(b'\n', &mut line) {
            Ok(1..) if (line.len() as u64) < LONGEST_LINE || line.ends_with(b"\n") => {}
            Ok(1..) => {
                if take(Written::TooLong) {
                    continue;
                }
                return;
            }
            _ => return,
        }
        if !take(Written::Whole(String::from_utf8_lossy(&line).trim_end().to_owned())) {
            return;
        }
    }
}

/// Keeps the last lines of standard error, and logs each line; of a line that is too long, only the remainder.
fn keep(last: &LastWords, line: Written) -> bool {
    let Written::Whole(line) = line else { return true };
    let line = label(line, LONGEST_LABEL);
    tracing::info!("{line}");
    let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
    if last.len() == LAST_WORDS {
        last.pop_front();
    }
    last.push_back(line);
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_endless_line_of_standard_error_is_dropped_and_read_on() {
        let endless = std::io::repeat(b'x').take(LONGEST_LINE + 5).chain(&b"\nno memory\n"[..]);
        let last = LastWords::default();
        each_line(endless, |line| keep(&last, line));
        let last = last.lock().expect("nobody panicked");
        assert_eq!(last.iter().map(String::as_str).collect::<Vec<_>>(), ["xxxxx", "no memory"]);
    }
}
