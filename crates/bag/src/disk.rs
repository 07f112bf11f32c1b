//! The disk that a bag is on.

use std::io;
use std::path::Path;

use rustix::fs::statvfs;

/// Returns the folder itself if it exists, otherwise the nearest parent that does.
pub fn existing(folder: &Path) -> &Path {
    let found = folder.ancestors().find(|path| path.exists());
    found.filter(|path| *path != Path::new("")).unwrap_or(Path::new("."))
}

/// The free space for ordinary users on the disk of a folder, or of its nearest parent that exists [bytes].
pub fn free_bytes(folder: &Path) -> io::Result<u64> {
    let disk = statvfs(existing(folder))?;
    Ok(disk.f_bavail.saturating_mul(disk.f_frsize))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn free_space_is_reported_also_for_a_folder_that_is_yet_to_be_created() {
        let folder = tempfile::tempdir().unwrap();
        assert!(free_bytes(&folder.path().join("new/bag")).unwrap() > 0);
        assert!(free_bytes(Path::new("new")).unwrap() > 0);
    }
}
