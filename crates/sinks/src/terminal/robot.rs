//! The line of a robot: the newest value of each figure.

use std::collections::BTreeMap;

use teampulse_core::data::FeatureValues;
use teampulse_core::stream::Stream;
use teampulse_core::time::Time;

use super::format::{clock, minutes};
use super::styled_line::{Style, StyledLine};

/// The figures shown of a robot: their channels, formats and widths [columns].
const FIGURES: &[(&str, Write, usize)] = &[
    ("power_w", |power_w| Some(format!("{power_w:.1} W")), 7),
    ("empty_in_secs", |secs| Some(format!("lasts {}", minutes(secs))), 13),
    ("rssi_median", |rssi_dbm| Some(format!("{rssi_dbm:.0} dBm").replace('-', "−")), 7),
    ("level", diagnosis, 10),
];

/// The channels that state whether, and for how long, a robot has been online.
const ONLINE: &str = "online";
const DEPLOYED: &str = "deployed_secs";

/// The age above which a figure is no longer current [s].
const OLD_SECS: f64 = 10.0;

/// Formats a figure; `None` if it is not worth showing.
type Write = fn(f64) -> Option<String>;

/// The newest figures of a robot: for each channel the value of each stream, with its time.
#[derive(Debug, Default)]
pub(super) struct Figures(BTreeMap<&'static str, BTreeMap<String, (f64, Time)>>);

impl Figures {
    /// Takes those values of a feature that are shown.
    pub fn take(&mut self, stream: &Stream, values: &FeatureValues, at: Time) {
        let names = || FIGURES.iter().map(|(name, _, _)| *name).chain([ONLINE, DEPLOYED]);
        for (channel, value) in stream.channels.iter().zip(&values.values) {
            if let Some(name) = names().find(|name| *name == channel.name) {
                self.0.entry(name).or_default().insert(stream.name.clone(), (*value, at));
            }
        }
    }

    /// Whether the robot was online and no longer is.
    pub fn is_offline(&self) -> bool {
        self.last(ONLINE).is_some_and(|(online, _)| online == 0.0)
    }

    /// The robot's line, aligned with the lines of other robots. While the robot is offline, only the duration of its
    /// deployment is shown, as the rest is no longer known.
    pub fn line(&self, id: &str, id_columns: usize, now: Time) -> StyledLine {
        let state = match self.last(ONLINE) {
            Some((online, _)) if online > 0.0 => StyledLine::of(Style::Plain, "online "),
            Some(_) => StyledLine::of(Style::Strong, "OFFLINE"),
            None => StyledLine::of(Style::Grey, "?      "),
        };
        let deployed = self.last(DEPLOYED).map(|(secs, _)| clock(secs)).unwrap_or_default();
        let line = StyledLine::of(Style::Strong, &format!("{id:<id_columns$}  "));
        let mut line = line.with_line(state).with(Style::Plain, &format!(" {deployed:>7}"));
        if self.is_offline() {
            return line;
        }
        for (name, write, columns) in FIGURES {
            let known = self.last(name);
            let is_old = known.is_some_and(|(_, at)| now.secs_since(at) > OLD_SECS);
            let written = known.and_then(|(value, _)| write(value)).unwrap_or_default();
            let style = match (is_old, *name) {
                (true, _) => Style::Grey,
                (false, "level") => Style::Warning,
                (false, _) => Style::Plain,
            };
            line.add(style, &format!("  {written:>columns$}"));
        }
        line
    }

    /// The newest value of a channel and its time: for the level the worst value, for other channels the value of the
    /// first window that has one.
    fn last(&self, channel: &str) -> Option<(f64, Time)> {
        let values = self.0.get(channel)?.values().copied();
        let mut known = values.filter(|(value, _)| value.is_finite());
        if channel == "level" {
            known.max_by(|(a, _), (b, _)| a.total_cmp(b))
        } else {
            known.next()
        }
    }
}

/// The worst level of the diagnostics, unless it is "ok".
fn diagnosis(level: f64) -> Option<String> {
    let word = match level as u8 {
        0 => return None,
        1 => "warn",
        2 => "error",
        _ => "stale",
    };
    Some(format!("diag {word}"))
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Shape, Subject};

    use super::*;

    fn line(figures: &[(&str, &str, f64)]) -> StyledLine {
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
            let at = Time::from_stamp(100, 0);
            robot.take(&stream.with_channels(&[(channel, "1")]), &values, at);
        }
        robot.line("robot1", 6, Time::from_stamp(101, 0))
    }

    #[test]
    fn all_that_is_urgent_fits_80_columns() {
        let line = line(&[
            ("/d", "online", 1.0),
            ("/d", "deployed_secs", 725.0),
            ("/b", "power_w", 123.4),
            ("/b", "empty_in_secs", 3120.0),
            ("/l", "rssi_median", -61.2),
            ("/v", "level", 2.0),
        ]);
        insta::assert_snapshot!(line.text(), @"robot1  online    12:05  123.4 W   lasts 52 min  −61 dBm  diag error");
        assert!(line.width() <= 70);
    }

    #[test]
    fn of_a_robot_that_is_offline_no_old_figure_is_shown() {
        let offline = line(&[("/d", "online", 0.0), ("/b", "power_w", 14.0)]);
        assert_eq!(offline.text(), "robot1  OFFLINE");
    }

    #[test]
    fn the_worst_of_several_diagnostics_is_shown_and_none_that_is_ok() {
        let warned = line(&[("/a", "level", 1.0), ("/b", "level", 0.0)]).text();
        assert!(warned.ends_with("diag warn"), "{warned}");
        assert!(!line(&[("/a", "level", 0.0)]).text().contains("diag"));
    }

    #[test]
    fn a_figure_is_of_the_first_window_that_has_it() {
        let windows =
            |short, long| line(&[("/b/w30", "power_w", short), ("/b/w60", "power_w", long)]).text();
        assert!(windows(20.0, 30.0).ends_with("20.0 W"));
        assert!(windows(f64::NAN, 30.0).ends_with("30.0 W"));
    }

    #[test]
    fn what_is_not_known_is_not_shown() {
        assert_eq!(line(&[("/b", "empty_in_secs", f64::NAN)]).text(), "robot1  ?");
    }
}
