//! The machine that records: its network buffers, its disk and its clock.

mod host_clock;

use std::path::Path;

/// What a best-effort image of 1 MiB at 30 Hz needs to arrive whole [bytes].
const RECEIVE_BUFFER: u64 = 4 << 20;
/// Less free disk than this is told [bytes].
const FREE_DISK: u64 = 2 << 30;

/// With less free disk than this nothing is recorded [bytes].
const LEAST_DISK: u64 = 64 << 20;

/// One line for each thing about the machine that a recording depends on.
pub fn check(out: &Path) -> Vec<String> {
    vec![receive_buffer(), free_disk(out), host_clock::line()]
}

/// Why nothing can be recorded into a folder.
pub fn unfit(out: &Path) -> Option<String> {
    let folder = existing(out);
    if !folder.is_dir() {
        return Some(format!("a folder to write into: {} is a file", folder.display()));
    }
    let writable = rustix::fs::access(folder, rustix::fs::Access::WRITE_OK);
    if let Err(error) = writable {
        return Some(format!("a folder to write into: {}: {error}", folder.display()));
    }
    let free = free_bytes(folder).ok().filter(|free| *free < LEAST_DISK)?;
    Some(format!("room on the disk of {}: {} MiB are free", folder.display(), free >> 20))
}

/// The folder itself, or the nearest above it that exists.
fn existing(out: &Path) -> &Path {
    let found = out.ancestors().find(|path| path.exists());
    found.filter(|path| *path != Path::new("")).unwrap_or(Path::new("."))
}

fn free_bytes(folder: &Path) -> rustix::io::Result<u64> {
    let space = rustix::fs::statvfs(folder)?;
    Ok(space.f_bavail.saturating_mul(space.f_frsize))
}

fn receive_buffer() -> String {
    let path = "/proc/sys/net/core/rmem_max";
    let text = std::fs::read_to_string(path).unwrap_or_default();
    match text.trim().parse::<u64>() {
        Ok(bytes) if bytes >= RECEIVE_BUFFER => {
            format!("network  ok    receive buffers up to {} KiB", bytes >> 10)
        }
        Ok(bytes) => format!(
            "network  small receive buffers up to {} KiB: large messages may be lost; raise it \
             with `sudo sysctl -w net.core.rmem_max={RECEIVE_BUFFER}`",
            bytes >> 10
        ),
        Err(_) => format!("network  ?     the size of receive buffers is unknown: no {path}"),
    }
}

fn free_disk(out: &Path) -> String {
    match free_bytes(existing(out)) {
        Ok(free) => {
            let word = if free < FREE_DISK { "small" } else { "ok   " };
            format!("disk     {word} {:.1} GB free for {}", free as f64 / 1e9, out.display())
        }
        Err(error) => format!("disk     ?     failed to ask for its free space: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_recorded_into_a_file_or_below_one() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "mine").unwrap();
        for out in [file.clone(), file.join("below")] {
            assert!(unfit(&out).unwrap().ends_with("file is a file"), "{out:?}");
        }
        assert_eq!(unfit(&folder.path().join("new")), None);
    }
}
