//! Alerts that a robot needs attention, as events: formatted and parsed.

use std::cmp::Ordering;
use std::fmt;

/// The topic of alerts.
pub const ALERTS: &str = "/team/alerts";

/// A robot needs someone, or no longer does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Alert {
    /// The robot.
    pub robot: String,
    /// Why.
    pub why: Why,
    /// The state of the alert.
    pub stage: Stage,
}

/// Why a robot needs someone; in the order of its words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Why {
    /// It is silent.
    Offline,
    /// A sensor of this name repeats itself.
    Stuck(String),
    /// Its diagnostics report an error.
    Diagnostics,
    /// A number is beyond its limit, in words: `battery below 20 %`.
    Limit(String),
}

impl Why {
    const OFFLINE: &str = "offline";
    const DIAGNOSTICS: &str = "diagnostics say error";
    const STUCK: &str = " is stuck";

    fn read(words: &str) -> Why {
        match (words, words.strip_suffix(Why::STUCK)) {
            (Why::OFFLINE, _) => Why::Offline,
            (Why::DIAGNOSTICS, _) => Why::Diagnostics,
            (_, Some(sensor)) => Why::Stuck(sensor.to_owned()),
            (limit, None) => Why::Limit(limit.to_owned()),
        }
    }
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Why::Offline => f.write_str(Why::OFFLINE),
            Why::Diagnostics => f.write_str(Why::DIAGNOSTICS),
            Why::Stuck(sensor) => write!(f, "{sensor}{}", Why::STUCK),
            Why::Limit(words) => f.write_str(words),
        }
    }
}

impl Ord for Why {
    fn cmp(&self, other: &Why) -> Ordering {
        self.to_string().cmp(&other.to_string())
    }
}

impl PartialOrd for Why {
    fn partial_cmp(&self, other: &Why) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The state of an alert.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The robot needs someone.
    Raised,
    /// A person has commanded the robot.
    Answered,
    /// The robot no longer needs someone.
    Over,
}

impl Stage {
    const ALL: [Stage; 3] = [Stage::Raised, Stage::Answered, Stage::Over];

    fn words(self) -> &'static str {
        match self {
            Stage::Raised => " needs someone: ",
            Stage::Answered => " was answered: ",
            Stage::Over => " no longer needs someone: ",
        }
    }
}

impl Alert {
    /// As in the label of its event: `robot2 needs someone: offline`.
    pub fn label(&self) -> String {
        format!("{}{}{}", self.robot, self.stage.words(), self.why)
    }

    /// The alert of a label; `None` for any other text.
    pub fn read(label: &str) -> Option<Alert> {
        // One phrase may be the end of another, so the robot is a single word.
        Stage::ALL.into_iter().find_map(|stage| {
            let (robot, why) = label.split_once(stage.words())?;
            let is_robot = !robot.is_empty() && !robot.contains(' ');
            is_robot.then(|| Alert { robot: robot.to_owned(), why: Why::read(why), stage })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alert_reads_as_it_was_reported() {
        for stage in Stage::ALL {
            let reasons = [
                Why::Offline,
                Why::Stuck("wifi".to_owned()),
                Why::Diagnostics,
                Why::Limit("battery below 20 %".to_owned()),
            ];
            for why in reasons {
                let alert = Alert { robot: "robot2".to_owned(), why, stage };
                assert_eq!(Alert::read(&alert.label()), Some(alert));
            }
        }
        assert_eq!(Alert::read("robot2 offline"), None);
    }
}
