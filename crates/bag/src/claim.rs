//! The lock on a file that is being written, so that readers do not take it for a damaged file, and nobody repairs it.

use std::fs::{File, TryLockError};

/// Marks a file as being written until all handles to it are closed; returns whether no other handle has marked it. On
/// a file system without locks nothing is marked.
pub(crate) fn claim(file: &File) -> bool {
    !matches!(file.try_lock(), Err(TryLockError::WouldBlock))
}

/// Whether another handle has claimed a file.
pub(crate) fn is_claimed(file: &File) -> bool {
    let claimed = matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
    drop(file.unlock());
    claimed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_claimed_until_its_last_handle_is_closed() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let reader = File::open(file.path()).unwrap();
        assert!(!is_claimed(&reader));
        let writer = File::options().write(true).open(file.path()).unwrap();
        assert!(claim(&writer));
        assert!(!claim(&reader));
        let second = writer.try_clone().unwrap();
        drop(writer);
        assert!(is_claimed(&reader) && is_claimed(&reader));
        drop(second);
        assert!(!is_claimed(&reader));
    }
}
