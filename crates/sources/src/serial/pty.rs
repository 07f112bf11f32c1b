use std::fs::{self, OpenOptions};
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::fs::{OpenOptionsExt, symlink};
use std::path::{Path, PathBuf};

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use crate::lock::{Lock, Locked};

/// The largest number of bytes read at once.
const PIECE: usize = 1024;
const MOST_PIECES: usize = 16;

/// A serial port without a device: what is written here is read by the program that opens its path, and vice versa.
#[derive(Debug)]
pub struct Pty {
    near: OwnedFd,
    path: String,
    link: Option<PathBuf>,
    _lock: Option<Lock>,
}

impl Pty {
    /// Creates a port, and a link to it if its path must be known beforehand. A link left behind by another process is
    /// replaced; the link of a running process is an error.
    pub fn open(link: Option<&Path>) -> io::Result<Pty> {
        let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&near)?;
        unlockpt(&near)?;
        fcntl_setfl(&near, fcntl_getfl(&near)? | OFlags::NONBLOCK)?;
        let path = ptsname(&near, Vec::new())?.into_string().map_err(io::Error::other)?;
        // Raw, like a device. The port is closed once, as only then a read shows that no program has it open.
        let flags = OFlags::NOCTTY.bits().cast_signed();
        let far = OpenOptions::new().read(true).write(true).custom_flags(flags).open(&path)?;
        let mut settings = tcgetattr(&far)?;
        settings.make_raw();
        tcsetattr(&far, OptionalActions::Now, &settings)?;
        let lock = link.map(locked).transpose()?.flatten();
        if let Some(link) = link {
            if link.is_symlink() {
                fs::remove_file(link)?;
            }
            symlink(&path, link)?;
        }
        Ok(Pty { near, path, link: link.map(Path::to_owned), _lock: lock })
    }

    /// The path to open.
    pub fn path(&self) -> &str {
        self.link.as_deref().and_then(Path::to_str).unwrap_or(&self.path)
    }

    /// Reads the bytes that have arrived; returns whether a program has the port open.
    pub fn read(&self, received: &mut Vec<u8>) -> io::Result<bool> {
        let mut bytes = [0; PIECE];
        for _ in 0..MOST_PIECES {
            match rustix::io::read(&self.near, &mut bytes) {
                Ok(count) => received.extend(bytes.iter().take(count)),
                Err(Errno::INTR) => {}
                Err(Errno::AGAIN) => return Ok(true),
                Err(Errno::IO) => return Ok(false),
                Err(error) => return Err(error.into()),
            }
        }
        Ok(true)
    }

    /// Writes as many bytes as are accepted immediately, and returns their number.
    pub fn write(&self, bytes: &[u8]) -> io::Result<usize> {
        match rustix::io::write(&self.near, bytes) {
            Err(Errno::AGAIN | Errno::IO | Errno::INTR) => Ok(0),
            written => Ok(written?),
        }
    }
}

/// Takes the lock on a link.
fn locked(link: &Path) -> io::Result<Option<Lock>> {
    let folder = link.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = fs::canonicalize(folder.unwrap_or(Path::new(".")))?;
    Lock::on("port", (folder, link.file_name())).map_err(|Locked| {
        io::Error::new(io::ErrorKind::AddrInUse, "another emulated device uses it")
    })
}

impl Drop for Pty {
    fn drop(&mut self) {
        let ours = |link: &PathBuf| fs::read_link(link).is_ok_and(|to| to == Path::new(&self.path));
        if let Some(link) = self.link.as_ref().filter(|link| ours(link)) {
            // A link that stays is dangling, and is replaced by the next one.
            let _removed = fs::remove_file(link);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_that_nobody_has_open_is_known_and_its_link_goes_with_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let link = folder.path().join("shimmer");
        let pty = Pty::open(Some(&link)).expect("a pseudoterminal");
        assert!(!pty.read(&mut Vec::new()).expect("is there"));
        let far = OpenOptions::new().read(true).write(true).open(pty.path()).expect("opens");
        assert!(pty.read(&mut Vec::new()).expect("is there"));
        drop(far);
        assert!(!pty.read(&mut Vec::new()).expect("is there"));
        let other = Pty::open(Some(&link)).expect_err("it is used");
        assert_eq!(other.to_string(), "another emulated device uses it");
        assert!(link.is_symlink(), "the link of the first stays");
        drop(pty);
        assert!(!link.is_symlink());
        assert!(Pty::open(Some(&link)).is_ok());
    }
}
