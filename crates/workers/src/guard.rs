//! Kills a program when teampulse itself is killed.

use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};

/// Kills the process group `$1` a second after its input is closed, which happens when teampulse is killed. A
/// program that reads its input has exited by then.
const SCRIPT: &str = r#"read -r _; sleep 1; kill -s KILL -- "-$1""#;

/// A shell that outlives teampulse and then kills a program with all processes that it has started.
pub(crate) struct Guard(Child);

impl Guard {
    /// Starts to guard the process group of a program; `None` if no shell can be started.
    pub(crate) fn of(program: &Child) -> Option<Guard> {
        let mut shell = Command::new("sh");
        shell.args(["-c", SCRIPT, "guard"]).arg(program.id().to_string());
        shell.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
        shell.process_group(0).spawn().ok().map(Guard)
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        // This fails if the shell has exited.
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::process::ExitStatusExt;

    use super::*;

    #[test]
    fn a_program_does_not_outlive_a_killed_teampulse() {
        let mut program = Command::new("sleep").arg("600").process_group(0).spawn().unwrap();
        let mut guard = Guard::of(&program).unwrap();
        // As the kernel closes it when teampulse is killed.
        drop(guard.0.stdin.take());
        assert_eq!(program.wait().unwrap().signal(), Some(9));
    }
}
