//! Alerts that a robot or a person needs attention, as events: formatted and parsed.

use std::cmp::Ordering;
use std::fmt;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::stream::{Origin, Shape, Stream};

/// The topic of alerts about robots, the team and the session.
pub const ALERTS: &str = "/team/alerts";

/// The family of alert streams. Alerts about a person have their own stream, which is as private as everything else
/// about that person; alerts on estimates belong to the family of estimates.
pub const FAMILY: &str = "alerts";

/// Whether a stream holds alerts.
pub fn holds_alerts(stream: &Stream) -> bool {
    let is_concluded = stream.origin == Origin::Derived && stream.shape == Shape::Event;
    stream.name == ALERTS || is_concluded && matches!(&*stream.family, FAMILY | "estimates")
}

/// A report that a robot or a person needs someone, or no longer does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Alert {
    /// The name of the robot or the person, one word; `team` or `session` if the alert is about neither.
    pub who: String,
    /// The reason.
    pub why: Why,
    /// The state of the alert.
    pub stage: Stage,
    /// The urgency, if the study states it. The label shows it while the alert is raised; [`Tier::Note`] also shows
    /// once the alert is unknown or over.
    pub tier: Option<Tier>,
}

/// How urgent an alert is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Tier {
    /// Act now.
    Act,
    /// Act soon.
    #[default]
    Soon,
    /// For information: nobody has to act.
    Note,
}

impl Tier {
    const ALL: [Tier; 3] = [Tier::Act, Tier::Soon, Tier::Note];

    /// The word for this tier in a study.
    pub fn word(self) -> &'static str {
        match self {
            Tier::Act => "act",
            Tier::Soon => "soon",
            Tier::Note => "note",
        }
    }
}

/// Why a robot or a person needs someone; ordered by the displayed text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Why {
    /// Nothing arrives from the robot or the person.
    Offline,
    /// The sensor with this name repeats the same values.
    Stuck(String),
    /// The robot's diagnostics report an error.
    Diagnostics,
    /// A value is beyond its limit, in words: `battery below 20 %`.
    Limit(String),
}

impl Why {
    const OFFLINE: &str = "offline";
    const DIAGNOSTICS: &str = "diagnostics say error";
    const STUCK: &str = " is stuck";
    /// The first words of the reason that a battery will soon be empty.
    pub const EMPTY: &str = "battery empty within";

    fn read(words: &str) -> Why {
        match (words, words.strip_suffix(Why::STUCK)) {
            (Why::OFFLINE, _) => Why::Offline,
            (Why::DIAGNOSTICS, _) => Why::Diagnostics,
            (_, Some(sensor)) => Why::Stuck(sensor.to_owned()),
            (limit, None) => Why::Limit(limit.to_owned()),
        }
    }

    /// The default urgency for this reason.
    pub fn tier(&self) -> Tier {
        match self {
            Why::Offline | Why::Diagnostics => Tier::Act,
            Why::Limit(words) if words.starts_with(Why::EMPTY) => Tier::Act,
            Why::Stuck(_) | Why::Limit(_) => Tier::Soon,
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
    /// Someone is needed.
    Raised,
    /// A person has commanded the robot since the alert was raised.
    Answered,
    /// Whether someone is still needed is unknown, as no value has arrived for too long.
    Unknown,
    /// The alert is over.
    Over,
}

impl Stage {
    const ALL: [Stage; 4] = [Stage::Raised, Stage::Answered, Stage::Unknown, Stage::Over];

    /// The machine-readable word for this stage.
    pub fn word(self) -> &'static str {
        match self {
            Stage::Raised => "raised",
            Stage::Answered => "answered",
            Stage::Unknown => "unknown",
            Stage::Over => "over",
        }
    }

    /// The phrase for this stage in a label; `tier` is `None` if the label does not state it.
    fn words(self, tier: Option<Tier>) -> &'static str {
        match (self, tier) {
            (Stage::Raised, None) => " needs someone: ",
            (Stage::Raised, Some(Tier::Act)) => " needs someone now: ",
            (Stage::Raised, Some(Tier::Soon)) => " needs someone soon: ",
            (Stage::Raised, Some(Tier::Note)) => " is worth a look: ",
            (Stage::Answered, _) => " was answered: ",
            (Stage::Unknown, Some(Tier::Note)) => " may still be worth a look, no value comes: ",
            (Stage::Unknown, _) => " may still need someone, no value comes: ",
            (Stage::Over, Some(Tier::Note)) => " is no longer worth a look: ",
            (Stage::Over, _) => " no longer needs someone: ",
        }
    }

    /// Whether labels at this stage state the tier.
    fn states(self, tier: Tier) -> bool {
        self.words(Some(tier)) != self.words(None)
    }
}

impl Alert {
    /// The label of the alert's event: `robot2 needs someone: offline`.
    pub fn label(&self) -> String {
        format!("{}{}{}", self.who, self.stage.words(self.tier), self.why)
    }

    /// Parses the label of an alert; `None` for any other text.
    pub fn read(label: &str) -> Option<Alert> {
        let mut kinds = Stage::ALL.into_iter().flat_map(|stage| {
            let stated = Tier::ALL.into_iter().filter(move |&tier| stage.states(tier));
            stated.map(Some).chain([None]).map(move |tier| (stage, tier))
        });
        // One phrase may be the end of another, so `who` must be a single word.
        kinds.find_map(|(stage, tier)| {
            let (who, why) = label.split_once(stage.words(tier))?;
            let is_word = !who.is_empty() && !who.contains(' ');
            is_word.then(|| Alert { who: who.to_owned(), why: Why::read(why), stage, tier })
        })
    }

    /// The urgency stated by the study, or else the default for the reason.
    pub fn urgency(&self) -> Tier {
        self.tier.unwrap_or_else(|| self.why.tier())
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
                let alert = Alert { who: "robot2".to_owned(), why, stage, tier: None };
                assert_eq!(Alert::read(&alert.label()), Some(alert));
            }
        }
        for tier in Tier::ALL {
            let why = Why::Limit("too hot: now (temperature above 38 degC)".to_owned());
            let (who, tier) = ("p001".to_owned(), Some(tier));
            let alert = Alert { who, why, stage: Stage::Raised, tier };
            assert_eq!(Alert::read(&alert.label()), Some(alert.clone()));
            let over = Alert { stage: Stage::Over, ..alert };
            let tier = over.tier.filter(|&tier| tier == Tier::Note);
            assert_eq!(Alert::read(&over.label()), Some(Alert { tier, ..over }));
        }
        assert_eq!(Alert::read("robot2 offline"), None);
    }
}
