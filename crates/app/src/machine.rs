//! The machine that records: its network buffers and its disk.

use std::path::Path;

/// What a best-effort image of 1 MiB at 30 Hz needs to arrive whole [bytes].
const RECEIVE_BUFFER: u64 = 4 << 20;
/// Less free disk than this is told [bytes].
const FREE_DISK: u64 = 2 << 30;

/// One line for each thing about the machine that a recording depends on.
pub fn check(out: &Path) -> Vec<String> {
    vec![receive_buffer(), free_disk(out)]
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
    let existing = out.ancestors().find(|path| path.exists()).filter(|path| path.is_dir());
    let space = rustix::fs::statvfs(existing.unwrap_or(Path::new(".")));
    match space {
        Ok(space) => {
            let free = space.f_bavail.saturating_mul(space.f_frsize);
            let word = if free < FREE_DISK { "small" } else { "ok   " };
            format!("disk     {word} {:.1} GB free for {}", free as f64 / 1e9, out.display())
        }
        Err(error) => format!("disk     ?     failed to ask for its free space: {error}"),
    }
}
