//! The alerts of a study: limits on numbers of streams.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::alerts::Tier;
use teampulse_core::pattern::Pattern;
use teampulse_core::registry::SettingsError;
use teampulse_core::stream::{About, Shape, Stream, Subject, Window};

/// The longest time without a value, and the longest time beyond a limit before an alert begins [s]: a day.
const LONGEST_SECS: f64 = 86_400.0;
/// The longest text of an alert [characters].
const LONGEST_TEXT: usize = 120;

/// An alert of the study: someone is needed while a number of a stream is beyond a limit.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Threshold {
    /// The streams whose number is watched, by name; `*` stands for a part of a token. Each of them is watched
    /// separately. Values over phases, which come once per phase, are not watched.
    pub stream: Pattern,
    /// The number, by the name of its channel; not needed if the stream has only one.
    pub channel: Option<String>,
    /// The alert begins above this number, in the stream's own unit. Either this or `below`.
    pub above: Option<f64>,
    /// The alert begins below this number, in the stream's own unit.
    pub below: Option<f64>,
    /// How long the number must be beyond the limit before the alert begins [s]. Default: 0, at once.
    #[serde(default)]
    pub for_secs: f64,
    /// The alert is over when the number is back at this one, so that a number close to the limit does not raise and
    /// clear it repeatedly. Default: the limit.
    pub clear: Option<f64>,
    /// The time without a value after which an alert becomes unknown, and the time beyond the limit is counted from
    /// zero again [s]. It must be longer than the interval between values.
    #[serde(default = "silent_secs")]
    pub silent_secs: f64,
    /// How urgent the alert is: `act`, `soon` or `note`. Default: `soon`.
    #[serde(default)]
    pub tier: Tier,
    /// What the alert means or what to do, in a few words, shown before the number and its limit.
    pub text: Option<String>,
    /// The person that the alert is about: only matching streams about this person or about nobody are watched.
    pub person: Option<String>,
    /// The robot that the alert is about: only matching streams about this robot or about nobody are watched.
    pub robot: Option<String>,
}

fn silent_secs() -> f64 {
    10.0
}

/// The side of a limit on which someone is needed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Limit {
    /// Above a number, until it is back at another one.
    Above(f64, f64),
    /// Below a number, until it is back at another one.
    Below(f64, f64),
}

impl Limit {
    /// Whether a number is beyond the limit.
    pub(crate) fn is_beyond(self, number: f64) -> bool {
        match self {
            Limit::Above(limit, _) => number > limit,
            Limit::Below(limit, _) => number < limit,
        }
    }

    /// Whether a number has come back far enough for the alert to end.
    pub(crate) fn is_back(self, number: f64) -> bool {
        match self {
            Limit::Above(_, clear) => number <= clear,
            Limit::Below(_, clear) => number >= clear,
        }
    }
}

impl Threshold {
    /// The limit; `None` without exactly one.
    pub(crate) fn limit(&self) -> Option<Limit> {
        match (self.above, self.below) {
            (Some(above), None) => Some(Limit::Above(above, self.clear.unwrap_or(above))),
            (None, Some(below)) => Some(Limit::Below(below, self.clear.unwrap_or(below))),
            _ => None,
        }
    }

    /// The index of the watched number among the channels of a stream; `None` for a stream that the alert does not
    /// watch.
    pub fn place_in(&self, stream: &Stream) -> Option<usize> {
        let has_numbers =
            !matches!(stream.shape, Shape::Event | Shape::Status | Shape::Description);
        let is_watched = has_numbers && stream.window != Some(Window::Phases);
        if !is_watched || !self.stream.matches(&stream.name) || self.about(stream).is_none() {
            return None;
        }
        match &self.channel {
            Some(channel) => stream.place_of(channel),
            None => (stream.channels.len() == 1).then_some(0),
        }
    }

    /// Who needs someone when a stream is beyond the limit; `None` for a stream about somebody else.
    pub(crate) fn about(&self, stream: &Stream) -> Option<Subject> {
        let own = stream.subject();
        let named = match (&self.person, &self.robot) {
            (Some(id), _) => Subject { about: About::Person, id: id.clone() },
            (None, Some(id)) => Subject::robot(id.clone()),
            (None, None) => return Some(own),
        };
        let is_nobodys = matches!(own.about, About::Team | About::Session);
        (is_nobodys || own == named).then_some(named)
    }

    /// The reason given by alerts on a stream: the text of the study, the number with its limit and unit.
    pub(crate) fn reason(&self, stream: &Stream, place: usize) -> String {
        let channel = &stream.channels[place];
        let (side, limit) = match self.limit() {
            Some(Limit::Below(limit, _)) => ("below", limit),
            Some(Limit::Above(limit, _)) => ("above", limit),
            None => ("beyond", f64::NAN),
        };
        let unit =
            if matches!(&*channel.unit, "" | "1") { "" } else { &format!(" {}", channel.unit) };
        let lasting = if self.for_secs > 0.0 { &format!(" for {} s", self.for_secs) } else { "" };
        let number = format!("{side} {limit}{unit}{lasting}");
        let within = stream.subject().within(stream.windowless_name()).to_owned();
        match &self.text {
            Some(text) => format!("{text} ({} {number})", channel.name),
            None => format!("{} of {within} {number}", channel.name),
        }
    }

    /// Fails if the alert is invalid, with the setting as the path of the error.
    fn check(&self) -> Result<(), SettingsError> {
        self.check_limit()?;
        self.check_times()?;
        self.check_subject()?;
        let is_plain = |text: &String| {
            let length = text.chars().count();
            (1..=LONGEST_TEXT).contains(&length) && !text.contains(char::is_control)
        };
        if self.text.as_ref().is_some_and(|text| !is_plain(text)) {
            let message =
                format!("`text` has no characters, more than {LONGEST_TEXT}, or several lines");
            return wrong("text", message, "say in a few words what it means or what to do");
        }
        Ok(())
    }

    fn check_limit(&self) -> Result<(), SettingsError> {
        const EITHER: &str = "give either `above` or `below`; for both sides write two [[alerts]]";
        let Some(limit) = self.limit() else {
            return match self.above {
                Some(_) => wrong("below", "an alert has two limits", EITHER),
                None => wrong("", "an alert has no limit", EITHER),
            };
        };
        let numbers = [("above", self.above), ("below", self.below), ("clear", self.clear)];
        let odd = |number: Option<f64>| number.is_some_and(|number| !number.is_finite());
        if let Some((key, _)) = numbers.into_iter().find(|(_, number)| odd(*number)) {
            let message = format!("`{key}` is not a number");
            return wrong(key, message, "give it in the stream's own unit");
        }
        let (is_right, side) = match limit {
            Limit::Above(limit, clear) => (clear <= limit, "at most as large as `above`"),
            Limit::Below(limit, clear) => (clear >= limit, "at least as large as `below`"),
        };
        if !is_right {
            let message = format!("`clear` is beyond the limit: expected a number {side}");
            return wrong("clear", message, "the alert ends once the value is back at `clear`");
        }
        Ok(())
    }

    fn check_times(&self) -> Result<(), SettingsError> {
        const SECONDS: &str = "give a length of time in seconds";
        let Threshold { for_secs, silent_secs, .. } = self;
        if !(0.0..=LONGEST_SECS).contains(for_secs) {
            let message = format!("`for_secs` is {for_secs}: expected 0 to {LONGEST_SECS}");
            return wrong("for_secs", message, SECONDS);
        }
        if !(*silent_secs > 0.0 && *silent_secs <= LONGEST_SECS) {
            let message = format!(
                "`silent_secs` is {silent_secs}: expected more than 0 and at most {LONGEST_SECS}"
            );
            return wrong("silent_secs", message, SECONDS);
        }
        Ok(())
    }

    fn check_subject(&self) -> Result<(), SettingsError> {
        if self.person.is_some() && self.robot.is_some() {
            let hint =
                "name one of them, or neither: by default it is about the subject of the stream";
            return wrong("robot", "an alert is about a person and a robot", hint);
        }
        let is_id = |id: &String| {
            !id.is_empty() && !id.contains(|each: char| each.is_whitespace() || each == '/')
        };
        for (key, id) in [("person", &self.person), ("robot", &self.robot)] {
            if id.as_ref().is_some_and(|id| !is_id(id)) {
                return wrong(key, format!("`{key}` is not an id"), "give one like p001 or robot2");
            }
        }
        Ok(())
    }
}

fn wrong(key: &str, message: impl Into<String>, hint: &str) -> Result<(), SettingsError> {
    Err(SettingsError::new(message).with_hint(hint).at(key))
}

/// Fails at the first alert that is invalid; the path starts at the alerts: `2.clear`.
pub fn check(alerts: &[Threshold]) -> Result<(), SettingsError> {
    for (place, alert) in alerts.iter().enumerate() {
        alert.check().map_err(|error| {
            let path = format!("{place}.{}", error.path);
            error.at(path.trim_end_matches('.'))
        })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn threshold(settings: &str) -> Threshold {
        toml::from_str(&format!("stream = \"/**\"\n{settings}")).expect("settings that read")
    }

    fn wrong(settings: &str) -> SettingsError {
        check(&[threshold("above = 1"), threshold(settings)]).expect_err(settings)
    }

    #[test]
    fn what_makes_no_alert_is_refused_at_its_setting() {
        for (settings, path) in [
            ("", "1"),
            ("above = 1\nbelow = 0", "1.below"),
            ("above = inf", "1.above"),
            ("above = 1\nclear = 2", "1.clear"),
            ("below = 1\nclear = 0.5", "1.clear"),
            ("above = 1\nclear = nan", "1.clear"),
            ("above = 1\nfor_secs = -1", "1.for_secs"),
            ("above = 1\nsilent_secs = 0", "1.silent_secs"),
            ("above = 1\nperson = \"p1\"\nrobot = \"r1\"", "1.robot"),
            ("above = 1\nrobot = \"r 1\"", "1.robot"),
            ("above = 1\ntext = \"\"", "1.text"),
            ("above = 1\ntext = \"a\\nb\"", "1.text"),
        ] {
            let error = wrong(settings);
            assert_eq!(error.path, path, "{settings}");
            assert!(!error.hint.is_empty(), "{settings}");
        }
        check(&[threshold("below = 20\nclear = 25\nfor_secs = 3\ntier = \"act\"")]).unwrap();
    }

    #[test]
    fn only_streams_with_the_number_and_of_whom_it_is_about_are_watched() {
        let arm = Stream::raw("/r1/arm", Subject::robot("r1"), Shape::Sample)
            .with_channels(&[("effort", "N m"), ("speed", "1/s")]);
        assert_eq!(threshold("above = 1\nchannel = \"speed\"").place_in(&arm), Some(1));
        assert_eq!(threshold("above = 1\nchannel = \"power\"").place_in(&arm), None);
        assert_eq!(threshold("above = 1").place_in(&arm), None, "which of both?");
        let of = |who: &str| threshold(&format!("above = 1\nchannel = \"speed\"\n{who}"));
        assert_eq!(of("robot = \"r1\"").place_in(&arm), Some(1));
        assert_eq!(of("robot = \"r2\"").place_in(&arm), None);
        let session = Stream { about: About::Session, id: String::new(), ..arm.clone() };
        let about = of("person = \"p001\"").about(&session).unwrap();
        assert_eq!((about.about, &*about.id), (About::Person, "p001"));
        assert_eq!(of("").place_in(&arm.over(Window::Phases)), None);
    }

    #[test]
    fn a_reason_has_the_number_its_limit_and_its_unit() {
        let arm = Stream::raw("/r1/arm", Subject::robot("r1"), Shape::Sample)
            .with_channels(&[("effort", "N m"), ("load", "1")]);
        let reason = |settings: &str, place| threshold(settings).reason(&arm, place);
        assert_eq!(reason("above = 2.5\nfor_secs = 3", 0), "effort of arm above 2.5 N m for 3 s");
        assert_eq!(reason("below = 0\ntext = \"let go\"", 1), "let go (load below 0)");
    }
}
