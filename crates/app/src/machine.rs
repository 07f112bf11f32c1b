//! The machine that records: its network buffers, its disk and its clock.

mod host_clock;
mod memory;

use std::path::Path;

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use teampulse_bag::disk::{existing, free_bytes};
use teampulse_ros::receiving;
use tokio::signal::unix::{SignalKind, signal};

pub use memory::share_one_heap;

/// The receive buffer that a best-effort image of 1 MiB at 30 Hz needs to arrive complete [bytes].
const RECEIVE_BUFFER: u64 = 4 << 20;
/// The largest receive buffer that the bus requests [bytes].
const LARGEST_BUFFER: u64 = receiving::BUFFER_BYTES as u64;
/// The part of a receive buffer that a packet of up to 1.4 KiB occupies [bytes]; the kernel grants twice the requested
/// size.
const PACKET: f64 = 2304.0 / 2.0;
/// How long the receiving thread may have to wait for a processor on a busy machine [s].
const HELD_UP_SECS: f64 = 0.1;
/// The rate of messages above which scheduling latency matters [1/s].
const MANY_PER_SEC: f64 = 10_000.0;
/// The free disk space below which a warning is shown [bytes].
const FREE_DISK: u64 = 2 << 30;

/// The free disk space below which nothing is recorded [bytes].
pub const LEAST_DISK: u64 = 64 << 20;
/// What a recording needs in addition to the space that it keeps free [bytes]: it reserves some in order to finish on a
/// full disk.
const ROOM: u64 = 8 << 20;

/// Returns one line for each property of the machine that a recording depends on.
pub fn check(out: &Path) -> Vec<String> {
    vec![receive_buffer(), free_disk(out), host_clock::line()]
}

/// Returns why nothing can be recorded into a folder, if so. The recording would stop when less than `keep_free_bytes`
/// are free.
pub fn unfit(out: &Path, keep_free_bytes: u64) -> Option<String> {
    let folder = existing(out);
    if !folder.is_dir() {
        return Some(format!("{} is a file, not a folder to write into", folder.display()));
    }
    let writable = rustix::fs::access(folder, rustix::fs::Access::WRITE_OK);
    if let Err(error) = writable {
        return Some(format!("{} is not writable: {error}", folder.display()));
    }
    let disk = rustix::fs::statvfs(folder).ok()?;
    if disk.f_blocks == 0 {
        return Some(format!(
            "{} is not on a disk: no files can be created there",
            folder.display()
        ));
    }
    too_full(free_bytes(folder).ok()?, keep_free_bytes, folder)
}

/// Returns the reason if a disk has too little space to start a recording.
fn too_full(free_bytes: u64, keep_free_bytes: u64, folder: &Path) -> Option<String> {
    let free =
        format!("only {} MiB are free on the disk of {}", free_bytes >> 20, folder.display());
    let needed = LEAST_DISK.max(keep_free_bytes.saturating_add(ROOM));
    let needs = format!("{free}, and a recording needs {} MiB to start", needed >> 20);
    if free_bytes < LEAST_DISK {
        return Some(needs);
    }
    (free_bytes < needed).then(|| {
        format!("{needs}: the study keeps {} MiB free (keep_free_mib)", keep_free_bytes >> 20)
    })
}

/// Raises the number of files and sockets that this process may open to its limit: a large team needs many.
pub fn allow_many_files() {
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    if current != maximum {
        let raised = setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum });
        raised.unwrap_or_else(|error| tracing::debug!("may not open more files: {error}"));
    }
}

/// Makes writes fail if a file exceeds the size that this account allows (`ulimit -f`), instead of ending the process:
/// a recording then reports the failure and ends intact.
pub fn outlive_large_files() {
    let hears = signal(SignalKind::from_raw(libc::SIGXFSZ));
    drop(hears.inspect_err(|error| tracing::warn!("failed to ignore SIGXFSZ: {error}")));
}

/// Returns a warning for each property of the machine that falls short of this rate of messages.
pub fn crowded(messages_per_sec: f64) -> Vec<String> {
    let small = largest_receive_buffer().and_then(|bytes| too_small(bytes, messages_per_sec));
    small.into_iter().chain(waits(receiving::may_come_first(), messages_per_sec)).collect()
}

/// Returns the warning that receiving threads run at normal priority, if the rate of messages makes it matter.
fn waits(may_come_first: bool, messages_per_sec: f64) -> Option<String> {
    (!may_come_first && messages_per_sec >= MANY_PER_SEC).then(|| {
        format!(
            "cpu      wait  {messages_per_sec:.0} messages/s are received at normal priority: a \
             busy machine may lose some; a line `YOU - nice -10` with your account in \
             /etc/security/limits.conf permits a higher one from the next login on"
        )
    })
}

fn too_small(bytes: u64, messages_per_sec: f64) -> Option<String> {
    let needed = (messages_per_sec * HELD_UP_SECS * PACKET) as u64;
    let needed = needed.max(RECEIVE_BUFFER).next_power_of_two().min(LARGEST_BUFFER);
    let held_ms = bytes as f64 / PACKET / messages_per_sec * 1e3;
    (bytes < needed && messages_per_sec > 0.0 && held_ms < HELD_UP_SECS * 1e3).then(|| {
        format!(
            "network  small receive buffers of {} KiB hold {held_ms:.0} ms of {messages_per_sec:.0} \
             messages/s: a busy machine loses some; raise them with \
             `sudo sysctl -w net.core.rmem_max={needed}`",
            bytes >> 10
        )
    })
}

fn largest_receive_buffer() -> Option<u64> {
    receiving::buffer_bytes().map(|bytes| bytes as u64)
}

fn receive_buffer() -> String {
    match largest_receive_buffer() {
        Some(bytes) if bytes >= RECEIVE_BUFFER => {
            format!("network  ok    receive buffers up to {} KiB", bytes >> 10)
        }
        Some(bytes) => format!(
            "network  small receive buffers up to {} KiB: large messages may be lost; raise it \
             with `sudo sysctl -w net.core.rmem_max={RECEIVE_BUFFER}`",
            bytes >> 10
        ),
        None => "network  ?     the size of receive buffers is unknown".to_owned(),
    }
}

fn free_disk(out: &Path) -> String {
    match free_bytes(out) {
        Ok(free) => {
            let word = match unfit(out, 0) {
                Some(_) => "unfit",
                None if free < FREE_DISK => "small",
                None => "ok   ",
            };
            format!("disk     {word} {:.1} GB free for {}", free as f64 / 1e9, out.display())
        }
        Err(error) => format!("disk     ?     failed to read its free space: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_receive_buffer_covers_the_delays_of_a_busy_machine() {
        let (installed, large) = (208 << 10, 16 << 20);
        let warning = too_small(installed, 50_000.0).unwrap();
        assert!(warning.contains("208 KiB hold 4 ms of 50000 messages/s"), "{warning}");
        assert!(warning.contains("net.core.rmem_max=8388608"), "{warning}");
        assert_eq!(too_small(large, 100_000.0), None);
        assert!(too_small(4 << 20, 100_000.0).unwrap().ends_with("rmem_max=16777216`"));
        assert_eq!(too_small(installed, 1_000.0), None, "they hold 185 ms of it");
        assert_eq!(too_small(installed, 0.0), None);
    }

    #[test]
    fn many_messages_without_priority_give_a_warning() {
        let warning = waits(false, 50_000.0).unwrap();
        assert!(warning.contains("50000 messages/s") && warning.contains("nice -10"), "{warning}");
        assert_eq!(waits(true, 50_000.0), None);
        assert_eq!(waits(false, 500.0), None);
    }

    #[test]
    fn a_file_is_not_a_folder_for_recordings() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "mine").unwrap();
        for out in [file.clone(), file.join("below")] {
            assert!(
                unfit(&out, 0).unwrap().ends_with("file is a file, not a folder to write into"),
                "{out:?}"
            );
        }
        assert_eq!(unfit(&folder.path().join("new"), 0), None);
        let nowhere = unfit(Path::new("/proc/nowhere"), 0).unwrap();
        assert_eq!(nowhere, "/proc is not on a disk: no files can be created there");
    }

    #[test]
    fn a_disk_with_less_free_space_than_required_is_refused() {
        let said = |free_mib: u64, keep_free_mib: u64| {
            too_full(free_mib << 20, keep_free_mib << 20, Path::new("/data"))
        };
        assert_eq!(said(500, 400), None);
        assert!(said(10, 0).unwrap().ends_with(
            "only 10 MiB are free on the disk of /data, and a recording needs 64 MiB to start"
        ));
        let kept = said(500, 600).unwrap();
        assert!(
            kept.ends_with(
                "a recording needs 608 MiB to start: the study keeps 600 MiB free (keep_free_mib)"
            ),
            "{kept}"
        );
        assert!(said(66, 64).unwrap().contains("needs 72 MiB to start"), "a bag reserves some");
        assert_eq!(said(72, 64), None);
    }
}
