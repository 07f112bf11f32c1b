//! Signs in a robot's features that it needs someone.

use std::fmt;

use teampulse_core::alerts::Why;
use teampulse_core::data::{Data, Event, EventKind, FeatureValues, Reason};
use teampulse_core::stream::{About, Origin, Shape, Signal, Stream};

use super::alerts::Said;
use crate::robots::{deployment, stuck};

/// The hysteresis of a limit, as a share of it.
const CLEARLY: f64 = 0.1;
/// The lowest level of diagnostics that is an error.
const ERROR_LEVEL: f64 = 2.0;

/// The limits beyond which a robot needs someone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// The share of its charge below which a battery is low [0..1].
    pub(super) low_battery: f64,
    /// The robot needs someone if its battery will be empty within this time [s].
    pub(super) empty_in_secs: f64,
    /// The quality below which a link is poor [0..1].
    pub(super) poor_link: f64,
}

impl fmt::Display for Limits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Limits { low_battery, empty_in_secs, poor_link } = *self;
        write!(
            f,
            "a robot needs someone while it is offline, a sensor is stuck, its diagnostics say error, \
             its battery is below {low_battery} or empty in {empty_in_secs} s, or the quality of its \
             link is below {poor_link}; limits are left behind by a tenth"
        )
    }
}

/// One reason why a robot may need someone, as one stream indicates it.
#[derive(Clone, Debug)]
pub(super) struct Sign {
    why: Why,
    indication: Indication,
}

/// The kind of indication.
#[derive(Clone, Copy, Debug)]
enum Indication {
    /// A fault starts it, and a marker ends it.
    ByEvents,
    /// A number below a limit.
    Below { channel: usize, limit: f64 },
    /// A level of at least an error.
    AsError { channel: usize },
}

impl Sign {
    /// The signs in a stream; none unless it was derived about a robot.
    pub(super) fn of(stream: &Stream, limits: &Limits) -> Vec<Sign> {
        if stream.about != About::Robot || stream.origin != Origin::Derived {
            return Vec::new();
        }
        match stream.shape {
            Shape::Event => by_events(stream).into_iter().collect(),
            Shape::Feature => by_numbers(stream, limits),
            _ => Vec::new(),
        }
    }

    /// The reason.
    pub(super) fn why(&self) -> &Why {
        &self.why
    }

    /// The result of a sample; `None` for no change.
    pub(super) fn read(&self, data: &Data) -> Option<Said> {
        match (self.indication, data) {
            (Indication::ByEvents, Data::Event(event)) => by_kind(event),
            (Indication::Below { channel, limit }, Data::Feature(values)) => {
                below(values, channel, limit)
            }
            (Indication::AsError { channel }, Data::Feature(values)) => {
                let level = *values.values.get(channel)?;
                let said = if level >= ERROR_LEVEL { Said::Needs(f64::NAN) } else { Said::Fine };
                level.is_finite().then_some(said)
            }
            _ => None,
        }
    }
}

fn by_kind(event: &Event) -> Option<Said> {
    match event.kind {
        EventKind::Fault => Some(Said::Needs(f64::NAN)),
        EventKind::Marker => Some(Said::Fine),
        _ => None,
    }
}

/// The result of a number with a lower limit. An undefined one, such as the time until a charging
/// battery is empty, is not a reason for an alert.
fn below(values: &FeatureValues, channel: usize, limit: f64) -> Option<Said> {
    let number = *values.values.get(channel)?;
    match values.reasons.get(channel)? {
        Reason::Ok if number < limit => Some(Said::Needs(f64::NAN)),
        Reason::Ok if number >= limit * (1.0 + CLEARLY) => Some(Said::Fine),
        Reason::Undefined => Some(Said::Fine),
        _ => None,
    }
}

fn by_events(stream: &Stream) -> Option<Sign> {
    let why = match (stream.family.as_str(), stream.inputs.first()) {
        (deployment::FAMILY, _) => Why::Offline,
        (stuck::FAMILY, Some(input)) => Why::Stuck(stream.subject().within(input).to_owned()),
        _ => return None,
    };
    Some(Sign { why, indication: Indication::ByEvents })
}

fn by_numbers(stream: &Stream, limits: &Limits) -> Vec<Sign> {
    let signs = stream.channels.iter().enumerate().filter_map(|(channel, of)| {
        let Limits { low_battery, empty_in_secs, poor_link } = *limits;
        let below = |limit| Indication::Below { channel, limit };
        let (why, indication) = match (stream.signal, of.name.as_str()) {
            (Signal::Battery, "fraction_left") => {
                let words = format!("battery below {:.0} %", 100.0 * low_battery);
                (Why::Limit(words), below(low_battery))
            }
            (Signal::Battery, "empty_in_secs") => {
                let words = format!("{} {:.0} min", Why::EMPTY, empty_in_secs / 60.0);
                (Why::Limit(words), below(empty_in_secs))
            }
            (Signal::Link, "quality") => (Why::Limit("poor link".to_owned()), below(poor_link)),
            (Signal::Diagnostics, "level") => (Why::Diagnostics, Indication::AsError { channel }),
            _ => return None,
        };
        Some(Sign { why, indication })
    });
    signs.collect()
}
