use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use rustix::fs::{FlockOperation, OFlags, fcntl_getfl, fcntl_setfl, flock};
use rustix::io::Errno;
use rustix::termios::{
    OptionalActions, QueueSelector, ioctl_tiocexcl, tcflush, tcgetattr, tcsetattr,
};
use thiserror::Error;
use tokio::io::unix::AsyncFd;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::task::spawn_blocking;

/// A serial port in raw mode with eight data bits, used exclusively by this program; earlier input is discarded.
#[derive(Debug)]
pub struct SerialPort(AsyncFd<File>);

/// Why a port can't be opened. The message fits after "failed to".
#[derive(Debug, Error)]
#[error("open {port}: {why}")]
pub struct SerialError {
    /// The path of the port.
    pub port: String,
    /// The reason.
    pub why: String,
    /// What the user can do.
    pub hint: String,
}

impl SerialPort {
    /// Opens a port, which takes seconds if the port is a radio link.
    pub async fn open(path: &str, baud: u32) -> Result<SerialPort, SerialError> {
        let owned = path.to_owned();
        let opened = spawn_blocking(move || open(&owned, baud)).await;
        let file = opened.unwrap_or_else(|error| Err(io::Error::other(error)));
        file.and_then(SerialPort::new).map_err(|error| describe(path, &error))
    }

    #[expect(
        deprecated,
        reason = "`register` is unsafe; a file keeps its descriptor until it is dropped"
    )]
    fn new(file: File) -> io::Result<SerialPort> {
        AsyncFd::new(file).map(SerialPort)
    }
}

fn open(path: &str, baud: u32) -> io::Result<File> {
    // Opening a pipe would block until it has a writer.
    if !fs::metadata(path)?.file_type().is_char_device() {
        return Err(Errno::NOTTY.into());
    }
    // Opening waits for the carrier, as Bluetooth's ports accept nothing until their link is up.
    let flags = OFlags::NOCTTY.bits().cast_signed();
    let file = OpenOptions::new().read(true).write(true).custom_flags(flags).open(path)?;
    let mut settings = tcgetattr(&file)?;
    // The kernel's exclusive mode does not apply to root.
    flock(&file, FlockOperation::NonBlockingLockExclusive)?;
    ioctl_tiocexcl(&file)?;
    settings.make_raw();
    settings.set_speed(baud)?;
    tcsetattr(&file, OptionalActions::Now, &settings)?;
    tcflush(&file, QueueSelector::IOFlush)?;
    fcntl_setfl(&file, fcntl_getfl(&file)? | OFlags::NONBLOCK)?;
    Ok(file)
}

fn describe(path: &str, error: &io::Error) -> SerialError {
    let (why, hint) = match Errno::from_io_error(error) {
        Some(Errno::ACCESS | Errno::PERM) => (
            "permission denied".to_owned(),
            "run `sudo usermod -aG dialout $USER`, then log out and in again".to_owned(),
        ),
        Some(Errno::NOENT | Errno::NODEV | Errno::NXIO) => (
            "there is no such port".to_owned(),
            "plug it in, or bind it if it is reached over Bluetooth (`sudo rfcomm bind 0 ADDRESS` makes \
             /dev/rfcomm0); `teampulse scan` lists the ports"
                .to_owned(),
        ),
        Some(Errno::BUSY | Errno::WOULDBLOCK) => (
            "another program is using it".to_owned(),
            format!("`fuser {path}` shows which one; close it"),
        ),
        Some(Errno::NOTTY | Errno::ISDIR | Errno::INVAL) => {
            ("it is not a serial port".to_owned(), "`teampulse scan` lists the ports".to_owned())
        }
        Some(Errno::HOSTDOWN | Errno::HOSTUNREACH | Errno::CONNREFUSED | Errno::TIMEDOUT) => {
            ("the device does not answer".to_owned(), "is it switched on, paired and in range?".to_owned())
        }
        _ => (error.to_string(), "`teampulse scan` lists the ports".to_owned()),
    };
    SerialError { port: path.to_owned(), why, hint }
}

impl AsyncRead for SerialPort {
    fn poll_read(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        loop {
            let mut ready = ready!(self.0.poll_read_ready(context))?;
            let read = ready.try_io(|file| file.get_ref().read(buffer.initialize_unfilled()));
            match read {
                Ok(Ok(count)) => {
                    buffer.advance(count);
                    return Poll::Ready(Ok(()));
                }
                // The other side is gone, so this is the end of the input.
                Ok(Err(error)) if Errno::from_io_error(&error) == Some(Errno::IO) => {
                    return Poll::Ready(Ok(()));
                }
                Ok(Err(error)) if error.kind() == ErrorKind::Interrupted => {}
                Ok(Err(error)) => return Poll::Ready(Err(error)),
                Err(_would_block) => {}
            }
        }
    }
}

impl AsyncWrite for SerialPort {
    fn poll_write(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        loop {
            let mut ready = ready!(self.0.poll_write_ready(context))?;
            match ready.try_io(|file| file.get_ref().write(bytes)) {
                Ok(Err(error)) if error.kind() == ErrorKind::Interrupted => {}
                Ok(written) => return Poll::Ready(written),
                Err(_would_block) => {}
            }
        }
    }

    fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    use super::super::Pty;
    use super::*;

    async fn hint_of(path: &str) -> (String, String) {
        let error = SerialPort::open(path, 115_200).await.expect_err("is no port");
        (error.to_string(), error.hint)
    }

    #[tokio::test]
    async fn what_is_not_a_port_is_named_with_a_remedy() {
        let (error, hint) = hint_of("/dev/rfcomm_absent").await;
        assert_eq!(error, "open /dev/rfcomm_absent: there is no such port");
        assert!(hint.contains("rfcomm bind"), "{hint}");
        assert_eq!(hint_of("/dev/null").await.0, "open /dev/null: it is not a serial port");
        assert_eq!(hint_of("/tmp").await.0, "open /tmp: it is not a serial port");
    }

    #[test]
    fn a_port_without_permission_comes_with_the_command_that_helps() {
        let denied = describe("/dev/ttyUSB0", &io::Error::from(ErrorKind::PermissionDenied));
        assert_eq!(denied.why, "permission denied".to_owned());
        let denied = describe("/dev/ttyUSB0", &Errno::ACCESS.into());
        assert!(denied.hint.contains("usermod -aG dialout"), "{denied:?}");
    }

    #[tokio::test]
    async fn every_byte_passes_both_ways_and_the_end_is_seen() {
        let pty = Pty::open(None).expect("a pseudoterminal");
        let mut port = SerialPort::open(pty.path(), 115_200).await.expect("a port");
        let all: Vec<u8> = (0..=255).collect();
        assert_eq!(pty.write(&all).expect("is open"), 256);
        let mut read = [0; 256];
        port.read_exact(&mut read).await.expect("arrives");
        assert_eq!(read, *all);
        port.write_all(&all).await.expect("is open");
        let mut there = Vec::new();
        while there.len() < 256 {
            pty.read(&mut there).expect("is open");
            tokio::task::yield_now().await;
        }
        assert_eq!(there, all);
        drop(pty);
        assert_eq!(port.read(&mut read).await.expect("the end"), 0);
    }
}
