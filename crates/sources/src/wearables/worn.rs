//! The readings of a device's session, as streams of the person who wears the device.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use teampulse_core::clock::Stopwatch;
use teampulse_core::counted::counted;
use teampulse_core::data::{Data, Event, EventKind, Wave};
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::SettingsError;
use teampulse_core::source::Reading;
use teampulse_core::stream::{Channel, Shape, Signal, Stream, StreamId, Subject};
use teampulse_core::time::Time;
use teampulse_devices as devices;

use super::beats::BeatClock;
use super::uses::{Use, Uses};

/// The namespace of people's streams.
const PEOPLE: &str = "/humans/persons";
/// The names of streams with intervals between beats.
const INTERVALS: [&str; 2] = ["ibi", BEATS];
/// The stream of intervals between beats, whose beats have no times of their own.
const BEATS: &str = "rr_interval";
/// The stream of intervals between pulses; several seconds of them arrive at once.
const PULSES: &str = "pp_interval";
/// If the elapsed time exceeds the sum of the received intervals by this much, some are missing \[ms\].
const MISSING_MS: f64 = 2500.0;
/// The device whose clock is the beats that a strap reports; it is as late as they are.
const STRAP: &str = "heart_rate_strap";

/// The prefix of acceleration streams, as a device may have several accelerometers.
const ACCELERATION: &str = "acceleration";
/// The suffix of streams with raw numbers, from which the streams in units are computed.
const RAW: &str = "_raw";

/// A device and the person who wears it.
#[derive(Clone, Debug)]
pub(super) struct Worn {
    person: String,
    /// The device's name, as in the table of latencies: `empatica_e4`.
    device: &'static str,
    streams: BTreeMap<&'static str, WornStream>,
    markers: Option<StreamId>,
    link: Option<StreamId>,
    /// The clock of the beats, and the clock of their arrivals.
    beats: BeatClock,
    clock: Stopwatch,
    /// The clock of pulses without times, and when the last ones arrived \[ms\]. If there are pulses, no beats are
    /// reported, and the clock of beats is the clock of arrivals.
    pulses: BeatClock,
    pulses_ms: Option<f64>,
    /// Whether device times come from a clock in the device.
    has_clock: bool,
    /// The kinds of recurring reports that were made already.
    reported: BTreeSet<&'static str>,
}

/// A stream of the device.
#[derive(Clone, Copy, Debug)]
struct WornStream {
    id: StreamId,
    width: usize,
    rate_hz: Option<f64>,
    in_runs: bool,
    /// Whether the beats that the device reports are its clock.
    by_beats: bool,
    /// The time since the stream's last reading arrived.
    last: Option<Stopwatch>,
    /// Whether an unknown number of samples is missing before the next one.
    has_gap: bool,
}

impl Worn {
    /// Creates a device of a person; fails if the person's id can't be part of a topic.
    pub(super) fn new(person: String, device: &'static str) -> Result<Worn, SettingsError> {
        Worn::check(&person)?;
        Ok(Worn::of(person, device))
    }

    /// Returns an error if a person's id can't be part of a topic.
    pub(super) fn check(person: &str) -> Result<(), SettingsError> {
        let is_plain = |each: char| each.is_ascii_alphanumeric() || each == '_';
        // ROS refuses topics with tokens that begin with a digit.
        let begins_well = person.starts_with(|first: char| first.is_ascii_alphabetic());
        if !begins_well || !person.chars().all(is_plain) {
            let error = SettingsError::new(format!("`{person}` can't be the id of a person"));
            let hint = "give a pseudonym of a-z, A-Z, 0-9 and `_` that begins with a letter, such as \"p001\"";
            return Err(error.at("person").with_hint(hint));
        }
        Ok(())
    }

    /// Reserves the names of the device's streams; fails if another source has the same ones.
    pub(super) fn names(&self, uses: &Uses) -> Result<Use, SettingsError> {
        let Worn { person, device, .. } = self;
        uses.begin(format!("{PEOPLE}/{person}/{device}")).ok_or_else(|| {
            let error = SettingsError::new(format!("{person} wears two devices of the kind {device}"));
            let hint = format!("their streams would have the same names: set a different `person` for one of them, such as \"{person}_left\"");
            error.at("person").with_hint(hint)
        })
    }

    /// Creates a device of a person whose id has been checked.
    pub(super) fn of(person: String, device: &'static str) -> Worn {
        Worn {
            person,
            device,
            streams: BTreeMap::new(),
            markers: None,
            link: None,
            beats: BeatClock::default(),
            clock: Stopwatch::start(),
            pulses: BeatClock::default(),
            pulses_ms: None,
            has_clock: false,
            reported: BTreeSet::new(),
        }
    }

    fn stream(&self, leaf: &str, shape: Shape) -> Stream {
        let name = format!("{PEOPLE}/{}/{}/{leaf}", self.person, self.device);
        let subject = Subject::person(&self.person);
        Stream { device: self.device.to_owned(), ..Stream::raw(name, subject, shape) }
    }

    /// Declares a stream that is new, or whose scale or rate has changed.
    pub(super) fn declare(&mut self, described: &devices::Stream, outlet: &Outlet) {
        let signal = match described.name {
            name if INTERVALS.contains(&name) => Signal::Interval,
            name if name.starts_with(ACCELERATION) && !name.ends_with(RAW) => Signal::Acceleration,
            name => Signal::from_word(name).unwrap_or(Signal::Other),
        };
        let channel = |channel: &devices::Channel| Channel {
            scale: channel.scale,
            ..Channel::new(channel.name, if channel.unit.is_empty() { "1" } else { channel.unit })
        };
        let shape = if described.in_runs { Shape::Wave } else { Shape::Sample };
        let mut stream = Stream {
            signal,
            channels: described.channels.iter().map(channel).collect(),
            rate_hz: described.rate_hz.unwrap_or(0.0),
            ..self.stream(described.name, shape)
        };
        if described.by_beats && self.device != STRAP {
            stream.device = format!("{STRAP}_{}", self.device);
        }
        self.has_clock |= described.has_clock;
        let id = outlet.declare(stream);
        let &devices::Stream { name, rate_hz, by_beats, in_runs, .. } = described;
        let width = described.channels.len().max(1);
        let known = self.streams.get(name);
        let (last, has_gap) = known.map_or((None, false), |known| (known.last, known.has_gap));
        let worn = WornStream { id, width, rate_hz, in_runs, by_beats, last, has_gap };
        if self.streams.insert(name, worn).is_none() && rate_hz.is_some() {
            // The device numbers its samples, so losses are known.
            outlet.lost(id, 0);
        }
    }

    /// Offers the samples of a reading.
    pub(super) fn offer(&mut self, reading: &devices::Reading, outlet: &Outlet) {
        let Some(stream) = self.streams.get_mut(reading.stream) else { return };
        let samples = reading.values.len() / stream.width;
        if std::mem::take(&mut stream.has_gap) {
            stream.report_gap(samples, outlet);
        }
        stream.last = Some(Stopwatch::start());
        let stream = *stream;
        let arrival_ms = self.clock.elapsed().as_secs_f64() * 1e3;
        match reading.stream {
            BEATS if stream.by_beats => self.offer_beats(stream, reading, outlet),
            PULSES if stream.by_beats => self.offer_pulses(stream, reading, arrival_ms, outlet),
            _ if stream.by_beats => {
                let device_time = Some(self.beats.notified(arrival_ms));
                let data = Data::Sample(reading.values.as_slice().into());
                let index = Some(reading.index);
                let stream = stream.id;
                outlet.offer(Reading { stream, index, device_time, source_time: None, data });
            }
            _ if stream.in_runs => offer_run(stream, reading, outlet),
            _ => self.offer_samples(stream, reading, outlet),
        }
    }

    /// Offers intervals between beats, each with the time of the beat at its end.
    fn offer_beats(&mut self, stream: WornStream, reading: &devices::Reading, outlet: &Outlet) {
        let channels = &outlet.streams().get(stream.id).channels;
        let scale = channels.first().map_or(1.0, |channel| channel.scale);
        let intervals_ms: Vec<f64> = reading.values.iter().map(|value| value * scale).collect();
        let times = self.beats.beats(&intervals_ms);
        let beat = |(interval, time): (&f64, i64)| Reading {
            stream: stream.id,
            index: None,
            device_time: Some(time),
            source_time: None,
            data: Data::Sample([*interval].into()),
        };
        outlet.offer_together(reading.values.iter().zip(times).map(beat).collect());
    }

    /// Offers intervals between pulses, each with the time of the pulse at its end; the last pulse was just before they
    /// were sent.
    fn offer_pulses(
        &mut self,
        stream: WornStream,
        reading: &devices::Reading,
        arrival_ms: f64,
        outlet: &Outlet,
    ) {
        let pulses = reading.values.chunks(stream.width);
        let intervals_ms: Vec<f64> =
            pulses.clone().filter_map(|pulse| pulse.first().copied()).collect();
        let waited_ms =
            self.pulses_ms.replace(arrival_ms).map_or(0.0, |before| arrival_ms - before);
        if waited_ms > intervals_ms.iter().sum::<f64>() + MISSING_MS {
            self.pulses.restart();
        }
        let times_ms = self.pulses.arrived(arrival_ms, &intervals_ms);
        let pulse = |((place, values), time_ms): ((usize, &[f64]), f64)| Reading {
            stream: stream.id,
            index: Some(reading.index + place as u64),
            device_time: Some((time_ms * 1e6).round() as i64),
            source_time: None,
            data: Data::Sample(values.into()),
        };
        outlet.offer_together(pulses.enumerate().zip(times_ms).map(pulse).collect());
    }

    fn offer_samples(&self, stream: WornStream, reading: &devices::Reading, outlet: &Outlet) {
        for (place, values) in reading.values.chunks(stream.width).enumerate() {
            let after_ns =
                reading.period_ns.map(|period_ns| (period_ns * place as f64).round() as i64);
            // Of irregular samples, only the first has a time.
            let after_ns = after_ns.or((place == 0).then_some(0));
            let stamp = reading.device_time_ns.zip(after_ns);
            let stamp = stamp.map(|(at_ns, after_ns)| at_ns.saturating_add(after_ns));
            let is_regular = stream.rate_hz.is_some();
            outlet.offer(Reading {
                stream: stream.id,
                index: Some(reading.index + place as u64),
                device_time: stamp.filter(|_| self.has_clock),
                source_time: self.source_time(stamp.filter(|_| !is_regular)),
                data: Data::Sample(values.into()),
            });
        }
    }

    /// Returns the stamp of a program that passes on data of a device without a clock; regular samples are counted
    /// instead.
    fn source_time(&self, stamp_ns: Option<i64>) -> Option<Time> {
        stamp_ns.filter(|_| !self.has_clock).map(Time::from_nanos)
    }

    /// Reports a session's events.
    pub(super) fn report(&mut self, event: devices::Event, outlet: &Outlet) {
        use devices::Event::{Discarded, Gap, Marker, Refused, Stalled, Wearable};
        match event {
            Marker { name, device_time_ns } => self.mark(name, device_time_ns, outlet),
            Gap { stream, samples } => self.miss(stream, samples, outlet),
            Stalled { stream, quiet } => {
                let secs = quiet.as_secs_f64();
                self.fault(&format!("{stream}: no data for {secs:.0} s, requested again"), outlet);
            }
            Refused { stream, reason } => {
                self.fault(&format!("the device refuses {stream}: {reason}"), outlet);
            }
            Wearable { connected: false } => {
                self.fault("the wristband lost its radio link to the computer that runs the streaming server", outlet);
            }
            Discarded { source, bytes } if self.reported.insert(source) => {
                self.fault(
                    &format!(
                        "skipped {} of its {source}",
                        counted(bytes, "invalid byte", "invalid bytes")
                    ),
                    outlet,
                );
            }
            _ => {}
        }
    }

    /// Reports samples missing before the next ones: as many as the device states, or else, once samples arrive again,
    /// as many as fit into the silence.
    fn miss(&mut self, name: &str, samples: Option<u64>, outlet: &Outlet) {
        if name == BEATS {
            self.beats.restart();
        }
        let Some(stream) = self.streams.get_mut(name) else { return };
        match samples {
            Some(samples) => stream.lost(Some(samples), outlet),
            None => stream.has_gap = true,
        }
    }

    /// Reports that the link to the device is up, with the signal strength at its start \[dBm\], or that it is down.
    ///
    /// `BlueZ` only knows the strength of advertisements (`Device1.RSSI`), which a connected device does not send.
    pub(super) fn link(&mut self, connected: bool, rssi_dbm: Option<i16>, outlet: &Outlet) {
        let stream = self.link.unwrap_or_else(|| {
            let link = self.stream("link", Shape::Sample);
            let link = link.with_channels(&[("connected", "1"), ("rssi", "dBm")]);
            let doc =
                "whether the device is connected, and its signal strength at connection".into();
            outlet.declare(Stream { signal: Signal::Link, doc, ..link })
        });
        self.link = Some(stream);
        let values = [f64::from(u8::from(connected)), rssi_dbm.map_or(f64::NAN, f64::from)];
        let data = Data::Sample(values.into());
        outlet.offer(Reading { stream, index: None, device_time: None, source_time: None, data });
    }

    /// Reports notifications that were lost on this computer.
    pub(super) fn count_lost(&mut self, notifications: u64, outlet: &Outlet) {
        if notifications > 0 {
            let what =
                format!("{notifications} notifications arrived faster than they were processed");
            self.fault(&what, outlet);
        }
    }

    fn mark(&mut self, name: &str, stamp_ns: Option<i64>, outlet: &Outlet) {
        let stream = self.markers.unwrap_or_else(|| {
            let markers = self.stream("markers", Shape::Event);
            outlet.declare(Stream { signal: Signal::Event, ..markers })
        });
        self.markers = Some(stream);
        let (kind, label) = (EventKind::Marker, name.to_owned());
        let event = Event { kind, label, value: f64::NAN, duration_secs: 0.0 };
        outlet.offer(Reading {
            stream,
            index: None,
            device_time: stamp_ns.filter(|_| self.has_clock),
            source_time: self.source_time(stamp_ns),
            data: Data::Event(Arc::new(event)),
        });
    }

    fn fault(&self, what: &str, outlet: &Outlet) {
        outlet.happen(passing(format!("{} of {}: {what}", self.device, self.person)));
    }
}

impl WornStream {
    /// Reports as many lost samples as fit into the silence before a reading of `samples`.
    fn report_gap(&self, samples: usize, outlet: &Outlet) {
        let of_silence = || {
            let due = (self.rate_hz? * self.last?.elapsed().as_secs_f64()).round();
            Some((due as u64).saturating_sub(samples as u64))
        };
        self.lost(of_silence(), outlet);
    }

    /// Reports lost samples; `None` means that their number is unknown.
    fn lost(&self, samples: Option<u64>, outlet: &Outlet) {
        match samples {
            Some(0) => {}
            Some(samples) => outlet.lost(self.id, samples),
            None => outlet.losses_are_unknown(self.id),
        }
    }
}

/// Offers successive samples as one wave. Samples missing before it are reported by a separate event.
fn offer_run(stream: WornStream, reading: &devices::Reading, outlet: &Outlet) {
    let nominal_ns = stream.rate_hz.map(|rate_hz| 1e9 / rate_hz);
    let wave = Wave {
        period_ns: reading.period_ns.or(nominal_ns).unwrap_or(0.0),
        channels: stream.width as u32,
        samples: reading.values.as_slice().into(),
    };
    outlet.offer(Reading {
        stream: stream.id,
        index: None,
        device_time: reading.device_time_ns,
        source_time: None,
        data: Data::Wave(wave),
    });
}

#[cfg(test)]
mod tests {
    use teampulse_core::clock::Clock;
    use teampulse_core::outlet::Queue;
    use teampulse_core::streams::Streams;
    use teampulse_devices::heart_rate::HeartRateSession;
    use teampulse_devices::{Output, Session};

    use super::*;

    /// The clock that times a stream of a device.
    fn clock_of(device: &'static str, described: &devices::Stream) -> String {
        let outlet = Queue::new().outlet(Clock::settable(), Streams::default());
        let mut worn = Worn::of("p001".to_owned(), device);
        worn.declare(described, &outlet);
        let name = format!("/humans/persons/p001/{device}/{}", described.name);
        let (_, stream) = outlet.streams().find(&name).expect("it is declared");
        stream.device.clone()
    }

    #[test]
    fn a_heart_rate_has_the_clock_of_its_device_unless_it_comes_with_beats() {
        let channels = vec![devices::Channel::new("heart_rate", "1/min")];
        let own = devices::Stream::irregular("heart_rate", channels);
        assert_eq!(clock_of("band", &own), "band");
        let mut strap = HeartRateSession::new();
        strap.start(std::time::Duration::ZERO);
        let streams = std::iter::from_fn(|| strap.poll()).filter_map(|output| match output {
            Output::Stream(stream) if stream.by_beats => Some(stream),
            _ => None,
        });
        let streams: Vec<devices::Stream> = streams.collect();
        assert_eq!(streams.iter().map(|it| it.name).collect::<Vec<_>>(), ["heart_rate", BEATS]);
        for stream in streams {
            assert_eq!(clock_of("band", &stream), "heart_rate_strap_band");
            assert_eq!(clock_of(STRAP, &stream), STRAP);
        }
    }
}
