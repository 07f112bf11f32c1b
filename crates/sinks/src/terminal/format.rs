//! Formats numbers for display.

/// A duration as a clock shows it: `0:41`, `12:05`, `1:02:05`.
pub(super) fn clock(secs: f64) -> String {
    let secs = secs.max(0.0) as u64;
    let (hours, minutes, secs) = (secs / 3600, secs / 60 % 60, secs % 60);
    match hours {
        0 => format!("{minutes}:{secs:02}"),
        _ => format!("{hours}:{minutes:02}:{secs:02}"),
    }
}

/// A duration in words: in seconds, with a decimal below ten, or in minutes from two minutes on.
pub(super) fn for_so_long(secs: f64) -> String {
    match secs {
        secs if secs < 9.95 => format!("{secs:.1} s"),
        secs if secs < 120.0 => format!("{secs:.0} s"),
        secs => minutes(secs),
    }
}

/// A duration in minutes, or in hours from ten hours on.
pub(super) fn minutes(secs: f64) -> String {
    let minutes = secs / 60.0;
    if minutes < 600.0 { format!("{minutes:.0} min") } else { format!("{:.0} h", minutes / 60.0) }
}

/// A file size: `48.2 MB`, `212 GB`.
pub(super) fn size(bytes: u64) -> String {
    let bytes = bytes as f64;
    let (value, unit) = match bytes {
        bytes if bytes < 1e6 => (bytes / 1e3, "kB"),
        bytes if bytes < 1e9 => (bytes / 1e6, "MB"),
        bytes if bytes < 1e12 => (bytes / 1e9, "GB"),
        bytes => (bytes / 1e12, "TB"),
    };
    if value < 99.95 { format!("{value:.1} {unit}") } else { format!("{value:.0} {unit}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_short_as_they_are_clear() {
        assert_eq!([clock(41.2), clock(725.0), clock(3725.9)], ["0:41", "12:05", "1:02:05"]);
        assert_eq!([for_so_long(9.7), for_so_long(41.3)], ["9.7 s", "41 s"]);
        assert_eq!([for_so_long(150.0), minutes(50_000.0)], ["2 min", "14 h"]);
        assert_eq!([size(0), size(48_240_000)], ["0.0 kB", "48.2 MB"]);
        assert_eq!([size(212_000_000_000), size(1_900_000_000_000)], ["212 GB", "1.9 TB"]);
    }
}
