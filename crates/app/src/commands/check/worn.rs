//! Whether wearables touch the skin, and how long their batteries last.

use std::sync::Arc;

use teampulse_core::stream::{About, Signal, Stream};
use teampulse_sources::session::Phase;

/// Below this, an unknown device may not last through a session \[%\].
const LOW_PERCENT: f64 = 20.0;

/// The battery life that the maker specifies for a full battery \[h\], by the device of its streams.
const LIVES_HOURS: [(&str, f64); 3] = [
    ("polar_h10", 400.0),         // Polar H10, technical specifications
    ("polar_verity_sense", 20.0), // Polar Verity Sense, technical specifications, first generation
    ("polar_oh1", 12.0),          // Polar OH1, technical specifications
];

/// A stream of a wearable with its newest values.
pub type Newest = (Arc<Stream>, Vec<f64>);

/// Whether a stream reports a battery or skin contact of a person.
pub fn wants(stream: &Stream) -> bool {
    let has_contact = stream.place_of("contact").is_some();
    stream.about == About::Person && (stream.signal == Signal::Battery || has_contact)
}

/// The findings about each device, and the reasons for a no-go.
#[derive(Debug, Default, PartialEq)]
pub struct Found {
    /// A line for each finding.
    pub lines: Vec<String>,
    /// The reasons for a no-go.
    pub missing: Vec<String>,
}

/// Compares what devices report with the planned length of the session \[s\].
pub fn found(newest: &[Newest], planned_secs: Option<f64>) -> Found {
    let mut found = Found::default();
    for (stream, values) in newest {
        if let Some(percent) = percent(stream, values) {
            found.judge_battery(stream, percent, planned_secs);
        }
        found.judge_contact(stream, values);
    }
    found
}

impl Found {
    fn judge_battery(&mut self, stream: &Stream, percent: f64, planned_secs: Option<f64>) {
        let (device, person) = (&stream.device, &stream.id);
        let lasts_hours = life_hours(device).map(|hours| hours * percent / 100.0);
        let lasts = lasts_hours.map_or_else(String::new, |hours| format!(", about {hours:.0} h"));
        let is_short = match (lasts_hours, planned_secs) {
            (Some(hours), Some(planned_secs)) => hours * 3600.0 < planned_secs,
            _ => percent < LOW_PERCENT,
        };
        let verdict = if is_short { "low " } else { "ok  " };
        self.lines.push(format!("battery  {verdict}  {device} of {person}: {percent:.0} %{lasts}"));
        if is_short {
            self.missing.push(format!(
                "battery of {device} of {person}: {percent:.0} %{lasts}; charge or replace it"
            ));
        }
    }

    fn judge_contact(&mut self, stream: &Stream, values: &[f64]) {
        let contact = stream.place_of("contact").and_then(|place| values.get(place));
        // A device that does not measure contact reports NaN.
        let Some(contact) = contact.filter(|contact| contact.is_finite()) else { return };
        let (device, person) = (&stream.device, &stream.id);
        if *contact > 0.0 {
            self.lines.push(format!("contact  ok    {device} of {person} touches the skin"));
        } else {
            self.lines.push(format!("contact  none  {device} of {person}"));
            self.missing.push(format!(
                "{device} of {person} has no skin contact: is it worn tightly, with moistened electrodes?"
            ));
        }
    }
}

/// Returns the charge of a battery \[%\], if a stream reports it.
fn percent(stream: &Stream, values: &[f64]) -> Option<f64> {
    let place = stream.channels.iter().position(|channel| channel.unit == "%")?;
    let is_battery = stream.signal == Signal::Battery;
    let value = values.get(place).filter(|value| is_battery && value.is_finite())?;
    Some(value * stream.channels.get(place)?.scale)
}

fn life_hours(device: &str) -> Option<f64> {
    LIVES_HOURS.iter().find(|(name, _)| *name == device).map(|(_, hours)| *hours)
}

/// Returns the time from the start of the session to the last known end of a phase \[s\]; `None` if no phase has an end.
pub fn planned_secs(phases: &[Phase]) -> Option<f64> {
    let mut end_secs = None;
    for phase in phases {
        let from_secs = phase.from_secs.or(end_secs).unwrap_or(0.0);
        let lasts = phase.lasts_secs.map(|lasts_secs| from_secs + lasts_secs);
        end_secs = phase.to_secs.or(lasts).or(end_secs);
    }
    end_secs
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Shape, Subject};

    use super::*;

    fn stream(device: &str, signal: Signal, channels: &[(&str, &str)]) -> Arc<Stream> {
        let name = format!("/humans/persons/p001/{device}/x");
        let stream = Stream::raw(name, Subject::person("p001"), Shape::Sample);
        let stream = Stream { device: device.to_owned(), signal, ..stream };
        Arc::new(stream.with_channels(channels))
    }

    fn battery(device: &str, percent: f64) -> Newest {
        (stream(device, Signal::Battery, &[("charge", "%")]), vec![percent])
    }

    fn contact(contact: f64) -> Newest {
        let channels = [("heart_rate", "1/min"), ("contact", "1")];
        (stream("heart_rate_strap", Signal::Other, &channels), vec![70.0, contact])
    }

    #[test]
    fn a_battery_that_lasts_through_the_session_is_go_and_any_other_is_not() {
        let hours = |hours: f64| Some(hours * 3600.0);
        let go = |newest, planned_secs| found(&[newest], planned_secs).missing.is_empty();
        assert!(go(battery("polar_h10", 10.0), hours(30.0)));
        assert!(!go(battery("polar_h10", 10.0), hours(50.0)));
        assert!(
            go(battery("polar_oh1", 50.0), hours(5.0))
                && !go(battery("polar_oh1", 30.0), hours(5.0))
        );
        // Where either is unknown, a fifth has to be left.
        assert!(go(battery("myo", 25.0), hours(2.0)) && !go(battery("myo", 15.0), hours(2.0)));
        assert!(!go(battery("polar_h10", 15.0), None));
        let found = found(&[battery("polar_h10", 87.0)], hours(1.0));
        assert_eq!(found.lines, ["battery  ok    polar_h10 of p001: 87 %, about 348 h"]);
    }

    #[test]
    fn a_strap_without_contact_is_no_go_and_one_that_does_not_measure_it_is_not() {
        assert_eq!(found(&[contact(1.0)], None).missing, Vec::<String>::new());
        assert!(found(&[contact(0.0)], None).missing[0].contains("has no skin contact"));
        assert_eq!(found(&[contact(f64::NAN)], None), Found::default());
    }

    #[test]
    fn the_planned_length_is_the_end_of_the_last_phase() {
        let phase = |from_secs, to_secs, lasts_secs| Phase {
            name: "x".into(),
            from_secs,
            to_secs,
            lasts_secs,
        };
        assert_eq!(planned_secs(&[]), None);
        assert_eq!(planned_secs(&[phase(Some(0.0), None, None)]), None);
        let phases = [phase(Some(0.0), Some(60.0), None), phase(None, None, Some(90.0))];
        assert_eq!(planned_secs(&phases), Some(150.0));
    }
}
