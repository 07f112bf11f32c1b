//! A text file that grows line by line.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

use teampulse_bag::private;

pub(super) use crate::text::on_one_line;

/// A text file that grows line by line.
#[derive(Debug)]
pub(super) struct TextFile {
    path: PathBuf,
    file: BufWriter<File>,
}

/// Writes a whole file, replacing an existing one; an incomplete file is removed.
pub(super) fn write(path: &Path, text: impl AsRef<[u8]>) -> Result<(), Unwritten> {
    whole(path, || private::write(path, text).map_err(Unwritten::at(path)))
}

/// Writes a file, and removes it if it is incomplete, as half a table looks like a complete one.
pub(super) fn whole<T>(
    path: &Path,
    write: impl FnOnce() -> Result<T, Unwritten>,
) -> Result<T, Unwritten> {
    write().inspect_err(|_| drop(fs::remove_file(path)))
}

/// A file could not be written. The message fits after "failed to".
#[derive(Debug, Error)]
#[error("write {}: {error}", path.display())]
pub(super) struct Unwritten {
    path: PathBuf,
    #[source]
    error: io::Error,
}

impl Unwritten {
    pub(super) fn at(path: &Path) -> impl FnOnce(io::Error) -> Unwritten {
        move |error| Unwritten { path: path.to_owned(), error }
    }
}

impl TextFile {
    /// Creates a file, replacing an existing one.
    pub(super) fn create(path: PathBuf) -> Result<TextFile, Unwritten> {
        let file = private::create(&path).map_err(Unwritten::at(&path))?;
        Ok(TextFile { path, file: BufWriter::new(file) })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Renames the file, which remains open.
    pub(super) fn rename(&mut self, path: PathBuf) -> Result<(), Unwritten> {
        fs::rename(&self.path, &path).map_err(Unwritten::at(&path))?;
        self.path = path;
        Ok(())
    }

    pub(super) fn push(&mut self, line: impl Display) -> Result<(), Unwritten> {
        writeln!(self.file, "{line}").map_err(Unwritten::at(&self.path))
    }

    /// Replaces or removes lines of a flushed file by number, and sorts all lines by a number in each.
    pub(super) fn revise(
        self,
        others: &BTreeMap<usize, Option<String>>,
        key: impl Fn(&str) -> f64,
    ) -> Result<(), Unwritten> {
        let text = fs::read_to_string(&self.path).map_err(Unwritten::at(&self.path))?;
        let lines = text.lines().enumerate();
        let other = |(number, line)| others.get(&number).map_or(Some(line), Option::as_deref);
        let mut lines: Vec<&str> = lines.filter_map(other).collect();
        lines.sort_by(|a, b| key(a).total_cmp(&key(b)));
        let mut file = TextFile::create(self.path)?;
        lines.iter().try_for_each(|line| file.push(line))?;
        file.flush()
    }

    /// Flushes the buffer to the system.
    pub(super) fn flush(&mut self) -> Result<(), Unwritten> {
        self.file.flush().map_err(Unwritten::at(&self.path))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_file_that_could_not_be_written_whole_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("phases.csv");
        let full = || io::Error::from(io::ErrorKind::StorageFull);
        let written = whole(&path, || {
            write(&path, "subject,pha")?;
            Err::<(), _>(Unwritten::at(&path)(full()))
        });
        assert!(written.is_err() && !path.exists());
        assert!(whole(&path, || write(&path, "subject,phase\n")).is_ok() && path.exists());
    }
}
