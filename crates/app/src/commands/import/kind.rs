//! Detects the kind of a file by its first bytes.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use super::imported::is_of_device;
use super::tables::signal_of;
use crate::failure::Failure;

/// The kind of a file or folder to import.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A ROS recording.
    Bag,
    /// A table of samples.
    Table,
    /// A folder of tables.
    Tables,
    /// A file of a device, other than a table.
    Device,
}

/// The first bytes of recordings: MCAP, `SQLite`, Zstandard and ROS 1; whether the file is valid shows when it is
/// opened.
const BEGINNINGS: [&[u8]; 4] =
    [b"\x89MCAP", b"SQLite format 3\0", &[0x28, 0xb5, 0x2f, 0xfd], b"#ROSBAG V"];

impl Kind {
    /// Detects the kind of a file or a folder.
    pub fn of(path: &Path) -> Result<Kind, Failure> {
        let unreadable = |error| Failure::to(format!("open {}: {error}", path.display()));
        if fs::metadata(path).map_err(unreadable)?.is_dir() {
            let has_tables = tables_in(path).is_ok_and(|tables| !tables.is_empty());
            return Ok(if has_tables { Kind::Tables } else { Kind::Bag });
        }
        let mut start = Vec::new();
        File::open(path)
            .and_then(|file| file.take(16).read_to_end(&mut start))
            .map_err(unreadable)?;
        let is_bag = BEGINNINGS.iter().any(|beginning| start.starts_with(beginning));
        if start.is_empty() {
            let empty = Failure::to(format!("import {}: the file is empty", path.display()));
            return Err(empty.hint("copy it again from where it was recorded"));
        }
        if is_of_device(&start) {
            return Ok(Kind::Device);
        }
        if is_bag {
            return Ok(Kind::Bag);
        }
        named_format(path).map_or(Ok(Kind::Table), |format| {
            let message = format!("import {}: its contents are not {format}", path.display());
            let hint = "copy it again from where it was recorded; a table needs a name that ends in .csv or .txt";
            Err(Failure::to(message).hint(hint))
        })
    }
}

/// Returns the format, other than a table, that the name of a file indicates.
fn named_format(path: &Path) -> Option<&'static str> {
    let formats = [
        ("edf", "EDF"),
        ("bdf", "BDF"),
        ("xdf", "XDF"),
        ("avro", "Avro"),
        ("zip", "a zip archive"),
        ("mcap", "MCAP"),
        ("db3", "an SQLite database"),
        ("bag", "a ROS 1 bag"),
    ];
    let ending = path.extension()?;
    formats.iter().find(|(name, _)| ending.eq_ignore_ascii_case(name)).map(|(_, format)| *format)
}

/// Returns the tables in a folder whose names indicate a signal; none if the folder contains a ROS recording.
pub fn tables_in(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let unreadable = |error| Failure::to(format!("open {}: {error}", folder.display()));
    let entries = fs::read_dir(folder).map_err(unreadable)?;
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.sort();
    let is = |path: &Path, kind: &str| {
        path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(kind))
    };
    if files.iter().any(|path| ["mcap", "db3", "zstd"].iter().any(|kind| is(path, kind))) {
        return Ok(Vec::new());
    }
    let is_table = |path: &Path| ["csv", "txt"].iter().any(|kind| is(path, kind));
    files.retain(|path| is_table(path) && signal_of(path).is_some());
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_not_what_its_name_says_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let kind = |name: &str, contents: &[u8]| {
            let path = folder.path().join(name);
            fs::write(&path, contents).unwrap();
            Kind::of(&path).map_err(|failure| failure.words().0)
        };
        assert_eq!(kind("a.csv", b"1\n2\n"), Ok(Kind::Table));
        assert_eq!(kind("a.mcap", b"\x89MCAP0\r\n"), Ok(Kind::Bag));
        assert_eq!(kind("a.edf", b"0       X"), Ok(Kind::Device));
        for (name, contents, reason) in [
            ("b.csv", "", "the file is empty"),
            ("b.EDF", "garbage", "its contents are not EDF"),
            ("b.zip", "garbage", "its contents are not a zip archive"),
        ] {
            let refused = kind(name, contents.as_bytes()).unwrap_err();
            assert!(refused.contains(reason), "{refused}");
        }
    }
}
