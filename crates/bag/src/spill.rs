//! A buffer that spills to the disk, so that memory does not grow with the recording.

use std::fs::File;
use std::io;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// The most bytes held in memory.
const IN_MEMORY: usize = 64 << 10;

/// A buffer of bytes: in memory while it is small, then in an unnamed file, which is deleted with the
/// process.
///
/// Bytes that can't be written to that file, such as on a full disk, stay in memory.
#[derive(Debug)]
pub struct Spill {
    folder: PathBuf,
    file: Option<File>,
    /// The number of bytes in the file.
    spilled_bytes: u64,
    rest: Vec<u8>,
}

impl Spill {
    /// Creates an empty buffer; its file will be on the disk of `folder`.
    pub fn new(folder: &Path) -> Spill {
        Spill { folder: folder.to_owned(), file: None, spilled_bytes: 0, rest: Vec::new() }
    }

    /// The number of bytes in the buffer.
    pub fn len(&self) -> u64 {
        self.spilled_bytes + self.rest.len() as u64
    }

    /// Whether the buffer is empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Appends the bytes that `put` produces.
    pub fn append(&mut self, put: impl FnOnce(&mut Vec<u8>)) {
        put(&mut self.rest);
        if self.rest.len() >= IN_MEMORY && self.spill().is_ok() {
            self.spilled_bytes += self.rest.len() as u64;
            self.rest.clear();
        }
    }

    /// Passes all bytes to `take`, in portions.
    pub fn read(&self, mut take: impl FnMut(&[u8]) -> io::Result<()>) -> io::Result<()> {
        let mut portion = vec![0; IN_MEMORY.min(self.spilled_bytes as usize)];
        let mut at = 0;
        while let (Some(file), true) = (&self.file, at < self.spilled_bytes) {
            let left = usize::try_from(self.spilled_bytes - at).unwrap_or(usize::MAX);
            let length = left.min(portion.len());
            file.read_exact_at(&mut portion[..length], at)?;
            take(&portion[..length])?;
            at += length as u64;
        }
        take(&self.rest)
    }

    /// Returns the bytes in a range, truncated at the end of the buffer.
    pub fn read_range(&self, range: Range<u64>) -> io::Result<Vec<u8>> {
        let in_file = range.start..range.end.min(self.spilled_bytes);
        let mut bytes = vec![0; in_file.end.saturating_sub(in_file.start) as usize];
        if let Some(file) = &self.file {
            file.read_exact_at(&mut bytes, in_file.start)?;
        }
        let place = |at: u64| at.saturating_sub(self.spilled_bytes) as usize;
        bytes.extend(self.rest.get(place(range.start)..place(range.end)).unwrap_or_default());
        Ok(bytes)
    }

    fn spill(&mut self) -> io::Result<()> {
        let file = match self.file.take() {
            Some(file) => file,
            None => tempfile::tempfile_in(&self.folder)?,
        };
        self.file.insert(file).write_all_at(&self.rest, self.spilled_bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(folder: &Path, words: u32) -> (Spill, Vec<u8>) {
        let mut spill = Spill::new(folder);
        for word in 0..words {
            spill.append(|out| out.extend(word.to_le_bytes()));
        }
        let mut all = Vec::new();
        let take = |portion: &[u8]| {
            all.extend_from_slice(portion);
            Ok(())
        };
        spill.read(take).unwrap();
        assert_eq!(all.len() as u64, spill.len());
        (spill, all)
    }

    #[test]
    fn what_is_kept_is_given_again_and_little_of_it_is_in_memory() {
        let folder = tempfile::tempdir().unwrap();
        let expected = |words: u32| (0..words).flat_map(u32::to_le_bytes).collect::<Vec<u8>>();
        for words in [0, 10, 100_000] {
            let (spill, all) = kept(folder.path(), words);
            assert_eq!(all, expected(words));
            for begin in [0, 1, words * 2, words * 4 - words.min(3)] {
                let [begin, end] = [begin, begin + words].map(|at| u64::from(at.min(words * 4)));
                let range = begin..end;
                let part = &all[range.start as usize..range.end as usize];
                assert_eq!(spill.read_range(range).unwrap(), part);
            }
            assert!(spill.rest.capacity() <= 2 * IN_MEMORY);
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "no file that has a name");
        let (spill, all) = kept(Path::new("/nowhere"), 100_000);
        assert_eq!(all, expected(100_000));
        assert_eq!(spill.spilled_bytes, 0);
    }
}
