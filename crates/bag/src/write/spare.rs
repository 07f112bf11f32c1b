//! Reserved space on the disk, so that a recording on a full disk can still be finished.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use rustix::fs::{FallocateFlags, fallocate};

use crate::private;

/// Disk space that can be released once.
pub(crate) trait Spare: Send {
    /// Reserves at least `bytes`.
    fn grow_to(&mut self, bytes: u64) -> io::Result<()>;

    /// Releases the space.
    fn release(&mut self);
}

/// An allocated unnamed file: it is deleted with the process.
#[derive(Debug)]
pub(crate) struct SpareFile {
    folder: PathBuf,
    file: Option<File>,
    kept_bytes: u64,
}

/// The step in which space is reserved [bytes].
const STEP_BYTES: u64 = 1 << 20;

impl SpareFile {
    pub(crate) fn new(folder: &Path) -> SpareFile {
        SpareFile { folder: folder.to_owned(), file: None, kept_bytes: 0 }
    }

    fn create(&self) -> io::Result<File> {
        let path = self.folder.join(".spare");
        let file = private::create(&path)?;
        fs::remove_file(&path)?;
        Ok(file)
    }
}

impl Spare for SpareFile {
    fn grow_to(&mut self, bytes: u64) -> io::Result<()> {
        if bytes <= self.kept_bytes {
            return Ok(());
        }
        let bytes = bytes.next_multiple_of(STEP_BYTES);
        let file = match self.file.take() {
            Some(file) => file,
            None => self.create()?,
        };
        let allocated = fallocate(&file, FallocateFlags::empty(), 0, bytes);
        self.file = Some(file);
        match allocated.map_err(io::Error::from) {
            // The file system can't reserve space, so checking the free space must suffice.
            Err(error) if !is_full(&error) => Ok(()),
            Err(full) => Err(full),
            Ok(()) => {
                self.kept_bytes = bytes;
                Ok(())
            }
        }
    }

    fn release(&mut self) {
        self.file = None;
        self.kept_bytes = 0;
    }
}

/// Whether an error means that the disk is full.
pub(crate) fn is_full(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded)
}

/// The state of the file that is being written, shared by its writers.
#[derive(Debug, Default)]
pub(crate) struct Progress {
    written_bytes: AtomicU64,
    full: AtomicBool,
}

impl Progress {
    /// The length of the file [bytes].
    pub(crate) fn written_bytes(&self) -> u64 {
        self.written_bytes.load(Ordering::Relaxed)
    }

    /// Whether the disk is full, and the reserved space is being used.
    pub(crate) fn is_full(&self) -> bool {
        self.full.load(Ordering::Relaxed)
    }
}

/// A file whose end can be written even on a full disk: it then releases the reserved space, and reports this through
/// its [`Progress`].
pub(crate) struct Backed<F> {
    file: F,
    spare: Arc<Mutex<dyn Spare>>,
    progress: Arc<Progress>,
}

impl<F: Write> Backed<F> {
    pub(crate) fn new(file: F, spare: Arc<Mutex<dyn Spare>>, progress: Arc<Progress>) -> Backed<F> {
        Backed { file, spare, progress }
    }
}

impl<F: Write> Write for Backed<F> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = match self.file.write(bytes) {
            Err(error) if is_full(&error) && !self.progress.full.swap(true, Ordering::Relaxed) => {
                self.spare.lock().unwrap_or_else(PoisonError::into_inner).release();
                self.file.write(bytes)
            }
            written => written,
        }?;
        self.progress.written_bytes.fetch_add(written as u64, Ordering::Relaxed);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spare_space_has_no_name_and_grows() {
        let folder = tempfile::tempdir().unwrap();
        let mut spare = SpareFile::new(folder.path());
        spare.grow_to(1).unwrap();
        spare.grow_to(3 << 20).unwrap();
        assert_eq!(spare.file.as_ref().unwrap().metadata().unwrap().len(), 3 << 20);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
