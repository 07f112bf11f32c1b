//! Places a device's recording in the session that it belongs to.

use std::path::{Path, PathBuf};

use clap::Args;
use teampulse_bag::Bag;
use teampulse_core::counted::counted;
use teampulse_timefilter::clock::Latency;
use teampulse_timefilter::join::{
    JoinError, Movement, Placement, Search, by_beats, by_marks, by_motion,
};

use super::delay::{Kind, SAME_DEVICE, Seen, delay};
use super::found_beats::FoundBeats;
use super::hearts::{of_heart, shown_by};
use super::imported::DeviceRecording;
use super::markers::Labels;
use super::movement::{self, Magnitudes};
use super::written::SessionFromDevice;
use crate::commands::calibrate::signals::{Span, Wanted, record};
use crate::exit::Exit;
use crate::failure::Failure;

/// How far the clock of a device that states the date may be off, by default [s].
const DATED_OFFSET_SECS: f64 = 600.0;
/// Half of the step in which devices stamp presses of their button [s].
const MARK_SECS: f64 = 0.005;

/// The options for files that join a session.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Options for joining a session")]
pub struct Into {
    /// The bag of the session during which the files were recorded. The new bag uses its clock; the session's own bag
    /// is not changed
    #[arg(id = "into", long = "into", value_name = "BAG")]
    session: Option<PathBuf>,
    /// Joins by an event that both recorded: the label of markers in the session and, after `=`, the label of marks in
    /// the file (by default all marks in the file). Without this, heartbeats are matched, or else movement
    #[arg(long, value_name = "LABEL[=LABEL]", requires = "into", conflicts_with = "against")]
    at: Option<Labels>,
    /// The stream of the session whose heartbeats or acceleration is matched; by default the pulses of the same kind of
    /// device if it was streamed live, else the person's beats from an ECG, else from intervals, else pulses; if there
    /// are none, or the file has no heart signal, the person's acceleration
    #[arg(long, value_name = "STREAM", requires = "into")]
    against: Option<Wanted>,
    /// The time from the R wave of an ECG to the foot of the pulse where the device was worn and, after a colon, its
    /// uncertainty (95 %) [ms]. It differs between people: measure it in a recording with a tap
    #[arg(long, value_name = "MS[:MS]", requires = "into", value_parser = pulse_arrival)]
    pulse_arrival: Option<Latency>,
    /// The largest offset between the clocks of session and device [s]; by default 600 if the file has a date with its
    /// time zone, and unlimited if it has none
    #[arg(long, value_name = "SECS", requires = "into", value_parser = positive)]
    max_offset: Option<f64>,
}

fn positive(text: &str) -> Result<f64, String> {
    let secs = text.parse().ok().filter(|secs: &f64| secs.is_finite() && *secs > 0.0);
    secs.ok_or_else(|| "expected a number of seconds above 0".to_owned())
}

fn pulse_arrival(text: &str) -> Result<Latency, String> {
    let (centre, uncertainty) = text.split_once(':').unwrap_or((text, "10"));
    let secs = |text: &str| {
        text.parse::<f64>().ok().filter(|ms| (0.0..=1000.0).contains(ms)).map(|ms| ms / 1e3)
    };
    let both = secs(centre).zip(secs(uncertainty));
    let (centre, uncertainty) =
        both.ok_or("expected milliseconds from 0 to 1000, such as 240 or 240:15")?;
    Ok(Latency::new(centre, uncertainty))
}

/// Reports the failure to place a file. If no offset fits well, the true one may be beyond those that were searched.
fn refused(name: &str, error: &JoinError, search: &Search) -> Failure {
    let most_secs = search.max_offset_secs;
    let is_bounded = most_secs.is_finite();
    let may_be_beyond = matches!(error, JoinError::Ambiguous { .. } | JoinError::Unlike { .. });
    let beyond = if is_bounded && may_be_beyond {
        format!(
            "; or the true offset is larger than {most_secs} s (give a larger --max-offset), or the file is from another \
             person"
        )
    } else {
        String::new()
    };
    Failure::to(format!("place {name} in the session: cannot {error}"))
        .hint(format!("{}{beyond}", error.hint()))
}

/// A placement, with its description for the user.
pub struct Joined {
    /// Converts times of the device.
    pub session_from_device: SessionFromDevice,
    /// Such as "placed by 612 heartbeats …: within 41 ms (95 %)".
    pub words: String,
}

/// The events of a session or a recording.
pub(super) struct Happened {
    name: String,
    at_ns: Vec<i64>,
    /// The magnitude of acceleration at each time.
    magnitudes: Vec<f64>,
    kind: Kind,
    /// The device that recorded the events, as a token of a topic.
    device: String,
}

impl Happened {
    pub(super) fn events(name: String, at_ns: Vec<i64>, kind: Kind) -> Happened {
        Happened { name, at_ns, magnitudes: Vec::new(), kind, device: String::new() }
    }

    /// Sets the device that recorded the events.
    pub(super) fn seen_by(self, device: &str) -> Happened {
        Happened { device: device.to_owned(), ..self }
    }

    fn seen(&self) -> Seen<'_> {
        Seen { kind: self.kind, device: &self.device }
    }

    fn movement(name: String, Magnitudes { at_ns, values }: Magnitudes) -> Happened {
        Happened { magnitudes: values, ..Happened::events(name, at_ns, Kind::Movement) }
    }

    /// Returns the acceleration, with these times [s].
    fn felt(&self, secs: &[f64]) -> Vec<Movement> {
        let samples = secs.iter().zip(&self.magnitudes);
        samples.map(|(&secs, &magnitude)| Movement { secs, magnitude }).collect()
    }
}

impl Into {
    /// The bag of the session to join.
    pub fn bag(&self) -> Option<&Path> {
        self.session.as_deref()
    }

    /// Places a recording in the session.
    pub fn join(
        &self,
        bag: &Bag,
        person: &str,
        device: &DeviceRecording,
    ) -> Result<Joined, Failure> {
        let (session, recording) = if let Some(labels) = &self.at {
            of_marks(bag, labels, device)?
        } else if let Some(both) = self.of_movement(bag, person, device)? {
            both
        } else {
            let session = self.beats_of(bag, person, device)?;
            let recording = of_heart(device, session.kind)?;
            (session, recording)
        };
        let origin_ns = session.at_ns.iter().min().copied().unwrap_or_default();
        let first_ns = recording.at_ns.iter().min().copied().unwrap_or_default();
        let zero_ns = self.zero_ns(device);
        let device_ns = zero_ns.map_or(first_ns, |zero_ns| origin_ns.saturating_sub(zero_ns));
        let secs = |at_ns: &[i64], origin_ns: i64| -> Vec<f64> {
            at_ns.iter().map(|at| at.saturating_sub(origin_ns) as f64 / 1e9).collect()
        };
        let (ours, theirs) = (secs(&session.at_ns, origin_ns), secs(&recording.at_ns, device_ns));
        let usual = if zero_ns.is_some() { DATED_OFFSET_SECS } else { f64::INFINITY };
        let search = Search {
            max_offset_secs: self.max_offset.unwrap_or(usual),
            delay: delay(session.seen(), recording.seen(), self.pulse_arrival),
            resolution_secs: if session.kind == Kind::Marks { MARK_SECS } else { 0.0 },
        };
        let found = match session.kind {
            Kind::Marks => by_marks(&ours, &theirs, &search),
            Kind::Movement => by_motion(&session.felt(&ours), &recording.felt(&theirs), &search),
            _ => by_beats(&ours, &theirs, &search),
        };
        let found = found.map_err(|error| refused(&device.name, &error, &search))?;
        let ends =
            theirs.iter().copied().fold((f64::MAX, f64::MIN), |(a, b), at| (a.min(at), b.max(at)));
        let words = words(&found, &session, ends, search.delay, zero_ns.is_some());
        let session_from_device = Box::new(move |at_ns: i64| {
            let secs = at_ns.saturating_sub(device_ns) as f64 / 1e9;
            // What is added is small, so no digits of the time itself are lost.
            let added_ns = ((found.session_from_device(secs) - secs) * 1e9).round() as i64;
            at_ns.saturating_sub(device_ns).saturating_add(origin_ns).saturating_add(added_ns)
        });
        Ok(Joined { session_from_device, words })
    }

    /// The date at which the device's times start [ns since 1970]; `None` if it is unknown. A header's date without a
    /// time zone is read as UTC if the user states how far the clock may be off.
    fn zero_ns(&self, device: &DeviceRecording) -> Option<i64> {
        let stated = device.date.filter(|date| date.has_zone || self.max_offset.is_some());
        if device.is_dated { Some(0) } else { stated.map(|date| date.zero_ns) }
    }

    /// The movement in the session and in the recording, if it is requested or their heartbeats can't be compared;
    /// `None` otherwise.
    fn of_movement(
        &self,
        bag: &Bag,
        person: &str,
        device: &DeviceRecording,
    ) -> Result<Option<(Happened, Happened)>, Failure> {
        let stream = match &self.against {
            Some(wanted) => bag.streams().iter().find(|known| {
                known.stream.name == wanted.to_string() && movement::is_acceleration(known)
            }),
            None if shown_by(device).is_some() && self.beats_of(bag, person, device).is_ok() => {
                None
            }
            None => movement::acceleration_of(bag, person),
        };
        let Some(stream) = stream else { return Ok(None) };
        let name = stream.stream.name.clone();
        let Some(theirs) = movement::of_device(device) else {
            if self.against.is_none() {
                return Ok(None);
            }
            return Err(Failure::new(format!("{} has no acceleration", device.name))
                .hint("match heartbeats, or join by a marker that is in both, with --at"));
        };
        let ours = movement::of_session(bag, &name)?;
        let theirs = Happened::movement(device.name.clone(), theirs);
        Ok(Some((Happened::movement(name, ours), theirs)))
    }

    /// Finds the beats of the person in the session: preferably the pulses of the same kind of device, so that the
    /// recording is aligned with its live stream; otherwise the beats closest to the heart.
    fn beats_of(
        &self,
        bag: &Bag,
        person: &str,
        device: &DeviceRecording,
    ) -> Result<Happened, Failure> {
        let beats: Vec<FoundBeats<'_>> =
            bag.streams().iter().filter_map(|known| FoundBeats::of(bag, known)).collect();
        let chosen = match &self.against {
            Some(wanted) => beats.iter().find(|each| each.name() == wanted.to_string()),
            None => beats
                .iter()
                .filter(|each| each.known.stream.id == person)
                .min_by_key(|each| (!each.is_of(device), each.rank())),
        };
        let Some(chosen) = chosen else {
            let names: Vec<&str> = beats.iter().map(FoundBeats::name).collect();
            let hint = match names.as_slice() {
                [] => "join by a marker with --at, or compute the session's beats with `teampulse replay`".to_owned(),
                names => format!("the session has {}: name one with --against, or its person with --person", names.join(", ")),
            };
            let whose =
                self.against.as_ref().map_or_else(|| format!("of {person}"), ToString::to_string);
            return Err(Failure::new(format!("the session has no heartbeats {whose}"))
                .hint(hint)
                .exit(Exit::BadArguments));
        };
        let (name, Seen { kind, device }) = (chosen.name().to_owned(), chosen.seen());
        let at_ns = times(bag, &name)?;
        Ok(Happened::events(name, at_ns, kind).seen_by(device))
    }
}

/// The times of the events of a stream, such as `/session/events:tap` [ns].
fn times(bag: &Bag, stream: &str) -> Result<Vec<i64>, Failure> {
    let wanted: Wanted = stream.parse().map_err(Failure::new)?;
    let recorded = record(bag, [&wanted, &wanted], Span::of(bag, None, None))?;
    Ok(recorded.seen[0].times().to_vec())
}

/// Returns the markers of the session and the marks of the file.
fn of_marks(
    bag: &Bag,
    labels: &Labels,
    device: &DeviceRecording,
) -> Result<(Happened, Happened), Failure> {
    let (name, kind) = (labels.in_session(), Kind::Marks);
    let ours = times(bag, &name)?;
    if ours.is_empty() {
        return Err(labels.none_in_session(bag));
    }
    let theirs = labels.in_file(device)?;
    let recording = Happened::events(device.name.clone(), theirs, kind);
    Ok((Happened::events(name, ours, kind), recording))
}

/// Describes a placement.
fn words(
    found: &Placement,
    session: &Happened,
    (from, to): (f64, f64),
    delay: Latency,
    is_dated: bool,
) -> String {
    let (one, several) = match session.kind {
        Kind::Marks => ("event", "events"),
        Kind::Movement => {
            ("stretch of 30 s with the same movement", "stretches of 30 s with the same movement")
        }
        _ => ("heartbeat", "heartbeats"),
    };
    let share = 100.0 * found.share;
    let slow = (found.skew_ppm != 0.0)
        .then(|| format!("{:+.1} ± {:.1} ppm slow", found.skew_ppm, found.skew_uncertainty_ppm()));
    let clock = clock(is_dated.then_some(found.offset_secs), slow.as_deref());
    let ms = 1e3 * found.uncertainty_secs(from).max(found.uncertainty_secs(to));
    let of_delay = if session.kind == Kind::Movement {
        let ms = 1e3 * delay.uncertainty_secs;
        format!(
            ", with ±{ms:.0} ms for the time that a movement takes from one sensor to the other"
        )
    } else if delay == SAME_DEVICE {
        format!(", which is the live stream of the same kind of device, {}", session.device)
    } else if delay.secs == 0.0 {
        String::new()
    } else {
        let (secs, uncertainty) = (1e3 * delay.secs, 1e3 * delay.uncertainty_secs);
        format!(
            ", with {secs:.0} ± {uncertainty:.0} ms from the heart to where the pulse was measured"
        )
    };
    let unconfirmed = if found.pairs == 1 {
        ", if this is the same event, which no second event confirms"
    } else {
        ""
    };
    format!(
        "placed by {} in common with {} ({share:.0} % of the file's): {clock}; \
         times are within {ms:.0} ms (95 %) of the times in that stream{of_delay}{unconfirmed}",
        counted(found.pairs, one, several),
        session.name
    )
}

/// Describes the device's clock: how far behind it was [s], if it states a date, and how slow it was, if that is known.
fn clock(behind_secs: Option<f64>, slow: Option<&str>) -> String {
    let offset = behind_secs.map(|behind| {
        let side = if behind < 0.0 { "ahead" } else { "behind" };
        format!("its clock was {:.3} s {side}", behind.abs())
    });
    match (offset, slow) {
        (Some(offset), Some(slow)) => format!("{offset} and {slow}"),
        (Some(offset), None) => {
            format!("{offset}, and the recording is too short to show its skew")
        }
        (None, Some(slow)) => format!("its clock has no date and was {slow}"),
        (None, None) => {
            "its clock has no date, and the recording is too short to show its skew".to_owned()
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use teampulse_formats::StatedDate;

    use super::*;

    #[test]
    fn an_offset_that_may_be_beyond_the_largest_is_reported_as_such() {
        let error = JoinError::Ambiguous { offset_secs: 8.0, next_offset_secs: 9.0 };
        let hint = |max_offset_secs| {
            refused("x.edf", &error, &Search { max_offset_secs, ..Search::default() }).words().1
        };
        assert!(hint(10.0).contains("the true offset is larger than 10 s"), "{}", hint(10.0));
        assert_eq!(hint(f64::INFINITY), error.hint());
    }

    #[test]
    fn a_recording_is_searched_for_around_the_date_that_its_file_states() {
        #[derive(Parser)]
        struct Asked {
            #[command(flatten)]
            into: Into,
        }
        let zero_ns = |arguments: &[&str], is_dated: bool, has_zone: Option<bool>| {
            let asked = Asked::try_parse_from([&["x", "--into", "bag"], arguments].concat());
            let date = has_zone.map(|has_zone| StatedDate { zero_ns: 7, has_zone });
            let (name, device) = (String::new(), String::new());
            let device = DeviceRecording { name, device, is_dated, date, signals: Vec::new() };
            asked.ok().and_then(|asked| asked.into.zero_ns(&device))
        };
        assert_eq!(zero_ns(&[], true, None), Some(0));
        assert_eq!(zero_ns(&[], false, None), None);
        assert_eq!(zero_ns(&[], false, Some(true)), Some(7));
        assert_eq!(zero_ns(&[], false, Some(false)), None);
        assert_eq!(zero_ns(&["--max-offset", "9"], false, Some(false)), Some(7));
        assert_eq!(zero_ns(&["--max-offset", "9"], false, None), None);
    }

    #[test]
    fn a_clock_is_described_in_a_sentence() {
        let slow = Some("+3.0 ± 0.1 ppm slow");
        assert_eq!(
            clock(Some(37.0), slow),
            "its clock was 37.000 s behind and +3.0 ± 0.1 ppm slow"
        );
        assert_eq!(
            clock(Some(-0.5), None),
            "its clock was 0.500 s ahead, and the recording is too short to show its skew"
        );
        assert_eq!(clock(None, slow), "its clock has no date and was +3.0 ± 0.1 ppm slow");
        assert_eq!(
            clock(None, None),
            "its clock has no date, and the recording is too short to show its skew"
        );
    }
}
