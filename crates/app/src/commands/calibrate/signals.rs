//! Reads the two signals of a bag that `calibrate` compares.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use teampulse_bag::{Bag, BagError, BagStream, Message};
use teampulse_core::clocks;
use teampulse_core::data::Data;
use teampulse_core::stream::{Shape, Stream};
use teampulse_core::time::Time;
use teampulse_messages::convert::{decode, type_name};
use teampulse_messages::definition::Definition;
use teampulse_messages::fields::{Fields, header_stamp, numbers, starts_with_header};
use teampulse_messages::readout;
use teampulse_messages::standard::Message as _;
use teampulse_messages::standard::teampulse_msgs as msgs;
use teampulse_timefilter::calibrate::Seen;
use teampulse_timefilter::clock::{ClockKind, ConnectionInterval};

use crate::failure::Failure;
use crate::output;
use crate::study::is_near;

/// The most numbers that are read from a stream: half an hour of nine channels at 1 kHz, or 128 MB.
const MOST_NUMBERS: usize = 16 << 20;
/// Message types that only report that something happened.
const MOMENTS: [&str; 2] = ["std_msgs/msg/Empty", "std_msgs/msg/String"];

/// A stream to read, or one channel, field or label of it.
#[derive(Clone, Debug)]
pub(in crate::commands) struct Wanted {
    stream: String,
    channel: Option<String>,
}

impl FromStr for Wanted {
    type Err = String;

    fn from_str(text: &str) -> Result<Wanted, String> {
        let (stream, channel) = match text.split_once(':') {
            Some((stream, channel)) => (stream, Some(channel.to_owned())),
            None => (text, None),
        };
        if stream.is_empty() || channel.as_ref().is_some_and(String::is_empty) {
            return Err("expected a stream, or a stream and one of its channels".into());
        }
        Ok(Wanted { stream: stream.to_owned(), channel })
    }
}

impl fmt::Display for Wanted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.stream)?;
        self.channel.iter().try_for_each(|channel| write!(f, ":{channel}"))
    }
}

/// The part of a bag to read, by log time.
#[derive(Clone, Copy, Debug)]
pub(in crate::commands) struct Span {
    from: Time,
    to: Time,
}

impl Span {
    /// Returns the part between two times, given in seconds after the bag's start.
    pub(in crate::commands) fn of(bag: &Bag, from_secs: Option<f64>, to_secs: Option<f64>) -> Span {
        let (first, last) = bag.bounds().unwrap_or_default();
        let after = |secs: f64| Time::from_nanos(first.nanos().saturating_add((secs * 1e9) as i64));
        Span { from: from_secs.map_or(first, after), to: to_secs.map_or(last, after) }
    }
}

/// What was read from the bag.
pub(in crate::commands) struct Recorded {
    pub seen: [SeenBy; 2],
    /// Whether a fixed latency was subtracted from the times of the second stream.
    pub has_latency: bool,
    /// The devices from whose streams the second stream was computed.
    pub devices: Vec<String>,
    /// Whether the whole bag could be read.
    pub is_whole: bool,
}

/// Reads two signals.
pub(in crate::commands) fn record(
    bag: &Bag,
    wanted: [&Wanted; 2],
    span: Span,
) -> Result<Recorded, Failure> {
    let [a, b] = wanted;
    let mut seen = [SeenBy::new(bag, a)?, SeenBy::new(bag, b)?];
    let (mut has_latency, mut is_whole) = (false, true);
    let (origins, devices) = origins(bag, &seen[1].stream);
    for message in bag.messages(Some(span.from)) {
        let message = match message {
            Ok(message) => message,
            Err(error @ BagError::Damaged { .. }) => {
                output::note(format!("damaged: {error}; skipped"));
                is_whole = false;
                continue;
            }
            Err(error) => return Err(Failure::to(&error).hint(error.hint())),
        };
        if message.log_time > span.to {
            break;
        }
        for each in seen.iter_mut().filter(|each| each.place == message.stream) {
            each.take(&message);
            if each.values.len() > MOST_NUMBERS {
                return Err(Failure::to(format!(
                    "read all of {}: it has too many numbers",
                    each.stream.name
                ))
                .hint("use --from and --to to select the part with the events"));
            }
        }
        if bag.streams()[message.stream].stream.shape == Shape::Status {
            has_latency |= states_latency(&message, &origins);
        }
    }
    Ok(Recorded { seen, has_latency, devices, is_whole })
}

/// Returns a stream's name with the names of all streams that it was computed from, and the devices at their origin.
fn origins(bag: &Bag, stream: &Stream) -> (Vec<String>, Vec<String>) {
    let mut names = vec![stream.name.clone()];
    let mut devices: Vec<String> = Vec::new();
    let mut next = 0;
    while let Some(name) = names.get(next) {
        next += 1;
        let known = bag.streams().iter().find(|known| known.stream.name == *name);
        let Some(known) = known.map(|known| &known.stream) else { continue };
        if known.inputs.is_empty() && !devices.contains(&known.device) {
            devices.push(known.device.clone());
        }
        let inputs = known.inputs.iter().filter(|input| !names.contains(*input));
        let inputs: Vec<String> = inputs.cloned().collect();
        names.extend(inputs);
    }
    (names, devices)
}

/// Whether a message is the status of one of these streams and reports a clock that subtracts a latency.
fn states_latency(message: &Message, streams: &[String]) -> bool {
    let with_latency = [ClockKind::OneWay as u8, ClockKind::SampleIndex as u8];
    match decode(msgs::StreamStatus::NAME, &message.cdr).map(|decoded| decoded.data) {
        Ok(Data::Status(status)) => {
            streams.contains(&status.name) && with_latency.contains(&status.clock)
        }
        _ => false,
    }
}

/// The signal of one stream.
pub(in crate::commands) struct SeenBy {
    stream: Arc<Stream>,
    place: usize,
    mode: ReadMode,
    times: Vec<i64>,
    /// The values of all samples, one sample after the other; all samples have the same width.
    values: Vec<f64>,
    width: Option<usize>,
    numbers: Vec<f64>,
    link: ConnectionInterval,
}

/// How the numbers of a stream are read.
enum ReadMode {
    /// All events, or only those with this label or of this kind.
    Events(Option<String>),
    /// All messages.
    Moments,
    /// The values of samples: all channels, or the one at an index.
    Own(Option<usize>),
    /// Fields of its messages.
    Fields { fields: Fields, by_header: bool },
}

impl SeenBy {
    fn new(bag: &Bag, wanted: &Wanted) -> Result<SeenBy, Failure> {
        let known = |known: &BagStream| known.stream.name == wanted.stream && known.messages > 0;
        let Some(place) = bag.streams().iter().position(known) else {
            return Err(missing(bag, wanted));
        };
        let stream = Arc::clone(&bag.streams()[place].stream);
        let mode = ReadMode::of(&stream, wanted)?;
        let (times, values, numbers) = (Vec::new(), Vec::new(), Vec::new());
        let link = ConnectionInterval::default();
        Ok(SeenBy { stream, place, mode, times, values, width: None, numbers, link })
    }

    /// Returns the connection interval of the link that carried the messages [s], if their arrival times show one.
    pub(super) fn interval_secs(&self) -> Option<f64> {
        self.link.secs()
    }

    /// Returns the times of the events or samples [ns].
    pub(in crate::commands) fn times(&self) -> &[i64] {
        &self.times
    }

    /// Returns the times of the samples [ns] and their values, one sample after the other.
    pub(in crate::commands) fn samples(&self) -> (&[i64], &[f64]) {
        (&self.times, &self.values)
    }

    pub(super) fn seen(&self) -> Seen<'_> {
        match self.mode {
            ReadMode::Events(_) | ReadMode::Moments => Seen::Events(&self.times),
            _ => Seen::Samples { times: &self.times, values: &self.values },
        }
    }

    /// Returns the name of the device in the study.
    pub(super) fn device(&self) -> String {
        clocks::device_of(&self.stream).to_owned()
    }

    /// Adds a message; skips it if it can't be read.
    fn take(&mut self, message: &Message) {
        self.link.push(message.log_time.nanos());
        match &self.mode {
            ReadMode::Moments => self.times.push(message.publish_time.nanos()),
            ReadMode::Fields { fields, by_header } => {
                let mut numbers = std::mem::take(&mut self.numbers);
                if fields.read(&message.cdr, &mut numbers).is_ok() {
                    let stamp = by_header.then(|| header_stamp(&message.cdr)).flatten();
                    self.push(stamp.unwrap_or(message.publish_time).nanos(), &numbers);
                }
                self.numbers = numbers;
            }
            ReadMode::Events(_) | ReadMode::Own(_) => self.take_own(message),
        }
    }

    fn take_own(&mut self, message: &Message) {
        let Ok(decoded) = decode(own_type(&self.stream), &message.cdr) else { return };
        let stamp = decoded.stamp.nanos();
        match &decoded.data {
            Data::Event(event) => {
                let ReadMode::Events(label) = &self.mode else { return };
                let is_meant = |label: &String| *label == event.label || label == event.kind.word();
                if label.as_ref().is_none_or(is_meant) {
                    self.times.push(stamp);
                }
            }
            Data::Sample(numbers) => self.push(stamp, numbers),
            Data::Feature(feature) => self.push(stamp, &feature.values),
            Data::Wave(wave) => {
                for (k, numbers) in wave.samples.chunks_exact(wave.channels as usize).enumerate() {
                    self.push(stamp.saturating_add((k as f64 * wave.period_ns) as i64), numbers);
                }
            }
            _ => {}
        }
    }

    /// Adds a sample, unless its width differs from the width of earlier samples.
    fn push(&mut self, time: i64, numbers: &[f64]) {
        let numbers = match self.mode {
            ReadMode::Own(Some(place)) => numbers.get(place..=place).unwrap_or_default(),
            _ => numbers,
        };
        if !numbers.is_empty() && *self.width.get_or_insert(numbers.len()) == numbers.len() {
            self.times.push(time);
            self.values.extend_from_slice(numbers);
        }
    }
}

impl ReadMode {
    fn of(stream: &Stream, wanted: &Wanted) -> Result<ReadMode, Failure> {
        let own = own_type(stream);
        if own == msgs::Event::NAME {
            return Ok(ReadMode::Events(wanted.channel.clone()));
        }
        if [msgs::Sample::NAME, msgs::Wave::NAME, msgs::Feature::NAME].contains(&own) {
            return own_channel(stream, wanted).map(ReadMode::Own);
        }
        match &stream.shape {
            Shape::Message(schema)
                if wanted.channel.is_none() && MOMENTS.contains(&&*schema.name) =>
            {
                Ok(ReadMode::Moments)
            }
            Shape::Message(schema) => {
                let definition = readout::definition(schema).ok_or_else(|| {
                    Failure::to(format!(
                        "read {}: the bag has no definition of this type",
                        schema.name
                    ))
                })?;
                ReadMode::of_fields(stream, &definition, wanted)
            }
            _ => Err(Failure::to(format!(
                "find events in {wanted}: it only describes other streams"
            ))
            .hint("`teampulse info` lists the streams of the bag")),
        }
    }

    /// Reads the named field, all numbers within it, or the channels that the stream declares.
    fn of_fields(
        stream: &Stream,
        definition: &Definition,
        wanted: &Wanted,
    ) -> Result<ReadMode, Failure> {
        let all = numbers(definition);
        let paths: Vec<String> = match &wanted.channel {
            Some(channel) => {
                let within = all.iter().filter(|path| path.starts_with(&format!("{channel}.")));
                let within: Vec<String> = within.cloned().collect();
                if within.is_empty() { vec![channel.clone()] } else { within }
            }
            None if !stream.channels.is_empty() => names(stream).map(str::to_owned).collect(),
            None => {
                let mut all = all.iter().filter(|path| !path.starts_with("header."));
                let first = all.next().cloned().unwrap_or_default();
                let name = &stream.name;
                return Err(Failure::new(format!("{name} has messages, so a field must be named"))
                    .hint(format!("name one after a colon, as in {name}:{first}")));
            }
        };
        let fields = Fields::compile(definition, &paths).map_err(Failure::to)?;
        Ok(ReadMode::Fields { fields, by_header: starts_with_header(definition) })
    }
}

fn names(stream: &Stream) -> impl Iterator<Item = &str> {
    stream.channels.iter().map(|channel| channel.name.as_str())
}

/// Returns the index of the requested channel, given by its name or its number from 0.
fn own_channel(stream: &Stream, wanted: &Wanted) -> Result<Option<usize>, Failure> {
    let Some(channel) = &wanted.channel else { return Ok(None) };
    let named = stream.place_of(channel);
    let place = named.or_else(|| channel.parse().ok());
    place.map(Some).ok_or_else(|| {
        Failure::new(format!("{} has no channel `{channel}`", stream.name))
            .hint(format!("it has {}", names(stream).collect::<Vec<_>>().join(", ")))
    })
}

/// Returns the type of a stream's messages.
fn own_type(stream: &Stream) -> &str {
    match &stream.shape {
        Shape::Message(schema) => &schema.name,
        shape => type_name(shape),
    }
}

fn missing(bag: &Bag, wanted: &Wanted) -> Failure {
    let names = bag.streams().iter().map(|known| known.stream.name.as_str());
    let alike = |name: &&str| strsim::jaro_winkler(name, &wanted.stream);
    let near = names.max_by(|a, b| alike(a).total_cmp(&alike(b)));
    let near = near.filter(|near| is_near(&wanted.stream, near));
    let hint = "`teampulse info` lists the streams of the bag".to_owned();
    Failure::new(format!("{} is not in {}", wanted.stream, bag.path().display()))
        .hint(near.map_or(hint, |near| format!("did you mean {near}?")))
}
