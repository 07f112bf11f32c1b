//! A robot as one line: the last of each figure that matters at a glance.

use std::collections::BTreeMap;

use teampulse_core::data::FeatureValues;
use teampulse_core::stream::Stream;

/// The figures that are shown of a robot, the most important first, and how each is written.
const FIGURES: &[(&str, Write)] = &[
    ("online", |online| Some(if online > 0.0 { "online" } else { "OFFLINE" }.into())),
    ("deployed_secs", |secs| Some(format!("deployed {}", hours_and_minutes(secs)))),
    ("power_w", |power_w| Some(format!("{power_w:.1} W"))),
    ("empty_in_secs", |secs| Some(format!("empty in {}", about(secs)))),
    ("level", diagnosis),
    ("rssi_median", |rssi_dbm| Some(format!("{rssi_dbm:.0} dBm"))),
    ("percent_per_min", |percent| Some(format!("{percent:.1} %/min"))),
];

/// How many of them hold for a robot that is offline.
const KNOWN_OFFLINE: usize = 2;

/// Writes a figure; `None` where it is not worth a word.
type Write = fn(f64) -> Option<String>;

/// The last figures of a robot: of each channel, what each stream says.
#[derive(Debug, Default)]
pub(super) struct Figures(BTreeMap<&'static str, BTreeMap<String, f64>>);

impl Figures {
    /// Takes those values of a feature that are shown.
    pub fn take(&mut self, stream: &Stream, values: &FeatureValues) {
        for (channel, value) in stream.channels.iter().zip(&values.values) {
            if let Some((name, _)) = FIGURES.iter().find(|(name, _)| name == channel) {
                self.0.entry(name).or_default().insert(stream.name.clone(), *value);
            }
        }
    }

    /// The robot's line. Of one that is offline only how long it was deployed is said: the rest
    /// is no longer known.
    pub fn line(&self, id: &str) -> String {
        let known = if self.last("online") == Some(0.0) { KNOWN_OFFLINE } else { FIGURES.len() };
        let figures = FIGURES[..known].iter().filter_map(|(name, write)| write(self.last(name)?));
        let parts: Vec<_> = std::iter::once(id.to_owned()).chain(figures).collect();
        parts.join("  ")
    }

    /// What is known of a channel: the worst level, otherwise the first window that has a value.
    fn last(&self, channel: &str) -> Option<f64> {
        let values = self.0.get(channel)?.values().copied();
        let mut known = values.filter(|value| value.is_finite());
        if channel == "level" { known.reduce(f64::max) } else { known.next() }
    }
}

/// The worst level of the diagnostics, where that is not "ok".
fn diagnosis(level: f64) -> Option<String> {
    let word = match level as u8 {
        0 => return None,
        1 => "warn",
        2 => "error",
        _ => "stale",
    };
    Some(format!("diag {word}"))
}

/// A duration as `m:ss`, from an hour on as `h:mm:ss`.
fn hours_and_minutes(secs: f64) -> String {
    let secs = secs as u64;
    let (hours, minutes, secs) = (secs / 3600, secs / 60 % 60, secs % 60);
    match hours {
        0 => format!("{minutes}:{secs:02}"),
        _ => format!("{hours}:{minutes:02}:{secs:02}"),
    }
}

/// A duration as people say it: in minutes, from ten hours on in hours.
fn about(secs: f64) -> String {
    let minutes = secs / 60.0;
    if minutes < 600.0 { format!("{minutes:.0} min") } else { format!("{:.0} h", minutes / 60.0) }
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Shape, Subject};

    use super::*;

    fn line(figures: &[(&str, &str, f64)]) -> String {
        let mut robot = Figures::default();
        for (name, channel, value) in figures {
            let stream = Stream::raw(*name, Subject::robot("robot1"), Shape::Feature);
            let values = FeatureValues {
                window_secs: 0.0,
                coverage: 1.0,
                quality: 1.0,
                values: vec![*value],
                sigmas: Vec::new(),
                reasons: Vec::new(),
            };
            robot.take(&stream.with_channels(&[(channel, "1")]), &values);
        }
        robot.line("robot1")
    }

    #[test]
    fn all_that_is_urgent_fits_80_columns() {
        let line = line(&[
            ("/d", "online", 1.0),
            ("/d", "deployed_secs", 725.0),
            ("/b", "power_w", 123.4),
            ("/b", "empty_in_secs", 3120.0),
            ("/b", "percent_per_min", 0.8),
            ("/l", "rssi_median", -61.2),
            ("/v", "level", 2.0),
        ]);
        insta::assert_snapshot!(line, @"robot1  online  deployed 12:05  123.4 W  empty in 52 min  diag error  -61 dBm  0.8 %/min");
        assert!(line.find("dBm").is_some_and(|at| at + 3 < 80));
    }

    #[test]
    fn of_a_robot_that_is_offline_no_old_figure_is_shown() {
        let offline = line(&[("/d", "online", 0.0), ("/b", "power_w", 14.0)]);
        assert_eq!(offline, "robot1  OFFLINE");
    }

    #[test]
    fn the_worst_of_several_diagnostics_is_shown_and_none_that_is_ok() {
        assert_eq!(line(&[("/a", "level", 1.0), ("/b", "level", 0.0)]), "robot1  diag warn");
        assert_eq!(line(&[("/a", "level", 0.0)]), "robot1");
    }

    #[test]
    fn a_figure_is_of_the_first_window_that_has_it() {
        let windows =
            |short, long| line(&[("/b/w30", "power_w", short), ("/b/w60", "power_w", long)]);
        assert_eq!(windows(20.0, 30.0), "robot1  20.0 W");
        assert_eq!(windows(f64::NAN, 30.0), "robot1  30.0 W");
    }

    #[test]
    fn what_is_not_known_is_not_shown() {
        assert_eq!(line(&[("/b", "empty_in_secs", f64::NAN)]), "robot1");
    }

    #[test]
    fn long_deployments_are_told_in_hours() {
        assert_eq!(hours_and_minutes(3725.9), "1:02:05");
        assert_eq!(about(50_000.0), "14 h");
    }
}
