//! One stream, whose samples are handed over until its sender is gone.

use std::sync::Arc;
use std::time::Duration;

use teampulse_core::clock::Stopwatch;
use teampulse_core::data::{Data, Event, EventKind, Wave};
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::Reading;
use teampulse_core::stream::{Shape, StreamId};
use teampulse_core::time::Time;
use teampulse_devices::lsl::{Sample, Values};
use tokio::sync::mpsc;
use tokio::time::sleep;

use super::connection::{Feed, InletError, described};
use super::described::{Kind, kind, stream};
use super::grouping::Grouping;
use super::probing::{Exchange, probe};
use super::resolver::FoundStream;
use super::senders::{RepliedClock, SenderClocks};

/// The time without a reply after which samples are timed by their arrival.
const UNPROBED_AFTER: Duration = Duration::from_secs(3);
/// The time without a reply or samples after which the sender counts as gone.
const SILENT_AFTER: Duration = Duration::from_secs(15);
/// Streams faster than this are read at intervals of `GATHERED`, so that their samples arrive in runs.
const FAST_HZ: f64 = 50.0;
const GATHERED: Duration = Duration::from_millis(8);
/// The largest number of samples held until the clock is known.
const MOST_HELD: usize = 100_000;
/// The largest number of probe results that wait to be processed.
const WAITING: usize = 64;

/// A stream in the session, which remains while its sender is away.
pub(super) struct Inlet {
    person: Option<String>,
    /// The device in the stream's topics.
    device: String,
    clocks: SenderClocks,
    grouping: Option<Grouping>,
    /// The name of the clock that stamps the stream.
    stamped_by: Option<String>,
    /// Whether it has been reported that probes are not answered.
    is_reported: bool,
}

/// A running connection to a stream's sender.
struct Connection<'a> {
    outlet: &'a Outlet,
    stream: StreamId,
    kind: Kind,
    channels: u32,
    period_ns: f64,
    began: Stopwatch,
    /// The clock that replied to the last probe.
    clock: Option<RepliedClock>,
    /// The time since the last reply and since the last samples.
    last_reply: Option<Stopwatch>,
    last_samples: Stopwatch,
    held: Vec<Sample>,
}

impl Inlet {
    pub fn new(person: Option<String>, device: String, clocks: SenderClocks) -> Inlet {
        let (grouping, stamped_by, is_reported) = (None, None, false);
        Inlet { person, device, clocks, grouping, stamped_by, is_reported }
    }

    /// Hands over the samples of a stream until its sender is gone or the session is over.
    pub async fn run(&mut self, found: &FoundStream, outlet: &Outlet) -> Result<(), InletError> {
        let info = described(found).await?;
        let declared = stream(&info, self.person.as_deref(), &self.device);
        let (is_event, name) = (declared.shape == Shape::Event, declared.name.clone());
        let stream = outlet.declare(declared);
        if self.grouping.is_none() && info.rate_hz > 0.0 && !is_event {
            self.grouping = Some(Grouping::new(info.rate_hz));
            // TCP loses nothing, and losses at the sender show in the stamps.
            outlet.lost(stream, 0);
        }
        let (sender, mut exchanges) = mpsc::channel(WAITING);
        // In simulated time, probes of the session's clock are meaningless.
        let is_probed = !outlet.clock().is_settable();
        let probing = async {
            if is_probed {
                // If the queue is full, losing a reply makes no difference.
                let keep = |exchange| {
                    sender.try_send(exchange).ok();
                };
                if let Err(error) =
                    probe(found.address, info.service_port, outlet.clock(), keep).await
                {
                    tracing::warn!("failed to probe the clock of {}: {error}", info.hostname);
                }
            }
            std::future::pending::<()>().await;
        };
        let mut connection = Connection {
            outlet,
            stream,
            kind: kind(&info),
            channels: info.channel_count as u32,
            period_ns: if info.rate_hz > 0.0 { 1e9 / info.rate_hz } else { 0.0 },
            began: Stopwatch::start(),
            clock: None,
            last_reply: None,
            last_samples: Stopwatch::start(),
            held: Vec::new(),
        };
        let mut feed = Feed::open(found).await?;
        let pause = if info.rate_hz > FAST_HZ { GATHERED } else { Duration::ZERO };
        tokio::pin!(probing);
        loop {
            tokio::select! {
                () = &mut probing => {}
                Some(exchange) = exchanges.recv() => self.take_exchange(exchange, &info.hostname, &mut connection),
                samples = feed.next() => {
                    let samples = samples?;
                    if !samples.is_empty() {
                        connection.last_samples = Stopwatch::start();
                        self.take(samples, &mut connection);
                        sleep(pause).await;
                    }
                }
                () = sleep(Duration::from_millis(100)) => {
                    self.take(Vec::new(), &mut connection);
                    if is_probed { self.watch(&name, &connection)?; }
                }
                () = outlet.closed() => return Ok(()),
            }
        }
    }

    /// Reports the result of a probe, and which clock stamps the stream.
    fn take_exchange(
        &mut self,
        exchange: Exchange,
        hostname: &str,
        connection: &mut Connection<'_>,
    ) {
        let clock = self.clocks.replied(hostname, exchange.offset_secs);
        let outlet = connection.outlet;
        if self.stamped_by.as_ref() != Some(&clock.name) {
            outlet.stamped_by(connection.stream, &clock.name);
            if self.stamped_by.replace(clock.name.clone()).is_some() {
                // The new clock's stamps can't be compared with the previous ones.
                self.grouping.iter_mut().for_each(Grouping::forget);
            }
        }
        outlet.probed(&clock.name, exchange.offset_secs, exchange.round_trip_secs);
        connection.clock = Some(clock);
        connection.last_reply = Some(Stopwatch::start());
    }

    /// Returns an error if the sender is gone without having closed its connection.
    fn watch(&mut self, name: &str, connection: &Connection<'_>) -> Result<(), InletError> {
        let is_unprobed = connection.clock.is_none() && connection.began.elapsed() > UNPROBED_AFTER;
        if is_unprobed && !self.is_reported {
            self.is_reported = true;
            connection.outlet.happen(passing(format!(
                "{name}: its sender does not reply to probes of its clock (UDP), so samples are timed by their arrival; open the ports 16572-16603 of its firewall"
            )));
        }
        let silent = |since: &Stopwatch| since.elapsed() > SILENT_AFTER;
        let is_unanswered = connection.last_reply.as_ref().is_some_and(silent)
            || (connection.last_reply.is_none() && connection.kind == Kind::Regular);
        if is_unanswered && silent(&connection.last_samples) {
            Err(InletError::Silent)
        } else {
            Ok(())
        }
    }

    /// Hands samples over, or holds them until the sender's clock is known.
    fn take(&mut self, samples: Vec<Sample>, connection: &mut Connection<'_>) {
        connection.held.extend(samples);
        let is_known = connection.clock.as_ref().is_some_and(RepliedClock::is_known);
        let is_unprobed = connection.clock.is_none()
            && (connection.outlet.clock().is_settable()
                || connection.began.elapsed() > UNPROBED_AFTER);
        let is_full = connection.held.len() > MOST_HELD;
        if connection.held.is_empty() || !(is_known || is_unprobed || is_full) {
            return;
        }
        let samples = std::mem::take(&mut connection.held);
        match (connection.kind, &mut self.grouping) {
            (Kind::Regular, Some(grouping)) => connection.offer_waves(grouping, &samples, is_known),
            (Kind::Markers, _) => connection.offer_markers(&samples, is_known),
            _ => connection.offer_samples(samples, is_known),
        }
    }
}

impl Connection<'_> {
    fn offer_waves(&self, grouping: &mut Grouping, samples: &[Sample], is_known: bool) {
        for run in grouping.group(samples) {
            if run.missing > 0 {
                self.outlet.lost(self.stream, run.missing);
            }
            let (period_ns, channels) = (self.period_ns, self.channels);
            let data = Data::Wave(Wave { period_ns, channels, samples: run.values.into() });
            self.outlet.offer(self.reading(run.stamp_secs, is_known, data));
        }
    }

    fn offer_samples(&self, samples: Vec<Sample>, is_known: bool) {
        let reading = |sample: Sample| match sample.values {
            Values::Numbers(values) => {
                Some(self.reading(sample.stamp_secs, is_known, Data::Sample(values.into())))
            }
            Values::Texts(_) => None,
        };
        self.outlet.offer_together(samples.into_iter().filter_map(reading).collect());
    }

    fn offer_markers(&self, samples: &[Sample], is_known: bool) {
        let reading = |sample: &Sample| {
            let data = Data::Event(Arc::new(marker(&sample.values)));
            self.reading(sample.stamp_secs, is_known, data)
        };
        self.outlet.offer_together(samples.iter().map(reading).collect());
    }

    /// Returns a reading, with the sender's stamp if its clock is known.
    fn reading(&self, stamp_secs: f64, is_known: bool, data: Data) -> Reading {
        let is_sound = is_known && stamp_secs > 0.0 && stamp_secs < 9e9;
        let source_time = is_sound.then(|| Time::from_nanos((stamp_secs * 1e9).round() as i64));
        Reading { stream: self.stream, index: None, device_time: None, source_time, data }
    }
}

/// Returns the marker of a sample, with its texts or numbers as the label.
fn marker(values: &Values) -> Event {
    let (label, value) = match values {
        Values::Texts(texts) => {
            let texts: Vec<&str> =
                texts.iter().map(String::as_str).filter(|text| !text.is_empty()).collect();
            (texts.join(", "), f64::NAN)
        }
        Values::Numbers(numbers) => {
            let label: Vec<String> = numbers.iter().map(f64::to_string).collect();
            (label.join(", "), numbers.first().copied().unwrap_or(f64::NAN))
        }
    };
    Event { kind: EventKind::Marker, label, value, duration_secs: 0.0 }
}
