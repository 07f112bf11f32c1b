//! What a device's session gives, as streams of the person who wears it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::SettingsError;
use teampulse_core::source::Reading;
use teampulse_core::stream::{About, Channel, Shape, Signal, Stream, StreamId, Subject};
use teampulse_devices as devices;

/// Where the streams of people stand.
const PEOPLE: &str = "/humans/persons";
/// What a device calls a stream of intervals between beats.
const INTERVALS: &str = "ibi";

/// A device and the person who wears it.
#[derive(Clone, Debug)]
pub(super) struct Worn {
    person: String,
    /// Its name, as latencies are known by: `empatica_e4`.
    device: &'static str,
    streams: BTreeMap<&'static str, StreamId>,
    markers: Option<StreamId>,
    /// What was reported already and may come often.
    reported: BTreeSet<&'static str>,
}

impl Worn {
    /// A device of a person; an error where the person's id can't be a part of a topic.
    pub(super) fn new(person: String, device: &'static str) -> Result<Worn, SettingsError> {
        let is_plain = |each: char| each.is_ascii_alphanumeric() || each == '_';
        if person.is_empty() || !person.chars().all(is_plain) {
            let error = SettingsError::new(format!("`{person}` can't be the id of a person"));
            let hint = "give a pseudonym of letters, digits and `_`, such as \"p001\"";
            return Err(error.at("person").with_hint(hint));
        }
        let (streams, reported) = (BTreeMap::new(), BTreeSet::new());
        Ok(Worn { person, device, streams, markers: None, reported })
    }

    fn stream(&self, leaf: &str, shape: Shape) -> Stream {
        let subject = Subject { about: About::Person, id: self.person.clone() };
        let name = format!("{PEOPLE}/{}/{}/{leaf}", self.person, self.device);
        Stream { device: self.device.to_owned(), ..Stream::raw(name, subject, shape) }
    }

    /// A stream begins, or its scale or rate changed.
    pub(super) fn declare(&mut self, described: &devices::Stream, outlet: &Outlet) {
        let signal = match described.name {
            INTERVALS => Signal::Interval,
            name => Signal::from_word(name).unwrap_or(Signal::Other),
        };
        let channel = |channel: &devices::Channel| Channel {
            scale: channel.scale,
            ..Channel::new(channel.name, if channel.unit.is_empty() { "1" } else { channel.unit })
        };
        let stream = Stream {
            signal,
            channels: described.channels.iter().map(channel).collect(),
            rate_hz: described.rate_hz.unwrap_or(0.0),
            ..self.stream(described.name, Shape::Sample)
        };
        let id = outlet.declare(stream);
        if self.streams.insert(described.name, id).is_none() && described.rate_hz.is_some() {
            // The device numbers its samples: what is lost is known.
            outlet.lost(id, 0.0);
        }
    }

    /// Samples came.
    pub(super) fn offer(&self, reading: &devices::Reading, outlet: &Outlet) {
        let Some(stream) = self.streams.get(reading.stream).copied() else { return };
        let width = outlet.streams().get(stream).channels.len().max(1);
        for (place, values) in reading.values.chunks(width).enumerate() {
            let after_ns =
                reading.period_ns.map(|period_ns| (period_ns * place as f64).round() as i64);
            // Of irregular samples only the first has a time.
            let after_ns = after_ns.or((place == 0).then_some(0));
            let device_time = reading.device_time_ns.zip(after_ns);
            outlet.offer(Reading {
                stream,
                index: Some(reading.index + place as u64),
                device_time: device_time.map(|(at_ns, after_ns)| at_ns.saturating_add(after_ns)),
                source_time: None,
                data: Data::Sample(values.into()),
            });
        }
    }

    /// Something else became known. A gap needs no words: the numbers of the samples have it.
    pub(super) fn report(&mut self, event: devices::Event, outlet: &Outlet) {
        use devices::Event::{Discarded, Marker, Refused, Stalled, Wearable};
        match event {
            Marker { name, device_time_ns } => self.mark(name, device_time_ns, outlet),
            Stalled { stream, quiet } => {
                let secs = quiet.as_secs_f64();
                self.fault(
                    &format!("{stream} was silent for {secs:.0} s and is asked for again"),
                    outlet,
                );
            }
            Refused { stream, reason } => {
                self.fault(&format!("the device refuses {stream}: {reason}"), outlet);
            }
            Wearable { connected: false } => {
                self.fault("the radio link between the device and its base is lost", outlet);
            }
            Discarded { source, bytes } if self.reported.insert(source) => {
                self.fault(
                    &format!("{bytes} bytes of its {source} mean nothing and are left out"),
                    outlet,
                );
            }
            _ => {}
        }
    }

    fn mark(&mut self, name: &str, device_time: Option<i64>, outlet: &Outlet) {
        let stream = self.markers.unwrap_or_else(|| {
            let markers = self.stream("markers", Shape::Event);
            outlet.declare(Stream { signal: Signal::Event, ..markers })
        });
        self.markers = Some(stream);
        let (kind, label) = (EventKind::Marker, name.to_owned());
        let event = Event { kind, label, value: f64::NAN, duration_secs: 0.0 };
        let data = Data::Event(Arc::new(event));
        outlet.offer(Reading { stream, index: None, device_time, source_time: None, data });
    }

    fn fault(&self, what: &str, outlet: &Outlet) {
        outlet.happen(passing(format!("{} of {}: {what}", self.device, self.person)));
    }
}
