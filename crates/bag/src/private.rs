//! Private files about people: unreadable for other users of the machine, whatever the umask.

use std::fs::{self, DirBuilder, File, OpenOptions, Permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt, PermissionsExt};
use std::path::Path;

/// The mode of folders: accessible by their owner only.
const FOLDER: u32 = 0o700;
/// The mode of files: readable and writable by their owner only.
const FILE: u32 = 0o600;

/// Creates or truncates a file for writing. An existing file that others could read becomes private.
pub fn create(path: &Path) -> io::Result<File> {
    owned(OpenOptions::new().write(true).create(true).truncate(true).mode(FILE).open(path)?)
}

/// Creates a file for writing; fails if it exists.
pub fn create_new(path: &Path) -> io::Result<File> {
    owned(OpenOptions::new().write(true).create_new(true).mode(FILE).open(path)?)
}

/// Writes a file, replacing its contents.
pub fn write(path: &Path, contents: impl AsRef<[u8]>) -> io::Result<()> {
    io::Write::write_all(&mut create(path)?, contents.as_ref())
}

/// Creates a folder; fails if it exists.
pub fn create_folder(path: &Path) -> io::Result<()> {
    DirBuilder::new().mode(FOLDER).create(path)?;
    restrict_folder(path)
}

/// Creates a folder and its missing parents; existing folders keep their permissions.
pub fn create_folders(path: &Path) -> io::Result<()> {
    if path.as_os_str().is_empty() || path.is_dir() {
        return Ok(());
    }
    if let Some(above) = path.parent() {
        create_folders(above)?;
    }
    match create_folder(path) {
        Err(_) if path.is_dir() => Ok(()),
        created => created,
    }
}

/// Makes a file private: the umask may have removed the owner's own permissions, and an existing file may be readable
/// by others. A file system without permissions, such as a USB stick's, returns an error, and has nothing to restrict.
fn owned(file: File) -> io::Result<File> {
    let is_private = file.metadata()?.permissions().mode() & 0o777 == FILE;
    if !is_private {
        drop(file.set_permissions(Permissions::from_mode(FILE)));
    }
    Ok(file)
}

fn restrict_folder(path: &Path) -> io::Result<()> {
    let is_private = fs::metadata(path)?.permissions().mode() & 0o777 == FOLDER;
    if !is_private {
        drop(fs::set_permissions(path, Permissions::from_mode(FOLDER)));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn what_is_created_can_be_read_by_its_owner_alone() {
        let folder = tempfile::tempdir().unwrap();
        let (outer, inner) = (folder.path().join("a"), folder.path().join("a/b/c"));
        create_folders(&inner).unwrap();
        create_folders(&inner).unwrap();
        assert_eq!((mode(&outer), mode(&inner)), (0o700, 0o700));
        let (old, new) = (inner.join("old"), inner.join("new"));
        fs::write(&old, "seen by all").unwrap();
        fs::set_permissions(&old, Permissions::from_mode(0o666)).unwrap();
        write(&old, "private").unwrap();
        drop(create_new(&new).unwrap());
        assert_eq!((mode(&old), mode(&new)), (0o600, 0o600));
        assert_eq!(fs::read_to_string(&old).unwrap(), "private");
        assert!(create_new(&new).is_err());
        assert!(create_folder(&inner).is_err());
    }

    #[test]
    fn a_folder_that_was_there_stays_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let shared = folder.path().join("shared");
        fs::create_dir(&shared).unwrap();
        fs::set_permissions(&shared, Permissions::from_mode(0o755)).unwrap();
        create_folders(&shared.join("sessions")).unwrap();
        assert_eq!((mode(&shared), mode(&shared.join("sessions"))), (0o755, 0o700));
        create_folders(Path::new("")).unwrap();
    }
}
