//! Quality of service as rosbag2 writes it: a YAML sequence, with names since version 9 and with the numbers of `rmw`
//! before it.

use std::fmt::Write;
use std::time::Duration;

use teampulse_core::qos::{Durability, History, Liveliness, Qos, Reliability};

use crate::metadata::Version;

/// The value for "no limit" in ROS 2 durations [ns].
const INFINITE_NANOS: u64 = i64::MAX as u64;
const NANOS_PER_SEC: u64 = 1_000_000_000;

/// Serialises the profiles as a YAML sequence without indentation; empty sequences are written as rosbag2 writes them.
pub(crate) fn write(profiles: &[Qos], version: Version) -> String {
    if profiles.is_empty() {
        return if version == Version::V9 { "[]".into() } else { String::new() };
    }
    profiles.iter().map(|qos| profile(qos, version)).collect::<Vec<_>>().join("\n")
}

fn profile(qos: &Qos, version: Version) -> String {
    let word = |named: (&str, u8)| match version {
        Version::V9 => format!(" {}", named.0),
        Version::V5 => format!(" {}", named.1),
    };
    let depth = match qos.history {
        History::KeepLast(depth) => depth,
        History::KeepAll => 0,
    };
    let mut text = format!("- history:{}\n  depth: {depth}", word(history(qos.history)));
    let mut line = |key: &str, value: &str| {
        write!(text, "\n  {key}:{value}").expect("writing to a string never fails");
    };
    line("reliability", &word(reliability(qos.reliability)));
    line("durability", &word(durability(qos.durability)));
    line("deadline", &duration(qos.deadline));
    line("lifespan", &duration(qos.lifespan));
    line("liveliness", &word(liveliness(qos.liveliness)));
    line("liveliness_lease_duration", &duration(qos.liveliness_lease));
    line("avoid_ros_namespace_conventions", " false");
    text
}

/// The names used by rosbag2 and the numbers of `rmw/types.h`.
fn history(history: History) -> (&'static str, u8) {
    match history {
        History::KeepLast(_) => ("keep_last", 1),
        History::KeepAll => ("keep_all", 2),
    }
}

fn reliability(reliability: Reliability) -> (&'static str, u8) {
    match reliability {
        Reliability::Reliable => ("reliable", 1),
        Reliability::BestEffort => ("best_effort", 2),
    }
}

fn durability(durability: Durability) -> (&'static str, u8) {
    match durability {
        Durability::TransientLocal => ("transient_local", 1),
        Durability::Volatile => ("volatile", 2),
    }
}

fn liveliness(liveliness: Liveliness) -> (&'static str, u8) {
    match liveliness {
        Liveliness::Automatic => ("automatic", 1),
        Liveliness::ManualByTopic => ("manual_by_topic", 3),
    }
}

fn duration(limit: Option<Duration>) -> String {
    let nanos = limit.map_or(INFINITE_NANOS, |limit| {
        u64::try_from(limit.as_nanos()).map_or(INFINITE_NANOS, |nanos| nanos.min(INFINITE_NANOS))
    });
    format!("\n    sec: {}\n    nsec: {}", nanos / NANOS_PER_SEC, nanos % NANOS_PER_SEC)
}

/// Parses profiles of any version; unknown entries get ROS 2's defaults.
pub(crate) fn read(text: &str) -> Vec<Qos> {
    let mut profiles = Vec::new();
    let mut limit = Limit::default();
    for line in text.lines() {
        let (begins, line) = match line.trim_start().strip_prefix("- ") {
            Some(rest) => (true, rest),
            None => (false, line),
        };
        if begins {
            profiles.push(Qos::reliable(10));
        }
        let (Some(qos), Some((key, value))) = (profiles.last_mut(), line.split_once(':')) else {
            continue;
        };
        read_field(qos, &mut limit, key.trim(), value.trim());
    }
    profiles
}

/// The duration that is being parsed.
#[derive(Default)]
struct Limit {
    of: String,
    secs: u64,
}

fn read_field(qos: &mut Qos, limit: &mut Limit, key: &str, value: &str) {
    match (key, value) {
        ("history", "keep_all" | "2") => qos.history = History::KeepAll,
        ("depth", depth) => {
            if let (History::KeepLast(known), Ok(depth)) = (&mut qos.history, depth.parse()) {
                *known = depth;
            }
        }
        ("reliability", "best_effort" | "2") => qos.reliability = Reliability::BestEffort,
        ("durability", "transient_local" | "1") => qos.durability = Durability::TransientLocal,
        ("liveliness", "manual_by_topic" | "3") => qos.liveliness = Liveliness::ManualByTopic,
        ("deadline" | "lifespan" | "liveliness_lease_duration", _) => key.clone_into(&mut limit.of),
        ("sec", secs) => limit.secs = secs.parse().unwrap_or(INFINITE_NANOS),
        ("nsec", nanos) => {
            let read = finite(limit.secs, nanos.parse().unwrap_or(0));
            match limit.of.as_str() {
                "deadline" => qos.deadline = read,
                "lifespan" => qos.lifespan = read,
                "liveliness_lease_duration" => qos.liveliness_lease = read,
                _ => {}
            }
        }
        _ => {}
    }
}

/// A ROS 2 duration; `None` if it is infinite, or zero, which `rmw` uses for unspecified.
fn finite(secs: u64, nanos: u64) -> Option<Duration> {
    let nanos = secs.saturating_mul(NANOS_PER_SEC).saturating_add(nanos);
    (nanos != 0 && nanos < INFINITE_NANOS).then(|| Duration::from_nanos(nanos))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_come_back_in_every_version() {
        let mut odd = Qos::best_effort(7);
        odd.deadline = Some(Duration::from_millis(1500));
        odd.liveliness = Liveliness::ManualByTopic;
        odd.liveliness_lease = Some(Duration::from_nanos(1));
        let all = Qos { history: History::KeepAll, ..Qos::reliable(0) };
        let profiles = [Qos::latched(3), odd, all];
        for version in [Version::V5, Version::V9] {
            assert_eq!(read(&write(&profiles, version)), profiles);
            assert_eq!(read(&write(&[], version)), []);
        }
    }

    #[test]
    fn a_profile_reads_as_rosbag2_writes_it() {
        insta::assert_snapshot!(write(&[Qos::latched(3)], Version::V9), @r"
        - history: keep_last
          depth: 3
          reliability: reliable
          durability: transient_local
          deadline:
            sec: 9223372036
            nsec: 854775807
          lifespan:
            sec: 9223372036
            nsec: 854775807
          liveliness: automatic
          liveliness_lease_duration:
            sec: 9223372036
            nsec: 854775807
          avoid_ros_namespace_conventions: false
        ");
    }
}
