//! The folder of a recording, which no other recording shares.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use teampulse_bag::private;
use teampulse_core::clock;
use teampulse_sinks::tables_beside;

use crate::failure::Failure;

/// A folder that was created for one recording, so that another recording that starts in the same second gets a
/// different one. It is removed again if it stays empty.
#[derive(Debug)]
pub struct Claimed(PathBuf);

impl Claimed {
    /// Creates the folder of a session's bag: `OUT/<name>_<UTC>`, with a number appended if that name is taken.
    pub fn new(out: &Path, session: &str) -> Result<Claimed, Failure> {
        if out.join("metadata.yaml").exists() {
            let message = format!(
                "{} is a recording: no other recording is created inside it",
                out.display()
            );
            return Err(Failure::new(message).hint("choose another folder with --out"));
        }
        private::create_folders(out).map_err(unmade(out))?;
        for folder in names(out, session) {
            match private::create_folder(&folder) {
                Ok(()) => return Ok(Claimed(folder)),
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => return Err(unmade(&folder)(error)),
            }
        }
        unreachable!("there are more numbers than folders")
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Claimed {
    fn drop(&mut self) {
        // Fails, as intended, if the folder is not empty.
        drop(fs::remove_dir(&self.0));
    }
}

fn unmade(folder: &Path) -> impl FnOnce(std::io::Error) -> Failure {
    move |error| {
        let hint =
            "check the free disk space and the permissions, or choose another folder with --out";
        Failure::to(format!("create {}: {error}", folder.display())).hint(hint)
    }
}

/// Returns the name that the folder of a session's bag would get now; creates nothing.
pub fn bag_folder(out: &Path, session: &str) -> PathBuf {
    let mut free = names(out, session).filter(|folder| folder.symlink_metadata().is_err());
    free.next().expect("there are more numbers than folders")
}

/// Candidate names for the folder of a session's bag, in the order in which they are tried.
fn names(out: &Path, session: &str) -> impl Iterator<Item = PathBuf> {
    let now = clock::wall().to_string();
    let utc: String = now[..19].chars().filter(char::is_ascii_alphanumeric).collect();
    let first = out.join(format!("{session}_{utc}Z"));
    let numbered = (2..).map({
        let out = out.to_owned();
        let name = format!("{session}_{utc}Z");
        move |number| out.join(format!("{name}_{number}"))
    });
    // Exported tables of another bag would be overwritten.
    let is_free = |folder: &PathBuf| tables_beside(folder).symlink_metadata().is_err();
    std::iter::once(first).chain(numbered).filter(is_free)
}

/// Whether a folder has any entries.
pub fn holds_something(folder: &Path) -> bool {
    fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn no_recording_is_created_inside_another() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("metadata.yaml"), "").unwrap();
        let (message, _) = Claimed::new(folder.path(), "session").unwrap_err().words();
        assert!(
            message.ends_with("is a recording: no other recording is created inside it"),
            "{message}"
        );
    }

    #[test]
    fn simultaneous_sessions_have_separate_folders() {
        let out = tempfile::tempdir().unwrap();
        let sessions: Vec<Claimed> = std::thread::scope(|scope| {
            let claim = || Claimed::new(out.path(), "pilot").unwrap();
            let all: Vec<_> = (0..8).map(|_| scope.spawn(claim)).collect();
            all.into_iter().map(|each| each.join().unwrap()).collect()
        });
        let folders: BTreeSet<&Path> = sessions.iter().map(Claimed::path).collect();
        assert_eq!(folders.len(), 8);
        assert!(folders.iter().all(|folder| folder.is_dir()));
    }

    #[test]
    fn an_empty_folder_is_removed() {
        let out = tempfile::tempdir().unwrap();
        let (empty, full) = (Claimed::new(out.path(), "a"), Claimed::new(out.path(), "b"));
        let (empty, full) = (empty.unwrap(), full.unwrap());
        let (gone, stays) = (empty.path().to_owned(), full.path().to_owned());
        fs::write(stays.join("b_0.mcap"), "something").unwrap();
        drop((empty, full));
        assert!(!gone.exists() && holds_something(&stays));
    }

    #[test]
    fn a_folder_that_cannot_be_created_is_reported_with_a_hint() {
        let (message, hint) = Claimed::new(Path::new("/proc/nowhere"), "a").unwrap_err().words();
        assert!(message.starts_with("failed to create /proc/nowhere"), "{message}");
        assert!(!hint.is_empty());
    }
}
